// SPDX-License-Identifier: MIT
//! include/pokeys/settings.h, member for member.

use super::*;

const PIN_BYTES: usize = 8;
const PINS: usize = 56;
const ENCODERS: usize = 25;
const PWM: usize = 6;
const POEXTBUS: usize = 10;
const AXES: usize = 8;

layout! {
    PokeysAxisSettings {
        set: u32,
        options: u8,
        options_mask: u8,
        switches: u8,
        switches_mask: u8,
        pin_limit_minus: u8,
        pin_limit_plus: u8,
        pin_home: u8,
        pin_enable: u8,
        invert_enable: u8,
        filter_limit_minus: u8,
        filter_limit_plus: u8,
        filter_home: u8,
        filter_probe: u8,
        homing_algorithm: u8,
        homing_speed: u8,
        homing_return: u8,
        mpg_encoder: u8,
        signals: u8,
        mpg_multiplier: i16,
        mpg_divider: u16,
        backlash_half: u16,
        soft_minimum: i32,
        soft_maximum: i32,
        back_off: i32,
        max_speed: f32,
        max_acceleration: f32,
        max_deceleration: f32,
        backlash_acceleration: u8,
        postep_type: u8,
        postep_address: u8,
        postep_step: u8,
        postep_temperature: u8,
        reserved: [u8; 7],
    }
}

layout! {
    PokeysEncoderSettings {
        options: u8,
        options_mask: u8,
        pins_set: u8,
        pin_a: u8,
        pin_b: u8,
        reserved: [u8; 3],
    }
}

layout! {
    PokeysSettings {
        set: u32,
        pwm_period: u32,
        pin_set: [u8; PIN_BYTES],
        pin_function: [u8; PINS],
        encoder: [PokeysEncoderSettings; ENCODERS],
        fast_configuration: u8,
        fast_options: u8,
        ultra_enable: u8,
        ultra_options: u8,
        ultra_filter: u32,
        axes: u8,
        charge_pump: u8,
        generator: u8,
        emergency_invert: u8,
        emergency_pin: u8,
        power_states: u8,
        poextbus_connector: u8,
        poextbus_no_crc: u8,
        failsafe_timeout: u8,
        failsafe_peripherals: u8,
        failsafe_outputs: [u8; PIN_BYTES],
        failsafe_poextbus: [u8; POEXTBUS],
        failsafe_pwm: [u8; PWM],
        matrix_enable: u8,
        matrix_rows: u8,
        matrix_columns: u8,
        matrix_row_pin: [u8; 16],
        matrix_column_pin: [u8; 8],
        reserved: [u8; 7],
        analog_filter: u32,
        name: [u8; 24],
        backlash_enable: u8,
        backlash_speed: u8,
        postep_enable: u8,
        sync_pwm_enable: u8,
        sync_pwm_axis: u8,
        sync_pwm_channel: u8,
        sync_out_enable: u8,
        sync_out_axis: u8,
        sync_out_pin: [u8; 8],
        threading_mode: u8,
        threading_ignore: u8,
        threading_ticks: u16,
        threading_rpm: u16,
        threading_speed_gain: u16,
        threading_position_gain: u16,
        reserved2: [u8; 6],
        axis: [PokeysAxisSettings; AXES],
    }
}

layout! {
    #[repr(align(8))]
    PokeysWish {
        magic: u32,
        version: u16,
        size_units: u16,
        hash: u64,
        session: u32,
        generation: u32,
        settings: PokeysSettings,
    }
}

layout! {
    #[repr(align(8))]
    PokeysReport {
        magic: u32,
        version: u16,
        size_units: u16,
        hash: u64,
        epoch: u64,
        t_publish_ns: u64,
        count: u32,
        generation: u32,
        state: u8,
        refused: u8,
        refused_index: u8,
        reserved: [u8; 5],
        device: PokeysSettings,
        wanted: PokeysSettings,
    }
}

published! {
    PokeysWish, "wish", magic 0x4857_4b50, version 2, size 944,
    hash 0x90bba2dde6674bea, hash_function iox_wish_hash
}

published! {
    PokeysReport, "report", magic 0x5052_4b50, version 2, size 1888,
    hash 0x27bb31d594bd80c8, hash_function iox_report_hash
}
