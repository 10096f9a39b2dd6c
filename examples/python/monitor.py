#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A monitor in Python: what the daemon knows of a device, live.

The same as examples/monitor.c, through pokeys.py. It may be started before the
daemon and survives it; how old the data are is decided here, by this program's
clock.
"""
import argparse
import json
import sys
import time

import pokeys


def facts(device, state):
    """What both kinds of output show."""
    return {
        "device": device,
        "link": pokeys.LINK[state.link] if state.link < len(pokeys.LINK) else "unknown",
        "fresh": pokeys.fresh(state),
        "serial": state.identity.serial,
        "epoch": state.epoch,
        "cycle": state.cycle,
        "age_ms": {"cycle": pokeys.age_ms(state.t_publish_ns),
                   "digital": pokeys.age_ms(state.t_digital_ns),
                   "analog": pokeys.age_ms(state.t_analog_ns),
                   "encoder": pokeys.age_ms(state.t_encoder_ns),
                   "motion": pokeys.age_ms(state.t_motion_ns)},
        "inputs": "".join("01"[b] for b in pokeys.bits(state.digital_in)),
        "outputs": "".join("01"[b] for b in pokeys.bits(state.digital_out)),
        "analog": list(state.analog)[:pokeys.ANALOG],
        "encoders": list(state.encoder),
        "positions": [axis.position for axis in state.engine.axis],
        "late": state.statistics.late,
        "lost": state.statistics.lost,
        "sent": state.statistics.sent,
    }


def ten_by_ten(pins):
    return " ".join(pins[i:i + 10].replace("0", ".") for i in range(0, len(pins), 10))


def numbered(values, shown):
    return " ".join(f"{i}:{value}" for i, value in enumerate(values) if shown(i))


def print_text(now, state):
    ages = "  ".join(f"{name} " + ("never" if age is None else f"{age:.2f}")
                     for name, age in now["age_ms"].items())
    print(f"{now['device']}: {now['link']}{'' if now['fresh'] else ' (STALE)'}, "
          f"serial {now['serial']}, cycle {now['cycle']}")
    print(f"  age ms    {ages}")
    print(f"  inputs    {ten_by_ten(now['inputs'])}")
    print(f"  outputs   {ten_by_ten(now['outputs'])}")
    print(f"  analog    {' '.join(map(str, now['analog']))}")
    print(f"  encoders  {numbered(now['encoders'], lambda i: state.encoder_enabled >> i & 1)}")
    axes = min(state.engine.axes_enabled, pokeys.AXES)
    off = ["" if axis.enabled else "(off)" for axis in state.engine.axis]
    positions = [f"{i}:{now['positions'][i]}{off[i]}" for i in range(axes)]
    print(f"  axes      {' '.join(positions) or 'none set up in the device'}")


def show(client, options):
    """One look: True if there was something to show."""
    client.poll()
    state = client.read()
    if state is None:
        print(f"{options.device}: {client.status()[1]}", file=sys.stderr)
        return False
    now = facts(options.device, state)
    if options.json:
        print(json.dumps(now), flush=True)
    else:
        print_text(now, state)
    return True


def seconds(text):
    value = float(text)
    if not 0.01 <= value <= 3600:
        raise argparse.ArgumentTypeError("0.01..3600 is allowed")
    return value


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0],
                                     allow_abbrev=False)
    parser.add_argument("device", nargs="?", help="its name in pokeysd.conf; default: the first one")
    parser.add_argument("-r", "--runtime-directory", metavar="DIR", dest="runtime",
                        help="folder of the daemon's shared memory")
    parser.add_argument("--interval", type=seconds, default=0.5, metavar="S",
                        help="seconds between two looks, 0.01..3600 (default 0.5)")
    parser.add_argument("--once", action="store_true")
    parser.add_argument("-j", "--json", action="store_true", help="one object a line")
    return parser.parse_args()


def wait(client, interval):
    """Until the interval is over; news come ten times a second and when the link changes."""
    last = time.monotonic() + interval
    while (left := last - time.monotonic()) > 0:
        client.wait(int(left * 1000) + 1)


def main():
    options = arguments()
    if not options.device:
        options.device = next(iter(pokeys.devices(options.runtime)), None)
    if not options.device:
        print("no daemon runs; name a DEVICE to wait for it", file=sys.stderr)
        return 1
    with pokeys.Client(options.device, options.runtime, "monitor-py", pokeys.EVENTS) as client:
        shown = show(client, options)
        while not options.once:
            wait(client, options.interval)
            shown = show(client, options)
    return 0 if shown else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(0)
    except pokeys.LibraryMissing as missing:
        sys.exit(str(missing))
    except PermissionError as why:
        print(f"the runtime folder: {why.strerror}; this user must be in its group, "
              "which is pokeys-monitor as a rule", file=sys.stderr)
        sys.exit(1)
    except OSError:
        print("not a device name, or the runtime folder is no path from /", file=sys.stderr)
        sys.exit(2)
