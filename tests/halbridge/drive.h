/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pins, binding and exchange together, by name: as HAL and a daemon see them.
 */
#ifndef TESTS_HALBRIDGE_DRIVE_H
#define TESTS_HALBRIDGE_DRIVE_H

#include "tests/halbridge/rig.h"
#include "halbridge/binding.h"

struct drive {
	struct rig rig;
	struct binding binding;
	uint64_t storage[BINDING_PINS];
	void *pointers[BINDING_PINS];
};

static inline void drive_init(struct drive *drive, unsigned int schemes)
{
	rig_init(&drive->rig);
	memset(drive->storage, 0, sizeof(drive->storage));
	for (size_t i = 0; i < BINDING_PINS; i++)
		drive->pointers[i] = &drive->storage[i];
	assert_int_equal(binding_init(&drive->binding, &drive->rig.values,
				      (void *volatile *)drive->pointers, schemes),
			 0);
}

/* A servo period as the component runs it; no pin is written merely in turn. */
static inline void drive_period(struct drive *drive)
{
	struct rig *rig = &drive->rig;

	rig->now_ns += RIG_MS;
	rig_daemon(rig);
	drive->binding.out_slice = 0;
	if (!rig->unread) {
		binding_gather(&drive->binding, TABLE_AT_READ);
		rig_read(rig);
		binding_scatter(&drive->binding, TABLE_AT_READ);
	}
	binding_gather(&drive->binding, TABLE_AT_WRITE);
	rig_write(rig);
	binding_scatter(&drive->binding, TABLE_AT_WRITE);
	if (rig->values.read_missing)
		binding_scatter(&drive->binding, TABLE_AT_READ);
}

static inline void drive_periods(struct drive *drive, unsigned int count)
{
	while (count--)
		drive_period(drive);
}

static inline double drive_get(const struct drive *drive, const struct table_row *row, size_t pin)
{
	return table_get(row, &drive->storage[pin]);
}

static inline void drive_set(struct drive *drive, const struct table_row *row, size_t pin,
			     double value)
{
	table_put(row, &drive->storage[pin], value);
}

/* Bytes of an image, little-endian; `size` 0: one bit, `index` bits behind `at`. */
static inline uint64_t drive_load(const void *at, size_t size, size_t index)
{
	const uint8_t *bytes = at;
	uint64_t value = 0;

	if (!size)
		return bytes[index / 8] >> index % 8 & 1;
	memcpy(&value, bytes, size);
	return value;
}

static inline void drive_store(void *at, size_t size, size_t index, uint64_t value)
{
	uint8_t *bytes = at;

	if (size)
		memcpy(bytes, &value, size);
	else
		bytes[index / 8] = (uint8_t)((bytes[index / 8] & ~(1u << index % 8)) |
					     (uint8_t)((value & 1) << index % 8));
}

#endif
