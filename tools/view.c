// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A flag in an image says what its writer thought; a writer that is dead
 * thinks nothing any more. So how old things are is decided here, by this
 * program's clock, from the time stamps.
 */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <pokeys/names.h>
#include "shm/mirror.h"
#include "tools/pokeysctl.h"
#include "tools/view.h"

/* A writer that missed so many periods, and at least so long, is not late but gone. */
enum { DEAD_PERIODS = 20 };
#define DEAD_NS UINT64_C(100000000)

uint64_t view_now(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return (uint64_t)now.tv_sec * UINT64_C(1000000000) + (uint64_t)now.tv_nsec;
}

static double as_number(uint64_t age_ns)
{
	return age_ns == POKEYS_NEVER ? INFINITY : (double)age_ns;
}

double view_age_ns(uint64_t now_ns, uint64_t then_ns)
{
	return as_number(pokeys_age_ns(then_ns, now_ns));
}

struct view *view_only(void)
{
	static struct view view;

	return &view;
}

/* With what to do, where the name alone does not say it. */
static const char *fault_text(uint8_t fault)
{
	switch (fault) {
	case POKEYS_FAULT_NO_ADDRESS:
		return "not found in the network; run \"pokeysctl discover\" to see why";
	case POKEYS_FAULT_NO_ANSWER:
		return "no answer; check power and cable, then run \"sudo pokeysctl discover\"";
	case POKEYS_FAULT_WRONG_SERIAL:
		return "wrong serial number; \"pokeysctl events\" says which one answers";
	case POKEYS_FAULT_LOCKED:
		return "configuration locked; see password-file in pokeysd.conf(5)";
	case POKEYS_FAULT_IN_USE:
		return "driven by another pokeysd or section; \"pokeysctl events\" says which";
	default:
		return pokeys_fault_name(fault);
	}
}

double view_data_age_ns(const struct view_device *device)
{
	return as_number(pokeys_state_age_ns(&device->state, device->now_ns));
}

static bool is_ahead(uint64_t t_ns, uint64_t now_ns)
{
	return t_ns && pokeys_age_ns(t_ns, now_ns) == POKEYS_NEVER;
}

void view_judge(struct view_device *device)
{
	const struct pokeys_state *state = &device->state;
	double silent = view_age_ns(device->now_ns, state->t_publish_ns);
	double age = view_data_age_ns(device);
	double limit = fmax((double)DEAD_NS, (double)state->period_ns * DEAD_PERIODS);

	device->freshness = VIEW_FRESH;
	device->why[0] = '\0';
	if (is_ahead(state->t_publish_ns, device->now_ns) ||
	    is_ahead(state->t_digital_ns, device->now_ns) ||
	    (state->capability.pulse_engine >= 2 && is_ahead(state->t_motion_ns, device->now_ns))) {
		device->freshness = VIEW_STALE;
		snprintf(device->why, sizeof(device->why),
			 "stale (its time stamps are ahead of this machine's clock)");
	} else if (silent > limit) {
		device->freshness = VIEW_DEAD;
		snprintf(device->why, sizeof(device->why),
			 "stale (daemon not publishing for %.1f s)", silent / 1e9);
	} else if (state->link != POKEYS_LINK_RUNNING && state->fault) {
		device->freshness = VIEW_STALE;
		snprintf(device->why, sizeof(device->why), "%s", fault_text(state->fault));
	} else if (state->link != POKEYS_LINK_RUNNING || age > (double)state->stale_after_ns) {
		device->freshness = VIEW_STALE;
		if (isinf(age))
			snprintf(device->why, sizeof(device->why), "no data yet");
		else
			snprintf(device->why, sizeof(device->why), "stale (data is %.4g ms old)",
				 age / 1e6);
	}
}

/* One that never said anything is in the device's settings only. */
static uint8_t postep_axes(const struct view_device *device)
{
	struct pokeys_report report;
	uint8_t axes = 0;

	if (!device->state.t_postep_ns || pokeys_client_read_report(device->client, &report))
		return 0;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		axes |= (uint8_t)((report.device.axis[i].postep_type ? 1u : 0u) << i);
	return report.device.postep_enable ? axes : 0;
}

uint64_t view_moment(uint64_t before_ns, uint64_t published_ns, uint64_t after_ns)
{
	if (published_ns <= before_ns)
		return before_ns;
	return published_ns < after_ns ? published_ns : after_ns;
}

static void read_one(struct view_device *device)
{
	enum pokeys_client_state attached = pokeys_client_poll(device->client);
	uint64_t before_ns;
	int result;

	before_ns = view_now();
	result = pokeys_client_read(device->client, &device->state);
	device->now_ns = view_moment(before_ns, device->state.t_publish_ns, view_now());
	device->has_diag = !result && !pokeys_client_read_diag(device->client, &device->diag) &&
			   device->diag.t_publish_ns;
	if (!result) {
		device->postep_axes = postep_axes(device);
		view_judge(device);
		return;
	}
	device->freshness = VIEW_NONE;
	if (attached == POKEYS_CLIENT_ATTACHED)
		snprintf(device->why, sizeof(device->why), "the shared memory cannot be read: %s",
			 strerror(-result));
	else
		pokeys_client_status(device->client, device->why, sizeof(device->why));
}

void view_read(struct view *view)
{
	for (size_t i = 0; i < view->count; i++)
		read_one(&view->device[i]);
}

static int no_daemon(const struct view *view, int result)
{
	char why[256];

	if (result == -EINVAL)
		complain("--runtime-directory: \"%s\" is not allowed; a path from / is",
			 view->runtime_directory);
	else if (result < 0 && mirror_explain(view->runtime_directory, result, why, sizeof(why)))
		complain("%s", why);
	else
		complain("no daemon runs in %s; start it (systemctl start pokeysd), or name "
			 "another folder with --runtime-directory",
			 view->runtime_directory);
	return STATUS_FAILED;
}

static int no_device(const struct view *view, const char *name, char names[][POKEYS_SHM_NAME_MAX],
		     int known)
{
	char text[VIEW_DEVICES * (POKEYS_SHM_NAME_MAX + 2)] = "";
	size_t at = 0;

	for (int i = 0; i < known; i++)
		at += (size_t)snprintf(text + at, sizeof(text) - at, "%s%s", i ? ", " : "",
				       names[i]);
	complain("the daemon in %s has no device \"%s\"; it has: %s", view->runtime_directory, name,
		 text);
	return STATUS_FAILED;
}

static bool is_among(const char *name, char names[][POKEYS_SHM_NAME_MAX], int known)
{
	for (int i = 0; i < known; i++)
		if (!strcmp(names[i], name))
			return true;
	return false;
}

static int attach(struct view *view, const char *name)
{
	struct view_device *device = &view->device[view->count];
	int result;

	snprintf(device->name, sizeof(device->name), "%s", name);
	result = pokeys_client_open(&device->client, view->runtime_directory, name, "pokeysctl", 0);
	view->count += !result;
	return result;
}

static void begin(struct view *view, const char *runtime_directory)
{
	memset(view, 0, sizeof(*view));
	view->runtime_directory = runtime_directory;
}

int view_open(struct view *view, const char *runtime_directory, char *const names[], size_t count)
{
	char known[VIEW_DEVICES][POKEYS_SHM_NAME_MAX];
	int result;

	begin(view, runtime_directory);
	result = pokeys_shm_devices(runtime_directory, known, VIEW_DEVICES);
	if (result <= 0)
		return no_daemon(view, result);
	if (result > VIEW_DEVICES)
		result = VIEW_DEVICES;
	if (count > VIEW_DEVICES)
		count = VIEW_DEVICES;
	for (size_t i = 0; i < (count ? count : (size_t)result); i++) {
		const char *name = count ? names[i] : known[i];

		if (!is_among(name, known, result))
			return no_device(view, name, known, result);
		if (attach(view, name)) {
			complain("no memory to attach to %s", name);
			return STATUS_FAILED;
		}
	}
	return 0;
}

int view_attach(struct view *view, const char *runtime_directory, char names[][POKEYS_SHM_NAME_MAX],
		size_t count)
{
	begin(view, runtime_directory);
	for (size_t i = 0; i < count && i < VIEW_DEVICES; i++) {
		if (attach(view, names[i])) {
			view_close(view);
			return -ENOMEM;
		}
	}
	return 0;
}

void view_close(struct view *view)
{
	for (size_t i = 0; i < view->count; i++)
		pokeys_client_close(view->device[i].client);
	view->count = 0;
}
