/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pins, digital and analog values, counters, PWM, encoders: protocol sections
 * 3.2 to 3.8.
 *
 * Offsets are written down from there, independently of the layouts in wire/;
 * see vectors.h for how a wrong one shows.
 */

#include "tests/wire/vectors.h"
#include "wire/encoder.h"
#include "wire/io.h"

static void pins_are_where_sections_3_2_and_3_3_say(void **state)
{
	REQ(pin_set, pin_set_req, set);
	REP(pin_set, pin_set_rep, done);
	REQ(pin_get, pin_get_req, get);
	REP(pin_get, pin_get_rep, got);
	REQ(pin_all, pin_all_req, all);
	REP(pin_all, pin_all_rep, all_is);
	REQ(pin_caps, pin_caps_req, caps);
	REP(pin_caps, pin_caps_rep, caps_are);
	REQ(key_map, key_map_req, keys);
	REP(key_map, key_map_rep, keys_are);

	(void)state;
	AT(set.pin, 2);
	AT(set.function, 3);
	AT(set.options, 4);
	AT(done.status, 2);
	AT(get.pin, 2);
	AT(got.pin, 2);
	AT(got.function, 3);
	AT(got.options, 4);
	AT(got.extended, 5);
	AT(all.option1, 2);
	AT(all.option2, 3);
	ATBYTES(all.value, 8);
	AT(all_is.settings, 2);
	ATBYTES(all_is.value, 8);
	AT(caps.range, 2);
	AT32(caps_are.mask[0], 8);
	AT32(caps_are.mask[12], 56);
	AT(keys.option, 2);
	ATBYTES(keys.value, 8);
	ATBYTES(keys_are.value, 8);
}

static void digital_values_are_where_sections_3_3_and_3_4_say(void **state)
{
	REQ(input, input_req, in);
	REP(input, input_rep, in_is);
	REP(inputs_low, inputs_low_rep, low);
	REP(inputs_high, inputs_high_rep, high);
	REQ(output, output_req, out);
	REP(output, output_rep, out_is);
	REQ(outputs_low, outputs_low_req, set_low);
	REQ(outputs_high, outputs_high_req, set_high);
	REQ(io, io_req, io);
	REP(io, io_rep, io_is);

	(void)state;
	AT(in.pin, 2);
	AT(in_is.status, 2);
	AT(in_is.value, 3);
	AT32(low.inputs, 2);
	ATBYTES(high.inputs, 2);
	AT(out.pin, 2);
	AT(out.value, 3);
	AT(out_is.status, 2);
	AT32(set_low.outputs, 2);
	ATBYTES(set_high.outputs, 2);
	AT(io.write, 2);
	AT56(io.outputs, 8);
	assert_int_equal(io.analog_out, BE16(15));
	AT56(io.ignore, 20);
	AT56(io_is.inputs, 8);
	assert_int_equal(io_is.analog[0], BE16(15));
	assert_int_equal(io_is.analog[4], BE16(23));
	ATBYTES(io_is.encoder, 25);
	ATBYTES(io_is.matrix, 50);
	AT32(io_is.ultra, 58);
}

static void analog_values_are_where_section_3_6_says(void **state)
{
	REQ(analog_one, analog_one_req, one);
	REP(analog_one, analog_one_rep, one_is);
	REQ(analog_4x8, analog_4x8_req, four);
	REP(analog_4x8, analog_4x8_rep, four_are);
	REQ(analog_3x10, analog_3x10_req, three);
	REP(analog_3x10, analog_3x10_rep, three_are);
	REP(filter_get, filter_rep, filter);
	REQ(filter_set, filter_set_req, set);
	REQ(analog, analog_req, all);
	REP(analog, analog_rep, all_are);
	REQ(analog_out, analog_out_req, out);
	REP(analog_out, analog_out_rep, out_is);

	(void)state;
	AT(one.pin, 2);
	AT(one_is.status, 2);
	AT(one_is.value8, 3);
	AT(one_is.high, 4);
	AT(one_is.low, 5);
	ATBYTES(four.pin, 2);
	ATBYTES(four_are.value, 2);
	ATBYTES(three.pin, 2);
	ATBYTES(three_are.packed, 2);
	AT32(filter.rc, 2);
	AT32(set.rc, 2);
	AT(all.first, 2);
	AT(all.count, 3);
	assert_int_equal(all_are.value[0], BE16(8));
	assert_int_equal(all_are.value[6], BE16(20));
	AT(out.pin, 2);
	assert_int_equal(out.value, BE16(3));
	AT(out_is.status, 2);
}

static void counters_and_pwm_are_where_sections_3_5_and_3_7_say(void **state)
{
	REQ(counters, counters_req, ask);
	REP(counters, counters_rep, values);
	REQ(counter_dirs, counter_dirs_req, dirs);
	REP(counter_dirs, counter_dirs_rep, dirs_are);
	REQ(pwm, pwm_req, pwm);
	REP(pwm, pwm_rep, pwm_is);

	(void)state;
	ATBYTES(ask.pin, 8);
	AT32(values.value[0], 8);
	AT32(values.value[12], 56);
	AT(dirs.write, 2);
	ATBYTES(dirs.pin, 8);
	ATBYTES(dirs_are.pin, 8);
	AT(pwm.write, 2);
	AT(pwm.duties_only, 3);
	AT(pwm.enabled, 8);
	AT32(pwm.duty[0], 9);
	AT32(pwm.duty[5], 29);
	AT32(pwm.period, 33);
	AT(pwm_is.enabled, 8);
	AT32(pwm_is.duty[0], 9);
	AT32(pwm_is.duty[5], 29);
	AT32(pwm_is.period, 33);
}

static void encoders_are_where_section_3_8_says(void **state)
{
	REQ(encoder_set, encoder_set_req, set);
	REP(encoder_set, encoder_set_rep, done);
	REQ(encoder_get, encoder_get_req, get);
	REP(encoder_get, encoder_get_rep, got);
	REQ(encoder_raw, encoder_raw_req, raw);
	REP(encoder_raw, encoder_raw_rep, raw_is);
	REQ(encoder_options, encoder_options_req, options);
	REP(encoder_options, encoder_options_rep, options_are);
	REQ(encoder_pins, encoder_pins_req, pins);
	REP(encoder_pins, encoder_pins_rep, pins_are);
	REQ(encoder_keys_a, encoder_keys_req, keys);
	REP(encoder_keys_a, encoder_keys_rep, keys_are);

	(void)state;
	AT(set.encoder, 2);
	AT(set.options, 3);
	AT(set.pin_a, 4);
	AT(set.pin_b, 5);
	AT(done.status, 2);
	AT(get.encoder, 2);
	AT(got.encoder, 2);
	AT(got.options, 3);
	AT(got.pin_a, 4);
	AT(got.pin_b, 5);
	AT(raw.encoder, 2);
	AT(raw_is.encoder, 2);
	AT(raw_is.value, 3);
	AT(options.write, 2);
	ATBYTES(options.option, 8);
	ATBYTES(options_are.option, 8);
	AT(pins.write, 2);
	ATBYTES(pins.a, 8);
	ATBYTES(pins.b, 33);
	ATBYTES(pins_are.a, 8);
	ATBYTES(pins_are.b, 33);
	AT(keys.write, 2);
	ATBYTES(keys.code, 8);
	ATBYTES(keys.modifier, 33);
	ATBYTES(keys_are.code, 8);
	ATBYTES(keys_are.modifier, 33);
}

static void fast_encoders_are_where_section_3_8_says(void **state)
{
	REQ(encoders, encoders_req, values);
	REP(encoders, encoders_rep, values_are);
	REQ(fast_encoders, fast_encoders_req, fast);
	REP(fast_encoders, fast_encoders_rep, fast_is);
	REQ(ultra_encoder, ultra_encoder_req, ultra);
	REP(ultra_encoder, ultra_encoder_rep, ultra_is);
	REP(ultra_test, ultra_test_rep, test);

	(void)state;
	AT(values.option, 2);
	AT32(values.value[0], 8);
	AT32(values.value[12], 56);
	AT32(values_are.value[0], 8);
	AT32(values_are.value[12], 56);
	AT(fast.option, 2);
	AT(fast.index, 3);
	AT(fast_is.status, 2);
	AT(fast_is.index, 3);
	AT(ultra.mode, 2);
	AT(ultra.options, 3);
	AT(ultra.reset_on_index, 4);
	AT32(ultra.filter, 8);
	AT(ultra_is.status, 2);
	AT(ultra_is.options, 3);
	AT32(ultra_is.filter, 8);
	AT(ultra_is.status_copy, 12);
	AT(ultra_is.options_copy, 13);
	AT32(test.position, 8);
	AT32(test.index_count, 12);
	AT32(test.ticks, 16);
	AT32(test.speed, 20);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pins_are_where_sections_3_2_and_3_3_say),
		cmocka_unit_test(digital_values_are_where_sections_3_3_and_3_4_say),
		cmocka_unit_test(analog_values_are_where_section_3_6_says),
		cmocka_unit_test(counters_and_pwm_are_where_sections_3_5_and_3_7_say),
		cmocka_unit_test(encoders_are_where_section_3_8_says),
		cmocka_unit_test(fast_encoders_are_where_section_3_8_says),
	};

	return cmocka_run_group_tests(tests, vectors_count, NULL);
}
