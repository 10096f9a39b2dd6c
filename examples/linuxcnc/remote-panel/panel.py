#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""A panel in a terminal: "run" and "stop" press buttons; what the machine does is printed.

Usage: panel.py                                    pokeys-remote runs on this computer
       panel.py ADDRESS PROXY.key NAME.key_secret  on another one: its address and key, and the panel's own keys
"""
import sys
import time

import zmq
import zmq.auth
from pokeys_machinetalk_pb2 import Container

PING, BIND, BIND_REJECT, SET, SET_REJECT, FULL = 210, 256, 258, 259, 260, 288
BIT, FLOAT, IN, OUT = 1, 2, 16, 32
PINS = {"panel.run": (BIT, OUT), "panel.stop": (BIT, OUT), "panel.running": (BIT, IN), "panel.x": (FLOAT, IN)}
PRESS, SIGN_OF_LIFE, SILENCE = 0.2, 1.0, 5.0        # s
context = zmq.Context()


def connect(kind, port):
    made, address = context.socket(kind), "127.0.0.1"
    if len(sys.argv) == 4:
        address, server, own = sys.argv[1:]
        made.curve_serverkey, _ = zmq.auth.load_certificate(server)
        made.curve_publickey, made.curve_secretkey = zmq.auth.load_certificate(own)
    made.connect(f"tcp://{address}:{port}")
    return made


def say(text):
    print(text, file=sys.stderr, flush=True)


def bind():
    request = Container(type=BIND)
    pins = request.comp.add(name=b"panel").pin
    for name, (kind, direction) in PINS.items():
        pins.add(name=name.encode(), type=kind, dir=direction)
    command.send(request.SerializeToString())


def press(button):
    handle = next((handle for handle, name in handles.items() if name == f"panel.{button}"), None)
    if handle is None or PINS[handles[handle]][1] != OUT:
        say("the buttons are run and stop" if handles else "not connected")
        return
    for value in (True, False):
        request = Container(type=SET)
        request.pin.add(handle=handle, type=BIT, halbit=value)
        command.send(request.SerializeToString())
        time.sleep(PRESS)               # as long as a finger


if len(sys.argv) not in (1, 4):
    sys.exit(__doc__)
command, update = connect(zmq.DEALER, 6202), connect(zmq.SUB, 6201)
handles = {}
said, heard = -SIGN_OF_LIFE, time.monotonic()
bind()
update.subscribe(b"panel")
poller = zmq.Poller()
for source in (command, update, sys.stdin):
    poller.register(source, zmq.POLLIN)
while True:
    ready = dict(poller.poll(SIGN_OF_LIFE * 1000))
    now = time.monotonic()
    if command in ready and (answer := Container.FromString(command.recv())).type in (BIND_REJECT, SET_REJECT):
        sys.exit(b"; ".join(answer.note).decode())
    if update in ready:
        message, heard = Container.FromString(update.recv_multipart()[1]), now
        if message.type == FULL:
            if handles:
                bind()                  # after a lost connection or a new proxy, which knows nothing of this panel
            handles = {pin.handle: pin.name.decode() for pin in message.comp[0].pin}
        for pin in (*message.pin, *(pin for component in message.comp for pin in component.pin)):
            if PINS[handles[pin.handle]][1] == IN:
                print(handles[pin.handle], pin.halbit if pin.type == BIT else round(pin.halfloat, 2), flush=True)
    elif heard and now - heard > SILENCE:
        heard = 0
        say("nothing comes from pokeys-remote")
    if sys.stdin.fileno() in ready:
        if not (line := sys.stdin.readline()):
            sys.exit()
        press(line.strip())
    if now - said >= SIGN_OF_LIFE:
        command.send(Container(type=PING).SerializeToString())
        said = now
