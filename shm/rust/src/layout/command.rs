// SPDX-License-Identifier: MIT
//! include/pokeys/command.h, member for member.

use super::*;

const PIN_BYTES: usize = 8;
const PWM: usize = 6;
const AXES: usize = 8;
const PONET: usize = 16;
const ONE_SHOTS: usize = 64;
const READ_AGES: usize = 16;
const HEATERS: usize = 7;
const SERVOS: usize = 6;

layout! {
    PokeysAxisCommand {
        position: i32,
        velocity: f32,
        mode: u8,
        enable: u8,
        reserved: [u8; 6],
    }
}

layout! {
    PokeysServoCommand {
        position: f64,
        velocity: f32,
        enable: u8,
        reserved: [u8; 3],
    }
}

layout! {
    PokeysOneShot {
        id: u32,
        operation: u8,
        index: u8,
        mask: u8,
        flags: u8,
        value: [i32; 8],
        parameter: [f32; 4],
        fraction: [u8; 8],
    }
}

layout! {
    #[repr(align(8))]
    PokeysCommand {
        magic: u32,
        version: u16,
        size_units: u16,
        hash: u64,
        heartbeat: u64,
        t_ns: u64,
        t_thread_ns: u64,
        period_ns: u64,
        session: u32,
        flags: u32,
        read_age_ns: [u32; READ_AGES],
        digital_out: [u8; PIN_BYTES],
        digital_out_mask: [u8; PIN_BYTES],
        pwm_duty: [u32; PWM],
        pwm_period: u32,
        pwm_enable: u32,
        poextbus: [u8; 16],
        poextbus_mask: [u8; 16],
        external_outputs: u8,
        external_outputs_mask: u8,
        relays: u8,
        relays_mask: u8,
        reserved: u32,
        ponet_data: [[u8; 16]; PONET],
        ponet_brightness: [u8; PONET],
        ponet_mask: u32,
        kbd48_flags: u8,
        kbd48_brightness: u8,
        reserved3: [u8; 2],
        kbd48_leds: u64,
        axis: [PokeysAxisCommand; AXES],
        heater_target: [f32; HEATERS],
        heater_mask: u32,
        servo: [PokeysServoCommand; SERVOS],
        one_shot_head: u32,
        reserved2: u32,
        one_shot: [PokeysOneShot; ONE_SHOTS],
    }
}

published! {
    PokeysCommand, "command", magic 0x4d43_4b50, version 6, size 4856,
    hash 0xc06793d84e920364, hash_function iox_command_hash
}
