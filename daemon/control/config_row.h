// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * How the rows of the tables of keys (config_table.c, config_table_loop.c) are written.
 */
#ifndef CONTROL_CONFIG_ROW_H
#define CONTROL_CONFIG_ROW_H

#include <stddef.h>
#include "daemon/control/config_key.h"

#define DAEMON(field) CONFIG_DAEMON, .offset = offsetof(struct config_raw_daemon, field), \
	.size = sizeof(((struct config_raw_daemon *)0)->field)
#define DEVICE(field) CONFIG_DEVICE, .offset = offsetof(struct config_raw_device, field), \
	.size = sizeof(((struct config_raw_device *)0)->field)

#define HEATER(field) CONFIG_HEATER, .offset = offsetof(struct config_raw_heater, field), \
	.size = sizeof(((struct config_raw_heater *)0)->field)

#define SERVO(field) CONFIG_SERVO, .offset = offsetof(struct config_raw_servo, field), \
	.size = sizeof(((struct config_raw_servo *)0)->field)

#define WORDS(...) ((const struct settings_word[]){ __VA_ARGS__, { NULL, 0 } })
#define RANGE(low, high) .minimum = (low), .maximum = (high)
#define WORDS_ONLY RANGE(1, 0)

#define KEY(where, name_, type_, ...) \
	{ .section = where, .name = (name_), .type = (type_), __VA_ARGS__ }

/* Keys of [heater NAME] and [servo NAME]. */
extern const struct config_key config_loop_keys[];
extern const size_t config_loop_key_count;

#endif
