/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What pokeysctl servo and pokeysctl moves have in common. Cold, main thread. */
#ifndef TOOLS_SERVO_RUN_H
#define TOOLS_SERVO_RUN_H

#include <stdbool.h>
#include "tools/loop_run.h"

extern const struct loop_kind servo_run_kind;

/* All of them are about the motor run->index. */
const struct pokeys_servo *servo_run_of(const struct loop_run *run);
bool servo_run_is_enabled(const struct loop_run *run);

/* Command it, at a position (units) with a velocity (units/s). */
void servo_run_want(struct loop_run *run, bool enable, double position, double velocity);

/* Enable it where it is; off first, as the daemon asks for. False after an error message. */
bool servo_run_begin(struct loop_run *run);

/* Off, and the daemon has confirmed that. False after an error message. */
bool servo_run_finish(struct loop_run *run);

#endif
