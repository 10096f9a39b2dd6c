// SPDX-License-Identifier: GPL-2.0-or-later
/* From a datagram to no reply or to exactly one. */
#include "tests/sim/talk.h"

static struct talk t;

static size_t send_raw(size_t len)
{
	return sim_device_request(&t.dev, t.now_ns, t.rq, len, t.rp);
}

static void good_request(uint8_t op)
{
	talk_begin(&t, op, 0, 0, 0, 0);
	wire_finish(t.rq, 77);
}

static void a_wrong_header_byte_is_dropped(void **state)
{
	(void)state;
	talk_start(&t, 0);
	good_request(0x05);
	t.rq[0] = 0xAA;
	wire_finish(t.rq, 77);
	assert_int_equal(send_raw(64), 0);
	assert_int_equal(t.dev.stats.dropped[SIM_DROP_HEADER], 1);
}

static void a_wrong_checksum_is_dropped(void **state)
{
	(void)state;
	talk_start(&t, 0);
	good_request(0x05);
	t.rq[7]++;
	assert_int_equal(send_raw(64), 0);
	assert_int_equal(t.dev.stats.dropped[SIM_DROP_CHECKSUM], 1);
	assert_int_equal(t.dev.stats.requests, 0);
}

static void the_checksum_does_not_cover_the_payload(void **state)
{
	(void)state;
	talk_start(&t, 0);
	good_request(0x05);
	t.rq[40] = 0x5A;
	t.rq[63] = 0xFF;
	assert_int_equal(send_raw(64), 64);
}

static void any_other_length_is_dropped(void **state)
{
	static uint8_t many[2048];
	unsigned int dropped = 0;

	(void)state;
	talk_start(&t, 0);
	good_request(0x05);
	memcpy(many, t.rq, sizeof(t.rq));
	for (size_t len = 0; len < sizeof(many); len++) {
		if (len == 64 || len == 512)
			continue;
		assert_int_equal(sim_device_request(&t.dev, t.now_ns, many, len, t.rp), 0);
		assert_int_equal(t.dev.stats.dropped[SIM_DROP_LENGTH], ++dropped);
	}
}

static void an_unknown_operation_is_answered_empty(void **state)
{
	uint8_t empty[56] = { 0 };

	(void)state;
	talk_start(&t, 0);
	talk_ask(&t, 0x01, 3, 4);
	assert_memory_equal(t.rp + 8, empty, sizeof(empty));
	assert_int_equal(t.dev.stats.unknown, 1);
	talk_ask(&t, 0x85, 0x77, 0);
	assert_int_equal(t.dev.stats.unknown, 2);
}

static void an_unknown_operation_is_dropped_when_so_chosen(void **state)
{
	(void)state;
	talk_start(&t, 0);
	t.dev.options.choices.drop_unknown = true;
	good_request(0x01);
	assert_int_equal(send_raw(64), 0);
	assert_int_equal(t.dev.stats.dropped[SIM_DROP_UNKNOWN], 1);
}

static void a_repeated_id_is_executed_again(void **state)
{
	(void)state;
	talk_start(&t, 0);
	good_request(0x1D);
	assert_int_equal(send_raw(64), 64);
	assert_int_equal(send_raw(64), 64);
	assert_int_equal(t.dev.stats.executed[0x1D], 2);
}

static void every_execution_is_counted_once(void **state)
{
	(void)state;
	talk_start(&t, 0);
	for (int i = 0; i < 5; i++)
		talk_ask(&t, 0x85, 0x03, 0);
	talk_ask(&t, 0x85, 0x00, 0);
	assert_int_equal(t.dev.stats.executed[0x85], 6);
	assert_int_equal(t.dev.stats.executed_pe[0x03], 5);
	assert_int_equal(t.dev.stats.executed_pe[0x00], 1);
}

static void led_strip_data_has_no_reply(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0x4B, 0x10, 5, 0, 1);
	t.rq[8] = 0x11;
	wire_finish(t.rq, 1);
	assert_int_equal(send_raw(64), 0);
	assert_int_equal(t.dev.stats.dropped[SIM_DROP_SILENT], 1);
	assert_int_equal(t.dev.bus.strip[5][0], 0x11);
}

static void a_booting_device_is_silent(void **state)
{
	(void)state;
	talk_start(&t, 0);
	t.dev.options.boot_ms = 250;
	talk_ask(&t, 0xF3, 0, 0);
	good_request(0x05);
	assert_int_equal(send_raw(64), 0);
	talk_wait(&t, 249);
	assert_int_equal(send_raw(64), 0);
	talk_wait(&t, 1);
	assert_int_equal(send_raw(64), 64);
	assert_int_equal(t.dev.stats.dropped[SIM_DROP_BOOTING], 2);
}

static void a_model_lacks_what_its_hardware_lacks(void **state)
{
	(void)state;
	talk_start(&t, WIRE_HW_57CNCDB25);
	talk_ask(&t, 0xD0, 1, 0);
	talk_ask(&t, 0x3A, 0, 0);
	assert_int_equal(t.dev.stats.unknown, 2);
	talk_start(&t, WIRE_HW_57E_V11);
	talk_ask(&t, 0xD0, 1, 0);
	talk_ask(&t, 0x3A, 0, 0);
	assert_int_equal(t.dev.stats.unknown, 0);
}

/* No request at all, however odd, may harm the device; ids always come back. */
static void all_operations_with_all_parameters_are_answered_well(void **state)
{
	(void)state;
	talk_start(&t, 0);
	for (unsigned int op = 0; op < 256; op++) {
		for (unsigned int p1 = 0; p1 < 256; p1++) {
			for (unsigned int fill = 0; fill < 256; fill += 85) {
				talk_begin(&t, (uint8_t)op, (uint8_t)p1, (uint8_t)fill,
					   (uint8_t)fill, (uint8_t)fill);
				memset(t.rq + 8, (int)fill, 56);
				if ((op == 0x4B && p1 == 0x10) || op == 0xB0)
					continue;
				talk_send(&t);
			}
		}
		talk_wait(&t, 3);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_wrong_header_byte_is_dropped),
		cmocka_unit_test(a_wrong_checksum_is_dropped),
		cmocka_unit_test(the_checksum_does_not_cover_the_payload),
		cmocka_unit_test(any_other_length_is_dropped),
		cmocka_unit_test(an_unknown_operation_is_answered_empty),
		cmocka_unit_test(an_unknown_operation_is_dropped_when_so_chosen),
		cmocka_unit_test(a_repeated_id_is_executed_again),
		cmocka_unit_test(every_execution_is_counted_once),
		cmocka_unit_test(led_strip_data_has_no_reply),
		cmocka_unit_test(a_booting_device_is_silent),
		cmocka_unit_test(a_model_lacks_what_its_hardware_lacks),
		cmocka_unit_test(all_operations_with_all_parameters_are_answered_well),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
