// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Program and maps into the kernel, and what is refused there into words.
 *
 * The maps are pinned, so that counters and learnt addresses outlive a loader
 * that was killed. Pins of a build with other maps are of no use to anybody:
 * they are removed and made anew, rather than refusing to start until a person
 * does that.
 *
 * libbpf speaks to programmers, over many lines; it is silenced, and errno is
 * put into one line of our own. POKEYS_GUARD_DEBUG in the environment lets it
 * speak, for whoever wants the verifier's view.
 */
#include <bpf/bpf.h>
#include <bpf/libbpf.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "daemon/control/log.h"
#include "daemon/device/event.h"
#include "guard/kernel.h"
#include "guard.skel.h"

static struct guard_bpf *program;

int guard_refused(const char *what, int error)
{
	bool right = error == EPERM || error == EACCES;

	log_line(right ? EVENT_ERROR : EVENT_WARNING, "%s: %s%s" GUARD_LOSS, what, strerror(error),
		 right ? " (CAP_BPF, CAP_NET_ADMIN and CAP_PERFMON are needed, and the right to "
			 "the folder of pins)" :
			 "");
	return right ? GUARD_NO_RIGHT : GUARD_UNAVAILABLE;
}

static int try_to_load(bool dedicated, bool sockets)
{
	char folder[GUARD_PATH];
	LIBBPF_OPTS(bpf_object_open_opts, options, .pin_root_path = guard_pin("", folder));
	int result;

	program = guard_bpf__open_opts(&options);
	if (!program)
		return -errno;
	program->rodata->dedicated = dedicated;
	program->rodata->have_sockets = sockets;
	result = sockets ? 0 : bpf_map__set_autocreate(program->maps.sockets, false);
	if (!result)
		result = guard_bpf__load(program);
	if (!result)
		return 0;
	guard_bpf__destroy(program);
	program = NULL;
	return result;
}

int guard_load(bool dedicated, bool sockets)
{
	char path[GUARD_PATH];
	int result = guard_make_pin_folder();

	if (result)
		return result;
	if (!getenv("POKEYS_GUARD_DEBUG"))
		libbpf_set_print(NULL);
	if (!sockets)
		unlink(guard_pin("sockets", path));
	result = try_to_load(dedicated, sockets);
	if (result == -EINVAL && !access(guard_pin("devices", path), F_OK)) {
		log_line(EVENT_NOTICE,
			 "what another version has pinned in %s is created again; "
			 "counters begin at 0",
			 guard_pin("", path));
		guard_remove_pins();
		result = guard_make_pin_folder();
		result = result ? result : try_to_load(dedicated, sockets);
	}
	if (result > 0)
		return result;
	if (result)
		return guard_refused("the guard cannot be loaded into this kernel", -result);
	guard_open_pins();
	return 0;
}

int guard_program_fd(void)
{
	return bpf_program__fd(program->progs.pokeys_guard);
}

int guard_devices_fd(void)
{
	return bpf_map__fd(program->maps.devices);
}

int guard_sockets_fd(void)
{
	return bpf_map__fd(program->maps.sockets);
}

int guard_ports_fd(void)
{
	return bpf_map__fd(program->maps.ports);
}

int guard_remove(void)
{
	int result;

	guard_detach();
	result = guard_remove_pins();
	unlink(GUARD_STATUS);
	return result;
}
