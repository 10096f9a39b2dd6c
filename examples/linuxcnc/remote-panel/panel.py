#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""A panel in a terminal: "run" and "stop" press buttons; what the machine does is printed."""
import sys
import time

import zmq
from pokeys_machinetalk_pb2 import Container

PING, BIND, REJECT, SET, FULL = 210, 256, 258, 259, 288
BIT, FLOAT, IN, OUT = 1, 2, 16, 32
PINS = {"panel.run": (BIT, OUT), "panel.stop": (BIT, OUT), "panel.running": (BIT, IN), "panel.x": (FLOAT, IN)}
handles = {}
said = -1.0
context = zmq.Context()
command, update = context.socket(zmq.DEALER), context.socket(zmq.SUB)
command.connect("tcp://127.0.0.1:6202")
update.connect("tcp://127.0.0.1:6201")
bind = Container(type=BIND)
pins = bind.comp.add(name=b"panel").pin
for name, (kind, direction) in PINS.items():
    pins.add(name=name.encode(), type=kind, dir=direction)
command.send(bind.SerializeToString())
update.subscribe(b"panel")
poller = zmq.Poller()
for source in (command, update, sys.stdin):
    poller.register(source, zmq.POLLIN)
while True:
    ready = dict(poller.poll(1000))
    if command in ready and (answer := Container.FromString(command.recv())).type == REJECT:
        sys.exit(b"; ".join(answer.note).decode())
    if update in ready:
        message = Container.FromString(update.recv_multipart()[1])
        if message.type == FULL:
            handles = {pin.handle: pin.name.decode() for pin in message.comp[0].pin}
        for pin in (*message.pin, *(pin for component in message.comp for pin in component.pin)):
            print(handles[pin.handle], pin.halbit if pin.type == BIT else round(pin.halfloat, 2), flush=True)
    if sys.stdin.fileno() in ready:
        if not (line := sys.stdin.readline()):
            sys.exit()
        pressed = f"panel.{line.strip()}"
        for value in (True, False):
            for handle in [handle for handle, name in handles.items() if name == pressed]:
                button = Container(type=SET)
                button.pin.add(handle=handle, type=BIT, halbit=value)
                command.send(button.SerializeToString())
            time.sleep(0.2)             # as long as a finger
    if time.monotonic() - said > 1.0:   # the sign of life
        command.send(Container(type=PING).SerializeToString())
        said = time.monotonic()
