/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * malloc and its relatives, in front of the C library's own: they count the
 * calls of one watched thread and do the work. Being in the program itself,
 * they are found before the library's by everybody, also by the Rust code.
 */
#include <malloc.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "tests/rt/allocations.h"

const bool allocations_are_counted = true;
_Atomic int32_t allocations_thread;
_Atomic uint64_t allocations_count;

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);
extern void __libc_free(void *memory);

static _Thread_local int32_t self;

static void note(void)
{
	int32_t watched = atomic_load_explicit(&allocations_thread, memory_order_relaxed);

	if (!watched)
		return;
	if (!self)
		self = (int32_t)syscall(SYS_gettid);
	if (self == watched)
		atomic_fetch_add(&allocations_count, 1);
}

void *malloc(size_t size)
{
	note();
	return __libc_malloc(size);
}

void *calloc(size_t n, size_t size)
{
	note();
	return __libc_calloc(n, size);
}

void *realloc(void *old, size_t size)
{
	note();
	return __libc_realloc(old, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
	note();
	return __libc_memalign(alignment, size);
}

int posix_memalign(void **out, size_t alignment, size_t size)
{
	note();
	*out = __libc_memalign(alignment, size);
	return *out ? 0 : 12;
}

void free(void *memory)
{
	note();
	__libc_free(memory);
}
