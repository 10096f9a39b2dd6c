// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Buffered motion: a ring of 128 slots of 1 ms, one of which is taken in each
 * slot while the engine runs (protocol sections 1.6, 3.24.5 and 5.3).
 *
 * A fill has no sequence number and is never recognised as a repetition: sent
 * twice, it moves twice. That is the device's nature and what a client must
 * be tested against.
 *
 * An empty ring stands still at once and raises no error; how often it ran
 * dry after asking for motion is counted for the test bench.
 */
#include "sim/engine_part.h"

void sim_ring_clear(struct sim_ring *ring)
{
	ring->head = 0;
	ring->used = 0;
	ring->moving = false;
}

/* One axis of one slot as it came: magnitude and direction bit. */
static void take_value(struct sim_ring_slot *slot, unsigned int axis, const uint8_t *data,
		       bool wide)
{
	unsigned int raw = wide ? wire_get_u16(data) : data[0];
	unsigned int sign = wide ? 0x8000u : 0x80u;

	slot->magnitude[axis] = (uint16_t)(raw & (sign - 1));
	if (raw & sign)
		slot->negative |= (uint8_t)(1u << axis);
}

unsigned int sim_ring_fill(struct sim_device *dev, const uint8_t *data, size_t bytes,
			   unsigned int slots, unsigned int axes, bool wide)
{
	struct sim_ring *ring = &dev->engine.ring;
	unsigned int value = wide ? 2 : 1;
	unsigned int taken;

	if (!axes || axes > SIM_AXES)
		return 0;
	if (slots > bytes / (axes * value))
		slots = (unsigned int)(bytes / (axes * value));
	for (taken = 0; taken < slots && ring->used < SIM_RING_SLOTS; taken++) {
		struct sim_ring_slot *slot =
			&ring->slot[(ring->head + ring->used++) % SIM_RING_SLOTS];

		memset(slot, 0, sizeof(*slot));
		for (unsigned int axis = 0; axis < axes; axis++, data += value)
			take_value(slot, axis, data, wide);
	}
	ring->slots_accepted += taken;
	return taken;
}

/* PWM and outputs which follow an axis' slot value (0x0A, 0x0B). */
static void drive_synced(struct sim_device *dev, const struct sim_ring_slot *slot)
{
	struct sim_engine_config *config = &dev->config.engine;
	struct sim_pwm_config *pwm = &dev->config.pwm;
	unsigned int axis = config->synced_pwm[1];

	if (config->synced_pwm[0] == 1 && axis < SIM_AXES && config->synced_pwm[2] < 6) {
		unsigned int percent = slot->magnitude[axis] > 100 ? 100 : slot->magnitude[axis];

		pwm->duty[config->synced_pwm[2]] = (uint32_t)((uint64_t)pwm->period * percent /
							      100);
	}
	axis = config->synced_out[1];
	if (config->synced_out[0] != 1 || axis >= SIM_AXES)
		return;
	for (unsigned int i = 0; i < 8; i++) {
		unsigned int mask = slot->magnitude[axis] | (slot->negative >> axis & 1u) << 7;
		unsigned int on = mask >> i & 1;
		unsigned int pin = config->synced_pins[i];

		if (pin >= 1 && pin <= SIM_PINS)
			sim_pins_write(dev, on ? UINT64_MAX : 0, UINT64_C(1) << (pin - 1));
		else if (pin >= 92 && pin <= 99)
			dev->engine.outputs = (uint8_t)((dev->engine.outputs &
							 ~(1u << (pin - 92))) |
							on << (pin - 92));
	}
}

static void step_axis(struct sim_device *dev, unsigned int i, const struct sim_ring_slot *slot)
{
	struct sim_axis *ax = &dev->engine.axis[i];
	unsigned int most = sim_engine_kilohertz(dev);
	int32_t pulses = slot->magnitude[i];

	if (!sim_axis_usable(dev, i) || (ax->setup.options & SIM_AC_PLANNER))
		return;
	if (pulses > (int32_t)most) {
		pulses = (int32_t)most;
		ax->clamped++;
	}
	sim_axis_jump(dev, i, slot->negative >> i & 1 ? -pulses : pulses);
}

const struct sim_ring_slot *sim_ring_take(struct sim_device *dev)
{
	struct sim_ring *ring = &dev->engine.ring;
	const struct sim_ring_slot *slot = &ring->slot[ring->head];

	if (!ring->used) {
		ring->underruns += ring->moving;
		ring->moving = false;
		return NULL;
	}
	ring->head = (ring->head + 1) % SIM_RING_SLOTS;
	ring->used--;
	ring->slots_taken++;
	ring->moving = false;
	for (unsigned int i = 0; i < SIM_AXES; i++)
		ring->moving = ring->moving || slot->magnitude[i];
	drive_synced(dev, slot);
	return slot;
}

void sim_ring_slot(struct sim_device *dev)
{
	const struct sim_ring_slot *slot = sim_thread_holds(dev) ? NULL : sim_ring_take(dev);

	for (unsigned int i = 0; slot && i < SIM_AXES; i++)
		step_axis(dev, i, slot);
}

SIM_HANDLER(sim_pe_clear)
{
	(void)rq;
	(void)rp;
	sim_ring_clear(&dev->engine.ring);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_fill)
{
	bool wide = rq[P1] == 0xFE;
	unsigned int taken = sim_ring_fill(dev, rq + 8, WIRE_PAYLOAD_LEN, rq[P2], rq[P3], wide);

	sim_engine_status(dev, rp);
	rp[P1] = (uint8_t)taken;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_fill_part)
{
	struct sim_runtime *run = &dev->run;
	unsigned int part = rq[P1] & 7;

	if (part == 0)
		run->fill_parts = 0;
	if (part != run->fill_parts)
		return SIM_ANSWER_NONE;
	memcpy(run->fill + part * WIRE_PK, rq, WIRE_PK);
	run->fill_parts = (uint8_t)(part + 1);
	if (part < 7)
		return SIM_ANSWER_NONE;
	run->fill_parts = 0;
	return sim_do_multi_fill(dev, run->fill, rp);
}

enum sim_answer sim_do_multi_fill(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	uint8_t data[8 * WIRE_PAYLOAD_LEN];
	unsigned int taken;

	if (rq[WIRE_AT_OP] != 0xB0)
		return SIM_ANSWER_UNKNOWN;
	for (unsigned int part = 0; part < 8; part++)
		memcpy(data + part * WIRE_PAYLOAD_LEN, rq + part * WIRE_PK + 8, WIRE_PAYLOAD_LEN);
	taken = sim_ring_fill(dev, data, sizeof(data), rq[P3], rq[P4], rq[P2] == 0xFE);
	sim_engine_status(dev, rp);
	rp[P1] = (uint8_t)taken;
	return SIM_ANSWER;
}
