/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Each IN and I/O pin of the canonical names reaches its piece of the command
 * image, each instance its own and no other's, there and back. A pin that is
 * neither in the list below nor tested by a function of its own fails the
 * test.
 */
#include "tests/halbridge/drive.h"

/* What a pressed or special pin has done; true if it is right. */
typedef bool (*consequence)(const struct table_cursor *at, bool pressed);

struct in_driver {
	const char *name; /* of the row */
	uint16_t offset;
	int16_t stride, inner_stride;
	uint8_t size;      /* of the field, 0 = one bit per instance */
	const char *with;  /* the row of a pin that has to be true as well */
	double units, raw; /* what is set, and the field then */
	bool is_float;
	consequence right; /* instead of a field */
};

#define SIZE(field_)	sizeof(((struct pokeys_command *)0)->field_)
#define AT(field_)	.offset = offsetof(struct pokeys_command, field_)
#define BITS(name_, field_)	{ .name = name_, AT(field_), .units = 1, .raw = 1 }
#define EACH(name_, array_, member_, units_, raw_, ...) {			\
	.name = name_, AT(array_[0] member_), .size = SIZE(array_[0] member_),	\
	.stride = SIZE(array_[0]), .units = units_, .raw = raw_, __VA_ARGS__ }
#define BY(name_, function_)	{ .name = name_, .units = 1, .right = function_ }

static struct drive drive;
static struct pokeys_command *const command = &drive.rig.exchange.command;

static bool pressed_once(uint8_t operation, bool pressed)
{
	return !pressed ||
	       (command->one_shot_head == 1 && command->one_shot[0].operation == operation);
}

static bool counters_are_reset(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return pressed_once(POKEYS_ONE_SHOT_RESET_COUNTERS, pressed);
}

static bool fault_is_cleared(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return pressed_once(POKEYS_ONE_SHOT_CLEAR_FAULT, pressed);
}

static bool wheels_are_let_go(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return pressed ? pressed_once(POKEYS_ONE_SHOT_JOG, true) :
			 command->one_shot[1].operation == POKEYS_ONE_SHOT_JOG_END;
}

static bool settings_are_saved(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return pressed_once(POKEYS_ONE_SHOT_SAVE_CONFIG, pressed);
}

static bool joint_is_homed(const struct table_cursor *at, bool pressed)
{
	return pressed_once(POKEYS_ONE_SHOT_HOME, pressed) &&
	       (!pressed || command->one_shot[0].mask == 1u << at->index);
}

static bool homing_is_cancelled(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return pressed_once(POKEYS_ONE_SHOT_HOME_CANCEL, pressed);
}

static bool probing_is_begun(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return pressed_once(POKEYS_ONE_SHOT_PROBE, pressed);
}

static bool probing_is_ended(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return pressed_once(POKEYS_ONE_SHOT_PROBE_FINISH, pressed);
}

/* Each of its buttons is a one-shot; they stand in the order of their operations. */
static bool threading_is_asked(const struct table_cursor *at, bool pressed)
{
	static const char *const buttons[] = { "prepare", "force", "arm", "release", "cancel" };
	uint8_t operation = POKEYS_ONE_SHOT_THREAD_PREPARE;

	for (size_t i = 0; i < sizeof(buttons) / sizeof(buttons[0]); i++) {
		if (!strcmp(at->row->name + strlen("threading."), buttons[i]))
			operation = (uint8_t)(POKEYS_ONE_SHOT_THREAD_PREPARE + i);
	}
	return pressed_once(operation, pressed);
}

/* Seen when the probing begins: tests/halbridge/probe.c. */
static bool target_is_known(const struct table_cursor *at, bool pressed)
{
	return drive.rig.exchange.joint[at->index].target == (pressed ? 400 : 0);
}

static bool index_is_armed(const struct table_cursor *at, bool pressed)
{
	return pressed_once(POKEYS_ONE_SHOT_ARM_INDEX, pressed) &&
	       (!pressed || command->one_shot[0].index == at->index);
}

static bool counter_is_set(const struct table_cursor *at, bool pressed)
{
	return pressed_once(POKEYS_ONE_SHOT_SET_ENCODER, pressed) &&
	       (!pressed || command->one_shot[0].index == at->index);
}

/* Looked at when `set` rises: tests/halbridge/encoder.c. */
static bool value_is_known(const struct table_cursor *at, bool pressed)
{
	return drive.rig.values.encoder[at->index].set_value == pressed;
}

static bool heater_is_reset(const struct table_cursor *at, bool pressed)
{
	return pressed_once(POKEYS_ONE_SHOT_HEATER_RESET, pressed) &&
	       (!pressed || command->one_shot[0].index == at->index);
}

static bool servo_is_reset(const struct table_cursor *at, bool pressed)
{
	return pressed_once(POKEYS_ONE_SHOT_SERVO_RESET, pressed) &&
	       (!pressed || command->one_shot[0].index == at->index);
}

static bool servo_is_homed(const struct table_cursor *at, bool pressed)
{
	return pressed_once(POKEYS_ONE_SHOT_SERVO_HOME, pressed) &&
	       (!pressed || command->one_shot[0].index == at->index);
}

static bool position_is_sent(const struct table_cursor *at, bool pressed)
{
	const double position = command->servo[at->index].position;

	/* NaN is passed on: the daemon makes it a fault */
	return pressed ? position == 1 : position == 0 || isnan(position);
}

static bool velocity_is_sent(const struct table_cursor *at, bool pressed)
{
	const float velocity = command->servo[at->index].velocity;

	return pressed ? velocity == 1 : isnan(velocity);
}

static bool encoder_is_held(const struct table_cursor *at, bool pressed)
{
	drive.rig.daemon.encoder[at->index] += 50;
	drive_periods(&drive, 2);
	return (drive.rig.values.encoder[at->index].count == 0) == pressed;
}

/* The seven together: tests/halbridge/buttons.c sets a clock with them. */
static bool is_a_part_of_the_date(const struct table_cursor *at, bool pressed)
{
	return *(uint32_t *)((uint8_t *)&drive.rig.values + at->offset) == pressed;
}

static bool date_is_judged(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return !pressed || drive.rig.values.rtc.set_outcome == POKEYS_OUTCOME_REFUSED ||
	       drive.rig.exchange.buttons.clock.outcome == POKEYS_OUTCOME_REFUSED;
}

static bool channel_is_enabled(const struct table_cursor *at, bool pressed)
{
	(void)pressed; /* once enabled it stays so, with duty 0 */
	return command->pwm_enable == UINT32_C(1) << at->index;
}

static bool machine_is_on(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return command->flags == (pressed ? POKEYS_COMMAND_MACHINE_ON : 0u);
}

static bool emergency_stops(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return command->flags == (pressed ? POKEYS_COMMAND_EMERGENCY : 0u);
}

/* unhome is true only if LinuxCNC takes the joint for homed. */
static bool it_was_homed(const struct table_cursor *at, bool pressed)
{
	drive.rig.daemon.engine.axis[at->index].position_epoch += 2;
	drive_periods(&drive, 2);
	return drive.rig.values.unhome == pressed;
}

static bool limits_are_overridden(const struct table_cursor *at, bool pressed)
{
	(void)at;
	return command->flags == (pressed ? POKEYS_COMMAND_LIMIT_OVERRIDE : 0u);
}

static void set_pin(const char *name, unsigned int index, double value);

/* Along a path, pos-fb of a joint in buffered mode leaves out the delay. */
static bool path_is_shown(const struct table_cursor *at, bool pressed)
{
	struct pokeys_axis *axis = &drive.rig.daemon.engine.axis[0];

	(void)at;
	set_pin("joint.%02u.enable", 0, 1);
	*axis = (struct pokeys_axis){ .mode = POKEYS_AXIS_BUFFERED, .enabled = 1 };
	drive_periods(&drive, 2); /* it has arrived */
	axis->delayed = 77;
	drive_periods(&drive, 2);
	return (drive.rig.values.joint[0].pos_fb != 0) == pressed;
}

static const struct in_driver drivers[] = {
	BY("motion-type", path_is_shown),
	BY("emergency-stop", emergency_stops),
	BY("joint.%02u.motion-homed", it_was_homed),
	BY("machine-is-on", machine_is_on),
	BY("engine.limit-override", limits_are_overridden),
	BY("engine.clear-fault", fault_is_cleared),
	BY("counter.reset", counters_are_reset),
	BY("joint.%02u.home", joint_is_homed),
	BY("homing.cancel", homing_is_cancelled),
	BY("probe.start", probing_is_begun),
	BY("probe.cancel", probing_is_ended),
	BY("joint.%02u.probe-target", target_is_known),
	BY("threading.prepare", threading_is_asked),
	BY("threading.force", threading_is_asked),
	BY("threading.arm", threading_is_asked),
	BY("threading.release", threading_is_asked),
	BY("threading.cancel", threading_is_asked),
	BY("engine.mpg-jog", wheels_are_let_go),
	BY("config.save", settings_are_saved),
	BY("encoder.%02u.reset", encoder_is_held),
	BY("encoder.%02u.set", counter_is_set),
	BY("encoder.%02u.set-value", value_is_known),
	BY("heater.%02u.reset", heater_is_reset),
	BY("encoder.%02u.index-enable", index_is_armed),
	BY("rtc.set", date_is_judged),
	BY("rtc.set-sec", is_a_part_of_the_date),
	BY("rtc.set-min", is_a_part_of_the_date),
	BY("rtc.set-hour", is_a_part_of_the_date),
	BY("rtc.set-dom", is_a_part_of_the_date),
	BY("rtc.set-month", is_a_part_of_the_date),
	BY("rtc.set-year", is_a_part_of_the_date),
	BITS("pin.%02u.out", digital_out),
	BITS("PoExtBus.%02u.out", poextbus),
	{ .name = "PoRelay8.%02u.relay-%u", AT(poextbus[9]), .units = 1, .raw = 1, .stride = -1 },
	BITS("external.%02u.out", external_outputs),
	BITS("external-relay.%02u.out", relays),
	BITS("kbd48CNC.%02u.LED", kbd48_leds),
	{ .name = "PoNET.%02u.out-%u",
	  AT(ponet_data[0]),
	  .size = 4,
	  .inner_stride = 4,
	  .stride = SIZE(ponet_data[0]),
	  .units = 77777,
	  .raw = 77777 },
	EACH("pwm.%02u.value", pwm_duty, , 0.25, 625, .with = "pwm.%02u.enable"),
	BY("pwm.%02u.enable", channel_is_enabled),
	EACH("heater.%02u.target", heater_target, , 60.5, 60.5, .is_float = true),
	BY("servo.%02u.reset", servo_is_reset),
	BY("servo.%02u.home", servo_is_homed),
	BY("servo.%02u.pos-cmd", position_is_sent),
	BY("servo.%02u.vel-cmd", velocity_is_sent),
	EACH("servo.%02u.enable", servo, .enable, 1, 1),
	EACH("joint.%02u.enable", axis, .enable, 1, 1),
	EACH("joint.%02u.pos-cmd", axis, .position, 12.5, 5000),
	EACH("joint.%02u.vel-cmd", axis, .velocity, 2, 800, .is_float = true),
};

static const struct in_driver *driver_of(const struct table_row *row)
{
	for (size_t i = 0; i < sizeof(drivers) / sizeof(drivers[0]); i++) {
		if (!strcmp(drivers[i].name, row->name))
			return &drivers[i];
	}
	return NULL;
}

/* Everything that is a condition: outputs owned, a PWM period, scales, heaters, servos. */
static void begin(void)
{
	drive_init(&drive, TABLE_LOOPS);
	memset(drive.rig.daemon.digital_out_owned, 0xff, 7);
	drive.rig.daemon.pwm_period = 2500;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		drive.rig.values.joint[i].scale = 400;
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		drive.rig.daemon.heater[i].state = POKEYS_HEATER_OFF;
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		drive.rig.daemon.servo[i].state = POKEYS_SERVO_OFF;
	drive_periods(&drive, 2);
}

static void set_pin(const char *name, unsigned int index, double value)
{
	size_t pin = 0;

	for (struct table_cursor at = table_walk(TABLE_LOOPS); name && table_next(&at);) {
		if (!strcmp(at.row->name, name) && at.index == index)
			drive_set(&drive, at.row, pin, value);
		pin += at.row->kind == TABLE_PIN;
	}
}

static void *field_of(const struct in_driver *driver, const struct table_cursor *at)
{
	int inner = at->row->inner ? at->row->inner : 1;

	return (uint8_t *)command + driver->offset + (int)at->index / inner * driver->stride +
	       (int)at->index % inner * driver->inner_stride;
}

static size_t bit_of(const struct table_cursor *at)
{
	return at->row->inner ? at->index % at->row->inner : at->index;
}

static double field_value(const struct in_driver *driver, const struct table_cursor *at)
{
	uint64_t raw = drive_load(field_of(driver, at), driver->size, bit_of(at));
	uint32_t word = (uint32_t)raw;
	float number;

	memcpy(&number, &word, sizeof(number));
	return driver->is_float ? (double)number : (double)(int64_t)raw;
}

/* The image without what changes anyway, and without masks: those follow the pins. */
static struct pokeys_command without_times(void)
{
	struct pokeys_command image = *command;

	image.heartbeat = image.t_ns = image.t_thread_ns = 0;
	memset(image.read_age_ns, 0, sizeof(image.read_age_ns));
	memset(image.poextbus_mask, 0, sizeof(image.poextbus_mask));
	image.external_outputs_mask = image.relays_mask = image.kbd48_flags = 0;
	image.ponet_mask = image.pwm_enable = 0;
	return image;
}

static void check(const struct in_driver *driver, const struct table_cursor *at, double expected)
{
	if (field_value(driver, at) == expected)
		return;
	fail_msg("%s, %u: %g instead of %g", at->row->name, at->index, field_value(driver, at),
		 expected);
}

/* There and back, and nothing else moves. */
static void move_field(const struct in_driver *driver, const struct table_cursor *at, size_t pin)
{
	uint64_t old = drive_load(field_of(driver, at), driver->size, bit_of(at));
	struct pokeys_command before, after;

	set_pin(driver->with, at->index, 1);
	drive_period(&drive);
	before = without_times();
	drive_set(&drive, at->row, pin, driver->units);
	drive_period(&drive);
	check(driver, at, driver->raw);
	after = without_times();
	drive_store((uint8_t *)&after + ((uint8_t *)field_of(driver, at) - (uint8_t *)command),
		    driver->size, bit_of(at), old);
	assert_memory_equal(&before, &after, sizeof(before));
	drive_set(&drive, at->row, pin, 0);
	drive_period(&drive);
	check(driver, at, 0);
}

static void press(const struct in_driver *driver, const struct table_cursor *at, size_t pin)
{
	begin();
	drive_set(&drive, at->row, pin, driver->units);
	drive_period(&drive);
	if (!driver->right(at, true))
		fail_msg("%s, %u has no effect", at->row->name, at->index);
	drive_set(&drive, at->row, pin, 0);
	drive_period(&drive);
	if (!driver->right(at, false))
		fail_msg("%s, %u does not go back", at->row->name, at->index);
}

static void every_in_pin_reaches_its_piece_of_the_command(void **state)
{
	size_t pin = 0, checked = 0;

	(void)state;
	begin();
	for (struct table_cursor at = table_walk(TABLE_LOOPS); table_next(&at);) {
		const struct in_driver *driver = driver_of(at.row);

		if (at.row->kind != TABLE_PIN)
			continue;
		if (at.row->direction != TABLE_OUT && !driver)
			fail_msg("%s has no driver", at.row->name);
		if (driver && !driver->right) {
			move_field(driver, &at, pin);
			checked++;
		}
		pin++;
	}
	assert_true(checked > 350);
}

static void pins_that_are_pressed_have_their_effect(void **state)
{
	size_t pin = 0;

	(void)state;
	for (struct table_cursor at = table_walk(TABLE_LOOPS); table_next(&at);) {
		const struct in_driver *driver = driver_of(at.row);

		if (at.row->kind == TABLE_PIN && driver && driver->right)
			press(driver, &at, pin);
		pin += at.row->kind == TABLE_PIN;
	}
}

static void no_in_pin_that_is_not_a_number_reaches_the_command(void **state)
{
	static const double bad[] = { (double)NAN, (double)INFINITY, (double)-INFINITY };
	size_t pin = 0;

	(void)state;
	for (struct table_cursor at = table_walk(TABLE_LOOPS); table_next(&at);) {
		const struct in_driver *driver = driver_of(at.row);
		bool concerned = at.row->kind == TABLE_PIN && at.row->direction == TABLE_IN &&
				 at.row->type == TABLE_FLOAT;

		for (size_t i = 0; concerned && i < sizeof(bad) / sizeof(bad[0]); i++) {
			begin();
			set_pin(driver->with, at.index, 1);
			drive_set(&drive, at.row, pin, bad[i]);
			drive_period(&drive);
			if (driver->right)
				assert_true(driver->right(&at, false));
			else
				check(driver, &at, 0);
			assert_true(drive.rig.values.input_refused);
		}
		pin += at.row->kind == TABLE_PIN;
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_in_pin_reaches_its_piece_of_the_command),
		cmocka_unit_test(pins_that_are_pressed_have_their_effect),
		cmocka_unit_test(no_in_pin_that_is_not_a_number_reaches_the_command),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
