// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Who the device says it is (protocol section 2.1).
 *
 * The serial number stands twice in the reply to 0x00: the low 16 bits big
 * endian in the header, where series 55 and 56 have their only one, and 32
 * bits little endian in the extended block. The vendor's library takes the
 * long name only if its first ten characters equal the short one, so both are
 * kept from one name.
 */
#include "sim/request.h"

#include <stdio.h>

#define BUILD_DATE "Mar 14 2025"

/* Fills a field which need not be terminated. */
static void put_text(char *field, size_t size, const char *text)
{
	size_t len = strnlen(text, size);

	memset(field, 0, size);
	memcpy(field, text, len);
}

void sim_identity_defaults(struct sim_device *dev)
{
	struct sim_identity_config *id = &dev->config.identity;
	char name[40];

	if (dev->options.name)
		snprintf(name, sizeof(name), "%s", dev->options.name);
	else
		snprintf(name, sizeof(name), "SimPoKeys%s",
			 sim_hardware_name(dev->options.hardware));
	put_text(id->name, sizeof(id->name), name);
	put_text(id->long_name, sizeof(id->long_name), name);
	put_text(id->joystick_name, sizeof(id->joystick_name), "PoKeys joystick");
	id->user_id = dev->options.user_id;
}

SIM_HANDLER(sim_do_device_data)
{
	const struct sim_identity_config *id = &dev->config.identity;
	const struct sim_device_options *own = &dev->options;

	(void)rq;
	wire_put_u16be(rp + 2, (uint16_t)own->serial);
	rp[4] = own->firmware_major;
	rp[5] = own->firmware_revision;
	if (own->hardware == WIRE_HW_56E)
		return SIM_ANSWER;
	memcpy(rp + 8, "PKEx", 4);
	wire_put_u32(rp + 12, own->serial);
	rp[16] = own->firmware_major;
	rp[17] = own->firmware_revision;
	rp[18] = own->hardware;
	rp[19] = id->user_id;
	memcpy(rp + 20, BUILD_DATE, 11);
	memcpy(rp + 31, id->name, sizeof(id->name));
	rp[57] = id->product_offset;
	rp[58] = id->locked;
	rp[59] = own->firmware_major;
	rp[60] = own->firmware_revision;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_set_user_id)
{
	if (!sim_locked(dev))
		dev->config.identity.user_id = rq[P1];
	rp[P1] = dev->config.identity.user_id;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_user_id)
{
	(void)rq;
	rp[P1] = dev->config.identity.user_id;
	rp[P2] = dev->config.identity.locked;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_build_date)
{
	(void)dev;
	if (rq[P1] <= 2) {
		memcpy(rp + 2, &BUILD_DATE[4 * rq[P1]], rq[P1] < 2 ? 4 : 3);
	} else if (rq[P1] == 10) {
		rp[2] = 1;
		rp[3] = 1;
		rp[4] = 57;
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_load)
{
	(void)rq;
	rp[P1] = dev->bench.load_percent;
	return SIM_ANSWER;
}

/*
 * A client which writes the long name may leave the short one out. The device then
 * is called by the beginning of the long one, or it would have no name in 0x00.
 */
static void set_name(struct sim_identity_config *id, const uint8_t *rq)
{
	bool is_long = rq[P2] == 1;

	if (is_long)
		memcpy(id->long_name, rq + 35, sizeof(id->long_name));
	memcpy(id->name, is_long && !rq[8] ? rq + 35 : rq + 8, sizeof(id->name));
}

SIM_HANDLER(sim_do_name)
{
	struct sim_identity_config *id = &dev->config.identity;
	uint8_t what = rq[P1];

	if (!sim_locked(dev)) {
		if (what & 1)
			set_name(id, rq);
		if (what & 2)
			memcpy(id->joystick_name, rq + 18, sizeof(id->joystick_name));
		if (what & 8)
			id->product_offset = rq[34];
	}
	memcpy(rp + 8, id->name, sizeof(id->name));
	memcpy(rp + 18, id->joystick_name, sizeof(id->joystick_name));
	rp[34] = id->product_offset;
	memcpy(rp + 35, id->long_name, sizeof(id->long_name));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_usb)
{
	if (rq[P1] != 10 && !sim_locked(dev))
		dev->config.identity.usb = rq[P1];
	rp[P1] = dev->config.identity.usb;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_delayed_start)
{
	if (rq[P1] == 1 && !sim_locked(dev))
		dev->config.identity.delayed_start = rq[P2];
	rp[P1] = rq[P1];
	rp[P2] = dev->config.identity.delayed_start;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_session)
{
	if (rq[P1] == 0x10)
		memcpy(dev->run.session, rq + 8, sizeof(dev->run.session));
	rp[P1] = rq[P1];
	memcpy(rp + 8, dev->run.session, sizeof(dev->run.session));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_misc_usb)
{
	struct sim_identity_config *id = &dev->config.identity;

	if (rq[P1] == 0x10 && !sim_locked(dev))
		memcpy(id->misc_usb, rq + 8, sizeof(id->misc_usb));
	rp[P1] = rq[P1];
	memcpy(rp + 8, id->misc_usb, sizeof(id->misc_usb));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_activation)
{
	if (rq[P1] == 1 && !sim_locked(dev))
		dev->config.identity.activated |= 1;
	if (rq[P1] == 0xFF && !sim_locked(dev))
		dev->config.identity.activated = 0;
	rp[8] = dev->config.identity.activated;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_tick)
{
	(void)rq;
	wire_put_u32(rp + 2, sim_device_tick(dev));
	return SIM_ANSWER;
}
