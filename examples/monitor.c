/* SPDX-License-Identifier: MIT */
/*
 * A monitor: show what the daemon knows of a device, live.
 *
 *	monitor [DEVICE] [--runtime-directory DIR] [--interval S] [--once] [--json]
 *
 * It shows how a program attaches: open a client, poll it (it may be started
 * before the daemon and survives it), wait for news, read the newest
 * image. Reading costs the daemon nothing, and there may be many
 * monitors. How old the data are is decided here, by this program's clock:
 * a daemon that died cannot raise a flag any more.
 *
 * Build it anywhere with: cc monitor.c $(pkg-config --cflags --libs pokeys_shm)
 */
#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <pokeys/shm.h>

static volatile sig_atomic_t ended;

struct options {
	const char *runtime, *device;
	double interval_s;
	bool once, json;
};

static void end(int signal_number)
{
	(void)signal_number;
	ended = 1;
}

static uint64_t now_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

/* Milliseconds since `t_ns`; -1 = never, or a time stamp in the future. */
static double age_ms(uint64_t now, uint64_t t_ns)
{
	uint64_t age = pokeys_age_ns(t_ns, now);

	return age == POKEYS_NEVER ? -1 : (double)age / 1e6;
}

static bool bit(const uint8_t *bytes, unsigned int i)
{
	return bytes[i / 8] >> (i % 8) & 1;
}

static const char *link_name(unsigned int link)
{
	static const char *const names[] = {
		"searching", "identifying", "configuring", "running", "lost",
	};

	return link < sizeof(names) / sizeof(names[0]) ? names[link] : "unknown";
}

/* Fresh = the link runs, and inputs and (if it has axes) positions are young enough. */
static bool fresh(const struct pokeys_state *state, uint64_t now)
{
	return state->link == POKEYS_LINK_RUNNING &&
	       pokeys_state_age_ns(state, now) <= state->stale_after_ns;
}

static void print_pins(const char *title, const uint8_t *bytes)
{
	printf("  %-9s", title);
	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		printf("%s%c", i % 10 ? "" : " ", bit(bytes, i) ? '1' : '.');
	putchar('\n');
}

static void print_text(const struct options *options, const struct pokeys_state *state,
		       uint64_t now)
{
	printf("%s: %s%s, serial %" PRIu32 " %.24s, cycle %" PRIu64 "\n", options->device,
	       link_name(state->link), fresh(state, now) ? "" : " (STALE)", state->identity.serial,
	       state->identity.type, state->cycle);
	printf("  age ms    cycle %.2f digital %.2f analog %.2f encoder %.2f motion %.2f\n",
	       age_ms(now, state->t_publish_ns), age_ms(now, state->t_digital_ns),
	       age_ms(now, state->t_analog_ns), age_ms(now, state->t_encoder_ns),
	       age_ms(now, state->t_motion_ns));
	print_pins("inputs", state->digital_in);
	print_pins("outputs", state->digital_out);
	printf("  analog   ");
	for (unsigned int i = 0; i < POKEYS_ANALOG; i++)
		printf(" %u", state->analog[i]);
	printf("\n  encoders ");
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		if (state->encoder_enabled >> i & 1)
			printf(" %u:%" PRId32, i, state->encoder[i]);
	}
	printf("\n  axes     ");
	for (unsigned int i = 0; i < state->engine.axes_enabled && i < POKEYS_AXES; i++)
		printf(" %u:%" PRId32 "%s", i, state->engine.axis[i].position,
		       state->engine.axis[i].enabled ? "" : "(off)");
	if (!state->engine.axes_enabled)
		printf(" none set up in the device");
	printf("\n  round trip us: last %.1f smoothed %.1f; of %" PRIu64 " requests %" PRIu64
	       " late, %" PRIu64 " lost\n",
	       state->statistics.rtt_last_ns / 1e3, state->statistics.rtt_smoothed_ns / 1e3,
	       state->statistics.sent, state->statistics.late, state->statistics.lost);
}

static void json_pins(const char *name, const uint8_t *bytes)
{
	printf(",\"%s\":\"", name);
	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		putchar(bit(bytes, i) ? '1' : '0');
	putchar('"');
}

static void print_json(const struct options *options, const struct pokeys_state *state,
		       uint64_t now)
{
	printf("{\"device\":\"%s\",\"link\":\"%s\",\"fresh\":%s,\"serial\":%" PRIu32
	       ",\"epoch\":%" PRIu64 ",\"cycle\":%" PRIu64,
	       options->device, link_name(state->link), fresh(state, now) ? "true" : "false",
	       state->identity.serial, state->epoch, state->cycle);
	printf(",\"age_ms\":{\"cycle\":%.3f,\"digital\":%.3f,\"analog\":%.3f,"
	       "\"encoder\":%.3f,\"motion\":%.3f}",
	       age_ms(now, state->t_publish_ns), age_ms(now, state->t_digital_ns),
	       age_ms(now, state->t_analog_ns), age_ms(now, state->t_encoder_ns),
	       age_ms(now, state->t_motion_ns));
	json_pins("inputs", state->digital_in);
	json_pins("outputs", state->digital_out);
	printf(",\"analog\":[");
	for (unsigned int i = 0; i < POKEYS_ANALOG; i++)
		printf("%s%u", i ? "," : "", state->analog[i]);
	printf("],\"encoders\":[");
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		printf("%s%" PRId32, i ? "," : "", state->encoder[i]);
	printf("],\"positions\":[");
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		printf("%s%" PRId32, i ? "," : "", state->engine.axis[i].position);
	printf("],\"late\":%" PRIu64 ",\"lost\":%" PRIu64 ",\"sent\":%" PRIu64 "}\n",
	       state->statistics.late, state->statistics.lost, state->statistics.sent);
}

/* One look: 0 = shown, 1 = there is nothing to show (said on stderr). */
static int show(const struct options *options, pokeys_client *client)
{
	struct pokeys_state state;
	char why[256];
	int r;

	pokeys_client_poll(client);
	r = pokeys_client_read(client, &state);
	if (r) {
		pokeys_client_status(client, why, sizeof(why));
		fprintf(stderr, "%s: %s\n", options->device, why);
		return 1;
	}
	(options->json ? print_json : print_text)(options, &state, now_ns());
	fflush(stdout);
	return 0;
}

/*
 * Until the interval is over. Notifications come ten times a second and whenever
 * the link changes; a program that wants to react at once does so here.
 */
static void pass(pokeys_client *client, double seconds)
{
	uint64_t now, last = now_ns() + (uint64_t)(seconds * 1e9);
	unsigned int ms;

	while (!ended && (now = now_ns()) < last) {
		ms = (unsigned int)((last - now) / 1000000) + 1;
		/* a wait that fails (no daemon) must not become a busy loop */
		if (pokeys_client_wait(client, ms) < 0)
			usleep((ms < 500 ? ms : 500) * 1000);
	}
}

static int usage(const char *program, bool asked)
{
	fprintf(asked ? stdout : stderr,
		"usage: %s [DEVICE] [--runtime-directory DIR] "
		"[--interval S] [--once] [--json]\n       S = 0.01..3600\n",
		program);
	return asked ? 0 : 2;
}

/* 1 = help is asked for, -1 = a mistake. */
static int parse(struct options *options, int argc, char **argv)
{
	static const struct option known[] = {
		{ "runtime-directory", required_argument, NULL, 'r' },
		{ "interval", required_argument, NULL, 'i' },
		{ "once", no_argument, NULL, 'o' },
		{ "json", no_argument, NULL, 'j' },
		{ "help", no_argument, NULL, 'h' },
		{ NULL, 0, NULL, 0 },
	};
	char *end_of_number;
	int c;

	while ((c = getopt_long(argc, argv, "r:jh", known, NULL)) != -1) {
		switch (c) {
		case 'r':
			options->runtime = optarg;
			break;
		case 'i':
			options->interval_s = strtod(optarg, &end_of_number);
			if (*end_of_number)
				return -1;
			break;
		case 'o':
			options->once = true;
			break;
		case 'j':
			options->json = true;
			break;
		case 'h':
			return 1;
		default:
			return -1;
		}
	}
	if (optind < argc)
		options->device = argv[optind++];
	/* written so that what is no number is out of range */
	return optind == argc && options->interval_s >= 0.01 && options->interval_s <= 3600 ? 0 :
											      -1;
}

/* The daemon's first device; NULL = there is none, which is said. */
static const char *first_device(const char *runtime)
{
	static char names[1][POKEYS_SHM_NAME_MAX];
	int r = pokeys_shm_devices(runtime, names, 1);

	if (r > 0)
		return names[0];
	if (r < 0)
		fprintf(stderr, "the runtime folder: %s%s\n", strerror(-r),
			r == -EACCES ? "; this user must be in its group, which is "
				       "pokeys-monitor as a rule" :
				       "");
	else
		fprintf(stderr, "no daemon runs; name a DEVICE to wait for it\n");
	return NULL;
}

int main(int argc, char **argv)
{
	struct options options = { .interval_s = 0.5 };
	struct sigaction action = { .sa_handler = end };
	pokeys_client *client;
	int r;

	r = parse(&options, argc, argv);
	if (r)
		return usage(argv[0], r > 0);
	if (!options.device && !(options.device = first_device(options.runtime)))
		return 1;
	if (pokeys_client_open(&client, options.runtime, options.device, "monitor",
			       POKEYS_CLIENT_EVENTS)) {
		fprintf(stderr, "%s: not a device name, or the runtime folder is no path from /\n",
			options.device);
		return 2;
	}
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	do {
		if (!options.json && isatty(STDOUT_FILENO))
			printf("\033[H\033[J");
		r = show(&options, client);
		if (!options.once)
			pass(client, options.interval_s);
	} while (!options.once && !ended);
	pokeys_client_close(client);
	return options.once ? r : 0;
}
