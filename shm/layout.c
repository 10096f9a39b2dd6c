/* SPDX-License-Identifier: MIT */
/*
 * The layouts as the C compiler sees them, held against the numbers that the
 * headers publish: a compiler or an option that lays them out differently
 * does not get to build a library. The full comparison, member by member and
 * with Rust and Python, is the test `shm: layout`.
 */
#include <stddef.h>
#include <pokeys/shm.h>

#define SAME(type, member, offset) \
	_Static_assert(offsetof(struct type, member) == (offset), #type "." #member " has moved")
#define WHOLE(type, bytes) \
	_Static_assert(sizeof(struct type) == (bytes) && _Alignof(struct type) == 8, \
		       #type " has another size or alignment")

WHOLE(pokeys_state, 4736);
SAME(pokeys_state, identity, 136);
SAME(pokeys_state, capability, 216);
SAME(pokeys_state, digital_in, 304);
SAME(pokeys_state, engine, 1080);
SAME(pokeys_state, one_shot, 2360);
SAME(pokeys_state, phase, 2520);
SAME(pokeys_state, postep, 2592);
SAME(pokeys_state, statistics, 2848);
SAME(pokeys_state, heater, 3024);
SAME(pokeys_state, servo, 3752);
SAME(pokeys_state, moves, 4712);

WHOLE(pokeys_diag, 9664);
SAME(pokeys_diag, wakeup, 160);
SAME(pokeys_diag, cycle_work, 7936);
SAME(pokeys_diag, age_at_read, 8800);

WHOLE(pokeys_command, 4856);
SAME(pokeys_command, digital_out, 120);
SAME(pokeys_command, axis, 496);
SAME(pokeys_command, heater_target, 624);
SAME(pokeys_command, servo, 656);
SAME(pokeys_command, one_shot, 760);

WHOLE(pokeys_wish, 944);
SAME(pokeys_wish, settings, 24);
SAME(pokeys_settings, failsafe_timeout, 288);
SAME(pokeys_settings, axis, 408);

WHOLE(pokeys_report, 1888);
SAME(pokeys_report, device, 48);
SAME(pokeys_report, wanted, 968);

uint64_t pokeys_shm_layout(unsigned int image)
{
	static const uint64_t hashes[] = {
		[POKEYS_SHM_STATE] = POKEYS_STATE_HASH,
		[POKEYS_SHM_DIAG] = POKEYS_DIAG_HASH,
		[POKEYS_SHM_COMMAND] = POKEYS_COMMAND_HASH,
		[POKEYS_SHM_REPORT] = POKEYS_REPORT_HASH,
		[POKEYS_SHM_WISH] = POKEYS_WISH_HASH,
	};

	return image < sizeof(hashes) / sizeof(hashes[0]) ? hashes[image] : 0;
}
