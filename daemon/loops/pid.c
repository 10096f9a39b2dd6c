/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The output is P + I + D, limited. What a limit cuts off must not fill the integral, or a heater
 * that was too cold for a minute would be too hot for the next one; but an error of the other
 * sign must be able to take it back, or it would never leave the limit.
 */

#include "daemon/loops/pid.h"

#define BRIDGE_S 10.0	/* time constant */

static double limited(double value, double least, double most)
{
	return value < least ? least : value > most ? most : value;
}

void pid_reset(struct pid *pid)
{
	*pid = (struct pid){ .primed = false };
}

double pid_step(struct pid *pid, const struct pid_gains *gains, double target, double measured,
		double seconds, double least, double most)
{
	const double error = target - measured;
	const double before = pid->integral;
	double output, rest, more;

	if (pid->primed && seconds > 0)
		pid->rate += ((measured - pid->last) / seconds - pid->rate) * seconds /
			     (gains->smooth + seconds);
	pid->last = measured;
	pid->primed = true;
	pid->bridge -= pid->bridge * seconds / (BRIDGE_S + seconds);

	more = gains->i * error * seconds;
	rest = gains->p * error + pid->bridge - gains->d * pid->rate;
	output = rest + pid->integral + more;
	if (!(output > most && more > 0) && !(output < least && more < 0))
		pid->integral = limited(pid->integral + more, least, most);
	pid->added = pid->integral - before;
	return limited(rest + pid->integral, least, most);
}

void pid_cut(struct pid *pid)
{
	if (pid->added > 0)
		pid->integral -= pid->added;
	pid->added = 0;
}

void pid_regain(struct pid *pid, const struct pid_gains *from, const struct pid_gains *to,
		double target, double least, double most)
{
	const double error = target - pid->last;
	const double before = from->p * error + pid->integral + pid->bridge - from->d * pid->rate;
	const double rest = before - to->p * error + to->d * pid->rate;

	/* At a limit nothing goes on, and the integral would be filled with what was cut off. */
	if (!pid->primed || before <= least || before >= most) {
		if (to->i == 0)
			pid->integral = 0;
		return;
	}
	pid->integral = to->i == 0 ? 0 : limited(rest, least, most);
	pid->bridge = to->i == 0 ? rest : 0;
}
