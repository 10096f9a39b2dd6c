/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * hal_malloc() has no counterpart, and HAL's memory lasts until the last
 * component is gone: a component that is loaded and unloaded all day takes its
 * pins' memory from HAL's own free lists, but would lose what it has allocated
 * itself each time, until HAL has no more.
 *
 * Nothing of ours survives an unload to remember the place. So each block
 * begins with a mark that nothing else in there has, and is looked for by it:
 * through at most a few MiB, once per load. Where HAL's memory ends the kernel
 * knows.
 */
#include "halbridge/memory.h"
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <hal.h>

extern char *hal_shmem_base; /* hal_priv.h, which is not installed */

#define MARK_FIRST	UINT64_C(0x706f6b6579732d68)	/* "pokeys-h" */
#define MARK_SECOND	UINT64_C(0xa1c6b3e95d024f77)

struct block {
	uint64_t first, second; /* the marks */
	uint64_t size;          /* of what follows */
	uint64_t taken;
};

/* How many bytes of HAL's memory are mapped. */
static size_t mapped(void)
{
	unsigned long begin, end, base = (unsigned long)hal_shmem_base;
	FILE *maps = fopen("/proc/self/maps", "re");
	size_t size = 0;
	char line[512];

	while (maps && !size && fgets(line, sizeof(line), maps)) {
		if (sscanf(line, "%lx-%lx", &begin, &end) == 2 && base >= begin && base < end)
			size = end - base;
	}
	if (maps)
		fclose(maps);
	return size;
}

static bool is_block(const char *at)
{
	const struct block *block = (const void *)at;

	return block->first == MARK_FIRST && block->second == MARK_SECOND;
}

/* Two components may be loading at this moment: one of them gets it. */
static bool claim(struct block *block)
{
	uint64_t nobody = 0;

	return __atomic_compare_exchange_n(&block->taken, &nobody, 1, false, __ATOMIC_ACQUIRE,
					   __ATOMIC_RELAXED);
}

/* The smallest that has been given back and is large enough: names= may differ this time. */
static struct block *look(size_t size, size_t room)
{
	struct block *best = NULL;

	for (size_t at = 0; at + sizeof(struct block) + size <= room; at += sizeof(uint64_t)) {
		struct block *block = (void *)(hal_shmem_base + at);

		if (is_block(hal_shmem_base + at) && block->size >= size &&
		    !__atomic_load_n(&block->taken, __ATOMIC_RELAXED) &&
		    (!best || block->size < best->size))
			best = block;
	}
	return best;
}

/* Ours from now on. */
static struct block *find(size_t size)
{
	const size_t room = mapped();
	struct block *block;

	do
		block = look(size, room);
	while (block && !claim(block));
	return block;
}

/* The marks last: whoever finds them finds it taken. */
static struct block *make(size_t size)
{
	struct block *block = hal_malloc((long)(sizeof(*block) + size));

	if (!block)
		return NULL;
	block->size = size;
	block->taken = 1;
	block->second = MARK_SECOND;
	__atomic_store_n(&block->first, MARK_FIRST, __ATOMIC_RELEASE);
	return block;
}

void *memory_take(size_t size)
{
	struct block *block;

	size = (size + sizeof(uint64_t) - 1) & ~(sizeof(uint64_t) - 1);
	block = find(size);
	if (!block)
		block = make(size);
	return block ? memset(block + 1, 0, size) : NULL;
}

void memory_give_back(void *block)
{
	if (block)
		__atomic_store_n(&((struct block *)block - 1)->taken, 0, __ATOMIC_RELEASE);
}
