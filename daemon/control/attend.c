// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the control thread does while the loop runs, fifty times a second:
 * write events down, take orders, wake listeners, clean up after dead clients, tell the
 * service manager how things are, write metrics. Each of it may be late without harm:
 * a disk that hangs holds up all of it, and nothing else (watchdog.c).
 */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>
#include "daemon/control/clock.h"
#include "daemon/control/daemon.h"
#include "daemon/control/log.h"
#include "daemon/control/notify.h"
#include "daemon/control/options.h"

#define MS UINT64_C(1000000)
enum { ROUND_MS = 20 };
#define NOTIFY_NS (100 * MS)
#define MAINTAIN_NS (250 * MS)
#define STATUS_NS (1000 * MS)

static bool due(uint64_t *next_ns, uint64_t interval_ns, uint64_t now_ns)
{
	if (now_ns < *next_ns)
		return false;
	*next_ns = now_ns + interval_ns;
	return true;
}

/* True = a signal asks us to end. */
static bool take_signal(struct daemon *daemon)
{
	struct signalfd_siginfo info;
	bool end = false;

	while (read(daemon->signal_fd, &info, sizeof(info)) == (ssize_t)sizeof(info)) {
		if (info.ssi_signo == SIGHUP) {
			desk_reload(&daemon->desk);
			continue;
		}
		tell_line(&daemon->teller, TELL_ALL, EVENT_INFO, "daemon", "ending (%s)",
			  info.ssi_signo == SIGINT ? "SIGINT" : "SIGTERM");
		end = true;
	}
	return end;
}

/* Listeners hear at once of what the loop flagged, and of everything ten times a second. */
static void wake_listeners(struct daemon *daemon, uint64_t now_ns)
{
	uint64_t news = atomic_exchange(&daemon->loop.shared.notify, 0);
	bool all = due(&daemon->next_notify_ns, NOTIFY_NS, now_ns);

	for (uint32_t i = 0; i < daemon->loop.count; i++)
		if (all || news >> i & 1)
			shm_device_notify(daemon->loop.devices[i].shm);
}

/* Whoever drives by it is not concerned; but status and metrics say nothing of a device. */
static void tell_reading(struct daemon *daemon, uint32_t failed)
{
	bool bad = failed < daemon->loop.count;
	char why[256] = "";

	if (bad && !daemon->told_reading) {
		pokeys_client_status(daemon->reader[failed], why, sizeof(why));
		log_line(EVENT_WARNING,
			 "%s: what is published cannot be read back for status and "
			 "metrics: %s",
			 daemon->config->device[failed].name, why);
	} else if (!bad && daemon->told_reading) {
		log_line(EVENT_NOTICE, "what is published can be read back again");
	}
	daemon->told_reading = bad;
}

static void read_back(struct daemon *daemon)
{
	struct report *report = &daemon->report;
	uint32_t failed = UINT32_MAX;

	report->log_dropped = log_dropped();
	report->metrics_failed = daemon->metrics.failed;
	report->requests_refused = daemon->desk.refused;
	for (uint32_t i = 0; i < report->devices; i++) {
		struct report_device *device = &report->device[i];

		pokeys_client_poll(daemon->reader[i]);
		device->known = !pokeys_client_read(daemon->reader[i], &device->state) &&
				!pokeys_client_read_diag(daemon->reader[i], &device->diag);
		if (!device->known && failed == UINT32_MAX)
			failed = i;
	}
	/* after reading the images, so that none of them is newer than this time */
	report->now_ns = clock_now();
	tell_reading(daemon, failed);
}

static void tell(struct daemon *daemon, uint64_t now_ns)
{
	bool status = due(&daemon->next_status_ns, STATUS_NS, now_ns);
	bool metrics = metrics_due(&daemon->metrics, now_ns);
	char text[REPORT_STATUS_SIZE];

	if (!status && !metrics)
		return;
	read_back(daemon);
	if (status) {
		report_status(&daemon->report, text, sizeof(text));
		notify_status(text);
	}
	if (metrics)
		metrics_write(&daemon->metrics, &daemon->report, now_ns);
}

/* Driving goes on for whoever is attached; the next one finds nothing. */
static void maintain(struct daemon *daemon)
{
	bool removed = shm_host_maintain(daemon->host) == -ESTALE;

	if (removed && !daemon->told_removed)
		log_line(EVENT_ERROR,
			 "what is shared in %s was removed by somebody; nobody can "
			 "attach until pokeysd is restarted",
			 daemon->config->runtime_directory);
	daemon->told_removed = removed;
}

/* The guard comes and goes as it is told to; devices are driven with and without. */
static void look_for_guard(struct daemon *daemon)
{
	const char *interface = daemon->config->interface;
	struct guarded *guard = &daemon->report.guard;
	bool before = guard->on;

	guarded_read(guard, GUARDED_FILE, interface, clock_now());
	atomic_store(&daemon->loop.shared.guard_passed, guard->passed);
	atomic_store(&daemon->loop.shared.guard_dropped, guard->dropped);
	if (guard->on == before)
		return;
	if (guard->on) {
		atomic_fetch_or(&daemon->loop.shared.flags, POKEYS_STATE_GUARD);
		log_line(EVENT_INFO, "%s: guarded (%s XDP)", interface, guard->mode);
	} else {
		atomic_fetch_and(&daemon->loop.shared.flags, ~(uint32_t)POKEYS_STATE_GUARD);
		log_line(EVENT_WARNING,
			 "%s: the guard is not heard of any more (systemctl status "
			 "pokeys-guard says why)",
			 interface);
	}
}

/* What the transport knows of the network; while it can do less than asked for, so be it. */
static void tend_transport(struct daemon *daemon)
{
	struct transport *t = daemon->loop.transport;
	const char *news = NULL;
	int result;

	if (!t->ops->tend)
		return;
	result = t->ops->tend(t, &news);
	if (news)
		log_line(result < 0 ? EVENT_WARNING : EVENT_NOTICE, "%s: %s",
			 daemon->config->interface, news);
}

static void do_round(struct daemon *daemon, uint64_t now_ns)
{
	drain_run(&daemon->drain, now_ns);
	desk_run(&daemon->desk, now_ns);
	keeper_run(&daemon->keeper, now_ns);
	finder_report(&daemon->finder, now_ns);
	claims_run(&daemon->claims, daemon->finder.found, now_ns);
	wake_listeners(daemon, now_ns);
	if (due(&daemon->next_maintain_ns, MAINTAIN_NS, now_ns)) {
		maintain(daemon);
		look_for_guard(daemon);
		tend_transport(daemon);
		loop_sample_faults(&daemon->loop);
	}
	tell(daemon, now_ns);
}

static int begin(struct daemon *daemon)
{
	const struct config *config = daemon->config;
	uint64_t now_ns = clock_now();
	char text[REPORT_STATUS_SIZE];
	int result;

	daemon->report.devices = config->devices;
	for (uint32_t i = 0; i < config->devices; i++) {
		daemon->report.device[i].name = config->device[i].name;
		if (pokeys_client_open(&daemon->reader[i], config->runtime_directory,
				       config->device[i].name, "pokeysd", 0)) {
			log_line(EVENT_ERROR, "no memory to read back what is published");
			return STATUS_FAILED;
		}
	}
	drain_run(&daemon->drain, now_ns);
	metrics_init(&daemon->metrics, config->metrics_file, config->metrics_interval_ns, now_ns);
	read_back(daemon);
	report_status(&daemon->report, text, sizeof(text));
	notify_status(text);
	result = watchdog_start(&daemon->watchdog, notify_watchdog_limit(),
				&daemon->loop.shared.cycles);
	if (result) {
		log_line(EVENT_ERROR, "no thread for the service manager's watchdog: %s",
			 strerror(-result));
		return STATUS_FAILED;
	}
	tell_line(&daemon->teller, TELL_ALL, EVENT_INFO, "daemon",
		  "ready: %u device%s every %u us over %s in %s", config->devices,
		  config->devices == 1 ? "" : "s", (unsigned int)(config->loop.period_ns / 1000),
		  daemon->loop.transport->ops->name, config->runtime_directory);
	return 0;
}

int daemon_attend(struct daemon *daemon)
{
	struct pollfd poll_fd = { .fd = daemon->signal_fd, .events = POLLIN };
	int status = begin(daemon);

	if (status)
		return status;
	while (!atomic_load(&daemon->left)) {
		if (poll(&poll_fd, 1, ROUND_MS) > 0 && take_signal(daemon)) {
			notify_stopping();
			return STATUS_OK;
		}
		do_round(daemon, clock_now());
	}
	drain_run(&daemon->drain, clock_now());
	tell_line(&daemon->teller, TELL_ALL, EVENT_ERROR, "daemon",
		  "the realtime loop has ended by itself: %s", strerror(-daemon->loop_result));
	return STATUS_FAILED;
}
