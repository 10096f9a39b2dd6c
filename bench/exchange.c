// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the HAL component's read and write cost, beside memcpy of the same
 * bytes: the exchange between images and values alone, without LinuxCNC, so
 * that the figure is the code's and not the thread's.
 *
 * Values change between reads (inputs, positions and the number of encoders
 * named on the command line), for a bridge that sees the same image twice
 * would flatter itself. The device's time advances a millisecond a read.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <pokeys/shm.h>
#include "bench/samples.h"
#include "halbridge/exchange.h"
#include "halbridge/table.h"

enum { BATCH = 32, BATCHES = 4000 };

static struct exchange exchange;
static struct values values;
static struct { struct pokeys_state state; struct pokeys_command command; } from, to;

static int moving;	/* encoders */

static uint64_t now_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

/* The device a cycle later: everything fast has moved. */
static void move(struct pokeys_state *s, uint64_t now)
{
	s->cycle++;
	s->t_cycle_ns = s->t_publish_ns = s->t_digital_ns = s->t_analog_ns = now;
	s->t_encoder_ns = s->t_motion_ns = s->t_slow_ns = now;
	for (int i = 0; i < POKEYS_ENCODERS; i++) {
		s->encoder[i] += i < moving ? i + 1 : 0;
		s->encoder_t_ns[i] = now;
	}
	for (int i = 0; i < POKEYS_AXES; i++)
		s->engine.axis[i].position += 7 * i;
	for (int i = 0; i < POKEYS_PIN_BYTES; i++)
		s->digital_in[i] = (uint8_t)(s->digital_in[i] + 1);
}

/* Not inlined, so that the compiler cannot see that nobody reads the copy. */
static __attribute__((noinline)) void copy_bytes(void *destination, const void *source)
{
	memcpy(destination, source, sizeof(to));
	__asm__ volatile("" : : "r"(destination) : "memory");
}

static void begin(void)
{
	struct pokeys_state *s = &exchange.state;

	exchange_init(&exchange, 1);
	table_set_parameters(&values);
	s->epoch = 1;
	s->period_ns = 1000000;
	s->stale_after_ns = 5000000;
	s->link = POKEYS_LINK_RUNNING;
	s->encoder_enabled = UINT32_MAX;
	memset(s->digital_out_owned, 0xff, sizeof(s->digital_out_owned));
	for (int i = 0; i < POKEYS_ENCODERS; i++)
		values.encoder[i].scale = 4000;
	for (int i = 0; i < POKEYS_AXES; i++)
		values.joint[i].scale = 200;
}

int main(int argc, char **argv)
{
	static struct samples read, write, copy;
	uint64_t device_ns = UINT64_C(1000000000);

	if (argc != 2 || (moving = atoi(argv[1])) < 0 || moving > POKEYS_ENCODERS) {
		fprintf(stderr, "usage: bench-exchange ENCODERS (moving, 0..%d)\n", POKEYS_ENCODERS);
		return 2;
	}

	if (samples_init(&read, BATCHES) < 0 || samples_init(&write, BATCHES) < 0 ||
	    samples_init(&copy, BATCHES) < 0)
		return 1;
	begin();
	for (int batch = 0; batch < BATCHES; batch++) {
		uint64_t spent_read = 0, spent_write = 0, t;

		for (int k = 0; k < BATCH; k++) {
			device_ns += 1000000;
			move(&exchange.state, device_ns);
			t = now_ns();
			exchange_read(&exchange, &values, EXCHANGE_STATE, device_ns);
			spent_read += now_ns() - t;
			t = now_ns();
			exchange_write(&exchange, &values, device_ns, 1000000);
			spent_write += now_ns() - t;
			exchange_written(&exchange, true);
		}
		t = now_ns();
		for (int k = 0; k < BATCH; k++)
			copy_bytes(&to, &from);
		samples_add(&copy, (now_ns() - t) / BATCH);
		samples_add(&read, spent_read / BATCH);
		samples_add(&write, spent_write / BATCH);
	}
	printf("{\"bytes\": %zu, ", sizeof(to));
	samples_print(&copy, "memcpy");
	printf(", ");
	samples_print(&read, "read");
	printf(", ");
	samples_print(&write, "write");
	printf("}\n");
	return 0;
}
