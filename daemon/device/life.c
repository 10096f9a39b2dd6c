/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Found, identified, configured, run, lost, and again: the one place where
 * the link changes its state.
 *
 *	searching --answer--> identifying --> configuring --> running
 *	    ^                     ^  ^                           |  |
 *	    +-- another device ---+  +------- restarted ---------+  |
 *	                          +--answer-- lost <---- silent ----+
 *
 * Nothing is ever given up: searching and lost ask "who are you" (0x00) some
 * ten times a second, for ever, and that is the only request which a device
 * gets before its serial number and type were seen to be right. A foreign
 * device is asked now and then whether it is still the foreign one.
 *
 * Questions that arrive keep the device's own failsafe quiet. Where only its answers are
 * lost, outputs would stay on and an axis would run on for as long as we ask. So a device
 * that is lost for longer than most take to start is left alone once, for as long as its
 * failsafe waits: a short loss costs no time, and a long one ends with outputs and axes
 * off, whichever way is broken. So is one that was not heard yet, which may be as a daemon
 * before us has left it; and at once one with a heater or a motor that may still be on.
 *
 * Silence is counted from the last answer, or from the first question after
 * it, so that nobody is lost who was not asked. A loop that itself stood
 * still for as long has lost the device too: what happened meanwhile nobody
 * knows, and motion has to be permitted anew (invariant I7). So has a machine that was
 * suspended, for however short a time.
 *
 * Coming from lost or restarted everything is read and compared again: the
 * device may have been switched off, replaced, or set up by somebody else.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define PROBE_NS (100 * MS)		/* from probe to probe */
#define FOREIGN_NS (500 * MS)		/* ... when a foreign device answers */
#define WANTS_ADDRESS_NS (1 * SECOND)	/* so long nobody answered */
#define SAY_AGAIN_NS (60 * SECOND)
#define QUESTIONS_NS (1500 * MS)	/* to a lost device, before its failsafe's turn */
#define FAILSAFE_LATE_NS (200 * MS)	/* its clock, and what is still on its way */

static enum event_level level_of(enum pokeys_link link, enum pokeys_fault fault)
{
	if (link == POKEYS_LINK_LOST || fault == POKEYS_FAULT_CONFIG_REFUSED ||
	    fault == POKEYS_FAULT_LOCKED)
		return EVENT_ERROR;
	if (fault == POKEYS_FAULT_IN_USE)
		return EVENT_DEBUG; /* control/claim.c knows the owner, and logs it */
	return fault ? EVENT_WARNING : EVENT_NOTICE;
}

/* The reason is kept until there is another one. */
static void note_fault(struct device *device, enum pokeys_fault fault)
{
	device->life.fault = (uint8_t)fault;
	if (!fault)
		return;
	device->image.fault = (uint8_t)fault;
	device->image.fault_count++;
}

void life_fault(struct device *device, enum pokeys_fault fault)
{
	const enum pokeys_link link = (enum pokeys_link)device->image.link;

	if (fault == device->life.fault)
		return;
	note_fault(device, fault);
	device_say(device, EVENT_LINK, level_of(link, fault), link, link, fault);
}

void life_block(struct device *device, enum pokeys_fault fault)
{
	life_fault(device, fault);
	device->life.blocked = true;
}

static uint64_t failsafe_ns(uint8_t timeout, uint8_t peripherals)
{
	return peripherals ? timeout * 100 * MS : 0;
}

void life_failsafe_read(struct device *device, const struct wire_failsafe_req *have)
{
	device->life.failsafe = *have;
	device->life.failsafe_ns = failsafe_ns(have->timeout, have->peripherals);
}

static uint8_t larger(uint8_t a, uint8_t b)
{
	return a > b ? a : b;
}

/* Until it is read back, it may have this one or the one of before: what both switch off counts. */
void life_failsafe_sent(struct device *device, const struct wire_failsafe_req *want)
{
	const uint64_t ns = failsafe_ns(want->timeout, want->peripherals);
	struct life *life = &device->life;
	struct wire_failsafe_req *both = &life->failsafe;

	both->timeout = both->timeout && want->timeout ? larger(both->timeout, want->timeout) : 0;
	both->peripherals &= want->peripherals;
	both->outputs |= want->outputs;
	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		both->pwm_percent[i] = larger(both->pwm_percent[i], want->pwm_percent[i]);
	if (ns > life->failsafe_ns)
		life->failsafe_ns = ns;
}

static void note_left(struct device *device)
{
	struct life *life = &device->life;

	life->left_ns = device->now_ns;
	life->alone_until_ns = 0;
	life->cooled = false;
}

const struct wire_failsafe_req *life_failsafe(const struct device *device)
{
	return device->life.failsafe_ns ? &device->life.failsafe : NULL;
}

static void leave_running(struct device *device)
{
	note_left(device);
	safe_permit_drop(device);
	safe_lost(device);
	one_shot_abort(device);
	task_lost(device);
	memset(device->image.slow_millihertz, 0, sizeof(device->image.slow_millihertz));
}

static void forget_failsafe(struct life *life)
{
	memset(&life->failsafe, 0, sizeof(life->failsafe));
	life->failsafe_ns = 0;
}

static void begin_running(struct device *device)
{
	/* what is on from now on, another start of it switches off, or does not */
	if (!failsafe_known(device))
		forget_failsafe(&device->life);
	device->meter.reconnects += device->life.ran;
	device->life.ran = true;
	plan_begin(device);
	safe_begin(device);
	motion_begin(device);
	place_begin(device);
	threading_begin(device);
}

void life_enter(struct device *device, enum pokeys_link link, enum pokeys_fault fault)
{
	const enum pokeys_link before = (enum pokeys_link)device->image.link;

	if (link == before) {
		life_fault(device, fault);
		return;
	}
	note_fault(device, fault);
	device->life.blocked = false;
	device->image.link = (uint8_t)link;
	device->image.t_link_ns = device->now_ns;
	device_say(device, EVENT_LINK, level_of(link, fault), link, before, fault);
	if (before == POKEYS_LINK_RUNNING)
		leave_running(device);
	if (link == POKEYS_LINK_RUNNING)
		begin_running(device);
}

void life_asked(struct device *device)
{
	struct life *life = &device->life;

	if (!life->asked)
		life->quiet_since_ns = device->now_ns;
	life->asked = true;
}

void life_heard(struct device *device, uint64_t t_ns)
{
	struct life *life = &device->life;

	if (t_ns > life->quiet_since_ns)
		life->quiet_since_ns = t_ns;
	life->asked = device->mailbox.in_flight_count > 0;
}

static enum pokeys_fault why_silent(const struct device *device)
{
	if (device->life.in_use)
		return POKEYS_FAULT_IN_USE;
	return device->mailbox.statistics.send_failed != device->life.failed_sends ?
		       POKEYS_FAULT_NETWORK :
		       POKEYS_FAULT_NO_ANSWER;
}

/* From the beginning, with nothing in flight and no round trip known. */
static void start_over(struct device *device)
{
	struct life *life = &device->life;

	pokeys_device_reset(&device->mailbox, device->now_ns);
	life->asked = false;
	life->rebooted = false;
	life->patient_until_ns = 0;
	life->probing = false;
	life->probe_after_ns = device->now_ns;
}

static void lose(struct device *device)
{
	const enum pokeys_fault why = why_silent(device);

	start_over(device);
	life_enter(device, device->life.ran ? POKEYS_LINK_LOST : POKEYS_LINK_SEARCHING, why);
}

void device_suspended(struct device *device, uint64_t now_ns, uint64_t slept_ns)
{
	const uint8_t link = device->image.link;

	device->now_ns = now_ns;
	restart_slept(device, slept_ns);
	place_slept(device, slept_ns);
	intake_forget(device);
	safe_permit_drop(device);
	safe_lost(device);
	if (link == POKEYS_LINK_SEARCHING || link == POKEYS_LINK_LOST)
		return;
	start_over(device);
	life_enter(device, device->life.ran ? POKEYS_LINK_LOST : POKEYS_LINK_SEARCHING,
		   POKEYS_FAULT_SUSPENDED);
}

static void leave_alone(struct device *device, uint64_t waits_ns)
{
	struct life *life = &device->life;

	life->waits_ns = waits_ns;
	life->alone_until_ns = device->now_ns + waits_ns + FAILSAFE_LATE_NS;
	life->probe_after_ns = life->alone_until_ns;
	life->cooled = true;
	life->left_alone = true;
}

/* Its failsafe has had its turn. */
static void end_silence(struct device *device)
{
	struct life *life = &device->life;

	if (!life->left_alone || device->now_ns < life->alone_until_ns)
		return;
	life->left_alone = false;
	if (life->waits_ns >= life->failsafe_ns)
		loops_stopped_itself(device);
}

void life_refuse(struct device *device, enum pokeys_fault fault)
{
	const uint32_t serial = device->identify.identity.serial;
	struct life *life = &device->life;
	const bool known = life->foreign && life->foreign_serial == serial;

	if (fault == POKEYS_FAULT_WRONG_SERIAL &&
	    (!known || device->now_ns - life->foreign_said_ns >= SAY_AGAIN_NS)) {
		device_say(device, EVENT_WRONG_SERIAL, EVENT_ERROR, serial, device->config.serial,
			   0);
		life->foreign_said_ns = device->now_ns;
	}
	life->foreign = true;
	life->foreign_serial = serial;
	life->ran = false;
	life->asked = false;
	life->probe_after_ns = device->now_ns + FOREIGN_NS;
	life_enter(device, POKEYS_LINK_SEARCHING, fault);
	/* ours was at this address: it may hear what is asked there */
	if (loops_may_run(device) && life->failsafe_ns)
		leave_alone(device, life->failsafe_ns);
}

/*
 * How long its failsafe waits. Of one that did not run yet it is what we want it to be: so a
 * daemon before us has set it up, if it had these wishes. It may be ours at another address.
 */
static uint64_t failsafe_waits_ns(const struct device *device)
{
	const struct pokeys_settings *wanted = &device->wishes.wanted;
	const struct life *life = &device->life;
	uint64_t waits_ns = 0;

	if (life->ran)
		return life->failsafe_ns;
	if (!life->foreign && wanted->set & POKEYS_SET_FAILSAFE)
		waits_ns = failsafe_ns(wanted->failsafe_timeout, wanted->failsafe_peripherals);
	return loops_may_run(device) && life->failsafe_ns > waits_ns ? life->failsafe_ns : waits_ns;
}

/*
 * It answers, and may heat or move, as a daemon before us or we ourselves have left it: questions
 * would keep its failsafe quiet until all its settings are read. True: it is left alone first.
 */
static bool cools(struct device *device)
{
	struct life *life = &device->life;
	const uint64_t waits_ns = failsafe_waits_ns(device);
	const bool may_run = life->ran ? loops_may_run(device) : loops_covered(device);

	if (life->cooled || !may_run || !waits_ns)
		return false;
	leave_alone(device, waits_ns);
	return true;
}

/*
 * Once from the first question or from running to running, whatever comes back in between:
 * long enough without a question for its own failsafe.
 */
static void leave_to_failsafe(struct device *device)
{
	const uint64_t waits_ns = failsafe_waits_ns(device);
	struct life *life = &device->life;

	if (life->alone_until_ns || !waits_ns || device->now_ns - life->left_ns < QUESTIONS_NS)
		return;
	leave_alone(device, waits_ns);
}

static void probe_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	enum pokeys_fault fault;

	(void)context;
	device->now_ns = now_ns;
	device->life.probing = false;
	if (entry->state == POKEYS_REQUEST_CANCELLED)
		return;
	if (!answered(entry)) {
		life_fault(device, why_silent(device));
		if (device->image.fault == POKEYS_FAULT_NETWORK)
			device->life.left_ns = now_ns; /* nor was it asked then */
		leave_to_failsafe(device);
		return;
	}
	if (!identify_believed(device, entry->response_buffer)) {
		device->life.probe_after_ns = now_ns;
		return;
	}
	if (cools(device))
		return;
	identify_begin(device);
	fault = identify_take(device, entry->response_buffer);
	if (fault) {
		life_refuse(device, fault);
		return;
	}
	device->life.foreign = false;
	life_enter(device, POKEYS_LINK_IDENTIFYING, POKEYS_FAULT_NONE);
}

static void probe(struct device *device)
{
	struct life *life = &device->life;

	if (!life->left_ns)
		life->left_ns = device->now_ns;
	if (!life->address) {
		life_fault(device, life->in_use ? POKEYS_FAULT_IN_USE : POKEYS_FAULT_NO_ADDRESS);
		leave_to_failsafe(device);
		return;
	}
	if (life->probing || device->now_ns < life->probe_after_ns)
		return;
	life->failed_sends = device->mailbox.statistics.send_failed;
	if (!request_send(device, WIRE_OP_DEVICE_DATA, NULL, probe_ended, NULL, NULL)) {
		life->left_ns = device->now_ns; /* it was not asked */
		return;
	}
	life->probing = true;
	life->probe_after_ns = device->now_ns + PROBE_NS;
}

/* Nobody has answered for long, or nobody has asked: we stood still. */
static bool silent(const struct device *device)
{
	const struct life *life = &device->life;
	const uint64_t limit = device->config.lost_after_ns;

	if (device->now_ns < life->patient_until_ns)
		return false;
	if (device->cycle_ns && device->now_ns - device->cycle_ns >= limit)
		return true;
	return life->asked && device->now_ns - life->quiet_since_ns >= limit;
}

/* An output of a loop is to be off, and the device does not say so, whatever else it answers. */
static void leave_unheard(struct device *device)
{
	const bool heats = heating_unheard(device);

	lose(device);
	device_say(device, heats ? EVENT_HEATER_UNHEARD : EVENT_SERVO_UNHEARD, EVENT_ERROR,
		   (int64_t)(device->life.failsafe_ns / MS), 0, 0);
	leave_alone(device, device->life.failsafe_ns);
}

/* What may heat or move there is not to do so for as long as we ask in vain. */
static void lose_silent(struct device *device)
{
	const bool runs = loops_may_run(device);

	lose(device);
	if (runs && device->life.failsafe_ns)
		leave_alone(device, device->life.failsafe_ns);
}

/*
 * One that has just begun has all outputs off. What any other has on, nobody knows: it is switched
 * off as soon as it runs; if that takes too long, it is left alone (found_cycle()).
 */
static void restarted(struct device *device)
{
	start_over(device);
	if (device->life.began)
		loops_began_again(device);
	identify_begin(device);
	life_enter(device, POKEYS_LINK_IDENTIFYING, POKEYS_FAULT_REBOOTED);
}

static void found_cycle(struct device *device)
{
	if (silent(device)) {
		lose_silent(device);
		return;
	}
	if (heating_unheard(device) || servoing_unheard(device)) {
		leave_unheard(device);
		return;
	}
	if (device->life.rebooted)
		restarted(device);
}

void life_cycle(struct device *device)
{
	if (device->image.link != POKEYS_LINK_SEARCHING && device->image.link != POKEYS_LINK_LOST)
		found_cycle(device);
	switch ((enum pokeys_link)device->image.link) {
	case POKEYS_LINK_SEARCHING:
	case POKEYS_LINK_LOST:
		end_silence(device);
		probe(device);
		break;
	case POKEYS_LINK_IDENTIFYING:
		identify_cycle(device);
		break;
	case POKEYS_LINK_CONFIGURING:
		configure_cycle(device);
		break;
	case POKEYS_LINK_RUNNING:
		plan_cycle(device);
		break;
	}
}

void device_set_address(struct device *device, uint32_t address, uint16_t port, uint64_t now_ns)
{
	struct life *life = &device->life;

	device->now_ns = now_ns;
	if (life->address == address && life->port == port)
		return;
	life->address = address;
	life->port = port;
	life->foreign = false;
	life->ran = false;
	life->left_ns = now_ns;
	life->alone_until_ns = 0;
	life->cooled = life->left_alone = false;
	start_over(device);
	pokeys_device_set_peer(&device->mailbox, address, port);
	life_enter(device, POKEYS_LINK_SEARCHING, POKEYS_FAULT_NONE);
	device->image.identity.address = address;
}

void device_set_in_use(struct device *device, bool in_use)
{
	device->life.in_use = in_use;
}

bool device_wants_address(const struct device *device)
{
	const struct life *life = &device->life;
	const uint8_t link = device->image.link;

	/* a search is a question, too */
	if (device->config.address || device->now_ns < life->alone_until_ns ||
	    (link != POKEYS_LINK_SEARCHING && link != POKEYS_LINK_LOST))
		return false;
	return !life->address || life->foreign ||
	       device->now_ns - device->image.t_link_ns >= WANTS_ADDRESS_NS;
}
