#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""--json is valid JSON for whatever stands in an image, and its keys are those
that pokeysctl(1) lists: no key without documentation, none documented that is
not there."""
import json
import re
import subprocess
import sys


def refuse(word):
    raise ValueError(f"{word} is not JSON")


def keys(value, into):
    if isinstance(value, dict):
        for key, inner in value.items():
            into.add(key)
            keys(inner, into)
    elif isinstance(value, list):
        for inner in value:
            keys(inner, into)


def main():
    out = subprocess.run([sys.argv[1], "--print"], capture_output=True, timeout=120, check=True).stdout
    assert out.count(b"\n") == 1 and out.isascii(), "not one line of ASCII"
    document = json.loads(out, parse_constant=refuse)
    assert document["format"] == 1
    good, spoiled, away = document["devices"]
    assert good["fresh"] and good["publishing"] and good["attached"] and good["reason"] == ""
    assert len(good["state"]["inputs"]) == 55 and len(good["state"]["encoders"]) == 26
    assert abs(good["state"]["age_us"]["digital"] - 2000) < 1e-6
    assert good["state"]["age_us"]["analog"] is None
    assert good["diag"]["latency_us"]["wakeup"]["p50"] is None
    assert spoiled["state"]["identity"]["name"] == "\xff" * 24
    assert spoiled["state"]["identity"]["type"] == 'a"b\\c\n\x1b[2J\x01\x7f'
    assert spoiled["state"]["engine"]["axes"][0]["max_speed"] is None
    assert good["state"]["engine"]["axes"][0]["postep"] is None
    assert spoiled["state"]["engine"]["axes"][7]["postep"]["supply_v"] == 63.75
    assert good["state"]["heaters"] == []
    assert spoiled["state"]["heaters"][0]["index"] == 6 and spoiled["state"]["heaters"][0]["temperature"] is None
    assert spoiled["state"]["cycle"] == 2**64 - 1 and not spoiled["fresh"]
    assert away["state"] is None and away["reason"] == 'a "reason"' and not away["attached"]

    page = open(sys.argv[2], encoding="utf-8").read()
    section = page[page.index("# JSON"):page.index("# EXAMPLES")]
    documented = {name.replace("\\", "") for name in re.findall(r"\*([a-z0-9_\\]+)\*", section)}
    found = set()
    keys(document, found)
    # words of the section that are no keys of status, and the keys of discover
    documented -= {"null", "top", "discover", "dhcp"}
    # and those of config show and config diff
    documented -= {"device", "config_state", "refused_index", "settings", "differences",
                   "key", "wanted", "has"}
    # and those of doctor
    documented -= {"doctor", "problems", "advice", "unknown", "findings", "check", "subject", "verdict",
                   "why", "mend", "keep"}
    # and those of latency
    documented -= {"latency", "kernel", "virtual_machine", "priority", "seconds", "note", "series", "cpu",
                   "samples", "mean_us", "min_us", "p50_us", "p99_us", "p999_us", "max_us", "buckets",
                   "daemon"}
    # and those of get and names, which model / get reads
    documented -= {"get", "names", "values", "words", "images", "version", "hash", "size", "unit", "help", "hal",
                   "inner", "image", "storage", "offset", "stride", "inner_stride", "bit", "factor",
                   "divisor_offset", "quantile", "writable", "low", "high", "command", "mask_offset", "mask_bit", "read_time_offset", "t_thread_ns", "command_t_ns",
                   "session_offset", "one_shot_ack_offset", "one_shot_head_offset", "one_shots_offset", "axes_offset", "servos_offset", "command_time_offset",
                   "mask_stride", "judgement", "boards", "labels", "pwm", "pin", "terminal",
                   "terminals", "model", "pokeys_histogram_percentile"}
    # and those of terminals, which tools / terminals reads
    documented -= {"terminals", "model", "terminal", "hal", "can_be", "label", "also"}
    # and those of record and replay, which system / recorder compares
    documented -= {"record", "file", "packets", "events", "replay", "t_ns", "kind", "request", "reply",
                   "event", "level", "text", "operation", "id", "length", "round_trip_us", "data", "try",
                   "taken_us", "again_us", "answered_us"}
    # and those of events, which system / events reads
    documented -= {"events", "number", "time_ns", "monotonic_ns", "held"}
    # and those of trace, which tools / trace compares
    documented -= {"trace", "cycles", "dropped", "median_us", "longest_us", "slowest", "tick_ns", "length_us", "awake_us",
                   "skipped", "whole", "where_us", "parts", "where", "who", "us"}
    documented.discard("status")
    assert found <= documented, f"not documented: {sorted(found - documented)}"
    assert documented <= found, f"documented, but not there: {sorted(documented - found)}"
    print(f"{len(found)} keys")
    return 0


if __name__ == "__main__":
    sys.exit(main())
