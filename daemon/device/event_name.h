/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The names of numbers in an event, as its line shows them; "unknown" for a number that is
 * not in the list. Static texts; any thread.
 */
#ifndef DEVICE_EVENT_NAME_H
#define DEVICE_EVENT_NAME_H

#include <stdint.h>
#include "daemon/device/event.h"

/* a word for programs, which stays the same; at most 31 characters */
const char *event_kind_name(uint32_t code); /* enum event_code */
const char *event_link_name(int64_t link);  /* enum pokeys_link */
/* enum pokeys_fault, as the end of a line: with its colon, empty for none */
const char *event_fault_text(int64_t fault);
/* enum event_packets, for so many of them */
const char *event_packets_name(int64_t kind, int64_t count);
const char *event_one_shot_name(int64_t operation);  /* enum pokeys_one_shot_operation */
const char *event_outcome_name(int64_t outcome);     /* enum pokeys_outcome */
const char *event_refusal_name(int64_t refusal);     /* enum one_shot_refusal; # = its part */
const char *event_command_fault_name(int64_t fault); /* enum command_fault, a number follows */
const char *event_part_name(int64_t part);           /* enum command_part */
const char *event_place_loss_name(int64_t why);      /* enum place_loss */
const char *event_task_name(int64_t task);           /* enum pokeys_task */

#endif
