// SPDX-License-Identifier: MIT
//! include/pokeys/state.h, member for member.

use super::*;

const PIN_BYTES: usize = 8;
const ENCODERS: usize = 26;
const PWM: usize = 6;
const AXES: usize = 8;
const HEATERS: usize = 7;
const SERVOS: usize = 6;
const PONET: usize = 16;
const MATRIX_BYTES: usize = 16;
const SLOW_GROUPS: usize = 20;
const ONE_SHOT_RESULTS: usize = 16;
const HISTOGRAM_BUCKETS: usize = 104;

layout! {
    PokeysIdentity {
        serial: u32,
        address: u32,
        hardware: u8,
        firmware_major: u8,
        firmware_minor: u8,
        firmware_revision: u8,
        user_id: u8,
        locked: u8,
        load: u8,
        options: u8,
        name: [u8; 24],
        r#type: [u8; 24],
        build: [u8; 16],
    }
}

layout! {
    PokeysCapability {
        pins: u8,
        pwm: u8,
        basic_encoders: u8,
        encoders: u8,
        fast_encoders: u8,
        ultra_fast_encoders: u8,
        analog_inputs: u8,
        digital_counters: u8,
        matrix_keyboard: u8,
        lcd: u8,
        matrix_led: u8,
        poextbus: u8,
        ponet: u8,
        i2c: u8,
        one_wire: u8,
        easy_sensors: u8,
        pulse_engine: u8,
        failsafe: u8,
        axes: u8,
        axis_khz: u8,
        key_mapping: u8,
        triggered_key_mapping: u8,
        key_repeat_delay: u8,
        joystick: u8,
        macros: u8,
        analog_filtering: u8,
        init_outputs: u8,
        connection_signal: u8,
        web_interface: u8,
        additional_options: u8,
        load_status: u8,
        custom_name: u8,
        sensor_list: u8,
        potlog27: u8,
        reserved: [u8; 6],
        pwm_hz: u32,
        reserved2: u32,
        digital_in: u64,
        digital_out: u64,
        analog_in: u64,
        counter: u64,
        pwm_pins: u64,
    }
}

layout! {
    PokeysAxis {
        position: i32,
        reference: i32,
        state: u8,
        enabled: u8,
        mode: u8,
        position_epoch: u8,
        limit_minus: u8,
        limit_plus: u8,
        home: u8,
        error: u8,
        soft_limit: u8,
        in_position: u8,
        homed: u8,
        parked: u8,
        following_error: i32,
        delayed: i32,
        reserved: [u8; 4],
        t_reference_ns: u64,
        probe: i64,
        max_speed: f32,
        max_acceleration: f32,
        soft_minimum: i32,
        soft_maximum: i32,
        pulses_per_unit: f64,
        name: [u8; 16],
    }
}

layout! {
    PokeysEngine {
        state: u8,
        axes_enabled: u8,
        activated: u8,
        limit_override: u8,
        emergency: u8,
        charge_pump: u8,
        generator: u8,
        misc_inputs: u8,
        relays: u8,
        outputs: u8,
        buffer_slots: u8,
        buffer_level: u8,
        power_states: u8,
        probe_status: u8,
        slot_time: u8,
        emergency_invert: u8,
        emergency_pin: u8,
        dedicated_limit_minus: u8,
        dedicated_limit_plus: u8,
        dedicated_home: u8,
        limit_minus: u8,
        limit_plus: u8,
        home: u8,
        stops: u8,
        task: u8,
        task_phase: u8,
        task_result: u8,
        task_axes: u8,
        task_count: u32,
        buffer_underruns: u32,
        buffer_resyncs: u32,
        axis: [PokeysAxis; AXES],
    }
}

layout! {
    PokeysThreading {
        preparing: u8,
        prepared: u8,
        waiting: u8,
        active: u8,
        ignore_axes: u8,
        refused: u8,
        behind: u16,
        velocity: i32,
        position_error: i32,
        spindle_rpm: u32,
        index_count: u32,
    }
}

layout! {
    PokeysPostep {
        t_update_ns: u64,
        update_count: u32,
        supply: u8,
        temperature: u8,
        inputs: u8,
        state: u8,
        faults: u8,
        updates: u8,
        mode: u8,
        step_mode: u8,
        temperature_limit: u8,
        hardware_major: u8,
        hardware_minor: u8,
        firmware_major: u8,
        firmware_minor: u8,
        reserved: u8,
        full_scale: u16,
        idle: u16,
        overheat: u16,
    }
}

layout! {
    PokeysRtc {
        year: u16,
        month: u8,
        day: u8,
        hour: u8,
        minute: u8,
        second: u8,
        day_of_week: u8,
        day_of_year: u16,
        unnamed: u8,
        reserved: [u8; 5],
    }
}

layout! {
    PokeysPonetModule {
        r#type: u8,
        address: u8,
        size: u8,
        options: u8,
        status: u8,
        light: u8,
        version: u8,
        failures: u8,
        data: [u8; 16],
    }
}

layout! {
    PokeysLinkStatistics {
        sent: u64,
        resent: u64,
        received: u64,
        accepted: u64,
        missed: u64,
        late: u64,
        lost: u64,
        timed_out: u64,
        stray: u64,
        duplicate: u64,
        stale: u64,
        corrupt: u64,
        wrong_source: u64,
        send_failed: u64,
        cycles_late: u64,
        reconnects: u64,
        rtt_last_ns: u32,
        rtt_smoothed_ns: u32,
        rtt_variation_ns: u32,
        rtt_min_ns: u32,
        rtt_max_ns: u32,
        deadline_ns: u32,
        in_flight: u32,
        packet_error_level: u32,
        refused_command: u64,
        one_shot_refused: u64,
    }
}

layout! {
    PokeysHeater {
        t_ns: u64,
        temperature: f32,
        target: f32,
        power: f32,
        minimum: f32,
        maximum: f32,
        target_maximum: f32,
        p: f32,
        i: f32,
        d: f32,
        tuned_p: f32,
        tuned_i: f32,
        tuned_d: f32,
        fault_count: u32,
        tune_cycles: u16,
        state: u8,
        fault: u8,
        condition: u8,
        refused: u8,
        tuning: u8,
        at_temperature: u8,
        limited: u8,
        fan: u8,
        stops_machine: u8,
        obstacle: u8,
        name: [u8; 32],
    }
}

layout! {
    PokeysServo {
        t_ns: u64,
        position: f64,
        commanded: f64,
        counts_per_unit: f64,
        velocity: f32,
        commanded_velocity: f32,
        error: f32,
        output: f32,
        minimum: f32,
        maximum: f32,
        p: f32,
        i: f32,
        d: f32,
        velocity_gain: f32,
        acceleration_gain: f32,
        max_speed: f32,
        max_acceleration: f32,
        fault_count: u32,
        state: u8,
        fault: u8,
        condition: u8,
        refused: u8,
        homed: u8,
        low: u8,
        high: u8,
        encoder: u8,
        obstacle: u8,
        homing: u8,
        home_end: u8,
        home: u8,
        tuning: u8,
        tune_reason: u8,
        reserved: [u8; 2],
        tuned_p: f32,
        tuned_i: f32,
        tuned_d: f32,
        tuned_velocity_gain: f32,
        tuned_acceleration_gain: f32,
        tuned_acceleration: f32,
        name: [u8; 32],
    }
}

layout! {
    PokeysMoves {
        taken: u32,
        feed: f32,
        speed: f32,
        waiting: u8,
        motors: u8,
        state: u8,
        end: u8,
        refused: u8,
        held: u8,
        axes: u8,
        reserved: [u8; 5],
    }
}

layout! {
    PokeysPhase {
        state: u8,
        master: u8,
        reserved: [u8; 2],
        losses: u32,
        error_ns: i32,
        lead_ns: u32,
        jitter_ns: u32,
        period_ns: u32,
    }
}

layout! {
    PokeysOneShotResult {
        id: u32,
        operation: u8,
        outcome: u8,
        reserved: [u8; 2],
    }
}

layout! {
    #[repr(align(8))]
    PokeysState {
        magic: u32,
        version: u16,
        size_units: u16,
        hash: u64,
        epoch: u64,
        cycle: u64,
        period_ns: u64,
        t_cycle_ns: u64,
        t_publish_ns: u64,
        t_digital_ns: u64,
        t_analog_ns: u64,
        t_encoder_ns: u64,
        t_motion_ns: u64,
        t_slow_ns: u64,
        t_analog_slow_ns: u64,
        stale_after_ns: u64,
        flags: u32,
        link: u8,
        fault: u8,
        access: u8,
        failsafe: u8,
        t_link_ns: u64,
        device_tick_ms: u32,
        fault_count: u32,
        identity: PokeysIdentity,
        capability: PokeysCapability,
        digital_in: [u8; PIN_BYTES],
        digital_out: [u8; PIN_BYTES],
        digital_out_owned: [u8; PIN_BYTES],
        pin_function: [u8; 56],
        analog: [u16; 8],
        encoder: [i32; ENCODERS],
        encoder_enabled: u32,
        encoder_index: u32,
        encoder_t_ns: [u64; ENCODERS],
        encoder_resync: [u32; ENCODERS],
        counter: [u32; 56],
        pwm_period: u32,
        pwm_enabled: u32,
        pwm_duty: [u32; PWM],
        engine: PokeysEngine,
        matrix: [u8; MATRIX_BYTES],
        poextbus: [u8; 16],
        ponet_state: u8,
        ponet_count: u8,
        kbd48_module: u8,
        matrix_enabled: u8,
        reserved2: [u8; 4],
        kbd48_keys: u64,
        ponet: [PokeysPonetModule; PONET],
        slow_millihertz: [u32; SLOW_GROUPS],
        rtc: PokeysRtc,
        one_shot_session: u32,
        one_shot_ack: u32,
        one_shot: [PokeysOneShotResult; ONE_SHOT_RESULTS],
        command_heartbeat: u64,
        command_t_ns: u64,
        config_generation: u32,
        config_state: u8,
        encoder_epoch: u8,
        reserved3: [u8; 2],
        report_count: u32,
        config_foreign: u32,
        phase: PokeysPhase,
        t_postep_ns: u64,
        backlash: [i16; AXES],
        threading: PokeysThreading,
        postep: [PokeysPostep; AXES],
        statistics: PokeysLinkStatistics,
        heater: [PokeysHeater; HEATERS],
        servo: [PokeysServo; SERVOS],
        moves: PokeysMoves,
    }
}

layout! {
    PokeysHistogram {
        count: u64,
        sum_ns: u64,
        min_ns: u64,
        max_ns: u64,
        bucket: [u64; HISTOGRAM_BUCKETS],
    }
}

layout! {
    #[repr(align(8))]
    PokeysDiag {
        magic: u32,
        version: u16,
        size_units: u16,
        hash: u64,
        epoch: u64,
        cycle: u64,
        t_publish_ns: u64,
        cycles_skipped: u64,
        events_dropped: u64,
        event_high_water: u64,
        transport_system_calls: u64,
        transport_waits_avoided: u64,
        transport_rearmed: u64,
        transport_no_buffers: u64,
        transport_overflow: u64,
        transport_truncated: u64,
        minor_faults: u64,
        major_faults: u64,
        guard_passed: u64,
        guard_dropped: u64,
        transport: [u8; 16],
        wakeup: PokeysHistogram,
        round_trip: PokeysHistogram,
        fast_round_trip: PokeysHistogram,
        read_round_trip: PokeysHistogram,
        write_round_trip: PokeysHistogram,
        one_shot_round_trip: PokeysHistogram,
        receive: PokeysHistogram,
        fresh: PokeysHistogram,
        publish: PokeysHistogram,
        cycle_work: PokeysHistogram,
        age_at_read: PokeysHistogram,
    }
}

published! {
    PokeysState, "state", magic 0x5453_4b50, version 22, size 4736,
    hash 0xffba3099fa38976e, hash_function iox_state_hash
}

published! {
    PokeysDiag, "diag", magic 0x4744_4b50, version 4, size 9664,
    hash 0x043bbadfaaa1ea0e, hash_function iox_diag_hash
}
