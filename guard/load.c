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
#include <grp.h>
#include <linux/magic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>
#include "daemon/control/log.h"
#include "daemon/device/event.h"
#include "guard/kernel.h"
#include "guard.skel.h"

static struct guard_bpf *program;

static int refused(const char *what, int error)
{
	bool right = error == EPERM || error == EACCES;

	log_line(right ? EVENT_ERROR : EVENT_WARNING, "%s: %s%s" GUARD_LOSS, what, strerror(error),
		 right ? " (CAP_BPF, CAP_NET_ADMIN and CAP_PERFMON are needed)" : "");
	return right ? GUARD_NO_RIGHT : GUARD_UNAVAILABLE;
}

static int make_pin_folder(void)
{
	struct statfs status;

	if (statfs(GUARD_BPFFS, &status))
		return refused(GUARD_BPFFS, errno);
	if ((unsigned long)status.f_type != BPF_FS_MAGIC) {
		log_line(EVENT_WARNING, GUARD_BPFFS " is no bpf file system (mount -t bpf bpf "
			 GUARD_BPFFS ")" GUARD_LOSS);
		return GUARD_UNAVAILABLE;
	}
	if (mkdir(GUARD_PINS, 0750) && errno != EEXIST)
		return refused(GUARD_PINS, errno);
	return 0;
}

/* The group may read the counters, where it may get as far as the folder. */
static void open_to_group(void)
{
	const struct group *group = getgrnam("pokeys");

	if (group && (chown(GUARD_PINS, (uid_t)-1, group->gr_gid) ||
		      chown(GUARD_PINS "/counters", (uid_t)-1, group->gr_gid) ||
		      chmod(GUARD_PINS "/counters", 0640)))
		log_line(EVENT_INFO, GUARD_PINS "/counters: cannot be given to group pokeys: %s; "
			 GUARD_STATUS " has them as well", strerror(errno));
}

static int try_to_load(bool dedicated, bool sockets)
{
	LIBBPF_OPTS(bpf_object_open_opts, options, .pin_root_path = GUARD_PINS);
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
	int result = make_pin_folder();

	if (result)
		return result;
	if (!getenv("POKEYS_GUARD_DEBUG"))
		libbpf_set_print(NULL);
	if (!sockets)
		unlink(GUARD_PINS "/sockets");
	result = try_to_load(dedicated, sockets);
	if (result == -EINVAL && !access(GUARD_PINS "/devices", F_OK)) {
		log_line(EVENT_NOTICE, "what another version has pinned in " GUARD_PINS " is "
			 "created again; counters begin at 0");
		guard_remove_pins();
		result = make_pin_folder();
		result = result ? result : try_to_load(dedicated, sockets);
	}
	if (result > 0)
		return result;
	if (result)
		return refused("the guard cannot be loaded into this kernel", -result);
	open_to_group();
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

void guard_remove_pins(void)
{
	unlink(GUARD_PINS "/link");
	unlink(GUARD_PINS "/counters");
	unlink(GUARD_PINS "/devices");
	unlink(GUARD_PINS "/ports");
	unlink(GUARD_PINS "/sockets");
	rmdir(GUARD_PINS);
}

void guard_remove(void)
{
	guard_detach();
	guard_remove_pins();
	unlink(GUARD_STATUS);
}
