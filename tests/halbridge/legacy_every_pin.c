/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Each pin of the older names in both directions: moved at the device's end it
 * is seen at the pin, set at the pin it is seen in the command, each instance
 * its own. A pin that is in no list here fails the test; those without a
 * function are listed as that, and must have none.
 */
#include "tests/halbridge/drive.h"

enum { SCHEMES = TABLE_LEGACY | TABLE_PONET };

static struct drive drive;
static struct pokeys_state *const daemon_image = &drive.rig.daemon;
static struct pokeys_command *const command = &drive.rig.exchange.command;
static struct value_legacy *const legacy = &drive.rig.values.legacy;

/* Move the device's (or our) end; what the pin shows then, not a number: more than 0. */
typedef double (*mover)(unsigned int index);

struct driver {
	const char *name;
	mover move;
};

static void begin(void)
{
	drive_init(&drive, SCHEMES);
	drive.rig.exchange.legacy.on = true;
	memset(daemon_image->digital_out_owned, 0xff, 7);
	daemon_image->kbd48_module = 255;
	daemon_image->pwm_period = 1000;
	for (unsigned int i = 0; i < POKEYS_PONET; i++)
		daemon_image->ponet[i].type = 1;
	daemon_image->engine.emergency_pin = 1;
	drive_periods(&drive, 3);
}

/* As somebody sets an IN pin. */
static void set_pin(const char *name, unsigned int index, double value)
{
	size_t pin = 0;

	for (struct table_cursor at = table_walk(SCHEMES); table_next(&at);) {
		if (!strcmp(at.row->name, name) && at.index == index)
			drive_set(&drive, at.row, pin, value);
		pin += at.row->kind == TABLE_PIN;
	}
}

#define MOVE(name_, ...)	\
	static double name_(unsigned int i) { (void)i; __VA_ARGS__ }
#define AXIS(i_)	daemon_image->engine.axis[i_]

MOVE(found, daemon_image->identity.serial = 5; return 1;)
MOVE(link_code, return POKEYS_LINK_RUNNING;)
MOVE(lost, drive.rig.device_silent = true; drive.rig.now_ns += 100 * RIG_MS; return 1;)
MOVE(there, return 1;)
MOVE(unnamed, daemon_image->rtc.unnamed = 9; return 9;)
MOVE(loops, daemon_image->rtc.second = 3; drive_periods(&drive, 5); return 6;)
MOVE(last_minute, daemon_image->rtc.minute = 8; drive_period(&drive); daemon_image->rtc.minute = 9;
     return 8;)
MOVE(last_second, daemon_image->rtc.second = 8; drive_period(&drive); daemon_image->rtc.second = 9;
     return 8;)
MOVE(rate, daemon_image->rtc.second = 8; drive_periods(&drive, 100); daemon_image->rtc.second = 9;
     return 1000;)
MOVE(latency, set_pin("rtc.sec-ret", 0, 8); daemon_image->rtc.second = 8; drive_periods(&drive, 3);
     return 0;)
MOVE(encoder_age, daemon_image->t_encoder_ns = drive.rig.now_ns; return 2000;)
MOVE(input_age, return 200;)
MOVE(motion_age, return 100;)
MOVE(count, daemon_image->encoder[i] = 77; return 77;)
MOVE(position, legacy->encoder[i].scale = 0.5; daemon_image->encoder[i] = 77; return 38.5;)
MOVE(
	turning, legacy->encoder[i].scale = 2; for (int k = 0; k < 8; k++) {
		daemon_image->encoder[i] += 10;
		drive_period(&drive);
	} daemon_image->encoder[i] += 10;
	return (double)NAN;)
MOVE(bus_rate, daemon_image->slow_millihertz[POKEYS_SLOW_POEXTBUS] = 123; return 123;)
MOVE(ponet_rate, daemon_image->slow_millihertz[POKEYS_SLOW_PONET] = 123; return 123;)
MOVE(bus_in, daemon_image->poextbus[9 - i / 8] ^= (uint8_t)(1u << (7 - i % 8)); return 1;)
MOVE(bus_in_not, bus_in(i); return 0;)
MOVE(ponet_state, daemon_image->ponet_state = 10; return 10;)
MOVE(ponet_data, daemon_image->ponet[i / 16].data[i % 16] = 99; return 99;)
MOVE(light, daemon_image->kbd48_module = 2; daemon_image->ponet[2].light = 33; return 33;)
MOVE(brightness, light(i); set_pin("kbd48CNC.%u.LED", 0, 1); return 255 - 33;)
MOVE(brightness_before, brightness(i); drive_periods(&drive, 2); daemon_image->ponet[2].light = 34;
     drive_periods(&drive, 2); return 255 - 33;)
MOVE(button, daemon_image->kbd48_keys ^= UINT64_C(1) << i; return 1;)
MOVE(pwm_step, daemon_image->pwm_duty[5 - i] = 44; return 44;)
MOVE(pwm_on, daemon_image->pwm_enabled = 3; return 3;)
MOVE(duty, set_pin("adcout.%u.value", i, 2.5); legacy->adcout[i].scale = 1; return 500;)
MOVE(volts, daemon_image->analog[i] = 2048; return 1.65;)
MOVE(input, daemon_image->digital_in[i / 8] ^= (uint8_t)(1u << i % 8); return 1;)
MOVE(input_not, input(i); return 0;)
MOVE(counter, daemon_image->counter[i] = 1234; return 1234;)

MOVE(axes, daemon_image->capability.axes = 8; return 8;)
MOVE(khz, daemon_image->capability.axis_khz = 125; return 125;)
MOVE(slots, daemon_image->engine.buffer_slots = 128; return 128;)
MOVE(slot_time, daemon_image->engine.slot_time = 10; return 10;)
MOVE(activated, daemon_image->engine.activated = 1; return 1;)
MOVE(engine_state, daemon_image->engine.state = 3; return 3;)
MOVE(wanted_state, set_pin("machine-is-on", 0, 1); return 3;)
MOVE(misc, daemon_image->engine.misc_inputs = 0x40; return 0x40;)
MOVE(misc_bit, daemon_image->engine.misc_inputs ^= (uint8_t)(1u << i); return 1;)
MOVE(misc_bit_not, misc_bit(i); return 0;)
MOVE(override, daemon_image->engine.limit_override = 1; return 1;)
MOVE(probed, daemon_image->engine.state = 30; return 1;)
MOVE(emergency, daemon_image->engine.state = 101; return 1;)
MOVE(emergency_not, daemon_image->engine.state = 101; return 0;)
MOVE(emergency_step, daemon_image->engine.state = 101; return 8;)
MOVE(enabled_mask, AXIS(2).enabled = 1; return 4;)
MOVE(power_mask, daemon_image->engine.power_states = 5; return 5;)
MOVE(relays, daemon_image->engine.relays = 6; return 6;)
MOVE(outputs, daemon_image->engine.outputs = 6; return 6;)
MOVE(back_register, daemon_image->backlash[i] = 77; return 77;)
MOVE(probe_status, daemon_image->engine.probe_status = 6; return 6;)

MOVE(mode, AXIS(i).mode = POKEYS_AXIS_VELOCITY; return POKEYS_AXIS_VELOCITY;)
MOVE(homing, AXIS(i).state = 12; return 1;)
MOVE(in_position, AXIS(i).in_position = 1; return 1;)
MOVE(position_mode, return 1;)
MOVE(position_mode_active, AXIS(i).mode = POKEYS_AXIS_POSITION; return 1;)
MOVE(velocity_moves, AXIS(i).mode = POKEYS_AXIS_VELOCITY; return 1;)
MOVE(moves, AXIS(i).enabled = 1; return 1;)
MOVE(speed, set_pin("PEv2.%u.joint-vel-cmd", i, -20); return -20;)
MOVE(speed_without_sign, speed(i); return 20;)
MOVE(reference_position, set_pin("PEv2.%u.joint-pos-cmd", i, 30); return 30;)
MOVE(reference, AXIS(i).reference = 40; return 40;)
MOVE(state, AXIS(i).state = 2; return 2;)
MOVE(probe_position, AXIS(i).probe = 50; return 50;)
MOVE(homing_status, set_pin("PEv2.%u.AxesCommand", i, LEGACY_HOME_START); drive_period(&drive);
     return 1;)
MOVE(axis_position, AXIS(i).position = -60; return -60;)
MOVE(limit_minus, legacy->axis_set[i].limit_minus = true;
     daemon_image->engine.dedicated_limit_minus ^= (uint8_t)(1u << i); return 1;)
MOVE(limit_minus_not, limit_minus(i); return 0;)
MOVE(limit_plus, legacy->axis_set[i].limit_plus = true;
     daemon_image->engine.dedicated_limit_plus ^= (uint8_t)(1u << i); return 1;)
MOVE(limit_plus_not, limit_plus(i); return 0;)
MOVE(home, legacy->axis_set[i].home_switch = true;
     daemon_image->engine.dedicated_home ^= (uint8_t)(1u << i); return 1;)
MOVE(home_not, home(i); return 0;)
MOVE(error, AXIS(i).error = 1; return 1;)
MOVE(error_not, AXIS(i).error = 1; return 0;)
MOVE(probe, AXIS(i).state = 14; return 1;)
MOVE(probe_not, AXIS(i).state = 14; return 0;)
MOVE(soft_limit, AXIS(i).soft_limit = 1; return 1;)

#define PEV2(name_)	"PEv2.%u." name_

static const struct driver shown[] = {
	{ "enum-udp-dev", found },
	{ "deb.out", link_code },
	{ "err", lost },
	{ "connected.udp", there },
	{ "alive", there },
	{ "connected", there },
	{ "rtc.tmp", unnamed },
	{ "rtc.loopcount", loops },
	{ "rtc.lastmin", last_minute },
	{ "rtc.lastsec", last_second },
	{ "rtc.loop-frequ", rate },
	{ "rtc.hal-latency", latency },
	{ "encoder.deb.out", encoder_age },
	{ "digin.deb.out", input_age },
	{ "PEv2.deb.out", motion_age },
	{ "encoder.%u.count", count },
	{ "encoder.%u.position", position },
	{ "encoder.%u.velocity", turning },
	{ "PoExtBus.deb.out", bus_rate },
	{ "PoExtBus.%u.digin.%u.in", bus_in },
	{ "PoExtBus.%u.digin.%u.in_not", bus_in_not },
	{ "PoNET.PoNETstatus", ponet_state },
	{ "PoNET.Deb.Out", ponet_rate },
	{ "PoNET.%u.digin.%u.in", ponet_data },
	{ "kbd48CNC.lightValue", light },
	{ "kbd48CNC.KeyBrightness", brightness },
	{ "kbd48CNC.prevBrightness", brightness_before },
	{ "kbd48CNC.%u.Button", button },
	{ "adcout.%u.deb.out", pwm_step },
	{ "adcout.%u.deb.setval", duty },
	{ "adcout.deb.outv", pwm_on },
	{ "adcin.%u.value-raw", volts },
	{ "adcin.%u.value", volts },
	{ "digin.%u.in", input },
	{ "digin.%u.in-not", input_not },
	{ "counter.%u.value", counter },
	{ "PEv2.nrOfAxes", axes },
	{ "PEv2.maxPulseFrequency", khz },
	{ "PEv2.bufferDepth", slots },
	{ "PEv2.slotTiming", slot_time },
	{ "PEv2.PulseEngineActivated", activated },
	{ "PEv2.PulseEngineState", engine_state },
	{ "PEv2.PulseEngineStateSetup", wanted_state },
	{ "PEv2.MiscInputStatus", misc },
	{ "PEv2.digin.Misc-%u.in", misc_bit },
	{ "PEv2.digin.Misc-%u.in-not", misc_bit_not },
	{ "PEv2.LimitOverride", override },
	{ "PEv2.digin.Probed.in", probed },
	{ "PEv2.digin.Emergency.in", emergency },
	{ "PEv2.digin.Emergency.in-not", emergency_not },
	{ "PEv2.deb.estop", emergency_step },
	{ "PEv2.AxisEnabledMask", enabled_mask },
	{ "PEv2.AxisEnabledStatesMask", power_mask },
	{ "PEv2.ExternalRelayOutputs", relays },
	{ "PEv2.ExternalOCOutputs", outputs },
	{ "PEv2.ProbeStatus", probe_status },
	{ PEV2("deb.axxisout"), mode },
	{ PEV2("deb.ishoming"), homing },
	{ PEV2("deb.inposition"), in_position },
	{ PEV2("deb.PosMode"), position_mode },
	{ PEV2("deb.PosModeAct"), position_mode_active },
	{ PEV2("deb.velmode-count"), velocity_moves },
	{ PEV2("deb.posmode-count"), position_mode_active },
	{ PEV2("deb.doMove"), moves },
	{ PEV2("deb.RefSpeed"), speed },
	{ PEV2("deb.RefPos"), reference_position },
	{ PEV2("deb.RefPosSpeed"), reference },
	{ PEV2("AxesState"), state },
	{ PEV2("ProbePosition"), probe_position },
	{ PEV2("HomingStatus"), homing_status },
	{ PEV2("BacklashRegister"), back_register },
	{ PEV2("CurrentPosition"), axis_position },
	{ PEV2("ReferencePositionSpeed"), reference },
	{ PEV2("ReferencePosition"), reference_position },
	{ PEV2("ReferenceSpeed"), speed_without_sign },
	{ PEV2("joint-pos-fb"), axis_position },
	{ PEV2("digin.LimitN.in"), limit_minus },
	{ PEV2("digin.LimitN.in-not"), limit_minus_not },
	{ PEV2("digin.LimitN.DedicatedInput"), limit_minus },
	{ PEV2("digin.LimitP.in"), limit_plus },
	{ PEV2("digin.LimitP.in-not"), limit_plus_not },
	{ PEV2("digin.LimitP.DedicatedInput"), limit_plus },
	{ PEV2("digin.Home.in"), home },
	{ PEV2("digin.Home.in-not"), home_not },
	{ PEV2("digin.Home.DedicatedInput"), home },
	{ PEV2("digin.Error.in"), error },
	{ PEV2("digin.Error.in-not"), error_not },
	{ PEV2("digin.Probe.in"), probe },
	{ PEV2("digin.Probe.in-not"), probe_not },
	{ PEV2("digin.SoftLimit.in"), soft_limit },
	{ PEV2("digin.AxisEnabled.in"), moves },
	{ PEV2("digout.LimitOverride.out"), override },
};

/* They never had anything behind them, and have not now. */
static const char *const constant[] = {
	"enum-usb-dev", "enum-fusb-dev", "connected.usb", "connected.fusb", "connected.net",
};

/* Set the pin to `set`; what it does is then seen by `seen`, and before it is not. */
struct effect {
	const char *name;
	double set;
	bool (*seen)(unsigned int index);
	void (*before)(unsigned int index);
};

#define SEEN(name_, ...)	\
	static bool name_(unsigned int i) { (void)i; return __VA_ARGS__; }
#define BEFORE(name_, ...)	\
	static void name_(unsigned int i) { (void)i; __VA_ARGS__ }
#define SHOT		command->one_shot[(command->one_shot_head - 1) % POKEYS_ONE_SHOTS]
#define SHOT_IS(operation_, mask_) (command->one_shot_head > 0 &&			\
	SHOT.operation == POKEYS_ONE_SHOT_##operation_ && SHOT.mask == (mask_))

BEFORE(choose, memset((void *)&legacy->choice, 1, sizeof(legacy->choice));)
BEFORE(drive_axis, choose(i); drive.rig.exchange.legacy.linked[i] = true;
       legacy->axis_set[i].enabled = 1; set_pin("machine-is-on", 0, 1);)
BEFORE(count_first, daemon_image->encoder[i] = 50;)
BEFORE(analog_on, choose(i); set_pin("adcout.%u.enable", i, 1); legacy->adcout[i].scale = 1;)
BEFORE(analog_value, choose(i); set_pin("adcout.%u.value", i, 2.5); legacy->adcout[i].scale = 1;)
BEFORE(emergency_pin, choose(i); legacy->engine_set.emergency_out_pin = 10;)
BEFORE(board, daemon_image->identity.serial = 1; daemon_image->identity.hardware = 32;)
BEFORE(probing, legacy->engine.probe_mask = 0;)
BEFORE(final_move, drive.rig.exchange.legacy.home[i].phase = LEGACY_PHASE_MOVING;
       legacy->axis_set[i].home_position = 9;)
BEFORE(second, daemon_image->rtc.second = 8;)

SEEN(machine_on, command->flags &POKEYS_COMMAND_MACHINE_ON)
SEEN(latency_known, legacy->clock.second_back == 8)
SEEN(encoder_held, drive.rig.values.encoder[i].count == 0)
SEEN(index_armed, command->one_shot_head == 1 && command->one_shot[0].index == i)
SEEN(bus_out, command->poextbus[9 - i / 8] == 1u << (7 - i % 8))
SEEN(ponet_out, command->ponet_data[i / 16][i % 16] == 7)
SEEN(led, command->kbd48_leds == UINT64_C(1) << i)
SEEN(analog, command->pwm_duty[5 - i] == 500)
SEEN(digital, command->digital_out[i / 8] == 1u << i % 8)
SEEN(apply, legacy->engine.apply)
SEEN(overridden, command->flags &POKEYS_COMMAND_LIMIT_OVERRIDE)
SEEN(emergency_out, command->digital_out[1] & 2)
SEEN(external, command->external_outputs == ((const uint8_t[]){ 0x80, 0x01, 0x04, 0x02 })[i])
SEEN(external_output, command->external_outputs == 8u << i)
SEEN(home_mask, SHOT_IS(HOME, 3))
SEEN(probe_mask, SHOT_IS(PROBE, 3))
SEEN(probe_speed, legacy->engine.probe_speed > 0.4)
SEEN(probe_most, legacy->axis[i].probe_max == 9)
SEEN(enabled, command->axis[i].enable)
SEEN(home_command, SHOT_IS(HOME, 1u << i))
SEEN(preset, SHOT_IS(SET_POSITION, 1u << i) && SHOT.value[i] == 9)
SEEN(position_command, command->axis[i].position == 9)
SEEN(velocity_command, command->axis[i].velocity > 8.5f)
SEEN(rate_wanted, legacy->clock.rate_demand == 500)
SEEN(power_wanted, legacy->engine.power_mask == 9)
SEEN(backlash_wanted, legacy->engine.backlash == 1)
SEEN(play_wanted, legacy->axis[i].backlash_width == 9)
SEEN(taking_up_wanted, legacy->axis[i].backlash_acceleration == 9)
SEEN(index_kept, legacy->axis[i].index_enable)

static const struct effect effects[] = {
	{ "machine-is-on", 1, machine_on, choose },
	{ "rtc.sec-ret", 8, latency_known, second },
	{ "rtc.loop-frequ-demand", 500, rate_wanted, choose },
	{ "encoder.%u.reset", 1, encoder_held, count_first },
	{ "encoder.%u.index-enable", 1, index_armed, choose },
	{ "PoExtBus.%u.digout.%u.out", 1, bus_out, choose },
	{ "PoNET.%u.digout.%u.out", 7, ponet_out, choose },
	{ "kbd48CNC.%u.LED", 1, led, choose },
	{ "adcout.%u.value", 2.5, analog, analog_on },
	{ "adcout.%u.enable", 1, analog, analog_value },
	{ "digout.%u.out", 1, digital, choose },
	{ "PEv2.params.ApplyIniSettings", 1, apply, choose },
	{ "PEv2.LimitOverrideSetup", 1, overridden, choose },
	{ "PEv2.digout.Emergency.out", 1, emergency_out, emergency_pin },
	{ "PEv2.digout.ExternalRelay-%u.out", 1, external, board },
	{ "PEv2.digout.ExternalOC-%u.out", 1, external_output, board },
	{ "PEv2.HomingStartMaskSetup", 3, home_mask, choose },
	{ "PEv2.ProbeStartMaskSetup", 3, probe_mask, probing },
	{ "PEv2.ProbeSpeed", 0.5, probe_speed, probing },
	{ PEV2("ProbeMaxPosition"), 9, probe_most, probing },
	{ "PEv2.AxisEnabledStatesMask", 9, power_wanted, choose },
	{ "PEv2.BacklashCompensationEnabled", 1, backlash_wanted, choose },
	{ PEV2("BacklashWidth"), 9, play_wanted, choose },
	{ PEV2("BacklashAcceleration"), 9, taking_up_wanted, choose },
	{ PEV2("AxesCommand"), 1, home_command, choose },
	{ PEV2("PositionSetup"), 9, preset, choose },
	{ PEV2("index-enable"), 1, index_kept, choose },
	{ PEV2("joint-vel-cmd"), 9, velocity_command, drive_axis },
	{ PEV2("joint-pos-cmd"), 9, position_command, drive_axis },
	{ PEV2("digout.AxisEnable.out"), 1, enabled, drive_axis },
	{ PEV2("digout.AxisEnabled.out"), 1, enabled, drive_axis },
	{ PEV2("stepgen.HOME-FINAL-VEL"), 9, velocity_command, final_move },
};

/* Shown only, or accepted without a function: setting them must change nothing. */
static const char *const inert[] = {
	"PEv2.LimitOverride",
	"PEv2.AxisEnabledMask",
	PEV2("ProbePosition"),
	PEV2("HomingStatus"),
	PEV2("joint-out-home"),
	PEV2("joint-in-homing"),
	PEV2("joint-in-position"),
	PEV2("joint-kb-jog-active"),
	PEV2("joint-wheel-jog-active"),
	PEV2("stepgen.TYPE"),
	PEV2("params.Feedback-Encoder-Id"),
	PEV2("stepgen.DEADBAND"),
	PEV2("stepgen.MAX-OUTPUT"),
	PEV2("stepgen.ENCODER-SCALE"),
	PEV2("stepgen.HOME-IGNORE-LIMITS"),
	PEV2("BacklashRegister"),
};

static bool listed(const char *const *list, size_t count, const char *name)
{
	for (size_t i = 0; i < count; i++) {
		if (!strcmp(list[i], name))
			return true;
	}
	return false;
}

#define LISTED(list_, name_)	listed(list_, sizeof(list_) / sizeof(list_[0]), name_)

/* Encoders from 26 on have nothing behind them, whatever the name says. */
static bool is_unused(const struct table_row *row)
{
	return row->first == POKEYS_ENCODERS && !strncmp(row->name, "encoder.", 8);
}

static const struct driver *driver_of(const char *name)
{
	for (size_t i = 0; i < sizeof(shown) / sizeof(shown[0]); i++) {
		if (!strcmp(shown[i].name, name))
			return &shown[i];
	}
	return NULL;
}

static const struct effect *effect_of(const char *name)
{
	for (size_t i = 0; i < sizeof(effects) / sizeof(effects[0]); i++) {
		if (!strcmp(effects[i].name, name))
			return &effects[i];
	}
	return NULL;
}

static void show(const struct driver *driver, const struct table_cursor *at, size_t pin)
{
	double expected, got;

	begin();
	expected = driver->move(at->index);
	drive_periods(&drive, 2);
	got = drive_get(&drive, at->row, pin);
	if (isnan(expected) && got > 0)
		return;
	if (!(fabs(got - expected) <= 0.01 * fabs(expected) + 1e-9))
		fail_msg("%s, %u shows %g instead of %g", at->row->name, at->index, got, expected);
}

static void every_pin_shows_what_the_device_does(void **state)
{
	size_t pin = 0, checked = 0;

	(void)state;
	for (struct table_cursor at = table_walk(SCHEMES); table_next(&at);) {
		const struct driver *driver = driver_of(at.row->name);
		bool out = at.row->kind == TABLE_PIN && at.row->direction == TABLE_OUT;

		if (out && !driver && !LISTED(constant, at.row->name) && !is_unused(at.row) &&
		    at.row->scheme != TABLE_BOTH)
			fail_msg("%s is in no list", at.row->name);
		if (at.row->kind == TABLE_PIN && driver && !is_unused(at.row)) {
			show(driver, &at, pin);
			checked++;
		}
		pin += at.row->kind == TABLE_PIN;
	}
	assert_true(checked > 1000);
}

static void take_effect(const struct effect *effect, const struct table_cursor *at, size_t pin)
{
	begin();
	effect->before(at->index);
	drive_periods(&drive, 2);
	if (effect->seen(at->index))
		fail_msg("%s, %u is seen before it is set", at->row->name, at->index);
	drive_set(&drive, at->row, pin, effect->set);
	drive_period(&drive);
	if (!effect->seen(at->index))
		fail_msg("%s, %u has no effect", at->row->name, at->index);
}

/* The command without what changes in every period. */
static struct pokeys_command without_times(void)
{
	struct pokeys_command image = *command;

	image.heartbeat = image.t_ns = image.t_thread_ns = 0;
	memset(image.read_age_ns, 0, sizeof(image.read_age_ns));
	return image;
}

static void take_no_effect(const struct table_cursor *at, size_t pin)
{
	struct pokeys_command before, after;

	begin();
	choose(0);
	drive_period(&drive);
	before = without_times();
	drive_set(&drive, at->row, pin, 1);
	drive_periods(&drive, 2);
	after = without_times();
	assert_memory_equal(&before, &after, sizeof(before));
}

static void every_pin_that_is_set_has_its_effect(void **state)
{
	size_t pin = 0, checked = 0;

	(void)state;
	for (struct table_cursor at = table_walk(SCHEMES); table_next(&at);) {
		const struct effect *effect = effect_of(at.row->name);
		bool in = at.row->kind == TABLE_PIN && at.row->direction != TABLE_OUT;
		bool none = LISTED(inert, at.row->name) || is_unused(at.row);

		if (in && !effect && !none)
			fail_msg("%s is in no list", at.row->name);
		if (in && none)
			take_no_effect(&at, pin);
		else if (in)
			take_effect(effect, &at, pin);
		checked += in;
		pin += at.row->kind == TABLE_PIN;
	}
	assert_true(checked > 700);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_pin_shows_what_the_device_does),
		cmocka_unit_test(every_pin_that_is_set_has_its_effect),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
