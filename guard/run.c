// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The guard as a service: on the interface, and there again after the
 * interface has gone and come back (a USB adapter, a driver that was loaded
 * anew), for a link does not follow a name.
 *
 * An interface that is not there yet is waited for; an interface that cannot
 * have a guard ends the service, for it will not change its mind. Ending by
 * order takes the guard off: whoever stops it wants to see the network as it
 * is without. Being killed does not, which is why there are pins.
 */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/file.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <unistd.h>
#include <fcntl.h>
#include "daemon/control/clock.h"
#include "daemon/control/log.h"
#include "daemon/control/notify.h"
#include "daemon/device/event.h"
#include "daemon/transport/handover.h"
#include "guard/guard.h"
#include "guard/kernel.h"
#include "guard/server.h"

enum { ROUND_MS = 250 };

struct service {
	struct guard_place place;
	bool told_waiting;
	int told_publish;
	bool sockets; /* hand AF_XDP sockets over */
	struct guard_server server;
};

int guard_lock(void)
{
	int fd;

	if (mkdir(GUARD_RUN, 0755) && errno != EEXIST) {
		log_line(EVENT_ERROR, GUARD_RUN ": %s", strerror(errno));
		return -(errno == EACCES ? GUARD_NO_RIGHT : GUARD_FAILED);
	}
	fd = open(GUARD_RUN "/lock", O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
	if (fd < 0) {
		log_line(EVENT_ERROR, GUARD_RUN "/lock: %s", strerror(errno));
		return -(errno == EACCES ? GUARD_NO_RIGHT : GUARD_FAILED);
	}
	if (!flock(fd, LOCK_EX | LOCK_NB))
		return fd;
	close(fd);
	log_line(EVENT_ERROR, "another pokeys-guard is at work; one guards one interface of a "
			      "machine");
	return -GUARD_BUSY;
}

static int open_signals(void)
{
	sigset_t set;

	sigemptyset(&set);
	sigaddset(&set, SIGTERM);
	sigaddset(&set, SIGINT);
	sigprocmask(SIG_BLOCK, &set, NULL);
	return signalfd(-1, &set, SFD_CLOEXEC);
}

static void tell_mode(const struct guard_place *place, char *out, size_t size)
{
	if (place->native)
		snprintf(out, size, "native");
	else if (!place->error)
		snprintf(out, size, "generic (as the guard before it; slower)");
	else if (place->error == EOPNOTSUPP)
		snprintf(out, size, "generic (this driver has no XDP; slower)");
	else
		snprintf(out, size,
			 "generic (the driver refuses XDP: %s; is the MTU too large? "
			 "slower)",
			 strerror(place->error));
}

/* What most drivers that have XDP refuse it for. */
static void tell_remedy(const struct guard_place *place)
{
	const char *name = place->interface;

	if (place->error == EOPNOTSUPP)
		log_line(EVENT_NOTICE,
			 "%s: a driver that has XDP says this while it merges "
			 "packets: then ethtool -K %s lro off rx-gro-hw off, and systemctl restart "
			 "pokeys-guard, help",
			 name, name);
	else
		log_line(EVENT_NOTICE,
			 "%s: dmesg says what the driver wants; mostly ip link set "
			 "%s mtu 1500 or ethtool -L %s combined 1 helps, then systemctl restart "
			 "pokeys-guard",
			 name, name, name);
}

static void tell(const struct guard_place *place)
{
	char text[192], mode[96];

	tell_mode(place, mode, sizeof(mode));
	if (place->index)
		snprintf(text, sizeof(text), "on %s, %s, %s", place->interface, mode,
			 place->dedicated ? "dedicated" : "shared");
	else
		snprintf(text, sizeof(text), "waiting for interface %s", place->interface);
	log_line(EVENT_INFO, "%s", text);
	notify_status(text);
	if (place->index && place->error)
		tell_remedy(place);
}

/* On the interface, if it is there. 0 or an exit status. */
static int attach(struct service *service)
{
	int result = guard_attach(&service->place);

	if (result > 0)
		return result;
	if (!result || !service->told_waiting)
		tell(&service->place);
	service->told_waiting = result != 0;
	return 0;
}

static int look(struct service *service)
{
	int result = 0;

	if (!guard_is_attached(&service->place)) {
		if (service->place.index) {
			log_line(EVENT_WARNING,
				 "%s: the guard is off, for the interface is gone "
				 "or somebody took it off; putting it on again",
				 service->place.interface);
			service->place.index = 0;
			guard_detach();
		}
		result = attach(service);
	}
	if (result)
		return result;
	result = guard_publish(&service->place, clock_now());
	if (result && result != service->told_publish)
		log_line(EVENT_WARNING,
			 GUARD_STATUS ": cannot be written: %s; the daemon does not "
				      "see the guard",
			 strerror(-result));
	service->told_publish = result;
	return 0;
}

static int serve(struct service *service)
{
	struct pollfd fds[1 + GUARD_SERVER_FDS] = { { .fd = open_signals(), .events = POLLIN } };
	int status;

	if (fds[0].fd < 0) {
		log_line(EVENT_ERROR, "signals cannot be taken: %s", strerror(errno));
		return GUARD_FAILED;
	}
	do {
		status = look(service);
		service->server.index = service->place.index;
		service->server.native = service->place.native;
		guard_server_run(&service->server, fds + 1, clock_now());
		if (!status)
			poll(fds, 1 + GUARD_SERVER_FDS, ROUND_MS);
	} while (!status && !fds[0].revents);
	close(fds[0].fd);
	return status;
}

/*
 * Where there is no XDP, systemd has to hear that we have started: an end
 * before that is a failed start to it, whatever the status.
 */
static int leave(int status, int locked)
{
	if (status == GUARD_UNAVAILABLE)
		notify_status("no XDP to be had; going on without");
	guard_remove();
	close(locked);
	return status;
}

/* Without it the daemon takes another transport, so it is no reason to be without a guard. */
static void open_server(struct guard_server *server)
{
	int result = guard_server_open(server, HANDOVER_PATH, guard_sockets_fd(), guard_ports_fd());

	if (result)
		log_line(EVENT_WARNING,
			 HANDOVER_PATH ": cannot be made: %s; pokeysd gets no "
				       "AF_XDP socket",
			 strerror(-result));
}

int guard_run(const struct config *config)
{
	struct service service = {
		.place.dedicated = config->interface_dedicated,
		.sockets = config->transport == CONFIG_XDP,
		.server = GUARD_SERVER_CLOSED,
	};
	int locked = guard_lock(), status, missing;

	if (locked < 0)
		return -locked;
	memcpy(service.place.interface, config->interface, sizeof(service.place.interface));
	status = guard_load(config->interface_dedicated, service.sockets);
	if (status)
		return leave(status, locked);
	missing = guard_set_devices(config);
	if (missing > 0)
		log_line(EVENT_INFO, "%d device%s not found yet; let in once %s answer%s a search",
			 missing, missing == 1 ? " is" : "s are", missing == 1 ? "it" : "they",
			 missing == 1 ? "s" : "");
	if (missing < 0) {
		log_line(EVENT_ERROR, "the devices cannot be told to the guard: %s",
			 strerror(-missing));
		status = GUARD_FAILED;
	}
	if (!status && service.sockets)
		open_server(&service.server);
	status = status ? status : serve(&service);
	guard_server_close(&service.server);
	return leave(status, locked);
}
