/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Is the position of a joint still that of before?
 */
#ifndef HALBRIDGE_POSITION_H
#define HALBRIDGE_POSITION_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "halbridge/joint.h"
#include "halbridge/values.h"

enum { POSITION_ERRORS = 3 };

/* Of one joint. */
struct position {
	bool known; /* it was shown; the two below say how */
	uint8_t epoch;
	int32_t shown; /* pulses, as the device counts */
	bool lost;
	bool homed;        /* motion-homed, at the last read */
	bool restarted;    /* the daemon was, since the joint was judged last */
	uint8_t errors;    /* its driver's, reads in a row up to POSITION_ERRORS */
	uint64_t moved_ns; /* its count has changed last; 0 = not yet */
};

struct positions {
	struct position joint[POKEYS_AXES];
	uint32_t underruns;
	uint8_t stops;      /* of the engine without a ramp, at the last read */
	uint64_t unhome_ns; /* since then joints have to be unhomed; 0 = none has to */
	uint64_t alarm_ns;  /* one was lost then */
	bool alarm;         /* ... and for a second, and until machine-is-on falls */
};

/*
 * At each read; `fresh` says whether the state is of now, `restarted` that it is of another
 * daemon than before. Joints of which the count began anew go on from where they were.
 * Returns true if one did. Realtime.
 */
bool positions_read(struct positions *positions, struct joint joint[POKEYS_AXES],
		    struct values *values, const struct pokeys_engine *engine, bool fresh,
		    bool restarted, uint64_t now_ns);

#endif
