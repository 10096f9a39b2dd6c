// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Speaking to the device byte by byte, as the sheet says and without wire's
 * encoders, so that these tests do not depend on them either.
 */
#include "tests/sim/talk.h"

void talk_start(struct talk *t, uint8_t hardware)
{
	struct sim_device_options options = { .hardware = hardware };

	memset(t, 0, sizeof(*t));
	sim_device_init(&t->dev, &options);
	t->now_ns = 1000 * MS;
	sim_device_advance(&t->dev, t->now_ns);
}

void talk_begin(struct talk *t, uint8_t op, uint8_t p1, uint8_t p2, uint8_t p3, uint8_t p4)
{
	memset(t->rq, 0, sizeof(t->rq));
	t->rq[0] = 0xBB;
	t->rq[1] = op;
	t->rq[2] = p1;
	t->rq[3] = p2;
	t->rq[4] = p3;
	t->rq[5] = p4;
}

static uint8_t sum7(const uint8_t *p)
{
	uint8_t sum = 0;

	for (int i = 0; i < 7; i++)
		sum = (uint8_t)(sum + p[i]);
	return sum;
}

const uint8_t *talk_send(struct talk *t)
{
	t->rq[6] = t->id++;
	t->rq[7] = sum7(t->rq);
	assert_int_equal(sim_device_request(&t->dev, t->now_ns, t->rq, sizeof(t->rq), t->rp), 64);
	assert_int_equal(t->rp[0], 0xAA);
	assert_int_equal(t->rp[1], t->rq[1]);
	assert_int_equal(t->rp[6], t->rq[6]);
	assert_int_equal(t->rp[7], sum7(t->rp));
	return t->rp;
}

const uint8_t *talk_ask(struct talk *t, uint8_t op, uint8_t p1, uint8_t p2)
{
	talk_begin(t, op, p1, p2, 0, 0);
	return talk_send(t);
}

void talk_wait(struct talk *t, unsigned int ms)
{
	t->now_ns += MS * ms;
	sim_device_advance(&t->dev, t->now_ns);
}

const uint8_t *talk_status(struct talk *t)
{
	return talk_ask(t, 0x85, 0x00, 0);
}

uint8_t talk_engine_state(struct talk *t)
{
	return talk_status(t)[10];
}

uint8_t talk_axis_state(struct talk *t, unsigned int axis)
{
	return talk_status(t)[16 + axis];
}

int32_t talk_position(struct talk *t, unsigned int axis)
{
	return wire_get_i32(talk_status(t) + 24 + 4 * axis);
}

void talk_axes(struct talk *t, uint8_t count)
{
	talk_begin(t, 0x85, 0x01, 0, 0, 0);
	t->rq[8] = count;
	t->rq[10] = 0x80;
	assert_int_equal(talk_send(t)[3], 0);
}

void talk_axis(struct talk *t, uint8_t axis, uint8_t options, uint8_t switches, float speed,
	       float accel, float decel)
{
	talk_begin(t, 0x85, 0x11, axis, 0, 0);
	t->rq[8] = options;
	t->rq[9] = switches;
	t->rq[13] = 10;
	t->rq[14] = 50;
	wire_put_f32(t->rq + 16, speed);
	wire_put_f32(t->rq + 20, accel);
	wire_put_f32(t->rq + 24, decel);
	wire_put_i32(t->rq + 28, -100000);
	wire_put_i32(t->rq + 32, 100000);
	t->rq[43] = 0x83;
	talk_send(t);
}

void talk_set_state(struct talk *t, uint8_t state)
{
	talk_begin(t, 0x85, 0x02, state, 0, 0xFF);
	talk_send(t);
}

void talk_move(struct talk *t, unsigned int axis, int32_t reference)
{
	talk_begin(t, 0x85, 0x20, 0, 0, 0);
	wire_put_i32(t->rq + 8 + 4 * axis, reference);
	talk_send(t);
}

void talk_start_axes(struct talk *t, uint8_t options)
{
	talk_start(t, 0);
	talk_axes(t, 3);
	for (uint8_t i = 0; i < 3; i++)
		talk_axis(t, i, options, 0, 15, 0.03f, 0.06f);
}

void talk_start_running(struct talk *t, uint8_t options)
{
	talk_start_axes(t, options);
	talk_set_state(t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(t), SIM_PE_RUNNING);
}

uint8_t talk_wait_while(struct talk *t, uint8_t busy)
{
	for (int ms = 0; ms < 60000; ms++) {
		talk_wait(t, 1);
		if (t->dev.engine.state != busy)
			return t->dev.engine.state;
	}
	return busy;
}
