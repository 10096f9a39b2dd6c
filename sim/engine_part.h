/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_ENGINE_PART_H
#define SIM_ENGINE_PART_H

/* What the files of the pulse engine share among themselves. */

#include "sim/request.h"

#define SIM_GENERATOR_TYPE 0x0F
#define SIM_GENERATOR_INTERNAL 1
#define SIM_GENERATOR_IO 0x80
#define SIM_HOMING_DEFAULT 0x83
#define SIM_STATUS_CHECK 0x5A	/* @63 of a status is this plus the check byte */

/* engine_start.c: no motion wanted any more. */
void sim_axis_rest(struct sim_axis *axis);

/* engine_switch.c */
bool sim_engine_limit(const struct sim_device *dev);
bool sim_engine_probe_active(const struct sim_device *dev);

/* engine_state.c: hard stop of everything; state is 100 or 101. */
void sim_engine_trip(struct sim_device *dev, uint8_t state);
void sim_engine_set_state(struct sim_device *dev, uint8_t state);
bool sim_engine_may_start(struct sim_device *dev);

/* engine_motion.c: one slot of one axis; both make the pulses. */
void sim_axis_run(struct sim_device *dev, unsigned int axis, double speed);
void sim_axis_go(struct sim_device *dev, unsigned int axis, double target, double ratio);
void sim_axis_jump(struct sim_device *dev, unsigned int axis, int32_t pulses);
void sim_axis_halt(struct sim_axis *axis);

/* Counter := position without any pulse: 0x03, homing. */
void sim_axis_set_position(struct sim_axis *axis, int32_t position);

/* engine_buffer.c */
void sim_ring_clear(struct sim_ring *ring);
void sim_ring_slot(struct sim_device *dev);
/* The next slot out of the ring, with all that hangs on it but motion; NULL: there is none. */
const struct sim_ring_slot *sim_ring_take(struct sim_device *dev);
unsigned int sim_ring_fill(struct sim_device *dev, const uint8_t *data, size_t bytes,
			   unsigned int slots, unsigned int axes, bool wide);

/* engine_homing.c, engine_probing.c: one slot of every axis concerned. */
void sim_homing_slot(struct sim_device *dev);
void sim_probing_slot(struct sim_device *dev);
void sim_hybrid_slot(struct sim_device *dev);

/* engine_status.c: the status block @2..@62, without the check byte. */
void sim_engine_status(struct sim_device *dev, uint8_t *rp);

/* engine_thread.c: one slot of 1 ms; one index pulse of the spindle. */
void sim_thread_slot(struct sim_device *dev);
void sim_thread_index(struct sim_device *dev);
/* The ring is not taken by the millisecond now. */
bool sim_thread_holds(const struct sim_device *dev);

/* Handlers of the sub-commands of 0x85. */
SIM_HANDLER(sim_pe_status);
SIM_HANDLER(sim_pe_setup);
SIM_HANDLER(sim_pe_state);
SIM_HANDLER(sim_pe_positions);
SIM_HANDLER(sim_pe_outputs);
SIM_HANDLER(sim_pe_reboot);
SIM_HANDLER(sim_pe_emergency_pin);
SIM_HANDLER(sim_pe_status2);
SIM_HANDLER(sim_pe_synced_pwm);
SIM_HANDLER(sim_pe_synced_outputs);
SIM_HANDLER(sim_pe_axis_get);
SIM_HANDLER(sim_pe_axis_set);
SIM_HANDLER(sim_pe_drivers);
SIM_HANDLER(sim_pe_move);
SIM_HANDLER(sim_pe_move_pv);
SIM_HANDLER(sim_pe_home_start);
SIM_HANDLER(sim_pe_home_finish);
SIM_HANDLER(sim_pe_probe_start);
SIM_HANDLER(sim_pe_probe_finish);
SIM_HANDLER(sim_pe_thread);
SIM_HANDLER(sim_pe_thread_status);
SIM_HANDLER(sim_pe_encoder_test);
SIM_HANDLER(sim_pe_backlash);
SIM_HANDLER(sim_pe_postep_comm);
SIM_HANDLER(sim_pe_postep_status);
SIM_HANDLER(sim_pe_postep_table);
SIM_HANDLER(sim_pe_postep_versions);
SIM_HANDLER(sim_pe_smart_config);
SIM_HANDLER(sim_pe_smart_reset);
SIM_HANDLER(sim_pe_smart_status);
SIM_HANDLER(sim_pe_smart_encoders);
SIM_HANDLER(sim_pe_clear);
SIM_HANDLER(sim_pe_fill);

#endif
