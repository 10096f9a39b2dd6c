/* SPDX-License-Identifier: MIT */
/*
 * Copies that another thread may disturb, between private memory and a cell of the mirror: the
 * counter says afterwards whether one was. Plain copies are faster; the thread sanitizer is
 * shown one in words that cannot be torn. Sizes are multiples of 8.
 */
#ifndef SHM_MIRROR_COPY_H
#define SHM_MIRROR_COPY_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __SANITIZE_THREAD__
static inline void mirror_copy_in(void *cell, const void *from, size_t size)
{
	for (size_t i = 0; i < size / 8; i++)
		__atomic_store_n((uint64_t *)cell + i, ((const uint64_t *)from)[i],
				 __ATOMIC_RELAXED);
}

static inline void mirror_copy_out(void *to, const void *cell, size_t size)
{
	for (size_t i = 0; i < size / 8; i++)
		((uint64_t *)to)[i] = __atomic_load_n((const uint64_t *)cell + i, __ATOMIC_RELAXED);
}
#else
static inline void mirror_copy_in(void *cell, const void *from, size_t size)
{
	memcpy(cell, from, size);
}

static inline void mirror_copy_out(void *to, const void *cell, size_t size)
{
	memcpy(to, cell, size);
}
#endif

#endif
