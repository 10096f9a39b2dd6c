/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Buttons, by a table: which pin, which press, which one-shot.
 *
 * All end in the same counter when they end badly; the clock alone has a pin
 * of its own for the outcome, because whoever sets a clock has nothing else to
 * see it by before the next second.
 *
 * A pin that falls while data are stale ends what it began as soon as they are fresh, or
 * a wheel that was let go just then would be followed for ever. In the second period of
 * fresh data: HAL may make the pin of some that are not true while data are stale
 * (machine-on-permitted), and raises it again in the first.
 */
#include "halbridge/buttons.h"
#include <stddef.h>
#include "halbridge/clock.h"

enum { PLAIN = 5 };

static const struct {
	size_t pin, press;
	uint8_t operation;
	bool released; /* pressed when the pin falls: it ends what the other began */
} plain[PLAIN] = {
	{ offsetof(struct values, counter.reset), offsetof(struct buttons, counters),
	  POKEYS_ONE_SHOT_RESET_COUNTERS, false },
	{ offsetof(struct values, engine.clear_fault), offsetof(struct buttons, fault),
	  POKEYS_ONE_SHOT_CLEAR_FAULT, false },
	{ offsetof(struct values, diagnostics.config_save), offsetof(struct buttons, save),
	  POKEYS_ONE_SHOT_SAVE_CONFIG, false },
	{ offsetof(struct values, engine.mpg_jog), offsetof(struct buttons, jog),
	  POKEYS_ONE_SHOT_JOG, false },
	{ offsetof(struct values, engine.mpg_jog), offsetof(struct buttons, jog_end),
	  POKEYS_ONE_SHOT_JOG_END, true },
};

static struct press *press_of(struct buttons *buttons, unsigned int i)
{
	return (struct press *)((unsigned char *)buttons + plain[i].press);
}

void buttons_read(struct buttons *buttons, struct values *values,
		  const struct one_shot_queue *queue, const struct pokeys_state *state)
{
	for (unsigned int i = 0; i < PLAIN; i++)
		values->one_shot_failed_count += press_read(press_of(buttons, i), queue, state);
	values->one_shot_failed_count += press_read(&buttons->clock, queue, state);
	if (values->rtc.set_outcome != buttons->clock.outcome)
		values_changed(values, BLOCK_RTC);
	values->rtc.set_outcome = buttons->clock.outcome;
}

static bool look_at_clock(struct buttons *buttons, struct values *values,
			  struct one_shot_queue *queue, struct pokeys_command *command, bool fresh,
			  struct refusals *refusals)
{
	const struct pokeys_one_shot *wanted = NULL;
	struct pokeys_one_shot shot;
	struct press_news news;

	if (values->rtc.set && buttons->clock.up && fresh &&
	    clock_wanted(&values->rtc, &shot, refusals))
		wanted = &shot;
	news = press_write(&buttons->clock, values->rtc.set, wanted, queue, command);
	values->one_shot_failed_count += news.failed;
	return news.full;
}

bool buttons_write(struct buttons *buttons, struct values *values, struct one_shot_queue *queue,
		   struct pokeys_command *command, bool fresh, struct refusals *refusals)
{
	bool full = look_at_clock(buttons, values, queue, command, fresh, refusals);

	for (unsigned int i = 0; i < PLAIN; i++) {
		const struct pokeys_one_shot shot = { .operation = plain[i].operation };
		bool pin = *(const bool *)((const unsigned char *)values + plain[i].pin);
		struct press_news news;

		if (plain[i].released && !pin && !(fresh && buttons->was_fresh))
			continue;
		news = press_write(press_of(buttons, i), pin != plain[i].released,
				   fresh ? &shot : NULL, queue, command);
		values->one_shot_failed_count += news.failed;
		full |= news.full;
	}
	buttons->was_fresh = fresh;
	return full;
}

void buttons_forget(struct buttons *buttons, struct values *values)
{
	for (unsigned int i = 0; i < PLAIN; i++)
		values->one_shot_failed_count += press_forget(press_of(buttons, i));
	values->one_shot_failed_count += press_forget(&buttons->clock);
}
