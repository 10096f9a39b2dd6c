/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Each OUT pin of the canonical names shows the piece of the state image it
 * is of, each instance its own, there and back. A pin that is neither in the
 * list below nor driven by a function of its own fails the test: there is no
 * pin without one.
 */
#include "tests/halbridge/drive.h"

struct out_driver {
	const char *name; /* of the row */
	uint16_t offset, stride, inner_stride;
	uint8_t size; /* of the field, 0 = one bit per instance */
	uint8_t bit;  /* the first one */
	bool inverse, is_float;
	double factor;                  /* pin = field * factor; 0 = 1 */
	void (*drive)(struct rig *rig); /* instead of a field: makes the pin 1 or more */
};

#define SIZE(field_)	sizeof(((struct pokeys_state *)0)->field_)
#define AT(field_)	.offset = offsetof(struct pokeys_state, field_)
#define FIELD(name_, field_)	{ .name = name_, AT(field_), .size = SIZE(field_) }
#define SCALED(name_, field_, factor_) \
	{ .name = name_, AT(field_), .size = SIZE(field_), .factor = factor_ }
#define EACH(name_, array_, member_) {						\
	.name = name_, AT(array_[0] member_), .size = SIZE(array_[0] member_),	\
	.stride = SIZE(array_[0]) }
#define BITS(name_, field_, bit_)	{ .name = name_, AT(field_), .bit = bit_ }
#define NOT(name_, field_)		{ .name = name_, AT(field_), .inverse = true }
#define BY(name_, function_)		{ .name = name_, .drive = function_ }
#define DRIVER(name_, member_)		EACH("joint.%02u.postep." name_, postep, member_)
#define AXIS(name_, member_)		EACH("joint.%02u." name_, engine.axis, member_)
#define MODULE(name_, member_)		EACH("PoNET.%02u." name_, ponet, member_)
#define CLOCK(name_, member_)		FIELD("rtc." name_, rtc.member_)
#define INFO(name_, member_)		FIELD("info." name_, capability.member_)
#define COUNT(name_, member_)		FIELD(name_, statistics.member_)
#define RATE(name_, group_) \
	SCALED("rate." name_, slow_millihertz[POKEYS_SLOW_##group_], 1e-3)

static void silence(struct rig *rig)
{
	rig->device_silent = true;
	rig->now_ns += 100 * RIG_MS;
}

static void nothing(struct rig *rig)
{
	(void)rig;
}

static void lose_packets(struct rig *rig)
{
	rig->daemon.statistics.missed += 3;
}

static void lose_many(struct rig *rig)
{
	rig->values.packet_error_increment = 10;
	lose_packets(rig);
}

static void set_bad_scale(struct rig *rig)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		rig->values.joint[i].scale = 0;
}

static void fill_the_queue(struct rig *rig)
{
	const struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_NOP };
	uint32_t id;

	while (one_shot_push(&rig->exchange.queue, &rig->exchange.command, &shot, &id) ==
	       ONE_SHOT_QUEUED)
		;
	rig->exchange.buttons.fault.state = PRESS_WAITING;
}

static void be_in_emergency(struct rig *rig)
{
	rig->daemon.engine.emergency = 1;
}

static void be_slow(struct rig *rig)
{
	rig->values.time_exceeded_count = 5;
}

static void do_not_read(struct rig *rig)
{
	rig->unread = true;
}

static void fail_a_one_shot(struct rig *rig)
{
	rig->values.one_shot_failed_count += press_forget(&(struct press){ .state = PRESS_QUEUED });
}

static void turn_and_stop(struct rig *rig)
{
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		rig->daemon.encoder[i] += 1000;
}

static void turn(struct rig *rig)
{
	for (unsigned int k = 0; k < 4; k++) {
		turn_and_stop(rig);
		rig_period(rig);
	}
}

static void stand_at_the_command(struct rig *rig)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		rig->daemon.engine.axis[i].in_position = 1;
}

static void home_all(struct rig *rig)
{
	rig->daemon.engine.task = POKEYS_TASK_HOMING;
	rig->daemon.engine.task_phase = POKEYS_TASK_WORKING;
	rig->daemon.engine.task_axes = 0xff;
}

static void fail_to_home(struct rig *rig)
{
	rig->exchange.home.error = POKEYS_TASK_TRIPPED;
	home_all(rig);
}

static void probe_something(struct rig *rig)
{
	rig->exchange.probe.done = true;
	rig->exchange.probe.error = POKEYS_TASK_TRIPPED;
	rig->daemon.engine.task = POKEYS_TASK_PROBING;
	rig->daemon.engine.task_phase = POKEYS_TASK_WORKING;
	rig->daemon.engine.state = 30;
}

static void refuse_a_thread(struct rig *rig)
{
	rig->exchange.threading.reason = POKEYS_THREADING_MOVING;
	rig->exchange.threading.error = POKEYS_TASK_STARVED;
	rig->daemon.threading.index_count++;
}

static struct drive drive;

static void begin_another_count(struct rig *rig)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		rig->daemon.engine.axis[i].position_epoch += 2;
}

static void restart_the_counters(struct rig *rig)
{
	rig->daemon.encoder_enabled = UINT32_MAX;
	rig->daemon.encoder_epoch++;
}

static void begin_one_while_homed(struct rig *rig)
{
	size_t pin = 0;

	for (struct table_cursor at = table_walk(TABLE_LOOPS); table_next(&at);) {
		if (!strcmp(at.row->name, "joint.%02u.motion-homed"))
			drive_set(&drive, at.row, pin, 1);
		pin += at.row->kind == TABLE_PIN;
	}
	drive_period(&drive);
	begin_another_count(rig);
}

static void attach_a_keyboard(struct rig *rig)
{
	rig->daemon.kbd48_module = 3;
	rig->daemon.ponet[3].type = 16;
	rig->daemon.ponet[3].light = 7;
}

static void attach_modules(struct rig *rig)
{
	for (unsigned int i = 0; i < POKEYS_PONET; i++)
		rig->daemon.ponet[i].type = 1;
}

static void ask_for_light(struct rig *rig)
{
	rig->values.kbd48.brightness = 9;
}

static void press_the_clock(struct rig *rig)
{
	rig->exchange.buttons.clock.outcome = POKEYS_OUTCOME_DONE;
}

static void pulse_engine_1(struct rig *rig)
{
	rig->daemon.capability.pulse_engine = 1;
}

static void pulse_engine_2(struct rig *rig)
{
	rig->daemon.capability.pulse_engine = 2;
}

static void set_pwm(struct rig *rig)
{
	rig->daemon.pwm_period = 2500;
	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		rig->daemon.pwm_duty[i] = 2500;
}

static void lock(struct rig *rig)
{
	rig->daemon.phase.state = POKEYS_PHASE_LOCKED;
}

static void be_late(struct rig *rig)
{
	struct value_diagnostics *value = &rig->values.diagnostics;

	value->wakeup = value->round_trip = value->data = value->age = (struct value_latency){ 7,
											       9 };
	value->cycles_skipped = 3;
}

static void refuse_a_setting(struct rig *rig)
{
	rig->values.diagnostics.config_generation = 5;
	rig->values.diagnostics.config_input_refused = 5;
	rig->values.diagnostics.config_refused = 5;
	rig->values.diagnostics.config_refused_index = 5;
}

static void talk_to_drivers(struct rig *rig)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		rig->daemon.postep[i].t_update_ns = rig->now_ns - 5 * RIG_MS;
}

#define HEATER(name_, member_, ...) {						\
	.name = "heater.%02u." name_, AT(heater[0] member_),			\
	.size = SIZE(heater[0] member_), .stride = SIZE(heater[0]), __VA_ARGS__ }
#define SERVO(name_, member_, ...) {						\
	.name = "servo.%02u." name_, AT(servo[0] member_),			\
	.size = SIZE(servo[0] member_), .stride = SIZE(servo[0]), __VA_ARGS__ }

static void enable_motors(struct rig *rig)
{
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		rig->daemon.servo[i].state = POKEYS_SERVO_ENABLED;
}

static const struct out_driver drivers[] = {
	BY("connected", nothing),
	BY("stale", silence),
	BY("daemon-alive", nothing),
	BY("attach-state", nothing),
	BY("cycle", nothing),
	BY("age-us", nothing),
	FIELD("link-state", link),
	FIELD("fault", fault),
	FIELD("fault-count", fault_count),
	COUNT("reconnects", reconnects),
	SCALED("rtt-us", statistics.rtt_last_ns, 1e-3),
	SCALED("rtt-avg-us", statistics.rtt_smoothed_ns, 1e-3),
	SCALED("rtt-max-us", statistics.rtt_max_ns, 1e-3),
	SCALED("rtt-jitter-us", statistics.rtt_variation_ns, 1e-3),
	SCALED("phase-error-us", phase.error_ns, 1e-3),
	BY("phase-locked", lock),
	BY("packet-error", lose_packets),
	BY("packet-error-level", lose_packets),
	BY("packet-error-total", lose_packets),
	BY("packet-error-exceeded", lose_many),
	BITS("machine-on-permitted", flags, 3),
	BITS("needs-edge", flags, 4),
	BY("position-lost", begin_another_count),
	BY("unhome", begin_one_while_homed),
	BY("joint.%02u.position-lost", begin_another_count),
	BY("encoder-count-lost", restart_the_counters),
	BY("encoder.%02u.count-lost", restart_the_counters),
	BITS("outputs-held", flags, 10),
	BITS("safe-state", flags, 2),
	BITS("commander", flags, 1),
	BITS("command-refused", flags, 7),
	COUNT("command-refused-count", refused_command),
	BY("input-refused", set_bad_scale),
	BY("input-refused-count", set_bad_scale),
	BY("error-active", be_in_emergency),
	BY("error-code", be_in_emergency),
	BY("error-count", be_in_emergency),
	BY("read-missing", do_not_read),
	BY("time-exceeded-count", be_slow),
	BY("one-shot-full", fill_the_queue),
	BY("one-shot-failed-count", fail_a_one_shot),

	FIELD("engine-state", engine.state),
	FIELD("emergency", engine.emergency),
	NOT("emergency-not", engine.emergency),
	FIELD("engine.axes-enabled", engine.axes_enabled),
	FIELD("engine.activated", engine.activated),
	FIELD("engine.charge-pump-state", engine.charge_pump),
	FIELD("engine.generator-state", engine.generator),
	FIELD("engine.power-states-in-effect", engine.power_states),
	FIELD("engine.probe-status", engine.probe_status),
	FIELD("engine.buffer-slots", engine.buffer_slots),
	FIELD("engine.buffer-level", engine.buffer_level),
	FIELD("engine.buffer-underruns", engine.buffer_underruns),
	FIELD("engine.buffer-resyncs", engine.buffer_resyncs),
	BY("homing.active", home_all),
	BY("homing.phase", home_all),
	BY("homing.error", fail_to_home),
	BY("joint.%02u.homing", home_all),
	BY("probe.active", probe_something),
	BY("probe.done", probe_something),
	BY("probe.error", probe_something),
	BY("probe.contact", probe_something),
	FIELD("threading.preparing", threading.preparing),
	FIELD("threading.prepared", threading.prepared),
	FIELD("threading.waiting", threading.waiting),
	FIELD("threading.active", threading.active),
	FIELD("threading.velocity", threading.velocity),
	FIELD("threading.position-error", threading.position_error),
	FIELD("threading.spindle-rpm", threading.spindle_rpm),
	FIELD("threading.index-count", threading.index_count),
	FIELD("threading.behind", threading.behind),
	BY("threading.refused", refuse_a_thread),
	BY("threading.reason", refuse_a_thread),
	BY("threading.error", refuse_a_thread),
	SCALED("engine.slot-us", engine.slot_time, 100),
	FIELD("engine.limit-override-active", engine.limit_override),
	BITS("engine.misc.%02u.in", engine.misc_inputs, 0),
	NOT("engine.misc.%02u.in-not", engine.misc_inputs),
	BITS("external.%02u.out-fb", engine.outputs, 0),
	BITS("external-relay.%02u.out-fb", engine.relays, 0),

	INFO("PinCount", pins),
	INFO("PWMCount", pwm),
	INFO("BasicEncoderCount", basic_encoders),
	INFO("EncodersCount", encoders),
	INFO("FastEncoders", fast_encoders),
	INFO("UltraFastEncoders", ultra_fast_encoders),
	INFO("PWMinternalFrequency", pwm_hz),
	INFO("AnalogInputs", analog_inputs),
	INFO("KeyMapping", key_mapping),
	INFO("TriggeredKeyMapping", triggered_key_mapping),
	INFO("KeyRepeatDelay", key_repeat_delay),
	INFO("DigitalCounters", digital_counters),
	INFO("JoystickButtonAxisMapping", joystick),
	INFO("JoystickAnalogToDigitalMapping", joystick),
	INFO("Macros", macros),
	INFO("MatrixKeyboard", matrix_keyboard),
	INFO("MatrixKeyboardTriggeredMapping", triggered_key_mapping),
	INFO("LCD", lcd),
	INFO("MatrixLED", matrix_led),
	INFO("ConnectionSignal", connection_signal),
	INFO("PoExtBus", poextbus),
	INFO("PoNET", ponet),
	INFO("AnalogFiltering", analog_filtering),
	INFO("InitOutputsStart", init_outputs),
	INFO("protI2C", i2c),
	INFO("prot1wire", one_wire),
	INFO("AdditionalOptions", additional_options),
	INFO("LoadStatus", load_status),
	INFO("CustomDeviceName", custom_name),
	INFO("PoTLog27support", potlog27),
	INFO("SensorList", sensor_list),
	INFO("WebInterface", web_interface),
	INFO("FailSafeSettings", failsafe),
	INFO("JoystickHATswitch", joystick),
	BY("info.PulseEngine", pulse_engine_1),
	BY("info.PulseEnginev2", pulse_engine_2),
	INFO("EasySensors", easy_sensors),
	INFO("Axes", axes),
	INFO("MaxPulseFrequency", axis_khz),
	FIELD("info.FirmwareMajor", identity.firmware_major),
	FIELD("info.FirmwareMinor", identity.firmware_minor),
	FIELD("info.FirmwareRevision", identity.firmware_revision),
	FIELD("info.UserID", identity.user_id),
	FIELD("info.ActivatedOptions", identity.options),

	CLOCK("sec", second),
	CLOCK("min", minute),
	CLOCK("hour", hour),
	CLOCK("dow", day_of_week),
	CLOCK("dom", day),
	CLOCK("month", month),
	CLOCK("year", year),
	CLOCK("doy", day_of_year),
	BY("rtc.set-outcome", press_the_clock),

	BITS("pin.%02u.in", digital_in, 0),
	NOT("pin.%02u.in-not", digital_in),
	BITS("pin.%02u.out-fb", digital_out, 0),
	EACH("counter.%02u.value", counter, ),
	EACH("adc.%02u.raw", analog, ),
	{ .name = "adc.%02u.value", AT(analog[0]), .size = 2, .stride = 2, .factor = 3.3 / 4096 },
	BY("pwm.%02u.duty", set_pwm),
	BITS("pwm.%02u.enabled", pwm_enabled, 0),
	EACH("encoder.%02u.count", encoder, ),
	EACH("encoder.%02u.position", encoder, ),
	BY("encoder.%02u.velocity", turn),
	BITS("encoder.%02u.enabled", encoder_enabled, 0),

	AXIS("following-error", .following_error),
	AXIS("pos-fb", .position),
	AXIS("state", .state),
	AXIS("enabled", .enabled),
	BY("joint.%02u.in-position", stand_at_the_command),
	AXIS("homed", .homed),
	AXIS("error", .error),
	AXIS("limit-neg", .limit_minus),
	AXIS("limit-pos", .limit_plus),
	AXIS("soft-limit", .soft_limit),
	AXIS("home-sw", .home),
	AXIS("probe-pos", .probe),
	BITS("joint.%02u.limit-neg-dedicated", engine.dedicated_limit_minus, 0),
	BITS("joint.%02u.limit-pos-dedicated", engine.dedicated_limit_plus, 0),
	BITS("joint.%02u.home-dedicated", engine.dedicated_home, 0),
	BITS("joint.%02u.probed", engine.probe_status, 0),

	BITS("PoExtBus.%02u.in", poextbus, 0),
	NOT("PoExtBus.%02u.in-not", poextbus),
	FIELD("PoNET.state", ponet_state),
	FIELD("PoNET.count", ponet_count),
	MODULE("type", .type),
	MODULE("address", .address),
	MODULE("size", .size),
	MODULE("options", .options),
	MODULE("status", .status),
	MODULE("light", .light),
	MODULE("version", .version),
	MODULE("failures", .failures),
	BY("PoNET.%02u.present", attach_modules),
	{ .name = "PoNET.%02u.in-%u",
	  AT(ponet[0].data),
	  .size = 4,
	  .inner_stride = 4,
	  .stride = SIZE(ponet[0]) },
	BITS("matrix.%02u.%02u", matrix, 0),
	FIELD("matrix.enabled", matrix_enabled),
	BITS("kbd48CNC.%02u.Button", kbd48_keys, 0),
	BY("kbd48CNC.present", attach_a_keyboard),
	BY("kbd48CNC.module", attach_a_keyboard),
	BY("kbd48CNC.light", attach_a_keyboard),
	BY("kbd48CNC.brightness-sent", ask_for_light),

	FIELD("failsafe.state", failsafe),
	FIELD("device.load", identity.load),
	SCALED("device.tick", device_tick_ms, 1e-3),
	FIELD("device.locked", identity.locked),
	FIELD("device.access", access),
	FIELD("config.state", config_state),
	BY("config.refused", refuse_a_setting),
	BY("config.refused-index", refuse_a_setting),
	BY("config.generation", refuse_a_setting),
	BY("config.input-refused", refuse_a_setting),
	FIELD("config.generation-applied", config_generation),
	FIELD("config.foreign-count", config_foreign),
	RATE("encoders-low", ENCODERS_LOW),
	RATE("encoders-high", ENCODERS_HIGH),
	RATE("analog", ANALOG),
	RATE("counters", COUNTERS),
	RATE("PoExtBus", POEXTBUS),
	RATE("tick", TICK),
	RATE("pwm", PWM),
	RATE("load", LOAD),
	RATE("rtc", CLOCK),
	RATE("external", EXTERNAL),
	RATE("identity", IDENTITY),
	RATE("PoNET", PONET),
	RATE("dedicated", DEDICATED),
	RATE("matrix", MATRIX),
	COUNT("packets.sent", sent),
	COUNT("packets.resent", resent),
	COUNT("packets.received", received),
	COUNT("packets.late", late),
	COUNT("packets.lost", lost),
	COUNT("packets.timed-out", timed_out),
	COUNT("packets.stray", stray),
	COUNT("packets.duplicate", duplicate),
	COUNT("packets.stale", stale),
	COUNT("packets.corrupt", corrupt),
	COUNT("packets.wrong-source", wrong_source),
	COUNT("packets.send-failed", send_failed),
	COUNT("packets.in-flight", in_flight),
	SCALED("deadline-us", statistics.deadline_ns, 1e-3),
	COUNT("cycles-late", cycles_late),
	BY("latency.wakeup-p99-us", be_late),
	BY("latency.wakeup-max-us", be_late),
	BY("latency.round-trip-p99-us", be_late),
	BY("latency.round-trip-max-us", be_late),
	BY("latency.data-p99-us", be_late),
	BY("latency.data-max-us", be_late),
	BY("latency.age-p99-us", be_late),
	BY("latency.age-max-us", be_late),
	BY("cycles-skipped", be_late),
	FIELD("encoder-resyncs", encoder_resync[0]),
	RATE("backlash", BACKLASH),
	RATE("postep", POSTEP),
	RATE("postep-rare", POSTEP_RARE),
	EACH("joint.%02u.backlash-taken", backlash, ),
	{ .name = "joint.%02u.postep.supply",
	  AT(postep[0].supply),
	  .size = 1,
	  .stride = SIZE(postep[0]),
	  .factor = 0.25 },
	DRIVER("temperature", .temperature),
	DRIVER("state", .state),
	DRIVER("faults", .faults),
	DRIVER("fault", .faults),
	DRIVER("inputs", .inputs),
	DRIVER("updates", .update_count),
	BY("joint.%02u.postep.age-ms", talk_to_drivers),
	DRIVER("current-raw", .full_scale),
	DRIVER("current-idle-raw", .idle),
	DRIVER("current-overheat-raw", .overheat),
	DRIVER("hardware", .hardware_minor),
	DRIVER("firmware", .firmware_minor),
	HEATER("temperature", .temperature, .is_float = true),
	HEATER("target-in-effect", .target, .is_float = true),
	HEATER("power", .power, .is_float = true),
	HEATER("at-temperature", .at_temperature),
	HEATER("fault", .fault),
	HEATER("fault-code", .fault),
	HEATER("condition", .condition),
	HEATER("refused", .refused),
	SERVO("pos-fb", .position, .is_float = true),
	SERVO("vel-fb", .velocity, .is_float = true),
	SERVO("error", .error, .is_float = true),
	SERVO("output", .output, .is_float = true),
	BY("servo.%02u.enabled", enable_motors),
	SERVO("fault", .fault),
	SERVO("fault-code", .fault),
	SERVO("condition", .condition),
	SERVO("refused", .refused),
	SERVO("homed", .homed),
	SERVO("limit-minus", .low),
	SERVO("limit-plus", .high),
	SERVO("homing", .homing),
	SERVO("home-end", .home_end),
	BITS("daemon.realtime", flags, 5),
	BITS("daemon.fallback", flags, 6),
	BITS("daemon.guard", flags, 9),
	BY("joint.%02u.refused", set_bad_scale),
};

static const struct out_driver *driver_of(const struct table_row *row)
{
	for (size_t i = 0; i < sizeof(drivers) / sizeof(drivers[0]); i++) {
		if (!strcmp(drivers[i].name, row->name))
			return &drivers[i];
	}
	return NULL;
}

static void begin(void)
{
	drive_init(&drive, TABLE_LOOPS);
	drive.rig.daemon.identity.serial = 1;
	memset(drive.rig.daemon.ponet, 0, sizeof(drive.rig.daemon.ponet));
	drive.rig.daemon.kbd48_module = 255;
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		drive.rig.daemon.heater[i].state = POKEYS_HEATER_OFF;
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		drive.rig.daemon.servo[i].state = POKEYS_SERVO_OFF;
	drive_periods(&drive, 17);
}

static void check(const struct table_cursor *at, size_t pin, double expected)
{
	double got = drive_get(&drive, at->row, pin);

	if (fabs(got - expected) <= 1e-9 * fabs(expected))
		return;
	print_error("%s, %u: %g instead of %g\n", at->row->name, at->index, got, expected);
	fail();
}

static void show_field(const struct out_driver *driver, const struct table_cursor *at, size_t pin)
{
	unsigned int inner = at->row->inner ? at->row->inner : 1;
	uint8_t *field = (uint8_t *)&drive.rig.daemon + driver->offset +
			 at->index / inner * driver->stride +
			 at->index % inner * driver->inner_stride;
	uint64_t before = drive_load(field, driver->size, driver->bit + at->index);
	bool bit = at->row->type == TABLE_BIT;
	uint64_t value = bit ? !before : 3 + at->index * 5 % 50;
	double factor = driver->factor != 0 ? driver->factor : 1;

	if (driver->is_float && driver->size == sizeof(double))
		memcpy(field, &(double){ (double)value }, sizeof(double));
	else if (driver->is_float)
		memcpy(field, &(float){ (float)value }, sizeof(float));
	else
		drive_store(field, driver->size, driver->bit + at->index, value);
	drive_periods(&drive, 17);
	check(at, pin, driver->inverse ? !value : (double)value * factor);
	drive_store(field, driver->size, driver->bit + at->index, before);
	drive_periods(&drive, 17);
	if (drive.rig.exchange.fresh)
		check(at, pin, driver->inverse ? !before : (double)before * factor);
}

static void every_out_pin_shows_its_piece_of_the_image(void **state)
{
	size_t pin = 0, checked = 0;

	(void)state;
	begin();
	for (struct table_cursor at = table_walk(TABLE_LOOPS); table_next(&at);) {
		const struct out_driver *driver = driver_of(at.row);

		if (at.row->kind != TABLE_PIN)
			continue;
		if (at.row->direction == TABLE_OUT && !driver)
			fail_msg("%s has no driver", at.row->name);
		if (driver && !driver->drive) {
			show_field(driver, &at, pin);
			checked++;
		}
		pin++;
	}
	assert_true(checked > 900);
}

static void pins_that_are_not_of_one_field_are_driven_too(void **state)
{
	size_t pin = 0;

	(void)state;
	for (struct table_cursor at = table_walk(TABLE_LOOPS); table_next(&at);) {
		const struct out_driver *driver = driver_of(at.row);

		if (at.row->kind == TABLE_PIN && driver && driver->drive) {
			begin();
			driver->drive(&drive.rig);
			for (unsigned int k = 0; k < 17 && drive_get(&drive, at.row, pin) <= 0; k++)
				drive_period(&drive);
			if (drive_get(&drive, at.row, pin) <= 0)
				fail_msg("%s, %u was not driven", at.row->name, at.index);
		}
		pin += at.row->kind == TABLE_PIN;
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_out_pin_shows_its_piece_of_the_image),
		cmocka_unit_test(pins_that_are_not_of_one_field_are_driven_too),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
