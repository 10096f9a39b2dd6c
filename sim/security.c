// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Password (protocol section 1.11): the host proves that it knows it by the
 * SHA-1 of password XOR seed. Short passwords are padded with zeros, which
 * the sources do not say. Whether a locked device refuses commands is one of
 * the simulator's choices; by default it only reports its level.
 */
#include "sim/request.h"
#include "wire/sha1.h"

SIM_HANDLER(sim_do_security_status)
{
	(void)rq;
	rp[8] = dev->run.security_level;
	memcpy(rp + 9, dev->run.seed, sizeof(dev->run.seed));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_authorise)
{
	uint8_t digest[WIRE_SHA1_DIGEST];

	wire_password_hash((const char *)dev->config.security.password, dev->run.seed, digest);
	if (memcmp(digest, rq + 8, sizeof(digest)) != 0) {
		rp[8] = 0;
		return SIM_ANSWER;
	}
	dev->run.security_level = rq[P1];
	rp[8] = 0xAA;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_password)
{
	(void)rp;
	if (sim_locked(dev))
		return SIM_ANSWER;
	dev->config.security.level = rq[P1];
	memcpy(dev->config.security.password, rq + 8, sizeof(dev->config.security.password));
	return SIM_ANSWER;
}
