/* SPDX-License-Identifier: MIT */
/*
 * What a device says about itself: protocol sections 1.9, 2.1 and 2.2.
 *
 * Two generations of replies exist, and each field must be taken from the
 * right one: without "PKEx" or "PK58" in the device data only the 16-bit
 * serial number and the first firmware byte are real; a discovery reply is
 * told from the other format by its length alone. The firmware byte has the
 * major number minus one in its high nibble, and is used coded in discovery
 * too, though the documentation only says "major, minor" there.
 */

#include "wire/model.h"

struct wire_version wire_firmware(uint8_t code, uint8_t revision)
{
	return (struct wire_version){
		.major = (uint8_t)(1 + ((code & 0x7F) >> 4)),
		.minor = code & 0x0F,
		.revision = revision,
		.boot56 = (code & 0x80) != 0,
	};
}

uint8_t wire_firmware_code(const struct wire_version *version)
{
	return (uint8_t)((version->boot56 ? 0x80 : 0) | ((version->major - 1) & 0x07) << 4 |
			 (version->minor & 0x0F));
}

bool wire_firmware_at_least(const struct wire_version *version, uint8_t major, uint8_t minor,
			    uint8_t revision)
{
	if (version->major != major)
		return version->major > major;
	if (version->minor != minor)
		return version->minor > minor;
	return version->revision >= revision;
}

void wire_identify(const struct wire_device_data_rep *data, struct wire_identity *identity)
{
	memset(identity, 0, sizeof(*identity));
	identity->extended = !memcmp(data->magic, "PKEx", 4) || !memcmp(data->magic, "PK58", 4);
	if (identity->extended) {
		identity->serial = data->serial;
		identity->firmware = wire_firmware(data->firmware, data->revision);
		identity->hardware = data->hardware;
	} else {
		identity->serial = data->serial_low;
		identity->firmware = wire_firmware(data->firmware_old, data->revision_old);
	}
	identity->model = wire_model(identity->hardware);
}

int wire_pulse_version(const struct wire_identity *identity)
{
	const struct wire_version *fw = &identity->firmware;

	if (identity->model->features & WIRE_HAS_PULSE_V2)
		return 2;
	if (identity->hardware != WIRE_HW_56E || fw->major != 3)
		return 0;
	if (fw->minor == 1)
		return 2;
	return fw->minor == 0 && fw->revision >= 59 ? 1 : 0;
}

void wire_device_label(const struct wire_device_name_rep *name, char out[21])
{
	const size_t len = sizeof(name->name) - 1;
	const bool use_long = !strncmp(name->long_name, name->name, len);
	const char *from = use_long ? name->long_name : name->name;

	memset(out, 0, 21);
	memcpy(out, from, strnlen(from, use_long ? sizeof(name->long_name) - 1 : len));
}

enum wire_reason wire_discovery_decode(const uint8_t *p, size_t len, struct wire_discovery *d)
{
	if (len != WIRE_DISCOVERY_LEN && len != WIRE_DISCOVERY_OLD_LEN)
		return WIRE_LENGTH;
	memset(d, 0, sizeof(*d));
	d->old_format = len == WIRE_DISCOVERY_OLD_LEN;
	d->user_id = p[0];
	d->firmware = p[3];
	d->revision = p[4];
	memcpy(d->ip, p + 5, 4);
	d->dhcp = p[9];
	memcpy(d->host_ip, p + 10, 4);
	d->serial = d->old_format ? wire_get_u16be(p + 1) : wire_get_u32(p + 14);
	d->hardware = d->old_format ? 0 : p[18];
	return WIRE_OK;
}

size_t wire_discovery_encode(uint8_t p[WIRE_DISCOVERY_LEN], const struct wire_discovery *d)
{
	memset(p, 0, WIRE_DISCOVERY_LEN);
	p[0] = d->user_id;
	p[3] = d->firmware;
	p[4] = d->revision;
	memcpy(p + 5, d->ip, 4);
	p[9] = d->dhcp;
	memcpy(p + 10, d->host_ip, 4);
	if (d->old_format) {
		wire_put_u16be(p + 1, (uint16_t)d->serial);
		return WIRE_DISCOVERY_OLD_LEN;
	}
	wire_put_u32(p + 14, d->serial);
	p[18] = d->hardware;
	return WIRE_DISCOVERY_LEN;
}
