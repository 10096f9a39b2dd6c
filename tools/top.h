/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef TOOLS_TOP_H
#define TOOLS_TOP_H

#include "tools/screen.h"
#include "tools/view.h"

/* The pulse engine, its PoStep drivers and threading; nothing without axes. */
void top_engine(struct screen *screen, const struct view_device *device);

#endif
