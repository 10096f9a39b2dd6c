/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * In place of allocations.c in a build with a sanitizer: that one puts its own
 * allocator in front of the C library's, and two of them cannot stand there.
 * Its memory is also not locked, so what concerns allocations and page faults
 * is skipped, and all else runs with the sanitizer watching.
 */
#include "tests/rt/allocations.h"

const bool allocations_are_counted = false;
_Atomic int32_t allocations_thread;
_Atomic uint64_t allocations_count;
