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
    print(f"  axes      {numbered(now['positions'], lambda i: state.engine.axis[i].enabled)}")


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


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--runtime", help="runtime folder of the daemon")
    parser.add_argument("--device", help="its name in pokeysd.conf; default: the first one")
    parser.add_argument("--interval", type=int, default=500, metavar="MS")
    parser.add_argument("--once", action="store_true")
    parser.add_argument("--json", action="store_true", help="one object a line")
    return parser.parse_args()


def main():
    options = arguments()
    if not options.device:
        options.device = next(iter(pokeys.devices(options.runtime)), None)
    if not options.device:
        print("no daemon runs; name the --device to wait for it", file=sys.stderr)
        return 1
    with pokeys.Client(options.device, options.runtime, "monitor-py", pokeys.EVENTS) as client:
        shown = show(client, options)
        while not options.once:
            client.wait(options.interval)
            shown = show(client, options)
    return 0 if shown else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(0)
