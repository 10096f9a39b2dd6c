/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Which parameter is which setting of the device.
 *
 * The names, ranges and initial values of the parameters stand in the tables
 * of names; here is only where each goes. A setting that the device takes
 * together with others shares its flag with them.
 */
#include <errno.h>
#include <string.h>
#include "halbridge/wish.h"

#define FROM(member_)	offsetof(struct pokeys_settings, member_)
#define BYTES(member_)	sizeof(((struct pokeys_settings *)0)->member_)
#define VALUE(member_)	.value = offsetof(struct values, set.member_)

/* A whole member; one of `set` says that it is meant. */
#define SET(bit_)	{ .offset = FROM(set), .size = 4, .bits = (bit_) }
#define WHOLE(value_, member_, bit_, unit_)						\
	{ VALUE(value_), .field = { .offset = FROM(member_), .size = BYTES(member_) },	\
	  .flag = SET(bit_), .unit = &(unit_) }
/* ... of which nobody could say what it should be if it is not set. */
#define TOGETHER(value_, member_, bit_)							\
	{ VALUE(value_), .field = { .offset = FROM(member_), .size = BYTES(member_) },	\
	  .flag = SET(bit_), .unit = &wish_plain, .together = true }
#define BITS(value_, member_, bits_, shift_, bit_, unit_)				\
	{ VALUE(value_), .field = { .offset = FROM(member_), .size = 1, .bits = bits_,	\
				    .shift = shift_ },					\
	  .flag = SET(bit_), .unit = &(unit_) }
/* An array of bytes. */
#define LIST(value_, member_, bit_)							\
	{ VALUE(value_), .field = { .offset = FROM(member_), .stride = 1, .size = 1 },	\
	  .flag = SET(bit_), .unit = &wish_plain }

/* Of an encoder. */
#define ENCODER_PLACE(member_, bits_)							\
	{ .offset = FROM(encoder[0].member_), .stride = BYTES(encoder[0]),		\
	  .size = 1, .bits = bits_ }
#define ENCODER_PIN(member_)								\
	{ VALUE(encoder[0].member_), .field = ENCODER_PLACE(member_, 0),		\
	  .flag = ENCODER_PLACE(pins_set, 1), .unit = &wish_plain }

/* Of an axis. */
#define AXIS_PLACE(member_, bits_, shift_)						\
	{ .offset = FROM(axis[0].member_), .stride = BYTES(axis[0]),			\
	  .size = BYTES(axis[0].member_), .bits = bits_, .shift = shift_ }
#define AXIS(value_, member_, set_, form_, unit_)					\
	{ VALUE(axis[0].value_), .field = AXIS_PLACE(member_, 0, 0),			\
	  .flag = AXIS_PLACE(set, POKEYS_AXIS_SET_##set_, 0), .form = form_,		\
	  .unit = &(unit_) }
#define BYTE(value_, member_, set_)	AXIS(value_, member_, set_, WISH_UNSIGNED, wish_plain)
#define NIBBLE(value_, bits_, shift_)							\
	{ VALUE(axis[0].value_), .field = AXIS_PLACE(homing_algorithm, bits_, shift_),	\
	  .flag = AXIS_PLACE(set, POKEYS_AXIS_SET_HOMING_ALGORITHM, 0), .unit = &wish_plain }
#define SIGNAL(value_, bit_)								\
	{ VALUE(axis[0].value_), .field = AXIS_PLACE(signals, 1u << (bit_), bit_),	\
	  .flag = AXIS_PLACE(set, POKEYS_AXIS_SET_SIGNALS, 0), .unit = &wish_plain }
#define BIT(value_, member_, bit_)							\
	{ VALUE(axis[0].value_), .field = AXIS_PLACE(member_, 1u << (bit_), bit_),	\
	  .flag = AXIS_PLACE(member_##_mask, 1u << (bit_), bit_), .unit = &wish_plain }
#define LIMIT(value_, member_, set_, other_, other_set_)				\
	{ VALUE(axis[0].value_), .field = AXIS_PLACE(member_, 0, 0),			\
	  .flag = AXIS_PLACE(set, POKEYS_AXIS_SET_##set_, 0), .form = WISH_SIGNED,	\
	  .mirror = AXIS_PLACE(other_, 0, 0),						\
	  .mirror_flag = AXIS_PLACE(set, POKEYS_AXIS_SET_##other_set_, 0),		\
	  .unit = &wish_length }

static const struct wish_row io_rows[] = {
	{ VALUE(pin_function), .field = { .offset = FROM(pin_function), .stride = 1, .size = 1 },
	  .flag = { .offset = FROM(pin_set) }, .unit = &wish_plain },
	WHOLE(pwm_frequency, pwm_period, POKEYS_SET_PWM_PERIOD, wish_hz),
	WHOLE(analog_filter, analog_filter, POKEYS_SET_ANALOG_FILTER, wish_plain),
	WHOLE(poextbus_connector, poextbus_connector, POKEYS_SET_POEXTBUS, wish_plain),
	WHOLE(poextbus_crc, poextbus_no_crc, POKEYS_SET_POEXTBUS, wish_not),
	WHOLE(matrix.enable, matrix_enable, POKEYS_SET_MATRIX, wish_plain),
	WHOLE(matrix.rows, matrix_rows, POKEYS_SET_MATRIX, wish_plain),
	WHOLE(matrix.columns, matrix_columns, POKEYS_SET_MATRIX, wish_plain),
	LIST(matrix.row_pin, matrix_row_pin, POKEYS_SET_MATRIX),
	LIST(matrix.column_pin, matrix_column_pin, POKEYS_SET_MATRIX),
	WHOLE(failsafe.timeout_ms, failsafe_timeout, POKEYS_SET_FAILSAFE, wish_100ms),
	BITS(failsafe.digital, failsafe_peripherals, 1, 0, POKEYS_SET_FAILSAFE, wish_plain),
	BITS(failsafe.poextbus, failsafe_peripherals, 2, 1, POKEYS_SET_FAILSAFE, wish_plain),
	BITS(failsafe.pwm, failsafe_peripherals, 4, 2, POKEYS_SET_FAILSAFE, wish_plain),
	BITS(failsafe.engine, failsafe_peripherals, 8, 3, POKEYS_SET_FAILSAFE, wish_plain),
	{ VALUE(failsafe.pin), .field = { .offset = FROM(failsafe_outputs) },
	  .flag = SET(POKEYS_SET_FAILSAFE), .unit = &wish_plain },
	LIST(failsafe.bus_byte, failsafe_poextbus, POKEYS_SET_FAILSAFE),
	LIST(failsafe.duty, failsafe_pwm, POKEYS_SET_FAILSAFE),
};

static const struct wish_row encoder_rows[] = {
	{ VALUE(encoder[0].sampling), .field = ENCODER_PLACE(options, 7),
	  .flag = ENCODER_PLACE(options_mask, 7), .unit = &wish_sampling },
	ENCODER_PIN(pin_a),
	ENCODER_PIN(pin_b),
	WHOLE(fast_configuration, fast_configuration, POKEYS_SET_FAST_ENCODERS, wish_fast),
	BITS(fast_index, fast_options, 1, 0, POKEYS_SET_FAST_ENCODERS, wish_plain),
	BITS(fast_4x, fast_options, 16, 4, POKEYS_SET_FAST_ENCODERS, wish_not),
	{ VALUE(fast_invert), .field = { .offset = FROM(fast_options), .shift = 5 },
	  .flag = SET(POKEYS_SET_FAST_ENCODERS), .unit = &wish_plain },
	WHOLE(ultra_enable, ultra_enable, POKEYS_SET_ULTRA_FAST, wish_plain),
	BITS(ultra_invert, ultra_options, 1, 0, POKEYS_SET_ULTRA_FAST, wish_plain),
	BITS(ultra_signal_mode, ultra_options, 2, 1, POKEYS_SET_ULTRA_FAST, wish_plain),
	BITS(ultra_4x, ultra_options, 4, 2, POKEYS_SET_ULTRA_FAST, wish_plain),
	WHOLE(ultra_filter, ultra_filter, POKEYS_SET_ULTRA_FAST, wish_plain),
};

static const struct wish_row engine_rows[] = {
	WHOLE(engine.axes, axes, POKEYS_SET_AXES, wish_plain),
	WHOLE(engine.charge_pump, charge_pump, POKEYS_SET_CHARGE_PUMP, wish_pump),
	BITS(engine.generator, generator, 15, 0, POKEYS_SET_GENERATOR, wish_plain),
	BITS(engine.swap_step_dir, generator, 64, 6, POKEYS_SET_GENERATOR, wish_plain),
	BITS(engine.extended_io, generator, 128, 7, POKEYS_SET_GENERATOR, wish_plain),
	WHOLE(engine.emergency_invert, emergency_invert, POKEYS_SET_EMERGENCY_INVERT, wish_plain),
	WHOLE(engine.emergency_pin, emergency_pin, POKEYS_SET_EMERGENCY_PIN, wish_terminal),
	WHOLE(engine.power_states, power_states, POKEYS_SET_POWER_STATES, wish_power),
	TOGETHER(threading.mode, threading_mode, POKEYS_SET_THREADING),
	TOGETHER(threading.ticks, threading_ticks, POKEYS_SET_THREADING),
	TOGETHER(threading.target_rpm, threading_rpm, POKEYS_SET_THREADING),
	TOGETHER(threading.speed_gain, threading_speed_gain, POKEYS_SET_THREADING),
	TOGETHER(threading.position_gain, threading_position_gain, POKEYS_SET_THREADING),
	TOGETHER(threading.ignore_axes, threading_ignore, POKEYS_SET_THREADING),
};

static const struct wish_row axis_rows[] = {
	BIT(enable, options, 0),
	BIT(invert, options, 1),
	BIT(home_invert, options, 4),
	BIT(soft_limits, options, 5),
	BIT(masked, options, 7),
	{ VALUE(axis[0].mode), .field = AXIS_PLACE(options, 12, 2),
	  .flag = AXIS_PLACE(options_mask, 12, 2), .unit = &wish_mode },
	BIT(limit_neg, switches, 0),
	BIT(limit_pos, switches, 1),
	BIT(home, switches, 2),
	BIT(home_on_limit_neg, switches, 3),
	BIT(home_on_limit_pos, switches, 4),
	BIT(limit_neg_invert, switches, 5),
	BIT(limit_pos_invert, switches, 6),
	BIT(home_switch_invert, switches, 7),
	BYTE(limit_neg_pin, pin_limit_minus, PIN_LIMIT_MINUS),
	BYTE(limit_pos_pin, pin_limit_plus, PIN_LIMIT_PLUS),
	BYTE(home_pin, pin_home, PIN_HOME),
	BYTE(enable_pin, pin_enable, PIN_ENABLE),
	BYTE(enable_invert, invert_enable, INVERT_ENABLE),
	BYTE(limit_neg_filter, filter_limit_minus, FILTER_LIMIT_MINUS),
	BYTE(limit_pos_filter, filter_limit_plus, FILTER_LIMIT_PLUS),
	BYTE(home_filter, filter_home, FILTER_HOME),
	BYTE(probe_filter, filter_probe, FILTER_PROBE),
	NIBBLE(homing_on_switch, 15, 0),
	NIBBLE(homing_off_switch, 240, 4),
	BYTE(homing_speed, homing_speed, HOMING_SPEED),
	BYTE(homing_return_speed, homing_return, HOMING_RETURN),
	BYTE(mpg_encoder, mpg_encoder, MPG_ENCODER),
	AXIS(mpg_multiplier, mpg_multiplier, MPG_MULTIPLIER, WISH_SIGNED, wish_plain),
	AXIS(mpg_divider, mpg_divider, MPG_DIVIDER, WISH_UNSIGNED, wish_plain),
	SIGNAL(step_invert, 0),
	SIGNAL(direction_invert, 1),
	SIGNAL(index_falling, 2),
	AXIS(max_velocity, max_speed, MAX_SPEED, WISH_REAL, wish_speed),
	AXIS(max_acceleration, max_acceleration, MAX_ACCELERATION, WISH_REAL, wish_speed),
	AXIS(max_deceleration, max_deceleration, MAX_DECELERATION, WISH_REAL, wish_speed),
	AXIS(back_off, back_off, BACK_OFF, WISH_SIGNED, wish_length),
	LIMIT(soft_min, soft_minimum, SOFT_MINIMUM, soft_maximum, SOFT_MAXIMUM),
	LIMIT(soft_max, soft_maximum, SOFT_MAXIMUM, soft_minimum, SOFT_MINIMUM),
};

static const struct wish_row drive_rows[] = {
	WHOLE(backlash, backlash_enable, POKEYS_SET_BACKLASH, wish_plain),
	WHOLE(backlash_speed, backlash_speed, POKEYS_SET_BACKLASH_SPEED, wish_plain),
	AXIS(backlash_width, backlash_half, BACKLASH_WIDTH, WISH_UNSIGNED, wish_play),
	AXIS(backlash_acceleration, backlash_acceleration, BACKLASH_ACCELERATION, WISH_UNSIGNED,
	     wish_taking_up),
	WHOLE(postep, postep_enable, POKEYS_SET_POSTEP, wish_plain),
	BYTE(postep_type, postep_type, POSTEP_TYPE),
	BYTE(postep_address, postep_address, POSTEP_ADDRESS),
	BYTE(postep_step, postep_step, POSTEP_STEP),
	BYTE(postep_temperature, postep_temperature, POSTEP_TEMPERATURE),
	WHOLE(sync.pwm_enable, sync_pwm_enable, POKEYS_SET_SYNC_PWM, wish_plain),
	WHOLE(sync.pwm_axis, sync_pwm_axis, POKEYS_SET_SYNC_PWM, wish_plain),
	WHOLE(sync.pwm_channel, sync_pwm_channel, POKEYS_SET_SYNC_PWM, wish_plain),
	WHOLE(sync.out_enable, sync_out_enable, POKEYS_SET_SYNC_OUTPUTS, wish_plain),
	WHOLE(sync.out_axis, sync_out_axis, POKEYS_SET_SYNC_OUTPUTS, wish_plain),
	{ VALUE(sync.out_pin), .field = { .offset = FROM(sync_out_pin), .stride = 1, .size = 1 },
	  .flag = SET(POKEYS_SET_SYNC_OUTPUTS), .unit = &wish_synced },
};

#define GROUP(rows_)	{ rows_, sizeof(rows_) / sizeof(rows_[0]) }

static const struct wish_group groups[] = {
	GROUP(io_rows),   GROUP(encoder_rows), GROUP(engine_rows),
	GROUP(axis_rows), GROUP(drive_rows),
};

static const struct table_row *name_of(size_t value)
{
	for (struct table_cursor at = table_walk(TABLE_ALL); table_next_row(&at);) {
		if (at.row->offset == value && at.row->kind == TABLE_PARAM)
			return at.row;
	}
	return NULL;
}

static int add(struct wish *wish, const struct wish_row *row)
{
	const struct table_row *name = name_of(row->value);
	size_t count = name ? table_row_names(name) : 0;

	if (!count || wish->count + count > WISH_ITEMS)
		return -ENOSPC;
	for (unsigned int i = 0; i < count; i++)
		wish->item[wish->count++] = (struct wish_item){
			.row = row,
			.name = name,
			.index = i,
			.shown = name->initial,
		};
	return 0;
}

int wish_init(struct wish *wish)
{
	int r = 0;

	memset(wish, 0, sizeof(*wish));
	for (size_t g = 0; g < sizeof(groups) / sizeof(groups[0]); g++) {
		for (size_t i = 0; i < groups[g].count && !r; i++)
			r = add(wish, &groups[g].rows[i]);
	}
	return r;
}
