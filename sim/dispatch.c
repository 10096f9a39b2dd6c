// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * From a datagram to its one reply.
 *
 * The vendor's library is wedged for good by a second or a late reply, so the
 * rule is kept here and nowhere else: one valid request, one reply, or none
 * and a counter which says why (protocol sections 1.5 and 1.7).
 *
 * A repeated request id is executed again. The device has no replay
 * protection, and a simulator with one would hide a client which sends a
 * one-shot twice.
 */
#include "sim/request.h"

static const sim_handler handlers[256] = {
	[0x00] = sim_do_device_data,
	[0x02] = sim_do_set_user_id,
	[0x03] = sim_do_user_id,
	[0x04] = sim_do_build_date,
	[0x05] = sim_do_load,
	[0x06] = sim_do_name,
	[0x07] = sim_do_usb,
	[0x08] = sim_do_delayed_start,
	[0x09] = sim_do_decoder,
	[0x0A] = sim_do_session,
	[0x0B] = sim_do_misc_usb,
	[0x10] = sim_do_pin_set,
	[0x11] = sim_do_encoder_set,
	[0x15] = sim_do_pin_get,
	[0x16] = sim_do_encoder_get,
	[0x19] = sim_do_encoder_raw,
	[0x1A] = sim_do_encoder_raw,
	[0x1B] = sim_do_connection_signal,
	[0x1C] = sim_do_ultra_encoder,
	[0x1D] = sim_do_counter_reset,
	[0x1E] = sim_do_startup,
	[0x1F] = sim_do_pin_caps,
	[0x21] = sim_do_typematic,
	[0x22] = sim_do_typematic,
	[0x30] = sim_do_input,
	[0x31] = sim_do_inputs,
	[0x32] = sim_do_inputs,
	[0x35] = sim_do_analog_one,
	[0x36] = sim_do_analog_packed,
	[0x37] = sim_do_analog_packed,
	[0x38] = sim_do_analog_filter,
	[0x39] = sim_do_analog_filter,
	[0x3A] = sim_do_analog_all,
	[0x40] = sim_do_output,
	[0x41] = sim_do_analog_out,
	[0x42] = sim_do_outputs,
	[0x43] = sim_do_outputs,
	[0x4A] = sim_do_servo,
	[0x4B] = sim_do_strip,
	[0x4C] = sim_do_blip,
	[0x50] = sim_do_save,
	[0x51] = sim_do_save,
	[0x52] = sim_do_save,
	[0x76] = sim_do_sensor_setup,
	[0x77] = sim_do_sensor_values,
	[0x81] = sim_do_failsafe,
	[0x82] = sim_do_poil,
	[0x83] = sim_do_clock,
	[0x84] = sim_do_log,
	[0x85] = sim_do_engine,
	[0x86] = sim_do_can,
	[0x8F] = sim_do_activation,
	[0xA2] = sim_do_udp_map,
	[0xB0] = sim_do_fill_part,
	[0xC0] = sim_do_pin_all,
	[0xC1] = sim_do_key_map,
	[0xC2] = sim_do_key_map,
	[0xC3] = sim_do_key_map,
	[0xC4] = sim_do_encoder_options,
	[0xC5] = sim_do_encoder_pins,
	[0xC6] = sim_do_encoder_keys,
	[0xC7] = sim_do_encoder_keys,
	[0xCA] = sim_do_keyboard,
	[0xCB] = sim_do_pwm,
	[0xCC] = sim_do_io,
	[0xCD] = sim_do_encoder_values,
	[0xCE] = sim_do_fast_encoders,
	[0xCF] = sim_do_tick,
	[0xD0] = sim_do_lcd_setup,
	[0xD1] = sim_do_lcd,
	[0xD5] = sim_do_led_setup,
	[0xD6] = sim_do_led,
	[0xD7] = sim_do_key_triggered,
	[0xD8] = sim_do_counters,
	[0xD9] = sim_do_counter_dirs,
	[0xDA] = sim_do_poext,
	[0xDB] = sim_do_i2c,
	[0xDC] = sim_do_onewire,
	[0xDD] = sim_do_ponet,
	[0xDE] = sim_do_uart,
	[0xE0] = sim_do_network,
	[0xE1] = sim_do_security_status,
	[0xE2] = sim_do_authorise,
	[0xE3] = sim_do_password,
	[0xE4] = sim_do_modbus,
	[0xE5] = sim_do_spi,
	[0xE6] = sim_do_pocan,
	[0xEF] = sim_do_reports,
	[0xF3] = sim_do_reboot,
	[0xFD] = sim_do_oem,
};

const char *sim_drop_name(enum sim_drop drop)
{
	static const char *const names[SIM_DROPS] = {
		[SIM_DROP_LENGTH] = "length",     [SIM_DROP_HEADER] = "header",
		[SIM_DROP_CHECKSUM] = "checksum", [SIM_DROP_UNKNOWN] = "unknown",
		[SIM_DROP_REFUSED] = "refused",   [SIM_DROP_BOOTING] = "booting",
		[SIM_DROP_SILENT] = "silent",
	};

	return (unsigned int)drop < SIM_DROPS ? names[drop] : "?";
}

static size_t drop(struct sim_device *dev, enum sim_drop why)
{
	dev->stats.dropped[why]++;
	return 0;
}

/* What a locked device still answers: who it is, and how to unlock it. */
static bool is_public(uint8_t op)
{
	switch (op) {
	case 0x00:
	case 0x03:
	case 0x04:
	case 0x05:
	case 0x8F:
	case 0xCF:
	case 0xE1:
	case 0xE2:
		return true;
	default:
		return false;
	}
}

static bool is_refused(const struct sim_device *dev, uint8_t op)
{
	return dev->options.choices.enforce_security && dev->run.security_level > 0 &&
	       !is_public(op);
}

/* Length, header byte and checksum of every part; the reason to drop it, or -1. */
static int check(const uint8_t *req, size_t len)
{
	if (len != WIRE_PK && len != SIM_MULTI)
		return SIM_DROP_LENGTH;
	for (size_t at = 0; at < len; at += WIRE_PK) {
		if (req[at] != WIRE_REQUEST)
			return SIM_DROP_HEADER;
		if (req[at + WIRE_AT_SUM] != wire_checksum(req + at))
			return SIM_DROP_CHECKSUM;
	}
	return -1;
}

/* Operations a model does not have for want of the hardware (section 2.4). */
static bool is_missing(const struct sim_device *dev, uint8_t op)
{
	static const uint32_t needed[256] = {
		[0x1D] = WIRE_HAS_COUNTERS,  [0xD8] = WIRE_HAS_COUNTERS, [0xD9] = WIRE_HAS_COUNTERS,
		[0x35] = WIRE_HAS_ANALOG,    [0x36] = WIRE_HAS_ANALOG,   [0x37] = WIRE_HAS_ANALOG,
		[0x38] = WIRE_HAS_ANALOG,    [0x39] = WIRE_HAS_ANALOG,   [0x3A] = WIRE_HAS_ANALOG,
		[0xCA] = WIRE_HAS_MATRIX_KB, [0xD0] = WIRE_HAS_LCD,      [0xD1] = WIRE_HAS_LCD,
		[0xDB] = WIRE_HAS_I2C,       [0xDC] = WIRE_HAS_1WIRE,    [0xDD] = WIRE_HAS_PONET,
		[0x85] = WIRE_HAS_PULSE_V2,  [0xB0] = WIRE_HAS_PULSE_V2,
	};

	return needed[op] & ~wire_model(dev->options.hardware)->features;
}

static enum sim_answer run(struct sim_device *dev, const uint8_t *req, size_t len, uint8_t *reply)
{
	uint8_t op = req[WIRE_AT_OP];

	dev->stats.requests++;
	dev->stats.executed[op]++;
	if (is_missing(dev, op))
		return SIM_ANSWER_UNKNOWN;
	if (len == SIM_MULTI)
		return sim_do_multi_fill(dev, req, reply);
	if (!handlers[op])
		return SIM_ANSWER_UNKNOWN;
	return handlers[op](dev, req, reply);
}

size_t sim_device_request(struct sim_device *dev, uint64_t now_ns, const uint8_t *req, size_t len,
			  uint8_t reply[WIRE_PK])
{
	enum sim_answer answer;
	int why;

	sim_device_advance(dev, now_ns);
	if (now_ns < dev->run.dead_until_ns)
		return drop(dev, SIM_DROP_BOOTING);
	why = check(req, len);
	if (why >= 0)
		return drop(dev, (enum sim_drop)why);
	if (is_refused(dev, req[WIRE_AT_OP]))
		return drop(dev, SIM_DROP_REFUSED);
	dev->run.heard_ns = now_ns;
	dev->run.failsafe_applied = false;

	memset(reply, 0, WIRE_PK);
	reply[WIRE_AT_MAGIC] = WIRE_REPLY;
	reply[WIRE_AT_OP] = req[WIRE_AT_OP];
	answer = run(dev, req, len, reply);
	if (dev->dirty)
		sim_pins_settle(dev);
	if (answer == SIM_ANSWER_NONE)
		return drop(dev, SIM_DROP_SILENT);
	if (answer == SIM_ANSWER_UNKNOWN) {
		dev->stats.unknown++;
		if (dev->options.choices.drop_unknown)
			return drop(dev, SIM_DROP_UNKNOWN);
	}
	wire_finish(reply, req[len - WIRE_PK + WIRE_AT_ID]);
	dev->stats.replies++;
	return WIRE_PK;
}
