// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The device's calendar clock and its log (protocol section 3.22).
 *
 * Calendar arithmetic is done here and not by libc, whose functions read the
 * time zone from files; the clock must run the same everywhere, in virtual
 * time too. Daylight saving rules are kept but not applied.
 */
#include "sim/clock.h"

#include "sim/request.h"

#define DAY 86400

/* Days since 1970-01-01 of a date in the Gregorian calendar (H. Hinnant's algorithm). */
static int64_t days_from_date(int64_t year, unsigned int month, unsigned int day)
{
	int64_t era;
	unsigned int of_era, of_year;

	year -= month <= 2;
	era = year / 400;
	of_era = (unsigned int)(year - era * 400);
	of_year = (153 * (month > 2 ? month - 3 : month + 9) + 2) / 5 + day - 1;
	return era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719468;
}

static unsigned int year_of(int64_t days)
{
	unsigned int year = (unsigned int)(1970 + days / 366);

	while (days >= days_from_date(year + 1, 1, 1))
		year++;
	return year;
}

static unsigned int month_of(int64_t days, unsigned int year)
{
	unsigned int month = 1;

	while (month < 12 && days >= days_from_date(year, month + 1, 1))
		month++;
	return month;
}

int64_t sim_clock_seconds(const struct sim_device *dev)
{
	return dev->run.clock_s + (int64_t)((dev->now_ns - dev->run.clock_ns) / 1000000000u);
}

static void put(const struct sim_device *dev, uint8_t *rp)
{
	int64_t now = sim_clock_seconds(dev);
	int64_t days = now / DAY;
	unsigned int second = (unsigned int)(now % DAY);
	unsigned int year = year_of(days);
	unsigned int month = month_of(days, year);

	rp[8] = (uint8_t)(second % 60);
	rp[9] = (uint8_t)(second / 60 % 60);
	rp[10] = (uint8_t)(second / 3600);
	rp[11] = (uint8_t)((days + 4) % 7);
	rp[12] = (uint8_t)(days - days_from_date(year, month, 1) + 1);
	rp[13] = (uint8_t)month;
	wire_put_u16(rp + 14, (uint16_t)(days - days_from_date(year, 1, 1) + 1));
	wire_put_u16(rp + 16, (uint16_t)year);
	rp[18] = dev->config.clock.rule;
	rp[19] = (uint8_t)dev->config.clock.offset;
}

static bool is_time(const uint8_t *rq)
{
	unsigned int year = wire_get_u16(rq + 16);

	return rq[8] < 60 && rq[9] < 60 && rq[10] < 24 && rq[12] >= 1 && rq[12] <= 31 &&
	       rq[13] >= 1 && rq[13] <= 12 && year >= 1970 && year < 3000;
}

/* A time which is none is not taken; the reply then shows the clock as it was. */
SIM_HANDLER(sim_do_clock)
{
	if ((rq[P1] == 0x10 || rq[P1] == 0x11) && is_time(rq)) {
		int64_t days = days_from_date(wire_get_u16(rq + 16), rq[13], rq[12]);

		dev->run.clock_s = days * DAY + rq[10] * 3600 + rq[9] * 60 + rq[8];
		dev->run.clock_ns = dev->now_ns;
	}
	if (rq[P1] == 0x11) {
		dev->config.clock.rule = rq[18];
		dev->config.clock.offset = (int8_t)rq[19];
	}
	rp[P1] = rq[P1];
	put(dev, rp);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_log)
{
	struct sim_runtime *run = &dev->run;

	if (rq[P1] == 0x10) {
		run->log_count = 0;
		memset(run->log, 0, sizeof(run->log));
	}
	rp[P1] = run->log_count;
	for (unsigned int i = 0; i < run->log_count; i++)
		wire_put_u16(rp + 8 + 2 * i, run->log[i]);
	return SIM_ANSWER;
}
