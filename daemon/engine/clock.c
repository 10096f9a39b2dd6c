/* SPDX-License-Identifier: MIT */
/*
 * The mailbox for a program that wants no clock of its own: the same functions,
 * with the time of now taken from CLOCK_MONOTONIC.
 *
 * Nothing else of the mailbox reads a clock, and nothing is decided here. The
 * daemon does not link this file: its cycle has one time, and its tests have
 * another.
 */

#include <pokeys/async.h>
#include <time.h>

#define NS_PER_US 1000u
#define NS_PER_S 1000000000ull

static uint64_t now_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return (uint64_t)now.tv_sec * NS_PER_S + (uint64_t)now.tv_nsec;
}

int SendRequestAsync(pokeys_device_t *dev, uint8_t request_id)
{
	return pokeys_request_send(dev, request_id, now_ns());
}

int PK_ReceiveAndDispatch(pokeys_device_t *dev)
{
	return pokeys_device_receive(dev, now_ns());
}

void PK_TimeoutAndRetryCheck(pokeys_device_t *dev, uint64_t timeout_us)
{
	const bool endless = timeout_us > UINT64_MAX / NS_PER_US;

	pokeys_device_set_timeout(dev, endless ? UINT64_MAX : timeout_us * NS_PER_US);
	pokeys_device_check(dev, now_ns());
}
