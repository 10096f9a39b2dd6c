/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a reply says, into the state image (protocol sections 3.4, 3.8,
 * 3.24.2).
 *
 * Only replies that the mailbox has accepted come here (invariant I1), and
 * every group of values gets the time at which its reply was received, not
 * the time at which somebody got round to it (invariant I2).
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

/* How far samples of 0xCC usually are apart. */
static uint64_t sample_ns(const struct device *device)
{
	return device->config.period_ns * device->config.fast_divider;
}

static bool is_enabled(const struct device *device, unsigned int encoder)
{
	return device->image.encoder_enabled >> encoder & 1;
}

/*
 * Is it still the same start of the same device? Until that is known no count is taken: one
 * of a new start is no motion, and is to be told in the image that has it.
 */
static bool doubted(const struct device *device)
{
	return plan_doubts(device) || restart_doubted(device);
}

/* `asked_ns`: when what was decoded now was asked for. */
static void show(struct device *device, unsigned int i, uint64_t asked_ns)
{
	if (device->image.encoder_t_ns[i] != device->encoder[i].t_ns)
		device->encoder[i].asked_ns = asked_ns;
	device->image.encoder[i] = device->encoder[i].count;
	device->image.encoder_t_ns[i] = device->encoder[i].t_ns;
	device->image.encoder_resync[i] = device->encoder[i].resync;
}

static void take_low_bytes(struct device *device, const struct wire_io_rep *io, uint64_t asked_ns,
			   uint64_t t_ns)
{
	for (unsigned int i = 0; i < WIRE_BASIC_ENCODERS; i++) {
		enum encoder_verdict verdict;

		if (!is_enabled(device, i))
			continue;
		verdict = encoder_low_byte(&device->encoder[i], io->encoder[i], t_ns,
					   sample_ns(device));
		if (verdict != ENCODER_TAKEN || device->one_shots.armed >> i & 1)
			slow_encoders_now(device, i / WIRE_ENCODER_BANK);
		show(device, i, asked_ns);
	}
}

/* The ultra-fast one comes whole: nothing to reconstruct. */
static void take_ultra(struct device *device, int32_t count, uint64_t asked_ns, uint64_t t_ns)
{
	struct encoder *encoder = &device->encoder[WIRE_ENCODER_ULTRA];

	if (!is_enabled(device, WIRE_ENCODER_ULTRA))
		return;
	if (operation_index_seen(device, WIRE_ENCODER_ULTRA, count, t_ns))
		encoder_forget(encoder);
	encoder_whole(encoder, count, t_ns);
	show(device, WIRE_ENCODER_ULTRA, asked_ns);
}

/* Over a silence the low bytes say nothing: as soon as there is no doubt any more. */
static void ask_all_bits(struct device *device)
{
	const uint32_t basic = device->image.encoder_enabled &
			       ((UINT32_C(1) << WIRE_BASIC_ENCODERS) - 1);

	if (basic & ((UINT32_C(1) << WIRE_ENCODER_BANK) - 1))
		slow_encoders_now(device, 0);
	if (basic >> WIRE_ENCODER_BANK)
		slow_encoders_now(device, 1);
}

void decode_io(struct device *device, const mailbox_entry_t *entry)
{
	struct pokeys_state *image = &device->image;
	const uint64_t t = entry->timestamp_received;
	struct wire_io_rep io;

	wire_io_decode_rep(entry->response_buffer, &io);
	pins_store(image->digital_in, io.inputs & OUTPUT_PINS);
	image->t_digital_ns = t;
	for (unsigned int i = 0; i < WIRE_IO_ANALOGS; i++)
		image->analog[i + POKEYS_ANALOG - WIRE_IO_ANALOGS] = io.analog[i];
	image->t_analog_ns = t;
	memcpy(image->matrix, io.matrix, sizeof(io.matrix));
	if (doubted(device)) {
		ask_all_bits(device);
		return;
	}
	take_low_bytes(device, &io, entry->timestamp_first_sent, t);
	take_ultra(device, (int32_t)io.ultra, entry->timestamp_first_sent, t);
	image->t_encoder_ns = t;
}

void decode_encoders(struct device *device, unsigned int bank, const mailbox_entry_t *entry)
{
	const unsigned int first = bank * WIRE_ENCODER_BANK;
	const uint64_t t = entry->timestamp_received;
	struct wire_encoders_rep reply;

	if (doubted(device))
		return;
	wire_encoders_decode_rep(entry->response_buffer, &reply);
	for (unsigned int i = 0; i < WIRE_ENCODER_BANK; i++) {
		const unsigned int n = first + i;

		if (!is_enabled(device, n) || n == WIRE_ENCODER_ULTRA)
			continue;
		if (operation_index_seen(device, n, reply.value[i], t))
			encoder_forget(&device->encoder[n]);
		if (encoder_exact(&device->encoder[n], reply.value[i], entry->timestamp_first_sent,
				  t, sample_ns(device)) != ENCODER_TAKEN)
			slow_encoders_now(device, bank);
		show(device, n, entry->timestamp_first_sent);
	}
}

void decode_encoders_forget(struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		encoder_forget(&device->encoder[i]);
}

void decode_encoders_anew(struct device *device)
{
	device->image.encoder_epoch++;
	decode_encoders_forget(device);
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		device->image.encoder_t_ns[i] = device->encoder[i].t_ns = 0;
}

void decode_pwm(struct device *device, const struct wire_pwm_rep *pwm)
{
	device->image.pwm_period = pwm->period;
	device->image.pwm_enabled = pwm->enabled;
	memcpy(device->image.pwm_duty, pwm->duty, sizeof(pwm->duty));
}

static void no_soft_limits(struct pokeys_axis *axis)
{
	axis->soft_minimum = INT32_MIN;
	axis->soft_maximum = INT32_MAX;
}

void decode_init(struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		no_soft_limits(&device->image.engine.axis[i]);
}

void decode_axis_setup(struct device *device, unsigned int i, const struct wire_axis_config *config)
{
	const uint8_t planner = WIRE_AXIS_INTERNAL_PLANNER | WIRE_AXIS_POSITION_MODE;
	struct pokeys_axis *axis = &device->image.engine.axis[i];

	axis->mode = POKEYS_AXIS_OFF;
	if (config->options & WIRE_AXIS_ENABLED) {
		if (!(config->options & WIRE_AXIS_INTERNAL_PLANNER))
			axis->mode = POKEYS_AXIS_BUFFERED;
		else
			axis->mode = (config->options & planner) == planner ? POKEYS_AXIS_POSITION :
									      POKEYS_AXIS_VELOCITY;
	}
	if (config->options & WIRE_AXIS_FAST_OUTPUT)
		axis->mode = POKEYS_AXIS_OFF;
	axis->max_speed = isfinite(config->max_speed) ? config->max_speed * 1e3f : 0;
	axis->max_acceleration = isfinite(config->max_accel) ? config->max_accel * 1e6f : 0;
	no_soft_limits(axis);
	if (config->options & WIRE_AXIS_SOFT_LIMITS) {
		axis->soft_minimum = config->soft_min;
		axis->soft_maximum = config->soft_max;
	}
}

static void take_axis(struct device *device, unsigned int i,
		      const struct wire_pulse_status_rep *status, bool placed)
{
	struct pokeys_axis *axis = &device->image.engine.axis[i];

	if (placed) {
		axis->position = status->position[i];
		axis->state = status->axis_state[i];
	}
	axis->limit_minus = status->limit_neg >> i & 1;
	axis->limit_plus = status->limit_pos >> i & 1;
	axis->home = status->home >> i & 1;
	axis->error = status->driver_error >> i & 1;
	axis->soft_limit = status->soft_limits >> i & 1;
	axis->enabled = device->motion.driven >> i & 1;
	axis->following_error = 0;
	if (axis->enabled && axis->mode != POKEYS_AXIS_VELOCITY)
		axis->following_error = (int32_t)((uint32_t)moving_axis_asked(device, i) -
						  (uint32_t)axis->position);
}

/*
 * A limit switch that is set up was reached: the device stops the engine within a millisecond, if
 * nothing else does.
 */
static bool hits_limit(const struct device *device, const struct wire_pulse_status_rep *status)
{
	const struct pokeys_engine *before = &device->image.engine;
	const uint8_t minus = status->limit_neg & (uint8_t)~before->limit_minus;
	const uint8_t plus = status->limit_pos & (uint8_t)~before->limit_plus;

	if (before->state != WIRE_ENGINE_RUNNING || status->engine_state != WIRE_ENGINE_RUNNING ||
	    status->limit_override)
		return false;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const uint8_t set_up =
			device->configure.setting[SETTING_AXIS + i].value.axis.config.switches;

		if ((minus >> i & 1 && set_up & WIRE_SWITCH_LIMIT_N) ||
		    (plus >> i & 1 && set_up & WIRE_SWITCH_LIMIT_P))
			return true;
	}
	return false;
}

/*
 * The trip may never be seen: whoever sees the switch stops the machine, and the stop that is sent
 * then ends the engine's state of being tripped.
 */
static void count_stops(struct device *device, const struct wire_pulse_status_rep *status)
{
	struct pokeys_engine *engine = &device->image.engine;

	if (hits_limit(device, status) ||
	    (status->engine_state != engine->state && engine_tripped(status->engine_state)))
		engine->stops++;
}

static void take_engine_state(struct device *device, uint8_t state)
{
	const uint8_t before = device->image.engine.state;

	device->image.engine.state = state;
	if (state != before && (engine_tripped(state) || engine_tripped(before)))
		device_say(device, EVENT_ENGINE, engine_tripped(state) ? EVENT_ERROR : EVENT_NOTICE,
			   state, before, 0);
}

/* 0 = there is none. */
static unsigned int emergency_terminal(const struct device *device)
{
	const struct wire_model *model = device->identify.identity.model;
	const uint8_t set = device->image.engine.emergency_pin;

	if (set > WIRE_EMERGENCY_PIN_BASE)
		return set - WIRE_EMERGENCY_PIN_BASE;
	return set == WIRE_EMERGENCY_PIN_DEFAULT && model ? model->pinmap->emergency : 0u;
}

/*
 * The emergency input itself, where it is a terminal that is a digital input: an
 * engine that stands does not latch it (protocol section 5.3). Raw levels count,
 * so the pin's own invert bit is taken out again.
 */
static bool emergency_input(const struct device *device)
{
	const struct pokeys_engine *engine = &device->image.engine;
	const unsigned int pin = emergency_terminal(device) - 1u;
	uint8_t function;
	bool level;

	if (pin >= POKEYS_PINS)
		return false;
	function = device->image.pin_function[pin];
	level = device->image.digital_in[pin / 8] >> pin % 8 & 1;
	return function & WIRE_PIN_INPUT &&
	       (level != !!(function & WIRE_PIN_INVERT)) != !!engine->emergency_invert;
}

bool decode_status(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_pulse_status_rep status;

	wire_pulse_status_decode_rep(entry->response_buffer, &status);
	if (!decode_engine(device, &status, entry->timestamp_first_sent, entry->timestamp_received))
		return false;
	buffer_status(device, &status, entry->timestamp_first_sent);
	buffer_watch(device, &status, entry->timestamp_first_sent);
	return true;
}

/* The device has one for all axes: it cannot be narrowed to those that stand on a switch. */
static void take_override(struct device *device, uint8_t override)
{
	struct pokeys_engine *engine = &device->image.engine;

	if (!engine->limit_override != !override)
		device_say(device, EVENT_LIMIT_OVERRIDE, override ? EVENT_NOTICE : EVENT_INFO,
			   override != 0, 0, 0);
	engine->limit_override = override;
}

bool decode_engine(struct device *device, const struct wire_pulse_status_rep *from,
		   uint64_t asked_ns, uint64_t came_ns)
{
	struct pokeys_engine *engine = &device->image.engine;
	const struct wire_pulse_status_rep status = *from;
	const bool placed = place_take(device, from, asked_ns, came_ns);

	count_stops(device, &status);
	take_engine_state(device, status.engine_state);
	engine->axes_enabled = status.axes_enabled;
	engine->activated = status.activated;
	take_override(device, status.limit_override);
	engine->charge_pump = status.charge_pump;
	engine->generator = status.generator;
	engine->misc_inputs = status.misc_inputs;
	engine->buffer_slots = status.buffer_slots;
	engine->power_states = status.power_states;
	engine->slot_time = status.slot_time;
	engine->emergency_invert = status.emergency_invert;
	engine->emergency = status.engine_state == WIRE_ENGINE_STOP_EMERGENCY ||
			    emergency_input(device);
	engine->limit_minus = status.limit_neg;
	engine->limit_plus = status.limit_pos;
	engine->home = status.home;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		take_axis(device, i, &status, placed);
	if (placed) {
		device->image.t_motion_ns = came_ns;
		device->motion.status_ns = asked_ns;
	}
	return placed;
}
