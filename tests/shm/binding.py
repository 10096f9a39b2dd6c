# SPDX-License-Identifier: GPL-2.0-or-later
"""The images as Python sees them, written down by hand, and the library over ctypes: for tests.

It is independent of the tables that python/pokeys is generated from. shm / layout in Python
compares it with the C headers, member for member; system / settings commands through it.
"""
import ctypes
from ctypes import (POINTER, Structure, byref, c_char, c_char_p, c_double, c_float, c_int, c_int32,
                    c_int16, c_int64, c_size_t, c_uint, c_uint8, c_uint16, c_uint32, c_uint64, c_void_p)
import errno
import os
import time

PINS, ANALOG, ENCODERS, PWM, AXES, PONET, HEATERS, SERVOS = 55, 7, 26, 6, 8, 16, 7, 6
COMMANDER, EVENTS = 1, 2
DETACHED, ATTACHED, REFUSED = 0, 1, 2
NAME_MAX = 32


class Identity(Structure):
    _fields_ = [("serial", c_uint32), ("address", c_uint32), ("hardware", c_uint8),
                ("firmware_major", c_uint8), ("firmware_minor", c_uint8),
                ("firmware_revision", c_uint8), ("user_id", c_uint8), ("locked", c_uint8),
                ("load", c_uint8), ("options", c_uint8), ("name", c_char * 24),
                ("type", c_char * 24), ("build", c_char * 16)]


class Capability(Structure):
    _fields_ = [(name, c_uint8) for name in (
        "pins pwm basic_encoders encoders fast_encoders ultra_fast_encoders analog_inputs "
        "digital_counters matrix_keyboard lcd matrix_led poextbus ponet i2c one_wire "
        "easy_sensors pulse_engine failsafe axes axis_khz key_mapping triggered_key_mapping "
        "key_repeat_delay joystick macros analog_filtering init_outputs connection_signal "
        "web_interface additional_options load_status custom_name sensor_list potlog27"
    ).split()] + [("reserved", c_uint8 * 6), ("pwm_hz", c_uint32), ("reserved2", c_uint32),
                  ("digital_in", c_uint64), ("digital_out", c_uint64), ("analog_in", c_uint64),
                  ("counter", c_uint64), ("pwm_pins", c_uint64)]


class Axis(Structure):
    _fields_ = [("position", c_int32), ("reference", c_int32), ("state", c_uint8),
                ("enabled", c_uint8), ("mode", c_uint8), ("position_epoch", c_uint8),
                ("limit_minus", c_uint8), ("limit_plus", c_uint8), ("home", c_uint8),
                ("error", c_uint8), ("soft_limit", c_uint8), ("in_position", c_uint8),
                ("homed", c_uint8), ("parked", c_uint8), ("following_error", c_int32), ("delayed", c_int32), ("reserved", c_uint8 * 4),
                ("t_reference_ns", c_uint64),
                ("probe", c_int64), ("max_speed", c_float), ("max_acceleration", c_float),
                ("soft_minimum", c_int32), ("soft_maximum", c_int32), ("pulses_per_unit", c_double),
                ("name", c_char * 16)]


class Engine(Structure):
    _fields_ = [(name, c_uint8) for name in (
        "state axes_enabled activated limit_override emergency charge_pump generator "
        "misc_inputs relays outputs buffer_slots buffer_level power_states probe_status slot_time emergency_invert emergency_pin dedicated_limit_minus "
        "dedicated_limit_plus dedicated_home limit_minus limit_plus home stops "
        "task task_phase task_result task_axes"
    ).split()] + [("task_count", c_uint32), ("buffer_underruns", c_uint32),
                  ("buffer_resyncs", c_uint32), ("axis", Axis * AXES)]


class Threading(Structure):
    _fields_ = [(name, c_uint8) for name in (
        "preparing prepared waiting active ignore_axes refused").split()] + [
        ("behind", c_uint16), ("velocity", c_int32), ("position_error", c_int32),
        ("spindle_rpm", c_uint32), ("index_count", c_uint32)]


class Postep(Structure):
    _fields_ = [("t_update_ns", c_uint64), ("update_count", c_uint32)] + [
        (name, c_uint8) for name in (
            "supply temperature inputs state faults updates mode step_mode temperature_limit "
            "hardware_major hardware_minor firmware_major firmware_minor reserved").split()] + [
        ("full_scale", c_uint16), ("idle", c_uint16), ("overheat", c_uint16)]


class Rtc(Structure):
    _fields_ = [("year", c_uint16), ("month", c_uint8), ("day", c_uint8), ("hour", c_uint8),
                ("minute", c_uint8), ("second", c_uint8), ("day_of_week", c_uint8),
                ("day_of_year", c_uint16), ("unnamed", c_uint8), ("reserved", c_uint8 * 5)]


class PonetModule(Structure):
    _fields_ = [(name, c_uint8) for name in (
        "type address size options status light version failures"
    ).split()] + [("data", c_uint8 * 16)]


class LinkStatistics(Structure):
    _fields_ = [(name, c_uint64) for name in (
        "sent resent received accepted missed late lost timed_out stray duplicate stale corrupt "
        "wrong_source send_failed cycles_late reconnects"
    ).split()] + [(name, c_uint32) for name in (
        "rtt_last_ns rtt_smoothed_ns rtt_variation_ns rtt_min_ns rtt_max_ns deadline_ns "
        "in_flight packet_error_level"
    ).split()] + [("refused_command", c_uint64), ("one_shot_refused", c_uint64)]


class OneShotResult(Structure):
    _fields_ = [("id", c_uint32), ("operation", c_uint8), ("outcome", c_uint8),
                ("reserved", c_uint8 * 2)]


class Phase(Structure):
    _fields_ = [("state", c_uint8), ("master", c_uint8), ("reserved", c_uint8 * 2),
                ("losses", c_uint32), ("error_ns", c_int32), ("lead_ns", c_uint32),
                ("jitter_ns", c_uint32), ("period_ns", c_uint32)]


class Heater(Structure):
    _fields_ = [("t_ns", c_uint64)] + [(name, c_float) for name in (
        "temperature target power minimum maximum target_maximum p i d tuned_p tuned_i tuned_d"
    ).split()] + [("fault_count", c_uint32), ("tune_cycles", c_uint16)] + [
        (name, c_uint8) for name in "state fault condition refused tuning at_temperature limited fan stops_machine obstacle".split()] + [
        ("name", c_char * 32)]


class Servo(Structure):
    _fields_ = [("t_ns", c_uint64)] + [(name, c_double) for name in "position commanded counts_per_unit".split()] + [
        (name, c_float) for name in (
            "velocity commanded_velocity error output minimum maximum p i d velocity_gain acceleration_gain max_speed "
            "max_acceleration").split()] + [
        ("fault_count", c_uint32)] + [
        (name, c_uint8) for name in ("state fault condition refused homed low high encoder obstacle homing home_end home tuning "
                                     "tune_reason").split()] + [("reserved", c_uint8 * 2)] + [
        (name, c_float) for name in (
            "tuned_p tuned_i tuned_d tuned_velocity_gain tuned_acceleration_gain tuned_acceleration").split()] + [
        ("name", c_char * 32)]


class Moves(Structure):
    _fields_ = [("taken", c_uint32), ("feed", c_float), ("speed", c_float)] + [
        (name, c_uint8) for name in "waiting motors state end refused held axes".split()] + [("reserved", c_uint8 * 5)]


class State(Structure):
    VERSION, HASH = 22, 0xffba3099fa38976e
    _fields_ = [("magic", c_uint32), ("version", c_uint16), ("size_units", c_uint16),
                ("hash", c_uint64)] + [(name, c_uint64) for name in (
        "epoch cycle period_ns t_cycle_ns t_publish_ns t_digital_ns t_analog_ns t_encoder_ns "
        "t_motion_ns t_slow_ns t_analog_slow_ns stale_after_ns").split()] + [
        ("flags", c_uint32), ("link", c_uint8), ("fault", c_uint8), ("access", c_uint8),
        ("failsafe", c_uint8),
        ("t_link_ns", c_uint64), ("device_tick_ms", c_uint32), ("fault_count", c_uint32),
        ("identity", Identity), ("capability", Capability), ("digital_in", c_uint8 * 8),
        ("digital_out", c_uint8 * 8), ("digital_out_owned", c_uint8 * 8),
        ("pin_function", c_uint8 * 56), ("analog", c_uint16 * 8),
        ("encoder", c_int32 * ENCODERS), ("encoder_enabled", c_uint32),
        ("encoder_index", c_uint32), ("encoder_t_ns", c_uint64 * ENCODERS),
        ("encoder_resync", c_uint32 * ENCODERS), ("counter", c_uint32 * 56),
        ("pwm_period", c_uint32), ("pwm_enabled", c_uint32), ("pwm_duty", c_uint32 * PWM),
        ("engine", Engine), ("matrix", c_uint8 * 16), ("poextbus", c_uint8 * 16),
        ("ponet_state", c_uint8), ("ponet_count", c_uint8), ("kbd48_module", c_uint8),
        ("matrix_enabled", c_uint8), ("reserved2", c_uint8 * 4), ("kbd48_keys", c_uint64),
        ("ponet", PonetModule * PONET), ("slow_millihertz", c_uint32 * 20), ("rtc", Rtc), ("one_shot_session", c_uint32),
        ("one_shot_ack", c_uint32), ("one_shot", OneShotResult * 16),
        ("command_heartbeat", c_uint64), ("command_t_ns", c_uint64),
        ("config_generation", c_uint32), ("config_state", c_uint8),
        ("encoder_epoch", c_uint8), ("reserved3", c_uint8 * 2), ("report_count", c_uint32),
        ("config_foreign", c_uint32), ("phase", Phase),
        ("t_postep_ns", c_uint64), ("backlash", c_int16 * AXES), ("threading", Threading),
        ("postep", Postep * AXES),
        ("statistics", LinkStatistics), ("heater", Heater * HEATERS), ("servo", Servo * SERVOS),
        ("moves", Moves)]


class Histogram(Structure):
    _fields_ = [("count", c_uint64), ("sum_ns", c_uint64), ("min_ns", c_uint64),
                ("max_ns", c_uint64), ("bucket", c_uint64 * 104)]


class Diag(Structure):
    VERSION, HASH = 5, 0x043bbadfaaa1ea0e
    _fields_ = [("magic", c_uint32), ("version", c_uint16), ("size_units", c_uint16),
                ("hash", c_uint64)] + [(name, c_uint64) for name in (
        "epoch cycle t_publish_ns cycles_skipped events_dropped event_high_water "
        "transport_system_calls transport_waits_avoided transport_rearmed "
        "transport_no_buffers transport_overflow transport_truncated minor_faults "
        "major_faults guard_passed guard_dropped").split()] + [("transport", c_char * 16)] + [(name, Histogram) for name in (
        "wakeup round_trip fast_round_trip read_round_trip write_round_trip one_shot_round_trip "
        "receive fresh publish cycle_work age_at_read").split()]


class AxisCommand(Structure):
    _fields_ = [("position", c_int32), ("velocity", c_float), ("mode", c_uint8),
                ("enable", c_uint8), ("reserved", c_uint8 * 6)]


class ServoCommand(Structure):
    _fields_ = [("position", c_double), ("velocity", c_float), ("enable", c_uint8), ("reserved", c_uint8 * 3)]


class OneShot(Structure):
    _fields_ = [("id", c_uint32), ("operation", c_uint8), ("index", c_uint8), ("mask", c_uint8),
                ("flags", c_uint8), ("value", c_int32 * 8), ("parameter", c_float * 4),
                ("fraction", c_uint8 * 8)]


class Command(Structure):
    VERSION, HASH = 4, 0xc06793d84e920364
    _fields_ = [("magic", c_uint32), ("version", c_uint16), ("size_units", c_uint16),
                ("hash", c_uint64), ("heartbeat", c_uint64), ("t_ns", c_uint64),
                ("t_thread_ns", c_uint64), ("period_ns", c_uint64), ("session", c_uint32),
                ("flags", c_uint32), ("read_age_ns", c_uint32 * 16), ("digital_out", c_uint8 * 8),
                ("digital_out_mask", c_uint8 * 8), ("pwm_duty", c_uint32 * PWM),
                ("pwm_period", c_uint32), ("pwm_enable", c_uint32), ("poextbus", c_uint8 * 16),
                ("poextbus_mask", c_uint8 * 16), ("external_outputs", c_uint8),
                ("external_outputs_mask", c_uint8), ("relays", c_uint8),
                ("relays_mask", c_uint8), ("reserved", c_uint32),
                ("ponet_data", (c_uint8 * 16) * PONET), ("ponet_brightness", c_uint8 * PONET),
                ("ponet_mask", c_uint32), ("kbd48_flags", c_uint8), ("kbd48_brightness", c_uint8),
                ("reserved3", c_uint8 * 2), ("kbd48_leds", c_uint64),
                ("axis", AxisCommand * AXES), ("heater_target", c_float * HEATERS),
                ("heater_mask", c_uint32), ("servo", ServoCommand * SERVOS), ("one_shot_head", c_uint32),
                ("reserved2", c_uint32), ("one_shot", OneShot * 64)]


class AxisSettings(Structure):
    _fields_ = [("set", c_uint32)] + [(name, c_uint8) for name in (
        "options options_mask switches switches_mask pin_limit_minus pin_limit_plus pin_home "
        "pin_enable invert_enable filter_limit_minus filter_limit_plus filter_home filter_probe "
        "homing_algorithm homing_speed homing_return mpg_encoder signals").split()] + [
        ("mpg_multiplier", c_int16), ("mpg_divider", c_uint16), ("backlash_half", c_uint16),
        ("soft_minimum", c_int32), ("soft_maximum", c_int32), ("back_off", c_int32),
        ("max_speed", c_float), ("max_acceleration", c_float), ("max_deceleration", c_float),
        *((name, c_uint8) for name in (
            "backlash_acceleration postep_type postep_address postep_step postep_temperature"
        ).split()), ("reserved", c_uint8 * 7)]


class EncoderSettings(Structure):
    _fields_ = [(name, c_uint8) for name in (
        "options options_mask pins_set pin_a pin_b").split()] + [("reserved", c_uint8 * 3)]


class Settings(Structure):
    _fields_ = [("set", c_uint32), ("pwm_period", c_uint32), ("pin_set", c_uint8 * 8),
                ("pin_function", c_uint8 * 56), ("encoder", EncoderSettings * 25),
                ("fast_configuration", c_uint8), ("fast_options", c_uint8),
                ("ultra_enable", c_uint8), ("ultra_options", c_uint8),
                ("ultra_filter", c_uint32)] + [(name, c_uint8) for name in (
        "axes charge_pump generator emergency_invert emergency_pin power_states "
        "poextbus_connector poextbus_no_crc failsafe_timeout failsafe_peripherals"
    ).split()] + [("failsafe_outputs", c_uint8 * 8), ("failsafe_poextbus", c_uint8 * 10),
                  ("failsafe_pwm", c_uint8 * PWM), ("matrix_enable", c_uint8),
                  ("matrix_rows", c_uint8), ("matrix_columns", c_uint8),
                  ("matrix_row_pin", c_uint8 * 16), ("matrix_column_pin", c_uint8 * 8),
                  ("reserved", c_uint8 * 7), ("analog_filter", c_uint32), ("name", c_char * 24),
                  *((name, c_uint8) for name in (
                      "backlash_enable backlash_speed postep_enable sync_pwm_enable "
                      "sync_pwm_axis sync_pwm_channel sync_out_enable sync_out_axis").split()),
                  ("sync_out_pin", c_uint8 * 8), ("threading_mode", c_uint8),
                  ("threading_ignore", c_uint8), ("threading_ticks", c_uint16),
                  ("threading_rpm", c_uint16), ("threading_speed_gain", c_uint16),
                  ("threading_position_gain", c_uint16), ("reserved2", c_uint8 * 6),
                  ("axis", AxisSettings * AXES)]


class Wish(Structure):
    VERSION, HASH = 2, 0x90bba2dde6674bea
    _fields_ = [("magic", c_uint32), ("version", c_uint16), ("size_units", c_uint16),
                ("hash", c_uint64), ("session", c_uint32), ("generation", c_uint32),
                ("settings", Settings)]


class Report(Structure):
    VERSION, HASH = 2, 0x27bb31d594bd80c8
    _fields_ = [("magic", c_uint32), ("version", c_uint16), ("size_units", c_uint16),
                ("hash", c_uint64), ("epoch", c_uint64), ("t_publish_ns", c_uint64),
                ("count", c_uint32), ("generation", c_uint32), ("state", c_uint8),
                ("refused", c_uint8), ("refused_index", c_uint8), ("reserved", c_uint8 * 5),
                ("device", Settings), ("wanted", Settings)]


def _element(kind):
    """The type that an array (of arrays) is made of."""
    while issubclass(kind, ctypes.Array):
        kind = kind._type_
    return kind


def text(image):
    """What the layout's hash is made of, see state.h."""
    out = ""
    for name, kind in image._fields_:
        out += f"{name}:{getattr(image, name).offset}:{getattr(image, name).size};"
        if issubclass(_element(kind), Structure):
            out += "{" + text(_element(kind)) + "}"
    return out


def fnv1a(string):
    value = 0xcbf29ce484222325
    for byte in string.encode():
        value = (value ^ byte) * 0x100000001b3 & 0xffffffffffffffff
    return value


class LibraryMissing(RuntimeError):
    """libpokeys_shm.so.0 is not to be had; the text is one line for a person."""


def _load():
    name = os.environ.get("POKEYS_SHM_LIBRARY", "libpokeys_shm.so.0")
    try:
        library = ctypes.CDLL(name)
    except OSError as error:
        raise LibraryMissing(f"{error}; install pokeysd, or let POKEYS_SHM_LIBRARY name the file "
                             "(build/shm/libpokeys_shm.so.0 of a build)") from None
    prototypes = {
        "pokeys_client_open": [POINTER(c_void_p), c_char_p, c_char_p, c_char_p, c_uint],
        "pokeys_client_close": [c_void_p],
        "pokeys_client_poll": [c_void_p],
        "pokeys_client_follow": [c_void_p, c_uint],
        "pokeys_client_status": [c_void_p, c_char_p, c_size_t],
        "pokeys_client_read": [c_void_p, POINTER(State)],
        "pokeys_client_read_diag": [c_void_p, POINTER(Diag)],
        "pokeys_client_read_report": [c_void_p, POINTER(Report)],
        "pokeys_client_write": [c_void_p, POINTER(Command)],
        "pokeys_client_write_wish": [c_void_p, POINTER(Wish)],
        "pokeys_client_wait": [c_void_p, c_uint],
        "pokeys_client_commanders": [c_void_p],
        "pokeys_shm_devices": [c_char_p, c_void_p, c_size_t],
    }
    for name, arguments in prototypes.items():
        function = getattr(library, name)
        function.argtypes, function.restype = arguments, c_int
    library.pokeys_client_close.restype = None
    library.pokeys_shm_layout.argtypes = [c_uint]
    library.pokeys_shm_layout.restype = c_uint64
    for number, image in enumerate((State, Diag, Command, Report, Wish)):
        if library.pokeys_shm_layout(number) != image.HASH:
            raise RuntimeError(f"libpokeys_shm.so has another layout of {image.__name__}; "
                               "mend this file")
    return library


_library = None


def library():
    """The shared library, loaded once. POKEYS_SHM_LIBRARY names another file."""
    global _library
    _library = _library or _load()
    return _library


def _check(result):
    if result < 0:
        raise OSError(-result, os.strerror(-result))
    return result


class Client:
    """One device. May be made before the daemon runs, and survives it."""

    def __init__(self, device, runtime=None, program="python", flags=0):
        self._client = c_void_p()
        _check(library().pokeys_client_open(byref(self._client), runtime and runtime.encode(),
                                            device.encode(), program.encode(), flags))

    def close(self):
        library().pokeys_client_close(self._client)
        self._client = c_void_p()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()

    def poll(self):
        """Look for the daemon: DETACHED, ATTACHED or REFUSED."""
        return library().pokeys_client_poll(self._client)

    def status(self):
        why = ctypes.create_string_buffer(256)
        return library().pokeys_client_status(self._client, why, len(why)), why.value.decode()

    def _read(self, function, image):
        result = function(self._client, byref(image))
        if result == -errno.ENOTCONN:
            return None
        _check(result)
        return image

    def read(self):
        """The newest state, or None while no daemon is there."""
        return self._read(library().pokeys_client_read, State())

    def read_diag(self):
        return self._read(library().pokeys_client_read_diag, Diag())

    def read_report(self):
        """The device's settings, as they are and as they are wanted."""
        return self._read(library().pokeys_client_read_report, Report())

    def _write(self, function, image):
        result = function(self._client, byref(image))
        if result == -errno.ENOTCONN:
            return False
        _check(result)
        return True

    def write(self, command):
        """Overwrite the command image (flags=COMMANDER). False if there is no daemon."""
        return self._write(library().pokeys_client_write, command)

    def write_wish(self, wish):
        """Overwrite the wish for settings (flags=COMMANDER). False if there is no daemon."""
        return self._write(library().pokeys_client_write_wish, wish)

    def wait(self, timeout_ms):
        """Wait for news (flags=EVENTS). True if some came."""
        result = library().pokeys_client_wait(self._client, timeout_ms)
        if result == -errno.ENOTCONN:
            time.sleep(timeout_ms / 1000)
            return False
        return bool(_check(result))

    def commanders(self):
        return _check(library().pokeys_client_commanders(self._client))
