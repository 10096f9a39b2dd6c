/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the device is and can do, its clock, and the state of its settings.
 *
 * Several HAL pins may show the same capability (halbridge/info.c).
 */
#include "model/rows.h"

#define TEXT(name_, member_, help_)	ONE(name_, MODEL_TEXT, member_, "", HELP(help_))
#define IS(name_, member_, ...)	NUMBER("info." name_, identity.member_, __VA_ARGS__)
#define COUNT(name_, member_, ...)	NUMBER("info." name_, capability.member_, __VA_ARGS__)
#define HAS(name_, member_)	COUNT(name_, member_, "")
#define CLOCK(name_, member_)	NUMBER("rtc." name_, rtc.member_, "")

static const struct model_row rows[] = {
	IS("SerialNumber", serial, ""),
	TEXT("info.type", identity.type, "model, e.g. PoKeys57CNC"),
	TEXT("info.name", identity.name, "the device's own name"),
	TEXT("info.build", identity.build, "build date of the firmware"),
	ONE("info.address", MODEL_ADDRESS, identity.address, "", HELP("IP address")),
	IS("DeviceTypeID", hardware, ""),
	IS("FirmwareMajor", firmware_major, ""),
	IS("FirmwareMinor", firmware_minor, ""),
	IS("FirmwareRevision", firmware_revision, ""),
	IS("UserID", user_id, ""),
	IS("ActivatedOptions", options, ""),
	FLAG("device.locked", identity.locked, ""),
	NUMBER("device.load", identity.load, "%"),
	NUMBER("device.tick", device_tick_ms, "s", FACTOR(1e-3)),
	NUMBER("device.access", access, ""),

	COUNT("PinCount", pins, ""),
	COUNT("PWMCount", pwm, ""),
	COUNT("BasicEncoderCount", basic_encoders, ""),
	COUNT("EncodersCount", encoders, ""),
	COUNT("FastEncoders", fast_encoders, ""),
	COUNT("UltraFastEncoders", ultra_fast_encoders, ""),
	COUNT("PWMinternalFrequency", pwm_hz, "Hz"),
	COUNT("AnalogInputs", analog_inputs, ""),
	HAS("KeyMapping", key_mapping),
	HAS("TriggeredKeyMapping", triggered_key_mapping),
	HAS("KeyRepeatDelay", key_repeat_delay),
	COUNT("DigitalCounters", digital_counters, ""),
	HAS("JoystickButtonAxisMapping", joystick),
	HAS("JoystickAnalogToDigitalMapping", joystick),
	HAS("JoystickHATswitch", joystick),
	HAS("Macros", macros),
	HAS("MatrixKeyboard", matrix_keyboard),
	HAS("MatrixKeyboardTriggeredMapping", triggered_key_mapping),
	HAS("LCD", lcd),
	COUNT("MatrixLED", matrix_led, ""),
	HAS("ConnectionSignal", connection_signal),
	COUNT("PoExtBus", poextbus, ""),
	HAS("PoNET", ponet),
	HAS("AnalogFiltering", analog_filtering),
	HAS("InitOutputsStart", init_outputs),
	HAS("protI2C", i2c),
	HAS("prot1wire", one_wire),
	HAS("AdditionalOptions", additional_options),
	HAS("LoadStatus", load_status),
	HAS("CustomDeviceName", custom_name),
	HAS("PoTLog27support", potlog27),
	HAS("SensorList", sensor_list),
	HAS("WebInterface", web_interface),
	HAS("FailSafeSettings", failsafe),
	COUNT("pulse-engine-version", pulse_engine, "",
	      HELP("version of the pulse engine: 0 none, 1, 2")),
	COUNT("EasySensors", easy_sensors, ""),
	COUNT("Axes", axes, ""),
	COUNT("MaxPulseFrequency", axis_khz, "kHz"),

	CLOCK("sec", second),
	CLOCK("min", minute),
	CLOCK("hour", hour),
	CLOCK("dow", day_of_week),
	CLOCK("dom", day),
	CLOCK("month", month),
	CLOCK("year", year),
	CLOCK("doy", day_of_year),

	NUMBER("config.state", config_state, ""),
	NUMBER("config.generation-applied", config_generation, ""),
	NUMBER("config.foreign-count", config_foreign, ""),
	NUMBER("config.report-count", report_count, "",
	       HELP("incremented when the reported settings of the device change")),
	NUMBER("failsafe.state", failsafe, ""),
};

MODEL_GROUP(model_device, rows);
