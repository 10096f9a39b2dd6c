# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the clock and the device itself."""
import datetime
from every_name import Act

SET_CLOCK = Act("the clock is set", phases=4)
WANTED = ({"sec": 5, "min": 6, "hour": 13, "dom": 28, "month": 2, "year": 2031},
          {"sec": 1, "min": 44, "hour": 2, "dom": 9, "month": 11, "year": 2052})


# a phase in which the button is released, one in which it is pressed
@SET_CLOCK.rule(r"rtc\.set-(sec|min|hour|dom|month|year)")
def _(step, phase, part):
    value = WANTED[phase // 2][part]
    step.set(value)
    if phase % 2:
        step.shows((lambda have: value <= have < value + 30) if part == "sec" else value,
                   f"rtc.{part}", phase)


@SET_CLOCK.rule(r"rtc\.set")
def _(step, phase):
    step.press(bool(phase % 2))
    if phase:
        step.shows(WANTED[(phase - 1) // 2]["year"], "rtc.year")


@SET_CLOCK.rule(r"rtc\.set-outcome")
def _(step, phase):
    step.shows(1 if phase else 0)


CLOCK = Act("the device's clock", phases=2)
MOMENTS = [datetime.datetime(2031, 3, 4, 5, 6, 7), datetime.datetime(2044, 12, 31, 20, 50, 30)]


def seconds(moment):
    return int(moment.replace(tzinfo=datetime.timezone.utc).timestamp())


PARTS = {"min": lambda at: at.minute, "hour": lambda at: at.hour, "dom": lambda at: at.day,
         "month": lambda at: at.month, "year": lambda at: at.year,
         "dow": lambda at: (at.weekday() + 1) % 7, "doy": lambda at: at.timetuple().tm_yday}


@CLOCK.rule(r"rtc\.(min|hour|dom|month|year|dow|doy)")
def _(step, phase, part):
    step.sim(f"field device.clock 0 {seconds(MOMENTS[phase])}")
    step.shows(PARTS[part](MOMENTS[phase]))


@CLOCK.rule(r"rtc\.lastmin")
def _(step, phase):
    step.shows(WANTED[1]["min"] if not phase else MOMENTS[0].minute)


@CLOCK.rule(r"rtc\.sec")
def _(step, phase):
    # it goes on
    step.shows(lambda have: MOMENTS[phase].second <= have < MOMENTS[phase].second + 23,
               state=phase)


@CLOCK.rule(r"rtc\.tmp")
def _(step, phase):
    step.sim(f"field device.clock-rule 0 {7 + phase}")
    step.shows(7 + phase)


IDENTITY = Act("the device itself", phases=2)


@IDENTITY.rule(r"device\.load")
def _(step, phase):
    step.sim(f"load {30 + 20 * phase}")
    step.shows(30 + 20 * phase)


@IDENTITY.rule(r"info\.UserID")
def _(step, phase):
    step.sim(f"field device.user-id 0 {5 + phase}")
    step.shows(5 + phase)


@IDENTITY.rule(r"info\.ActivatedOptions")
def _(step, phase):
    step.sim(f"field device.activated 0 {1 - phase}")
    step.shows(1 - phase)


@IDENTITY.rule(r"info\.Firmware(Major|Minor|Revision)")
def _(step, phase, part):
    step.sim(f"firmware {(0x37, 0x48)[phase]} {15 + phase}")
    step.shows({"Major": 4 + phase, "Minor": 7 + phase, "Revision": 15 + phase}[part])


@IDENTITY.rule(r"devSerial", r"info\.SerialNumber")
def _(step, phase):
    step.sim(f"serial {70000 + phase}")
    step.shows(70000 + phase)


# what is learned when the device is found: it is switched off and on
@IDENTITY.rule(r"info\.DeviceTypeID")
def _(step, phase):
    step.sim("reboot keep-config")
    step.shows(32)


LOCKED = Act("a locked device", phases=2)


@LOCKED.rule(r"device\.locked")
def _(step, phase):
    step.sim(f"field device.locked 0 {1 - phase}")
    step.sim("save")
    step.sim("reboot keep-config")
    step.shows(not phase)


@LOCKED.rule(r"fault")
def _(step, phase):
    # rebooted, or locked if there was something to be written
    if not phase:
        step.shows(lambda have: have in (6, 7), state="new")


TIME = Act("time goes on", phases=1)


@TIME.rule(r"rtc\.(?:loopcount|lastsec)")
def _(step, phase):
    step.changes()


ACCESS = Act("a device behind a password", phases=3)


# asked for when it is found again
@ACCESS.rule(r"device\.access")
def _(step, phase):
    if phase == 1:
        step.sim("field device.access 0 255")
        step.sim("silence 3600000")
        step.shows(lambda have: have != 3, "link-state", state="away")
        return
    step.sim("silence 0")
    step.shows(255 if phase else 0)


ACTS = [SET_CLOCK, CLOCK, TIME]
DEVICE = [IDENTITY, LOCKED, ACCESS]
