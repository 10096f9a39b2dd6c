// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * ethtool's questions by ioctl: they need no privilege, and ethtool(8) itself
 * need not be installed. Drivers answer EOPNOTSUPP to what they do not have;
 * that stays unknown, and is never taken for zero.
 */
#include <linux/ethtool.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>
#include "tools/nic.h"
#include "tools/probe.h"

static const char *const names[NIC_SETTINGS] = {
	[NIC_RX_USECS] = "rx-usecs",
	[NIC_RX_FRAMES] = "rx-frames",
	[NIC_ADAPTIVE_RX] = "adaptive-rx",
	[NIC_GRO] = "gro",
	[NIC_LRO] = "lro",
	[NIC_EEE] = "eee",
	[NIC_CHANNELS] = "channels",
	[NIC_RX_CHANNELS] = "rx-channels",
};

static bool ask(int fd, const char *name, void *question)
{
	struct ifreq request = { .ifr_data = question };

	snprintf(request.ifr_name, sizeof(request.ifr_name), "%s", name);
	return ioctl(fd, SIOCETHTOOL, &request) == 0;
}

static void ask_driver(int fd, struct nic *nic)
{
	struct ethtool_coalesce coalesce = { .cmd = ETHTOOL_GCOALESCE };
	struct ethtool_value gro = { .cmd = ETHTOOL_GGRO }, flags = { .cmd = ETHTOOL_GFLAGS };
	struct ethtool_eee eee = { .cmd = ETHTOOL_GEEE };
	struct ethtool_channels channels = { .cmd = ETHTOOL_GCHANNELS };

	if (ask(fd, nic->name, &coalesce)) {
		nic->value[NIC_RX_USECS] = (long)coalesce.rx_coalesce_usecs;
		nic->value[NIC_RX_FRAMES] = (long)coalesce.rx_max_coalesced_frames;
		nic->value[NIC_ADAPTIVE_RX] = coalesce.use_adaptive_rx_coalesce != 0;
	}
	if (ask(fd, nic->name, &gro))
		nic->value[NIC_GRO] = gro.data != 0;
	if (ask(fd, nic->name, &flags))
		nic->value[NIC_LRO] = (flags.data & ETH_FLAG_LRO) != 0;
	if (ask(fd, nic->name, &eee))
		nic->value[NIC_EEE] = eee.eee_enabled && eee.tx_lpi_enabled;
	if (ask(fd, nic->name, &channels)) {
		nic->value[NIC_CHANNELS] = (long)channels.combined_count + channels.rx_count;
		nic->value[NIC_RX_CHANNELS] = (long)channels.rx_count;
	}
}

/* The last word of the link to it. */
static void find_driver(const char *root, struct nic *nic)
{
	char path[512], target[256];
	ssize_t length;

	snprintf(path, sizeof(path), "%s/sys/class/net/%s/device/driver", root, nic->name);
	length = readlink(path, target, sizeof(target) - 1);
	if (length <= 0)
		return;
	target[length] = '\0';
	snprintf(nic->driver, sizeof(nic->driver), "%.31s",
		 strrchr(target, '/') ? strrchr(target, '/') + 1 : target);
}

static void read_file(const char *root, struct nic *nic)
{
	char text[PROBE_TEXT], value[32];

	if (!probe_text(root, text, sizeof(text), "/ethtool/%s", nic->name))
		return;
	for (size_t i = 0; i < NIC_SETTINGS; i++)
		if (probe_line(text, names[i], value, sizeof(value)))
			nic->value[i] = atol(value);
}

void nic_read(const char *root, const char *name, struct nic *nic)
{
	int fd;

	memset(nic, 0, sizeof(*nic));
	snprintf(nic->name, sizeof(nic->name), "%s", name);
	for (size_t i = 0; i < NIC_SETTINGS; i++)
		nic->value[i] = NIC_UNKNOWN;
	find_driver(root, nic);
	if (*root) {
		read_file(root, nic);
		return;
	}
	fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	if (fd < 0)
		return;
	ask_driver(fd, nic);
	close(fd);
}
