# SPDX-License-Identifier: GPL-2.0-or-later
"""A client of pokeys-remote that sets pins as fast as they are taken. Prints JSON: how many settings.

usage: storm.py SECONDS [alone]

"alone": the same work with messages, whose pins are those of a dictionary; nothing is sent, and HAL is not touched.
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


def settings(handles, value, reply):
    setting = Container(type=SET, reply_required=reply)
    for handle in handles:
        setting.pin.add(handle=handle, type=FLOAT, halfloat=value)
    return setting.SerializeToString()


def alone(end_at):
    pins, done = {}, 0
    pair = [zmq.Context.instance().socket(zmq.PAIR) for _ in range(2)]
    pair[0].bind("inproc://alone")
    pair[1].connect("inproc://alone")
    while time.monotonic() < end_at:
        for number in range(AT_ONCE):
            pair[0].send(settings(range(PINS), done + number, False))
        for _ in range(AT_ONCE):
            for pin in Container.FromString(pair[1].recv()).pin:
                pins[pin.handle] = pin.halfloat
        done += AT_ONCE
    return done


def against_pokeys_remote(end_at):
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
            socket.send(settings(handles, done + number, number == AT_ONCE - 1))
        answer(socket, ACK)
        done += AT_ONCE
    return done


def main():
    work = alone if sys.argv[2:] == ["alone"] else against_pokeys_remote
    print(json.dumps({"settings": work(time.monotonic() + float(sys.argv[1])), "pins": PINS}))


main()
