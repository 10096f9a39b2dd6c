# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC, operated through pokeys-remote(1) of its session.

Each client that gives commands has a connection of its own to pokeys-remote, which ends with the client: then
pokeys-remote stops what the client jogs. LinuxCNC's state, and all stops, come and go over one connection that the
gateway shares, so that neither a command nor the number of clients is ever before a stop.

A stop also ends what is still on its way here: each request has the number of stops that came before it (its
*turn*), and a request of an earlier turn is not sent any more.
"""
from __future__ import annotations

import asyncio
import contextlib
import functools
import itertools
import logging
from collections.abc import Awaitable, Callable
from typing import Any

from .wire import NotDone, Wire, encode

METHODS = ("mode", "mdi", "run", "pause", "resume", "home", "override", "jog", "subscribe")
STOPS = ("stop", "emergency_stop")
ANSWER_S = 2.0              # pokeys-remote answers commands at once
STOP_S = 7.0                # and stops when LinuxCNC has taken them, or after 6 s
BEAT_S = 1.0                # between looks at pokeys-remote
UNDER_WAY_MOST = 64         # commands of a client
OPERATORS_MOST = 32         # clients; pokeys-remote has twice as many places
AXES_MOST, SHOWN = 32, 80   # whose presses are remembered, and characters of their names
GONE = "its client is gone"
_LOG = logging.getLogger("pokeys-gateway")


class Operators:
    """What all clients share: LinuxCNC's state, and the way for stops."""

    def __init__(self, proxy: str) -> None:
        self.proxy = proxy
        self.turn = 0               # how many stops there were
        self.commanding: set[Operator] = set()
        self.on_stop: Callable[[], None] = lambda: None     # one has come, from whomever
        self._subscribed: set[Operator] = set()
        self._joining = 0           # who will be one of them
        self._state: dict[str, Any] = {}
        self._silent = ""           # why what is in the state is not shown
        self._numbers = itertools.count(1)
        self._wire: Wire | None = None
        self._opening: asyncio.Task[Wire] | None = None
        self._stops: set[asyncio.Task[None]] = set()
        self._beating: asyncio.Task[None] | None = None

    def begin_stop(self, method: str) -> asyncio.Future[None]:
        """One has come: nothing is sent any more of what came before it. Done when LinuxCNC has taken it; or
        :class:`NotDone`. It goes on if nobody waits for it."""
        self.turn += 1
        for operator in list(self.commanding):
            operator.cut()
        stop = asyncio.get_running_loop().create_task(self._stop(method))
        self._stops.add(stop)
        stop.add_done_callback(self._stops.discard)
        stop.add_done_callback(lambda done: done.cancelled() or done.exception())
        try:
            self.on_stop()
        except Exception:
            _LOG.exception("a stop that goes on")
        return stop

    async def _stop(self, method: str) -> None:
        try:
            await asyncio.wait_for(self._stop_twice(method), STOP_S)
        except TimeoutError:
            raise NotDone(f"{self.proxy} does not confirm the stop") from None

    async def _stop_twice(self, method: str) -> None:
        wire = await self._open()
        try:
            await self._send(wire, method, {})
        except NotDone:
            if not wire.ended:
                raise
            # nobody has heard it at the other end
            await self._send(await self._open(), method, {})

    async def _send(self, wire: Wire, method: str, params: dict[str, Any]) -> None:
        number = next(self._numbers)
        await wire.send(number, encode(number, method, params))

    async def subscribe(self, operator: Operator, params: dict[str, Any]) -> None:
        """It gets the whole state, and what changes. :class:`NotDone`."""
        self._joining += 1
        try:
            await self._subscribe(params)
        finally:
            self._joining -= 1
        self._know("")
        if operator.closed:
            return
        self._subscribed.add(operator)
        operator.take(self._shown)
        if not self._beating:
            self._beating = asyncio.get_running_loop().create_task(self._beat())

    def leave(self, operator: Operator) -> None:
        """The client is gone."""
        self._subscribed.discard(operator)

    def close(self) -> None:
        """The gateway ends."""
        # a cancelled task may go on: wait_for() of Python 3.11 can lose it
        self._subscribed.clear()
        if self._beating:
            self._beating.cancel()
        if self._opening:
            self._opening.cancel()
        if self._wire:
            self._wire.close(f"{self.proxy} is not needed any more")

    @property
    def _shown(self) -> dict[str, Any]:
        return {"connected": False, "why": self._silent} if self._silent else dict(self._state)

    async def _open(self) -> Wire:
        """For all who wait for it, which succeeds or fails for all of them."""
        if self._wire and not self._wire.ended:
            return self._wire
        if not self._opening:
            self._opening = asyncio.get_running_loop().create_task(Wire.open(self.proxy, self._heard, self._lost))
            self._opening.add_done_callback(self._opened)
        return await asyncio.shield(self._opening)

    def _opened(self, opening: asyncio.Task[Wire]) -> None:
        self._opening = None
        if not opening.cancelled() and not opening.exception():
            self._wire = opening.result()

    async def _subscribe(self, params: dict[str, Any]) -> None:
        try:
            await asyncio.wait_for(self._send(await self._open(), "subscribe", params), ANSWER_S)
        except TimeoutError:
            raise NotDone(f"{self.proxy} does not answer") from None

    async def _beat(self) -> None:
        """As long as somebody sees the state: connect again, and notice that pokeys-remote does not answer."""
        while self._subscribed or self._joining or self._stops:
            silent = ""
            try:
                await self._subscribe({})
            except NotDone as error:
                silent = str(error)
            except Exception:
                _LOG.exception("LinuxCNC's state")
                silent = "an error of the gateway; its log says more"
            self._know(silent)
            await asyncio.sleep(BEAT_S)
        self._beating = None
        self.close()

    def _know(self, silent: str) -> None:
        if silent != self._silent:
            self._silent = silent
            self._tell(self._shown)

    async def _heard(self, said: dict[str, Any]) -> None:
        if said["method"] == "linuxcnc.state":
            changed = said["params"]
            # what came before it is to be forgotten
            self._state = changed if "connected" in changed else {**self._state, **changed}
            if not self._silent:
                self._tell(changed)
        elif said["method"] == "linuxcnc.said":
            for operator in self._subscribed:
                operator.say(said)

    def _lost(self, wire: Wire) -> None:
        self._state = {}
        self._know(wire.why)

    def _tell(self, changed: dict[str, Any]) -> None:
        for operator in self._subscribed:
            operator.take(changed)


class Operator:
    """One client's. Its commands keep their order, however many callers wait for answers."""

    def __init__(self, shared: Operators, offer: Callable[[Callable[[], dict[str, Any]]], None],
                 say: Callable[[dict[str, Any]], None], tell: Callable[[dict[str, Any]], Awaitable[None]]) -> None:
        """``offer`` fetches a state when the client has room for it, ``say`` takes a notification if there is room, and
        ``tell`` waits for room."""
        self._shared, self._offer, self.say, self._tell = shared, offer, say, tell
        self.closed = False
        self.on_lost: Callable[[str], None] = lambda why: None      # what pokeys-remote has not done is lost
        self._wire: Wire | None = None
        self._numbers = itertools.count(1)
        self._order = asyncio.Lock()
        self._commands: dict[int, Any] = {}         # ids of the client by ours, until they are done
        self._pressed: dict[str, Any] = {}          # the newest press of each axis
        self._over: dict[str, Any] = {}             # presses that do not begin any more
        self._news: dict[str, Any] = {}             # of LinuxCNC's state, which the client does not have

    async def ask(self, method: str, params: dict[str, Any], identity: Any, judge: Callable[[bool], None]) -> None:
        """Until pokeys-remote has taken a command. :class:`NotDone`, or what ``judge`` raises.

        It is called when the command is to be sent, and says if it still may be; its argument is true for one that
        gives nothing to LinuxCNC.
        """
        if method == "subscribe":
            await self._shared.subscribe(self, params)
            return
        if method != "jog" or params.get("speed") == 0:
            await self._command(method, params, identity, functools.partial(judge, method == "jog"))
            return
        # as in pokeys-remote, a jog that was refused does not begin while the key is still down
        axis, press = str(params.get("axis"))[:SHOWN], params.get("press")
        if axis in self._over and self._over[axis] == press:
            raise NotDone("this press has ended")
        try:
            await self._command(method, params, identity, functools.partial(judge, False))
        except Exception:
            self._end_press(axis, press)
            raise
        if len(self._pressed) >= AXES_MOST:
            self._pressed.clear()
        self._pressed[axis] = press

    def _end_press(self, axis: str, press: Any) -> None:
        if len(self._over) >= AXES_MOST:
            self._over.clear()
        self._over[axis] = press

    async def _command(self, method: str, params: dict[str, Any], identity: Any, judge: Callable[[], None]) -> None:
        judge()
        if len(self._commands) >= UNDER_WAY_MOST:
            raise NotDone(f"{UNDER_WAY_MOST} commands are under way, which is the most")
        number = next(self._numbers)
        line = encode(number, method, params)
        self._commands[number] = identity
        try:
            async with self._order:
                wire = await self._connected()
                if self.closed:
                    wire.close(GONE)
                judge()
                # a connection that has ended meanwhile has forgotten it
                self._commands[number] = identity
                answer = wire.send(number, line)
            await asyncio.wait_for(answer, ANSWER_S)
        except TimeoutError:
            # what it was asked for must not happen later
            wire.close(f"{self._shared.proxy} does not answer")
            raise NotDone(wire.why) from None
        except BaseException:
            self._commands.pop(number, None)
            raise

    async def _connected(self) -> Wire:
        if self._wire and not self._wire.ended:
            return self._wire
        if self not in self._shared.commanding and len(self._shared.commanding) >= OPERATORS_MOST:
            raise NotDone(f"{OPERATORS_MOST} clients operate already, which is the most")
        self._shared.commanding.add(self)
        try:
            self._wire = await Wire.open(self._shared.proxy, self._heard, self._lost)
        finally:
            if not self._wire or self._wire.ended:
                self._shared.commanding.discard(self)
        return self._wire

    async def _heard(self, said: dict[str, Any]) -> None:
        if said["method"] == "linuxcnc.done":
            said["params"]["id"] = self._commands.pop(said["params"]["id"], None)
            # pokeys-remote waits meanwhile, and ends the connection of one that reads nothing
            with contextlib.suppress(ConnectionResetError):
                await self._tell(said)

    def _lost(self, wire: Wire) -> None:
        self._commands.clear()
        self.on_lost(wire.why)
        # pokeys-remote has forgotten these
        for axis, press in self._pressed.items():
            self._end_press(axis, press)
        self._shared.commanding.discard(self)

    # LinuxCNC's state

    def take(self, changed: dict[str, Any]) -> None:
        """It is so now. What the client had no room for is merged."""
        if not changed:
            return
        if not self._news:
            self._offer(self._fetch)
        self._news = dict(changed) if "connected" in changed else {**self._news, **changed}

    def _fetch(self) -> dict[str, Any]:
        news, self._news = self._news, {}
        return {"jsonrpc": "2.0", "method": "linuxcnc.state", "params": news}

    # the end

    def abandon(self, why: str) -> None:
        """What LinuxCNC has not taken yet is not given to it any more."""
        if self._wire:
            self._wire.close(why)

    def cut(self) -> None:
        """A stop has come: the kernel takes nothing more of what waits here."""
        if self._wire and self._wire.unsent:
            self._wire.close("it was stopped")

    def close(self) -> None:
        """The client is gone: commands that wait are dropped, and what it jogs stops."""
        self.closed = True
        self._shared.leave(self)
        if self._wire:
            self._wire.close(GONE)
