/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A daemon made of nothing but its shared memory, moved by lines on stdin:
 *
 *	host RUNTIME DEVICE[,DEVICE]
 *
 * All devices show the same image; show tells of the first one's commands.
 *
 *	set FIELD [INDEX] VALUE	a field of the state image, see fields[] below
 *	axis INDEX FIELD VALUE	of an axis, see axis_fields[]
 *	silent 0|1		the device does not answer: time stamps stand still
 *	foreign 0|1		what is published is not a state image
 *	ack ID OUTCOME		a one-shot has ended
 *	show			prints the newest command image, one line
 *	quit
 *
 * Each line is answered by "ok", by what show prints, or by "?". It publishes
 * every millisecond. With it a test can put the images into states that a real
 * daemon would reach once a year.
 */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "shm/host_private.h"

enum { DEVICES = 4 };

struct field {
	const char *name;
	size_t offset, size, step; /* step 0: no index; size 0: one bit, index counts bits */
};

#define PLAIN(name, member)	{ name, offsetof(struct pokeys_state, member),	\
				  sizeof(((struct pokeys_state *)0)->member), 0 }
#define EACH(name, member)	{ name, offsetof(struct pokeys_state, member),	\
				  sizeof(((struct pokeys_state *)0)->member[0]),	\
				  sizeof(((struct pokeys_state *)0)->member[0]) }
#define BITS(name, member)	{ name, offsetof(struct pokeys_state, member), 0, 1 }
#define AXIS(name, member)	{ name, offsetof(struct pokeys_axis, member),	\
				  sizeof(((struct pokeys_axis *)0)->member), 0 }

static const struct field fields[] = {
	BITS("in", digital_in),
	BITS("own", digital_out_owned),
	BITS("index", encoder_index),
	EACH("analog", analog),
	EACH("encoder", encoder),
	PLAIN("link", link),
	PLAIN("fault", fault),
	PLAIN("fault-count", fault_count),
	PLAIN("flags", flags),
	PLAIN("missed", statistics.missed),
	PLAIN("serial", identity.serial),
	PLAIN("hardware", identity.hardware),
	PLAIN("pins", capability.pins),
	PLAIN("engine", engine.state),
	PLAIN("rtt", statistics.rtt_last_ns),
};

static const struct field axis_fields[] = {
	AXIS("position", position),
	AXIS("reference", reference),
	AXIS("state", state),
	AXIS("in-position", in_position),
	AXIS("error", error),
	AXIS("enabled", enabled),
	AXIS("limit-minus", limit_minus),
	AXIS("limit-plus", limit_plus),
	AXIS("home", home),
	AXIS("homed", homed),
	AXIS("soft-limit", soft_limit),
};

static struct pokeys_state state;
static struct pokeys_command command;
static bool silent, foreign, ended;

static const struct field *find(const struct field *table, size_t count, const char *name)
{
	for (size_t i = 0; i < count; i++) {
		if (!strcmp(table[i].name, name))
			return &table[i];
	}
	return NULL;
}

static void store(void *base, const struct field *field, unsigned long index, long long value)
{
	unsigned char *at = (unsigned char *)base + field->offset;

	if (field->size) {
		memcpy(at + index * field->step, &value, field->size);
	} else if (value) {
		at[index / 8] |= (unsigned char)(1u << index % 8);
	} else {
		at[index / 8] &= (unsigned char)~(1u << index % 8);
	}
}

static bool set(char *const *word, int words)
{
	const struct field *field = find(fields, sizeof(fields) / sizeof(fields[0]), word[1]);
	unsigned long index = 0;

	if (!field || words != (field->step ? 4 : 3))
		return false;
	if (field->step)
		index = strtoul(word[2], NULL, 0);
	store(&state, field, index, strtoll(word[words - 1], NULL, 0));
	return true;
}

static bool set_axis(char *const *word)
{
	const size_t count = sizeof(axis_fields) / sizeof(axis_fields[0]);
	const struct field *field = find(axis_fields, count, word[2]);
	unsigned long index = strtoul(word[1], NULL, 0);

	if (!field || index >= POKEYS_AXES)
		return false;
	store(&state.engine.axis[index], field, 0, strtoll(word[3], NULL, 0));
	return true;
}

static bool acknowledge(char *const *word)
{
	uint32_t id = (uint32_t)strtoul(word[1], NULL, 0);
	struct pokeys_one_shot_result *result = &state.one_shot[id % POKEYS_ONE_SHOT_RESULTS];

	state.one_shot_ack = id + 1;
	result->id = id;
	result->operation = command.one_shot[id % POKEYS_ONE_SHOTS].operation;
	result->outcome = (uint8_t)strtoul(word[2], NULL, 0);
	return true;
}

static bool show(void)
{
	printf("heartbeat=%llu session=%u flags=%u head=%u out=",
	       (unsigned long long)command.heartbeat, command.session, command.flags,
	       command.one_shot_head);
	for (int i = 0; i < POKEYS_PIN_BYTES; i++)
		printf("%02x", command.digital_out[i] & command.digital_out_mask[i]);
	printf(" mask=");
	for (int i = 0; i < POKEYS_PIN_BYTES; i++)
		printf("%02x", command.digital_out_mask[i]);
	for (int i = 0; i < POKEYS_AXES; i++)
		printf(" axis%d=%d,%g,%u,%u", i, command.axis[i].position,
		       (double)command.axis[i].velocity, command.axis[i].mode,
		       command.axis[i].enable);
	printf("\n");
	return true;
}

static bool obey(char *line)
{
	char *word[5] = { NULL }, *rest = NULL;
	int words = 0;

	for (char *at = strtok_r(line, " \n", &rest); at && words < 5;
	     at = strtok_r(NULL, " \n", &rest))
		word[words++] = at;
	if (words >= 3 && !strcmp(word[0], "set"))
		return set(word, words) && printf("ok\n") > 0;
	if (words == 4 && !strcmp(word[0], "axis"))
		return set_axis(word) && printf("ok\n") > 0;
	if (words == 3 && !strcmp(word[0], "ack"))
		return acknowledge(word) && printf("ok\n") > 0;
	if (words == 1 && !strcmp(word[0], "show"))
		return show();
	if (words == 1 && !strcmp(word[0], "quit"))
		return ended = printf("ok\n") > 0;
	if (words == 2 && !strcmp(word[0], "foreign")) {
		foreign = word[1][0] == '1';
		return printf("ok\n") > 0;
	}
	if (words == 2 && !strcmp(word[0], "silent")) {
		silent = word[1][0] == '1';
		return printf("ok\n") > 0;
	}
	return false;
}

static void listen_to_stdin(void)
{
	struct pollfd in = { .fd = 0, .events = POLLIN };
	char line[256];

	while (!ended && poll(&in, 1, 0) > 0) {
		if (!fgets(line, sizeof(line), stdin)) {
			ended = true;
			return;
		}
		if (!obey(line))
			printf("?\n");
		fflush(stdout);
	}
}

static uint64_t now(void)
{
	struct timespec time;

	clock_gettime(CLOCK_MONOTONIC, &time);
	return (uint64_t)time.tv_sec * 1000000000 + (uint64_t)time.tv_nsec;
}

/* As somebody else would who has the rights: whole, but not stamped as ours. */
static void publish_foreign(struct shm_device *device)
{
	struct pokeys_state *cell = iox_state_loan(device->state);

	if (!cell)
		return;
	memset(cell, 0x5a, sizeof(*cell));
	iox_state_commit(device->state);
}

/* The first device's command is kept for show. */
static void publish_device(struct shm_device *device, bool first)
{
	struct pokeys_command image;

	if (shm_device_read_command(device, &image) == 1) {
		state.one_shot_session = image.session;
		if (first)
			command = image;
	}
	if (foreign)
		publish_foreign(device);
	else
		shm_device_write(device, &state);
}

static void publish(struct shm_device *const *device, size_t count)
{
	state.cycle++;
	state.t_publish_ns = now();
	if (!silent) {
		state.t_digital_ns = state.t_analog_ns = state.t_encoder_ns = state.t_publish_ns;
		state.t_motion_ns = state.t_publish_ns;
		for (int i = 0; i < POKEYS_ENCODERS; i++)
			state.encoder_t_ns[i] = state.t_publish_ns;
	}
	for (size_t i = 0; i < count; i++)
		publish_device(device[i], i == 0);
}

/* Returns how many devices were made, 0 with a line on stderr. */
static size_t open_devices(struct shm_host **host, const char *runtime, char *names,
			   struct shm_device *device[DEVICES])
{
	char why[256] = "", *rest = NULL;
	size_t count = 0;

	if (shm_host_open(host, runtime, NULL, NULL, why, sizeof(why))) {
		fprintf(stderr, "%s\n", why);
		return 0;
	}
	for (char *name = strtok_r(names, ",", &rest); name && count < DEVICES;
	     name = strtok_r(NULL, ",", &rest)) {
		if (shm_host_add(*host, name, &device[count++], why, sizeof(why))) {
			fprintf(stderr, "%s\n", why);
			return 0;
		}
	}
	publish(device, count);
	if (shm_host_publish(*host, why, sizeof(why))) {
		fprintf(stderr, "%s\n", why);
		return 0;
	}
	return count;
}

int main(int argc, char **argv)
{
	static const struct timespec cycle = { .tv_nsec = 1000000 };
	struct shm_device *device[DEVICES];
	struct shm_host *host;
	size_t count;

	if (argc != 3)
		return 2;
	setvbuf(stdin, NULL, _IONBF, 0);
	state.link = POKEYS_LINK_RUNNING;
	state.period_ns = 1000000;
	state.stale_after_ns = 5000000;
	state.flags = POKEYS_STATE_COMMANDER;
	count = open_devices(&host, argv[1], argv[2], device);
	if (!count)
		return 1;
	printf("ready\n");
	fflush(stdout);
	while (!ended) {
		publish(device, count);
		listen_to_stdin();
		if (state.cycle % 100 == 0)
			shm_host_maintain(host);
		nanosleep(&cycle, NULL);
	}
	shm_host_close(host);
	return 0;
}
