// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * HAL pins that have no row in the model, and the name of the device's own value, if there is
 * one. An error message names it to a user who asks for the pin. A test fails if a new pin of
 * HAL is neither in the model nor here.
 */
#include <string.h>
#include "model/model.h"

#define COUNT(array)	(sizeof(array) / sizeof((array)[0]))

static const struct model_alone alone[] = {
	{ "pin.%02u.in-not", "pin.NN.in" },
	{ "PoExtBus.%02u.in-not", "PoExtBus.NN.in" },
	{ "engine.misc.%02u.in-not", "engine.misc.NN.in" },
	{ "emergency-not", "emergency" },
	/* depend on a scale, an offset or a reset that only LinuxCNC knows */
	{ "adc.%02u.value", "adc.NN.volts" },
	{ "encoder.%02u.count", "encoder.NN.rawcounts" },
	{ "encoder.%02u.position", "encoder.NN.rawcounts" },
	{ "encoder.%02u.velocity", "encoder.NN.rawcounts" },
	{ "encoder.%02u.count-lost", "encoder-epoch" },
	{ "encoder-count-lost", "encoder-epoch" },
	{ "joint.%02u.pos-fb", "joint.NN.counts" },
	{ "joint.%02u.following-error", "joint.NN.counts-error" },
	{ "joint.%02u.probe-pos", "joint.NN.counts-probed" },
	{ "joint.%02u.in-position", "joint.NN.at-counts-cmd" },
	{ "joint.%02u.position-lost", "joint.NN.position-epoch" },
	{ "position-lost", "joint.NN.position-epoch" },
	{ "unhome", "joint.NN.position-epoch" },
	/* computed from other values */
	{ "encoder-resyncs", "encoder.NN.resyncs" },
	{ "joint.%02u.postep.hardware", "joint.NN.postep.hardware-major" },
	{ "joint.%02u.postep.firmware", "joint.NN.postep.firmware-major" },
	{ "PoNET.%02u.present", "PoNET.NN.type" },
	{ "kbd48CNC.present", "kbd48CNC.module" },
	{ "kbd48CNC.light", "PoNET.NN.light" },
	{ "info.PulseEngine", "info.pulse-engine-version" },
	{ "info.PulseEnginev2", "info.pulse-engine-version" },
	{ "joint.%02u.homing", "task.kind" },
	{ "homing.active", "task.kind" },
	{ "homing.phase", "task.phase" },
	{ "homing.error", "task.result" },
	{ "probe.active", "task.kind" },
	{ "probe.done", "task.result" },
	{ "probe.error", "task.result" },
	{ "threading.refused", "threading.refusal" },
	{ "threading.reason", "threading.refusal" },
	{ "threading.error", "task.result" },
	{ "phase-locked", "phase.state" },
	{ "packet-error", "packets.missed" },
	{ "packet-error-level", "packets.error-level" },
	{ "packet-error-total", "packets.missed" },
	{ "packet-error-exceeded", "packets.error-level" },
	{ "commander", "commander-alive" },
	{ "servo.%02u.enabled", "servo.NN.state" },
	{ "servo.%02u.fault", "servo.NN.fault-code" },
	{ "servo.%02u.homing", "servo.NN.home-state" },
	/* state of the HAL component itself: its functions, commands and requests */
	{ "probe.contact", NULL },
	{ "joint.%02u.refused", NULL },
	{ "kbd48CNC.brightness-sent", NULL },
	{ "attach-state", NULL },
	{ "error-active", NULL },
	{ "error-code", NULL },
	{ "error-count", NULL },
	{ "time-exceeded-count", NULL },
	{ "read-missing", NULL },
	{ "input-refused", NULL },
	{ "input-refused-count", NULL },
	{ "one-shot-full", NULL },
	{ "one-shot-failed-count", NULL },
	{ "rtc.set-outcome", NULL },
	{ "config.refused", NULL },
	{ "config.refused-index", NULL },
	{ "config.generation", NULL },
	{ "config.input-refused", NULL },
};

const struct model_alone *model_alone(size_t number)
{
	return number < COUNT(alone) ? &alone[number] : NULL;
}
