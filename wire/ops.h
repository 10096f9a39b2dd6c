/* SPDX-License-Identifier: MIT */
#ifndef WIRE_OPS_H
#define WIRE_OPS_H

/*
 * The one table of operations, for wire/op.h, which explains the columns and
 * is what to include.
 */

/*
 * X(NAME, name, id, sub, class, rule, flags, request struct, reply struct)
 *
 * Classes, where they are not plain: a write of an absolute value is WRITE.
 * ONE_SHOT are (a) things which act on what happened meanwhile - counter and
 * encoder resets, set position, buffer fill and clear; (b) starts of anything
 * that moves or transfers - homing, probing, threading, bus transfers; (c)
 * reads which consume what they return - UART, CAN, SPI; (d) writes into
 * flash and changes of access - save, network, password; (e) values which age
 * on the way - the clock. The comments say which letter.
 */

/* wire/system.h */
#define WIRE_OPS_SYSTEM(X) \
	X(DEVICE_DATA, device_data, 0x00, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, device_data_rep) \
	X(SET_USER_ID, set_user_id, 0x02, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  set_user_id_req, set_user_id_rep) \
	X(USER_ID, user_id, 0x03, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, user_id_rep) \
	X(BUILD_DATE, build_date, 0x04, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  build_date_req, build_date_rep) \
	X(SYSTEM_LOAD, system_load, 0x05, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, system_load_rep) \
	X(DEVICE_NAME, device_name, 0x06, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  device_name_req, device_name_rep) \
	X(USB_INTERFACE, usb_interface, 0x07, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 10), 0, \
	  usb_interface_req, usb_interface_rep) \
	X(DELAYED_START, delayed_start, 0x08, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  delayed_start_req, delayed_start_rep) \
	X(SESSION_DATA, session_data, 0x0A, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  session_data_req, session_data_rep) \
	X(MISC_USB, misc_usb, 0x0B, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  misc_usb_req, misc_usb_rep) \
	X(CONNECTION_SIGNAL, connection_signal, 0x1B, WIRE_NO_SUB, WIRE_WRITE, \
	  WIRE_IF_NE(2, 0), 0, connection_signal_req, connection_signal_rep) \
	X(STARTUP_OUTPUTS, startup_outputs, 0x1E, WIRE_NO_SUB, WIRE_WRITE, \
	  WIRE_IF_NE(2, 0), 0, startup_outputs_req, startup_outputs_rep) \
	/* d: flash */ \
	X(SAVE, save, 0x50, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_ALWAYS, 0, confirm_req, nothing) \
	X(SAVE_LOCK, save_lock, 0x51, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  confirm_req, nothing) \
	X(RESET_CONFIG, reset_config, 0x52, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  confirm_req, nothing) \
	X(FAILSAFE, failsafe, 0x81, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), WIRE_P1, \
	  failsafe_req, failsafe_req) \
	/* e: a late copy sets the clock back; read it to learn whether it was set */ \
	X(RTC, rtc, 0x83, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_IF_NE(2, 0), WIRE_P1, \
	  rtc_req, rtc_req) \
	/* a: a second clear drops the entries written between */ \
	X(SYSTEM_LOG, system_log, 0x84, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_IF_NE(2, 0), 0, \
	  system_log_req, system_log_rep) \
	X(OPTIONS, options, 0x8F, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  options_req, options_rep) \
	X(TICK, tick, 0xCF, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, nothing, tick_rep) \
	/* d: also saves to flash, and the device may answer elsewhere afterwards */ \
	X(NETWORK, network, 0xE0, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_IF_NE(2, 0), 0, \
	  network_req, network_rep) \
	X(SECURITY, security, 0xE1, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, security_rep) \
	/* d: the hash answers one seed; after a try ask for the level instead */ \
	X(AUTHORISE, authorise, 0xE2, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  authorise_req, authorise_rep) \
	X(PASSWORD, password, 0xE3, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  password_req, nothing) \
	X(REBOOT, reboot, 0xF3, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_ALWAYS, 0, nothing, nothing)

/* wire/io.h */
#define WIRE_OPS_IO(X) \
	X(PIN_SET, pin_set, 0x10, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  pin_set_req, pin_set_rep) \
	/* the reply repeats the pin, or has 0xFF there on an error: no echo rule */ \
	X(PIN_GET, pin_get, 0x15, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  pin_get_req, pin_get_rep) \
	/* a: counts between two resets would be lost */ \
	X(COUNTER_RESET, counter_reset, 0x1D, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  nothing, nothing) \
	X(PIN_CAPS, pin_caps, 0x1F, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  pin_caps_req, pin_caps_rep) \
	X(INPUT, input, 0x30, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, input_req, input_rep) \
	X(INPUTS_LOW, inputs_low, 0x31, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, inputs_low_rep) \
	X(INPUTS_HIGH, inputs_high, 0x32, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, inputs_high_rep) \
	X(ANALOG_ONE, analog_one, 0x35, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  analog_one_req, analog_one_rep) \
	X(ANALOG_4X8, analog_4x8, 0x36, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  analog_4x8_req, analog_4x8_rep) \
	X(ANALOG_3X10, analog_3x10, 0x37, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  analog_3x10_req, analog_3x10_rep) \
	X(FILTER_GET, filter_get, 0x38, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, filter_rep) \
	X(FILTER_SET, filter_set, 0x39, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  filter_set_req, filter_rep) \
	X(ANALOG, analog, 0x3A, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  analog_req, analog_rep) \
	X(OUTPUT, output, 0x40, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  output_req, output_rep) \
	X(ANALOG_OUT, analog_out, 0x41, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  analog_out_req, analog_out_rep) \
	X(OUTPUTS_LOW, outputs_low, 0x42, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  outputs_low_req, nothing) \
	X(OUTPUTS_HIGH, outputs_high, 0x43, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  outputs_high_req, nothing) \
	X(PIN_ALL, pin_all, 0xC0, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_PIN_ALL, 0, \
	  pin_all_req, pin_all_rep) \
	X(KEY_MAP, key_map, 0xC1, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  key_map_req, key_map_rep) \
	X(KEY_CODES, key_codes, 0xC2, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  key_map_req, key_map_rep) \
	X(KEY_MODIFIERS, key_modifiers, 0xC3, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  key_map_req, key_map_rep) \
	X(PWM, pwm, 0xCB, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, pwm_req, pwm_rep) \
	X(IO, io, 0xCC, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_EQ(2, 1), 0, io_req, io_rep) \
	/* options 20 and 21 are not described: taken as writes, which is the safe side */ \
	X(KEY_TRIGGERED, key_triggered, 0xD7, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  key_map_req, key_map_rep) \
	X(COUNTERS, counters, 0xD8, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  counters_req, counters_rep) \
	X(COUNTER_DIRS, counter_dirs, 0xD9, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  counter_dirs_req, counter_dirs_rep)

/* wire/encoder.h */
#define WIRE_OPS_ENCODER(X) \
	X(ENCODER_SET, encoder_set, 0x11, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  encoder_set_req, encoder_set_rep) \
	X(ENCODER_GET, encoder_get, 0x16, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  encoder_get_req, encoder_get_rep) \
	X(ENCODER_RAW, encoder_raw, 0x19, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  encoder_raw_req, encoder_raw_rep) \
	/* a: counts between two resets would be lost */ \
	X(ENCODER_RAW_RESET, encoder_raw_reset, 0x1A, WIRE_NO_SUB, WIRE_ONE_SHOT, \
	  WIRE_ALWAYS, 0, encoder_raw_req, nothing) \
	/* a: when it arms the index reset, a repeat arms it again after the index */ \
	X(ULTRA_ENCODER, ultra_encoder, 0x1C, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_IF_ULTRA, 0, \
	  ultra_encoder_req, ultra_encoder_rep) \
	X(ULTRA_TEST, ultra_test, 0x85, WIRE_SUB(0x37), WIRE_READ, WIRE_ALWAYS, WIRE_P1, \
	  nothing, ultra_test_rep) \
	X(ENCODER_OPTIONS, encoder_options, 0xC4, WIRE_NO_SUB, WIRE_WRITE, \
	  WIRE_IF_NE(2, 0), 0, encoder_options_req, encoder_options_rep) \
	X(ENCODER_PINS, encoder_pins, 0xC5, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  encoder_pins_req, encoder_pins_rep) \
	X(ENCODER_KEYS_A, encoder_keys_a, 0xC6, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  encoder_keys_req, encoder_keys_rep) \
	X(ENCODER_KEYS_B, encoder_keys_b, 0xC7, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 0), 0, \
	  encoder_keys_req, encoder_keys_rep) \
	/* a: writing (options 10, 11) drops what was counted since the first copy */ \
	X(ENCODERS, encoders, 0xCD, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_IF_GE(2, 10), 0, \
	  encoders_req, encoders_rep) \
	X(FAST_ENCODERS, fast_encoders, 0xCE, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 2), 0, \
	  fast_encoders_req, fast_encoders_rep)

/* wire/pulse.h; every reply has the sub-command at @2 except those of the fills */
#define WIRE_OPS_PULSE(X) \
	X(PULSE_STATUS, pulse_status, 0x85, WIRE_SUB(0x00), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1 | WIRE_CHECK, pulse_status_req, pulse_status_rep) \
	X(PULSE_SETUP, pulse_setup, 0x85, WIRE_SUB(0x01), WIRE_WRITE, WIRE_ALWAYS, WIRE_P1, \
	  pulse_setup_req, pulse_result_rep) \
	/* b: a late "run" must not restart what the device has stopped; see WIRE_RULE_STATE */ \
	X(PULSE_STATE, pulse_state, 0x85, WIRE_SUB(0x02), WIRE_ONE_SHOT, WIRE_IF_STATE, \
	  WIRE_P1, pulse_state_req, nothing) \
	/* a: a second copy during motion would shift the coordinates */ \
	X(PULSE_POSITIONS, pulse_positions, 0x85, WIRE_SUB(0x03), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_P1, pulse_positions_req, nothing) \
	X(PULSE_OUTPUTS, pulse_outputs, 0x85, WIRE_SUB(0x04), WIRE_WRITE, WIRE_IF_NE(5, 1), \
	  WIRE_P1, pulse_outputs_req, pulse_outputs_rep) \
	X(PULSE_REBOOT, pulse_reboot, 0x85, WIRE_SUB(0x05), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_P1, nothing, nothing) \
	X(PULSE_EMERGENCY, pulse_emergency, 0x85, WIRE_SUB(0x06), WIRE_WRITE, \
	  WIRE_IF_NE(3, 0), WIRE_P1, pulse_emergency_req, pulse_emergency_rep) \
	/* its check byte is not defined for the request: not checked (section 6, D7) */ \
	X(PULSE_STATUS2, pulse_status2, 0x85, WIRE_SUB(0x08), WIRE_READ, WIRE_ALWAYS, WIRE_P1, \
	  pulse_status_req, pulse_status2_rep) \
	X(PULSE_SYNC_PWM, pulse_sync_pwm, 0x85, WIRE_SUB(0x0A), WIRE_WRITE, WIRE_IF_NE(3, 2), \
	  WIRE_P1, pulse_sync_pwm_req, pulse_sync_pwm_req) \
	X(PULSE_SYNC_OUTPUTS, pulse_sync_outputs, 0x85, WIRE_SUB(0x0B), WIRE_WRITE, \
	  WIRE_IF_NE(3, 2), WIRE_P1, pulse_sync_outputs_req, pulse_sync_outputs_req) \
	X(PULSE_AXIS_GET, pulse_axis_get, 0x85, WIRE_SUB(0x10), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, pulse_axis_get_req, pulse_axis_get_rep) \
	X(PULSE_AXIS_SET, pulse_axis_set, 0x85, WIRE_SUB(0x11), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_P1, pulse_axis_set_req, nothing) \
	X(PULSE_DRIVERS_GET, pulse_drivers_get, 0x85, WIRE_SUB(0x18), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, pulse_drivers) \
	X(PULSE_DRIVERS_SET, pulse_drivers_set, 0x85, WIRE_SUB(0x19), WIRE_WRITE, \
	  WIRE_ALWAYS, WIRE_P1, pulse_drivers, nothing) \
	/* absolute references: every copy says the same */ \
	X(PULSE_MOVE, pulse_move, 0x85, WIRE_SUB(0x20), WIRE_WRITE, WIRE_ALWAYS, WIRE_P1, \
	  pulse_move_req, nothing) \
	X(PULSE_MOVE_PV, pulse_move_pv, 0x85, WIRE_SUB(0x25), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_P1, pulse_move_pv_req, nothing) \
	/* b */ \
	X(PULSE_HOME_START, pulse_home_start, 0x85, WIRE_SUB(0x21), WIRE_ONE_SHOT, \
	  WIRE_ALWAYS, WIRE_P1, pulse_home_start_req, nothing) \
	/* b: may put the engine into a running state */ \
	X(PULSE_HOME_FINISH, pulse_home_finish, 0x85, WIRE_SUB(0x22), WIRE_ONE_SHOT, \
	  WIRE_ALWAYS, WIRE_P1, pulse_home_finish_req, nothing) \
	/* b */ \
	X(PULSE_PROBE_START, pulse_probe_start, 0x85, WIRE_SUB(0x23), WIRE_ONE_SHOT, \
	  WIRE_ALWAYS, WIRE_P1, pulse_probe_start_req, nothing) \
	/* leaves the engine stopped however often; the reply is the only copy of the result */ \
	X(PULSE_PROBE_FINISH, pulse_probe_finish, 0x85, WIRE_SUB(0x24), WIRE_WRITE, \
	  WIRE_ALWAYS, WIRE_P1, pulse_probe_finish_req, pulse_probe_finish_rep) \
	/* b; release and cancel only end threading and may be repeated */ \
	X(THREAD_PREPARE, thread_prepare, 0x85, WIRE_SUB(0x30), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_P1, nothing, nothing) \
	X(THREAD_FORCE, thread_force, 0x85, WIRE_SUB(0x31), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_P1, nothing, nothing) \
	X(THREAD_ARM, thread_arm, 0x85, WIRE_SUB(0x32), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_P1, nothing, nothing) \
	X(THREAD_RELEASE, thread_release, 0x85, WIRE_SUB(0x33), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_P1, nothing, nothing) \
	X(THREAD_CANCEL, thread_cancel, 0x85, WIRE_SUB(0x34), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_P1, nothing, nothing) \
	X(THREAD_STATUS, thread_status, 0x85, WIRE_SUB(0x35), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, thread_status_rep) \
	X(THREAD_PARAMS, thread_params, 0x85, WIRE_SUB(0x36), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_P1, thread_params_req, thread_status_rep) \
	X(PULSE_BACKLASH_GET, pulse_backlash_get, 0x85, WIRE_SUB(0x40), WIRE_READ, \
	  WIRE_ALWAYS, WIRE_P1, nothing, pulse_backlash_rep) \
	X(PULSE_BACKLASH_SET, pulse_backlash_set, 0x85, WIRE_SUB(0x41), WIRE_WRITE, \
	  WIRE_ALWAYS, WIRE_P1, pulse_backlash_set_req, pulse_backlash_rep) \
	/* d: one of its write modes saves into the driver's EEPROM */ \
	X(POSTEP_COMM, postep_comm, 0x85, WIRE_SUB(0x50), WIRE_ONE_SHOT, WIRE_IF_NE(3, 0), \
	  WIRE_P1, postep_comm_req, postep_comm_req) \
	X(POSTEP_STATUS, postep_status, 0x85, WIRE_SUB(0x51), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, postep_status_rep) \
	X(POSTEP_CURRENTS, postep_currents, 0x85, WIRE_SUB(0x52), WIRE_WRITE, \
	  WIRE_IF_NE(3, 0), WIRE_P1, postep_currents_req, postep_currents_req) \
	X(POSTEP_MODES, postep_modes, 0x85, WIRE_SUB(0x53), WIRE_WRITE, WIRE_IF_NE(3, 0), \
	  WIRE_P1, postep_modes_req, postep_modes_req) \
	X(POSTEP_VERSIONS, postep_versions, 0x85, WIRE_SUB(0x54), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, postep_versions_rep) \
	X(SMART_GET, smart_get, 0x85, WIRE_SUB(0x90), WIRE_READ, WIRE_ALWAYS, WIRE_P1, \
	  nothing, smart_config) \
	X(SMART_SET, smart_set, 0x85, WIRE_SUB(0x91), WIRE_WRITE, WIRE_ALWAYS, WIRE_P1, \
	  smart_config, pulse_result_rep) \
	/* a */ \
	X(SMART_RESET, smart_reset, 0x85, WIRE_SUB(0x92), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_P1, smart_reset_req, pulse_result_rep) \
	X(SMART_STATUS, smart_status, 0x85, WIRE_SUB(0x95), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, smart_status_rep) \
	X(SMART_ENCODERS, smart_encoders, 0x85, WIRE_SUB(0x96), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, smart_encoders_rep) \
	/* a: steps filled after the first copy would be dropped by the second */ \
	X(PULSE_BUFFER_CLEAR, pulse_buffer_clear, 0x85, WIRE_SUB(0xF0), WIRE_ONE_SHOT, \
	  WIRE_ALWAYS, WIRE_P1, nothing, nothing) \
	/* a: relative steps; the reply has the number of accepted slots at @2 */ \
	X(PULSE_FILL16, pulse_fill16, 0x85, WIRE_SUB(0xFE), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  pulse_fill_req, pulse_fill_rep) \
	X(PULSE_FILL8, pulse_fill8, 0x85, WIRE_SUB(0xFF), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  pulse_fill_req, pulse_fill_rep) \
	/* one of eight parts; see wire_multi_build() */ \
	X(PULSE_FILL_PART, pulse_fill_part, 0xB0, WIRE_NO_SUB, WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  pulse_fill_part_req, pulse_fill_rep)

/* wire/bus.h */
#define WIRE_OPS_BUS(X) \
	X(SENSOR_SETUP, sensor_setup, 0x76, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(4, 0), \
	  WIRE_P1 | WIRE_P2, sensor_setup_req, sensor_setup_rep) \
	X(SENSOR_VALUES, sensor_values, 0x77, WIRE_NO_SUB, WIRE_READ, WIRE_ALWAYS, 0, \
	  sensor_values_req, sensor_values_rep) \
	X(CAN_SETUP, can_setup, 0x86, WIRE_SUB(0x01), WIRE_WRITE, WIRE_ALWAYS, 0, \
	  can_setup_req, nothing) \
	X(CAN_FILTER, can_filter, 0x86, WIRE_SUB(0x10), WIRE_WRITE, WIRE_ALWAYS, 0, \
	  can_filter_req, nothing) \
	/* b */ \
	X(CAN_SEND, can_send, 0x86, WIRE_SUB(0x20), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  can_send_req, nothing) \
	/* the device drops messages only when the next request confirms them */ \
	X(CAN_QUEUE, can_queue, 0x86, WIRE_SUB(0x30), WIRE_READ, WIRE_ALWAYS, 0, \
	  can_queue_req, can_queue_rep) \
	/* c */ \
	X(CAN_READ, can_read, 0x86, WIRE_SUB(0x31), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  nothing, can_read_rep) \
	/* a */ \
	X(CAN_FLUSH, can_flush, 0x86, WIRE_SUB(0x32), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  nothing, nothing) \
	X(POEXTBUS, poextbus, 0xDA, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_NE(2, 2), 0, \
	  poextbus_req, poextbus_rep) \
	X(I2C_ACTIVATE, i2c_activate, 0xDB, WIRE_SUBS(0x00, 0x02), WIRE_WRITE, \
	  WIRE_IF_NE(2, 2), WIRE_P1, bus_op_req, bus_op_rep) \
	/* b: a slave may count bytes */ \
	X(I2C_WRITE, i2c_write, 0xDB, WIRE_SUB(0x10), WIRE_ONE_SHOT, WIRE_ALWAYS, WIRE_P1, \
	  i2c_write_req, bus_result_rep) \
	X(I2C_WRITE_RESULT, i2c_write_result, 0xDB, WIRE_SUB(0x11), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, bus_result_rep) \
	/* b */ \
	X(I2C_READ, i2c_read, 0xDB, WIRE_SUB(0x20), WIRE_ONE_SHOT, WIRE_ALWAYS, WIRE_P1, \
	  i2c_read_req, bus_result_rep) \
	X(I2C_READ_RESULT, i2c_read_result, 0xDB, WIRE_SUB(0x21), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, i2c_read_result_rep) \
	/* a scan only addresses */ \
	X(I2C_SCAN, i2c_scan, 0xDB, WIRE_SUB(0x30), WIRE_WRITE, WIRE_ALWAYS, WIRE_P1, \
	  nothing, bus_result_rep) \
	X(I2C_SCAN_RESULT, i2c_scan_result, 0xDB, WIRE_SUB(0x31), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, nothing, i2c_scan_result_rep) \
	X(ONEWIRE_STATE, onewire_state, 0xDC, WIRE_SUBS(0x00, 0x02), WIRE_WRITE, \
	  WIRE_IF_NE(2, 2), 0, bus_op_req, bus_op_rep) \
	/* b */ \
	X(ONEWIRE_START, onewire_start, 0xDC, WIRE_SUB(0x10), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  onewire_start_req, bus_result_rep) \
	X(ONEWIRE_RESULT, onewire_result, 0xDC, WIRE_SUB(0x11), WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, onewire_result_rep) \
	/* b: starts again, or takes the next step of, a search */ \
	X(ONEWIRE_SCAN, onewire_scan, 0xDC, WIRE_SUB(0x20), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  onewire_scan_req, bus_result_rep) \
	X(ONEWIRE_SCAN_RESULT, onewire_scan_result, 0xDC, WIRE_SUB(0x21), WIRE_READ, \
	  WIRE_ALWAYS, 0, nothing, onewire_scan_result_rep) \
	X(ONEWIRE_SCAN_NEXT, onewire_scan_next, 0xDC, WIRE_SUB(0x22), WIRE_ONE_SHOT, \
	  WIRE_ALWAYS, 0, nothing, bus_result_rep) \
	X(ONEWIRE_SCAN_STOP, onewire_scan_stop, 0xDC, WIRE_SUB(0x23), WIRE_WRITE, \
	  WIRE_ALWAYS, 0, nothing, bus_result_rep) \
	X(PONET_STATUS, ponet_status, 0xDD, WIRE_SUB(0x00), WIRE_READ, WIRE_ALWAYS, WIRE_P1, \
	  nothing, ponet_status_rep) \
	X(PONET_SETTINGS, ponet_settings, 0xDD, WIRE_SUB(0x10), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, ponet_module_req, ponet_settings_rep) \
	X(PONET_VERSION, ponet_version, 0xDD, WIRE_SUB(0x11), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_P1, ponet_module_req, ponet_version_rep) \
	X(PONET_MAP, ponet_map, 0xDD, WIRE_SUB(0x15), WIRE_WRITE, WIRE_ALWAYS, WIRE_P1, \
	  ponet_map_req, bus_result_rep) \
	/* b: bus operations which begin anew; poll the status instead */ \
	X(PONET_CLEAR, ponet_clear, 0xDD, WIRE_SUB(0x20), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_P1, ponet_module_req, bus_result_rep) \
	X(PONET_REINIT, ponet_reinit, 0xDD, WIRE_SUB(0x21), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_P1, nothing, bus_result_rep) \
	X(PONET_REINIT_CLEAR, ponet_reinit_clear, 0xDD, WIRE_SUB(0x25), WIRE_ONE_SHOT, \
	  WIRE_ALWAYS, WIRE_P1, nothing, bus_result_rep) \
	X(PONET_DISCOVERY, ponet_discovery, 0xDD, WIRE_SUB(0x30), WIRE_WRITE, \
	  WIRE_IF_NE(3, 0x30), WIRE_P1, ponet_option_req, ponet_found_rep) \
	X(PONET_CHECK, ponet_check, 0xDD, WIRE_SUB(0x40), WIRE_WRITE, WIRE_IF_NE(3, 0x30), \
	  WIRE_P1, ponet_option_req, ponet_found_rep) \
	/* start and fetch; a second start reads the keys again */ \
	X(PONET_DATA, ponet_data, 0xDD, WIRE_SUB(0x50), WIRE_READ, WIRE_ALWAYS, WIRE_P1, \
	  ponet_option_req, ponet_data_rep) \
	X(PONET_SET_DATA, ponet_set_data, 0xDD, WIRE_SUB(0x55), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_P1, ponet_set_data_req, bus_result_rep) \
	X(PONET_LIGHT, ponet_light, 0xDD, WIRE_SUB(0x60), WIRE_READ, WIRE_ALWAYS, WIRE_P1, \
	  ponet_option_req, ponet_light_rep) \
	X(PONET_PWM, ponet_pwm, 0xDD, WIRE_SUB(0x70), WIRE_WRITE, WIRE_ALWAYS, WIRE_P1, \
	  ponet_pwm_req, bus_result_rep) \
	X(UART_SETUP, uart_setup, 0xDE, WIRE_SUB(0x10), WIRE_WRITE, WIRE_ALWAYS, 0, \
	  uart_setup_req, nothing) \
	/* b */ \
	X(UART_SEND, uart_send, 0xDE, WIRE_SUB(0x20), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  uart_send_req, uart_send_rep) \
	/* c */ \
	X(UART_READ, uart_read, 0xDE, WIRE_SUB(0x30), WIRE_ONE_SHOT, WIRE_ALWAYS, 0, \
	  uart_read_req, uart_read_rep) \
	X(SPI_SETUP, spi_setup, 0xE5, WIRE_SUB(0x01), WIRE_WRITE, WIRE_ALWAYS, WIRE_P1, \
	  spi_setup_req, bus_result_rep) \
	/* b */ \
	X(SPI_WRITE, spi_write, 0xE5, WIRE_SUB(0x10), WIRE_ONE_SHOT, WIRE_ALWAYS, WIRE_P1, \
	  spi_write_req, bus_result_rep) \
	/* c */ \
	X(SPI_READ, spi_read, 0xE5, WIRE_SUB(0x20), WIRE_ONE_SHOT, WIRE_ALWAYS, WIRE_P1, \
	  spi_read_req, spi_read_rep) \
	X(POCAN_STATUS, pocan_status, 0xE6, WIRE_SUB(0x00), WIRE_READ, WIRE_ALWAYS, 0, \
	  nothing, pocan_status_rep) \
	X(POCAN_ENABLE, pocan_enable, 0xE6, WIRE_SUB(0x01), WIRE_WRITE, WIRE_ALWAYS, 0, \
	  pocan_enable_req, nothing) \
	X(POCAN_REQUIRE, pocan_require, 0xE6, WIRE_SUB(0x02), WIRE_WRITE, WIRE_ALWAYS, 0, \
	  pocan_require_req, nothing)

/* wire/panel.h */
#define WIRE_OPS_PANEL(X) \
	X(STRIP_DATA, strip_data, 0x4B, WIRE_SUB(0x10), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_NO_REPLY, strip_data_req, nothing) \
	/* the reply has the keyboard id at @2, not the option */ \
	X(KB_CONFIG_SET, kb_config_set, 0xCA, WIRE_SUB(1), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_BARE, kb_config_set_req, kb_config_rep) \
	X(KB_CODES_SET, kb_codes_set, 0xCA, WIRE_SUBS(2, 9), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_BARE, kb_codes_set_req, kb_codes_rep) \
	X(KB_CONFIG_GET, kb_config_get, 0xCA, WIRE_SUBS(10, 11), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_BARE, kb_option_req, kb_config_rep) \
	X(KB_CODES_GET, kb_codes_get, 0xCA, WIRE_SUBS(12, 19), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_BARE, kb_option_req, kb_codes_rep) \
	X(KB_STATUS, kb_status, 0xCA, WIRE_SUB(20), WIRE_READ, WIRE_ALWAYS, WIRE_BARE, \
	  kb_status_req, kb_status_rep) \
	X(KB_UP_CODES_SET, kb_up_codes_set, 0xCA, WIRE_SUBS(22, 29), WIRE_WRITE, WIRE_ALWAYS, \
	  WIRE_BARE, kb_codes_set_req, kb_codes_rep) \
	X(KB_UP_CODES_GET, kb_up_codes_get, 0xCA, WIRE_SUBS(32, 39), WIRE_READ, WIRE_ALWAYS, \
	  WIRE_BARE, kb_option_req, kb_codes_rep) \
	X(KB_SCAN, kb_scan, 0xCA, WIRE_SUB(50), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  kb_scan_req, kb_scan_rep) \
	X(LCD_CONFIG, lcd_config, 0xD0, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_EQ(2, 0), 0, \
	  lcd_config_req, lcd_config_rep) \
	X(LCD_INIT, lcd_init, 0xD1, WIRE_SUB(0x00), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  nothing, nothing) \
	X(LCD_CLEAR, lcd_clear, 0xD1, WIRE_SUB(0x10), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  nothing, nothing) \
	X(LCD_CURSOR, lcd_cursor, 0xD1, WIRE_SUB(0x20), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_cursor_req, nothing) \
	/* a: text goes where the cursor stands, and moves it */ \
	X(LCD_PRINT, lcd_print, 0xD1, WIRE_SUB(0x30), WIRE_ONE_SHOT, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_print_req, nothing) \
	X(LCD_CHAR, lcd_char, 0xD1, WIRE_SUB(0x31), WIRE_ONE_SHOT, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_char_req, nothing) \
	X(LCD_CUSTOM, lcd_custom, 0xD1, WIRE_SUB(0x40), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_custom_req, nothing) \
	X(LCD_ENTRY, lcd_entry, 0xD1, WIRE_SUB(0x50), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_entry_req, nothing) \
	X(LCD_DISPLAY, lcd_display, 0xD1, WIRE_SUB(0x60), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_display_req, nothing) \
	X(LCD_COMMAND, lcd_command, 0xD1, WIRE_SUB(0x61), WIRE_ONE_SHOT, WIRE_ALWAYS, \
	  WIRE_BARE, lcd_byte_req, nothing) \
	X(LCD_DATA, lcd_data, 0xD1, WIRE_SUB(0x62), WIRE_ONE_SHOT, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_byte_req, nothing) \
	X(LCD_MODE, lcd_mode, 0xD1, WIRE_SUB(0x80), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_byte_req, nothing) \
	X(LCD_ROW, lcd_row, 0xD1, WIRE_SUB(0x85), WIRE_WRITE, WIRE_ALWAYS, WIRE_BARE, \
	  lcd_row_req, nothing) \
	X(LED_CONFIG, led_config, 0xD5, WIRE_NO_SUB, WIRE_WRITE, WIRE_IF_EQ(2, 0), 0, \
	  led_config_req, led_config_rep) \
	X(LED_UPDATE, led_update, 0xD6, WIRE_NO_SUB, WIRE_WRITE, WIRE_ALWAYS, 0, \
	  led_update_req, nothing)

#define WIRE_OPS(X) \
	WIRE_OPS_SYSTEM(X) \
	WIRE_OPS_IO(X) \
	WIRE_OPS_ENCODER(X) \
	WIRE_OPS_PULSE(X) \
	WIRE_OPS_BUS(X) \
	WIRE_OPS_PANEL(X)

#endif
