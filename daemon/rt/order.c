/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Orders from the control thread: what a person at a terminal wants of a
 * device, rarely.
 *
 * A ring with one writer (the control thread) and one that executes (the
 * loop). A slot carries its order there and the result back, and is used again
 * only when the writer has taken the result; so the loop never waits for
 * anybody, and a full ring is an error of the writer, who may try again. One
 * order a cycle: an order copies a kilobyte, and nobody at a terminal gives a
 * thousand in a second.
 */
#include <errno.h>
#include "daemon/rt/internal.h"

int loop_order_give(struct loop *loop, const struct loop_order *order)
{
	struct loop_orders *orders = &loop->orders;
	uint32_t given = atomic_load_explicit(&orders->given, memory_order_relaxed);

	if (order->device >= loop->count)
		return -ENODEV;
	if (given - orders->taken == LOOP_ORDERS)
		return -EAGAIN;
	orders->slot[given % LOOP_ORDERS] = *order;
	atomic_store_explicit(&orders->given, given + 1, memory_order_release);
	return 0;
}

bool loop_order_result(struct loop *loop, struct loop_order *out)
{
	struct loop_orders *orders = &loop->orders;

	if (orders->taken == atomic_load_explicit(&orders->done, memory_order_acquire))
		return false;
	*out = orders->slot[orders->taken++ % LOOP_ORDERS];
	return true;
}

void orders_run(struct loop *loop)
{
	struct loop_orders *orders = &loop->orders;
	uint32_t done = atomic_load_explicit(&orders->done, memory_order_relaxed);
	struct loop_order *order = &orders->slot[done % LOOP_ORDERS];
	struct device *device;

	if (done == atomic_load_explicit(&orders->given, memory_order_acquire))
		return;
	device = loop->devices[order->device].device;
	if (order->replace)
		device_wanted(device, &order->settings);
	order->result = device_order(device, (enum device_order)order->what);
	atomic_store_explicit(&orders->done, done + 1, memory_order_release);
}
