/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the device is, and its clock.
 *
 * Names of info.* and devSerial keep the mixed case of the older userspace
 * component, whose users have them in their HAL files; the clock's are its names
 * as well. Setting the clock is new: a rising edge takes the six set-* pins.
 */
#include "halbridge/table_rows.h"

#define INFO(name, member, help)	\
	ROW("info." name, PIN, OUT, READ, info.member, help, BOTH_SCHEMES)
#define MORE(name, member, help)	ROW("info." name, PIN, OUT, READ, info.member, help)
#define FACT(name, member, help)	\
	ROW(name, PARAM, RO, READ, member, help, BOTH_SCHEMES)
#define CLOCK(name, member, help)	\
	ROW("rtc." name, PIN, OUT, READ, rtc.member, help, BOTH_SCHEMES)
#define CLOCK_SET(name, member, low_, high_, help)	\
	ROW("rtc.set-" name, PIN, IN, WRITE, rtc.set_##member, help, .low = low_, .high = high_)

static const struct table_row rows[] = {
	ROW("devSerial", PARAM, RW, READ, device_serial,
	    "serial number of the device in use; written when it is identified", BOTH_SCHEMES),
	FACT("info.SerialNumber", info.serial, "serial number"),
	FACT("info.DeviceTypeID", info.type_id, "hardware id"),
	INFO("PinCount", pins, "digital pins"),
	INFO("PWMCount", pwm, "PWM channels"),
	INFO("BasicEncoderCount", basic_encoders, "basic encoders"),
	INFO("EncodersCount", encoders, "encoders of all kinds"),
	INFO("FastEncoders", fast_encoders, "fast encoders"),
	INFO("UltraFastEncoders", ultra_fast_encoders, "ultra-fast encoders"),
	INFO("PWMinternalFrequency", pwm_hz, "clock of the PWM counter, Hz"),
	INFO("AnalogInputs", analog_inputs, "analog inputs"),
	INFO("KeyMapping", key_mapping, "key mapping"),
	INFO("TriggeredKeyMapping", triggered_key_mapping, "triggered key mapping"),
	INFO("KeyRepeatDelay", key_repeat_delay, "key repeat delay"),
	INFO("DigitalCounters", digital_counters, "digital counters"),
	INFO("JoystickButtonAxisMapping", joystick_button_axis, "joystick button and axis mapping"),
	INFO("JoystickAnalogToDigitalMapping", joystick_analog_digital,
	     "joystick analog to digital mapping"),
	INFO("Macros", macros, "macros"),
	INFO("MatrixKeyboard", matrix_keyboard, "matrix keyboard"),
	INFO("MatrixKeyboardTriggeredMapping", matrix_triggered_mapping,
	     "matrix keyboard with triggered mapping"),
	INFO("LCD", lcd, "LCD"),
	INFO("MatrixLED", matrix_led, "matrix LED displays"),
	INFO("ConnectionSignal", connection_signal, "connection signal"),
	INFO("PoExtBus", poextbus, "PoExtBus, bytes"),
	INFO("PoNET", ponet, "PoNET"),
	INFO("AnalogFiltering", analog_filtering, "filter of the analog inputs"),
	INFO("InitOutputsStart", init_outputs, "start values of outputs"),
	INFO("protI2C", i2c, "I2C"),
	INFO("prot1wire", one_wire, "1-wire"),
	INFO("AdditionalOptions", additional_options, "options that can be activated"),
	INFO("LoadStatus", load_status, "reports its processor load"),
	INFO("CustomDeviceName", custom_name, "custom device name"),
	INFO("PoTLog27support", potlog27, "PoTLog27"),
	INFO("SensorList", sensor_list, "sensor list"),
	INFO("WebInterface", web_interface, "web interface"),
	INFO("FailSafeSettings", failsafe, "failsafe settings"),
	INFO("JoystickHATswitch", joystick_hat, "joystick hat switch"),
	INFO("PulseEngine", pulse_engine, "pulse engine, version 1"),
	INFO("PulseEnginev2", pulse_engine_v2, "pulse engine, version 2"),
	INFO("EasySensors", easy_sensors, "EasySensor slots"),
	MORE("Axes", axes, "axes of the pulse engine, as it reports"),
	MORE("MaxPulseFrequency", axis_khz, "highest pulse frequency of an axis, kHz"),
	MORE("FirmwareMajor", firmware_major, "firmware version, e.g. 4 of 4.7.15"),
	MORE("FirmwareMinor", firmware_minor, "firmware version, e.g. 7 of 4.7.15"),
	MORE("FirmwareRevision", firmware_revision, "firmware version, e.g. 15 of 4.7.15"),
	MORE("UserID", user_id, "the device's user id"),
	MORE("ActivatedOptions", options, "activated options, bits as the device reports them"),

	CLOCK("sec", second, "the device's clock: second"),
	CLOCK("min", minute, "minute"),
	CLOCK("hour", hour, "hour"),
	CLOCK("dow", day_of_week, "day of the week, 0..6"),
	CLOCK("dom", day, "day of the month, 1..31"),
	CLOCK("month", month, "month, 1..12"),
	CLOCK("year", year, "year, e.g. 2026"),
	CLOCK("doy", day_of_year, "day of the year"),
	ROW("rtc.set", PIN, IN, WRITE, rtc.set,
	    "its rising edge sets the clock to the values of the pins rtc.set-*"),
	CLOCK_SET("sec", second, 0, 59, "second"),
	CLOCK_SET("min", minute, 0, 59, "minute"),
	CLOCK_SET("hour", hour, 0, 23, "hour"),
	CLOCK_SET("dom", day, 1, 31, "day of the month"),
	CLOCK_SET("month", month, 1, 12, "month"),
	CLOCK_SET("year", year, 2000, 2099,
		  "year; the day of the week and the day of the year are computed"),
	ROW("rtc.set-outcome", PIN, OUT, READ, rtc.set_outcome,
	    "result of the last setting of the clock: 0 none or in progress, 1 done, 2 failed, 3 "
	    "unknown, 4 refused"),
};

TABLE_GROUP(table_info, rows);
