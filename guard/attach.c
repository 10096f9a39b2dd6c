// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The program onto its interface.
 *
 * A link and not the older netlink way: a link belongs to us, so nobody
 * replaces it by mistake and we replace nobody's, and a pinned one keeps
 * working while there is no loader. Whoever comes next puts its program into
 * that link, between two packets.
 *
 * First in the driver, then generic: left to choose by itself, the kernel does
 * not say which it took, and generic costs a copy of the packet.
 *
 * Only where frames begin with Ethernet's header (loopback's do): in a tunnel they
 * begin with IP's, the program would read addresses for types, and on a dedicated
 * interface drop the devices.
 */
#include <bpf/bpf.h>
#include <bpf/libbpf.h>
#include <errno.h>
#include <linux/if_link.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>
#include "daemon/control/log.h"
#include "daemon/device/event.h"
#include "guard/kernel.h"

static int link_fd = -1;

/* The interface that a link is on, 0 = on none any more. */
static uint32_t index_of(int fd)
{
	struct bpf_link_info info = { 0 };
	__u32 size = sizeof(info);

	return bpf_obj_get_info_by_fd(fd, &info, &size) ? 0 : info.xdp.ifindex;
}

static bool is_native(uint32_t index)
{
	LIBBPF_OPTS(bpf_xdp_query_opts, options);

	return !bpf_xdp_query((int)index, 0, &options) && options.attach_mode == XDP_ATTACHED_DRV;
}

static void place_at(struct guard_place *place, uint32_t index)
{
	place->index = index;
	place->native = is_native(index);
}

/* Into the link that an earlier loader has pinned. False = there is none that is of use. */
static bool take_over(uint32_t index)
{
	char pin[GUARD_PATH];
	int fd = bpf_obj_get(guard_pin("link", pin));

	if (fd < 0)
		return false;
	if (index_of(fd) == index && !bpf_link_update(fd, guard_program_fd(), NULL)) {
		link_fd = fd;
		return true;
	}
	bpf_link_detach(fd);
	close(fd);
	unlink(pin);
	return false;
}

static int make_link(uint32_t index, uint32_t flags)
{
	LIBBPF_OPTS(bpf_link_create_opts, options, .flags = flags);
	int fd = bpf_link_create(guard_program_fd(), (int)index, BPF_XDP, &options);

	return fd < 0 ? -errno : fd;
}

static int refused(const char *interface, int error)
{
	if (error == ENODEV)
		return -ENODEV;
	if (error == EPERM || error == EACCES) {
		log_line(EVENT_ERROR,
			 "%s: the guard may not be attached: %s (CAP_BPF and "
			 "CAP_NET_ADMIN are needed)" GUARD_LOSS,
			 interface, strerror(error));
		return GUARD_NO_RIGHT;
	}
	if (error == EBUSY || error == EEXIST)
		log_line(EVENT_WARNING,
			 "%s: another XDP program is on it (ip link shows which)" GUARD_LOSS,
			 interface);
	else
		log_line(EVENT_WARNING,
			 "%s: this kernel or this interface has no XDP: %s" GUARD_LOSS, interface,
			 strerror(error));
	return GUARD_UNAVAILABLE;
}

static bool is_ethernet(const char *interface)
{
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	struct ifreq request = { 0 };
	bool is = true;

	snprintf(request.ifr_name, sizeof(request.ifr_name), "%s", interface);
	if (fd >= 0 && !ioctl(fd, SIOCGIFHWADDR, &request))
		is = request.ifr_hwaddr.sa_family == ARPHRD_ETHER ||
		     request.ifr_hwaddr.sa_family == ARPHRD_LOOPBACK;
	if (fd >= 0)
		close(fd);
	return is;
}

/* In the driver, else generic: place->error says why. A descriptor or -errno. */
static int make_best_link(struct guard_place *place, uint32_t index)
{
	int fd = make_link(index, XDP_FLAGS_DRV_MODE);

	place->error = fd < 0 ? -fd : 0;
	if (fd < 0 && fd != -EBUSY && fd != -EEXIST && fd != -ENODEV)
		fd = make_link(index, XDP_FLAGS_SKB_MODE);
	return fd;
}

int guard_attach(struct guard_place *place)
{
	uint32_t index = if_nametoindex(place->interface);
	char pin[GUARD_PATH];
	int fd;

	place->error = 0;
	if (!index)
		return -ENODEV;
	if (!is_ethernet(place->interface)) {
		log_line(EVENT_WARNING,
			 "%s is no Ethernet interface, and only such are guarded" GUARD_LOSS,
			 place->interface);
		return GUARD_UNAVAILABLE;
	}
	if (take_over(index)) {
		place_at(place, index);
		return 0;
	}
	fd = make_best_link(place, index);
	if (fd < 0)
		return refused(place->interface, -fd);
	if (bpf_obj_pin(fd, guard_pin("link", pin))) {
		log_line(EVENT_ERROR, "%s: %s", pin, strerror(errno));
		close(fd);
		return GUARD_FAILED;
	}
	link_fd = fd;
	place_at(place, index);
	return 0;
}

bool guard_is_attached(const struct guard_place *place)
{
	return link_fd >= 0 && place->index && index_of(link_fd) == place->index &&
	       if_nametoindex(place->interface) == place->index;
}

void guard_detach(void)
{
	char pin[GUARD_PATH];
	int fd;

	guard_pin("link", pin);
	fd = link_fd >= 0 ? link_fd : bpf_obj_get(pin);
	if (fd >= 0) {
		bpf_link_detach(fd);
		close(fd);
	}
	unlink(pin);
	link_fd = -1;
}

int guard_find(struct guard_place *place)
{
	char pin[GUARD_PATH];
	int fd = bpf_obj_get(guard_pin("link", pin));
	uint32_t index;

	memset(place, 0, sizeof(*place));
	if (fd < 0)
		return -errno;
	index = index_of(fd);
	close(fd);
	if (!index || !if_indextoname(index, place->interface))
		return -ENODEV;
	place_at(place, index);
	return 0;
}
