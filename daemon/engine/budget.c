/* SPDX-License-Identifier: MIT */
/*
 * Two token buckets: one for every transmission, one more for repetitions.
 *
 * They bound what this client can do to a device and a network that are in
 * trouble already (invariant I5), also after the caller was stalled for
 * seconds: tokens do not pile up beyond a twentieth of a second's worth. Size
 * and rate of a bucket are chosen so that size + rate - 1 is the budget: then
 * no second, wherever it begins, sees more than the budget.
 *
 * A token is a billion units, so that rate x nanoseconds needs no division.
 */

#include "daemon/engine/mailbox.h"

#define TOKEN 1000000000u
#define SECOND_NS 1000000000u

static uint64_t bucket_size(uint32_t budget)
{
	return budget < 20 ? 1 : budget / 20;
}

static uint64_t filled(uint64_t tokens, uint32_t budget, uint64_t elapsed_ns)
{
	const uint64_t size = bucket_size(budget);
	const uint64_t rate = budget - size + 1;

	tokens += elapsed_ns * rate;
	return tokens < size * TOKEN ? tokens : size * TOKEN;
}

void mailbox_budget_init(pokeys_device_t *dev)
{
	dev->send_tokens = bucket_size(dev->options.send_budget) * TOKEN;
	dev->retry_tokens = bucket_size(dev->options.retry_budget) * TOKEN;
}

void mailbox_budget_fill(pokeys_device_t *dev, uint64_t now_ns)
{
	uint64_t elapsed_ns = now_ns - dev->tokens_time;

	if (elapsed_ns > SECOND_NS)
		elapsed_ns = SECOND_NS;
	dev->tokens_time = now_ns;
	dev->send_tokens = filled(dev->send_tokens, dev->options.send_budget, elapsed_ns);
	dev->retry_tokens = filled(dev->retry_tokens, dev->options.retry_budget, elapsed_ns);
}

bool mailbox_budget_send(pokeys_device_t *dev)
{
	if (dev->send_tokens < TOKEN)
		return false;
	dev->send_tokens -= TOKEN;
	return true;
}

/* The second half of the bucket is for what has to arrive. */
bool mailbox_budget_spares_resend(const pokeys_device_t *dev)
{
	return dev->retry_tokens >= bucket_size(dev->options.retry_budget) * TOKEN / 2;
}

bool mailbox_budget_resend(pokeys_device_t *dev)
{
	if (dev->retry_tokens < TOKEN || !mailbox_budget_send(dev))
		return false;
	dev->retry_tokens -= TOKEN;
	return true;
}
