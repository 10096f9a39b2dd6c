/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Firmware coding, both generations of device data and both discovery
 * formats (protocol sections 1.9, 2.1, 2.2).
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "wire/model.h"

static void firmware_bytes_are_decoded(void **state)
{
	struct wire_version v = wire_firmware(0x37, 15);

	(void)state;
	assert_int_equal(v.major, 4);
	assert_int_equal(v.minor, 7);
	assert_int_equal(v.revision, 15);
	assert_false(v.boot56);
	v = wire_firmware(0x21, 0);
	assert_int_equal(v.major, 3);
	assert_int_equal(v.minor, 1);
	v = wire_firmware(0x20, 59);
	assert_int_equal(v.major, 3);
	assert_int_equal(v.minor, 0);
	assert_int_equal(v.revision, 59);
	v = wire_firmware(0xA1, 2);
	assert_true(v.boot56);
	assert_int_equal(v.major, 3);
}

static void firmware_coding_is_reversible(void **state)
{
	(void)state;
	for (unsigned int code = 0; code < 256; code++) {
		const struct wire_version v = wire_firmware((uint8_t)code, 0);

		assert_int_equal(wire_firmware_code(&v), code);
	}
}

static void versions_compare_by_major_then_minor_then_revision(void **state)
{
	const struct wire_version v = { .major = 4, .minor = 4, .revision = 7 };

	(void)state;
	assert_true(wire_firmware_at_least(&v, 4, 4, 7));
	assert_true(wire_firmware_at_least(&v, 4, 4, 6));
	assert_true(wire_firmware_at_least(&v, 4, 3, 200));
	assert_true(wire_firmware_at_least(&v, 3, 15, 255));
	assert_false(wire_firmware_at_least(&v, 4, 4, 8));
	assert_false(wire_firmware_at_least(&v, 4, 5, 0));
	assert_false(wire_firmware_at_least(&v, 5, 0, 0));
}

static void a_new_device_is_identified_by_its_extended_block(void **state)
{
	struct wire_device_data_rep data = {
		.serial_low = 111,
		.firmware_old = 0x10,
		.magic = "PKEx",
		.serial = 165432,
		.firmware = 0x37,
		.revision = 15,
		.hardware = 32,
	};
	struct wire_identity id;

	(void)state;
	wire_identify(&data, &id);
	assert_true(id.extended);
	assert_int_equal(id.serial, 165432);
	assert_int_equal(id.firmware.major, 4);
	assert_int_equal(id.hardware, 32);
	assert_string_equal(id.model->name, "PoKeys57CNC");
	assert_int_equal(wire_pulse_version(&id), 2);
	memcpy(data.magic, "PK58", 5);
	wire_identify(&data, &id);
	assert_true(id.extended);
}

static void an_old_device_has_only_the_short_serial_number(void **state)
{
	const struct wire_device_data_rep data = {
		.serial_low = 20111,
		.firmware_old = 0x21,
		.revision_old = 3,
		.serial = 165432,
		.firmware = 0x37,
		.hardware = 32,
	};
	struct wire_identity id;

	(void)state;
	wire_identify(&data, &id);
	assert_false(id.extended);
	assert_int_equal(id.serial, 20111);
	assert_int_equal(id.firmware.major, 3);
	assert_int_equal(id.firmware.minor, 1);
	assert_int_equal(id.firmware.revision, 3);
	assert_int_equal(id.hardware, 0);
	assert_int_equal(wire_pulse_version(&id), 0);
}

static void the_pulse_engine_of_a_56e_depends_on_its_firmware(void **state)
{
	static const struct {
		uint8_t code, revision;
		int version;
	} want[] = { { 0x21, 0, 2 }, { 0x20, 59, 1 }, { 0x20, 58, 0 }, { 0x37, 0, 0 } };
	struct wire_identity id = { .hardware = WIRE_HW_56E, .model = wire_model(WIRE_HW_56E) };

	(void)state;
	for (size_t i = 0; i < sizeof(want) / sizeof(want[0]); i++) {
		id.firmware = wire_firmware(want[i].code, want[i].revision);
		assert_int_equal(wire_pulse_version(&id), want[i].version);
	}
}

static void the_long_name_counts_only_if_it_begins_with_the_short_one(void **state)
{
	struct wire_device_name_rep name = {
		.name = "SimPoKeys5",
		.long_name = "SimPoKeys57CNC-0001",
	};
	char label[21];

	(void)state;
	wire_device_label(&name, label);
	assert_string_equal(label, "SimPoKeys57CNC-0001");
	memcpy(name.long_name, "something else", 15);
	wire_device_label(&name, label);
	assert_string_equal(label, "SimPoKeys5");
	memset(&name, 'x', sizeof(name));
	wire_device_label(&name, label);
	assert_int_equal(strlen(label), 20);
}

static void discovery_tells_its_formats_by_length_alone(void **state)
{
	uint8_t p[64] = { 9,  0x12, 0x34, 0x37, 15,   10,   0,    0,    77, 1,
			  10, 0,    0,    5,    0x78, 0x56, 0x34, 0x12, 33 };
	struct wire_discovery d;

	(void)state;
	for (size_t len = 0; len <= sizeof(p); len++) {
		const bool known = len == 19 || len == 14;

		assert_int_equal(wire_discovery_decode(p, len, &d), known ? WIRE_OK : WIRE_LENGTH);
	}
	assert_int_equal(wire_discovery_decode(p, 19, &d), WIRE_OK);
	assert_false(d.old_format);
	assert_int_equal(d.serial, 0x12345678);
	assert_int_equal(d.hardware, 33);
	assert_int_equal(d.user_id, 9);
	assert_int_equal(d.dhcp, 1);
	assert_int_equal(d.ip[3], 77);
	assert_int_equal(d.host_ip[3], 5);
	assert_int_equal(wire_discovery_decode(p, 14, &d), WIRE_OK);
	assert_true(d.old_format);
	assert_int_equal(d.serial, 0x1234);
	assert_int_equal(d.hardware, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(firmware_bytes_are_decoded),
		cmocka_unit_test(firmware_coding_is_reversible),
		cmocka_unit_test(versions_compare_by_major_then_minor_then_revision),
		cmocka_unit_test(a_new_device_is_identified_by_its_extended_block),
		cmocka_unit_test(an_old_device_has_only_the_short_serial_number),
		cmocka_unit_test(the_pulse_engine_of_a_56e_depends_on_its_firmware),
		cmocka_unit_test(the_long_name_counts_only_if_it_begins_with_the_short_one),
		cmocka_unit_test(discovery_tells_its_formats_by_length_alone),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
