/* SPDX-License-Identifier: GPL-2.0-or-later */
/* How a network interface is set up, as ethtool(8) shows it. Cold, no privilege. */
#ifndef TOOLS_NIC_H
#define TOOLS_NIC_H

/* Index of nic.value[]; a value of NIC_UNKNOWN: the driver does not say. */
enum nic_setting {
	NIC_RX_USECS, /* how long a received packet may wait for others */
	NIC_RX_FRAMES,
	NIC_ADAPTIVE_RX,
	NIC_GRO,
	NIC_LRO,
	NIC_EEE,         /* the link goes to sleep between packets */
	NIC_CHANNELS,    /* in use, that receive */
	NIC_RX_CHANNELS, /* of them those that only receive */
	NIC_SETTINGS,
};

#define NIC_UNKNOWN (-1L)

struct nic {
	char name[16];
	char driver[32]; /* empty: not known */
	long value[NIC_SETTINGS];
};

/*
 * Ask the driver; with a root other than "" read the file ROOT/ethtool/NAME
 * instead, lines of "key value" (keys: pokeysctl(1), --root).
 */
void nic_read(const char *root, const char *name, struct nic *nic);

#endif
