/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The world of the loop's unit tests: devices that behave as told, shared
 * memory that remembers when it was written, the memory transport, and a
 * clock that moves only when somebody sleeps, waits or is told to take time.
 * So every time in these tests is exact.
 */
#include <errno.h>
#include <string.h>
#include "tests/rt/doubles.h"

struct world world;

/* devices */

static void transmit(struct device *d, struct request *r)
{
	uint8_t packet[64] = { 0xbb, r->number };

	r->sent_ns = world.now;
	r->due_ns = world.now + d->deadline_ns;
	memmove(d->last_send_ns + 1, d->last_send_ns, sizeof d->last_send_ns - sizeof(uint64_t));
	d->last_send_ns[0] = world.now;
	d->io.send(d->io.context, packet, sizeof packet);
}

static void request(struct device *d, bool fast)
{
	for (int i = 0; i < REQUESTS; i++) {
		struct request *r = &d->request[i];

		if (r->open)
			continue;
		*r = (struct request){ .open = true, .fast = fast, .number = d->next_number++ };
		transmit(d, r);
		return;
	}
}

void device_cycle(struct device *d, uint64_t cycle, uint64_t tick_ns, uint64_t now_ns,
		  const struct pokeys_command *command, int refused)
{
	assert_true(now_ns >= tick_ns);
	if (d->cycles < LOG)
		d->tick_log[d->cycles] = tick_ns;
	d->cycles++;
	d->cycle = cycle;
	d->tick_ns = tick_ns;
	d->refused = refused;
	d->commands += command != NULL;
	if (command)
		d->heartbeat = command->heartbeat;
	for (int i = 0; i < REQUESTS; i++) /* the engine's window is not our subject */
		d->request[i].fast = false;
	for (uint32_t i = 0; i < d->fast; i++)
		request(d, true);
}

void device_spare(struct device *d)
{
	for (uint32_t i = 0; i < d->slow; i++)
		request(d, false);
}

void device_deliver(struct device *d, const uint8_t *data, size_t length,
		    const struct pokeys_rx *rx, uint64_t now_ns)
{
	assert_true(rx->t_ns <= now_ns);
	d->delivered++;
	if (now_ns - rx->t_ns > d->delivered_late_ns)
		d->delivered_late_ns = now_ns - rx->t_ns;
	world.now += d->deliver_takes_ns;
	if (length != 64)
		return;
	for (int i = 0; i < REQUESTS; i++)
		if (d->request[i].open && d->request[i].number == data[1])
			d->request[i].open = false;
}

const pokeys_device_t *device_mailbox(const struct device *d)
{
	static const pokeys_device_t mailbox;

	(void)d;
	return &mailbox;
}

void device_check(struct device *d, uint64_t now_ns)
{
	d->checked++;
	for (int i = 0; i < REQUESTS; i++) {
		struct request *r = &d->request[i];

		if (!r->open || r->due_ns > now_ns)
			continue;
		d->resent++;
		transmit(d, r);
	}
}

uint64_t device_next_deadline(const struct device *d)
{
	uint64_t due = UINT64_MAX;

	if (d->overdue)
		return 1;
	for (int i = 0; i < REQUESTS; i++)
		if (d->request[i].open && d->request[i].due_ns < due)
			due = d->request[i].due_ns;
	return due;
}

bool device_fast_complete(const struct device *d)
{
	for (int i = 0; i < REQUESTS; i++)
		if (d->request[i].open && d->request[i].fast)
			return false;
	return true;
}

void device_publish(struct device *d, uint64_t now_ns, struct pokeys_state *out)
{
	memset(out, 0, sizeof *out);
	out->cycle = d->cycle;
	out->t_cycle_ns = d->tick_ns;
	out->t_publish_ns = now_ns;
	out->link = d->link;
	out->report_count = d->reported;
	world.now += world.publish_takes_ns;
}

void device_wish(struct device *d, const struct pokeys_wish *wish)
{
	d->wishes++;
	d->wish_generation = wish->generation;
}

void device_wanted(struct device *d, const struct pokeys_settings *wanted)
{
	d->wanted_axes = wanted->axes;
}

bool device_report(struct device *d, struct pokeys_report *out)
{
	if (d->reported == d->report_count)
		return false;
	d->reported = d->report_count;
	memset(out, 0, sizeof *out);
	out->count = d->reported;
	return true;
}

int device_order(struct device *d, enum device_order order)
{
	if (d->orders < 8)
		d->order_cycle[d->orders] = d->cycle;
	d->orders++;
	d->last_order = order;
	return d->order_result;
}

void device_diag(const struct device *d, struct pokeys_diag *out)
{
	out->round_trip.count = d->delivered;
}

void device_set_address(struct device *d, uint32_t address, uint16_t port, uint64_t now_ns)
{
	d->address = address;
	d->port = port;
	d->address_ns = now_ns;
}

void device_set_in_use(struct device *d, bool in_use)
{
	d->in_use = in_use;
}

bool device_wants_address(const struct device *d)
{
	return d->wants_address;
}

void device_suspended(struct device *d, uint64_t now_ns, uint64_t slept_ns)
{
	assert_int_equal(now_ns, world.now);
	d->slept_ns += slept_ns;
	d->suspended++;
	d->suspended_cycles = d->cycles;
}

void device_stop(struct device *d, uint64_t now_ns)
{
	d->stopping = true;
	d->stop_ns = now_ns;
}

bool device_stopped(const struct device *d)
{
	return d->stopping && world.now >= d->stop_ns + d->stop_takes_ns;
}

void device_ended(struct device *d, uint64_t now_ns)
{
	assert_int_equal(now_ns, world.now);
	d->ends++;
	d->ended_cycles = d->cycles;
}

/* shared memory */

int shm_device_read_wish(struct shm_device *s, struct pokeys_wish *out)
{
	int result = s->wish_result;

	s->wish_result = 0;
	if (result == 1)
		*out = s->wish;
	return result;
}

void shm_device_write_report(struct shm_device *s, const struct pokeys_report *report)
{
	s->reports++;
	s->report = *report;
	s->report_before_state = s->published;
}

struct pokeys_state *shm_device_loan(struct shm_device *s)
{
	assert_false(s->loaned);
	s->loaned = true;
	return &s->cell[s->newest ^ 1];
}

void shm_device_prepare(struct shm_device *s)
{
	assert_false(s->loaned);
}

void shm_device_commit(struct shm_device *s)
{
	assert_true(s->loaned);
	s->loaned = false;
	s->newest ^= 1;
	if (s->published < LOG)
		s->published_log[s->published] = s->cell[s->newest].t_publish_ns;
	s->published++;
}

void shm_device_mirror(struct shm_device *s)
{
	assert_false(s->loaned);
}

void shm_device_write_diag(struct shm_device *s, const struct pokeys_diag *diag)
{
	s->diag = *diag;
	if (s->diags < LOG)
		s->diag_log[s->diags] = world.now;
	s->diags++;
}

int shm_device_read_command(struct shm_device *s, struct pokeys_command *out)
{
	if (world.on_look)
		world.on_look(&world, (uint32_t)(s - world.shm));
	if (s->command_result == 1)
		*out = s->command;
	return s->command_result;
}

/* network and clock */

static void sent(void *context, uint32_t channel, const uint8_t *data, size_t length, uint64_t now)
{
	struct world *w = context;
	uint64_t n = w->sent[channel]++;

	if (n < LOG)
		w->sent_log[channel][n] = now;
	if (w->round_trip_ns[channel] && !(channel == 0 && w->lose == n + 1))
		transport_memory_arrive(w->t, now + w->round_trip_ns[channel], channel,
					&w->aimed_at[channel], data, length);
	if (w->on_sent)
		w->on_sent(w, channel, data, length);
}

static int aimed(void *context, uint32_t channel, const struct transport_address *to)
{
	struct world *w = context;

	if (w->aims < LOG)
		w->aim_log[w->aims] = w->now;
	w->aims++;
	w->aimed_at[channel] = *to;
	return w->aim_result;
}

static uint64_t clock_now(void *context)
{
	struct world *w = context;

	if (w->now >= w->end_ns)
		w->loop.shared.stop = true;
	return w->now;
}

static uint64_t clock_boot(void *context)
{
	struct world *w = context;

	if (++w->boot_reads % 10 == 0)
		w->now += w->clock_takes_ns;
	return w->now + w->asleep_ns;
}

static void clock_sleep_until(void *context, uint64_t until_ns)
{
	struct world *w = context;

	assert_true(until_ns > w->now);
	w->sleeps++;
	w->slept_ns += until_ns - w->now;
	w->now = until_ns + w->oversleep_ns;
	w->oversleep_ns = 0;
}

/* The memory transport's wait, with an account of how the time was spent. */
static const struct transport_ops *inner;

static enum transport_wait wait_and_account(struct transport *t, uint64_t deadline_ns)
{
	uint64_t before = world.now;
	enum transport_wait result;

	result = inner->wait(t, deadline_ns);
	world.now += world.wait_late_ns;
	world.wait_late_ns = 0;
	world.waits++;
	*(t->spin ? &world.spun_ns : &world.waited_ns) += world.now - before;
	return result;
}

void world_begin(uint32_t count)
{
	static struct transport_ops ops;
	struct transport_memory_hooks hooks = { &world.now, sent, aimed, &world };
	struct loop *loop = &world.loop;

	memset(&world, 0, sizeof world);
	world.now = 1000 * SECOND;
	assert_int_equal(transport_memory_open(&world.t, &hooks), 0);
	inner = world.t->ops;
	ops = *inner;
	ops.wait = wait_and_account;
	world.t->ops = &ops;
	loop->options = (struct loop_options){ MS, LOOP_SLEEP, 0.5, 0.9, LOOP_PHASE_AUTO };
	loop->transport = world.t;
	loop->count = count;
	for (uint32_t i = 0; i < count; i++) {
		struct device *d = &world.device[i];

		*d = (struct device){ .fast = 2,
				      .deadline_ns = 300 * US,
				      .link = POKEYS_LINK_RUNNING };
		world.round_trip_ns[i] = 100 * US;
		loop_io(loop, i, &d->io);
		loop->devices[i] = (struct loop_device){ d, &world.shm[i] };
		loop->shared.address[i] = (uint64_t)(0x0a000001 + i) << 16 | 20055;
	}
}

int world_run(uint64_t for_ns)
{
	int rc = loop_prepare(&world.loop);

	if (rc < 0)
		return rc;
	world.loop.own->clock = (struct loop_clock){ clock_now, clock_boot, clock_sleep_until,
						     &world };
	world.end_ns = world.now + for_ns;
	return loop_run(&world.loop);
}

void world_end(void)
{
	loop_release(&world.loop);
	world.t->ops = inner;
	transport_close(world.t);
}

const struct event *world_event(uint16_t code)
{
	static struct event e;

	while (event_pop(&world.loop.events, &e))
		if (e.code == code)
			return &e;
	return NULL;
}
