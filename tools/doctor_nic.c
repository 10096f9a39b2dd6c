// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The network between daemon and device, as far as this machine sees it. What
 * makes a network card fast for many packets (collecting them, merging them,
 * sleeping between them) makes one packet late.
 *
 * What a driver does not tell is unknown and no advice: many simple ones have
 * nothing to set, and are good for it.
 */
#include <string.h>
#include "tools/doctor.h"
#include "tools/neighbour.h"

enum { LATE_US = 10 };

static bool is_loopback(const struct doctor_finding *finding)
{
	return !strcmp(finding->nic->name, "lo");
}

static bool said_loopback(struct doctor_finding *finding)
{
	if (is_loopback(finding))
		doctor_say(finding, DOCTOR_OK, "the loopback has none");
	return is_loopback(finding);
}

static void judge_route(const struct doctor *doctor, struct doctor_finding *finding)
{
	const struct doctor_device *device = finding->device;

	if (!device->address) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "its address is not known (neither configured "
			   "nor found yet)");
		doctor_mend(finding, "sudo pokeysctl discover");
	} else if (!*device->nic && !doctor->routes_read) {
		doctor_say(finding, DOCTOR_UNKNOWN, "/proc/net/route cannot be read");
	} else if (!*device->nic) {
		doctor_say(finding, DOCTOR_PROBLEM, "no network interface leads to it");
		doctor_mend(finding, "ip address add ADDRESS/24 dev NIC, an address in the "
				     "device's network");
		doctor_keep(finding, DOCTOR_UP, "NIC");
	} else if (*doctor->plan.interface &&
		   !probe_exists(doctor->root, "/sys/class/net/%s", device->nic)) {
		doctor_say(finding, DOCTOR_PROBLEM, "there is no interface %s, which %s names",
			   device->nic, doctor->plan.path);
		doctor_mend(finding, "interface = NIC in section [daemon] of %s",
			    doctor->plan.path);
	} else if (*device->aside) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "it answers at %s, but its route leads to %s: "
			   "two interfaces are in one network",
			   device->nic, device->aside);
		doctor_mend(finding,
			    "interface = %s in section [daemon] of %s, or another "
			    "network for %s",
			    device->nic, doctor->plan.path, device->aside);
	} else if (device->through_router) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "through a router at %s: its delays and losses "
			   "are added",
			   device->nic);
		doctor_mend(finding, "connect it directly, and ip address add ADDRESS/24 dev NIC");
		doctor_keep(finding, DOCTOR_UP, "NIC");
	} else {
		doctor_say(finding, DOCTOR_OK, "directly at %s", device->nic);
	}
}

/* What is said of each state, and how bad it is. */
static const struct {
	enum doctor_verdict verdict;
	const char *why;
} neighbours[] = {
	[NEIGHBOUR_UNSEEN] = { DOCTOR_UNKNOWN, "the kernel does not tell its entry" },
	[NEIGHBOUR_NONE] = { DOCTOR_ADVICE, "it has no complete entry: the first packet waits "
					    "until it answers ARP" },
	[NEIGHBOUR_FAILED] = { DOCTOR_PROBLEM, "it does not answer ARP: it is off, or has another "
					       "address" },
	[NEIGHBOUR_STALE] = { DOCTOR_ADVICE, "its entry is stale and is asked for again; if that "
					     "fails, packets wait" },
	[NEIGHBOUR_REACHABLE] = { DOCTOR_ADVICE, "its entry is not permanent: it is asked for "
						 "again and again, and if that fails, packets "
						 "wait" },
	[NEIGHBOUR_PERMANENT] = { DOCTOR_OK, "its entry is permanent" },
};

static void judge_neighbour(const struct doctor *doctor, struct doctor_finding *finding)
{
	const struct doctor_device *device = finding->device;
	uint32_t a = device->address;
	enum neighbour neighbour;
	char mac[NEIGHBOUR_MAC];

	if (!a || !*device->nic || device->through_router) {
		doctor_say(finding, DOCTOR_UNKNOWN, "not a neighbour; see the check route");
		return;
	}
	if (!strcmp(device->nic, "lo")) {
		doctor_say(finding, DOCTOR_OK, "the loopback has none");
		return;
	}
	neighbour = neighbour_look(doctor->root, device->nic, a, mac);
	doctor_say(finding, neighbours[neighbour].verdict, "%s", neighbours[neighbour].why);
	if (neighbour == NEIGHBOUR_UNSEEN || neighbour == NEIGHBOUR_PERMANENT)
		return;
	doctor_mend(finding, "ip neighbour replace %u.%u.%u.%u lladdr %s dev %s nud permanent",
		    a >> 24, a >> 16 & 255, a >> 8 & 255, a & 255, *mac ? mac : "ITS-MAC",
		    device->nic);
	doctor_keep(finding, DOCTOR_UP, device->nic);
}

static void judge_link(const struct doctor *doctor, struct doctor_finding *finding)
{
	const char *nic = finding->nic->name;
	char state[32], duplex[32];
	long carrier, speed = -1;

	probe_text(doctor->root, duplex, sizeof(duplex), "/sys/class/net/%s/duplex", nic);
	probe_number(doctor->root, &speed, "/sys/class/net/%s/speed", nic);
	if (is_loopback(finding)) {
		doctor_say(finding, DOCTOR_OK, "the loopback: no card at all");
	} else if (probe_text(doctor->root, state, sizeof(state), "/sys/class/net/%s/phy80211/name",
			      nic)) {
		doctor_say(finding, DOCTOR_PROBLEM, "a radio: packets are late by milliseconds");
		doctor_mend(finding, "a cable");
	} else if (!probe_number(doctor->root, &carrier, "/sys/class/net/%s/carrier", nic)) {
		doctor_say(finding, DOCTOR_UNKNOWN,
			   "/sys/class/net/%s/carrier cannot be read "
			   "(is the interface up?)",
			   nic);
		doctor_mend(finding, "ip link set %s up", nic);
		doctor_keep(finding, "auto %s in /etc/network/interfaces", nic);
	} else if (!carrier) {
		doctor_say(finding, DOCTOR_PROBLEM, "no carrier: cable or device is off");
		doctor_mend(finding, "plug in the cable, switch the device on");
	} else if (!strcmp(duplex, "half")) {
		doctor_say(finding, DOCTOR_PROBLEM, "half duplex: packets collide");
		doctor_mend(finding, "ethtool -s %s autoneg on, another cable or switch", nic);
		doctor_keep(finding, DOCTOR_UP, nic);
	} else if (speed > 0) {
		doctor_say(finding, DOCTOR_OK, "%ld Mbit/s", speed);
	} else {
		doctor_say(finding, DOCTOR_UNKNOWN, "it is up; the driver tells no speed");
	}
}

/* Intel's drivers take the least rx-usecs for ways of their own to choose how long it is. */
static bool chooses_itself(const struct nic *nic)
{
	static const struct {
		const char *driver;
		long last;
	} modes[] = {
		{ "e1000", 4 }, { "e1000e", 4 }, { "igb", 3 }, { "igc", 3 }, { "ixgbe", 1 },
	};
	const long usecs = nic->value[NIC_RX_USECS];

	for (size_t i = 0; i < sizeof(modes) / sizeof(modes[0]); i++)
		if (!strcmp(nic->driver, modes[i].driver))
			return usecs >= 1 && usecs <= modes[i].last;
	return false;
}

/* Only what the driver has: one word that it does not know, and it refuses all of them. */
static void mend_coalescing(struct doctor_finding *finding)
{
	const struct nic *nic = finding->nic;

	doctor_mend(finding, "ethtool -C %s%s rx-usecs 0%s", nic->name,
		    nic->value[NIC_ADAPTIVE_RX] == 1 ? " adaptive-rx off" : "",
		    nic->value[NIC_RX_FRAMES] > 1 ? " rx-frames 1" : "");
	doctor_keep(finding, DOCTOR_UP, nic->name);
}

static void judge_coalescing(const struct doctor *doctor, struct doctor_finding *finding)
{
	const long *value = finding->nic->value;

	(void)doctor;
	if (said_loopback(finding))
		return;
	if (value[NIC_RX_USECS] == NIC_UNKNOWN) {
		doctor_say(finding, DOCTOR_UNKNOWN, "the driver does not tell");
	} else if (value[NIC_ADAPTIVE_RX] == 1) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "the driver chooses how long packets wait "
			   "(adaptive)");
	} else if (chooses_itself(finding->nic)) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "the driver chooses how long packets wait "
			   "(%s means that by rx-usecs %ld)",
			   finding->nic->driver, value[NIC_RX_USECS]);
	} else if (value[NIC_RX_USECS] > LATE_US) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "a received packet waits up to %ld us for "
			   "others",
			   value[NIC_RX_USECS]);
	} else {
		doctor_say(finding, DOCTOR_OK, "a received packet waits at most %ld us",
			   value[NIC_RX_USECS]);
	}
	if (finding->verdict == DOCTOR_ADVICE)
		mend_coalescing(finding);
}

static void judge_offloads(const struct doctor *doctor, struct doctor_finding *finding)
{
	const long *value = finding->nic->value;

	(void)doctor;
	if (said_loopback(finding))
		return;
	if (value[NIC_GRO] == NIC_UNKNOWN && value[NIC_LRO] == NIC_UNKNOWN) {
		doctor_say(finding, DOCTOR_UNKNOWN, "the driver does not tell");
	} else if (value[NIC_GRO] > 0 || value[NIC_LRO] > 0) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "received packets are looked through for ones "
			   "to merge (%s%s%s)",
			   value[NIC_GRO] > 0 ? "GRO" : "",
			   value[NIC_GRO] > 0 && value[NIC_LRO] > 0 ? ", " : "",
			   value[NIC_LRO] > 0 ? "LRO" : "");
		doctor_mend(finding, "ethtool -K %s gro off lro off", finding->nic->name);
		doctor_keep(finding, DOCTOR_UP, finding->nic->name);
	} else {
		doctor_say(finding, DOCTOR_OK, "GRO and LRO are off");
	}
}

static void judge_queues(const struct doctor *doctor, struct doctor_finding *finding)
{
	long count = finding->nic->value[NIC_CHANNELS];

	(void)doctor;
	if (said_loopback(finding))
		return;
	if (count == NIC_UNKNOWN || count == 0) {
		doctor_say(finding, DOCTOR_UNKNOWN, "the driver does not tell");
	} else if (count > 1) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "%ld queues receive, so that a device's packets "
			   "may come at any of %ld interrupts",
			   count, count);
		doctor_mend(finding, "ethtool -L %s %s 1", finding->nic->name,
			    finding->nic->value[NIC_RX_CHANNELS] > 1 ? "rx" : "combined");
		doctor_keep(finding, DOCTOR_UP, finding->nic->name);
	} else {
		doctor_say(finding, DOCTOR_OK, "one queue receives");
	}
}

static void judge_eee(const struct doctor *doctor, struct doctor_finding *finding)
{
	long on = finding->nic->value[NIC_EEE];

	(void)doctor;
	if (said_loopback(finding))
		return;
	if (on == NIC_UNKNOWN) {
		doctor_say(finding, DOCTOR_UNKNOWN, "the driver does not tell");
	} else if (on) {
		doctor_say(finding, DOCTOR_ADVICE,
			   "the link sleeps between packets (EEE) and "
			   "needs some 20 us to wake up");
		doctor_mend(finding, "ethtool --set-eee %s eee off", finding->nic->name);
		doctor_keep(finding, DOCTOR_UP, finding->nic->name);
	} else {
		doctor_say(finding, DOCTOR_OK, "the link does not sleep");
	}
}

static const struct doctor_check checks[] = {
	{ "route", DOCTOR_DEVICE, judge_route },
	{ "neighbour", DOCTOR_DEVICE, judge_neighbour },
	{ "nic-link", DOCTOR_NIC, judge_link },
	{ "nic-coalescing", DOCTOR_NIC, judge_coalescing },
	{ "nic-offloads", DOCTOR_NIC, judge_offloads },
	{ "nic-queues", DOCTOR_NIC, judge_queues },
	{ "nic-eee", DOCTOR_NIC, judge_eee },
};
const struct doctor_checks doctor_nic_checks = { checks, sizeof(checks) / sizeof(checks[0]) };
