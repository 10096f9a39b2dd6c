/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Counts what one thread allocates and frees; see allocations.c. */
#ifndef TESTS_RT_ALLOCATIONS_H
#define TESTS_RT_ALLOCATIONS_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

/* False in a build whose allocator cannot be counted (sanitizers). */
extern const bool allocations_are_counted;

/* Whose (thread id; 0 = nobody's), and how many so far. */
extern _Atomic int32_t allocations_thread;
extern _Atomic uint64_t allocations_count;

#endif
