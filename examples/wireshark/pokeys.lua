-- SPDX-License-Identifier: MIT
--
-- Names for PoKeys packets in Wireshark and tshark: operation, request id, and whether the
-- checksum is right; requests and replies lead to each other. Copy it into Wireshark's folder
-- of personal plugins (Help, About, Folders), or: tshark -X lua_script:pokeys.lua
--
-- The operations are those of the wire's table (wire/ops.h); a test compares them.

local pokeys = Proto("pokeys", "PoKeys Ethernet protocol")

local f = {
	kind = ProtoField.uint8("pokeys.kind", "Packet", base.HEX, { [0xbb] = "request", [0xaa] = "reply" }),
	operation = ProtoField.uint8("pokeys.operation", "Operation", base.HEX),
	name = ProtoField.string("pokeys.name", "Name"),
	parameters = ProtoField.bytes("pokeys.parameters", "Parameters"),
	id = ProtoField.uint8("pokeys.id", "Request id"),
	checksum = ProtoField.uint8("pokeys.checksum", "Checksum", base.HEX),
	good = ProtoField.bool("pokeys.checksum.good", "Checksum is right"),
	payload = ProtoField.bytes("pokeys.payload", "Payload"),
	answer = ProtoField.framenum("pokeys.reply_in", "Answered in", base.NONE, frametype.RESPONSE),
	question = ProtoField.framenum("pokeys.request_in", "Answers", base.NONE, frametype.REQUEST),
	time = ProtoField.double("pokeys.round_trip_us", "Round trip, us"),
}
pokeys.fields = { f.kind, f.operation, f.name, f.parameters, f.id, f.checksum, f.good, f.payload, f.answer,
	f.question, f.time }

-- operation, first and last sub-operation, name
local operations = {
	{ 0x00, 0x00, 0xff, "device_data" },
	{ 0x02, 0x00, 0xff, "set_user_id" },
	{ 0x03, 0x00, 0xff, "user_id" },
	{ 0x04, 0x00, 0xff, "build_date" },
	{ 0x05, 0x00, 0xff, "system_load" },
	{ 0x06, 0x00, 0xff, "device_name" },
	{ 0x07, 0x00, 0xff, "usb_interface" },
	{ 0x08, 0x00, 0xff, "delayed_start" },
	{ 0x0a, 0x00, 0xff, "session_data" },
	{ 0x0b, 0x00, 0xff, "misc_usb" },
	{ 0x1b, 0x00, 0xff, "connection_signal" },
	{ 0x1e, 0x00, 0xff, "startup_outputs" },
	{ 0x50, 0x00, 0xff, "save" },
	{ 0x51, 0x00, 0xff, "save_lock" },
	{ 0x52, 0x00, 0xff, "reset_config" },
	{ 0x81, 0x00, 0xff, "failsafe" },
	{ 0x83, 0x00, 0xff, "rtc" },
	{ 0x84, 0x00, 0xff, "system_log" },
	{ 0x8f, 0x00, 0xff, "options" },
	{ 0xcf, 0x00, 0xff, "tick" },
	{ 0xe0, 0x00, 0xff, "network" },
	{ 0xe1, 0x00, 0xff, "security" },
	{ 0xe2, 0x00, 0xff, "authorise" },
	{ 0xe3, 0x00, 0xff, "password" },
	{ 0xf3, 0x00, 0xff, "reboot" },
	{ 0x10, 0x00, 0xff, "pin_set" },
	{ 0x15, 0x00, 0xff, "pin_get" },
	{ 0x1d, 0x00, 0xff, "counter_reset" },
	{ 0x1f, 0x00, 0xff, "pin_caps" },
	{ 0x30, 0x00, 0xff, "input" },
	{ 0x31, 0x00, 0xff, "inputs_low" },
	{ 0x32, 0x00, 0xff, "inputs_high" },
	{ 0x35, 0x00, 0xff, "analog_one" },
	{ 0x36, 0x00, 0xff, "analog_4x8" },
	{ 0x37, 0x00, 0xff, "analog_3x10" },
	{ 0x38, 0x00, 0xff, "filter_get" },
	{ 0x39, 0x00, 0xff, "filter_set" },
	{ 0x3a, 0x00, 0xff, "analog" },
	{ 0x40, 0x00, 0xff, "output" },
	{ 0x41, 0x00, 0xff, "analog_out" },
	{ 0x42, 0x00, 0xff, "outputs_low" },
	{ 0x43, 0x00, 0xff, "outputs_high" },
	{ 0xc0, 0x00, 0xff, "pin_all" },
	{ 0xc1, 0x00, 0xff, "key_map" },
	{ 0xc2, 0x00, 0xff, "key_codes" },
	{ 0xc3, 0x00, 0xff, "key_modifiers" },
	{ 0xcb, 0x00, 0xff, "pwm" },
	{ 0xcc, 0x00, 0xff, "io" },
	{ 0xd7, 0x00, 0xff, "key_triggered" },
	{ 0xd8, 0x00, 0xff, "counters" },
	{ 0xd9, 0x00, 0xff, "counter_dirs" },
	{ 0x11, 0x00, 0xff, "encoder_set" },
	{ 0x16, 0x00, 0xff, "encoder_get" },
	{ 0x19, 0x00, 0xff, "encoder_raw" },
	{ 0x1a, 0x00, 0xff, "encoder_raw_reset" },
	{ 0x1c, 0x00, 0xff, "ultra_encoder" },
	{ 0x85, 0x37, 0x37, "ultra_test" },
	{ 0xc4, 0x00, 0xff, "encoder_options" },
	{ 0xc5, 0x00, 0xff, "encoder_pins" },
	{ 0xc6, 0x00, 0xff, "encoder_keys_a" },
	{ 0xc7, 0x00, 0xff, "encoder_keys_b" },
	{ 0xcd, 0x00, 0xff, "encoders" },
	{ 0xce, 0x00, 0xff, "fast_encoders" },
	{ 0x85, 0x00, 0x00, "pulse_status" },
	{ 0x85, 0x01, 0x01, "pulse_setup" },
	{ 0x85, 0x02, 0x02, "pulse_state" },
	{ 0x85, 0x03, 0x03, "pulse_positions" },
	{ 0x85, 0x04, 0x04, "pulse_outputs" },
	{ 0x85, 0x05, 0x05, "pulse_reboot" },
	{ 0x85, 0x06, 0x06, "pulse_emergency" },
	{ 0x85, 0x08, 0x08, "pulse_status2" },
	{ 0x85, 0x0a, 0x0a, "pulse_sync_pwm" },
	{ 0x85, 0x0b, 0x0b, "pulse_sync_outputs" },
	{ 0x85, 0x10, 0x10, "pulse_axis_get" },
	{ 0x85, 0x11, 0x11, "pulse_axis_set" },
	{ 0x85, 0x18, 0x18, "pulse_drivers_get" },
	{ 0x85, 0x19, 0x19, "pulse_drivers_set" },
	{ 0x85, 0x20, 0x20, "pulse_move" },
	{ 0x85, 0x25, 0x25, "pulse_move_pv" },
	{ 0x85, 0x21, 0x21, "pulse_home_start" },
	{ 0x85, 0x22, 0x22, "pulse_home_finish" },
	{ 0x85, 0x23, 0x23, "pulse_probe_start" },
	{ 0x85, 0x24, 0x24, "pulse_probe_finish" },
	{ 0x85, 0x30, 0x30, "thread_prepare" },
	{ 0x85, 0x31, 0x31, "thread_force" },
	{ 0x85, 0x32, 0x32, "thread_arm" },
	{ 0x85, 0x33, 0x33, "thread_release" },
	{ 0x85, 0x34, 0x34, "thread_cancel" },
	{ 0x85, 0x35, 0x35, "thread_status" },
	{ 0x85, 0x36, 0x36, "thread_params" },
	{ 0x85, 0x40, 0x40, "pulse_backlash_get" },
	{ 0x85, 0x41, 0x41, "pulse_backlash_set" },
	{ 0x85, 0x50, 0x50, "postep_comm" },
	{ 0x85, 0x51, 0x51, "postep_status" },
	{ 0x85, 0x52, 0x52, "postep_currents" },
	{ 0x85, 0x53, 0x53, "postep_modes" },
	{ 0x85, 0x54, 0x54, "postep_versions" },
	{ 0x85, 0x90, 0x90, "smart_get" },
	{ 0x85, 0x91, 0x91, "smart_set" },
	{ 0x85, 0x92, 0x92, "smart_reset" },
	{ 0x85, 0x95, 0x95, "smart_status" },
	{ 0x85, 0x96, 0x96, "smart_encoders" },
	{ 0x85, 0xf0, 0xf0, "pulse_buffer_clear" },
	{ 0x85, 0xfe, 0xfe, "pulse_fill16" },
	{ 0x85, 0xff, 0xff, "pulse_fill8" },
	{ 0xb0, 0x00, 0xff, "pulse_fill_part" },
	{ 0x76, 0x00, 0xff, "sensor_setup" },
	{ 0x77, 0x00, 0xff, "sensor_values" },
	{ 0x86, 0x01, 0x01, "can_setup" },
	{ 0x86, 0x10, 0x10, "can_filter" },
	{ 0x86, 0x20, 0x20, "can_send" },
	{ 0x86, 0x30, 0x30, "can_queue" },
	{ 0x86, 0x31, 0x31, "can_read" },
	{ 0x86, 0x32, 0x32, "can_flush" },
	{ 0xda, 0x00, 0xff, "poextbus" },
	{ 0xdb, 0x00, 0x02, "i2c_activate" },
	{ 0xdb, 0x10, 0x10, "i2c_write" },
	{ 0xdb, 0x11, 0x11, "i2c_write_result" },
	{ 0xdb, 0x20, 0x20, "i2c_read" },
	{ 0xdb, 0x21, 0x21, "i2c_read_result" },
	{ 0xdb, 0x30, 0x30, "i2c_scan" },
	{ 0xdb, 0x31, 0x31, "i2c_scan_result" },
	{ 0xdc, 0x00, 0x02, "onewire_state" },
	{ 0xdc, 0x10, 0x10, "onewire_start" },
	{ 0xdc, 0x11, 0x11, "onewire_result" },
	{ 0xdc, 0x20, 0x20, "onewire_scan" },
	{ 0xdc, 0x21, 0x21, "onewire_scan_result" },
	{ 0xdc, 0x22, 0x22, "onewire_scan_next" },
	{ 0xdc, 0x23, 0x23, "onewire_scan_stop" },
	{ 0xdd, 0x00, 0x00, "ponet_status" },
	{ 0xdd, 0x10, 0x10, "ponet_settings" },
	{ 0xdd, 0x11, 0x11, "ponet_version" },
	{ 0xdd, 0x15, 0x15, "ponet_map" },
	{ 0xdd, 0x20, 0x20, "ponet_clear" },
	{ 0xdd, 0x21, 0x21, "ponet_reinit" },
	{ 0xdd, 0x25, 0x25, "ponet_reinit_clear" },
	{ 0xdd, 0x30, 0x30, "ponet_discovery" },
	{ 0xdd, 0x40, 0x40, "ponet_check" },
	{ 0xdd, 0x50, 0x50, "ponet_data" },
	{ 0xdd, 0x55, 0x55, "ponet_set_data" },
	{ 0xdd, 0x60, 0x60, "ponet_light" },
	{ 0xdd, 0x70, 0x70, "ponet_pwm" },
	{ 0xde, 0x10, 0x10, "uart_setup" },
	{ 0xde, 0x20, 0x20, "uart_send" },
	{ 0xde, 0x30, 0x30, "uart_read" },
	{ 0xe5, 0x01, 0x01, "spi_setup" },
	{ 0xe5, 0x10, 0x10, "spi_write" },
	{ 0xe5, 0x20, 0x20, "spi_read" },
	{ 0xe6, 0x00, 0x00, "pocan_status" },
	{ 0xe6, 0x01, 0x01, "pocan_enable" },
	{ 0xe6, 0x02, 0x02, "pocan_require" },
	{ 0x4b, 0x10, 0x10, "strip_data" },
	{ 0xca, 0x01, 0x01, "kb_config_set" },
	{ 0xca, 0x02, 0x09, "kb_codes_set" },
	{ 0xca, 0x0a, 0x0b, "kb_config_get" },
	{ 0xca, 0x0c, 0x13, "kb_codes_get" },
	{ 0xca, 0x14, 0x14, "kb_status" },
	{ 0xca, 0x16, 0x1d, "kb_up_codes_set" },
	{ 0xca, 0x20, 0x27, "kb_up_codes_get" },
	{ 0xca, 0x32, 0x32, "kb_scan" },
	{ 0xd0, 0x00, 0xff, "lcd_config" },
	{ 0xd1, 0x00, 0x00, "lcd_init" },
	{ 0xd1, 0x10, 0x10, "lcd_clear" },
	{ 0xd1, 0x20, 0x20, "lcd_cursor" },
	{ 0xd1, 0x30, 0x30, "lcd_print" },
	{ 0xd1, 0x31, 0x31, "lcd_char" },
	{ 0xd1, 0x40, 0x40, "lcd_custom" },
	{ 0xd1, 0x50, 0x50, "lcd_entry" },
	{ 0xd1, 0x60, 0x60, "lcd_display" },
	{ 0xd1, 0x61, 0x61, "lcd_command" },
	{ 0xd1, 0x62, 0x62, "lcd_data" },
	{ 0xd1, 0x80, 0x80, "lcd_mode" },
	{ 0xd1, 0x85, 0x85, "lcd_row" },
	{ 0xd5, 0x00, 0xff, "led_config" },
	{ 0xd6, 0x00, 0xff, "led_update" },
}

local function name_of(operation, sub)
	for _, row in ipairs(operations) do
		if row[1] == operation and row[2] <= sub and sub <= row[3] then
			return row[4]
		end
	end
	return "unknown"
end

-- The newest request of each device and id while the file is read the first time; then by frame.
local newest, answer_of, question_of = {}, {}, {}

function pokeys.init()
	newest, answer_of, question_of = {}, {}, {}
end

local function key_of(pinfo, device, port, id)
	return tostring(device) .. ":" .. port .. "/" .. id
end

local function find_other(buffer, pinfo, request)
	local id, operation = buffer(6, 1):uint(), buffer(1, 1):uint()
	if request then
		newest[key_of(pinfo, pinfo.dst, pinfo.dst_port, id)] =
			{ frame = pinfo.number, operation = operation, sub = buffer(2, 1):uint(), t = pinfo.abs_ts }
		return
	end
	local key = key_of(pinfo, pinfo.src, pinfo.src_port, id)
	local asked = newest[key]
	if asked and asked.operation == operation then
		answer_of[asked.frame] = pinfo.number
		question_of[pinfo.number] = { frame = asked.frame, sub = asked.sub, us = (pinfo.abs_ts - asked.t) * 1e6 }
		newest[key] = nil
	end
end

local function sum_of(buffer)
	local sum = 0
	for i = 0, 6 do
		sum = sum + buffer(i, 1):uint()
	end
	return sum % 256
end

local function is_pokeys(buffer)
	if buffer:len() ~= 64 then
		return false
	end
	local kind = buffer(0, 1):uint()
	return kind == 0xbb or kind == 0xaa
end

function pokeys.dissector(buffer, pinfo, tree)
	if not is_pokeys(buffer) then
		return 0
	end
	local request = buffer(0, 1):uint() == 0xbb
	local sum = buffer(7, 1):uint()
	if not pinfo.visited then
		find_other(buffer, pinfo, request)
	end
	-- not every device puts the sub-operation into its reply
	local question = question_of[pinfo.number]
	local name = name_of(buffer(1, 1):uint(), question and question.sub or buffer(2, 1):uint())
	pinfo.cols.protocol = "PoKeys"
	pinfo.cols.info = string.format("%s %s, id %d", request and "request" or "reply", name,
		buffer(6, 1):uint())
	local branch = tree:add(pokeys, buffer(), "PoKeys " .. name)
	branch:add(f.kind, buffer(0, 1))
	branch:add(f.operation, buffer(1, 1))
	branch:add(f.name, buffer(1, 1), name)
	branch:add(f.parameters, buffer(2, 4))
	branch:add(f.id, buffer(6, 1))
	branch:add(f.checksum, buffer(7, 1))
	branch:add(f.good, buffer(7, 1), sum == sum_of(buffer))
	branch:add(f.payload, buffer(8))
	if answer_of[pinfo.number] then
		branch:add(f.answer, answer_of[pinfo.number]):set_generated()
	end
	if question then
		branch:add(f.question, question.frame):set_generated()
		branch:add(f.time, question.us):set_generated()
	end
	return 64
end

DissectorTable.get("udp.port"):add(20055, pokeys)
