// SPDX-License-Identifier: GPL-2.0-or-later
/* Pins, counters, analog inputs, PWM. Pins count from 0 here. */
#include "tests/sim/talk.h"

#include "sim/bench.h"

static struct talk t;

static void set_pin(uint8_t pin, uint8_t function, uint8_t options)
{
	talk_begin(&t, 0x10, pin, function, options, 0);
	assert_int_equal(talk_send(&t)[2], 0);
}

static uint64_t inputs(void)
{
	return wire_get_u56(talk_ask(&t, 0xCC, 0, 0) + 8);
}

static void write_outputs(uint64_t values, uint64_t ignore)
{
	talk_begin(&t, 0xCC, 1, 0, 0, 0);
	wire_put_u56(t.rq + 8, values);
	wire_put_u56(t.rq + 20, ignore);
	talk_send(&t);
}

static void an_input_reads_its_level(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(2, 0x02, 0);
	set_pin(3, 0x82, 0);
	assert_int_equal(inputs(), 0x04);
	sim_bench_pin(&t.dev, 2, 0);
	sim_bench_pin(&t.dev, 3, 0);
	assert_int_equal(inputs(), 0x08);
	assert_int_equal(talk_ask(&t, 0x30, 3, 0)[3], 1);
	assert_int_equal(talk_ask(&t, 0x30, 2, 0)[3], 0);
	assert_int_equal(talk_ask(&t, 0x30, 55, 0)[2], 1);
	assert_int_equal(wire_get_u32(talk_ask(&t, 0x31, 0, 0) + 2), 0x08);
}

static void only_outputs_are_written(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(30, 0x04, 0);
	set_pin(54, 0x04, 0);
	write_outputs(UINT64_MAX, 0);
	assert_int_equal(inputs(), UINT64_C(1) << 30 | UINT64_C(1) << 54);
	assert_int_equal(t.dev.pins.latch, UINT64_C(1) << 30 | UINT64_C(1) << 54);
	assert_int_equal(talk_ask(&t, 0x40, 5, 1)[2], 1);
	assert_int_equal(wire_get_u16(talk_ask(&t, 0x32, 0, 0) + 2), 0);
	assert_int_equal(t.rp[4], 0x40);
}

static void the_ignore_mask_leaves_outputs_alone(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(8, 0x04, 0);
	set_pin(9, 0x04, 0);
	write_outputs(0x300, 0);
	write_outputs(0, 0x200);
	assert_int_equal(t.dev.pins.latch, 0x200);
	talk_begin(&t, 0xCC, 0, 0, 0, 0);
	wire_put_u56(t.rq + 8, UINT64_MAX);
	talk_send(&t);
	assert_int_equal(t.dev.pins.latch, 0x200);
}

static void block_and_single_writes_agree(void **state)
{
	(void)state;
	talk_start(&t, 0);
	for (uint8_t pin = 0; pin < 55; pin++)
		set_pin(pin, 0x04, 0);
	talk_begin(&t, 0x42, 0x01, 0x00, 0x00, 0x80);
	talk_send(&t);
	talk_begin(&t, 0x43, 0x02, 0x00, 0x40, 0);
	talk_send(&t);
	assert_int_equal(t.dev.pins.latch,
			 UINT64_C(1) | UINT64_C(1) << 31 | UINT64_C(1) << 33 | UINT64_C(1) << 54);
	talk_ask(&t, 0x40, 0, 0);
	talk_ask(&t, 0x40, 1, 1);
	assert_int_equal(inputs() & 3, 2);
}

/* The sheet's odd rule: not inverted, writing 0 drives the pin high. */
static void an_output_drives_its_pin_by_its_polarity(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(20, 0x04, 0);
	set_pin(21, 0x84, 0);
	write_outputs(0, 0);
	assert_int_equal(sim_pin_level(&t.dev, 20), 1);
	assert_int_equal(sim_pin_level(&t.dev, 21), 0);
	write_outputs(UINT64_C(3) << 20, 0);
	assert_int_equal(sim_pin_level(&t.dev, 20), 0);
	assert_int_equal(sim_pin_level(&t.dev, 21), 1);
}

static void a_wire_leads_an_output_to_an_input(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(20, 0x84, 0);
	set_pin(5, 0x02, 0);
	sim_bench_wire(&t.dev, 20, 5);
	write_outputs(UINT64_C(1) << 20, 0);
	assert_int_equal(inputs() >> 5 & 1, 1);
	write_outputs(0, 0);
	assert_int_equal(inputs() >> 5 & 1, 0);
	sim_bench_wire(&t.dev, SIM_NO_PIN, 5);
	assert_int_equal(inputs() >> 5 & 1, 1);
}

static void a_ring_of_wires_floats_high(void **state)
{
	(void)state;
	talk_start(&t, 0);
	sim_bench_wire(&t.dev, 1, 2);
	sim_bench_wire(&t.dev, 2, 1);
	assert_int_equal(sim_pin_level(&t.dev, 1), 1);
}

static void startup_outputs_are_there_after_a_reboot(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(8, 0x04, 0);
	talk_begin(&t, 0x1E, 1, 1, 1, 0);
	t.rq[9] = 0x01;
	talk_send(&t);
	talk_ask(&t, 0x50, 0xAA, 0x55);
	talk_ask(&t, 0xF3, 0, 0);
	assert_int_equal(inputs(), 0x100);
}

static uint32_t counter(uint8_t pin)
{
	talk_begin(&t, 0xD8, 0, 0, 0, 0);
	t.rq[8] = 7;
	t.rq[9] = pin;
	talk_send(&t);
	return wire_get_u32(t.rp + 12);
}

static void pulse(unsigned int pin, unsigned int count)
{
	while (count--) {
		sim_bench_pin(&t.dev, pin, 0);
		sim_bench_pin(&t.dev, pin, 1);
	}
}

static void counters_count_the_edges_they_are_told_to(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(0, 0x42, 0x01);
	set_pin(1, 0x42, 0x02);
	set_pin(2, 0x42, 0x03);
	set_pin(3, 0x02, 0x03);
	for (unsigned int pin = 0; pin < 4; pin++)
		pulse(pin, 5);
	sim_bench_pin(&t.dev, 1, 0);
	assert_int_equal(counter(0), 5);
	assert_int_equal(counter(1), 6);
	assert_int_equal(counter(2), 10);
	assert_int_equal(counter(3), 0);
	talk_ask(&t, 0x1D, 0, 0);
	assert_int_equal(counter(2), 0);
}

static void a_counter_runs_down_while_its_direction_pin_is_high(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(4, 0x42, 0x01);
	talk_begin(&t, 0xD9, 1, 0, 0, 0);
	t.rq[8 + 4] = 9;
	talk_send(&t);
	pulse(4, 3);
	assert_int_equal(counter(4), (uint32_t)-3);
	sim_bench_pin(&t.dev, 9, 0);
	pulse(4, 5);
	assert_int_equal(counter(4), 2);
}

static void an_output_wired_to_a_counter_is_counted(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_pin(20, 0x04, 0);
	set_pin(0, 0x42, 0x01);
	sim_bench_wire(&t.dev, 20, 0);
	for (int i = 0; i < 7; i++) {
		write_outputs(UINT64_C(1) << 20, 0);
		write_outputs(0, 0);
	}
	assert_int_equal(counter(0), 7);
}

static void analog_values_are_big_endian_and_from_pin_41_on(void **state)
{
	(void)state;
	talk_start(&t, WIRE_HW_57E_V11);
	for (uint8_t i = 0; i < 7; i++) {
		set_pin((uint8_t)(40 + i), 0x08, 0);
		t.dev.bench.analog[i].low = (uint16_t)(0x0123 + 0x100 * i);
	}
	talk_ask(&t, 0x3A, 1, 0);
	assert_int_equal(t.rp[8], 0x01);
	assert_int_equal(t.rp[9], 0x23);
	for (unsigned int i = 0; i < 7; i++)
		assert_int_equal(wire_get_u16be(t.rp + 8 + 2 * i), 0x0123 + 0x100 * i);
	talk_ask(&t, 0xCC, 0, 0);
	for (unsigned int i = 0; i < 5; i++)
		assert_int_equal(wire_get_u16be(t.rp + 15 + 2 * i), 0x0323 + 0x100 * i);
	talk_ask(&t, 0x35, 42, 0);
	assert_int_equal(t.rp[2], 0);
	assert_int_equal(t.rp[4] << 8 | t.rp[5], 0x0323);
	assert_int_equal(talk_ask(&t, 0x35, 39, 0)[2], 1);
}

static void a_pin_which_is_no_analog_input_reads_nothing(void **state)
{
	(void)state;
	talk_start(&t, 0);
	t.dev.bench.analog[0].low = 4000;
	assert_int_equal(wire_get_u16be(talk_ask(&t, 0x3A, 0, 0) + 8), 0);
	set_pin(40, 0x08, 0);
	assert_int_equal(wire_get_u16be(talk_ask(&t, 0x3A, 0, 0) + 8), 4000);
}

/* After n samples of a step the filter is at 1 - (RC / (RC + 1))^n. */
static void the_rc_filter_slows_a_step(void **state)
{
	uint16_t value;

	(void)state;
	talk_start(&t, 0);
	set_pin(40, 0x08, 0);
	talk_begin(&t, 0x39, 99, 0, 0, 0);
	talk_send(&t);
	t.dev.bench.analog[0].low = 4000;
	talk_wait(&t, 100);
	value = wire_get_u16be(talk_ask(&t, 0x3A, 0, 0) + 8);
	assert_in_range(value, 4000 * 0.633, 4000 * 0.635);
	talk_wait(&t, 2000);
	assert_in_range(wire_get_u16be(talk_ask(&t, 0x3A, 0, 0) + 8), 3999, 4000);
}

static void a_duty_update_leaves_period_and_channels(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xCB, 1, 0, 0, 0);
	t.rq[8] = 0x24;
	wire_put_u32(t.rq + 9, 100);
	wire_put_u32(t.rq + 33, 2500);
	talk_send(&t);
	talk_begin(&t, 0xCB, 1, 1, 0, 0);
	wire_put_u32(t.rq + 9, 700);
	talk_send(&t);
	talk_ask(&t, 0xCB, 0, 0);
	assert_int_equal(t.rp[8], 0x24);
	assert_int_equal(wire_get_u32(t.rp + 9), 700);
	assert_int_equal(wire_get_u32(t.rp + 33), 2500);
}

static void a_pulse_train_ends_by_itself(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0x4C, 0x00, 0, 0, 0);
	t.rq[8] = 3;
	wire_put_u16(t.rq + 9, 100);
	wire_put_u16(t.rq + 11, 5);
	talk_send(&t);
	assert_int_equal(talk_ask(&t, 0x4C, 0x10, 0)[8 + 2], 1);
	talk_wait(&t, 49);
	assert_int_equal(talk_ask(&t, 0x4C, 0x10, 0)[8 + 2], 1);
	talk_wait(&t, 2);
	assert_int_equal(talk_ask(&t, 0x4C, 0x10, 0)[8 + 2], 0);
}

static void pin_capabilities_follow_the_model(void **state)
{
	(void)state;
	talk_start(&t, WIRE_HW_57CNC);
	talk_ask(&t, 0x1F, 0, 0);
	assert_true(wire_get_u32(t.rp + 8) & 0x02);
	assert_int_equal(wire_get_u32(t.rp + 8 + 4 * 6), 0);
	talk_start(&t, WIRE_HW_57E_V11);
	talk_ask(&t, 0x1F, 0, 0);
	assert_true(wire_get_u32(t.rp + 8 + 4 * 6) & 0x02);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_input_reads_its_level),
		cmocka_unit_test(only_outputs_are_written),
		cmocka_unit_test(the_ignore_mask_leaves_outputs_alone),
		cmocka_unit_test(block_and_single_writes_agree),
		cmocka_unit_test(an_output_drives_its_pin_by_its_polarity),
		cmocka_unit_test(a_wire_leads_an_output_to_an_input),
		cmocka_unit_test(a_ring_of_wires_floats_high),
		cmocka_unit_test(startup_outputs_are_there_after_a_reboot),
		cmocka_unit_test(counters_count_the_edges_they_are_told_to),
		cmocka_unit_test(a_counter_runs_down_while_its_direction_pin_is_high),
		cmocka_unit_test(an_output_wired_to_a_counter_is_counted),
		cmocka_unit_test(analog_values_are_big_endian_and_from_pin_41_on),
		cmocka_unit_test(a_pin_which_is_no_analog_input_reads_nothing),
		cmocka_unit_test(the_rc_filter_slows_a_step),
		cmocka_unit_test(a_duty_update_leaves_period_and_channels),
		cmocka_unit_test(a_pulse_train_ends_by_itself),
		cmocka_unit_test(pin_capabilities_follow_the_model),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
