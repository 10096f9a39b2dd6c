# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for what is told before there is a daemon, and after: HAL is loaded first."""
import os
from every_name import Act

# what a PoKeys57CNC is, by protocol sections 2.3 to 2.5
BOARD = {
    "PinCount": 55, "PWMCount": 6, "BasicEncoderCount": 25, "EncodersCount": 26,
    "FastEncoders": 3, "UltraFastEncoders": 1, "PWMinternalFrequency": 25000000,
    "AnalogInputs": 1, "DigitalCounters": 1, "MatrixKeyboard": 1, "LCD": 1, "MatrixLED": 2,
    "ConnectionSignal": 1, "PoExtBus": 10, "PoNET": 1, "AnalogFiltering": 1,
    "InitOutputsStart": 1, "protI2C": 1, "prot1wire": 1, "LoadStatus": 1, "CustomDeviceName": 1,
    "WebInterface": 1, "PulseEnginev2": 1, "EasySensors": 100, "Axes": 8,
    "MaxPulseFrequency": 125, "DeviceTypeID": 32, "FailSafeSettings": 1,
    "AdditionalOptions": 1, "KeyMapping": 1, "TriggeredKeyMapping": 1, "KeyRepeatDelay": 1,
    "JoystickButtonAxisMapping": 1, "JoystickAnalogToDigitalMapping": 1, "Macros": 1,
    "MatrixKeyboardTriggeredMapping": 1, "JoystickHATswitch": 1,
}
# boards that have them are older than what the daemon drives
NONE = ("PoTLog27support", "SensorList", "PulseEngine")

CONFIG = "transport = xdp\ninterface = lo"
START = Act("before and after the daemon's start", phases=2, before=lambda m: m.device())


def then(step, phase, value, before=0):
    step.daemon(bool(phase))
    step.shows(value if phase else before, state="there")


@START.rule(r"info\.(" + "|".join(BOARD) + ")")
def _(step, phase, what):
    then(step, phase, BOARD[what])


@START.rule(r"(?:rtt|deadline|latency)\b.*", r"packets\.(?:sent|received)", r"rate\.(?:tick|PoNET)",
            r"cycle", r"device\.tick", r"device\.load", r"engine\.slot-us", r"kbd48CNC\.light",
            r"rtc\.loop-frequ")
def _(step, phase):
    then(step, phase, lambda have: have > 0)


@START.rule(r"attach-state", r"enum-udp-dev", r"PoNET\.Deb\.Out")
def _(step, phase):
    then(step, phase, lambda have: have > 0)


VALUES = {"PEv2.nrOfAxes": 8, "PEv2.maxPulseFrequency": 125, "config.state": 3,
          "kbd48CNC.present": True, "kbd48CNC.available": True, "info.SerialNumber": 65432,
          "devSerial": 65432, "PEv2.PulseEngineEnabled": 8}


@START.rule(*(f"({name})".replace(".", r"\.") for name in VALUES))
def _(step, phase, name):
    then(step, phase, VALUES[name])


@START.rule(r"PoNET\.(\d+)\.moduleID")
def _(step, phase, i):
    if i:       # the first one's number is 0
        then(step, phase, i)
    else:
        step.fixed(0)


@START.rule(r"adcout\.(\d)\.PinId")
def _(step, phase, i):
    then(step, phase, 17 + i)


def may_be_realtime():
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(80))
        os.sched_setscheduler(0, *before)
        return True
    except PermissionError:
        return False


REALTIME = may_be_realtime()


@START.rule(r"daemon\.realtime")
def _(step, phase):
    if REALTIME:
        then(step, phase, True, False)
    else:
        step.fixed(False)


@START.rule(r"info\.(?:" + "|".join(NONE) + ")")
def _(step, phase):
    step.fixed(0)


# it is asked to use AF_XDP, which is not to be had on the loopback
@START.rule(r"daemon\.fallback")
def _(step, phase):
    then(step, phase, True, False)


ACTS = [START]
