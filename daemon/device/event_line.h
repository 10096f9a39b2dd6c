/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Texts about events, for the files that write them. */
#ifndef DEVICE_EVENT_LINE_H
#define DEVICE_EVENT_LINE_H

#include "daemon/device/event.h"
#include "settings/line.h"

/* event_text_loop.c */
void event_put_heater(struct line *line, const struct event *e);
void event_put_heater_refused(struct line *line, const struct event *e);
void event_put_heater_tuned(struct line *line, const struct event *e);
void event_put_heater_left(struct line *line, const struct event *e);
void event_put_heater_unheard(struct line *line, const struct event *e);
void event_put_servo(struct line *line, const struct event *e);
void event_put_servo_refused(struct line *line, const struct event *e);
void event_put_servo_left(struct line *line, const struct event *e);
void event_put_servo_unheard(struct line *line, const struct event *e);
void event_put_heater_gain(struct line *line, const struct event *e);
void event_put_servo_gain(struct line *line, const struct event *e);
void event_put_servo_home(struct line *line, const struct event *e);
void event_put_moves(struct line *line, const struct event *e);
void event_put_servo_tuned(struct line *line, const struct event *e);

#endif
