/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The servo motors of a device (daemon/loops/servo.h) between its encoders and its outputs.
 *
 * The outputs of a motor belong to this motor only. No commander can switch them, and the safe
 * state does not change them: whatever is lost, the motor's controller finds it in the same cycle,
 * and its output is 0. It does not wait for machine-on, which belongs to the pulse engine; the
 * commander enables each motor by itself. The commander's emergency stop (whatever on-emergency
 * says), the emergency input of the pulse engine, and the daemon's end are an emergency stop.
 *
 * If this daemon or its computer fails, only the device can stop a motor. So a motor is ready only
 * while the device's failsafe is known to do that, by its enable wire or by its PWM outputs, or
 * with without-failsafe = yes.
 *
 * While it is doubted that the device is still the same one (plan.c), no counts are taken and
 * nothing is written but off. So a motor has no readings, and soon stops for want of them.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define UNHEARD_NS (200 * MS)
#define THOUSANDTHS_MOST 1e15

/* The image shows the numbers of the loops. */
#define SAME(a, b) _Static_assert((int)(a) == (int)(b), #a " is not " #b)
SAME(SERVO_DEVICE, POKEYS_SERVO_DEVICE);
SAME(SERVO_FOLLOWING, POKEYS_SERVO_FOLLOWING);
SAME(SERVO_HEATER, POKEYS_SERVO_HEATER);
SAME(SERVO_FAULTS, POKEYS_SERVO_HEATER + 1);
SAME(SERVO_UNREAD, POKEYS_SERVO_UNREAD);
SAME(SERVO_STALE_MOST_NS, POKEYS_SERVO_STALE_MOST_NS);

static const struct servoing_config *config_of(const struct device *device, unsigned int i)
{
	return &device->config.servo[i];
}

void servoing_init(struct device *device)
{
	struct servoings *servoings = &device->servoings;

	servoings->count = device->config.servos < POKEYS_SERVOS ? device->config.servos :
								   POKEYS_SERVOS;
	for (unsigned int i = 0; i < servoings->count; i++) {
		struct servoing *servoing = &servoings->servoing[i];
		const struct servoing_config *config = config_of(device, i);

		servoing->good = !servo_init(&servoing->servo, &config->servo);
		if (servo_home_init(&servoing->home, &config->home, &config->servo))
			servoing->good = false;
	}
}

static uint64_t pin_bit(uint8_t pin)
{
	return pin < POKEYS_PINS ? UINT64_C(1) << pin : 0;
}

static uint8_t channel_bit(uint8_t channel)
{
	return (uint8_t)(channel < POKEYS_PWM ? 1u << channel : 0);
}

static uint8_t channels_of(const struct servoing_config *config)
{
	return (uint8_t)(channel_bit(config->pwm) | channel_bit(config->reverse_pwm));
}

static bool disables(const struct wire_failsafe_req *failsafe, const struct servoing_config *config)
{
	return config->enable != SERVOING_NONE && failsafe->peripherals & WIRE_FAILSAFE_DIGITAL &&
	       !(failsafe->outputs >> config->enable & 1);
}

/* With antiphase, a duty of 0 is full speed backwards. */
static bool ends_pwm(const struct wire_failsafe_req *failsafe, const struct servoing_config *config)
{
	if (config->drive.kind == DRIVE_ANTIPHASE)
		return false;
	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		if (channels_of(config) >> i & 1 && failsafe->pwm_percent[i])
			return false;
	return failsafe->peripherals & WIRE_FAILSAFE_PWM;
}

/* Does this motor stop when nobody has talked to the device for long enough? */
static bool stops(const struct wire_failsafe_req *failsafe, const struct servoing_config *config)
{
	return failsafe && failsafe->timeout &&
	       (disables(failsafe, config) || ends_pwm(failsafe, config));
}

/* ... soon: silence is worth it. */
static bool helps(const struct wire_failsafe_req *failsafe, const struct servoing_config *config)
{
	return stops(failsafe, config) && failsafe->timeout <= SERVOING_FAILSAFE_MOST;
}

static bool is_covered(const struct device *device, const struct servoing_config *config)
{
	return config->without_failsafe || helps(failsafe_known(device), config);
}

/* An inverted output would be on when it is off. */
bool servoing_is_as_wanted(const struct device *device, uint8_t pin, uint8_t function)
{
	return pin == SERVOING_NONE ||
	       (device->image.pin_function[pin] & function &&
		device->image.pin_function[pin] == device->config.settings.pin_function[pin]);
}

static bool has_channel(const struct device *device, uint8_t channel)
{
	return loops_have_pwm(device, channel, SERVOING_PERIOD_LEAST, SERVOING_PERIOD_MOST);
}

static bool has_pwm(const struct device *device, const struct servoing_config *config)
{
	return has_channel(device, config->pwm) &&
	       (config->reverse_pwm == SERVOING_NONE || has_channel(device, config->reverse_pwm));
}

static enum pokeys_obstacle obstacle_of(const struct device *device, unsigned int i)
{
	const struct servoing_config *config = config_of(device, i);
	const struct servoing *servoing = &device->servoings.servoing[i];

	if (!servoing->good)
		return POKEYS_OBSTACLE_CONFIG;
	if (!running(device))
		return POKEYS_OBSTACLE_LINK;
	if (servoing->shared)
		return POKEYS_OBSTACLE_SHARED;
	if (!(device->image.encoder_enabled >> config->encoder & 1))
		return POKEYS_OBSTACLE_ENCODER;
	if (servoing_index_resets(device, config->encoder))
		return POKEYS_OBSTACLE_INDEX;
	if (!servoing_is_as_wanted(device, config->direction, WIRE_PIN_OUTPUT) ||
	    !servoing_is_as_wanted(device, config->enable, WIRE_PIN_OUTPUT))
		return POKEYS_OBSTACLE_OUTPUT;
	if (!servoing_is_as_wanted(device, config->low, WIRE_PIN_INPUT) ||
	    !servoing_is_as_wanted(device, config->high, WIRE_PIN_INPUT))
		return POKEYS_OBSTACLE_LIMIT;
	if (!has_pwm(device, config))
		return POKEYS_OBSTACLE_PWM;
	return is_covered(device, config) ? POKEYS_OBSTACLE_NONE : POKEYS_OBSTACLE_FAILSAFE;
}

bool servoing_covered(const struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (!config_of(device, i)->without_failsafe)
			return true;
	return false;
}

void servoing_unshare(struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++)
		device->servoings.servoing[i].shared = false;
}

void servoing_share(struct device *device, const char *key, unsigned int index)
{
	static const char prefix[] = "servo.";

	if (!strncmp(key, prefix, sizeof(prefix) - 1) && index < device->servoings.count)
		device->servoings.servoing[index].shared = true;
}

bool servoing_is_pressed(const struct device *device, uint8_t pin, bool inverted)
{
	return pin != SERVOING_NONE && (pins_load(device->image.digital_in) >> pin & 1) != inverted;
}

static struct servo_input input_of(const struct device *device, unsigned int i)
{
	const struct servoing_config *config = config_of(device, i);

	return (struct servo_input){
		.counts = device->image.encoder[config->encoder],
		.read_ns = device->image.encoder_t_ns[config->encoder],
		.asked_ns = device->encoder[config->encoder].asked_ns,
		.usable = obstacle_of(device, i) == POKEYS_OBSTACLE_NONE,
		.epoch = (uint32_t)device->servoings.counts_epoch[config->encoder] << 8 |
			 device->image.encoder_epoch,
		.slips = device->encoder[config->encoder].slips,
		.emergency = safe_emergency(device),
		.heater = heating_stops_machine(device),
		.low = servoing_is_pressed(device, config->low, config->low_inverted),
		.high = servoing_is_pressed(device, config->high, config->high_inverted),
		.seeks_low = servoing_seeks(device, i, true),
		.seeks_high = servoing_seeks(device, i, false),
	};
}

static uint32_t ticks(double duty, uint32_t period)
{
	return (uint32_t)llround(duty * period);
}

static uint64_t pins_of(const struct servoing_config *config)
{
	return pin_bit(config->direction) | pin_bit(config->enable);
}

static uint64_t pins_on(const struct servoing_config *config, const struct drive_wires *wires)
{
	return (wires->reverse ? pin_bit(config->direction) : 0) |
	       (wires->enable ? pin_bit(config->enable) : 0);
}

/* Has the device acknowledged what is on the wires, and is nothing else under way to it? */
static bool is_settled(const struct device *device, unsigned int i)
{
	const struct servoing_config *config = config_of(device, i);
	const struct drive_wires *wires = &device->servoings.servoing[i].wires;
	const uint32_t period = device->outputs.output[OUTPUT_PWM].have.pwm.period;

	return safe_pins_settled(device, pins_of(config), pins_on(config, wires)) &&
	       loops_duty_settled(device, config->pwm, ticks(wires->duty[0], period)) &&
	       (config->reverse_pwm == SERVOING_NONE ||
		loops_duty_settled(device, config->reverse_pwm, ticks(wires->duty[1], period)));
}

static int64_t thousandths(double units)
{
	return fabs(units) < THOUSANDTHS_MOST ? (int64_t)llround(units * 1000) : 0;
}

static void say_left(struct device *device, unsigned int i)
{
	device_say(device, EVENT_SERVO_LEFT, EVENT_WARNING, i, 0,
		   thousandths(device->servoings.servoing[i].servo.position));
}

/* Log what has changed since the last call. */
static void say(struct device *device, unsigned int i, bool was_enabled)
{
	struct servoing *servoing = &device->servoings.servoing[i];
	const struct servo *servo = &servoing->servo;
	const int64_t position = thousandths(servo->position);

	if (servo->fault != servoing->fault) {
		servoing->faults += servo->fault != SERVO_FINE;
		device_say(device, EVENT_SERVO, servo->fault ? EVENT_ERROR : EVENT_NOTICE, i,
			   servo->fault, position);
	}
	if (servo->refusal != servoing->refusal && servo->refusal)
		device_say(device, EVENT_SERVO_REFUSED, EVENT_WARNING, i, servo->refusal,
			   servo->condition);
	if (was_enabled && !servo->enabled && !servo->fault && !device->intake.fresh)
		say_left(device, i);
	servoing->fault = (uint8_t)servo->fault;
	servoing->refusal = (uint8_t)servo->refusal;
}

static struct servo_wish wish_of(const struct device *device, unsigned int i)
{
	const struct servoing_wish *wanted = &device->intake.servoing[i];

	return (struct servo_wish){
		.alive = device->intake.fresh && !device->safe.stopping,
		.blind = !device->intake.read_recently,
		.enable = wanted->enable,
		.position = wanted->position,
		.velocity = wanted->velocity,
	};
}

static void step(struct device *device, unsigned int i)
{
	const struct servoing_config *config = config_of(device, i);
	struct servoing *servoing = &device->servoings.servoing[i];
	struct servo_wish wish = wish_of(device, i);
	const bool was_enabled = servoing->servo.enabled;
	const bool settled = is_settled(device, i);
	struct servo_input input;
	double output;

	servoing_home_step(device, i, &wish);
	moving_wish(device, i, &wish);
	servoing_tune_step(device, i, settled);
	input = input_of(device, i);
	output = servo_step(&servoing->servo, &input, &wish, device->now_ns);
	/* in a doubt only off is written (plan.c): what is enabled keeps what it has */
	if (!servoing->servo.enabled || !plan_doubts(device))
		servoing->wires = drive_step(&servoing->drive, &config->drive,
					     config->inverted ? -output : output,
					     servoing->servo.enabled, settled, device->now_ns);
	say(device, i, was_enabled);
	if (servoing->servo.enabled)
		left_on(&servoing->driven);
	else if (servoing->driven.on && !servoing->driven.off_ns)
		left_off(device, &servoing->driven, false);
}

void servoing_session(struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++) {
		struct servo *servo = &device->servoings.servoing[i].servo;

		if (servo->enabled)
			say_left(device, i);
		servo_another(servo);
	}
}

static bool is_stopping(const struct servoing *servoing)
{
	return servoing->driven.on && !servoing->servo.enabled;
}

static enum pokeys_servo_state state_of(const struct servoing *servoing)
{
	if (is_stopping(servoing))
		return POKEYS_SERVO_STOPPING;
	if (servoing->servo.fault)
		return POKEYS_SERVO_FAULT;
	return servoing->servo.enabled ? POKEYS_SERVO_ENABLED : POKEYS_SERVO_OFF;
}

static void show_gains(struct pokeys_servo *image, const struct servo_gains *gains)
{
	image->p = (float)gains->p;
	image->i = (float)gains->i;
	image->d = (float)gains->d;
	image->velocity_gain = (float)gains->velocity;
	image->acceleration_gain = (float)gains->acceleration;
}

static void show(struct device *device, unsigned int i)
{
	const struct servoing *servoing = &device->servoings.servoing[i];
	const struct servoing_config *config = config_of(device, i);
	const struct servo *servo = &servoing->servo;
	struct pokeys_servo *image = &device->image.servo[i];

	image->t_ns = servo->read_ns;
	image->position = servo->position;
	image->commanded = servo->enabled ? servo->wanted : servo->position;
	image->counts_per_unit = config->servo.scale;
	image->velocity = (float)servo->rate;
	image->commanded_velocity = (float)servo->wanted_rate;
	image->error = (float)servo->error;
	image->output = (float)servo->output;
	image->minimum = (float)config->servo.least;
	image->maximum = (float)config->servo.most;
	image->max_speed = (float)config->servo.speed_most;
	image->max_acceleration = (float)config->acceleration;
	show_gains(image, &servo->config.gains);
	image->fault_count = servoing->faults;
	image->state = (uint8_t)state_of(servoing);
	image->fault = (uint8_t)servo->fault;
	image->condition = (uint8_t)servo->condition;
	image->obstacle = (uint8_t)(servo->condition == SERVO_DEVICE ? obstacle_of(device, i) :
								       POKEYS_OBSTACLE_NONE);
	image->refused = (uint8_t)servo->refusal;
	image->homed = servo->homed;
	image->low = servoing_is_pressed(device, config->low, config->low_inverted);
	image->high = servoing_is_pressed(device, config->high, config->high_inverted);
	image->encoder = config->encoder;
	servoing_home_show(device, i);
	servoing_tune_show(device, i);
	memcpy(image->name, config->name, sizeof(image->name));
}

/* Has the device taken it that a motor is off? Until then it may run. */
static void follow(struct device *device, unsigned int i)
{
	struct servoing *servoing = &device->servoings.servoing[i];

	if (servoing->driven.on && servoing->driven.off_ns)
		left_off(device, &servoing->driven, is_settled(device, i));
}

/* Not even silence helps: the same is sent again and again, and somebody has to know. */
static void say_unheard(struct device *device, unsigned int i)
{
	struct left_on *driven = &device->servoings.servoing[i].driven;

	if (driven->said || !left_on_long(device, driven, UNHEARD_NS) ||
	    helps(life_failsafe(device), config_of(device, i)))
		return;
	driven->said = true;
	device_say(device, EVENT_SERVO_UNHEARD, EVENT_ERROR, 0, i, 0);
}

bool servoing_unheard(const struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++) {
		const struct left_on *driven = &device->servoings.servoing[i].driven;

		if (left_on_late(device, driven, UNHEARD_NS) &&
		    helps(life_failsafe(device), config_of(device, i)))
			return true;
	}
	return false;
}

void servoing_cycle(struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++) {
		follow(device, i);
		step(device, i);
		say_unheard(device, i);
		show(device, i);
	}
}

void servoing_stopped_itself(struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (stops(life_failsafe(device), config_of(device, i)))
			device->servoings.servoing[i].driven.on = false;
}

void servoing_began_again(struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++)
		device->servoings.servoing[i].driven.on = false;
}

uint64_t servoing_pins(const struct device *device)
{
	uint64_t pins = 0;

	for (unsigned int i = 0; i < device->servoings.count; i++)
		pins |= pins_of(config_of(device, i));
	return pins;
}

uint64_t servoing_pins_stopping(const struct device *device)
{
	uint64_t pins = 0;

	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (is_stopping(&device->servoings.servoing[i]))
			pins |= pins_of(config_of(device, i));
	return pins;
}

uint8_t servoing_channels_stopping(const struct device *device)
{
	unsigned int channels = 0;

	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (is_stopping(&device->servoings.servoing[i]))
			channels |= channels_of(config_of(device, i));
	return (uint8_t)channels;
}

bool servoing_may_run(const struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (device->servoings.servoing[i].driven.on &&
		    helps(life_failsafe(device), config_of(device, i)))
			return true;
	return false;
}

uint64_t servoing_pins_on(const struct device *device)
{
	uint64_t pins = 0;

	for (unsigned int i = 0; i < device->servoings.count; i++)
		pins |= pins_on(config_of(device, i), &device->servoings.servoing[i].wires);
	return pins;
}

uint8_t servoing_channels(const struct device *device)
{
	unsigned int channels = 0;

	for (unsigned int i = 0; i < device->servoings.count; i++)
		channels |= channels_of(config_of(device, i));
	return (uint8_t)channels;
}

void servoing_pwm(const struct device *device, struct wire_pwm_req *pwm)
{
	for (unsigned int i = 0; i < device->servoings.count; i++) {
		const struct servoing_config *config = config_of(device, i);
		const struct drive_wires *wires = &device->servoings.servoing[i].wires;

		pwm->enabled |= channels_of(config);
		if (config->pwm < POKEYS_PWM)
			pwm->duty[config->pwm] = ticks(wires->duty[0], pwm->period);
		if (config->reverse_pwm < POKEYS_PWM)
			pwm->duty[config->reverse_pwm] = ticks(wires->duty[1], pwm->period);
	}
}

bool servoing_off(const struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (device->servoings.servoing[i].servo.enabled)
			return false;
	return true;
}

bool servoing_standing(const struct device *device)
{
	for (unsigned int i = 0; i < device->servoings.count; i++)
		if (device->servoings.servoing[i].driven.on)
			return false;
	return servoing_off(device);
}

bool servoing_reset(struct device *device, unsigned int index)
{
	struct servo_input input;
	struct servo_wish wish;

	if (index >= device->servoings.count)
		return false;
	input = input_of(device, index);
	wish = wish_of(device, index);
	return servo_reset(&device->servoings.servoing[index].servo, &input, &wish);
}

bool servoing_place(struct device *device, unsigned int index, int32_t counts, bool homed)
{
	struct servo *servo;

	if (index >= device->servoings.count)
		return false;
	servo = &device->servoings.servoing[index].servo;
	return servo_place(servo, counts / servo->config.scale, homed);
}

bool servoing_regain(struct device *device, unsigned int index, unsigned int which, double value)
{
	struct servo_gains gains;
	double *const gain[] = {
		[POKEYS_GAIN_P] = &gains.p,
		[POKEYS_GAIN_I] = &gains.i,
		[POKEYS_GAIN_D] = &gains.d,
		[POKEYS_GAIN_VELOCITY] = &gains.velocity,
		[POKEYS_GAIN_ACCELERATION] = &gains.acceleration,
	};
	struct servo *servo;

	if (index >= device->servoings.count || which >= sizeof(gain) / sizeof(gain[0]))
		return false;
	servo = &device->servoings.servoing[index].servo;
	gains = servo->config.gains;
	*gain[which] = value;
	if (!servo_regain(servo, &gains))
		return false;
	show_gains(&device->image.servo[index], &gains);
	device_say(device, EVENT_SERVO_GAIN, EVENT_NOTICE, index, which,
		   (int64_t)llround(value * EVENT_GAIN_SCALE));
	return true;
}
