/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * HAL's shared memory, used again.
 */
#ifndef HALBRIDGE_MEMORY_H
#define HALBRIDGE_MEMORY_H

#include <stddef.h>

/*
 * So many bytes of HAL's memory, zeroed, 8-byte aligned: those of an instance
 * that has ended if it had as many, else new ones. NULL if HAL has no more.
 * After hal_init(). Cold.
 */
void *memory_take(size_t size);

/* For the next one. NULL is allowed; `block` is not used any more. Cold. */
void memory_give_back(void *block);

#endif
