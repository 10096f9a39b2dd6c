# SPDX-License-Identifier: GPL-2.0-or-later
"""JSON-RPC 2.0 over a WebSocket, in the shape that Moonraker made familiar.

Requests are answered in the order in which they come, but for those that operate LinuxCNC; states come
between. No client waits for another: what one does not take is in its subscriber (feeds.py), its requests are
read only as far as there is room for answers, and one that reads nothing for ten seconds is closed.
"""
from __future__ import annotations

import array
import asyncio
import contextlib
import fcntl
import functools
import inspect
import itertools
import json
import logging
import math
import socket
import termios
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from aiohttp import WSCloseCode, WSMessage, WSMsgType, web

from .. import __version__
from ..access import LEVELS, Access, Who
from ..console.console import Console
from ..feeds import (
    ANSWER_BYTES_MOST,
    RATE_LEAST,
    RATE_MOST,
    Feed,
    Feeds,
    Objects,
    Part,
    Subscriber,
    Wish,
    encode,
    expand,
    look,
    whole,
)
from ..gate import Gate, cut
from ..hub import Hub
from ..operate import METHODS, STOPS, UNDER_WAY_MOST, Operator
from ..wire import NotDone
from .request import (
    AGE_MOST_S,
    BEAT_S,
    INTERNAL,
    INVALID_PARAMS,
    INVALID_REQUEST,
    NO_DEVICE,
    NO_METHOD,
    NOT_ALLOWED,
    NOT_DONE,
    PARSE_ERROR,
    SHOWN,
    TOO_MUCH,
    TOO_OLD,
    RpcError,
    Way,
    only,
)
from .session import WHO
from .talking import Talking, ends_jog, stop_of

MESSAGE_MOST = 64 * 1024
BATCH_MOST = 16
CLIENTS_MOST = 256
SEND_BUFFER, WRITE_LIMIT = 32 * 1024, 16 * 1024
BLOCKED_S = 10.0
# a client that has vanished, and to which nothing is sent, is noticed after 40 s; a ping would have to wait
# behind what a slow client has not taken yet
TCP_USER_TIMEOUT = 18       # tcp(7); the module has no name for it
KEEP_ALIVE = {socket.TCP_KEEPIDLE: 20, socket.TCP_KEEPINTVL: 5, socket.TCP_KEEPCNT: 4,
              # the same when something is sent, such as the pings below
              TCP_USER_TIMEOUT: 40000}
USUAL_RATE = 2.0
OPERATES = {"emergency_stop": "emergency_stop", **{
    f"linuxcnc.{name}": name for name in (*METHODS, *STOPS) if name != "emergency_stop"}}
NOT_JSON = object()
DIGITS_MOST, FRAMES_MOST = 18, 64
CLOSE_S = 1.0
_LOG = logging.getLogger("pokeys-gateway")


class _Connection:
    """One client."""

    def __init__(self, door: Rpc, who: Who, address: str) -> None:
        self.who = who
        self._door = door
        self._hub = door.hub
        self.subscriber = Subscriber(door.count_skipped)
        self.sent = 0               # bytes, into the transport
        self.fresh = time.monotonic()   # what comes now was sent after this time
        self.ended = False
        self._feed: Feed | None = None
        self._methods: dict[str, Callable[[dict[str, Any]], Any]] = {
            "server.info": self._info,
            "objects.list": self._list,
            "objects.query": self._query,
            "objects.subscribe": self._subscribe,
            "objects.unsubscribe": self._unsubscribe,
            "events.list": self._events,
        }
        self._talking = Talking(door.console, who, address, self._tell)
        self._methods |= self._talking.methods
        self._operator = Operator(door.hub.operators, self._offer, self._say, self._tell)
        self._under_way: set[asyncio.Task[None]] = set()

    def leave(self) -> None:
        """End the subscription, if there is one."""
        if self._feed:
            self._door.feeds.leave(self._feed, self.subscriber)
            self._feed = None

    # ---- requests

    def way(self) -> Way:
        """How what comes now has come."""
        return Way(self.fresh + AGE_MOST_S, self._hub.operators.turn, stops=self._door.console.router.stops)

    async def take(self, message: Any, way: Way) -> str | None:
        """The answer to a message of :func:`_parsed`; None if it needs none, or gets it later."""
        if message is NOT_JSON:
            return encode(_error(None, PARSE_ERROR, "not JSON"))
        if isinstance(message, list) and not 0 < len(message) <= BATCH_MOST:
            return encode(_error(None, INVALID_REQUEST, f"a batch has 1 to {BATCH_MOST} requests"))
        if any(map(_operates, _requests(message))):
            # LinuxCNC may hang, and nothing else is to wait for it
            self.later(message, way)
            return None
        return await self._answer(message, itertools.repeat(way))

    async def _answer(self, message: Any, ways: Iterable[Way]) -> str | None:
        if not isinstance(message, list):
            answer = await self._one(message, next(iter(ways)))
            return encode(answer) if answer else None
        answers: list[str] = []
        for one, way in zip(message, ways, strict=False):
            if answer := await self._one(one, way, sum(map(len, answers)) < ANSWER_BYTES_MOST):
                answers.append(encode(answer))
            # others' turn
            await asyncio.sleep(0)
        return f"[{','.join(answers)}]" if answers else None

    def later(self, message: Any, way: Way) -> None:
        """Answer it while others are answered. Stops in it are sent at once."""
        requests = _requests(message)
        # stops have as many places of their own
        if len(self._under_way) >= UNDER_WAY_MOST * (2 if any(map(_stops, requests)) else 1):
            number = message.get("id") if isinstance(message, dict) else None
            self.subscriber.answer(encode(_error(number, TOO_MUCH, "too many requests are under way")))
            return
        ways = []
        for one in requests:
            if _stops(one) and not self._refusal():
                way = replace(way, stop=self._hub.operators.begin_stop(OPERATES[one["method"]]),
                              turn=self._hub.operators.turn)
            ways.append(way)

        async def answer() -> None:
            if found := await self._answer(message, ways):
                self.subscriber.answer(found)
        task = asyncio.get_running_loop().create_task(answer())
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    async def _one(self, request: Any, way: Way, room: bool = True) -> dict[str, Any] | None:
        if not isinstance(request, dict) or request.get("jsonrpc") != "2.0" or not isinstance(
                request.get("method"), str) or not _is_id(request.get("id")):
            return _error(None, INVALID_REQUEST, 'a request of JSON-RPC 2.0 has "jsonrpc", "method" and "id"')
        number = request.get("id")
        self._talking.way = way
        try:
            name = request["method"]
            method = self._methods.get(name)
            operates = OPERATES.get(name)
            if not room:
                raise RpcError(TOO_MUCH, "not done: the answers before it are too long")
            if not method and not operates:
                raise RpcError(NO_METHOD, f"there is no method {name[:SHOWN]}; there are: "
                                          f"{', '.join((*self._methods, *OPERATES))}")
            params = request.get("params", {})
            if not isinstance(params, dict):
                raise RpcError(INVALID_PARAMS, "params has to be an object")
            if method == self._subscribe and "id" not in request:
                raise RpcError(INVALID_REQUEST, "its answer is the first state")
            result = method(params) if method else self._operate(operates or "", params, number, way)
            if inspect.isawaitable(result):
                result = await result
        except RpcError as error:
            return _error(number, error.code, str(error)) if "id" in request else None
        except Exception:
            _LOG.exception("%s", request["method"][:SHOWN])
            return _error(number, INTERNAL, "an error of the gateway; its log says more") if "id" in request else None
        return {"jsonrpc": "2.0", "id": number, "result": result} if "id" in request else None

    @property
    def operates(self) -> bool:
        """May it operate LinuxCNC?"""
        return self._hub.config.operate and self.who.level != LEVELS[0]

    @property
    def commands(self) -> bool:
        """May it command a machine? Then it is heard while it takes no answers: it may stop it."""
        return self.operates or self._talking.may_send

    async def begin(self, request: Any, way: Way) -> bool:
        """Do what does not wait for what came before it: a stop of the console, whatever is wrong with the request, and
        the end of a jog. False: it is neither."""
        if stop := stop_of(request):
            self._talking.stop(stop)
            number = request.get("id")
            answer = {"jsonrpc": "2.0", "id": number, "result": {}} if "id" in request and _is_id(number) else None
        elif ends_jog(request):
            answer = await self._one(request, way)
        else:
            return False
        if answer and not self.subscriber.full:
            self.subscriber.answer(encode(answer))
        return True

    def _refusal(self) -> str | None:
        """Why it may not operate."""
        if not self._hub.config.operate:
            return "nobody may operate LinuxCNC through this gateway ([linuxcnc] operate = no)"
        if not self.operates:
            return "operating needs a log-in of a user whose level is user or admin"
        if self.ended or not self._door.access.holds(self.who):
            return "this client is not logged in any more"
        return None

    async def _operate(self, method: str, params: dict[str, Any], number: Any, way: Way) -> dict[str, Any]:
        def judge(takes_back: bool) -> None:
            if why := self._refusal():
                raise RpcError(NOT_ALLOWED, why)
            if takes_back:
                return
            if way.turn != self._hub.operators.turn:
                raise NotDone("it was stopped")
            if way.stop and (not way.stop.done() or way.stop.exception()):
                raise NotDone("the stop before it is not confirmed")
            if time.monotonic() > way.until:
                raise NotDone(TOO_OLD)
        try:
            judge(True)
            if way.stop and method in STOPS:
                await asyncio.shield(way.stop)
            else:
                await self._operator.ask(method, params, number, judge)
        except NotDone as error:
            raise RpcError(NOT_DONE, str(error)) from None
        return {}

    def _offer(self, fetch: Callable[[], dict[str, Any]]) -> None:
        self.subscriber.offer_other(lambda: encode(fetch()))

    def _say(self, notification: dict[str, Any]) -> None:
        if not self.subscriber.full:
            self.subscriber.answer(encode(notification))

    async def _tell(self, notification: dict[str, Any]) -> None:
        await self.subscriber.room()
        self.subscriber.answer(encode(notification))

    def end(self) -> None:
        """The client is gone."""
        self.ended = True
        self.leave()
        self._talking.end()
        self._operator.close()
        # the task of who asks this is not one of them
        for task in self._under_way:
            task.cancel()

    # ---- methods

    def _info(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params)
        return {"format": 1, "version": __version__, "user": self.who.name or None, "level": self.who.level,
                "operate": self.operates,
                "trouble": self._hub.source.trouble, "devices": self._hub.source.names(),
                "clients": len(self._door.connections), "skipped": self.subscriber.skipped}

    def _list(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params)
        return {"objects": self._hub.source.names()}

    async def _objects(self, params: dict[str, Any]) -> Objects:
        objects = params.get("objects")
        if not isinstance(objects, dict) or not objects:
            raise RpcError(INVALID_PARAMS, 'objects has to be an object, such as {"mill": ["pin.03.in"]} or '
                                           '{"mill": null}')
        found = []
        for device, names in objects.items():
            if device not in self._hub.source.names():
                raise RpcError(NO_DEVICE, self._hub.no_such_device(device[:SHOWN]))
            if names is not None and not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
                raise RpcError(INVALID_PARAMS, f"objects.{device} has to be a list of names, or null")
            try:
                wanted = await expand(names, self._door.names)
            except ValueError as error:
                raise RpcError(INVALID_PARAMS, str(error)) from None
            rows = self._hub.model.rows
            found.append(Part(device, wanted, any(rows[name].diagnostic for name in wanted or ())))
        return tuple(sorted(found, key=lambda part: part.device))

    async def _query(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params, "objects")
        objects = await self._objects(params)
        return {"eventtime": time.time(), "status": look(functools.partial(whole, self._hub.source), objects)}

    async def _subscribe(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params, "objects", "rate")
        rate = params.get("rate", USUAL_RATE)
        if isinstance(rate, bool) or not isinstance(rate, (int, float)) or not RATE_LEAST <= rate <= RATE_MOST:
            raise RpcError(INVALID_PARAMS, f"rate has to be {RATE_LEAST} to {RATE_MOST:g} a second")
        wish = Wish.at(rate, await self._objects(params))
        self.leave()
        self._feed, status = self._door.feeds.join(wish, self.subscriber)
        return {"status": status, "eventtime": time.time(), "serial": self._feed.serial, "rate": wish.rate}

    def _unsubscribe(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params)
        self.leave()
        return {}

    def _events(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params, "device", "since")
        device, since = params.get("device"), params.get("since")
        if device not in self._hub.source.names():
            raise RpcError(NO_DEVICE, self._hub.no_such_device(str(device)[:SHOWN]))
        if since is None:
            return {"events": self._hub.events(str(device))}
        if not isinstance(since, dict) or not all(type(since.get(key)) is int for key in ("epoch", "number")):
            raise RpcError(INVALID_PARAMS, "since has to be an event, with epoch and number")
        return {"events": self._hub.events(str(device), (since["epoch"], since["number"]))}


def _error(number: Any, code: int, message: str) -> dict[str, Any]:
    return {"jsonrpc": "2.0", "id": number, "error": {"code": code, "message": message}}


def _parsed(text: str) -> Any:
    try:
        return json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        return NOT_JSON


def _requests(message: Any) -> list[Any]:
    return message if isinstance(message, list) else [message]


def _operates(message: Any) -> bool:
    return isinstance(message, dict) and str(message.get("method")) in OPERATES


def _stops(message: Any) -> bool:
    return _operates(message) and OPERATES[message["method"]] in STOPS


def _refuse(word: str) -> None:
    raise ValueError(f"{word} is not JSON")


def _is_id(number: Any) -> bool:
    return number is None or (isinstance(number, (str, int, float)) and not isinstance(number, bool) and
                              number not in (float("inf"), float("-inf")))


async def _put(queue: asyncio.Queue[Any], item: Any, work: asyncio.Task[None]) -> bool:
    """When there is room. False if those who take from the queue have ended."""
    if queue.full():
        room = asyncio.get_running_loop().create_task(queue.put(item))
        await asyncio.wait({room, work}, return_when=asyncio.FIRST_COMPLETED)
        room.cancel()
    else:
        queue.put_nowait(item)
    return not work.done()


def _frames(ws: web.WebSocketResponse) -> int:
    """Messages that were parsed and not read: aiohttp does not say how many, and limits their bytes only."""
    return len(getattr(getattr(ws, "_reader", None), "_buffer", ()))


def _of_the_kernel(transport: Any) -> int:
    """Bytes that the kernel has, and the other side has not acknowledged (tcp(7))."""
    found = array.array("i", [0])
    with contextlib.suppress(OSError, AttributeError, ValueError):
        fcntl.ioctl(transport.get_extra_info("socket").fileno(), termios.TIOCOUTQ, found)
    return found[0]


class Rpc:
    """The door. Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, gate: Gate, access: Access, console: Console,
                 address: Callable[[web.Request], str]) -> None:
        """``address`` is that of who has sent a request, also through a proxy."""
        self._address = address
        self.hub = hub
        self.console = console
        self.access = access
        self._gate = gate
        self.feeds = Feeds(hub.source)
        self.names = {name: i for i, (name, row) in enumerate(hub.model.rows.items()) if not row.writable}
        self.connections: dict[web.WebSocketResponse, _Connection] = {}
        self.closed_slow = 0
        self._ending = False
        self._watches: set[asyncio.Task[None]] = set()
        self.skipped = 0            # states that clients did not get, because they were slower

    @property
    def waiting(self) -> int:
        """Messages that are still to be sent. Any thread may ask."""
        return sum(one.subscriber.waiting for one in list(self.connections.values()))

    def count_skipped(self) -> None:
        """One more."""
        self.skipped += 1

    async def handle(self, request: web.Request) -> web.StreamResponse:
        """A client, until it leaves."""
        if self._ending or len(self.connections) >= CLIENTS_MOST:
            raise web.HTTPServiceUnavailable(reason="the gateway ends" if self._ending else
                                             f"there are {CLIENTS_MOST} clients, and no more are taken")
        # compressed for each client, an encoded state would not be one for all
        ws = web.WebSocketResponse(max_msg_size=MESSAGE_MOST, compress=False, autoping=False, timeout=CLOSE_S)
        await ws.prepare(request)
        transport: Any = request.transport
        if not transport:
            return ws
        if self._ending:
            return ws
        connection = _Connection(self, request[WHO], self._address(request))
        # who may stop a machine is heard also while it takes no answers
        self._gate.stream(transport, lambda: _frames(ws) >= FRAMES_MOST or (not connection.commands and (
            connection.subscriber.full or transport.get_write_buffer_size() > WRITE_LIMIT)))
        transport.set_write_buffer_limits(high=WRITE_LIMIT)
        with contextlib.suppress(OSError):
            peer = transport.get_extra_info("socket")
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            for option, value in KEEP_ALIVE.items():
                peer.setsockopt(socket.IPPROTO_TCP, option, value)
        self.connections[ws] = connection
        writer = asyncio.get_running_loop().create_task(self._write(ws, connection, transport))
        commands = connection.operates or self.console.configured
        beat = asyncio.get_running_loop().create_task(self._beat(ws)) if commands else None
        watch = asyncio.get_running_loop().create_task(self._watch(connection, transport))
        self._watches.add(watch)
        watch.add_done_callback(self._watches.discard)
        try:
            await self._read(ws, connection)
        except ConnectionError:
            pass
        except Exception:
            _LOG.exception("a WebSocket client")
        finally:
            writer.cancel()
            if beat:
                beat.cancel()
            connection.end()
            try:
                await ws.close(code=WSCloseCode.GOING_AWAY if self._ending else WSCloseCode.OK)
            finally:
                # the watch goes on until what waits has been taken
                del self.connections[ws]
        return ws

    async def _read(self, ws: web.WebSocketResponse, connection: _Connection) -> None:
        waiting: asyncio.Queue[tuple[Any, Way]] = asyncio.Queue(FRAMES_MOST)
        work = asyncio.get_running_loop().create_task(self._work(ws, connection, waiting))
        try:
            async for message in ws:
                # messages that have come already are given without a pause
                await asyncio.sleep(0)
                if connection.ended or work.done():
                    break
                if message.type is WSMsgType.PONG:
                    self._take_pong(connection, message.data)
                    continue
                if message.type not in (WSMsgType.TEXT, WSMsgType.PING):
                    await ws.close(code=WSCloseCode.UNSUPPORTED_DATA, message=b"text is expected")
                    break
                parsed = message if message.type is WSMsgType.PING else _parsed(message.data)
                way = connection.way()
                # what stands beside a stop was sent before it, as far as anybody knows
                left = [one for one in _requests(parsed) if not await connection.begin(one, way)]
                if len(left) < len(_requests(parsed)):
                    if not left:
                        continue
                    parsed = left
                if any(map(_stops, _requests(parsed))) and 0 < len(_requests(parsed)) <= BATCH_MOST:
                    connection.later(parsed, way)
                elif not connection.commands:
                    # one after the other, and nothing is read meanwhile
                    await self._do(ws, connection, parsed, way)
                elif not await _put(waiting, (parsed, way), work):
                    break
        finally:
            work.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionError):
                await work

    async def _work(self, ws: web.WebSocketResponse, connection: _Connection,
                    waiting: asyncio.Queue[tuple[Any, Way]]) -> None:
        """Do what was read of one who may operate, and so is read on."""
        while True:
            message, way = await waiting.get()
            await self._do(ws, connection, message, way)

    @staticmethod
    async def _do(ws: web.WebSocketResponse, connection: _Connection, message: Any, way: Way) -> None:
        """Answer a message, and wait until there is room for more answers."""
        if isinstance(message, WSMessage):
            await ws.pong(message.data)
            return
        if answer := await connection.take(message, way):
            connection.subscriber.answer(answer)
        await connection.subscriber.room()

    @staticmethod
    def _take_pong(connection: _Connection, data: bytes) -> None:
        """The answer to a ping of ours, if it is a number: of a state, or for those who operate, a time in ms."""
        timed, digits = data[:1] == b"t", data.removeprefix(b"t")
        if not digits.isdigit() or len(digits) > DIGITS_MOST:
            return
        if timed:
            # what comes after it was sent after the ping was read
            connection.fresh = min(time.monotonic(), max(connection.fresh, int(digits) / 1000))
        else:
            connection.subscriber.hear(int(digits))

    @staticmethod
    async def _beat(ws: web.WebSocketResponse) -> None:
        """Know how old what a client sends can be."""
        with contextlib.suppress(ConnectionError):
            while not ws.closed:
                await ws.ping(b"t%d" % math.floor(time.monotonic() * 1000))
                await asyncio.sleep(BEAT_S)

    @staticmethod
    async def _write(ws: web.WebSocketResponse, connection: _Connection, transport: Any) -> None:
        try:
            while not ws.closed:
                text, number = await connection.subscriber.next()
                connection.sent += len(text)
                await ws.send_str(text)
                if number:
                    # answered when it is read, by every library
                    await ws.ping(str(number).encode())
        except ConnectionError:
            pass
        except Exception:
            _LOG.exception("sending to a WebSocket client")
            cut(transport)
        finally:
            connection.subscriber.end()

    async def _watch(self, connection: _Connection, transport: Any) -> None:
        """Abort a connection whose client takes no bytes, and answers no ping, for BLOCKED_S, or may no longer read."""
        subscriber = connection.subscriber
        before, since = (0, 0), time.monotonic()
        while not transport.is_closing() or transport.get_write_buffer_size():
            await asyncio.sleep(BLOCKED_S / 10)
            waiting = transport.get_write_buffer_size()
            now = connection.sent - waiting - _of_the_kernel(transport), subscriber.heard
            if now[0] > before[0] or now[1] > before[1] or (waiting == 0 and subscriber.unheard == 0):
                since = time.monotonic()
            before = now
            if not self.access.holds(connection.who):
                connection.end()
                cut(transport)
                return
            if time.monotonic() - since > BLOCKED_S:
                self.closed_slow += 1
                _LOG.info("a client that read nothing for %.0f s was closed", BLOCKED_S)
                cut(transport)
                return

    async def close(self) -> None:
        """Say good-bye, for a second at most."""
        self._ending = True
        goodbyes = [ws.close(code=WSCloseCode.GOING_AWAY, message=b"the gateway ends") for ws in self.connections]
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(asyncio.gather(*goodbyes, return_exceptions=True), 1)
        self.feeds.close()
        for watch in self._watches:
            watch.cancel()
        await asyncio.gather(*self._watches, return_exceptions=True)
