/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The keys of [POKEYS] and [JOINT_n], as the older userspace component and its
 * HAL files have them, and which parameter each one sets.
 *
 * Where several keys set one parameter the last in this list wins, as it did.
 * Keys that the old component mixed up set what they say: AdcOut_N_offset the
 * output's offset, PEv2_AxisSoftLimitEnabled_N the soft limits. Of keys that
 * only HAL files used (setp … [POKEYS]KEY) both spellings are taken.
 */
#include "halbridge/ini_apply.h"

#define FLAG(key, name)		{ key, name, 0, 1, INI_WORD }
#define WHOLE(key, name, high)	{ key, name, 0, high, INI_WHOLE }
#define REAL(key, name, limit)	{ key, name, -(limit), limit, INI_REAL }
#define AXIS_FLAG(key, name)	FLAG("PEv2_" key "_%u", "PEv2.%u." name)
#define AXIS(key, name, high)	WHOLE("PEv2_" key "_%u", "PEv2.%u." name, high)
/* Of the device's signed numbers; the parameter holds those below 0 as its type can. */
#define AXIS_PULSES(key, name)								\
	{ "PEv2_" key "_%u", "PEv2.%u." name, INT32_MIN, UINT32_MAX, INI_WHOLE }
#define AXIS_REAL(key, name)	{ "PEv2_" key "_%u", "PEv2.%u." name, 0, 1e12, INI_REAL }

const struct ini_key ini_pokeys_keys[] = {
	FLAG("ApplyIniSettings", "PEv2.params.ApplyIniSettings"),
	WHOLE("Pin_%u_Function", "pins.%u.PinFunction", 255),
	FLAG("DigIn_%u_invert", "digin.%u.invert"),
	FLAG("DigOut_%u_invert", "digout.%u.invert"),
	REAL("AdcOut_%u_offset", "adcout.%u.offset", 1e9),
	REAL("AdcOut_%u_scale", "adcout.%u.scale", 1e9),
	REAL("AdcOut_%u_high_limit", "adcout.%u.high-limit", 1e9),
	REAL("AdcOut_%u_low_limit", "adcout.%u.low-limit", 1e9),
	{ "AdcOut_%u_max_v", "adcout.%u.max-v", 0, 1e9, INI_REAL },
	FLAG("AdcOut_%u_enable", "adcout.%u.enable"),
	WHOLE("AdcOut_PWM_Period", "adcout.pwm.period", UINT32_MAX),
	REAL("AdcIn_%u_scale", "adcin.%u.scale", 1e9),
	REAL("AdcIn_%u_offset", "adcin.%u.offset", 1e9),

	REAL("encoder.%u.scale", "encoder.%u.scale", 1e12),
	FLAG("encoder.%u.enable", "encoder.%u.enable"),
	FLAG("encoder.%u.x2_sampling", "encoder.%u.2x_sampling"),
	FLAG("encoder.%u.x4_sampling", "encoder.%u.4x_sampling"),
	WHOLE("encoder.%u.channelApin", "encoder.%u.channelApin", 54),
	WHOLE("encoder.%u.channelBpin", "encoder.%u.channelBpin", 54),
	FLAG("encoderFastEnable", "encoder.FastEncoders.Enable"),
	FLAG("alternativeconfig", "encoder.FastEncoders.AlternativeConfig"),
	FLAG("FastEncodersInvert.0", "encoder.FastEncoders.InvertE1"),
	FLAG("FastEncodersInvert.1", "encoder.FastEncoders.InvertE2"),
	FLAG("FastEncodersInvert.2", "encoder.FastEncoders.InvertE3"),
	FLAG("disable_4x_sampling", "encoder.FastEncoders.Disable4xSampling"),
	FLAG("UltraFastEncoder.invert_direction", "encoder.UltraFastEncoder.Options"),
	FLAG("UltraFastEncoder.signal_mode", "encoder.UltraFastEncoder.SignalMode"),
	FLAG("UltraFastEncoder.enable_4x_sampling", "encoder.UltraFastEncoder.4xSampling"),
	WHOLE("UltraFastEncoder.filter", "encoder.UltraFastEncoder.Filter", INT32_MAX),

	WHOLE("PEv2_ProbeInput", "PEv2.digin.Probe.Pin", 55),
	WHOLE("PEv2_ProbeInputPolarity", "PEv2.digin.Probe.invert", 1),
	WHOLE("PEv2_EmergencyInputPin", "PEv2.digin.Emergency.Pin", 55),
	WHOLE("PEv2_EmergencyInput_invert", "PEv2.digin.Emergency.invert", 1),
	WHOLE("PEv2_EmergencyInputPolarity", "PEv2.digin.Emergency.invert", 1),
	WHOLE("PEv2_EmergencyOutputPin", "PEv2.digout.Emergency.Pin", 55),
	WHOLE("PEv2_PulseEngineEnabled", "PEv2.PulseEngineEnabled", 8),
	WHOLE("PEv2_ChargePumpEnabled", "PEv2.ChargePumpEnabled", 65),
	WHOLE("PEv2_PulseGeneratorType", "PEv2.PulseGeneratorType", 255),
	FLAG("PEv2_PG_swap_stepdir", "PEv2.PG-swap-stepdir"),
	FLAG("PEv2_PG_extended_io", "PEv2.PG-extended-io"),

	AXIS("AxesConfig", "AxesConfig", 255),
	AXIS_FLAG("AxisEnabled", "AxisEnabled"),
	AXIS_FLAG("AxisInverted", "AxisInverted"),
	AXIS_FLAG("AxisInternalPlanner", "AxisInternalPlanner"),
	AXIS_FLAG("AxisPositionMode", "AxisPositionMode"),
	AXIS_FLAG("AxisInvertedHome", "AxisInvertedHome"),
	AXIS_FLAG("AxisSoftLimitEnabled", "AxisSoftLimitEnabled"),
	AXIS_FLAG("AxisEnabledMasked", "AxisEnabledMasked"),
	AXIS("AxesSwitchConfig", "AxesSwitchConfig", 255),
	AXIS_FLAG("EnableLimitN", "digin.LimitN.Enabled"),
	AXIS_FLAG("EnableLimitP", "digin.LimitP.Enabled"),
	AXIS_FLAG("EnableHome", "digin.Home.Enabled"),
	AXIS_FLAG("HomeOnLimitN", "digin.Home.OnLimitN"),
	AXIS_FLAG("HomeOnLimitP", "digin.Home.OnLimitP"),
	AXIS_FLAG("InvertLimitN", "digin.LimitN.invert"),
	AXIS_FLAG("InvertLimitP", "digin.LimitP.invert"),
	AXIS_FLAG("InvertHome", "digin.Home.invert"),
	AXIS("PinLimitMSwitch", "digin.LimitN.Pin", 55),
	AXIS("PinLimitNSwitch", "digin.LimitN.Pin", 55),
	AXIS("PinLimitPSwitch", "digin.LimitP.Pin", 55),
	AXIS("PinHomeSwitch", "digin.Home.Pin", 55),
	AXIS_REAL("MaxSpeed", "MaxSpeed"),
	AXIS_REAL("MaxAcceleration", "MaxAcceleration"),
	AXIS_REAL("MaxDecceleration", "MaxDecceleration"),
	AXIS("HomingSpeed", "HomingSpeed", 100),
	AXIS("HomingReturnSpeed", "HomingReturnSpeed", 100),
	AXIS_PULSES("HomeBackOffDistance", "HomeBackOffDistance"),
	AXIS("HomingAlgorithm", "HomingAlgorithm", 255),
	AXIS_FLAG("HomingAlgorithm_OnHome_Stop", "HomeAlg.OnHome.Stop"),
	AXIS_FLAG("HomingAlgorithm_OnHome_ArmEncoder", "HomeAlg.OnHome.ArmEncoder"),
	AXIS_FLAG("HomingAlgorithm_OnHome_RevDirection", "HomeAlg.OnHome.RevDirection"),
	AXIS_FLAG("HomingAlgorithm_OnHome_ReverseDirection", "HomeAlg.OnHome.RevDirection"),
	AXIS_FLAG("HomingAlgorithm_OnHome_ReducedSpeed", "HomeAlg.OnHome.ReducedSpeed"),
	AXIS_FLAG("HomingAlgorithm_OutHome_Stop", "HomeAlg.OutHome.Stop"),
	AXIS_FLAG("HomingAlgorithm_OutHome_ArmEncoder", "HomeAlg.OutHome.ArmEncoder"),
	AXIS_FLAG("HomingAlgorithm_OutHome_RevDirection", "HomeAlg.OutHome.RevDirection"),
	AXIS_FLAG("HomingAlgorithm_OutHome_ReverseDirection", "HomeAlg.OutHome.RevDirection"),
	AXIS_FLAG("HomingAlgorithm_OutHome_ReducedSpeed", "HomeAlg.OutHome.ReducedSpeed"),
	AXIS("MPGjogEncoder", "MPGjogEncoder", 26),
	AXIS("MPGjogDivider", "MPGjogDivider", 65535),
	{ "PEv2_MPGjogMultiplier_%u", "PEv2.%u.MPGjogMultiplier", INT16_MIN, INT16_MAX, INI_WHOLE },
	AXIS("FilterProbeInput", "digin.Probe.Filter", 254),
	AXIS("FilterProbeSwitch", "digin.Probe.Filter", 254),
	AXIS("FilterLimitMSwitch", "digin.LimitN.Filter", 254),
	AXIS("FilterLimitPSwitch", "digin.LimitP.Filter", 254),
	AXIS("FilterHomeSwitch", "digin.Home.Filter", 254),
	AXIS_PULSES("SoftLimitMinimum", "SoftLimitMinimum"),
	AXIS_PULSES("SoftLimitMaximum", "SoftLimitMaximum"),
	AXIS("AxisEnableOutputPins", "digout.AxisEnable.Pin", 55),
	AXIS_FLAG("InvertAxisEnable", "digout.AxisEnable.invert"),
};

const size_t ini_pokeys_key_count = sizeof(ini_pokeys_keys) / sizeof(ini_pokeys_keys[0]);

/* [JOINT_n], for an axis whose PEv2_linked_joint_N says n; "%u" is the axis. */
const struct ini_key ini_joint_keys[] = {
	REAL("STEP_SCALE", "PEv2.%u.stepgen.STEP-SCALE", 1e9),
	REAL("MAX_OUTPUT", "PEv2.%u.stepgen.MAX-OUTPUT", 1e12),
	REAL("DEADBAND", "PEv2.%u.stepgen.DEADBAND", 1e9),
	REAL("STEPGEN_MAXACCEL", "PEv2.%u.stepgen.STEPGEN-MAXACCEL", 1e9),
	REAL("STEPGEN_MAXVEL", "PEv2.%u.stepgen.STEPGEN-MAXVEL", 1e9),
	REAL("HOME", "PEv2.%u.stepgen.HOME", 1e9),
	{ "HOME_IGNORE_LIMITS", "PEv2.%u.stepgen.HOME-IGNORE-LIMITS", 0, 1, INI_WORD },
	REAL("HOME_FINAL_VEL", "PEv2.%u.stepgen.HOME-FINAL-VEL", 1e9),
	REAL("HOME_LATCH_VEL", "PEv2.%u.stepgen.HOME-LATCH-VEL", 1e9),
	REAL("HOME_SEARCH_VEL", "PEv2.%u.stepgen.HOME-SEARCH-VEL", 1e9),
	REAL("HOME_OFFSET", "PEv2.%u.stepgen.HOME-OFFSET", 1e9),
	REAL("MAX_LIMIT", "PEv2.%u.stepgen.MAX-LIMIT", 1e9),
	REAL("MIN_LIMIT", "PEv2.%u.stepgen.MIN-LIMIT", 1e9),
	REAL("ENCODER_SCALE", "PEv2.%u.stepgen.ENCODER-SCALE", 1e12),
	{ "TYPE", "PEv2.%u.stepgen.TYPE", 0, 1, INI_WORD },
};

const size_t ini_joint_key_count = sizeof(ini_joint_keys) / sizeof(ini_joint_keys[0]);
