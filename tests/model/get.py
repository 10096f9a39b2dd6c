#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl get shows what the device does, and names.json is enough to read the images.

The second is tried by a reader of its own, which knows nothing but names.json: it takes
the image as bytes, and all its values have to be those of pokeysctl."""
import ctypes
import json
import pathlib
import re
import signal
import struct
import sys

sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))
from house import House, equal, main, wait_equal, wait_for  # noqa: E402

FORMATS = {("unsigned", 1): "B", ("unsigned", 2): "H", ("unsigned", 4): "I", ("unsigned", 8): "Q",
           ("signed", 2): "h", ("signed", 4): "i", ("signed", 8): "q", ("float", 4): "f", ("float", 8): "d"}


def names_json():
    return json.loads(House.programs["names.json"].read_text(encoding="ascii"))


class Client:
    """The images as bytes."""

    def __init__(self, house):
        self.library = ctypes.CDLL(str(next(path for name, path in House.programs.items() if ".so" in name)))
        self.library.pokeys_shm_layout.restype = ctypes.c_uint64
        self.library.pokeys_histogram_percentile.restype = ctypes.c_uint64
        self.library.pokeys_histogram_percentile.argtypes = ctypes.c_void_p, ctypes.c_double
        self.client = ctypes.c_void_p()
        equal(self.library.pokeys_client_open(ctypes.byref(self.client), str(house.runtime).encode(), b"mill",
                                              b"test", 0), 0)
        wait_equal("the daemon", lambda: self.library.pokeys_client_poll(self.client), 1)

    def read(self, image, size):
        into = ctypes.create_string_buffer(size)
        call = self.library.pokeys_client_read if image == "state" else self.library.pokeys_client_read_diag
        equal(call(self.client, into), 0, image)
        return into.raw

    def percentile(self, histogram, part):
        return self.library.pokeys_histogram_percentile(ctypes.create_string_buffer(histogram, len(histogram)), part)

    def close(self):
        self.library.pokeys_client_close(self.client)


def number(row, image, at, client):
    if row["storage"] == "flag":
        return image[at] != 0
    if row["storage"] == "text":
        return image[at:at + row["size"]].split(b"\0")[0].decode("latin-1")
    if row["storage"] == "ipv4":
        return ".".join(map(str, reversed(image[at:at + 4])))
    if row["storage"] == "histogram":
        return client.percentile(image[at:], row["quantile"]) if any(image[at:at + 8]) else None
    return struct.unpack_from("<" + FORMATS[row["storage"], row["size"]], image, at)[0]


def values(row, image, client):
    """By name, as names.json says."""
    for i in range(row["count"]):
        for k in range(row.get("inner", 1)):
            name = row["name"] % ((i, k)[:row["name"].count("%")])
            at = row["offset"]
            place = i * row.get("stride", 0) + k * row.get("inner_stride", 0)
            if row["storage"] == "bit":
                place += row["bit"]
                yield name, bool(image[at + place // 8] >> place % 8 & 1)
                continue
            value = number(row, image, at + place, client)
            if "divisor_offset" in row:
                whole = struct.unpack_from("<I", image, row["divisor_offset"])[0]
                value = value / whole if whole else 0
            if "factor" in row and value is not None:
                value *= row["factor"]
            yield name, value


def test_names_json_is_enough_to_read_the_images():
    with House() as house:
        house.device_keys["mill"] |= {"digital-inputs": "4,9", "digital-outputs": "31-34", "analog-inputs": "43",
                                      "pwm-period": 25000}
        sim = house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        for words in (("pin", 4, 0), ("pin", 9, 1), ("analog", 43, 2000)):
            house.ask_sim(sim, *words)
        house.says("get", "mill", "pin.03.in", stdout="false\n")
        house.says("get", "mill", "adc.02.raw", stdout="2000\n")
        wait_for("the diagnostic image", lambda: house.ctl("get", "mill", "latency.wakeup-count").stdout != "-\n")
        model, client = names_json(), Client(house)
        equal(client.library.pokeys_shm_layout(0), int(model["images"]["state"]["hash"], 16))
        equal(client.library.pokeys_shm_layout(1), int(model["images"]["diag"]["hash"], 16))
        # from now on nothing changes but the time
        daemon.send_signal(signal.SIGSTOP)
        try:
            said = house.says("get", "mill", "stale", stdout="true\n")
            equal(said.returncode, 2)
            found = json.loads(house.ctl("get", "mill", "--json").stdout)["values"]
            images = {name: client.read(name, image["size"]) for name, image in model["images"].items() if name != "command"}
        finally:
            daemon.send_signal(signal.SIGCONT)
        compared = 0
        for row in model["names"]:
            if row["writable"] or row["image"] == "judgement" or row["storage"] == "timestamp":
                continue
            for name, value in values(row, images[row["image"]], client):
                other = found.pop(name)
                if isinstance(value, float) and isinstance(other, float):
                    assert abs(other - value) <= 1e-6 * abs(value), (name, value, other)
                else:
                    equal(other, value, name)
                compared += 1
        client.close()
        assert compared > 1700, compared
        assert all(re.search("^age|age-|^(connected|stale|daemon-alive)$", name) for name in found), found
        print(f"{compared} values")


def test_values_follow_the_device():
    with House() as house:
        house.device_keys["mill"] |= {"digital-inputs": "4,9", "digital-outputs": "31-34", "analog-inputs": "43"}
        sim = house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        for level, word in ((0, "false"), (1, "true")):
            house.ask_sim(sim, "pin", 4, level)
            house.says("get", "mill", "pin.03.in", stdout=f"{word}\n", stderr="", returncode=0)
        house.says("get", "mill", "link-state", stdout="3\n")
        house.says("get", "mill", "link-*", stdout="link-state  3 (running)\n")
        house.ask_sim(sim, "analog", 43, 4095)
        house.tells("adc.02.volts  3.29919434 V    terminal 43", "get", "mill", "adc.0?.volts")
        house.says("get", "mill", "info.type", "connected", returncode=0,
                   stdout="connected  true\ninfo.type  PoKeys57CNC\n")
        lines = house.ctl("get", "mill").stdout.splitlines()
        equal(len(lines), sum(row["count"] * row.get("inner", 1) for row in names_json()["names"]
                              if not row["writable"]))
        said = json.loads(house.ctl("get", "mill", "--json", "link-state", "pin.03.*").stdout)
        equal((said["device"], said["fresh"], said["reason"]), ("mill", True, ""))
        equal((said["values"]["link-state"], said["words"]), (3, {"link-state": "running"}))
        equal(said["values"]["pin.03.in"], True)
        # what is old is still shown, and the status says it
        sim.kill()
        wait_equal("the loss", lambda: house.ctl("get", "mill", "pin.03.in").returncode, 2)
        said = house.says("get", "mill", "pin.03.in", stdout="true\n", returncode=2)
        assert re.fullmatch(r"pokeysctl: mill: .*; these are the last known values\n", said.stderr), said


def test_it_is_said_what_is_wrong():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.says("get", "lathe", returncode=1, stdout="",
                   stderr=f'pokeysctl: the daemon in {house.runtime} has no device "lathe"; it has: mill\n')


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
