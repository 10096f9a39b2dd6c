/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Reads the settings of a device that another program may be driving. It writes nothing, stops
 * nothing, and does not disturb that program.
 *
 * Pure: no clock, no socket, no allocation. One thread.
 */
#ifndef DEVICE_SURVEY_H
#define DEVICE_SURVEY_H

#include <stddef.h>
#include <stdint.h>
#include <pokeys/async.h>
#include <pokeys/settings.h>
#include <pokeys/state.h>

enum survey_state {
	SURVEY_READING,
	SURVEY_DONE,        /* what the device did not answer is not set in the settings */
	SURVEY_SILENT,      /* the device does not answer, or has stopped answering */
	SURVEY_OTHER,       /* a device with another serial number answers */
	SURVEY_UNSUPPORTED, /* the daemon does not drive this type */
	SURVEY_LOCKED,      /* behind a password: only the identity is known */
};

struct survey;

/* Bytes that a survey needs, 64-byte aligned. */
size_t survey_size(void);

/*
 * Begin; `memory` has survey_size() bytes. Only answers from this address (host byte order)
 * count, and only from the device with this serial number (0 = any device). io->receive may
 * be NULL.
 */
void survey_begin(struct survey *memory, const struct pokeys_io *io, uint32_t address,
		  uint32_t serial, uint64_t now_ns);

/* Send what is next. To be called every few ms while it returns SURVEY_READING. */
enum survey_state survey_turn(struct survey *survey, uint64_t now_ns);

/* A datagram came. */
void survey_deliver(struct survey *survey, const uint8_t *data, size_t length,
		    const struct pokeys_rx *rx, uint64_t now_ns);

/* Valid when the survey has ended, unless it ended with SURVEY_SILENT. */
const struct pokeys_identity *survey_identity(const struct survey *survey);
const struct pokeys_capability *survey_capability(const struct survey *survey);

/* Number of requests that were not answered. */
unsigned int survey_unanswered(const struct survey *survey);

/* What was read; what is not in its `set` words and masks is not known. */
const struct pokeys_settings *survey_settings(const struct survey *survey);

#endif
