/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's clock, shown and set.
 *
 * Day of the week and day of the year are computed: a person who sets a clock
 * knows the date, and three values that must agree would be three ways to be
 * wrong. 2000 to 2099 have a leap year every fourth year without exception,
 * and the first of January 2000 was a Saturday (Sunday is 0).
 */
#include "halbridge/clock.h"
#include <stddef.h>
#include <stdint.h>
#include "halbridge/news.h"

enum { FIRST_YEAR = 2000, LAST_YEAR = 2099, FIRST_DAY_OF_WEEK = 6 };

void clock_read(struct pokeys_rtc *shown, bool *begun, struct values *values,
		const struct pokeys_rtc *rtc)
{
	struct value_rtc *value = &values->rtc;

	if (!news(shown, rtc, sizeof(*shown), !*begun))
		return;
	*begun = true;
	value->second = rtc->second;
	value->minute = rtc->minute;
	value->hour = rtc->hour;
	value->day_of_week = rtc->day_of_week;
	value->day = rtc->day;
	value->month = rtc->month;
	value->year = rtc->year;
	value->day_of_year = rtc->day_of_year;
	values_changed(values, BLOCK_RTC);
}

static bool is_leap(uint32_t year)
{
	return year % 4 == 0;
}

/* 1..366 */
static uint32_t day_of_year(uint32_t year, uint32_t month, uint32_t day)
{
	static const uint16_t before[] = {
		0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334,
	};

	return before[month - 1] + day + (month > 2 && is_leap(year));
}

static uint32_t days_in(uint32_t year, uint32_t month)
{
	static const uint8_t days[] = { 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31 };

	return month == 2 && is_leap(year) ? 29u : days[month - 1];
}

static uint32_t day_of_week(uint32_t year, uint32_t doy)
{
	uint32_t years = year - FIRST_YEAR;

	return (FIRST_DAY_OF_WEEK + 365 * years + (years + 3) / 4 + doy - 1) % 7;
}

static bool in_range(uint32_t value, uint32_t low, uint32_t high, size_t offset,
		     struct refusals *refusals)
{
	if (value >= low && value <= high)
		return true;
	refusal_once(refusals, offset, REFUSAL_RANGE, value);
	return false;
}

#define IN_RANGE(member, low, high)	\
	in_range(value->member, low, high, offsetof(struct values, rtc.member), refusals)

bool clock_wanted(const struct value_rtc *value, struct pokeys_one_shot *shot,
		  struct refusals *refusals)
{
	uint32_t doy;

	if (!IN_RANGE(set_year, FIRST_YEAR, LAST_YEAR) || !IN_RANGE(set_month, 1, 12) ||
	    !IN_RANGE(set_day, 1, days_in(value->set_year, value->set_month)) ||
	    !IN_RANGE(set_hour, 0, 23) || !IN_RANGE(set_minute, 0, 59) ||
	    !IN_RANGE(set_second, 0, 59))
		return false;
	doy = day_of_year(value->set_year, value->set_month, value->set_day);
	*shot = (struct pokeys_one_shot){
		.operation = POKEYS_ONE_SHOT_SET_RTC,
		.value = { (int32_t)value->set_year, (int32_t)value->set_month,
			   (int32_t)value->set_day, (int32_t)value->set_hour,
			   (int32_t)value->set_minute, (int32_t)value->set_second,
			   (int32_t)day_of_week(value->set_year, doy), (int32_t)doy },
	};
	return true;
}
