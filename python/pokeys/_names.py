# SPDX-License-Identifier: MIT
"""The names of all values, as classes. Made by generate.py: do not edit."""
from __future__ import annotations

from typing import Any

from ._values import (
    Address,
    Age,
    Bit,
    Bits,
    Duty,
    Flag,
    Integer,
    Level,
    Measured,
    Part,
    Parts,
    Quantile,
    Ratio,
    Real,
    Setpoint,
    Switch,
    Text,
    Value,
    Word,
)


class StateAge(Part):
    """age"""

    __slots__ = ()
    publish_us = Age(
        "age.publish-us", 1, (48, 0),
        "time since the daemon published the state, microseconds",
        "us",
        factor=0.001)
    cycle_us = Age(
        "age.cycle-us", 1, (40, 0),
        "time since the start of the daemon's last cycle, microseconds",
        "us",
        factor=0.001)
    digital_us = Age(
        "age.digital-us", 1, (56, 0),
        "age of the digital inputs, microseconds",
        "us",
        factor=0.001)
    analog_us = Age(
        "age.analog-us", 1, (64, 0),
        "age of the analog inputs from 02 on, microseconds",
        "us",
        factor=0.001)
    analog_slow_us = Age(
        "age.analog-slow-us", 1, (96, 0),
        "age of the analog inputs 00 and 01, microseconds",
        "us",
        factor=0.001)
    encoder_us = Age(
        "age.encoder-us", 1, (72, 0),
        "age of the encoders' fast counts, microseconds",
        "us",
        factor=0.001)
    motion_us = Age(
        "age.motion-us", 1, (80, 0),
        "age of the axes' positions, microseconds",
        "us",
        factor=0.001)
    slow_us = Age(
        "age.slow-us", 1, (88, 0),
        "age of the data that are read less often, microseconds",
        "us",
        factor=0.001)
    postep_us = Age(
        "age.postep-us", 1, (2544, 0),
        "age of the PoStep drivers' status, microseconds",
        "us",
        factor=0.001)
    link_us = Age(
        "age.link-us", 1, (120, 0),
        "time since link-state changed, microseconds",
        "us",
        factor=0.001)
    command_us = Age(
        "age.command-us", 1, (2496, 0),
        "age of the commander's last command, microseconds",
        "us",
        factor=0.001)


class StateDaemon(Part):
    """daemon"""

    __slots__ = ()
    realtime = Bit("daemon.realtime", 1, (901, 0), "the daemon runs at realtime priority")
    fallback = Bit(
        "daemon.fallback", 1, (902, 0),
        "the daemon's transport is slower than asked for")
    guard = Bit("daemon.guard", 1, (905, 0), "the daemon's packet guard is attached")
    stopping = Bit("daemon.stopping", 1, (904, 0), "the daemon is shutting down")
    stale = Bit("daemon.stale", 1, (896, 0), "the daemon has flagged the fast data as old")
    epoch = Integer(
        "daemon.epoch", 1, (16, 0),
        "differs for each start of the daemon",
        code="Q")
    period_us = Real(
        "daemon.period-us", 1, (32, 0),
        "period of the daemon's cycle",
        "us",
        code="Q",
        factor=0.001)
    stale_after_us = Real(
        "daemon.stale-after-us", 1, (104, 0),
        "data older than this are stale",
        "us",
        code="Q",
        factor=0.001)


class StateCommand(Part):
    """command"""

    __slots__ = ()
    heartbeat = Integer(
        "command.heartbeat", 1, (2488, 0),
        "heartbeat of the command in effect",
        code="Q")


class StatePackets(Part):
    """packets"""

    __slots__ = ()
    sent = Integer("packets.sent", 1, (2848, 0), "packets sent", code="Q")
    resent = Integer("packets.resent", 1, (2856, 0), "of these, repeated", code="Q")
    received = Integer("packets.received", 1, (2864, 0), "packets received", code="Q")
    accepted = Integer("packets.accepted", 1, (2872, 0), "answers accepted", code="Q")
    missed = Integer(
        "packets.missed", 1, (2880, 0),
        "requests without an answer by their deadline",
        code="Q")
    late = Integer(
        "packets.late", 1, (2888, 0),
        "requests answered after their deadline",
        code="Q")
    lost = Integer("packets.lost", 1, (2896, 0), "requests never answered", code="Q")
    timed_out = Integer("packets.timed-out", 1, (2904, 0), "requests abandoned", code="Q")
    stray = Integer(
        "packets.stray", 1, (2912, 0),
        "answers that match no request",
        code="Q")
    duplicate = Integer(
        "packets.duplicate", 1, (2920, 0),
        "answers that arrived twice",
        code="Q")
    stale = Integer(
        "packets.stale", 1, (2928, 0),
        "answers too old to be accepted",
        code="Q")
    corrupt = Integer("packets.corrupt", 1, (2936, 0), "damaged packets", code="Q")
    wrong_source = Integer(
        "packets.wrong-source", 1, (2944, 0),
        "packets from another sender",
        code="Q")
    send_failed = Integer(
        "packets.send-failed", 1, (2952, 0),
        "packets that the kernel did not send",
        code="Q")
    in_flight = Integer(
        "packets.in-flight", 1, (3000, 0),
        "requests currently waiting for an answer",
        code="I")
    error_level = Integer(
        "packets.error-level", 1, (3004, 0),
        "rises with lost answers, falls with good ones; 0 is normal",
        code="I")


class StatePhase(Part):
    """phase"""

    __slots__ = ()
    state = Word(
        "phase.state", 1, (2520, 0),
        "whether the daemon's cycle follows the commander: 0 off, 1 no commander, 2 the periods do "
        "not match, 3 locking, 4 locked",
        code="B",
        words={
            0: "off",
            1: "free",
            2: "unfit",
            3: "seeking",
            4: "locked",
        })
    master = Integer(
        "phase.master", 1, (2521, 0),
        "the daemon's index of the device whose commander it follows; 255 none",
        code="B")
    losses = Integer("phase.losses", 1, (2524, 0), "times the lock was lost", code="I")
    lead_us = Real(
        "phase.lead-us", 1, (2532, 0),
        "from the start of the daemon's cycle to the expected read",
        "us",
        code="I",
        factor=0.001)
    jitter_us = Real(
        "phase.jitter-us", 1, (2536, 0),
        "mean deviation of the reads",
        "us",
        code="I",
        factor=0.001)
    period_us = Real(
        "phase.period-us", 1, (2540, 0),
        "from the start of the last cycle to that of the next",
        "us",
        code="I",
        factor=0.001)


class StatePinItem(Part):
    """pin.NN"""

    __slots__ = ()
    in_ = Bit("pin.%02u.in", 55, (2432, 1), "digital input; pin.00 is pin 1")
    out_fb = Bit(
        "pin.%02u.out-fb", 55, (2496, 1),
        "state of the output, as acknowledged by the device")
    is_output = Bit(
        "pin.%02u.is-output", 55, (2560, 1),
        "the device has the pin configured as an output")
    function_in_effect = Integer(
        "pin.%02u.function-in-effect", 55, (328, 1),
        "function in the device: sum of 2 digital input, 4 digital output, 8 analog input, 16 "
        "analog output, 32 triggered input, 64 counter, 128 inverted",
        code="B")
    can_input = Bit("pin.%02u.can-input", 55, (2112, 1), "the pin can be a digital input")
    can_output = Bit("pin.%02u.can-output", 55, (2176, 1), "the pin can be a digital output")
    can_analog = Bit("pin.%02u.can-analog", 55, (2240, 1), "the pin can be an analog input")
    can_count = Bit("pin.%02u.can-count", 55, (2304, 1), "the pin can be a digital counter")
    can_pwm = Bit("pin.%02u.can-pwm", 55, (2368, 1), "the pin can be a PWM output")


class StatePin(Parts[StatePinItem]):
    """pin"""

    __slots__ = ()
    _kind = StatePinItem
    _count = 55


class StateCounterItem(Part):
    """counter.NN"""

    __slots__ = ()
    value = Integer(
        "counter.%02u.value", 55, (824, 4),
        "digital counter of the pin, wraps at 2^32",
        code="I")


class StateCounter(Parts[StateCounterItem]):
    """counter"""

    __slots__ = ()
    _kind = StateCounterItem
    _count = 55


class StateAdcItem(Part):
    """adc.NN"""

    __slots__ = ()
    raw = Integer("adc.%02u.raw", 7, (384, 2), "0..4095 = 0..3.3 V at the pin", code="H")
    volts = Real(
        "adc.%02u.volts", 7, (384, 2),
        "voltage at the pin; adc.00 is terminal 41",
        "V",
        code="H",
        factor=0.000805664062)


class StateAdc(Parts[StateAdcItem]):
    """adc"""

    __slots__ = ()
    _kind = StateAdcItem
    _count = 7


class StateEncoderItem(Part):
    """encoder.NN"""

    __slots__ = ()
    rawcounts = Integer(
        "encoder.%02u.rawcounts", 26, (400, 4),
        "the device's own count, wraps at 2^32; 25 is the ultra-fast encoder",
        "counts",
        code="i")
    enabled = Bit(
        "encoder.%02u.enabled", 26, (4032, 1),
        "the device counts it, as basic, fast or ultra-fast encoder")
    index_seen = Bit(
        "encoder.%02u.index-seen", 26, (4064, 1),
        "an index pulse has arrived since the index was last armed")
    age_us = Age(
        "encoder.%02u.age-us", 26, (512, 8),
        "time since the count was sampled",
        "us",
        factor=0.001)
    resyncs = Integer(
        "encoder.%02u.resyncs", 26, (720, 4),
        "jumps of the count that were corrected",
        code="I")


class StateEncoder(Parts[StateEncoderItem]):
    """encoder"""

    __slots__ = ()
    _kind = StateEncoderItem
    _count = 26


class StatePwmItem(Part):
    """pwm.NN"""

    __slots__ = ()
    duty = Ratio(
        "pwm.%02u.duty", 6, (1056, 4),
        "as the device has it, 0..1",
        code="I",
        whole=1048)
    enabled = Bit("pwm.%02u.enabled", 6, (8416, 1), "the device has the channel on")


class StatePwm(Parts[StatePwmItem]):
    """pwm"""

    __slots__ = ()
    _kind = StatePwmItem
    _count = 6
    period_ticks = Integer(
        "pwm.period-ticks", 1, (1048, 0),
        "period of all PWM channels; see info.PWMinternalFrequency",
        "ticks",
        code="I")


class StateExternalItem(Part):
    """external.NN"""

    __slots__ = ()
    out_fb = Bit("external.%02u.out-fb", 8, (8712, 1), "as the device has it")


class StateExternal(Parts[StateExternalItem]):
    """external"""

    __slots__ = ()
    _kind = StateExternalItem
    _count = 8


class StateExternalRelayItem(Part):
    """external-relay.NN"""

    __slots__ = ()
    out_fb = Bit("external-relay.%02u.out-fb", 8, (8704, 1), "as the device has it")


class StateExternalRelay(Parts[StateExternalRelayItem]):
    """external-relay"""

    __slots__ = ()
    _kind = StateExternalRelayItem
    _count = 8


class StateEngineMiscItem(Part):
    """engine.misc.NN"""

    __slots__ = ()
    in_ = Bit(
        "engine.misc.%02u.in", 8, (8696, 1),
        "further inputs of the engine's connector: 04..06 inputs 5 to 7, 07 spindle error")


class StateEngineMisc(Parts[StateEngineMiscItem]):
    """engine.misc"""

    __slots__ = ()
    _kind = StateEngineMiscItem
    _count = 8


class StateEngine(Part):
    """engine"""

    __slots__ = ()
    axes_enabled = Integer(
        "engine.axes-enabled", 1, (1081, 0),
        "axes the engine has enabled",
        code="B")
    activated = Flag("engine.activated", 1, (1082, 0), "the engine is initialised")
    charge_pump_state = Integer(
        "engine.charge-pump-state", 1, (1085, 0),
        "the charge pump's setting in effect",
        code="B")
    generator_state = Integer(
        "engine.generator-state", 1, (1086, 0),
        "the generator's setting in effect",
        code="B")
    power_states_in_effect = Integer(
        "engine.power-states-in-effect", 1, (1092, 0),
        "in which states the power is enabled, see engine.power-states",
        code="B")
    probe_status = Integer(
        "engine.probe-status", 1, (1093, 0),
        "bits of the axes that have probed",
        code="B")
    buffer_slots = Integer(
        "engine.buffer-slots", 1, (1090, 0),
        "size of the motion buffer, slots",
        code="B")
    buffer_level = Integer(
        "engine.buffer-level", 1, (1091, 0),
        "slots in use, as far as known",
        code="B")
    buffer_underruns = Integer(
        "engine.buffer-underruns", 1, (1112, 0),
        "how often the buffer ran dry while axes were moving, since the daemon's start",
        code="I")
    buffer_resyncs = Integer(
        "engine.buffer-resyncs", 1, (1116, 0),
        "how often positions were read back to find out what had been executed",
        code="I")
    slot_us = Real(
        "engine.slot-us", 1, (1094, 0),
        "time of a slot, microseconds",
        "us",
        code="B",
        factor=100)
    limit_override_active = Flag(
        "engine.limit-override-active", 1, (1083, 0),
        "the override is active in the device")
    emergency_invert_in_effect = Flag(
        "engine.emergency-invert-in-effect", 1, (1095, 0),
        "the emergency input is inverted: normally open")
    emergency_pin_in_effect = Integer(
        "engine.emergency-pin-in-effect", 1, (1096, 0),
        "the emergency input: 0 off, 1 default pin, otherwise terminal + 10",
        code="B")

    @property
    def misc(self) -> StateEngineMisc:
        """engine.misc"""
        return StateEngineMisc(self._image, self._index)


class StateTask(Part):
    """task"""

    __slots__ = ()
    kind = Integer(
        "task.kind", 1, (1104, 0),
        "current or last task of the device: 0 none, 1 homing, 2 probing, 3 hybrid probing, 4 "
        "jogging, 5 threading",
        code="B")
    phase = Integer(
        "task.phase", 1, (1105, 0),
        "phase of the task: 0 idle, 1 stopping the engine first, 2 start requested, 3 working, 4 "
        "complete, 5 finishing, 6 stopping",
        code="B")
    result = Word(
        "task.result", 1, (1106, 0),
        "result of the last task: 1 done, otherwise the reason",
        code="B",
        words={
            0: "ended",
            1: "done",
            2: "cancelled",
            3: "not done within its time limit",
            4: "failed: the device did not begin, or stopped by itself",
            5: "stopped by a limit switch or the emergency input",
            6: "at its end without a contact",
            7: "lost with the link",
            10: "stopped: the motion buffer ran dry in the middle of a thread",
            11: "stopped: the spindle is too far behind its target speed",
        })
    axes = Integer("task.axes", 1, (1107, 0), "axes of the task, one bit each", code="B")
    count = Integer(
        "task.count", 1, (1108, 0),
        "tasks ended since the daemon's start",
        code="I")


class StateJointItemPostep(Part):
    """joint.NN.postep"""

    __slots__ = ()
    supply = Real(
        "joint.%02u.postep.supply", 8, (2604, 32),
        "PoStep driver: supply, V",
        "V",
        code="B",
        factor=0.25)
    temperature = Integer(
        "joint.%02u.postep.temperature", 8, (2605, 32),
        "PoStep driver: degrees C",
        "deg C",
        code="B")
    state = Word(
        "joint.%02u.postep.state", 8, (2607, 32),
        "PoStep driver: 1 sleep, 2 active, 3 idle, 4 overheated, 5 DC motor",
        code="B",
        words={
            1: "asleep",
            2: "active",
            3: "idle",
            4: "overheated",
            5: "DC motor",
        })
    fault = Flag("joint.%02u.postep.fault", 8, (2608, 32), "PoStep driver: any fault")
    faults = Integer(
        "joint.%02u.postep.faults", 8, (2608, 32),
        "PoStep driver: 1 too hot, 2 and 4 overcurrent A and B, 8 and 16 predriver A and B, 32 "
        "undervoltage, 64 stall, 128 stall latched",
        code="B")
    inputs = Integer(
        "joint.%02u.postep.inputs", 8, (2606, 32),
        "PoStep driver: 1 bootloader, 2 sleep, 4 step, 8 direction, 16 BIN1, 32 BIN2, 64 end switch",
        code="B")
    updates = Integer(
        "joint.%02u.postep.updates", 8, (2600, 32),
        "PoStep driver: number of its answers to the device, as far as observed",
        code="I")
    age_ms = Age(
        "joint.%02u.postep.age-ms", 8, (2592, 32),
        "PoStep driver: time since its last observed answer",
        "ms",
        factor=1e-06)
    mode = Integer(
        "joint.%02u.postep.mode", 8, (2610, 32),
        "PoStep driver: 1 external, 2 step, 3 DC motor, 4 position, 5 BINx",
        code="B")
    step_mode_in_effect = Integer(
        "joint.%02u.postep.step-mode-in-effect", 8, (2611, 32),
        "PoStep driver: 0 full steps, 1 half steps, 2 quarter steps .. 8 1/256 steps",
        code="B")
    temperature_limit_in_effect = Integer(
        "joint.%02u.postep.temperature-limit-in-effect", 8, (2612, 32),
        "PoStep driver: switches off above this temperature",
        "deg C",
        code="B")
    current_raw = Integer(
        "joint.%02u.postep.current-raw", 8, (2618, 32),
        "PoStep driver: full scale current; unit not documented, never written",
        code="H")
    current_idle_raw = Integer(
        "joint.%02u.postep.current-idle-raw", 8, (2620, 32),
        "PoStep driver: idle current; unit not documented, never written",
        code="H")
    current_overheat_raw = Integer(
        "joint.%02u.postep.current-overheat-raw", 8, (2622, 32),
        "PoStep driver: current when overheated; unit not documented, never written",
        code="H")
    hardware_major = Integer(
        "joint.%02u.postep.hardware-major", 8, (2613, 32),
        "PoStep driver: version of its hardware",
        code="B")
    hardware_minor = Integer(
        "joint.%02u.postep.hardware-minor", 8, (2614, 32),
        "PoStep driver: version of its hardware",
        code="B")
    firmware_major = Integer(
        "joint.%02u.postep.firmware-major", 8, (2615, 32),
        "PoStep driver: version of its firmware",
        code="B")
    firmware_minor = Integer(
        "joint.%02u.postep.firmware-minor", 8, (2616, 32),
        "PoStep driver: version of its firmware",
        code="B")


class StateJointItem(Part):
    """joint.NN"""

    __slots__ = ()
    counts = Integer(
        "joint.%02u.counts", 8, (1120, 88),
        "position reported by the device",
        "pulses",
        code="i")
    counts_cmd = Integer(
        "joint.%02u.counts-cmd", 8, (1124, 88),
        "position last sent to the device; in speed mode (mode-in-effect 2) a speed in pulses/s",
        "pulses",
        code="i")
    counts_error = Integer(
        "joint.%02u.counts-error", 8, (1140, 88),
        "commanded position minus counts-delayed minus counts; 0 in speed mode or if not driven",
        "pulses",
        code="i")
    counts_delayed = Integer(
        "joint.%02u.counts-delayed", 8, (1144, 88),
        "commanded since the time of the reported position, in buffered mode; 0 in other modes",
        "pulses",
        code="i")
    counts_probed = Integer(
        "joint.%02u.counts-probed", 8, (1160, 88),
        "position at which the probe tripped",
        "pulses",
        code="q")
    age_cmd_us = Age(
        "joint.%02u.age-cmd-us", 8, (1152, 88),
        "time since counts-cmd was sent",
        "us",
        factor=0.001)
    max_rate = Measured(
        "joint.%02u.max-rate", 8, (1168, 88),
        "highest speed configured in the device",
        "pulses/s",
        code="f",
        factor=1)
    max_rate_change = Measured(
        "joint.%02u.max-rate-change", 8, (1172, 88),
        "acceleration configured in the device",
        "pulses/s^2",
        code="f",
        factor=1)
    soft_min = Integer(
        "joint.%02u.soft-min", 8, (1176, 88),
        "soft limit configured in the device; -2147483648 = none",
        "pulses",
        code="i")
    soft_max = Integer(
        "joint.%02u.soft-max", 8, (1180, 88),
        "soft limit configured in the device; 2147483647 = none",
        "pulses",
        code="i")
    pulses_per_unit = Measured(
        "joint.%02u.pulses-per-unit", 8, (1184, 88),
        "scale of the axis for moves of the daemon; 0 = not given",
        "pulses",
        code="d",
        factor=1)
    name = Text(
        "joint.%02u.name", 8, (1192, 88),
        "name of the axis for moves of the daemon",
        size=16)
    mode_in_effect = Integer(
        "joint.%02u.mode-in-effect", 8, (1130, 88),
        "how the axis is driven: 0 not, 1 positions, 2 speed, 3 motion buffer",
        code="B")
    position_epoch = Integer(
        "joint.%02u.position-epoch", 8, (1131, 88),
        "changes when the device restarts its count; even: position lost, odd: position known",
        code="B")
    state = Word(
        "joint.%02u.state", 8, (1128, 88),
        "0 stopped, 1 ready, 2 running, 8 resetting, 9 backing off, 10 home, 11 homing starts, 12 "
        "homing search, 13 homing back, 14 probed, 15 probe starts, 16 probe search, 20 error, 30 "
        "limit",
        code="B",
        words={
            0: "stopped",
            1: "ready",
            2: "running",
            5: "buffer",
            8: "homing resetting",
            9: "homing backing off",
            10: "home",
            11: "homing start",
            12: "homing search",
            13: "homing back",
            14: "probed",
            15: "probe start",
            16: "probe search",
            20: "error",
            30: "limit",
        })
    enabled = Flag("joint.%02u.enabled", 8, (1129, 88), "the daemon drives this axis")
    homed = Flag("joint.%02u.homed", 8, (1138, 88), "homed by the device")
    at_counts_cmd = Flag(
        "joint.%02u.at-counts-cmd", 8, (1137, 88),
        "at rest at counts-cmd, and nothing newer is commanded")
    parked = Flag(
        "joint.%02u.parked", 8, (1139, 88),
        "homed or probed: ignores its command until the command equals counts or its enable has "
        "been false")
    error = Flag("joint.%02u.error", 8, (1135, 88), "motor driver's error input")
    limit_neg = Flag("joint.%02u.limit-neg", 8, (1132, 88), "negative limit switch")
    limit_pos = Flag("joint.%02u.limit-pos", 8, (1133, 88), "positive limit switch")
    home_sw = Flag("joint.%02u.home-sw", 8, (1134, 88), "home switch")
    soft_limit = Flag("joint.%02u.soft-limit", 8, (1136, 88), "soft limit reached")
    limit_neg_raw = Bit(
        "joint.%02u.limit-neg-raw", 8, (8800, 1),
        "bit of the switch in the raw status")
    limit_pos_raw = Bit(
        "joint.%02u.limit-pos-raw", 8, (8808, 1),
        "bit of the switch in the raw status")
    home_raw = Bit("joint.%02u.home-raw", 8, (8816, 1), "bit of the switch in the raw status")
    limit_neg_dedicated = Bit(
        "joint.%02u.limit-neg-dedicated", 8, (8776, 1),
        "the axis' own limit input, before inversion")
    limit_pos_dedicated = Bit(
        "joint.%02u.limit-pos-dedicated", 8, (8784, 1),
        "the axis' own limit input, before inversion")
    home_dedicated = Bit(
        "joint.%02u.home-dedicated", 8, (8792, 1),
        "the axis' own home input, before inversion")
    probed = Bit(
        "joint.%02u.probed", 8, (8744, 1),
        "the axis' bit of the probe status: counts-probed is from the last probing")
    backlash_taken = Integer(
        "joint.%02u.backlash-taken", 8, (2552, 2),
        "pulses that the device has added",
        "pulses",
        code="h")

    @property
    def postep(self) -> StateJointItemPostep:
        """joint.NN.postep"""
        return StateJointItemPostep(self._image, self._index)


class StateJoint(Parts[StateJointItem]):
    """joint"""

    __slots__ = ()
    _kind = StateJointItem
    _count = 8


class StateThreading(Part):
    """threading"""

    __slots__ = ()
    preparing = Flag("threading.preparing", 1, (2568, 0), "the device empties its buffer")
    prepared = Flag(
        "threading.prepared", 1, (2569, 0),
        "the device plays nothing: the motion may begin, and threading may be armed")
    waiting = Flag("threading.waiting", 1, (2570, 0), "the device waits for the index")
    active = Flag("threading.active", 1, (2571, 0), "motion follows the spindle")
    velocity = Integer(
        "threading.velocity", 1, (2576, 0),
        "speed of the spindle as the device estimates it; its unit is not documented",
        code="i")
    position_error = Integer(
        "threading.position-error", 1, (2580, 0),
        "lag that the device reports; its unit is not documented",
        code="i")
    spindle_rpm = Integer(
        "threading.spindle-rpm", 1, (2584, 0),
        "speed of the spindle",
        "rpm",
        code="I")
    index_count = Integer("threading.index-count", 1, (2588, 0), "index pulses", code="I")
    behind = Integer(
        "threading.behind", 1, (2574, 0),
        "milliseconds of commanded motion that have not been played yet",
        code="H")
    refusal = Word(
        "threading.refusal", 1, (2573, 0),
        "why the last threading request was refused; 0 = it was accepted",
        code="B",
        words={
            0: "not refused",
            1: "the machine is off",
            2: "its settings are not given, or the device has not taken them yet",
            3: "no enabled axis in buffered mode takes part",
            4: "an axis has not come to rest",
            5: "the device is at work already",
            6: "it is not prepared",
            7: "it has not begun",
            8: "the time limit is out of range",
        })
    ignored_axes = Integer(
        "threading.ignored-axes", 1, (2572, 0),
        "axes that do not take part, one bit each",
        code="B")


class StateHeaterItem(Part):
    """heater.NN"""

    __slots__ = ()
    name = Text(
        "heater.%02u.name", 7, (3096, 104),
        "name of the heater in pokeysd.conf; empty = there is none",
        size=32)
    state = Word(
        "heater.%02u.state", 7, (3086, 104),
        "0 = no such heater, 1 off, 2 heating, 3 tuning, 4 fault, 5 off, but not acknowledged by "
        "the device",
        code="B",
        words={
            0: "none",
            1: "off",
            2: "heating",
            3: "tuning",
            4: "fault",
            5: "stopping",
        })
    temperature = Measured(
        "heater.%02u.temperature", 7, (3032, 104),
        "measured temperature, degrees C; nan = not known",
        "deg C",
        code="f",
        factor=1)
    age_ms = Age(
        "heater.%02u.age-ms", 7, (3024, 104),
        "time since the temperature was measured",
        "ms",
        factor=1e-06)
    target_in_effect = Measured(
        "heater.%02u.target-in-effect", 7, (3036, 104),
        "target that the daemon controls to, degrees C; 0 = off",
        "deg C",
        code="f",
        factor=1)
    power = Measured(
        "heater.%02u.power", 7, (3040, 104),
        "power of the heater, 0..1",
        code="f",
        factor=1)
    at_temperature = Flag(
        "heater.%02u.at-temperature", 7, (3091, 104),
        "it has a target, and is within at-temperature-k of it")
    fault = Flag(
        "heater.%02u.fault", 7, (3087, 104),
        "a fault has switched the heater off, until it is reset")
    fault_code = Word(
        "heater.%02u.fault-code", 7, (3087, 104),
        "which: 0 none, 1 device not ready, 2 no readings, 3 reading is no number, 4 sensor open, 5"
        " sensor shorted, 6 too hot, 7 too cold, 8 temperature jumps, 9 does not get warm, 10 does "
        "not stay warm, 11 full power has no effect",
        code="B",
        words={
            0: "none",
            1: "device not ready",
            2: "no readings",
            3: "reading is no number",
            4: "sensor open",
            5: "sensor shorted",
            6: "too hot",
            7: "too cold",
            8: "temperature jumps",
            9: "does not get warm",
            10: "does not stay warm",
            11: "full power has no effect",
        })
    condition = Word(
        "heater.%02u.condition", 7, (3088, 104),
        "what is wrong now, as fault-code has it",
        code="B",
        words={
            0: "none",
            1: "device not ready",
            2: "no readings",
            3: "reading is no number",
            4: "sensor open",
            5: "sensor shorted",
            6: "too hot",
            7: "too cold",
            8: "temperature jumps",
            9: "does not get warm",
            10: "does not stay warm",
            11: "full power has no effect",
        })
    obstacle = Word(
        "heater.%02u.obstacle", 7, (3095, 104),
        "why the device is not ready for it; 0 = it is",
        code="B",
        words={
            0: "none",
            1: "the device does not run",
            2: "something else uses its terminal",
            3: "the sensor's terminal is not set up",
            4: "the analog filter is too slow",
            5: "the encoder is off",
            6: "the index input resets the encoder",
            7: "the output is not set up",
            8: "no such PWM output, or another period",
            9: "a limit switch is not set up",
            10: "the fan's output is not set up",
            11: "the failsafe would leave it on",
            12: "its configuration cannot be used",
        })
    refused = Word(
        "heater.%02u.refused", 7, (3089, 104),
        "why the last target was refused: 0 it was not, 1 out of range, 2 it has to be 0 first, 3 "
        "sensor or device not ready (condition)",
        code="B",
        words={
            0: "none",
            1: "target out of range",
            2: "off has to be commanded first",
            3: "sensor or device not ready",
        })
    faults = Integer(
        "heater.%02u.faults", 7, (3080, 104),
        "faults of the heater since the daemon's start",
        code="I")
    power_limited = Flag(
        "heater.%02u.power-limited", 7, (3092, 104),
        "max-heater-power-w gives it less power than it asks for")
    fan = Word(
        "heater.%02u.fan", 7, (3093, 104),
        "fan of the heater: 0 = there is none, 1 off, 2 on",
        code="B",
        words={
            0: "none",
            1: "off",
            2: "on",
        })
    stops_machine = Flag(
        "heater.%02u.stops-machine", 7, (3094, 104),
        "its fault also stops the servo motors of its device (on-fault)")
    min_temperature = Measured(
        "heater.%02u.min-temperature", 7, (3044, 104),
        "below this, it does not heat",
        "deg C",
        code="f",
        factor=1)
    max_temperature = Measured(
        "heater.%02u.max-temperature", 7, (3048, 104),
        "above this, it has a fault",
        "deg C",
        code="f",
        factor=1)
    max_target = Measured(
        "heater.%02u.max-target", 7, (3052, 104),
        "highest target that is accepted",
        "deg C",
        code="f",
        factor=1)
    pid_p = Measured(
        "heater.%02u.pid-p", 7, (3056, 104),
        "proportional gain, 1/255 of full power for each kelvin",
        code="f",
        factor=1)
    pid_i = Measured(
        "heater.%02u.pid-i", 7, (3060, 104),
        "integral gain, 1/255 of full power for each kelvin second",
        code="f",
        factor=1)
    pid_d = Measured(
        "heater.%02u.pid-d", 7, (3064, 104),
        "derivative gain, 1/255 of full power for each kelvin a second",
        code="f",
        factor=1)
    tuning = Word(
        "heater.%02u.tuning", 7, (3090, 104),
        "search for gains: 0 = none yet, 1 runs, 2 done, 3 failed",
        code="B",
        words={
            0: "none",
            1: "runs",
            2: "done",
            3: "failed",
        })
    tune_cycles = Integer(
        "heater.%02u.tune-cycles", 7, (3084, 104),
        "oscillations of the last search for gains",
        code="H")
    tuned_p = Measured(
        "heater.%02u.tuned-p", 7, (3068, 104),
        "proportional gain that the last search has found",
        code="f",
        factor=1)
    tuned_i = Measured(
        "heater.%02u.tuned-i", 7, (3072, 104),
        "integral gain that the last search has found",
        code="f",
        factor=1)
    tuned_d = Measured(
        "heater.%02u.tuned-d", 7, (3076, 104),
        "derivative gain that the last search has found",
        code="f",
        factor=1)


class StateHeater(Parts[StateHeaterItem]):
    """heater"""

    __slots__ = ()
    _kind = StateHeaterItem
    _count = 7


class StateServoItem(Part):
    """servo.NN"""

    __slots__ = ()
    name = Text(
        "servo.%02u.name", 6, (3880, 160),
        "name of the motor in pokeysd.conf; empty = there is none",
        size=32)
    state = Word(
        "servo.%02u.state", 6, (3840, 160),
        "0 = no such motor, 1 off, 2 enabled, 3 fault, 4 off, but not acknowledged by the device",
        code="B",
        words={
            0: "none",
            1: "off",
            2: "enabled",
            3: "fault",
            4: "stopping",
        })
    pos_fb = Measured(
        "servo.%02u.pos-fb", 6, (3760, 160),
        "position of the encoder, units of counts-per-unit",
        code="d",
        factor=1)
    age_ms = Age(
        "servo.%02u.age-ms", 6, (3752, 160),
        "time since the encoder was read",
        "ms",
        factor=1e-06)
    vel_fb = Measured(
        "servo.%02u.vel-fb", 6, (3784, 160),
        "its velocity, units/s",
        "1/s",
        code="f",
        factor=1)
    commanded = Measured(
        "servo.%02u.commanded", 6, (3768, 160),
        "commanded position while it is enabled, else its position, units",
        code="d",
        factor=1)
    commanded_velocity = Measured(
        "servo.%02u.commanded-velocity", 6, (3788, 160),
        "commanded velocity, or what was found from the positions, units/s",
        "1/s",
        code="f",
        factor=1)
    error = Measured(
        "servo.%02u.error", 6, (3792, 160),
        "following error, pos-cmd - pos-fb; after a fault as it was then",
        code="f",
        factor=1)
    output = Measured(
        "servo.%02u.output", 6, (3796, 160),
        "part of the full voltage, -1..1",
        code="f",
        factor=1)
    fault_code = Word(
        "servo.%02u.fault-code", 6, (3841, 160),
        "which fault: 0 none, 1 device not ready, 2 no readings, 3 emergency stop, 4 encoder jumps,"
        " 5 command is impossible, 6 following error, 7 stalled, 8 encoder silent, 9 runs away, 10 "
        "soft limit, 11 limit switch, 12 heater fault",
        code="B",
        words={
            0: "none",
            1: "device not ready",
            2: "no readings",
            3: "emergency stop",
            4: "encoder jumps",
            5: "command is impossible",
            6: "following error",
            7: "stalled",
            8: "encoder silent",
            9: "runs away",
            10: "soft limit",
            11: "limit switch",
            12: "heater fault",
        })
    condition = Word(
        "servo.%02u.condition", 6, (3842, 160),
        "what is wrong now, as fault-code has it",
        code="B",
        words={
            0: "none",
            1: "device not ready",
            2: "no readings",
            3: "emergency stop",
            4: "encoder jumps",
            5: "command is impossible",
            6: "following error",
            7: "stalled",
            8: "encoder silent",
            9: "runs away",
            10: "soft limit",
            11: "limit switch",
            12: "heater fault",
        })
    obstacle = Word(
        "servo.%02u.obstacle", 6, (3848, 160),
        "why the device is not ready for it; 0 = it is",
        code="B",
        words={
            0: "none",
            1: "the device does not run",
            2: "something else uses its terminal",
            3: "the sensor's terminal is not set up",
            4: "the analog filter is too slow",
            5: "the encoder is off",
            6: "the index input resets the encoder",
            7: "the output is not set up",
            8: "no such PWM output, or another period",
            9: "a limit switch is not set up",
            10: "the fan's output is not set up",
            11: "the failsafe would leave it on",
            12: "its configuration cannot be used",
        })
    refused = Word(
        "servo.%02u.refused", 6, (3843, 160),
        "why it was not enabled: 0 it was, 1 the fault has to be reset first, 2 encoder or device "
        "not ready (condition), 3 not at the commanded position, 4 off has to be commanded first, 5"
        " its commander does not read the position",
        code="B",
        words={
            0: "none",
            1: "the fault has to be reset first",
            2: "encoder or device not ready",
            3: "not at the commanded position",
            4: "off has to be commanded first",
            5: "its commander does not read the position",
        })
    homed = Flag("servo.%02u.homed", 6, (3844, 160), "the position is that of the machine")
    limit_minus = Flag(
        "servo.%02u.limit-minus", 6, (3845, 160),
        "the limit switch at the lower end is pressed")
    limit_plus = Flag(
        "servo.%02u.limit-plus", 6, (3846, 160),
        "the limit switch at the upper end is pressed")
    home_state = Word(
        "servo.%02u.home-state", 6, (3849, 160),
        "what the daemon does to find its home switch; 0 = it is not homing",
        code="B",
        words={
            0: "none",
            1: "leaves the switch",
            2: "searches for the switch",
            3: "backs off",
            4: "approaches the switch",
            5: "goes to home-position",
            6: "holds its position",
        })
    home_end = Word(
        "servo.%02u.home-end", 6, (3850, 160),
        "how the last homing has ended: 0 there was none, or it has not ended, 1 it is homed, 2 "
        "aborted, 3 the motor was switched off, or had a fault, 4 the home switch did not close, 5 "
        "it did not open, 6 homing took too long, 7 no readings of the home switch",
        code="B",
        words={
            0: "none",
            1: "done",
            2: "aborted",
            3: "the motor was switched off, or had a fault",
            4: "the home switch did not close",
            5: "the home switch did not open",
            6: "homing took too long",
            7: "no readings of the home switch",
        })
    home_switch = Flag("servo.%02u.home-switch", 6, (3851, 160), "its home switch is pressed")
    tuning = Word(
        "servo.%02u.tuning", 6, (3852, 160),
        "search for gains: 0 = none yet, 1 runs, 2 done, 3 failed",
        code="B",
        words={
            0: "none",
            1: "runs",
            2: "done",
            3: "failed",
        })
    tune_reason = Word(
        "servo.%02u.tune-reason", 6, (3853, 160),
        "why the last search for gains has found none; 0 = it has",
        code="B",
        words={
            0: "none",
            1: "the motor was switched off, or had a fault",
            2: "the motor does not move",
            3: "the motor moves against its output",
            4: "the motor, or its encoder, stands still",
            5: "the motor went too far",
            6: "it does not respond like a motor",
            7: "not enough readings; try a longer distance",
        })
    tuned_p = Measured(
        "servo.%02u.tuned-p", 6, (3856, 160),
        "pid-p that the last search has found",
        code="f",
        factor=1)
    tuned_i = Measured(
        "servo.%02u.tuned-i", 6, (3860, 160),
        "pid-i that the last search has found",
        code="f",
        factor=1)
    tuned_d = Measured(
        "servo.%02u.tuned-d", 6, (3864, 160),
        "pid-d that the last search has found",
        code="f",
        factor=1)
    tuned_velocity_gain = Measured(
        "servo.%02u.tuned-velocity-gain", 6, (3868, 160),
        "velocity-gain that the last search has found",
        code="f",
        factor=1)
    tuned_acceleration_gain = Measured(
        "servo.%02u.tuned-acceleration-gain", 6, (3872, 160),
        "acceleration-gain that the last search has found",
        code="f",
        factor=1)
    tuned_acceleration = Measured(
        "servo.%02u.tuned-acceleration", 6, (3876, 160),
        "acceleration with the full output that the last search has found, units/s^2",
        code="f",
        factor=1)
    faults = Integer(
        "servo.%02u.faults", 6, (3836, 160),
        "faults of the motor since the daemon's start",
        code="I")
    encoder = Integer(
        "servo.%02u.encoder", 6, (3847, 160),
        "number of its encoder",
        code="B")
    counts_per_unit = Measured(
        "servo.%02u.counts-per-unit", 6, (3776, 160),
        "counts of the encoder for each unit of the axis",
        code="d",
        factor=1)
    min_position = Measured(
        "servo.%02u.min-position", 6, (3800, 160),
        "soft limit, units",
        code="f",
        factor=1)
    max_position = Measured(
        "servo.%02u.max-position", 6, (3804, 160),
        "soft limit, units",
        code="f",
        factor=1)
    pid_p = Measured(
        "servo.%02u.pid-p", 6, (3808, 160),
        "proportional gain, output for each unit of error",
        code="f",
        factor=1)
    pid_i = Measured(
        "servo.%02u.pid-i", 6, (3812, 160),
        "integral gain, output for each unit of error and second",
        code="f",
        factor=1)
    pid_d = Measured(
        "servo.%02u.pid-d", 6, (3816, 160),
        "derivative gain, output for each unit/s",
        code="f",
        factor=1)
    velocity_gain = Measured(
        "servo.%02u.velocity-gain", 6, (3820, 160),
        "feed-forward, output for each unit/s that is commanded",
        code="f",
        factor=1)
    acceleration_gain = Measured(
        "servo.%02u.acceleration-gain", 6, (3824, 160),
        "feed-forward, output for each unit/s^2 that is commanded",
        code="f",
        factor=1)
    max_rate = Measured(
        "servo.%02u.max-rate", 6, (3828, 160),
        "highest speed of moves, units/s",
        code="f",
        factor=1)
    max_rate_change = Measured(
        "servo.%02u.max-rate-change", 6, (3832, 160),
        "acceleration of moves, units/s^2",
        code="f",
        factor=1)


class StateServo(Parts[StateServoItem]):
    """servo"""

    __slots__ = ()
    _kind = StateServoItem
    _count = 6


class StateMoves(Part):
    """moves"""

    __slots__ = ()
    state = Word(
        "moves.state", 1, (4726, 0),
        "0 = no path of motors or axes, 1 moving, 2 held, 3 aborting, 4 ended, and held until the "
        "commanded positions match",
        code="B",
        words={
            0: "idle",
            1: "moving",
            2: "held",
            3: "aborting",
            4: "holds its position",
        })
    waiting = Integer(
        "moves.waiting", 1, (4724, 0),
        "moves that wait, with the one under way",
        code="B")
    taken = Integer(
        "moves.taken", 1, (4712, 0),
        "moves since the daemon's start",
        code="I")
    held = Integer(
        "moves.held", 1, (4729, 0),
        "1 = what moves waits on the path until it is resumed",
        code="B")
    speed = Measured(
        "moves.speed", 1, (4720, 0),
        "speed along the path, units/s",
        "1/s",
        code="f",
        factor=1)
    feed = Measured(
        "moves.feed", 1, (4716, 0),
        "part of the commanded speeds, 0 to 2",
        code="f",
        factor=1)
    end = Word(
        "moves.end", 1, (4727, 0),
        "how the last path has ended; 0 = there was none, or it has not; 1 = done",
        code="B",
        words={
            0: "none",
            1: "done",
            2: "aborted",
            3: "a motor or axis was switched off, or had a fault",
        })
    refusal = Word(
        "moves.refusal", 1, (4728, 0),
        "why the last move was not taken; 0 = it was",
        code="B",
        words={
            0: "none",
            1: "the queue is full",
            2: "there is no such motor or axis, or a value is invalid",
            3: "the path is being aborted",
            4: "a motor or axis is not enabled",
            5: "a motor or axis is homing",
            6: "a motor or axis is being moved by its commander",
            7: "its end is beyond a soft limit",
            8: "an earlier move was refused, or the path ended early",
        })
    motors = Integer(
        "moves.motors", 1, (4725, 0),
        "servo motors that are moved, one bit each",
        code="B")
    axes = Integer(
        "moves.axes", 1, (4730, 0),
        "axes of the pulse engine that are moved, one bit each",
        code="B")


class StateInfo(Part):
    """info"""

    __slots__ = ()
    SerialNumber = Integer("info.SerialNumber", 1, (136, 0), "serial number", code="I")
    type = Text("info.type", 1, (176, 0), "model, e.g. PoKeys57CNC", size=24)
    name = Text("info.name", 1, (152, 0), "the device's own name", size=24)
    build = Text("info.build", 1, (200, 0), "build date of the firmware", size=16)
    address = Address("info.address", 1, (140, 0), "IP address")
    DeviceTypeID = Integer("info.DeviceTypeID", 1, (144, 0), "hardware id", code="B")
    FirmwareMajor = Integer(
        "info.FirmwareMajor", 1, (145, 0),
        "firmware version, e.g. 4 of 4.7.15",
        code="B")
    FirmwareMinor = Integer(
        "info.FirmwareMinor", 1, (146, 0),
        "firmware version, e.g. 7 of 4.7.15",
        code="B")
    FirmwareRevision = Integer(
        "info.FirmwareRevision", 1, (147, 0),
        "firmware version, e.g. 15 of 4.7.15",
        code="B")
    UserID = Integer("info.UserID", 1, (148, 0), "the device's user id", code="B")
    ActivatedOptions = Integer(
        "info.ActivatedOptions", 1, (151, 0),
        "activated options, bits as the device reports them",
        code="B")
    PinCount = Integer("info.PinCount", 1, (216, 0), "digital pins", code="B")
    PWMCount = Integer("info.PWMCount", 1, (217, 0), "PWM channels", code="B")
    BasicEncoderCount = Integer("info.BasicEncoderCount", 1, (218, 0), "basic encoders", code="B")
    EncodersCount = Integer("info.EncodersCount", 1, (219, 0), "encoders of all kinds", code="B")
    FastEncoders = Integer("info.FastEncoders", 1, (220, 0), "fast encoders", code="B")
    UltraFastEncoders = Integer("info.UltraFastEncoders", 1, (221, 0), "ultra-fast encoders", code="B")
    PWMinternalFrequency = Integer(
        "info.PWMinternalFrequency", 1, (256, 0),
        "clock of the PWM counter, Hz",
        "Hz",
        code="I")
    AnalogInputs = Integer("info.AnalogInputs", 1, (222, 0), "analog inputs", code="B")
    KeyMapping = Integer("info.KeyMapping", 1, (236, 0), "key mapping", code="B")
    TriggeredKeyMapping = Integer(
        "info.TriggeredKeyMapping", 1, (237, 0),
        "triggered key mapping",
        code="B")
    KeyRepeatDelay = Integer("info.KeyRepeatDelay", 1, (238, 0), "key repeat delay", code="B")
    DigitalCounters = Integer("info.DigitalCounters", 1, (223, 0), "digital counters", code="B")
    JoystickButtonAxisMapping = Integer(
        "info.JoystickButtonAxisMapping", 1, (239, 0),
        "joystick button and axis mapping",
        code="B")
    JoystickAnalogToDigitalMapping = Integer(
        "info.JoystickAnalogToDigitalMapping", 1, (239, 0),
        "joystick analog to digital mapping",
        code="B")
    JoystickHATswitch = Integer("info.JoystickHATswitch", 1, (239, 0), "joystick hat switch", code="B")
    Macros = Integer("info.Macros", 1, (240, 0), "macros", code="B")
    MatrixKeyboard = Integer("info.MatrixKeyboard", 1, (224, 0), "matrix keyboard", code="B")
    MatrixKeyboardTriggeredMapping = Integer(
        "info.MatrixKeyboardTriggeredMapping", 1, (237, 0),
        "matrix keyboard with triggered mapping",
        code="B")
    LCD = Integer("info.LCD", 1, (225, 0), "LCD", code="B")
    MatrixLED = Integer("info.MatrixLED", 1, (226, 0), "matrix LED displays", code="B")
    ConnectionSignal = Integer("info.ConnectionSignal", 1, (243, 0), "connection signal", code="B")
    PoExtBus = Integer("info.PoExtBus", 1, (227, 0), "PoExtBus, bytes", code="B")
    PoNET = Integer("info.PoNET", 1, (228, 0), "PoNET", code="B")
    AnalogFiltering = Integer(
        "info.AnalogFiltering", 1, (241, 0),
        "filter of the analog inputs",
        code="B")
    InitOutputsStart = Integer(
        "info.InitOutputsStart", 1, (242, 0),
        "start values of outputs",
        code="B")
    protI2C = Integer("info.protI2C", 1, (229, 0), "I2C", code="B")
    prot1wire = Integer("info.prot1wire", 1, (230, 0), "1-wire", code="B")
    AdditionalOptions = Integer(
        "info.AdditionalOptions", 1, (245, 0),
        "options that can be activated",
        code="B")
    LoadStatus = Integer("info.LoadStatus", 1, (246, 0), "reports its processor load", code="B")
    CustomDeviceName = Integer("info.CustomDeviceName", 1, (247, 0), "custom device name", code="B")
    PoTLog27support = Integer("info.PoTLog27support", 1, (249, 0), "PoTLog27", code="B")
    SensorList = Integer("info.SensorList", 1, (248, 0), "sensor list", code="B")
    WebInterface = Integer("info.WebInterface", 1, (244, 0), "web interface", code="B")
    FailSafeSettings = Integer("info.FailSafeSettings", 1, (233, 0), "failsafe settings", code="B")
    pulse_engine_version = Integer(
        "info.pulse-engine-version", 1, (232, 0),
        "version of the pulse engine: 0 none, 1, 2",
        code="B")
    EasySensors = Integer("info.EasySensors", 1, (231, 0), "EasySensor slots", code="B")
    Axes = Integer(
        "info.Axes", 1, (234, 0),
        "axes of the pulse engine, as it reports",
        code="B")
    MaxPulseFrequency = Integer(
        "info.MaxPulseFrequency", 1, (235, 0),
        "highest pulse frequency of an axis, kHz",
        "kHz",
        code="B")


class StateDevice(Part):
    """device"""

    __slots__ = ()
    locked = Flag("device.locked", 1, (149, 0), "the device's configuration is locked")
    load = Integer(
        "device.load", 1, (150, 0),
        "the device's processor load, percent",
        "%",
        code="B")
    tick = Real(
        "device.tick", 1, (128, 0),
        "the device's own time, seconds since its start",
        "s",
        code="I",
        factor=0.001)
    access = Integer(
        "device.access", 1, (118, 0),
        "level of the device's password: 0 all, 255 locked",
        code="B")


class StateRtc(Part):
    """rtc"""

    __slots__ = ()
    sec = Integer("rtc.sec", 1, (2342, 0), "the device's clock: second", code="B")
    min = Integer("rtc.min", 1, (2341, 0), "minute", code="B")
    hour = Integer("rtc.hour", 1, (2340, 0), "hour", code="B")
    dow = Integer("rtc.dow", 1, (2343, 0), "day of the week, 0..6", code="B")
    dom = Integer("rtc.dom", 1, (2339, 0), "day of the month, 1..31", code="B")
    month = Integer("rtc.month", 1, (2338, 0), "month, 1..12", code="B")
    year = Integer("rtc.year", 1, (2336, 0), "year, e.g. 2026", code="H")
    doy = Integer("rtc.doy", 1, (2344, 0), "day of the year", code="H")


class StateConfig(Part):
    """config"""

    __slots__ = ()
    state = Integer(
        "config.state", 1, (2508, 0),
        "state of the device's settings: 0 not known, 1 differences wait for the machine to be off,"
        " 2 being written, 3 as requested, 4 some are refused",
        code="B")
    generation_applied = Integer(
        "config.generation-applied", 1, (2504, 0),
        "the one the daemon has in effect",
        code="I")
    foreign_count = Integer(
        "config.foreign-count", 1, (2516, 0),
        "settings of the device that another program has changed (see the log)",
        code="I")
    report_count = Integer(
        "config.report-count", 1, (2512, 0),
        "incremented when the reported settings of the device change",
        code="I")


class StateFailsafe(Part):
    """failsafe"""

    __slots__ = ()
    state = Integer(
        "failsafe.state", 1, (119, 0),
        "0 not known or none, 1 off, 2 on as configured, 3 on, but not as configured",
        code="B")


class StatePoExtBusItem(Part):
    """PoExtBus.NN"""

    __slots__ = ()
    in_ = Bit("PoExtBus.%02u.in", 80, (14720, 1), "as the device has it")


class StatePoExtBus(Parts[StatePoExtBusItem]):
    """PoExtBus"""

    __slots__ = ()
    _kind = StatePoExtBusItem
    _count = 80


class StatePoNETItem(Part):
    """PoNET.NN"""

    __slots__ = ()
    type = Integer("PoNET.%02u.type", 16, (1872, 24), "0 none, 16 kbd48CNC", code="B")
    address = Integer("PoNET.%02u.address", 16, (1873, 24), "address on the bus", code="B")
    size = Integer("PoNET.%02u.size", 16, (1874, 24), "bytes of data", code="B")
    options = Integer(
        "PoNET.%02u.options", 16, (1875, 24),
        "sum of 1 inputs, 2 outputs, 4 rotated, 8 light sensor, 16 mapped, 32 read, 64 configured, "
        "128 present",
        code="B")
    status = Integer("PoNET.%02u.status", 16, (1876, 24), "0 data are good", code="B")
    light = Integer("PoNET.%02u.light", 16, (1877, 24), "ambient light, 0..255", code="B")
    version = Integer(
        "PoNET.%02u.version", 16, (1878, 24),
        "version of the module's firmware",
        code="B")
    failures = Integer(
        "PoNET.%02u.failures", 16, (1879, 24),
        "consecutive exchanges without data",
        code="B")
    in_0 = Integer(
        "PoNET.%02u.in-0", 16, (1880, 24),
        "inputs: bytes 4 * n to 4 * n + 3, least first",
        code="I")
    in_1 = Integer(
        "PoNET.%02u.in-1", 16, (1884, 24),
        "inputs: bytes 4 * n to 4 * n + 3, least first",
        code="I")
    in_2 = Integer(
        "PoNET.%02u.in-2", 16, (1888, 24),
        "inputs: bytes 4 * n to 4 * n + 3, least first",
        code="I")
    in_3 = Integer(
        "PoNET.%02u.in-3", 16, (1892, 24),
        "inputs: bytes 4 * n to 4 * n + 3, least first",
        code="I")


class StatePoNET(Parts[StatePoNETItem]):
    """PoNET"""

    __slots__ = ()
    _kind = StatePoNETItem
    _count = 16
    state = Integer(
        "PoNET.state", 1, (1856, 0),
        "state of the bus: 10 ready, 0 inactive",
        code="B")
    count = Integer("PoNET.count", 1, (1857, 0), "modules found", code="B")


class StateMatrixItem(Bits):
    """matrix.NN"""

    __slots__ = ()
    _count = 8
    _bit = Bit(
        "matrix.%02u.%02u", 128, (14592, 1),
        "key of the matrix keyboard: row, column")


class StateMatrix(Parts[StateMatrixItem]):
    """matrix"""

    __slots__ = ()
    _kind = StateMatrixItem
    _count = 16
    enabled = Flag("matrix.enabled", 1, (1859, 0), "the device scans it")


class StateKbd48CNCItem(Part):
    """kbd48CNC.NN"""

    __slots__ = ()
    Button = Bit("kbd48CNC.%02u.Button", 48, (14912, 1), "key 4 * column + row is pressed")


class StateKbd48CNC(Parts[StateKbd48CNCItem]):
    """kbd48CNC"""

    __slots__ = ()
    _kind = StateKbd48CNCItem
    _count = 48
    module = Integer(
        "kbd48CNC.module", 1, (1858, 0),
        "which PoNET module it is; 255 none",
        code="B")


class StateRate(Part):
    """rate"""

    __slots__ = ()
    encoders_low = Real(
        "rate.encoders-low", 1, (2256, 0),
        "encoders 0..12, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    encoders_high = Real(
        "rate.encoders-high", 1, (2260, 0),
        "encoders 13..25, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    analog = Real(
        "rate.analog", 1, (2264, 0),
        "analog inputs, all, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    counters = Real(
        "rate.counters", 1, (2268, 0),
        "digital counters, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    PoExtBus = Real(
        "rate.PoExtBus", 1, (2272, 0),
        "PoExtBus, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    tick = Real(
        "rate.tick", 1, (2276, 0),
        "the device's time, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    pwm = Real(
        "rate.pwm", 1, (2280, 0),
        "PWM, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    load = Real(
        "rate.load", 1, (2284, 0),
        "the device's load, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    rtc = Real(
        "rate.rtc", 1, (2288, 0),
        "the device's clock, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    external = Real(
        "rate.external", 1, (2292, 0),
        "external outputs, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    identity = Real(
        "rate.identity", 1, (2296, 0),
        "identity, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    PoNET = Real(
        "rate.PoNET", 1, (2300, 0),
        "PoNET modules, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    dedicated = Real(
        "rate.dedicated", 1, (2304, 0),
        "dedicated inputs of the pulse engine, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    matrix = Real(
        "rate.matrix", 1, (2308, 0),
        "keys beyond the first 8 x 8, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    backlash = Real(
        "rate.backlash", 1, (2312, 0),
        "backlash added by the device, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    postep = Real(
        "rate.postep", 1, (2316, 0),
        "status of PoStep drivers, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)
    postep_rare = Real(
        "rate.postep-rare", 1, (2320, 0),
        "their currents, modes and versions, in turns, measured, Hz",
        "Hz",
        code="I",
        factor=0.001)


class StateValues(Part):
    """All values of the image."""

    __slots__ = ()
    link_state = Word(
        "link-state", 1, (116, 0),
        "0 searching, 1 identifying, 2 configuring, 3 running, 4 lost; as last reported by the "
        "daemon",
        code="B",
        words={
            0: "searching",
            1: "identifying",
            2: "configuring",
            3: "running",
            4: "lost",
        })
    fault = Word(
        "fault", 1, (117, 0),
        "why the link does not run, or did not the last time: 0 none, 1 no address, 2 no answer, 3 "
        "wrong serial number, 4 unsupported device, 5 setting refused, 6 locked, 7 rebooted, 8 "
        "network, 9 driven by another daemon or section, 10 the daemon's computer was suspended",
        code="B",
        words={
            0: "none",
            1: "no address",
            2: "no answer",
            3: "wrong serial number",
            4: "unsupported device",
            5: "setting refused",
            6: "configuration locked",
            7: "rebooted",
            8: "network unreachable",
            9: "in use",
            10: "computer was suspended",
        })
    fault_count = Integer(
        "fault-count", 1, (132, 0),
        "link faults since the daemon's start",
        code="I")
    reconnects = Integer(
        "reconnects", 1, (2968, 0),
        "times the device was found again",
        code="Q")
    cycle = Integer(
        "cycle", 1, (24, 0),
        "number of the daemon's cycle that published the values",
        code="Q")
    machine_on_permitted = Bit(
        "machine-on-permitted", 1, (899, 0),
        "the daemon permits motion, as last published")
    needs_edge = Bit(
        "needs-edge", 1, (900, 0),
        "machine-is-on is high, but must fall and rise again before anything moves; as last "
        "published")
    edge_unread = Bit(
        "edge-unread", 1, (907, 0),
        "machine-is-on is high, but its edge was refused: the positions that the commander had read"
        " were too old; as last published")
    outputs_held = Bit(
        "outputs-held", 1, (906, 0),
        "outputs are held in the safe state after a loss or an emergency stop, until machine-is-on "
        "rises; as last published")
    safe_state = Bit(
        "safe-state", 1, (898, 0),
        "the daemon holds outputs and axes in the safe state")
    command_refused = Bit(
        "command-refused", 1, (903, 0),
        "the daemon refused values of the last command")
    commander_alive = Bit("commander-alive", 1, (897, 0), "the heartbeat of a commander is fresh")
    command_refused_count = Integer(
        "command-refused-count", 1, (3008, 0),
        "values the daemon refused",
        code="Q")
    one_shot_refused_count = Integer(
        "one-shot-refused-count", 1, (3016, 0),
        "one-shot commands that the daemon refused",
        code="Q")
    rtt_us = Real(
        "rtt-us", 1, (2976, 0),
        "last round trip, microseconds",
        "us",
        code="I",
        factor=0.001)
    rtt_avg_us = Real(
        "rtt-avg-us", 1, (2980, 0),
        "smoothed round trip, microseconds",
        "us",
        code="I",
        factor=0.001)
    rtt_min_us = Real(
        "rtt-min-us", 1, (2988, 0),
        "shortest round trip, microseconds",
        "us",
        code="I",
        factor=0.001)
    rtt_max_us = Real(
        "rtt-max-us", 1, (2992, 0),
        "longest round trip, microseconds",
        "us",
        code="I",
        factor=0.001)
    rtt_jitter_us = Real(
        "rtt-jitter-us", 1, (2984, 0),
        "mean deviation of the round trip, microseconds",
        "us",
        code="I",
        factor=0.001)
    deadline_us = Real(
        "deadline-us", 1, (2996, 0),
        "time after which a request is sent again, microseconds",
        "us",
        code="I",
        factor=0.001)
    cycles_late = Integer(
        "cycles-late", 1, (2960, 0),
        "cycles whose fast data did not arrive in time",
        code="Q")
    phase_error_us = Real(
        "phase-error-us", 1, (2528, 0),
        "how much later the last read came than the daemon's cycle was scheduled for, microseconds",
        "us",
        code="i",
        factor=0.001)
    encoder_epoch = Integer(
        "encoder-epoch", 1, (2509, 0),
        "changes when the device may have restarted its counts",
        code="B")
    engine_state = Word(
        "engine-state", 1, (1080, 0),
        "pulse engine: 0 stopped, 3 running, 10 jogging, 11 stopping, 20 home, 21 homing, 30 "
        "probed, 31 probing, 32 probe error, 100 limit, 101 emergency",
        code="B",
        words={
            0: "stopped",
            1: "internal",
            2: "buffer",
            3: "running",
            10: "jogging",
            11: "stopping",
            20: "home",
            21: "homing",
            30: "probe complete",
            31: "probing",
            32: "probe error",
            40: "hybrid probe stopping",
            41: "hybrid probe complete",
            100: "stopped by limit",
            101: "stopped by emergency",
        })
    emergency = Flag(
        "emergency", 1, (1084, 0),
        "the pulse engine is in emergency, or its input is active")

    @property
    def age(self) -> StateAge:
        """age"""
        return StateAge(self._image, self._index)

    @property
    def daemon(self) -> StateDaemon:
        """daemon"""
        return StateDaemon(self._image, self._index)

    @property
    def command(self) -> StateCommand:
        """command"""
        return StateCommand(self._image, self._index)

    @property
    def packets(self) -> StatePackets:
        """packets"""
        return StatePackets(self._image, self._index)

    @property
    def phase(self) -> StatePhase:
        """phase"""
        return StatePhase(self._image, self._index)

    @property
    def pin(self) -> StatePin:
        """pin"""
        return StatePin(self._image, self._index)

    @property
    def counter(self) -> StateCounter:
        """counter"""
        return StateCounter(self._image, self._index)

    @property
    def adc(self) -> StateAdc:
        """adc"""
        return StateAdc(self._image, self._index)

    @property
    def encoder(self) -> StateEncoder:
        """encoder"""
        return StateEncoder(self._image, self._index)

    @property
    def pwm(self) -> StatePwm:
        """pwm"""
        return StatePwm(self._image, self._index)

    @property
    def external(self) -> StateExternal:
        """external"""
        return StateExternal(self._image, self._index)

    @property
    def external_relay(self) -> StateExternalRelay:
        """external-relay"""
        return StateExternalRelay(self._image, self._index)

    @property
    def engine(self) -> StateEngine:
        """engine"""
        return StateEngine(self._image, self._index)

    @property
    def task(self) -> StateTask:
        """task"""
        return StateTask(self._image, self._index)

    @property
    def joint(self) -> StateJoint:
        """joint"""
        return StateJoint(self._image, self._index)

    @property
    def threading(self) -> StateThreading:
        """threading"""
        return StateThreading(self._image, self._index)

    @property
    def heater(self) -> StateHeater:
        """heater"""
        return StateHeater(self._image, self._index)

    @property
    def servo(self) -> StateServo:
        """servo"""
        return StateServo(self._image, self._index)

    @property
    def moves(self) -> StateMoves:
        """moves"""
        return StateMoves(self._image, self._index)

    @property
    def info(self) -> StateInfo:
        """info"""
        return StateInfo(self._image, self._index)

    @property
    def device(self) -> StateDevice:
        """device"""
        return StateDevice(self._image, self._index)

    @property
    def rtc(self) -> StateRtc:
        """rtc"""
        return StateRtc(self._image, self._index)

    @property
    def config(self) -> StateConfig:
        """config"""
        return StateConfig(self._image, self._index)

    @property
    def failsafe(self) -> StateFailsafe:
        """failsafe"""
        return StateFailsafe(self._image, self._index)

    @property
    def PoExtBus(self) -> StatePoExtBus:
        """PoExtBus"""
        return StatePoExtBus(self._image, self._index)

    @property
    def PoNET(self) -> StatePoNET:
        """PoNET"""
        return StatePoNET(self._image, self._index)

    @property
    def matrix(self) -> StateMatrix:
        """matrix"""
        return StateMatrix(self._image, self._index)

    @property
    def kbd48CNC(self) -> StateKbd48CNC:
        """kbd48CNC"""
        return StateKbd48CNC(self._image, self._index)

    @property
    def rate(self) -> StateRate:
        """rate"""
        return StateRate(self._image, self._index)


STATE_SESSION = 2352
STATE_ONE_SHOT_ACK = 2356
STATE_ONE_SHOTS = 2360
STATE_COMMAND_TIME = 2496


STATE_HASH, STATE_SIZE = 0xffba3099fa38976e, 4736
STATE_VALUES: tuple[Value[Any], ...] = (
    StateValues.link_state, StateValues.fault, StateValues.fault_count, StateValues.reconnects,
    StateValues.cycle, StateAge.publish_us, StateAge.cycle_us, StateAge.digital_us, StateAge.analog_us,
    StateAge.analog_slow_us, StateAge.encoder_us, StateAge.motion_us, StateAge.slow_us, StateAge.postep_us,
    StateAge.link_us, StateAge.command_us, StateValues.machine_on_permitted, StateValues.needs_edge,
    StateValues.edge_unread, StateValues.outputs_held, StateValues.safe_state, StateValues.command_refused,
    StateValues.commander_alive, StateDaemon.realtime, StateDaemon.fallback, StateDaemon.guard,
    StateDaemon.stopping, StateDaemon.stale, StateDaemon.epoch, StateDaemon.period_us,
    StateDaemon.stale_after_us, StateCommand.heartbeat, StateValues.command_refused_count,
    StateValues.one_shot_refused_count, StateValues.rtt_us, StateValues.rtt_avg_us, StateValues.rtt_min_us,
    StateValues.rtt_max_us, StateValues.rtt_jitter_us, StateValues.deadline_us, StateValues.cycles_late,
    StatePackets.sent, StatePackets.resent, StatePackets.received, StatePackets.accepted, StatePackets.missed,
    StatePackets.late, StatePackets.lost, StatePackets.timed_out, StatePackets.stray, StatePackets.duplicate,
    StatePackets.stale, StatePackets.corrupt, StatePackets.wrong_source, StatePackets.send_failed,
    StatePackets.in_flight, StatePackets.error_level, StatePhase.state, StatePhase.master, StatePhase.losses,
    StateValues.phase_error_us, StatePhase.lead_us, StatePhase.jitter_us, StatePhase.period_us,
    StatePinItem.in_, StatePinItem.out_fb, StatePinItem.is_output, StatePinItem.function_in_effect,
    StatePinItem.can_input, StatePinItem.can_output, StatePinItem.can_analog, StatePinItem.can_count,
    StatePinItem.can_pwm, StateCounterItem.value, StateAdcItem.raw, StateAdcItem.volts,
    StateEncoderItem.rawcounts, StateEncoderItem.enabled, StateEncoderItem.index_seen,
    StateEncoderItem.age_us, StateEncoderItem.resyncs, StateValues.encoder_epoch, StatePwmItem.duty,
    StatePwmItem.enabled, StatePwm.period_ticks, StateExternalItem.out_fb, StateExternalRelayItem.out_fb,
    StateValues.engine_state, StateValues.emergency, StateEngine.axes_enabled, StateEngine.activated,
    StateEngine.charge_pump_state, StateEngine.generator_state, StateEngine.power_states_in_effect,
    StateEngine.probe_status, StateEngine.buffer_slots, StateEngine.buffer_level,
    StateEngine.buffer_underruns, StateEngine.buffer_resyncs, StateEngine.slot_us,
    StateEngine.limit_override_active, StateEngine.emergency_invert_in_effect,
    StateEngine.emergency_pin_in_effect, StateEngineMiscItem.in_, StateTask.kind, StateTask.phase,
    StateTask.result, StateTask.axes, StateTask.count, StateJointItem.counts, StateJointItem.counts_cmd,
    StateJointItem.counts_error, StateJointItem.counts_delayed, StateJointItem.counts_probed,
    StateJointItem.age_cmd_us, StateJointItem.max_rate, StateJointItem.max_rate_change,
    StateJointItem.soft_min, StateJointItem.soft_max, StateJointItem.pulses_per_unit, StateJointItem.name,
    StateJointItem.mode_in_effect, StateJointItem.position_epoch, StateJointItem.state,
    StateJointItem.enabled, StateJointItem.homed, StateJointItem.at_counts_cmd, StateJointItem.parked,
    StateJointItem.error, StateJointItem.limit_neg, StateJointItem.limit_pos, StateJointItem.home_sw,
    StateJointItem.soft_limit, StateJointItem.limit_neg_raw, StateJointItem.limit_pos_raw,
    StateJointItem.home_raw, StateJointItem.limit_neg_dedicated, StateJointItem.limit_pos_dedicated,
    StateJointItem.home_dedicated, StateJointItem.probed, StateThreading.preparing, StateThreading.prepared,
    StateThreading.waiting, StateThreading.active, StateThreading.velocity, StateThreading.position_error,
    StateThreading.spindle_rpm, StateThreading.index_count, StateThreading.behind, StateThreading.refusal,
    StateThreading.ignored_axes, StateJointItem.backlash_taken, StateJointItemPostep.supply,
    StateJointItemPostep.temperature, StateJointItemPostep.state, StateJointItemPostep.fault,
    StateJointItemPostep.faults, StateJointItemPostep.inputs, StateJointItemPostep.updates,
    StateJointItemPostep.age_ms, StateJointItemPostep.mode, StateJointItemPostep.step_mode_in_effect,
    StateJointItemPostep.temperature_limit_in_effect, StateJointItemPostep.current_raw,
    StateJointItemPostep.current_idle_raw, StateJointItemPostep.current_overheat_raw,
    StateJointItemPostep.hardware_major, StateJointItemPostep.hardware_minor,
    StateJointItemPostep.firmware_major, StateJointItemPostep.firmware_minor, StateHeaterItem.name,
    StateHeaterItem.state, StateHeaterItem.temperature, StateHeaterItem.age_ms,
    StateHeaterItem.target_in_effect, StateHeaterItem.power, StateHeaterItem.at_temperature,
    StateHeaterItem.fault, StateHeaterItem.fault_code, StateHeaterItem.condition, StateHeaterItem.obstacle,
    StateHeaterItem.refused, StateHeaterItem.faults, StateHeaterItem.power_limited, StateHeaterItem.fan,
    StateHeaterItem.stops_machine, StateHeaterItem.min_temperature, StateHeaterItem.max_temperature,
    StateHeaterItem.max_target, StateHeaterItem.pid_p, StateHeaterItem.pid_i, StateHeaterItem.pid_d,
    StateHeaterItem.tuning, StateHeaterItem.tune_cycles, StateHeaterItem.tuned_p, StateHeaterItem.tuned_i,
    StateHeaterItem.tuned_d, StateServoItem.name, StateServoItem.state, StateServoItem.pos_fb,
    StateServoItem.age_ms, StateServoItem.vel_fb, StateServoItem.commanded, StateServoItem.commanded_velocity,
    StateServoItem.error, StateServoItem.output, StateServoItem.fault_code, StateServoItem.condition,
    StateServoItem.obstacle, StateServoItem.refused, StateServoItem.homed, StateServoItem.limit_minus,
    StateServoItem.limit_plus, StateServoItem.home_state, StateServoItem.home_end, StateServoItem.home_switch,
    StateServoItem.tuning, StateServoItem.tune_reason, StateServoItem.tuned_p, StateServoItem.tuned_i,
    StateServoItem.tuned_d, StateServoItem.tuned_velocity_gain, StateServoItem.tuned_acceleration_gain,
    StateServoItem.tuned_acceleration, StateServoItem.faults, StateServoItem.encoder,
    StateServoItem.counts_per_unit, StateServoItem.min_position, StateServoItem.max_position,
    StateServoItem.pid_p, StateServoItem.pid_i, StateServoItem.pid_d, StateServoItem.velocity_gain,
    StateServoItem.acceleration_gain, StateServoItem.max_rate, StateServoItem.max_rate_change,
    StateMoves.state, StateMoves.waiting, StateMoves.taken, StateMoves.held, StateMoves.speed,
    StateMoves.feed, StateMoves.end, StateMoves.refusal, StateMoves.motors, StateMoves.axes,
    StateInfo.SerialNumber, StateInfo.type, StateInfo.name, StateInfo.build, StateInfo.address,
    StateInfo.DeviceTypeID, StateInfo.FirmwareMajor, StateInfo.FirmwareMinor, StateInfo.FirmwareRevision,
    StateInfo.UserID, StateInfo.ActivatedOptions, StateDevice.locked, StateDevice.load, StateDevice.tick,
    StateDevice.access, StateInfo.PinCount, StateInfo.PWMCount, StateInfo.BasicEncoderCount,
    StateInfo.EncodersCount, StateInfo.FastEncoders, StateInfo.UltraFastEncoders,
    StateInfo.PWMinternalFrequency, StateInfo.AnalogInputs, StateInfo.KeyMapping,
    StateInfo.TriggeredKeyMapping, StateInfo.KeyRepeatDelay, StateInfo.DigitalCounters,
    StateInfo.JoystickButtonAxisMapping, StateInfo.JoystickAnalogToDigitalMapping,
    StateInfo.JoystickHATswitch, StateInfo.Macros, StateInfo.MatrixKeyboard,
    StateInfo.MatrixKeyboardTriggeredMapping, StateInfo.LCD, StateInfo.MatrixLED, StateInfo.ConnectionSignal,
    StateInfo.PoExtBus, StateInfo.PoNET, StateInfo.AnalogFiltering, StateInfo.InitOutputsStart,
    StateInfo.protI2C, StateInfo.prot1wire, StateInfo.AdditionalOptions, StateInfo.LoadStatus,
    StateInfo.CustomDeviceName, StateInfo.PoTLog27support, StateInfo.SensorList, StateInfo.WebInterface,
    StateInfo.FailSafeSettings, StateInfo.pulse_engine_version, StateInfo.EasySensors, StateInfo.Axes,
    StateInfo.MaxPulseFrequency, StateRtc.sec, StateRtc.min, StateRtc.hour, StateRtc.dow, StateRtc.dom,
    StateRtc.month, StateRtc.year, StateRtc.doy, StateConfig.state, StateConfig.generation_applied,
    StateConfig.foreign_count, StateConfig.report_count, StateFailsafe.state, StatePoExtBusItem.in_,
    StatePoNET.state, StatePoNET.count, StatePoNETItem.type, StatePoNETItem.address, StatePoNETItem.size,
    StatePoNETItem.options, StatePoNETItem.status, StatePoNETItem.light, StatePoNETItem.version,
    StatePoNETItem.failures, StatePoNETItem.in_0, StatePoNETItem.in_1, StatePoNETItem.in_2,
    StatePoNETItem.in_3, StateMatrixItem._bit, StateMatrix.enabled, StateKbd48CNCItem.Button,
    StateKbd48CNC.module, StateRate.encoders_low, StateRate.encoders_high, StateRate.analog,
    StateRate.counters, StateRate.PoExtBus, StateRate.tick, StateRate.pwm, StateRate.load, StateRate.rtc,
    StateRate.external, StateRate.identity, StateRate.PoNET, StateRate.dedicated, StateRate.matrix,
    StateRate.backlash, StateRate.postep, StateRate.postep_rare)


class DiagnosticLatency(Part):
    """latency"""

    __slots__ = ()
    wakeup_p50_us = Quantile(
        "latency.wakeup-p50-us", 1, (160, 0),
        "from the start of the cycle until the daemon runs: median",
        "us",
        factor=0.001,
        quantile=0.5)
    wakeup_p99_us = Quantile(
        "latency.wakeup-p99-us", 1, (160, 0),
        "from the start of the cycle until the daemon runs: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    wakeup_p999_us = Quantile(
        "latency.wakeup-p999-us", 1, (160, 0),
        "from the start of the cycle until the daemon runs: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    wakeup_max_us = Quantile(
        "latency.wakeup-max-us", 1, (160, 0),
        "from the start of the cycle until the daemon runs: maximum",
        "us",
        factor=0.001,
        quantile=1)
    wakeup_count = Integer(
        "latency.wakeup-count", 1, (160, 0),
        "from the start of the cycle until the daemon runs: number of samples",
        code="Q")
    round_trip_p50_us = Quantile(
        "latency.round-trip-p50-us", 1, (1024, 0),
        "from a request to its answer: median",
        "us",
        factor=0.001,
        quantile=0.5)
    round_trip_p99_us = Quantile(
        "latency.round-trip-p99-us", 1, (1024, 0),
        "from a request to its answer: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    round_trip_p999_us = Quantile(
        "latency.round-trip-p999-us", 1, (1024, 0),
        "from a request to its answer: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    round_trip_max_us = Quantile(
        "latency.round-trip-max-us", 1, (1024, 0),
        "from a request to its answer: maximum",
        "us",
        factor=0.001,
        quantile=1)
    round_trip_count = Integer(
        "latency.round-trip-count", 1, (1024, 0),
        "from a request to its answer: number of samples",
        code="Q")
    fast_round_trip_p50_us = Quantile(
        "latency.fast-round-trip-p50-us", 1, (1888, 0),
        "round trip of the two fast requests: median",
        "us",
        factor=0.001,
        quantile=0.5)
    fast_round_trip_p99_us = Quantile(
        "latency.fast-round-trip-p99-us", 1, (1888, 0),
        "round trip of the two fast requests: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    fast_round_trip_p999_us = Quantile(
        "latency.fast-round-trip-p999-us", 1, (1888, 0),
        "round trip of the two fast requests: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    fast_round_trip_max_us = Quantile(
        "latency.fast-round-trip-max-us", 1, (1888, 0),
        "round trip of the two fast requests: maximum",
        "us",
        factor=0.001,
        quantile=1)
    fast_round_trip_count = Integer(
        "latency.fast-round-trip-count", 1, (1888, 0),
        "round trip of the two fast requests: number of samples",
        code="Q")
    read_round_trip_p50_us = Quantile(
        "latency.read-round-trip-p50-us", 1, (2752, 0),
        "round trip of requests that only read: median",
        "us",
        factor=0.001,
        quantile=0.5)
    read_round_trip_p99_us = Quantile(
        "latency.read-round-trip-p99-us", 1, (2752, 0),
        "round trip of requests that only read: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    read_round_trip_p999_us = Quantile(
        "latency.read-round-trip-p999-us", 1, (2752, 0),
        "round trip of requests that only read: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    read_round_trip_max_us = Quantile(
        "latency.read-round-trip-max-us", 1, (2752, 0),
        "round trip of requests that only read: maximum",
        "us",
        factor=0.001,
        quantile=1)
    read_round_trip_count = Integer(
        "latency.read-round-trip-count", 1, (2752, 0),
        "round trip of requests that only read: number of samples",
        code="Q")
    write_round_trip_p50_us = Quantile(
        "latency.write-round-trip-p50-us", 1, (3616, 0),
        "round trip of requests that write: median",
        "us",
        factor=0.001,
        quantile=0.5)
    write_round_trip_p99_us = Quantile(
        "latency.write-round-trip-p99-us", 1, (3616, 0),
        "round trip of requests that write: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    write_round_trip_p999_us = Quantile(
        "latency.write-round-trip-p999-us", 1, (3616, 0),
        "round trip of requests that write: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    write_round_trip_max_us = Quantile(
        "latency.write-round-trip-max-us", 1, (3616, 0),
        "round trip of requests that write: maximum",
        "us",
        factor=0.001,
        quantile=1)
    write_round_trip_count = Integer(
        "latency.write-round-trip-count", 1, (3616, 0),
        "round trip of requests that write: number of samples",
        code="Q")
    one_shot_round_trip_p50_us = Quantile(
        "latency.one-shot-round-trip-p50-us", 1, (4480, 0),
        "round trip of one-shot commands: median",
        "us",
        factor=0.001,
        quantile=0.5)
    one_shot_round_trip_p99_us = Quantile(
        "latency.one-shot-round-trip-p99-us", 1, (4480, 0),
        "round trip of one-shot commands: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    one_shot_round_trip_p999_us = Quantile(
        "latency.one-shot-round-trip-p999-us", 1, (4480, 0),
        "round trip of one-shot commands: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    one_shot_round_trip_max_us = Quantile(
        "latency.one-shot-round-trip-max-us", 1, (4480, 0),
        "round trip of one-shot commands: maximum",
        "us",
        factor=0.001,
        quantile=1)
    one_shot_round_trip_count = Integer(
        "latency.one-shot-round-trip-count", 1, (4480, 0),
        "round trip of one-shot commands: number of samples",
        code="Q")
    receive_p50_us = Quantile(
        "latency.receive-p50-us", 1, (5344, 0),
        "from a packet's arrival in the NIC's driver to the daemon: median",
        "us",
        factor=0.001,
        quantile=0.5)
    receive_p99_us = Quantile(
        "latency.receive-p99-us", 1, (5344, 0),
        "from a packet's arrival in the NIC's driver to the daemon: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    receive_p999_us = Quantile(
        "latency.receive-p999-us", 1, (5344, 0),
        "from a packet's arrival in the NIC's driver to the daemon: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    receive_max_us = Quantile(
        "latency.receive-max-us", 1, (5344, 0),
        "from a packet's arrival in the NIC's driver to the daemon: maximum",
        "us",
        factor=0.001,
        quantile=1)
    receive_count = Integer(
        "latency.receive-count", 1, (5344, 0),
        "from a packet's arrival in the NIC's driver to the daemon: number of samples",
        code="Q")
    data_p50_us = Quantile(
        "latency.data-p50-us", 1, (6208, 0),
        "from the start of the cycle until the fast data are complete: median",
        "us",
        factor=0.001,
        quantile=0.5)
    data_p99_us = Quantile(
        "latency.data-p99-us", 1, (6208, 0),
        "from the start of the cycle until the fast data are complete: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    data_p999_us = Quantile(
        "latency.data-p999-us", 1, (6208, 0),
        "from the start of the cycle until the fast data are complete: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    data_max_us = Quantile(
        "latency.data-max-us", 1, (6208, 0),
        "from the start of the cycle until the fast data are complete: maximum",
        "us",
        factor=0.001,
        quantile=1)
    data_count = Integer(
        "latency.data-count", 1, (6208, 0),
        "from the start of the cycle until the fast data are complete: number of samples",
        code="Q")
    publish_p50_us = Quantile(
        "latency.publish-p50-us", 1, (7072, 0),
        "time that publishing the state takes: median",
        "us",
        factor=0.001,
        quantile=0.5)
    publish_p99_us = Quantile(
        "latency.publish-p99-us", 1, (7072, 0),
        "time that publishing the state takes: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    publish_p999_us = Quantile(
        "latency.publish-p999-us", 1, (7072, 0),
        "time that publishing the state takes: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    publish_max_us = Quantile(
        "latency.publish-max-us", 1, (7072, 0),
        "time that publishing the state takes: maximum",
        "us",
        factor=0.001,
        quantile=1)
    publish_count = Integer(
        "latency.publish-count", 1, (7072, 0),
        "time that publishing the state takes: number of samples",
        code="Q")
    cycle_work_p50_us = Quantile(
        "latency.cycle-work-p50-us", 1, (7936, 0),
        "from the start of the cycle to the end of its work: median",
        "us",
        factor=0.001,
        quantile=0.5)
    cycle_work_p99_us = Quantile(
        "latency.cycle-work-p99-us", 1, (7936, 0),
        "from the start of the cycle to the end of its work: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    cycle_work_p999_us = Quantile(
        "latency.cycle-work-p999-us", 1, (7936, 0),
        "from the start of the cycle to the end of its work: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    cycle_work_max_us = Quantile(
        "latency.cycle-work-max-us", 1, (7936, 0),
        "from the start of the cycle to the end of its work: maximum",
        "us",
        factor=0.001,
        quantile=1)
    cycle_work_count = Integer(
        "latency.cycle-work-count", 1, (7936, 0),
        "from the start of the cycle to the end of its work: number of samples",
        code="Q")
    age_p50_us = Quantile(
        "latency.age-p50-us", 1, (8800, 0),
        "age of the fast data when the commander reads them: median",
        "us",
        factor=0.001,
        quantile=0.5)
    age_p99_us = Quantile(
        "latency.age-p99-us", 1, (8800, 0),
        "age of the fast data when the commander reads them: 99th percentile",
        "us",
        factor=0.001,
        quantile=0.99)
    age_p999_us = Quantile(
        "latency.age-p999-us", 1, (8800, 0),
        "age of the fast data when the commander reads them: 99.9th percentile",
        "us",
        factor=0.001,
        quantile=0.999)
    age_max_us = Quantile(
        "latency.age-max-us", 1, (8800, 0),
        "age of the fast data when the commander reads them: maximum",
        "us",
        factor=0.001,
        quantile=1)
    age_count = Integer(
        "latency.age-count", 1, (8800, 0),
        "age of the fast data when the commander reads them: number of samples",
        code="Q")


class DiagnosticAge(Part):
    """age"""

    __slots__ = ()
    diagnostics_us = Age(
        "age.diagnostics-us", 1, (32, 0),
        "time since these diagnostics were published, microseconds",
        "us",
        factor=0.001)


class DiagnosticDiagnostics(Part):
    """diagnostics"""

    __slots__ = ()
    cycle = Integer(
        "diagnostics.cycle", 1, (24, 0),
        "number of the cycle that published them",
        code="Q")
    epoch = Integer(
        "diagnostics.epoch", 1, (16, 0),
        "differs for each start of the daemon",
        code="Q")


class DiagnosticDaemon(Part):
    """daemon"""

    __slots__ = ()
    minor_faults = Integer(
        "daemon.minor-faults", 1, (112, 0),
        "page faults of the realtime thread in its loop, without disk access",
        code="Q")
    major_faults = Integer(
        "daemon.major-faults", 1, (120, 0),
        "page faults of the realtime thread in its loop, with disk access",
        code="Q")
    events_dropped = Integer(
        "daemon.events-dropped", 1, (48, 0),
        "log events dropped, queue full",
        code="Q")
    events_high_water = Integer(
        "daemon.events-high-water", 1, (56, 0),
        "most log events waiting at once",
        code="Q")


class DiagnosticTransport(Part):
    """transport"""

    __slots__ = ()
    kind = Text(
        "transport.kind", 1, (144, 0),
        "how packets travel: io_uring, socket, xdp",
        size=16)
    system_calls = Integer(
        "transport.system-calls", 1, (64, 0),
        "system calls of the transport",
        code="Q")
    waits_avoided = Integer(
        "transport.waits-avoided", 1, (72, 0),
        "waits avoided because the answer had already arrived",
        code="Q")
    rearmed = Integer(
        "transport.rearmed", 1, (80, 0),
        "times reception was re-armed",
        code="Q")
    no_buffers = Integer(
        "transport.no-buffers", 1, (88, 0),
        "times all reception buffers were full",
        code="Q")
    overflow = Integer(
        "transport.overflow", 1, (96, 0),
        "times the completion queue was full",
        code="Q")
    truncated = Integer(
        "transport.truncated", 1, (104, 0),
        "packets that were too long",
        code="Q")


class DiagnosticGuard(Part):
    """guard"""

    __slots__ = ()
    passed = Integer(
        "guard.passed", 1, (128, 0),
        "packets from any sender that the guard passed",
        code="Q")
    dropped = Integer(
        "guard.dropped", 1, (136, 0),
        "packets from any sender that the guard dropped",
        code="Q")


class DiagnosticValues(Part):
    """All values of the image."""

    __slots__ = ()
    cycles_skipped = Integer("cycles-skipped", 1, (40, 0), "ticks that the daemon missed", code="Q")

    @property
    def latency(self) -> DiagnosticLatency:
        """latency"""
        return DiagnosticLatency(self._image, self._index)

    @property
    def age(self) -> DiagnosticAge:
        """age"""
        return DiagnosticAge(self._image, self._index)

    @property
    def diagnostics(self) -> DiagnosticDiagnostics:
        """diagnostics"""
        return DiagnosticDiagnostics(self._image, self._index)

    @property
    def daemon(self) -> DiagnosticDaemon:
        """daemon"""
        return DiagnosticDaemon(self._image, self._index)

    @property
    def transport(self) -> DiagnosticTransport:
        """transport"""
        return DiagnosticTransport(self._image, self._index)

    @property
    def guard(self) -> DiagnosticGuard:
        """guard"""
        return DiagnosticGuard(self._image, self._index)


DIAG_HASH, DIAG_SIZE = 0x043bbadfaaa1ea0e, 9664
DIAG_VALUES: tuple[Value[Any], ...] = (
    DiagnosticLatency.wakeup_p50_us, DiagnosticLatency.wakeup_p99_us, DiagnosticLatency.wakeup_p999_us,
    DiagnosticLatency.wakeup_max_us, DiagnosticLatency.wakeup_count, DiagnosticLatency.round_trip_p50_us,
    DiagnosticLatency.round_trip_p99_us, DiagnosticLatency.round_trip_p999_us,
    DiagnosticLatency.round_trip_max_us, DiagnosticLatency.round_trip_count,
    DiagnosticLatency.fast_round_trip_p50_us, DiagnosticLatency.fast_round_trip_p99_us,
    DiagnosticLatency.fast_round_trip_p999_us, DiagnosticLatency.fast_round_trip_max_us,
    DiagnosticLatency.fast_round_trip_count, DiagnosticLatency.read_round_trip_p50_us,
    DiagnosticLatency.read_round_trip_p99_us, DiagnosticLatency.read_round_trip_p999_us,
    DiagnosticLatency.read_round_trip_max_us, DiagnosticLatency.read_round_trip_count,
    DiagnosticLatency.write_round_trip_p50_us, DiagnosticLatency.write_round_trip_p99_us,
    DiagnosticLatency.write_round_trip_p999_us, DiagnosticLatency.write_round_trip_max_us,
    DiagnosticLatency.write_round_trip_count, DiagnosticLatency.one_shot_round_trip_p50_us,
    DiagnosticLatency.one_shot_round_trip_p99_us, DiagnosticLatency.one_shot_round_trip_p999_us,
    DiagnosticLatency.one_shot_round_trip_max_us, DiagnosticLatency.one_shot_round_trip_count,
    DiagnosticLatency.receive_p50_us, DiagnosticLatency.receive_p99_us, DiagnosticLatency.receive_p999_us,
    DiagnosticLatency.receive_max_us, DiagnosticLatency.receive_count, DiagnosticLatency.data_p50_us,
    DiagnosticLatency.data_p99_us, DiagnosticLatency.data_p999_us, DiagnosticLatency.data_max_us,
    DiagnosticLatency.data_count, DiagnosticLatency.publish_p50_us, DiagnosticLatency.publish_p99_us,
    DiagnosticLatency.publish_p999_us, DiagnosticLatency.publish_max_us, DiagnosticLatency.publish_count,
    DiagnosticLatency.cycle_work_p50_us, DiagnosticLatency.cycle_work_p99_us,
    DiagnosticLatency.cycle_work_p999_us, DiagnosticLatency.cycle_work_max_us,
    DiagnosticLatency.cycle_work_count, DiagnosticLatency.age_p50_us, DiagnosticLatency.age_p99_us,
    DiagnosticLatency.age_p999_us, DiagnosticLatency.age_max_us, DiagnosticLatency.age_count,
    DiagnosticAge.diagnostics_us, DiagnosticDiagnostics.cycle, DiagnosticDiagnostics.epoch,
    DiagnosticValues.cycles_skipped, DiagnosticDaemon.minor_faults, DiagnosticDaemon.major_faults,
    DiagnosticDaemon.events_dropped, DiagnosticDaemon.events_high_water, DiagnosticTransport.kind,
    DiagnosticTransport.system_calls, DiagnosticTransport.waits_avoided, DiagnosticTransport.rearmed,
    DiagnosticTransport.no_buffers, DiagnosticTransport.overflow, DiagnosticTransport.truncated,
    DiagnosticGuard.passed, DiagnosticGuard.dropped)


class CommandPinItem(Part):
    """pin.NN"""

    __slots__ = ()
    out = Switch(
        "pin.%02u.out", 55, (960, 1),
        "digital output; followed if the device has the pin configured as an output",
        mask=(1024, 1))


class CommandPin(Parts[CommandPinItem]):
    """pin"""

    __slots__ = ()
    _kind = CommandPinItem
    _count = 55


class CommandPwmItem(Part):
    """pwm.NN"""

    __slots__ = ()
    value = Duty(
        "pwm.%02u.value", 6, (136, 4),
        "duty as a part of the period; LinuxCNC has a scale and an offset besides",
        code="I",
        whole=160,
        mask=(1312, 1),
        low=0, high=1)


class CommandPwm(Parts[CommandPwmItem]):
    """pwm"""

    __slots__ = ()
    _kind = CommandPwmItem
    _count = 6


class CommandExternalItem(Part):
    """external.NN"""

    __slots__ = ()
    out = Switch(
        "external.%02u.out", 8, (1600, 1),
        "output or relay of the board, see pokeys_terminals(7)",
        mask=(1608, 1))


class CommandExternal(Parts[CommandExternalItem]):
    """external"""

    __slots__ = ()
    _kind = CommandExternalItem
    _count = 8


class CommandExternalRelayItem(Part):
    """external-relay.NN"""

    __slots__ = ()
    out = Switch(
        "external-relay.%02u.out", 8, (1616, 1),
        "relay of the engine's connector, not of the board",
        mask=(1624, 1))


class CommandExternalRelay(Parts[CommandExternalRelayItem]):
    """external-relay"""

    __slots__ = ()
    _kind = CommandExternalRelayItem
    _count = 8


class CommandPoExtBusItem(Part):
    """PoExtBus.NN"""

    __slots__ = ()
    out = Switch("PoExtBus.%02u.out", 80, (1344, 1), "output of the bus", mask=(1472, 1))


class CommandPoExtBus(Parts[CommandPoExtBusItem]):
    """PoExtBus"""

    __slots__ = ()
    _kind = CommandPoExtBusItem
    _count = 80


class CommandPoNETItem(Part):
    """PoNET.NN"""

    __slots__ = ()
    out_0 = Level(
        "PoNET.%02u.out-0", 16, (208, 16),
        "outputs: bytes 4 * n to 4 * n + 3, least first",
        code="I",
        mask=(3840, 1),
        low=0, high=4294967295)
    out_1 = Level(
        "PoNET.%02u.out-1", 16, (212, 16),
        "outputs: bytes 4 * n to 4 * n + 3, least first",
        code="I",
        mask=(3840, 1),
        low=0, high=4294967295)
    out_2 = Level(
        "PoNET.%02u.out-2", 16, (216, 16),
        "outputs: bytes 4 * n to 4 * n + 3, least first",
        code="I",
        mask=(3840, 1),
        low=0, high=4294967295)
    out_3 = Level(
        "PoNET.%02u.out-3", 16, (220, 16),
        "outputs: bytes 4 * n to 4 * n + 3, least first",
        code="I",
        mask=(3840, 1),
        low=0, high=4294967295)
    brightness = Level(
        "PoNET.%02u.brightness", 16, (464, 1),
        "of the module's lamps, 255 is full",
        code="B",
        mask=(3840, 1),
        low=0, high=255)


class CommandPoNET(Parts[CommandPoNETItem]):
    """PoNET"""

    __slots__ = ()
    _kind = CommandPoNETItem
    _count = 16


class CommandKbd48CNCItem(Part):
    """kbd48CNC.NN"""

    __slots__ = ()
    LED = Switch(
        "kbd48CNC.%02u.LED", 48, (3904, 1),
        "lamp of the key; all are commanded together",
        mask=(3872, 0))


class CommandKbd48CNC(Parts[CommandKbd48CNCItem]):
    """kbd48CNC"""

    __slots__ = ()
    _kind = CommandKbd48CNCItem
    _count = 48
    brightness = Level(
        "kbd48CNC.brightness", 1, (485, 0),
        "brightness of its lamps, 255 is full",
        code="B",
        mask=(3873, 0),
        low=0, high=255)


class CommandHeaterItem(Part):
    """heater.NN"""

    __slots__ = ()
    target = Setpoint(
        "heater.%02u.target", 7, (624, 4),
        "target, degrees C; 0 = off. After the start and after a fault it has to be 0 once",
        "deg C",
        code="f",
        factor=1,
        mask=(5216, 1),
        low=0, high=2000)


class CommandHeater(Parts[CommandHeaterItem]):
    """heater"""

    __slots__ = ()
    _kind = CommandHeaterItem
    _count = 7


class CommandEngine(Part):
    """engine"""

    __slots__ = ()
    limit_override = Switch(
        "engine.limit-override", 1, (417, 0),
        "axes may leave their limit switches; the device has one override for all axes, so no limit"
        " switch stops any of them",
        mask=None)


class CommandValues(Part):
    """All values of the image."""

    __slots__ = ()
    machine_is_on = Switch(
        "machine-is-on", 1, (416, 0),
        "the machine is on: motion is requested; each rising edge requests it again",
        mask=None)
    emergency_stop = Switch(
        "emergency-stop", 1, (418, 0),
        "emergency stop: axes stop and outputs go to the safe state at once (see on-emergency in "
        "pokeysd.conf), until this pin is false and machine-is-on rises",
        mask=None)

    @property
    def pin(self) -> CommandPin:
        """pin"""
        return CommandPin(self._image, self._index)

    @property
    def pwm(self) -> CommandPwm:
        """pwm"""
        return CommandPwm(self._image, self._index)

    @property
    def external(self) -> CommandExternal:
        """external"""
        return CommandExternal(self._image, self._index)

    @property
    def external_relay(self) -> CommandExternalRelay:
        """external-relay"""
        return CommandExternalRelay(self._image, self._index)

    @property
    def PoExtBus(self) -> CommandPoExtBus:
        """PoExtBus"""
        return CommandPoExtBus(self._image, self._index)

    @property
    def PoNET(self) -> CommandPoNET:
        """PoNET"""
        return CommandPoNET(self._image, self._index)

    @property
    def kbd48CNC(self) -> CommandKbd48CNC:
        """kbd48CNC"""
        return CommandKbd48CNC(self._image, self._index)

    @property
    def heater(self) -> CommandHeater:
        """heater"""
        return CommandHeater(self._image, self._index)

    @property
    def engine(self) -> CommandEngine:
        """engine"""
        return CommandEngine(self._image, self._index)


COMMAND_READ_TIME = 32
COMMAND_SESSION = 48
COMMAND_ONE_SHOT_HEAD = 752
COMMAND_ONE_SHOTS = 760
COMMAND_AXES = 496
COMMAND_SERVOS = 656


COMMAND_HASH, COMMAND_SIZE = 0xc06793d84e920364, 4856
COMMAND_VALUES: tuple[Value[Any], ...] = (
    CommandPinItem.out, CommandPwmItem.value, CommandExternalItem.out, CommandExternalRelayItem.out,
    CommandPoExtBusItem.out, CommandPoNETItem.out_0, CommandPoNETItem.out_1, CommandPoNETItem.out_2,
    CommandPoNETItem.out_3, CommandPoNETItem.brightness, CommandKbd48CNCItem.LED, CommandKbd48CNC.brightness,
    CommandHeaterItem.target, CommandValues.machine_is_on, CommandValues.emergency_stop,
    CommandEngine.limit_override)


BOARD_OUTPUTS: dict[int, tuple[str, ...]] = {
    32: ("SSR2", "Relay 2", "Relay 1", "OC1", "OC2", "OC3", "OC4", "SSR1"),
    33: ("fan", "Relay 1", "Relay 2", "OC1", "OC2", "OC3", "OC4", "plasma relay"),
}
