# SPDX-License-Identifier: GPL-2.0-or-later
"""A client of pokeys-remote that sets pins as fast as they are taken. Prints JSON: how many settings.

usage: storm.py SECONDS
"""
import json
import sys
import time

import zmq
from pokeys_machinetalk_pb2 import Container

BIND, BIND_CONFIRM, SET, ACK = 256, 257, 259, 263
FLOAT, OUT = 2, 32
PINS, AT_ONCE, LIMIT_MS = 16, 32, 10000


def answer(socket, kind):
    if not socket.poll(LIMIT_MS):
        sys.exit("pokeys-remote does not answer")
    got = Container.FromString(socket.recv())
    if got.type != kind:
        sys.exit(f"pokeys-remote refuses: {b'; '.join(got.note).decode()}")
    return got


def main():
    end_at = time.monotonic() + float(sys.argv[1])
    socket = zmq.Context().socket(zmq.DEALER)
    socket.connect("tcp://127.0.0.1:6202")
    bind = Container(type=BIND)
    pins = bind.comp.add(name=b"storm").pin
    for number in range(PINS):
        pins.add(name=f"storm.{number}".encode(), type=FLOAT, dir=OUT)
    socket.send(bind.SerializeToString())
    handles = [pin.handle for pin in answer(socket, BIND_CONFIRM).comp[0].pin]
    done = 0
    while time.monotonic() < end_at:
        for number in range(AT_ONCE):
            setting = Container(type=SET, reply_required=number == AT_ONCE - 1)
            for handle in handles:
                setting.pin.add(handle=handle, type=FLOAT, halfloat=done + number)
            socket.send(setting.SerializeToString())
        answer(socket, ACK)
        done += AT_ONCE
    print(json.dumps({"settings": done, "pins": PINS}))


main()
