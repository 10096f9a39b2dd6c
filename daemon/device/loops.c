/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Heaters and servo motors together: outputs, safety and life cycle need no difference. */

#include "daemon/device/loops.h"
#include "daemon/device/internal.h"

void left_on(struct left_on *left)
{
	*left = (struct left_on){ .on = true };
}

/* A device that is searched for acknowledges nothing; the time begins when it was found. */
void left_off(const struct device *device, struct left_on *left, bool settled)
{
	const uint8_t link = device->image.link;

	if (settled) {
		*left = (struct left_on){ .on = false };
		return;
	}
	if (!left->off_ns || link == POKEYS_LINK_SEARCHING || link == POKEYS_LINK_LOST)
		left->asked_ns = device->now_ns;
	if (!left->off_ns)
		left->off_ns = device->now_ns;
}

bool left_on_late(const struct device *device, const struct left_on *left, uint64_t limit_ns)
{
	return left->on && left->off_ns && device->now_ns - left->asked_ns > limit_ns;
}

bool left_on_long(const struct device *device, const struct left_on *left, uint64_t limit_ns)
{
	return left->on && left->off_ns && device->now_ns - left->off_ns > limit_ns;
}

void loops_init(struct device *device)
{
	heating_init(device);
	servoing_init(device);
	moving_init(device);
}

void loops_cycle(struct device *device)
{
	heating_cycle(device);
	moving_cycle(device);
	servoing_cycle(device);
	moving_show(device);
}

void loops_session(struct device *device)
{
	heating_session(device);
	servoing_session(device);
	moving_session(device);
}

uint64_t loops_pins(const struct device *device)
{
	return heating_pins(device) | servoing_pins(device);
}

uint64_t loops_pins_on(const struct device *device)
{
	return heating_pins_on(device) | servoing_pins_on(device);
}

uint8_t loops_channels(const struct device *device)
{
	return heating_channels(device) | servoing_channels(device);
}

/* Of a PWM channel: 0 to 5 are at terminals 22 to 17 (protocol section 2.5). */
static uint64_t pin_of(unsigned int channel)
{
	return UINT64_C(1) << (21 - channel);
}

uint8_t loops_channels_forbidden(const struct device *device)
{
	const uint64_t pins = loops_pins(device);
	unsigned int channels = 0;

	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		channels |= (unsigned int)((pins & pin_of(i)) != 0) << i;
	return (uint8_t)channels;
}

void loops_pwm(const struct device *device, struct wire_pwm_req *pwm)
{
	pwm->enabled &= (uint8_t)~loops_channels_forbidden(device);
	heating_pwm(device, pwm);
	servoing_pwm(device, pwm);
}

/* A board without a terminal for a channel has no capability bit for it. */
bool loops_have_pwm(const struct device *device, unsigned int channel, uint32_t least,
		    uint32_t most)
{
	const struct pokeys_state *image = &device->image;
	const uint64_t pins = image->capability.pwm_pins;

	return channel < image->capability.pwm && (!pins || pins & pin_of(channel)) &&
	       image->pwm_period >= least && image->pwm_period <= most &&
	       setting_synced_channel(device) < 0;
}

bool loops_off(const struct device *device)
{
	return heating_off(device) && servoing_off(device);
}

bool loops_covered(const struct device *device)
{
	return heating_covered(device) || servoing_covered(device);
}

void loops_doubt(struct device *device)
{
	struct output *pwm = &device->outputs.output[OUTPUT_PWM];

	fast_doubt(device, loops_pins(device));
	if (loops_channels(device)) {
		pwm->known = false;
		pwm->mixed = true;
	}
}

uint8_t loops_channels_stopping(const struct device *device)
{
	return heating_channels_stopping(device) | servoing_channels_stopping(device);
}

bool loops_duty_settled(const struct device *device, unsigned int channel, uint32_t duty)
{
	const struct output *pwm = &device->outputs.output[OUTPUT_PWM];

	return pwm->known && pwm->have.pwm.duty[channel] == duty &&
	       device->now_ns >= pwm->pulse_until_ns[channel] &&
	       (!pwm->open || (!pwm->mixed && pwm->sent.pwm.duty[channel] == duty)) &&
	       device->configure.setting[SETTING_PWM].state != SETTING_WRITING;
}

uint64_t loops_pins_stopping(const struct device *device)
{
	return heating_pins_stopping(device) | servoing_pins_stopping(device);
}

bool loops_may_run(const struct device *device)
{
	return heating_may_heat(device) || servoing_may_run(device);
}

void loops_stopped_itself(struct device *device)
{
	heating_stopped_itself(device);
	servoing_stopped_itself(device);
}

void loops_began_again(struct device *device)
{
	heating_began_again(device);
	servoing_began_again(device);
}

void loops_unshare(struct device *device)
{
	heating_unshare(device);
	servoing_unshare(device);
}

void loops_share(struct device *device, const char *key, unsigned int index)
{
	heating_share(device, key, index);
	servoing_share(device, key, index);
}
