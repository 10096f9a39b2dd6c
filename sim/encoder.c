// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Encoder counters (protocol sections 3.8 and 5.2).
 *
 * The shaft has a position in quadrature steps of its own. A counter which
 * counts every second or fourth step follows the shaft's position divided
 * down, not the steps it was given: a hundred turns of one step each way add
 * up to nothing, with any divider.
 *
 * Counters are 32 bits and wrap; 0xCC shows their lowest 8.
 */
#include "sim/engine_part.h"

#define FAST_NO_X4 0x10
#define FAST_INVERT 0x20	/* encoder 1; 2 and 3 in the bits above */
#define ULTRA_INVERT 0x01
#define ULTRA_X4 0x04
#define SPEED_WINDOW_MS 100

static bool is_fast(const struct sim_device *dev, unsigned int k)
{
	return k < 3 && (dev->config.encoders.fast & 0x0F) != 0;
}

/* Steps to a count: 4, 2 or 1; 0 when the encoder is off; negative when inverted. */
static int divider(const struct sim_device *dev, unsigned int k)
{
	const struct sim_encoders_config *config = &dev->config.encoders;
	int steps;

	if (k == SIM_ULTRA_FAST) {
		if (config->ultra_on != 1)
			return 0;
		steps = config->ultra_options & ULTRA_X4 ? 1 : 4;
		return config->ultra_options & ULTRA_INVERT ? -steps : steps;
	}
	if (is_fast(dev, k)) {
		steps = config->fast & FAST_NO_X4 ? 4 : 1;
		return config->fast & (FAST_INVERT << k) ? -steps : steps;
	}
	if (!(config->option[k] & SIM_ENC_ENABLE))
		return 0;
	if (config->option[k] & SIM_ENC_X4)
		return 1;
	return config->option[k] & SIM_ENC_X2 ? 2 : 4;
}

void sim_encoders_reset(struct sim_device *dev)
{
	memset(&dev->encoders, 0, sizeof(dev->encoders));
}

void sim_encoder_turn(struct sim_device *dev, unsigned int encoder, int64_t steps)
{
	struct sim_shaft *shaft = &dev->bench.shaft[encoder];
	int64_t before = shaft->position;
	int steps_per_count = divider(dev, encoder);
	int64_t counts;

	shaft->position += steps;
	if (steps_per_count) {
		int64_t by = steps_per_count < 0 ? -steps_per_count : steps_per_count;

		counts = sim_floor_div(shaft->position, by) - sim_floor_div(before, by);
		if (steps_per_count < 0)
			counts = -counts;
		dev->encoders.raw[encoder] += (uint32_t)counts;
	}
	if (shaft->index_every > 0 && sim_floor_div(before, shaft->index_every) !=
					      sim_floor_div(shaft->position, shaft->index_every))
		sim_encoder_index(dev, encoder);
}

double sim_encoder_counts(const struct sim_device *dev, unsigned int encoder, int64_t steps)
{
	int steps_per_count = divider(dev, encoder);

	return steps_per_count ? (double)steps / steps_per_count : 0;
}

#define SLOWEST_TURN_NS UINT64_C(100000000000)

static uint32_t ticks_since_index(const struct sim_device *dev)
{
	uint64_t ns = dev->now_ns - dev->encoders.index_ns;

	return (uint32_t)((ns < SLOWEST_TURN_NS ? ns : SLOWEST_TURN_NS) * (SIM_TICK_HZ / 1000000u) /
			  1000u);
}

uint32_t sim_spindle_ticks(const struct sim_device *dev)
{
	uint32_t last = dev->encoders.index_ticks, now = ticks_since_index(dev);

	return last && now > last ? now : last;
}

static void ultra_index(struct sim_device *dev)
{
	struct sim_encoders *enc = &dev->encoders;

	enc->index_count++;
	if (enc->index_ns && dev->now_ns - enc->index_ns < SLOWEST_TURN_NS)
		enc->index_ticks = ticks_since_index(dev);
	enc->index_ns = dev->now_ns;
	if (enc->ultra_armed)
		enc->raw[SIM_ULTRA_FAST] = 0;
	enc->ultra_armed = false;
	sim_thread_index(dev);
}

void sim_encoder_index(struct sim_device *dev, unsigned int encoder)
{
	if (encoder == SIM_ULTRA_FAST)
		ultra_index(dev);
	else if (is_fast(dev, encoder) && (dev->config.encoders.fast_index & 1))
		dev->encoders.raw[encoder] = 0;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (dev->bench.machine.axis[i].encoder == (int)encoder)
			dev->engine.axis[i].index_seen = true;
	}
}

void sim_encoders_slot(struct sim_device *dev)
{
	struct sim_encoders *enc = &dev->encoders;

	for (unsigned int k = 0; k < SIM_ENCODERS; k++) {
		struct sim_shaft *shaft = &dev->bench.shaft[k];

		if (!shaft->rate)
			continue;
		shaft->rest += shaft->rate;
		sim_encoder_turn(dev, k, shaft->rest / 1000);
		shaft->rest %= 1000;
	}
	if (dev->stats.slots % SPEED_WINDOW_MS)
		return;
	enc->ultra_speed = (int32_t)(enc->raw[SIM_ULTRA_FAST] - enc->ultra_mark);
	enc->ultra_mark = enc->raw[SIM_ULTRA_FAST];
}

/* Quadrature state as a number which grows by one a step: A leads B forwards. */
static int phase(uint64_t levels, unsigned int a, unsigned int b)
{
	int high_a = levels >> a & 1;
	int high_b = levels >> b & 1;

	return high_b ? 3 - high_a : high_a;
}

void sim_encoders_pins(struct sim_device *dev, uint64_t before, uint64_t after)
{
	const uint8_t *pins = dev->config.encoders.pins;

	for (unsigned int k = 0; k < SIM_BASIC_ENCODERS; k++) {
		unsigned int a = pins[k];
		unsigned int b = pins[SIM_BASIC_ENCODERS + k];
		int steps;

		if (!(dev->config.encoders.option[k] & SIM_ENC_ENABLE) || is_fast(dev, k) ||
		    a >= SIM_PINS || b >= SIM_PINS || a == b)
			continue;
		steps = (phase(after, a, b) - phase(before, a, b)) & 3;
		if (steps == 1)
			sim_encoder_turn(dev, k, 1);
		else if (steps == 3)
			sim_encoder_turn(dev, k, -1);
	}
}
