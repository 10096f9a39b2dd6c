// SPDX-License-Identifier: GPL-2.0-or-later
/* PoExtBus, PoNET, I2C, 1-Wire, SPI, UART, CAN, sensors, keyboard, display. */
#include "tests/sim/talk.h"

static struct talk t;

static void poextbus_echoes_what_was_written(void **state)
{
	uint8_t data[10] = { 0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8, 0xA9 };

	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xDA, 1, 0, 0, 0);
	memcpy(t.rq + 8, data, sizeof(data));
	talk_send(&t);
	assert_memory_equal(t.rp + 8, data, sizeof(data));
	assert_int_equal(t.rp[2], 1);
	talk_ask(&t, 0xDA, 2, 0);
	assert_memory_equal(t.rp + 8, data, sizeof(data));
	assert_int_equal(talk_ask(&t, 0xDA, 0, 0)[2], 0);
}

/* Column x, row y: byte (x / 2) XOR 1, bit y or 7 - y (section 3.13). */
static void a_keyboard_read_is_started_and_then_fetched(void **state)
{
	(void)state;
	talk_start(&t, 0);
	sim_module_key(&t.dev.bench.bus.module[0], 0, 0, true);
	sim_module_key(&t.dev.bench.bus.module[0], 5, 2, true);
	assert_int_equal(talk_ask(&t, 0xDD, 0x00, 0)[8], 10);
	assert_int_equal(talk_ask(&t, 0xDD, 0x10, 0)[9], 0x10);
	assert_int_equal(talk_ask(&t, 0xDD, 0x50, 0x30)[3], 0);
	talk_begin(&t, 0xDD, 0x50, 0x10, 0, 0);
	assert_int_equal(talk_send(&t)[3], 1);
	assert_int_equal(talk_ask(&t, 0xDD, 0x50, 0x30)[8], 0xFF);
	talk_wait(&t, 3);
	talk_ask(&t, 0xDD, 0x50, 0x30);
	assert_int_equal(t.rp[3], 1);
	assert_int_equal(t.rp[8], 0);
	assert_int_equal(t.rp[9 + 1], 0x80);
	assert_int_equal(t.rp[9 + 3], 0x04);
}

static void an_absent_module_fails(void **state)
{
	(void)state;
	talk_start(&t, 0);
	assert_int_equal(talk_ask(&t, 0xDD, 0x10, 3)[3], 0);
	talk_begin(&t, 0xDD, 0x50, 0x10, 3, 0);
	assert_int_equal(talk_send(&t)[3], 0);
	assert_int_equal(talk_ask(&t, 0xDD, 0x55, 200)[3], 0);
}

static void lamps_and_light(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xDD, 0x55, 0, 0, 0);
	t.rq[8] = 0x81;
	assert_int_equal(talk_send(&t)[3], 1);
	assert_true(sim_module_led(&t.dev, 0, 2, 0));
	assert_true(sim_module_led(&t.dev, 0, 3, 0));
	assert_false(sim_module_led(&t.dev, 0, 0, 0));
	talk_begin(&t, 0xDD, 0x60, 0x10, 0, 0);
	talk_send(&t);
	talk_wait(&t, 3);
	assert_int_equal(talk_ask(&t, 0xDD, 0x60, 0x30)[9], 77);
	talk_begin(&t, 0xDD, 0x70, 0, 200, 0);
	assert_int_equal(talk_send(&t)[3], 1);
	assert_int_equal(t.dev.bus.modules.pwm[0], 200);
}

static void i2c_memory_keeps_what_is_written(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xDB, 0x10, 0x50, 3, 0);
	memcpy(t.rq + 8, "\x20\xDE\xAD", 3);
	talk_send(&t);
	assert_int_equal(talk_ask(&t, 0xDB, 0x11, 0)[3], 0x10);
	talk_wait(&t, 1);
	assert_int_equal(talk_ask(&t, 0xDB, 0x11, 0)[3], 1);
	talk_begin(&t, 0xDB, 0x10, 0x50, 1, 2);
	t.rq[8] = 0x20;
	talk_send(&t);
	talk_wait(&t, 1);
	talk_ask(&t, 0xDB, 0x21, 0);
	assert_int_equal(t.rp[3], 1);
	assert_int_equal(t.rp[9], 2);
	assert_memory_equal(t.rp + 10, "\xDE\xAD", 2);
}

static void i2c_finds_only_what_is_there(void **state)
{
	uint8_t want[16] = { 0 };

	(void)state;
	talk_start(&t, 0);
	want[0x50 / 8] = 1 << (0x50 % 8);
	talk_ask(&t, 0xDB, 0x30, 0);
	assert_int_equal(talk_ask(&t, 0xDB, 0x31, 0)[3], 0x10);
	talk_wait(&t, 10);
	talk_ask(&t, 0xDB, 0x31, 0);
	assert_memory_equal(t.rp + 9, want, sizeof(want));
	talk_begin(&t, 0xDB, 0x20, 0x33, 2, 0);
	talk_send(&t);
	talk_wait(&t, 1);
	assert_int_equal(talk_ask(&t, 0xDB, 0x21, 0)[3], 0);
}

/* As a client does which asks for a result only if the start said that it is under way. */
static void i2c_starts_say_that_the_transfer_is_under_way(void **state)
{
	static const uint8_t starts[] = { 0x10, 0x20, 0x30 };

	(void)state;
	talk_start(&t, 0);
	for (unsigned int i = 0; i < sizeof(starts); i++) {
		talk_begin(&t, 0xDB, starts[i], 0x50, 1, 0);
		assert_int_equal(talk_send(&t)[3], 0x10);
		talk_wait(&t, 10);
		assert_int_equal(talk_ask(&t, 0xDB, starts[i] + 1, 0)[3], 1);
	}
}

static uint8_t dallas_crc(const uint8_t *data, int len)
{
	uint8_t crc = 0;

	while (len--) {
		uint8_t byte = *data++;

		for (int i = 0; i < 8; i++, byte >>= 1)
			crc = (uint8_t)(crc >> 1 ^ ((crc ^ byte) & 1 ? 0x8C : 0));
	}
	return crc;
}

static void the_thermometer_is_found_and_read(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_ask(&t, 0xDC, 0x20, 54);
	assert_int_equal(talk_ask(&t, 0xDC, 0x21, 0)[8], 0x10);
	talk_wait(&t, 10);
	talk_ask(&t, 0xDC, 0x21, 0);
	assert_int_equal(t.rp[9], 3);
	assert_int_equal(t.rp[10], 0x28);
	assert_int_equal(dallas_crc(t.rp + 10, 7), t.rp[17]);

	t.dev.bench.bus.temperature = -8;
	talk_begin(&t, 0xDC, 0x10, 2, 9, 54);
	memcpy(t.rq + 8, "\xCC\xBE", 2);
	talk_send(&t);
	talk_wait(&t, 20);
	talk_ask(&t, 0xDC, 0x11, 0);
	assert_int_equal(t.rp[8], 1);
	assert_int_equal(t.rp[9], 9);
	assert_int_equal((int16_t)wire_get_u16(t.rp + 10), -8);
	assert_int_equal(dallas_crc(t.rp + 10, 8), t.rp[18]);
}

/* The result stands at 3 and at 8; with nothing begun it says whether the bus is on. */
static void assert_onewire(uint8_t op, uint8_t result)
{
	talk_ask(&t, 0xDC, op, 0);
	assert_int_equal(t.rp[3], result);
	assert_int_equal(t.rp[8], result);
}

static void a_one_wire_result_stands_twice_and_tells_whether_the_bus_is_on(void **state)
{
	(void)state;
	talk_start(&t, 0);
	assert_onewire(0x11, 0);
	talk_ask(&t, 0xDC, 0x01, 0);
	assert_onewire(0x11, 1);
	talk_begin(&t, 0xDC, 0x10, 1, 8, 54);
	t.rq[8] = 0x33;
	talk_send(&t);
	assert_onewire(0x11, 0x10);
	talk_wait(&t, 20);
	assert_onewire(0x11, 1);
	assert_int_equal(t.rp[9], 8);
	talk_ask(&t, 0xDC, 0x20, 54);
	assert_onewire(0x21, 0x10);
	talk_wait(&t, 10);
	assert_onewire(0x21, 1);
	talk_ask(&t, 0xDC, 0x00, 0);
	assert_onewire(0x11, 0);
}

static void spi_and_uart_loop_back(void **state)
{
	(void)state;
	talk_start(&t, 0);
	assert_int_equal(talk_ask(&t, 0xE5, 0x01, 3)[3], 0);
	assert_int_equal(talk_ask(&t, 0xE5, 0x01, 50)[3], 1);
	talk_begin(&t, 0xE5, 0x10, 4, 12, 0);
	memcpy(t.rq + 8, "\1\2\3\4", 4);
	assert_int_equal(talk_send(&t)[3], 1);
	assert_memory_equal(talk_ask(&t, 0xE5, 0x20, 4) + 8, "\1\2\3\4", 4);

	talk_begin(&t, 0xDE, 0x20, 2, 5, 0);
	memcpy(t.rq + 8, "hello", 5);
	assert_int_equal(talk_send(&t)[3], 5);
	assert_int_equal(talk_ask(&t, 0xDE, 0x30, 1)[3], 0);
	assert_int_equal(talk_ask(&t, 0xDE, 0x30, 2)[3], 5);
	assert_memory_equal(t.rp + 8, "hello", 5);
	assert_int_equal(talk_ask(&t, 0xDE, 0x30, 2)[3], 0);
}

static void a_uart_takes_no_more_than_fits(void **state)
{
	unsigned int taken = 0;

	(void)state;
	talk_start(&t, 0);
	for (int i = 0; i < 10; i++) {
		talk_begin(&t, 0xDE, 0x20, 1, 55, 0);
		taken += talk_send(&t)[3];
	}
	assert_int_equal(taken, SIM_UART_BYTES);
}

static void send_can(uint32_t id, uint8_t first)
{
	talk_begin(&t, 0x86, 0x20, 0, 0, 0);
	wire_put_u32(t.rq + 8, id);
	t.rq[12] = first;
	t.rq[20] = 1;
	talk_send(&t);
}

static void can_messages_pass_their_filter(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0x86, 0x01, 0, 0, 0);
	wire_put_u32(t.rq + 8, 250000);
	talk_send(&t);
	talk_begin(&t, 0x86, 0x10, 0, 0, 0);
	wire_put_u32(t.rq + 8, 0x108);
	talk_send(&t);
	send_can(0x109, 1);
	send_can(0x108, 2);
	talk_ask(&t, 0x86, 0x31, 0);
	assert_int_equal(t.rp[3], 1);
	assert_int_equal(wire_get_u32(t.rp + 8), 0x108);
	assert_int_equal(t.rp[12], 2);
	assert_int_equal(talk_ask(&t, 0x86, 0x31, 0)[3], 0);
}

static void can_messages_stay_until_confirmed(void **state)
{
	uint8_t last;

	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0x86, 0x01, 0, 0, 0);
	wire_put_u32(t.rq + 8, 250000);
	talk_send(&t);
	for (uint8_t i = 0; i < 5; i++)
		send_can(0x100, i);
	talk_begin(&t, 0x86, 0x30, 0, 0xFF, 0);
	assert_int_equal(talk_send(&t)[3], 3);
	talk_send(&t);
	assert_int_equal(t.rp[8 + 4], 0);
	last = t.rp[4];
	talk_begin(&t, 0x86, 0x30, 0, last, 0);
	assert_int_equal(talk_send(&t)[3], 2);
	assert_int_equal(t.rp[8 + 4], 3);
	talk_begin(&t, 0x86, 0x30, 0, t.rp[4], 0);
	assert_int_equal(talk_send(&t)[3], 0);
}

static void sensors_have_values_once_they_are_set_up(void **state)
{
	(void)state;
	talk_start(&t, 0);
	t.dev.bench.bus.sensor[40] = -123;
	assert_int_equal(talk_ask(&t, 0x77, 40, 3)[4], 0);
	talk_begin(&t, 0x76, 40, 2, 1, 0);
	t.rq[8] = 0x10;
	t.rq[20] = 0x11;
	talk_send(&t);
	t.dev.bench.bus.sensor_ok[41] = false;
	talk_ask(&t, 0x77, 40, 3);
	assert_int_equal(t.rp[4], 1);
	assert_int_equal(wire_get_i32(t.rp + 8), -123);
	assert_int_equal(wire_get_i32(t.rp + 12), 0);
}

static void keys_show_while_the_keyboard_is_on(void **state)
{
	(void)state;
	talk_start(&t, 0);
	t.dev.bench.keys[2] = 0x80;
	assert_int_equal(talk_ask(&t, 0xCA, 20, 0)[8 + 2], 0);
	assert_int_equal(talk_ask(&t, 0xCC, 0, 0)[50 + 2], 0);
	talk_begin(&t, 0xCA, 1, 9, 0, 0);
	t.rq[8] = 1;
	assert_int_equal(talk_send(&t)[2], 9);
	assert_int_equal(talk_ask(&t, 0xCA, 20, 0)[8 + 2], 0x80);
	assert_int_equal(talk_ask(&t, 0xCC, 0, 0)[50 + 2], 0x80);
}

static void the_display_shows_text(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xD1, 0x85, 1, 0, 0);
	memcpy(t.rq + 8, "Hello PoKeys line 1", 19);
	talk_send(&t);
	talk_begin(&t, 0xD1, 0x20, 5, 2, 0);
	talk_send(&t);
	talk_begin(&t, 0xD1, 0x30, 0, 0, 0);
	memcpy(t.rq + 8, "abc", 3);
	talk_send(&t);
	assert_memory_equal(t.dev.panel.text[0], "Hello PoKeys line 1 ", 20);
	assert_memory_equal(t.dev.panel.text[1], "    abc             ", 20);
	talk_ask(&t, 0xD1, 0x10, 0);
	assert_int_equal(t.dev.panel.text[0][0], ' ');
}

static void led_pixels_are_set_one_by_one(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xD6, 1, 0, 0, 0);
	memset(t.rq + 8, 0x01, 8);
	talk_send(&t);
	talk_begin(&t, 0xD6, 5, 3, 7, 0);
	talk_send(&t);
	talk_begin(&t, 0xD6, 16, 0, 0, 0);
	talk_send(&t);
	assert_int_equal(t.dev.panel.led[0][3], 0x81);
	assert_int_equal(t.dev.panel.led[1][0], 0);
	talk_begin(&t, 0xD6, 6, 3, 0, 0);
	talk_send(&t);
	assert_int_equal(t.dev.panel.led[0][3], 0x80);
}

static void poil_memory_is_memory(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0x82, 0x15, 1, 100, 0);
	t.rq[8] = 4;
	memcpy(t.rq + 9, "wxyz", 4);
	talk_send(&t);
	talk_begin(&t, 0x82, 0x10, 1, 101, 0);
	t.rq[8] = 3;
	assert_memory_equal(talk_send(&t) + 8, "xyz", 3);
	talk_begin(&t, 0x82, 0x11, 1, 0, 0);
	memcpy(t.rq + 8, "\x67\0\1\x64\0\1\xFF\xFF", 8);
	assert_memory_equal(talk_send(&t) + 8, "zw", 2);
	/* code: what is in the data memory, moved to page 0 of the flash */
	talk_begin(&t, 0x82, 0x15, 0, 0, 0);
	talk_send(&t);
	talk_begin(&t, 0x82, 0x10, 0, 100, 0);
	t.rq[8] = 4;
	assert_memory_equal(talk_send(&t) + 8, "wxyz", 4);
}

static void poil_has_one_core_and_no_tasks(void **state)
{
	uint8_t nothing[56] = { 0 };

	(void)state;
	talk_start(&t, 0);
	assert_int_equal(talk_ask(&t, 0x82, 0x00, 0)[60], 0);
	talk_ask(&t, 0x82, 0x20, 0);
	assert_int_equal(t.rp[2], 0x20);
	assert_int_equal(t.rp[3], 100);
	assert_memory_equal(t.rp + 8, nothing, sizeof(nothing));
	talk_ask(&t, 0x82, 0x06, 3);
	assert_int_equal(t.rp[2], 0x06);
	assert_int_equal(t.rp[3], 0);
	assert_int_equal(t.dev.stats.unknown, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(poextbus_echoes_what_was_written),
		cmocka_unit_test(a_keyboard_read_is_started_and_then_fetched),
		cmocka_unit_test(an_absent_module_fails),
		cmocka_unit_test(lamps_and_light),
		cmocka_unit_test(i2c_memory_keeps_what_is_written),
		cmocka_unit_test(i2c_finds_only_what_is_there),
		cmocka_unit_test(i2c_starts_say_that_the_transfer_is_under_way),
		cmocka_unit_test(the_thermometer_is_found_and_read),
		cmocka_unit_test(a_one_wire_result_stands_twice_and_tells_whether_the_bus_is_on),
		cmocka_unit_test(spi_and_uart_loop_back),
		cmocka_unit_test(a_uart_takes_no_more_than_fits),
		cmocka_unit_test(can_messages_pass_their_filter),
		cmocka_unit_test(can_messages_stay_until_confirmed),
		cmocka_unit_test(sensors_have_values_once_they_are_set_up),
		cmocka_unit_test(keys_show_while_the_keyboard_is_on),
		cmocka_unit_test(the_display_shows_text),
		cmocka_unit_test(led_pixels_are_set_one_by_one),
		cmocka_unit_test(poil_memory_is_memory),
		cmocka_unit_test(poil_has_one_core_and_no_tasks),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
