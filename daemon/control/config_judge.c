// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Rules between keys.
 *
 * A rule stands here if two values, each good, are wrong together: a pin that
 * is input and output, a stale limit shorter than the time between two
 * samples. Somebody would otherwise find out at the machine. Rules of one
 * device's settings are in config_judge_settings.c.
 */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "daemon/control/config_judge.h"

uint32_t config_line_of(const struct config_lines *lines, const char *name, uint32_t index)
{
	const struct config_key *key;

	for (size_t i = 0; (key = config_key_at(i)); i++)
		if (!strcmp(key->name, name) && lines->key[i][index])
			return lines->key[i][index];
	return lines->section;
}

bool config_is_set(const struct config_lines *lines, const char *name, uint32_t index)
{
	const struct config_key *key;

	for (size_t i = 0; (key = config_key_at(i)); i++)
		if (!strcmp(key->name, name) && lines->key[i][index])
			return true;
	return false;
}

bool config_is_faulty(const struct config_lines *lines, const char *name)
{
	const struct config_key *key;

	for (size_t i = 0; (key = config_key_at(i)); i++)
		if (!strcmp(key->name, name) && lines->faulty[i])
			return true;
	return false;
}

void judge_fault(const struct judged *j, const char *key, uint32_t index, const char *format, ...)
{
	char text[400];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	config_fault(j->file, config_line_of(j->lines, key, index), "[device %s]: %s", j->raw->name,
		     text);
}

static void judge_times(const struct judged *j)
{
	const struct config_raw_device *raw = j->raw;
	double sample_ms = (double)j->file->daemon.period_us * (double)raw->fast_divider / 1000;

	if (raw->stale_after_ms <= sample_ms)
		judge_fault(j, "stale-after-ms", 0,
			    "stale-after-ms = %g has to be longer than the time "
			    "between two samples, which is %g ms (period-us times fast-divider)",
			    raw->stale_after_ms, sample_ms);
	if (raw->lost_after_ms <= raw->stale_after_ms)
		judge_fault(j, "lost-after-ms", 0,
			    "lost-after-ms = %g has to be longer than "
			    "stale-after-ms, which is %g",
			    raw->lost_after_ms, raw->stale_after_ms);
	if (raw->deadline_ceiling_ms < raw->deadline_floor_us / 1000)
		judge_fault(j, "deadline-ceiling-ms", 0,
			    "deadline-ceiling-ms = %g must not be shorter "
			    "than deadline-floor-us, which is %g us",
			    raw->deadline_ceiling_ms, raw->deadline_floor_us);
}

static bool has_loops(const struct judged *j)
{
	for (uint32_t i = 0; i < j->file->heaters; i++)
		if (judge_has_heater(j, i))
			return true;
	for (uint32_t i = 0; i < j->file->servos; i++)
		if (judge_has_servo(j, i))
			return true;
	return false;
}

/* Places for all slow groups, and for those that are kept for what is urgent (device/plan.c). */
static void judge_window(const struct judged *j)
{
	const int64_t window = j->raw->window;
	const bool loops = has_loops(j);
	const int64_t of_loops = 4, together = loops ? 21 : 20;

	if (loops && window < of_loops)
		judge_fault(j, "window", 0,
			    "window = %lld is too small for heaters and servo "
			    "motors, which need %lld or more",
			    (long long)window, (long long)of_loops);
	if (j->raw->slow_together && window < together)
		judge_fault(j, "window", 0,
			    "window = %lld is too small for slow = together, which "
			    "needs %lld or more%s",
			    (long long)window, (long long)together,
			    loops ? " beside heaters and servo motors" : "");
}

/* Two devices that are one. */
static void judge_identity(const struct judged *j, uint32_t index)
{
	const struct config_raw_device *raw = j->raw;

	if (!raw->address && !raw->serial && !config_is_faulty(j->lines, "address") &&
	    !config_is_faulty(j->lines, "serial"))
		judge_fault(j, "address", 0,
			    "neither address nor serial is given; one of them says "
			    "where the device is");
	for (uint32_t i = 0; i < index; i++) {
		const struct config_raw_device *other = &j->file->device[i];

		if (raw->address && raw->address == other->address && raw->port == other->port)
			judge_fault(j, "address", 0,
				    "address: [device %s] has the same one, and the "
				    "same port",
				    other->name);
		if (raw->serial && raw->serial == other->serial)
			judge_fault(j, "serial", 0, "serial: [device %s] has the same one",
				    other->name);
	}
}

/* The password is read here: a file that cannot be is a fault of the configuration. */
static void judge_password(const struct judged *j)
{
	const char *wrong;

	if (!*j->raw->password_file || j->file->public)
		return;
	if (j->file->here && config_password_hidden(j->raw->password_file)) {
		config_note(j->file, config_line_of(j->lines, "password-file", 0),
			    "[device %s]: password-file: %s may not be opened by this user: not "
			    "judged (root can)",
			    j->raw->name, j->raw->password_file);
		return;
	}
	wrong = config_read_password(j->raw->password_file, j->raw->password);
	if (wrong)
		judge_fault(j, "password-file", 0, "password-file: %s %s", j->raw->password_file,
			    wrong);
}

static void judge_device(struct config_file *file, uint32_t index)
{
	const struct judged j = { file, &file->device[index], &file->device_lines[index] };

	judge_identity(&j, index);
	judge_settings(&j);
	judge_times(&j);
	judge_window(&j);
	judge_password(&j);
}

void config_judge(struct config_file *file, struct config *out)
{
	if (file->daemon.duty > 0.9 && file->daemon.duty < 1)
		config_fault(file, config_line_of(&file->daemon_lines, "duty", 0),
			     "[daemon]: duty: \"%g\" is out of range; allowed: 0.1..0.9, or 1",
			     file->daemon.duty);
	if (file->daemon.transport == CONFIG_XDP && !*file->daemon.interface)
		config_fault(file, config_line_of(&file->daemon_lines, "transport", 0),
			     "[daemon]: transport = xdp belongs to one interface; interface is not "
			     "given");
	if (file->daemon.mode == CONFIG_WAIT_NAPI && !file->daemon.busy_poll_us)
		config_fault(file, config_line_of(&file->daemon_lines, "mode", 0),
			     "[daemon]: mode = napi polls for busy-poll-us, which is 0");
	if (!file->devices && !file->faults)
		config_fault(file, 0,
			     "there is no [device NAME] section; add one with the line "
			     "address = A.B.C.D or serial = NUMBER (pokeysctl discover --config "
			     "writes them)");
	judge_heaters(file);
	judge_servos(file);
	for (uint32_t i = 0; i < file->devices; i++)
		judge_device(file, i);
	if (file->here)
		config_judge_here(file);
	if (file->faults)
		return;
	memset(out, 0, sizeof(*out));
	config_convert_daemon(&file->daemon, out);
	out->devices = file->devices;
	for (uint32_t i = 0; i < file->devices; i++) {
		config_convert_device(&file->device[i], out->loop.period_ns, &out->device[i]);
		out->device[i].index = (uint8_t)i;
	}
	for (uint32_t i = 0; i < file->heaters; i++) {
		const struct config_raw_heater *raw = &file->heater[i];
		struct device_config *device = &out->device[raw->of];

		device->heater[raw->number] = raw->out;
		device->heaters++;
	}
	for (uint32_t i = 0; i < file->servos; i++) {
		const struct config_raw_servo *raw = &file->servo[i];
		struct device_config *device = &out->device[raw->of];

		device->servo[raw->number] = raw->out;
		device->servos++;
	}
}
