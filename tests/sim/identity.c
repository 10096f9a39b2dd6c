// SPDX-License-Identifier: GPL-2.0-or-later
/* Who the device says it is, being searched for, and the password. */
#include "tests/sim/talk.h"
#include "wire/sha1.h"

static struct talk t;

static void start(uint8_t hardware, const char *name)
{
	struct sim_device_options options = {
		.hardware = hardware,
		.serial = 65432,
		.user_id = 7,
		.name = name,
		.ip = { 127, 0, 0, 1 },
	};

	talk_start(&t, hardware);
	sim_device_init(&t.dev, &options);
	sim_device_advance(&t.dev, t.now_ns);
}

static void device_data_has_the_serial_twice_in_both_byte_orders(void **state)
{
	static const uint8_t head[] = { 0xFF, 0x98, 0x37, 0x0F };
	static const uint8_t block[] = {
		'P', 'K', 'E', 'x', 0x98, 0xFF, 0, 0, 0x37, 0x0F, 0x20, 7
	};

	(void)state;
	start(WIRE_HW_57CNC, NULL);
	talk_ask(&t, 0x00, 0, 0);
	assert_memory_equal(t.rp + 2, head, sizeof(head));
	assert_memory_equal(t.rp + 8, block, sizeof(block));
	assert_memory_equal(t.rp + 20, "Mar 14 2025", 11);
	assert_memory_equal(t.rp + 31, "SimPoKeys5", 10);
}

static void the_short_name_begins_the_long_one(void **state)
{
	(void)state;
	start(WIRE_HW_57E_V11, "Lathe by the window");
	talk_ask(&t, 0x06, 0, 0);
	assert_memory_equal(t.rp + 8, "Lathe by t", 10);
	assert_memory_equal(t.rp + 35, "Lathe by the window", 20);
	assert_int_equal(talk_ask(&t, 0x00, 0, 0)[18], 31);
}

static void a_long_name_written_alone_names_the_device_as_well(void **state)
{
	(void)state;
	start(WIRE_HW_57E_V11, "Lathe");
	talk_begin(&t, 0x06, 1, 1, 0, 0);
	memcpy(t.rq + 35, "Mill at the door", 16);
	talk_send(&t);
	talk_ask(&t, 0x06, 0, 0);
	assert_memory_equal(t.rp + 8, "Mill at th", 10);
	assert_memory_equal(t.rp + 35, "Mill at the door\0\0\0\0", 20);
	assert_memory_equal(talk_ask(&t, 0x00, 0, 0) + 31, "Mill at th", 10);
}

static void names_written_together_or_the_short_one_alone_are_kept(void **state)
{
	(void)state;
	start(WIRE_HW_57E_V11, "Lathe");
	talk_begin(&t, 0x06, 1, 1, 0, 0);
	memcpy(t.rq + 8, "Mill", 4);
	memcpy(t.rq + 35, "The mill", 8);
	talk_send(&t);
	talk_ask(&t, 0x06, 0, 0);
	assert_memory_equal(t.rp + 8, "Mill\0\0\0\0\0\0", 10);
	assert_memory_equal(t.rp + 35, "The mill\0", 9);
	talk_begin(&t, 0x06, 1, 0, 0, 0);
	memcpy(t.rq + 8, "Saw", 3);
	talk_send(&t);
	talk_ask(&t, 0x06, 0, 0);
	assert_memory_equal(t.rp + 8, "Saw\0", 4);
	assert_memory_equal(t.rp + 35, "The mill\0", 9);
}

static void build_date_comes_in_parts(void **state)
{
	(void)state;
	start(0, NULL);
	assert_memory_equal(talk_ask(&t, 0x04, 0, 0) + 2, "Mar ", 4);
	assert_memory_equal(talk_ask(&t, 0x04, 1, 0) + 2, "14 2", 4);
	assert_memory_equal(talk_ask(&t, 0x04, 2, 0) + 2, "025", 3);
}

static void user_id_can_be_set(void **state)
{
	(void)state;
	start(0, NULL);
	assert_int_equal(talk_ask(&t, 0x03, 0, 0)[2], 7);
	assert_int_equal(talk_ask(&t, 0x02, 99, 0)[2], 99);
	assert_int_equal(talk_ask(&t, 0x03, 0, 0)[2], 99);
	assert_int_equal(talk_ask(&t, 0x00, 0, 0)[19], 99);
}

static void session_data_is_forgotten_at_a_reboot(void **state)
{
	(void)state;
	start(0, NULL);
	talk_begin(&t, 0x0A, 0x10, 0, 0, 0);
	memcpy(t.rq + 8, "mine alone", 10);
	talk_send(&t);
	talk_ask(&t, 0x0A, 0, 0);
	assert_memory_equal(t.rp + 8, "mine alone", 10);
	talk_ask(&t, 0x50, 0xAA, 0x55);
	talk_ask(&t, 0xF3, 0, 0);
	assert_int_equal(talk_ask(&t, 0x0A, 0, 0)[8], 0);
}

static void tick_counts_milliseconds_since_power_on(void **state)
{
	uint32_t before;

	(void)state;
	start(0, NULL);
	before = wire_get_u32(talk_ask(&t, 0xCF, 0, 0) + 2);
	talk_wait(&t, 1234);
	assert_int_equal(wire_get_u32(talk_ask(&t, 0xCF, 0, 0) + 2), before + 1234);
	talk_ask(&t, 0xF3, 0, 0);
	assert_int_equal(wire_get_u32(talk_ask(&t, 0xCF, 0, 0) + 2), 0);
}

static void load_is_what_the_bench_says(void **state)
{
	(void)state;
	start(0, NULL);
	t.dev.bench.load_percent = 61;
	assert_int_equal(talk_ask(&t, 0x05, 0, 0)[2], 61);
}

static void a_search_is_answered_as_series_57(void **state)
{
	static const uint8_t want[19] = { 7,  0, 0, 0x37, 0x0F, 127,  0, 0, 1,   0,
					  10, 1, 2, 3,    0x98, 0xFF, 0, 0, 0x20 };
	static const uint8_t asker[4] = { 10, 1, 2, 3 };
	uint8_t reply[SIM_DISCOVERY_MAX];

	(void)state;
	start(WIRE_HW_57CNC, NULL);
	assert_int_equal(sim_device_discovery(&t.dev, t.now_ns, asker, reply), 19);
	assert_memory_equal(reply, want, sizeof(want));
}

static void a_56e_answers_in_the_old_format(void **state)
{
	static const uint8_t asker[4] = { 10, 1, 2, 3 };
	uint8_t reply[SIM_DISCOVERY_MAX];

	(void)state;
	start(WIRE_HW_56E, NULL);
	assert_int_equal(sim_device_discovery(&t.dev, t.now_ns, asker, reply), 14);
	assert_int_equal(wire_get_u16be(reply + 1), 65432);
	talk_ask(&t, 0x00, 0, 0);
	assert_int_equal(wire_get_u16be(t.rp + 2), 65432);
	assert_int_equal(t.rp[8], 0);
}

static void searching_can_be_switched_off(void **state)
{
	static const uint8_t asker[4] = { 10, 1, 2, 3 };
	uint8_t reply[SIM_DISCOVERY_MAX];

	(void)state;
	start(0, NULL);
	talk_begin(&t, 0xE0, 10, 0, 0, 0);
	t.rq[28] = 0xA1;
	talk_send(&t);
	assert_int_equal(sim_device_discovery(&t.dev, t.now_ns, asker, reply), 0);
}

static void set_password(const char *password, uint8_t level)
{
	talk_begin(&t, 0xE3, level, 0, 0, 0);
	memcpy(t.rq + 8, password, strlen(password));
	talk_send(&t);
}

/* Tries a password as a host does: SHA-1 of password XOR the seed just read. */
static uint8_t unlock(const char *password)
{
	uint8_t digest[20];

	talk_ask(&t, 0xE1, 0, 0);
	wire_password_hash(password, t.rp + 9, digest);
	talk_begin(&t, 0xE2, 0, 0, 0, 0);
	memcpy(t.rq + 8, digest, sizeof(digest));
	return talk_send(&t)[8];
}

static void the_right_password_unlocks_and_a_wrong_one_does_not(void **state)
{
	(void)state;
	start(0, NULL);
	set_password("open sesame", 0x80);
	sim_device_connected(&t.dev);
	assert_int_equal(talk_ask(&t, 0xE1, 0, 0)[8], 0x80);
	assert_int_equal(unlock("open barley"), 0);
	assert_int_equal(talk_ask(&t, 0xE1, 0, 0)[8], 0x80);
	assert_int_equal(unlock("open sesame"), 0xAA);
	assert_int_equal(talk_ask(&t, 0xE1, 0, 0)[8], 0);
	sim_device_connected(&t.dev);
	assert_int_equal(talk_ask(&t, 0xE1, 0, 0)[8], 0x80);
}

static void an_enforcing_device_refuses_until_unlocked(void **state)
{
	(void)state;
	start(0, NULL);
	t.dev.options.choices.enforce_security = true;
	set_password("pw", 1);
	sim_device_connected(&t.dev);
	talk_begin(&t, 0xCC, 1, 0, 0, 0);
	wire_finish(t.rq, 1);
	assert_int_equal(sim_device_request(&t.dev, t.now_ns, t.rq, 64, t.rp), 0);
	assert_int_equal(t.dev.stats.dropped[SIM_DROP_REFUSED], 1);
	talk_ask(&t, 0x00, 0, 0);
	assert_int_equal(unlock("pw"), 0xAA);
	talk_ask(&t, 0xCC, 0, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(device_data_has_the_serial_twice_in_both_byte_orders),
		cmocka_unit_test(the_short_name_begins_the_long_one),
		cmocka_unit_test(a_long_name_written_alone_names_the_device_as_well),
		cmocka_unit_test(names_written_together_or_the_short_one_alone_are_kept),
		cmocka_unit_test(build_date_comes_in_parts),
		cmocka_unit_test(user_id_can_be_set),
		cmocka_unit_test(session_data_is_forgotten_at_a_reboot),
		cmocka_unit_test(tick_counts_milliseconds_since_power_on),
		cmocka_unit_test(load_is_what_the_bench_says),
		cmocka_unit_test(a_search_is_answered_as_series_57),
		cmocka_unit_test(a_56e_answers_in_the_old_format),
		cmocka_unit_test(searching_can_be_switched_off),
		cmocka_unit_test(the_right_password_unlocks_and_a_wrong_one_does_not),
		cmocka_unit_test(an_enforcing_device_refuses_until_unlocked),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
