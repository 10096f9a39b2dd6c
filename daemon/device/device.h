/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One device's life: found, identified, configured, run, lost, and again.
 *
 * Pure: no clock, no socket, no allocation, no log. The loop calls it once a
 * cycle and whenever a packet came or a deadline passed; what it has to say
 * goes into the event ring. All functions are realtime and belong to the
 * realtime thread, except where said.
 */
#ifndef DEVICE_DEVICE_H
#define DEVICE_DEVICE_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/async.h>
#include <pokeys/command.h>
#include <pokeys/settings.h>
#include <pokeys/state.h>
#include "daemon/device/event.h"
#include "daemon/device/heating.h"
#include "daemon/device/servoing.h"

/* Outputs beside the terminals, in resume_parts. */
enum {
	DEVICE_RESUME_PWM = 1u << 0,
	DEVICE_RESUME_POEXTBUS = 1u << 1,
	DEVICE_RESUME_EXTERNAL = 1u << 2, /* external outputs and relays */
	DEVICE_RESUME_PONET = 1u << 3,
};

/* An axis of the pulse engine, as the daemon drives it. */
struct device_axis_config {
	char name[POKEYS_AXIS_NAME];
	double pulses_per_unit; /* below 0: the count falls; 0: on no path */
	bool lead;              /* references lead a position that moves on */
};

/* From pokeysd.conf (or a test); copied at init, never changed afterwards. */
struct device_config {
	char name[32];
	uint8_t index;   /* in the daemon, for events */
	uint32_t serial; /* 0 = whoever answers at the address */
	/* IPv4, host byte order; 0 = by discovery. Nothing is sent there but after
	 * device_set_address(): it may be that somebody else drives it. */
	uint32_t address;
	uint16_t port;                         /* 20055 */
	uint64_t period_ns;                    /* of the loop */
	uint64_t heartbeat_timeout_ns;         /* commander late -> safe state */
	uint64_t stale_after_ns;               /* fast data older -> stale flag */
	uint64_t lost_after_ns;                /* no valid reply for this long -> lost */
	uint32_t fast_divider;                 /* fast requests every n-th cycle, >= 1 */
	double slow_hz, encoder_hz, analog_hz; /* rates of the slow groups */
	bool slow_together; /* all of them in one cycle, at slow_hz; not PoNET's */
	struct pokeys_options mailbox;

	uint8_t safe_mask[8];    /* outputs that the safe state touches, besides all that
				  * a commander ever drove */
	uint8_t safe_outputs[8]; /* their values */
	uint8_t safe_hold[8];    /* outputs it leaves as they are, whoever drove them */
	bool emergency_holds;    /* the commander's emergency stop stops axes only */
	/*
	 * What follows a commander at once after a loss, instead of staying safe until
	 * machine-on rises. Auto: none of a device that is there to move something, all of
	 * another one; the other two count otherwise.
	 */
	bool resume_auto;
	uint8_t resume_outputs[8];
	uint8_t resume_parts;            /* DEVICE_RESUME_* */
	struct pokeys_settings settings; /* what it wants of the device's own settings */
	struct heating_config heater[POKEYS_HEATERS];
	double heater_watts; /* of all heaters together, at most; 0 = unlimited */
	uint8_t heaters;
	struct servoing_config servo[POKEYS_SERVOS];
	uint8_t servos;
	double corner_deviation; /* of paths, units */
	struct device_axis_config axis[POKEYS_AXES];
	char password[33]; /* of the device, NUL terminated; protocol section 1.11 */
	bool have_password;
};

/* Defaults of every field (name empty, serial 0, address 0). Any thread. */
void device_config_defaults(struct device_config *config);

struct device; /* see daemon/device/internal.h; sized by device_size() */

/* Bytes an instance needs, 64-byte aligned; the caller provides them zeroed. */
size_t device_size(void);

/* Cold. `events` outlives the device. It has no address yet. */
void device_init(struct device *device, const struct device_config *config,
		 const struct pokeys_io *io, struct event_ring *events);

/*
 * Discovery (or the configuration) says where the device is. The next cycle
 * starts anew there if it differs from before. The caller aims the transport
 * first.
 */
void device_set_address(struct device *device, uint32_t address, uint16_t port, uint64_t now_ns);

/*
 * Somebody else drives the device at the address that is wanted: this is then why it is
 * not found, in the image; whoever calls has told the rest. Realtime.
 */
void device_set_in_use(struct device *device, bool in_use);

/* True while an address from discovery would help (none, or nobody answers at the last). */
bool device_wants_address(const struct device *device);

/*
 * A cycle begins: take the newest command (NULL = there is none, or it was
 * refused as a whole with `refused` = its -errno) and send what must not wait: the
 * fast requests, and where axes are to go. device_spare() follows in the same cycle.
 */
void device_cycle(struct device *device, uint64_t cycle, uint64_t tick_ns, uint64_t now_ns,
		  const struct pokeys_command *command, int refused);

/*
 * The rest of the cycle that device_cycle() began: one-shots, settings, the lesser
 * outputs and the slow groups. Apart from it so that a caller may hand the urgent
 * requests over before these are planned.
 */
void device_spare(struct device *device);

/* One datagram that arrived on this device's channel. */
void device_deliver(struct device *device, const uint8_t *data, size_t length,
		    const struct pokeys_rx *rx, uint64_t now_ns);

/* Its mailbox, to look at: tries of a request, what became of a datagram. */
const pokeys_device_t *device_mailbox(const struct device *device);

/* Resend and expire whatever is due. */
void device_check(struct device *device, uint64_t now_ns);

/* When device_check wants to be called; UINT64_MAX = never. */
uint64_t device_next_deadline(const struct device *device);

/* True when no fast request of this cycle is still open. */
bool device_fast_complete(const struct device *device);

/* The whole state image as of now. magic/version/hash/epoch are the publisher's. */
void device_publish(struct device *device, uint64_t now_ns, struct pokeys_state *out);

/*
 * A new wish of the commander's (settings.h) is taken over. A field out of range
 * is refused by itself, with an event and in the report; the value of before stays.
 */
void device_wish(struct device *device, const struct pokeys_wish *wish);

/* Replaces what pokeysd.conf wants. Its ranges are the caller's to have checked. */
void device_wanted(struct device *device, const struct pokeys_settings *wanted);

/*
 * True if the report has changed since the last call: *out is it then, but for
 * magic, version, hash, epoch and t_publish_ns. Call it before device_publish(),
 * so that state.report_count never runs ahead of the report.
 */
bool device_report(struct device *device, struct pokeys_report *out);

enum device_order {
	DEVICE_ORDER_SAVE,  /* the settings as they are, into the device's flash */
	DEVICE_ORDER_APPLY, /* read, compare and write all settings once more */
	DEVICE_ORDER_REBOOT,
};

/*
 * Somebody at a terminal orders. 0 = it will be done (events say how it went);
 * -ENOTCONN = the link does not run, -EBUSY = motion is permitted or the engine
 * moves (save and reboot), -EAGAIN = saved less than 2 s ago, -EALREADY = an order
 * is at work, -EINVAL = no such order.
 */
int device_order(struct device *device, enum device_order order);

/* Histograms and counters of the link, into the parts of diag that are the device's. */
void device_diag(const struct device *device, struct pokeys_diag *out);

/*
 * This machine was suspended for slept_ns: nobody asked the device, and no clock of ours went
 * on. It is taken for lost, and its commander for gone until the next heartbeat. Realtime.
 */
void device_suspended(struct device *device, uint64_t now_ns, uint64_t slept_ns);

/*
 * The daemon ends: bring outputs and axes into the safe state.
 * device_stopped() becomes true when the device has acknowledged it, or when
 * it does not answer.
 */
void device_stop(struct device *device, uint64_t now_ns);
bool device_stopped(const struct device *device);

/*
 * The loop makes no more cycle, stopped or not: say so if the link ran and the device has not
 * acknowledged the safe state.
 */
void device_ended(struct device *device, uint64_t now_ns);

#endif
