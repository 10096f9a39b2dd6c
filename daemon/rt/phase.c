/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Two loops behind one another.
 *
 * The first predicts when the commander reads. It is a phase locked loop of second
 * order on the time stamps of its reads: the expected time moves on by one period
 * and by a sixteenth of what the last read was off, the period by a smaller part.
 * A servo thread is late now and then and never early, and a rare late one must move
 * nothing; so once locked, what a read is off counts up to four times what reads
 * usually are.
 *
 * The second lays the ticks: each cycle begins the lead before an expected read. What
 * is missing to that is made up by a quarter in each cycle, and by no more than 1 %
 * of the cycle: a whole period takes 100 cycles. The thread's own period may be 1 % off
 * ours. So a cycle is at most 2 % longer or shorter than configured, also while a
 * lock is sought, which is what motion sees of all this: it computes with the times
 * of the ticks, not with their number.
 *
 * The two are apart because the lead comes from the reads as well (a read that comes
 * early needs a longer one): in a single loop a longer lead would make reads look
 * early.
 *
 * Locked means: of the last reads so many came within an eighth of a period of what
 * was expected that a count, one up for each of those and two down for another,
 * has reached its top. It is lost when that count is at its bottom: by 32 reads in a
 * row that came otherwise, or by a third of all. A thread that jumps is so found
 * anew, and one that jitters wildly is not followed.
 *
 * Where a thread's period is n cycles, every n-th cycle lies before a read, and the
 * others between; where it is the n-th part, every n-th read lies behind a cycle.
 */
#include <math.h>
#include <string.h>
#include "daemon/rt/phase.h"

#define SILENT_NS	UINT64_C(100000000)	/* longer without a read: nothing is known */
#define MARGIN_NS	UINT64_C(10000)		/* between the last publication and the read */
#define FLOOR_NS	5000.0			/* so much off is never an outlier */
#define GAIN		(1.0 / 16)
#define DRIFT_GAIN	(GAIN * GAIN / 4)
#define JITTER_GAIN	(1.0 / 64)
#define TICK_GAIN	0.25
#define MOST		0.01			/* of a period: drift, and change of phase */

enum { QUALITY_MOST = 64, RATIO_MOST = 16 };

void phase_init(struct phase *phase, uint64_t nominal_ns)
{
	memset(phase, 0, sizeof(*phase));
	phase->nominal_ns = phase->period_ns = nominal_ns;
	lead_init(&phase->lead, nominal_ns);
}

static double clamp(double value, double most)
{
	return value > most ? most : value < -most ? -most : value;
}

/* Cycles to a period of the thread's, n or 1 / n; 0 = they do not fit. */
static double ratio_of(const struct phase *phase, uint64_t thread_ns)
{
	const double nominal = (double)phase->nominal_ns, thread = (double)thread_ns;
	const double ratio = thread < nominal ? 1 / round(nominal / thread) :
						round(thread / nominal);

	if (!thread_ns || ratio > RATIO_MOST || ratio < 1.0 / RATIO_MOST ||
	    fabs(thread / ratio - nominal) > MOST * nominal)
		return 0;
	return ratio;
}

bool phase_fits(const struct phase *phase, uint64_t thread_ns)
{
	return ratio_of(phase, thread_ns) > 0;
}

static void lose(struct phase *phase)
{
	phase->losses += phase->locked;
	phase->locked = false;
	phase->quality = 0;
}

void phase_free(struct phase *phase)
{
	lose(phase);
	phase->thread_ns = 0;
	phase->error_ns = 0;
	phase->jitter_ns = 0;
}

static void begin(struct phase *phase, uint64_t read_ns, uint64_t thread_ns)
{
	lose(phase);
	phase->thread_ns = thread_ns;
	phase->drift_ns = 0;
	phase->ratio = ratio_of(phase, thread_ns);
	phase->read_ns = phase->expected_ns = read_ns;
}

static double thread_period(const struct phase *phase)
{
	return (double)phase->thread_ns + phase->drift_ns;
}

/* Ticks that lie so far apart are as good as one another. */
static double comb(const struct phase *phase)
{
	return phase->ratio > 1 ? thread_period(phase) / phase->ratio : thread_period(phase);
}

/* To the nearest of the comb's teeth. */
static double wrap(const struct phase *phase, double ns)
{
	const double period = comb(phase);

	return ns - period * round(ns / period);
}

static void judge(struct phase *phase, double off)
{
	if (fabs(off) <= comb(phase) / 8)
		phase->quality += phase->quality < QUALITY_MOST;
	else
		phase->quality = phase->quality > 2 ? phase->quality - 2 : 0;
}

/* How far the read is off, after which the next one is expected better. */
static double track(struct phase *phase, uint64_t read_ns)
{
	const double since = (double)(int64_t)(read_ns - phase->expected_ns);
	const double passed = fmax(round(since / thread_period(phase)), 0);
	const double off = since - passed * thread_period(phase);
	const double most = phase->locked ? 4 * phase->jitter_ns + FLOOR_NS : comb(phase) / 8;
	const double believed = clamp(off, most);

	phase->expected_ns += (uint64_t)llround(passed * thread_period(phase) + GAIN * believed);
	phase->drift_ns = clamp(phase->drift_ns + DRIFT_GAIN * believed,
				MOST * (double)phase->thread_ns);
	phase->jitter_ns += JITTER_GAIN * (fmin(fabs(off), 2 * most) - phase->jitter_ns);
	phase->read_ns = read_ns;
	return off;
}

void phase_read(struct phase *phase, const struct phase_stamp *stamp, uint64_t tick_ns,
		uint64_t cost_ns)
{
	double off;

	phase->write_ns = stamp->write_ns - stamp->read_ns;
	if (stamp->period_ns != phase->thread_ns || stamp->read_ns - phase->read_ns > SILENT_NS) {
		begin(phase, stamp->read_ns, stamp->period_ns);
		return;
	}
	off = track(phase, stamp->read_ns);
	judge(phase, off);
	if (!phase->quality) /* then the newest read is as good a beginning as any */
		begin(phase, stamp->read_ns, stamp->period_ns);
	phase->error_ns = (int32_t)lround(wrap(phase, (double)(int64_t)(stamp->read_ns - tick_ns) -
							      (double)phase_lead(phase)));
	if (cost_ns && phase->locked)
		lead_add(&phase->lead, (int64_t)cost_ns - llround(wrap(phase, off)));
}

uint64_t phase_lead(const struct phase *phase)
{
	return phase->lead.value_ns + MARGIN_NS;
}

/* As much of a tooth as `ns` lies behind one. */
static double behind(const struct phase *phase, double ns)
{
	return ns - comb(phase) * floor(ns / comb(phase));
}

/*
 * How much later the next tick has to be, if it is a cycle of `length` from the last
 * one. The nearest way where it is locked; before, the way on which no tick comes to
 * the other side of a write: a command that is seen twice, or not at all, would be a
 * jump in what an axis is told.
 */
static double missing(const struct phase *phase, uint64_t tick_ns, double length)
{
	const double write = (double)phase->write_ns, lead = (double)phase_lead(phase);
	const double tick = (double)(int64_t)(tick_ns - phase->expected_ns) + length;

	if (phase->locked)
		return wrap(phase, -lead - tick);
	return behind(phase, -lead - write) - behind(phase, tick - write);
}

uint64_t phase_next(struct phase *phase, uint64_t tick_ns)
{
	const double nominal = (double)phase->nominal_ns;
	double length, more;

	phase->period_ns = phase->nominal_ns;
	if (!phase->thread_ns)
		return phase->period_ns;
	length = nominal + clamp(thread_period(phase) / phase->ratio - nominal, MOST * nominal);
	more = missing(phase, tick_ns, length);
	if (phase->quality == QUALITY_MOST && fabs(more) <= comb(phase) / 16)
		phase->locked = true;
	length += clamp(TICK_GAIN * more, MOST * nominal);
	phase->period_ns = (uint64_t)llround(length);
	return phase->period_ns;
}
