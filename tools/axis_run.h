/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Axes of the pulse engine in a program that is the commander of a device for a while: machine on,
 * enabled, commanded to stay where they are, off again. `axes`: one bit each. Cold, main thread.
 */
#ifndef TOOLS_AXIS_RUN_H
#define TOOLS_AXIS_RUN_H

#include <stdbool.h>
#include <stdint.h>
#include "tools/loop_run.h"

/* The machine goes on, and these axes are enabled. False after an error message. */
bool axis_run_begin(struct loop_run *run, uint8_t axes);

/* Command them where they are, and no other. Another function sends the command. */
void axis_run_keep(struct loop_run *run, uint8_t axes);

/* They are enabled. False after an error message. */
bool axis_run_check(struct loop_run *run, uint8_t axes);

/* Those that are enabled stand where they were sent. */
bool axis_run_stands(const struct loop_run *run, uint8_t axes);

/* The machine goes off, whatever has happened; that it is. False after an error message. */
void axis_run_switch_off(struct loop_run *run);
bool axis_run_finish(struct loop_run *run);

#endif
