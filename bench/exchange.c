// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the HAL component's read and write cost for one device, beside memcpy
 * of the same bytes: copying the images from and to memory, the pins of both
 * naming schemes (or those that the command line says), and the exchange
 * between, without LinuxCNC, so that the figure is the code's and not the
 * thread's. Pins lie as far apart as in HAL's memory, one to two cache lines.
 *
 * `cold`: before each read, other data fill the second-level cache and other code the first-level
 * one, as after the rest of a period in LinuxCNC; before each write, they fill only the first-level
 * caches, as after the motion controller.
 *
 * Values change between reads (inputs, the positions of all axes and as many
 * encoders as the command line says), for a bridge that sees the same image twice
 * would flatter itself. The device's time advances a millisecond a read.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <pokeys/shm.h>
#include "bench/samples.h"
#include "halbridge/binding.h"
#include "halbridge/exchange.h"
#include "halbridge/table.h"
#include "shm/command_cell.h"

enum { BATCH = 32, BATCHES = 400 };

/* A pin of HAL: where its value is while it is not linked, and the rest. */
struct pin {
	uint64_t value;
	unsigned char rest[104];
};

static struct exchange exchange;
static struct values values;
static struct binding binding;
static struct pin pins[BINDING_PINS];
static void *pointers[BINDING_PINS];
static struct {
	struct pokeys_state state;
	struct pokeys_command command;
} from, to;

static int moving; /* encoders */
static bool cold;

static uint64_t now_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

/* The processor is busy with something else, in `bytes` of data and in the code below. */
static __attribute__((noinline)) void elsewhere(size_t bytes)
{
	static unsigned char other[16 << 20];

	for (size_t i = 0; i < bytes; i += 64)
		((volatile unsigned char *)other)[i]++;
#ifdef __x86_64__
	__asm__ volatile(".fill 131072, 1, 0x90"); /* no operation */
#endif
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
	s->digital_in[s->cycle % POKEYS_PIN_BYTES]++;
}

/* Not inlined, so that the compiler cannot see that nobody reads the copy. */
static __attribute__((noinline)) void copy_bytes(void *destination, const void *source)
{
	memcpy(destination, source, sizeof(to));
	__asm__ volatile("" : : "r"(destination) : "memory");
}

static void begin(uint8_t names)
{
	struct pokeys_state *s = &from.state;

	exchange_init(&exchange, 1);
	table_set_parameters(&values);
	for (int i = 0; i < BINDING_PINS; i++)
		pointers[i] = &pins[i].value;
	if (binding_init(&binding, &values, (void *volatile *)pointers, names))
		exit(1);
	binding_exported(&binding);
	exchange.legacy.on = true;
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

/* As pokeys.N.read and pokeys.N.write do it. */
static void read_funct(uint64_t device_ns)
{
	struct pokeys_state *spare = exchange_spare(&exchange);

	memcpy(spare, &from.state, sizeof(from.state));
	exchange.state = spare;
	binding_gather(&binding, TABLE_AT_READ);
	exchange_read(&exchange, &values, EXCHANGE_STATE, device_ns);
	binding_scatter(&binding, TABLE_AT_READ);
}

static void write_funct(uint64_t device_ns)
{
	binding_gather(&binding, TABLE_AT_WRITE);
	exchange_write(&exchange, &values, device_ns, 1000000);
	command_cell_fill(&to.command, &exchange.command);
	exchange_written(&exchange, true);
	binding_scatter(&binding, TABLE_AT_WRITE);
}

/* 0 = there are no such ones. */
static uint8_t names_of(const char *text)
{
	static const struct {
		const char *text;
		uint8_t names;
	} known[] = {
		{ "canonical", TABLE_CANONICAL },
		{ "legacy", TABLE_LEGACY },
		{ "both", TABLE_BOTH },
		{ "all", TABLE_ALL },
	};

	for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++)
		if (!strcmp(known[i].text, text))
			return known[i].names;
	return 0;
}

int main(int argc, char **argv)
{
	static struct samples read, write, both, copy;
	const uint8_t names = argc == 3 || argc == 4 ? names_of(argv[2]) : 0;
	uint64_t device_ns = UINT64_C(1000000000);

	if (!names || (moving = atoi(argv[1])) < 0 || moving > POKEYS_ENCODERS) {
		fprintf(stderr,
			"usage: bench-exchange ENCODERS canonical|legacy|both|all [cold]\n"
			"(encoders that move, 0..%d)\n",
			POKEYS_ENCODERS);
		return 2;
	}
	cold = argc == 4;
	if (samples_init(&read, BATCH * BATCHES) < 0 || samples_init(&write, BATCH * BATCHES) < 0 ||
	    samples_init(&both, BATCH * BATCHES) < 0 || samples_init(&copy, BATCHES) < 0)
		return 1;
	begin(names);
	for (int batch = 0; batch < BATCHES; batch++) {
		uint64_t t, read_ns, write_ns;

		for (int k = 0; k < BATCH; k++) {
			device_ns += 1000000;
			move(&from.state, device_ns);
			if (cold)
				elsewhere(8 << 20);
			t = now_ns();
			read_funct(device_ns);
			read_ns = now_ns() - t;
			if (cold)
				elsewhere(128 << 10);
			t = now_ns();
			write_funct(device_ns);
			write_ns = now_ns() - t;
			samples_add(&read, read_ns);
			samples_add(&write, write_ns);
			samples_add(&both, read_ns + write_ns);
		}
		t = now_ns();
		for (int k = 0; k < BATCH; k++)
			copy_bytes(&to, &from);
		samples_add(&copy, (now_ns() - t) / BATCH);
	}
	printf("{\"bytes\": %zu, ", sizeof(to));
	samples_print(&copy, "memcpy");
	printf(", ");
	samples_print(&read, "read");
	printf(", ");
	samples_print(&write, "write");
	printf(", ");
	samples_print(&both, "both");
	printf("}\n");
	return 0;
}
