/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_RIG_H
#define SIM_RIG_H

/*
 * A device at the end of a faulty link, ready for a client: what is sent
 * travels, waits its turn at the device, is served, and its reply travels
 * back. The same rig stands behind pokeys-sim's sockets in real time and in
 * unit tests in virtual time. Pure, of fixed size, no allocation; one thread.
 *
 * In a test:
 *
 *	static struct sim_rig rig;		(about 700 KB: not on the stack)
 *	sim_rig_init(&rig, NULL);
 *	sim_rig_send(&rig, now, request, 64);
 *	now = sim_rig_next(&rig);		(when something next happens)
 *	len = sim_rig_receive(&rig, now, reply, sizeof(reply));
 *
 * rig.device may be looked at and its bench be set at any time; call
 * sim_rig_run(&rig, now) first to have it up to date.
 */

#include "sim/device.h"
#include "sim/link.h"

#define SIM_RIG_QUEUE 64	/* datagrams waiting for the device */
#define SIM_RIG_STREAM 256	/* and requests which came by streams */
#define SIM_RIG_PLACES (SIM_RIG_QUEUE + SIM_RIG_STREAM + 1)	/* one to receive into */
#define SIM_RIG_NEVER SIM_LINK_NEVER
#define SIM_PEER_RELIABLE (UINT64_C(1) << 63)	/* a peer whose packets no fault touches (TCP) */

struct sim_rig_options {
	struct sim_device_options device;
	struct sim_link_options link;
	uint64_t seed;
	uint64_t service_ns; /* time the device takes for a request */
	uint64_t jitter_ns;  /* and up to this much more, evenly */
	double hiccup;       /* probability that a request takes hiccup_ns more */
	uint64_t hiccup_ns;
	uint64_t save_ns; /* time it is busy after saving to flash */
};

struct sim_rig_waiting {
	uint64_t peer;
	uint16_t len;
	uint8_t bytes[SIM_LINK_BYTES];
};

struct sim_rig_stats {
	uint64_t served;
	uint64_t overflow; /* requests lost because the device's queue was full */
	unsigned int high_water;
};

struct sim_rig {
	struct sim_device device;
	struct sim_link link;
	struct sim_prng prng;
	uint64_t service_ns;
	uint64_t jitter_ns;
	double hiccup;
	uint64_t hiccup_ns;
	uint64_t save_ns;
	uint64_t busy_ns; /* busy with its flash until then */
	uint64_t done_ns; /* when the request at the head is served */
	unsigned int head;
	unsigned int used;
	unsigned int streamed; /* of these, came by a stream */
	struct sim_rig_waiting queue[SIM_RIG_PLACES];
	uint64_t last_peer; /* of the last reply, and the reply */
	bool replied;
	uint8_t last_reply[WIRE_PK];
	struct sim_rig_stats stats;
};

/* NULL options: a perfect link, no service time, a 57CNC, seed 0. */
void sim_rig_init(struct sim_rig *rig, const struct sim_rig_options *options);

/* The client sends a datagram: 64 or 512 bytes are requests, anything else is dropped there. */
void sim_rig_send(struct sim_rig *rig, uint64_t now_ns, const uint8_t *bytes, size_t len);

/*
 * One datagram which has arrived at the client by now_ns; returns its length,
 * 0 when there is none. Call until 0. A reply truncated to nothing on its way
 * is dropped.
 */
size_t sim_rig_receive(struct sim_rig *rig, uint64_t now_ns, uint8_t *bytes, size_t cap);

/*
 * When the next packet arrives somewhere or is served; SIM_RIG_NEVER when the
 * line is quiet. The device's own milliseconds do not count.
 */
uint64_t sim_rig_next(const struct sim_rig *rig);

/* Lets everything happen up to now_ns, the device's own life included. */
void sim_rig_run(struct sim_rig *rig, uint64_t now_ns);

/*
 * For a server of many clients: `peer` comes back with the reply. A stream loses
 * nothing: who sends from a reliable peer sees to it that no more than SIM_RIG_STREAM
 * of these wait, and leaves in the stream what has no place.
 */
void sim_rig_send_from(struct sim_rig *rig, uint64_t now_ns, uint64_t peer, const uint8_t *bytes,
		       size_t len);
/* How many requests wait at the device whose peer is this one, in the bits of `mask`. */
unsigned int sim_rig_waiting(const struct sim_rig *rig, uint64_t peer, uint64_t mask);
bool sim_rig_receive_for(struct sim_rig *rig, uint64_t now_ns, uint64_t *peer, uint8_t *bytes,
			 size_t cap, size_t *len);

/*
 * The device reboots at now_ns: what waits for it is lost, what is under way
 * is not. Its dead time is options.device.boot_ms.
 */
void sim_rig_reboot(struct sim_rig *rig, uint64_t now_ns, bool lose_config);

/*
 * Sends the last reply once more, untouched by faults: stale packets for the
 * client. False when there was none yet.
 */
bool sim_rig_stray(struct sim_rig *rig, uint64_t now_ns);

/* Nothing passes in either direction from now for so long. */
void sim_rig_silence(struct sim_rig *rig, uint64_t now_ns, uint64_t for_ns);

#endif
