#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The gateway's way to pokeys-remote, with a control socket that says what a test tells it to.

A real pokeys-remote with LinuxCNC is in tests/remote/gateway.py.
"""
import asyncio
import contextlib
import json
import os
import socket
import traceback

from pokeys_gateway import operate, wire
from pokeys_gateway.operate import OPERATORS_MOST, Operator, Operators
from pokeys_gateway.wire import NotDone

PATIENCE = 30               # s; only decides when to give up


class Fake:
    """A control socket. ``answers`` is what it does with a request; it answers nothing while ``silent``."""

    def __init__(self):
        self.name = f"test-{os.getpid()}-{id(self)}"
        self.asked, self.writers, self.silent = [], [], False
        self.unanswered = []
        self.refusal = None
        self.errors = {}

    async def __aenter__(self):
        self.server = await asyncio.start_unix_server(self.serve, f"\0pokeys-remote/{self.name}")
        return self

    async def __aexit__(self, *_):
        self.server.close()
        for writer in self.writers:
            writer.close()

    async def serve(self, reader, writer):
        self.writers.append(writer)
        if self.refusal:
            writer.write(self.refusal)
            writer.close()
            return
        while line := await reader.readline():
            one = json.loads(line)
            self.asked.append((one["method"].partition(".")[2], self.writers.index(writer)))
            if one["params"].get("later"):
                self.unanswered.append((one["id"], writer))
            elif not self.silent:
                fault = self.errors.get(one["method"])
                self.send({"id": one["id"], **({"error": {"code": 1, "message": fault}} if fault else {"result": True})},
                          writer)

    def answer(self):
        """What was to be answered later."""
        for number, writer in self.unanswered:
            self.send({"id": number, "result": True}, writer)

    def send(self, message, writer=None):
        (writer or self.writers[0]).write(json.dumps({"jsonrpc": "2.0", **message}).encode() + b"\n")

    def state(self, **values):
        self.send({"method": "linuxcnc.state", "params": values})

    def methods(self, besides=("subscribe",)):
        return [method for method, _ in self.asked if method not in besides]


class Client:
    """What a client gets; it fetches states when it has room."""

    def __init__(self, shared):
        self.shared, self.told, self.offers = shared, [], []
        self.operator = Operator(shared, self.offers.append, self.say, self.tell)

    def say(self, said):
        self.told.append(said)

    async def tell(self, said):
        self.told.append(said)

    def fetch(self):
        """The state that waits, or None."""
        return self.offers.pop(0)()["params"] if self.offers else None

    async def ask(self, method, turn=0, old=False, **params):
        def judge(takes_back):
            if not takes_back and turn != self.shared.turn:
                raise NotDone("it was stopped")
            if not takes_back and old:
                raise NotDone("it is old")
        await self.operator.ask(method, params, "id", judge)


async def until(what, test):
    async def look():
        while not test():
            await asyncio.sleep(0.01)
    try:
        await asyncio.wait_for(look(), PATIENCE)
    except TimeoutError:
        raise AssertionError(what) from None


async def refused(work, text):
    try:
        await asyncio.wait_for(work, PATIENCE)
    except NotDone as error:
        assert text in str(error), (text, str(error))
        return
    raise AssertionError(f"not refused: {text}")


async def one_connection_for_the_state(fake, shared):
    one, two = Client(shared), Client(shared)
    await one.ask("subscribe")
    fake.state(connected=True, task="on", line=1)
    await until("it is offered", lambda: one.offers)
    await two.ask("subscribe")
    assert two.fetch() == {"connected": True, "task": "on", "line": 1}
    # one reads nothing meanwhile, and gets what is true then, once
    for line in range(2, 9):
        fake.state(line=line)
        await until("the other sees it", lambda line=line: (two.fetch() or {}).get("line") == line)
    assert len(one.offers) == 1 and one.fetch() == {"connected": True, "task": "on", "line": 8}
    fake.send({"method": "linuxcnc.said", "params": {"kind": "text", "text": "x"}})
    await until("both clients have the message", lambda: one.told and two.told)
    fake.state(position={"x": float("nan")})
    await until("it is offered", lambda: two.offers)
    assert two.fetch() == {"position": {"x": None}}
    one.fetch()
    assert len(fake.writers) == 1, "a connection for each"
    one.operator.close()
    fake.state(line=9)
    await until("the other sees it", lambda: two.fetch() == {"line": 9})
    assert not one.offers


async def one_who_comes_as_the_last_one_leaves(fake, shared):
    """The connection for the state ends with its last client, and not under the next one."""
    one, two = Client(shared), Client(shared)
    await one.ask("subscribe")
    coming = asyncio.create_task(two.ask("subscribe", later=True))
    await until("it has asked", lambda: fake.unanswered)
    one.operator.close()
    asked = len(fake.asked)
    await until("another beat", lambda: coming.done() or len(fake.asked) > asked)
    fake.answer()
    await asyncio.wait_for(coming, PATIENCE)
    fake.state(connected=True, task="on")
    await until("the state", lambda: two.offers)


async def a_proxy_that_ends_and_comes_again(fake, shared):
    one = Client(shared)
    await one.ask("subscribe")
    fake.state(connected=True, task="on")
    await until("it is offered", lambda: one.offers)
    one.fetch()
    fake.writers[0].close()
    await until("it is said", lambda: one.offers)
    assert one.fetch() == {"connected": False, "why": f"{fake.name} has ended"}
    await until("it is there again", lambda: len(fake.writers) == 2)
    fake.send({"method": "linuxcnc.state", "params": {"connected": True, "task": "off"}}, fake.writers[1])
    await until("it is offered", lambda: one.offers)
    while (seen := one.fetch()) != {"connected": True, "task": "off"}:
        assert not (seen or {}).get("connected"), seen
        await asyncio.sleep(0.01)


async def a_proxy_that_is_silent(fake, shared):
    one = Client(shared)
    await one.ask("subscribe")
    fake.state(connected=True, task="on", line=1)
    await until("it is offered", lambda: one.offers)
    one.fetch()
    operate.ANSWER_S = 0.1
    fake.silent = True
    await until("it is said", lambda: one.offers)
    assert one.fetch() == {"connected": False, "why": f"{fake.name} does not answer"}
    # what it says meanwhile is not shown, and not forgotten
    fake.state(line=2)
    operate.ANSWER_S = PATIENCE
    fake.silent = False
    await until("it is there again", lambda: one.offers)
    assert one.fetch() == {"connected": True, "task": "on", "line": 2}


async def a_stop_ends_what_came_before_it(fake, shared):
    one, two = Client(shared), Client(shared)
    stop = shared.begin_stop("stop")
    await refused(one.ask("mdi", line="G0 X1"), "it was stopped")
    await stop
    await one.ask("mdi", turn=1, line="G0 X2")
    assert fake.methods() == ["stop", "mdi"]
    # what the kernel has not taken of a command is not sent any more
    await two.ask("pause", turn=1)
    for writer in fake.writers:
        writer.transport.pause_reading()
    waiting = [asyncio.create_task(two.ask("mdi", turn=1, line="G0 " + "x" * 3900)) for _ in range(63)]
    await until("the kernel takes no more", lambda: two.operator._wire and two.operator._wire.unsent)
    await refused(two.ask("mdi", turn=1, line="G0"), "64 commands are under way, which is the most")
    shared.begin_stop("stop")
    for one in waiting:
        await refused(one, "it was stopped")


async def stops_are_never_one(fake, shared):
    """A command may have come between two of them."""
    await shared.begin_stop("stop")
    fake.silent = True
    stops = [shared.begin_stop("stop") for _ in range(3)]
    await until("all of them are sent", lambda: fake.methods() == ["stop"] * 4)
    assert len(fake.writers) == 1
    # a stop whose connection ends before the answer is sent again
    fake.silent = False
    fake.writers[0].close()
    for one in stops:
        await one
    assert fake.methods() == ["stop"] * 7 and len(fake.writers) == 2
    fake.silent = True
    operate.STOP_S = 0.05
    await refused(shared.begin_stop("emergency_stop"), "does not confirm the stop")
    fake.errors["linuxcnc.stop"], fake.silent, operate.STOP_S = "LinuxCNC does not answer", False, PATIENCE
    await refused(shared.begin_stop("stop"), "LinuxCNC does not answer")


async def so_many_operate_and_no_more(fake, shared):
    clients = [Client(shared) for _ in range(OPERATORS_MOST + 5)]
    found = await asyncio.gather(*(one.ask("pause") for one in clients), return_exceptions=True)
    assert [str(one) for one in found if one] == [f"{OPERATORS_MOST} clients operate already, which is the most"] * 5
    await clients[-1].ask("subscribe")
    await shared.begin_stop("stop")
    assert len(fake.writers) == OPERATORS_MOST + 1
    clients[0].operator.close()
    await clients[-1].ask("pause", turn=1)
    # a command that was accepted is done later, and says of which request
    fake.send({"method": "linuxcnc.done", "params": {"id": 1, "error": None}}, fake.writers[1])
    await until("it is done", lambda: clients[1].told)
    assert clients[1].told == [{"jsonrpc": "2.0", "method": "linuxcnc.done", "params": {"id": "id", "error": None}}]


async def what_is_old_is_not_sent(fake, shared):
    one = Client(shared)
    await refused(one.ask("run", old=True), "it is old")
    for params in ({"speed": 0}, {"speed": 0, "axis": ["x"]}):
        await one.ask("jog", old=True, **params)
    await one.ask("subscribe", old=True)
    # the key has to be pressed again
    for press, old, turn, text in ((1, True, 0, "it is old"), (1, False, 0, "this press has ended"),
                                   (2, False, 1, "it was stopped"), (2, False, 0, "this press has ended")):
        await refused(one.ask("jog", axis="x", speed=1, press=press, old=old, turn=turn), text)
    await one.ask("jog", axis="y", speed=1, press=2)
    await one.ask("jog", axis="x", speed=1, press=3)
    for number in range(100):
        await refused(one.ask("jog", axis=[number], speed=1, press=4, old=True), "it is old")
    assert fake.methods() == ["jog"] * 4
    # pokeys-remote that has ended knows nothing of what was held
    fake.writers[0].close()
    await until("it has ended", lambda: one.operator._wire.ended)
    await refused(one.ask("jog", axis="x", speed=1, press=3), "this press has ended")
    await one.ask("jog", axis="x", speed=1, press=4)


async def one_who_is_gone_asks_for_nothing(fake, shared):
    one = Client(shared)
    await one.ask("pause")
    asked = asyncio.create_task(one.ask("run"))
    one.operator.close()
    await refused(asked, "its client is gone")
    await refused(one.ask("run"), "its client is gone")
    await asyncio.sleep(0.05)
    assert fake.methods() == ["pause"] and not shared.commanding


async def a_proxy_that_takes_no_connections(fake, shared):
    fake.server.close()
    with socket.socket(socket.AF_UNIX) as stopped:
        stopped.bind(f"\0pokeys-remote/{fake.name}-stopped")
        stopped.listen(0)
        crowd = [socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK) for _ in range(3)]
        taken = 0
        with contextlib.suppress(BlockingIOError):
            for one in crowd:
                one.connect(stopped.getsockname())
                taken += 1
        shared.proxy += "-stopped"
        wire.CONNECT_S = 0.1
        await refused(shared.begin_stop("stop"), f"{shared.proxy} does not answer")
        wire.CONNECT_S = PATIENCE
        stop = shared.begin_stop("stop")
        await asyncio.sleep(0.1)
        for _ in range(taken):
            stopped.accept()[0].close()
        stopped.setblocking(False)
        # a stop that is lost is sent twice
        for _ in range(2):
            made, _ = await asyncio.get_running_loop().sock_accept(stopped)
            assert b"linuxcnc.stop" in await asyncio.get_running_loop().sock_recv(made, 4096)
            made.close()
        await refused(stop, "has ended")
        for one in crowd:
            one.close()


async def what_is_wrong_is_said(fake, shared):
    one = Client(shared)
    await refused(one.ask("mdi", line="x" * 5000), "the request is too long")
    fake.refusal = b'{"jsonrpc":"2.0","id":null,"error":{"code":-32000,"message":"user 7 may not command"}}\n'
    await refused(one.ask("subscribe"), f"{fake.name}: user 7 may not command")
    await refused(one.ask("pause"), f"{fake.name}: user 7 may not command")
    for nonsense in (b"x\n", b"[]\n", b"7\n", b'{"id":null}\n', b'{"method":1}\n', b'{"method":"linuxcnc.state"}\n',
                     b'{"id":1,"error":7}\n', b"\xff\n", b"{" * 2_000_000):
        fake.refusal = nonsense
        await refused(one.ask("subscribe"), f"{fake.name}")
        await refused(one.ask("pause"), f"{fake.name}")
    fake.refusal = None
    fake.server.close()
    await refused(one.ask("pause"), "does not run; a HAL file of LinuxCNC starts it by loadusr -W pokeys-remote")
    await refused(shared.begin_stop("stop"), "does not run")


async def run(test):
    operate.ANSWER_S = operate.STOP_S = PATIENCE
    operate.BEAT_S = 0.02
    async with Fake() as fake:
        shared = Operators(fake.name)
        await test(fake, shared)
        shared.close()
        for task in asyncio.all_tasks() - {asyncio.current_task()}:
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError, Exception):
                await task


def main():
    failed = 0
    for each in (one_connection_for_the_state, one_who_comes_as_the_last_one_leaves,
                 a_proxy_that_ends_and_comes_again, a_proxy_that_is_silent, a_stop_ends_what_came_before_it,
                 stops_are_never_one, so_many_operate_and_no_more, what_is_old_is_not_sent,
                 one_who_is_gone_asks_for_nothing, a_proxy_that_takes_no_connections, what_is_wrong_is_said):
        try:
            asyncio.run(run(each))
            print(f"ok: {each.__name__}")
        except Exception as fault:  # pylint: disable=broad-exception-caught
            failed += 1
            print(f"FAILED: {each.__name__}: {fault}\n{traceback.format_exc()}")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
