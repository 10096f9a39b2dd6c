# SPDX-License-Identifier: GPL-2.0-or-later
"""ESP3D's doors for pages: HTTP, half duplex, and web sockets with what the machine says.

A page of others, such as ESP3D-WEBUI 3.0, lies in a folder and is served from here, at a port of its own: it
is another origin than the gateway's page, and has its own rules about scripts. Its web socket is at the
next port, as it expects it.
"""
from __future__ import annotations

import asyncio
import errno
import functools
import itertools
import logging
import math
import mimetypes
import os
import re
from http import HTTPStatus
from pathlib import Path
from socket import IPPROTO_TCP, SO_SNDBUF, SOL_SOCKET, TCP_INFO
from typing import Any, cast
from urllib.parse import urlsplit

from aiohttp import BodyPartReader, MultipartReader, StreamReader, WSMsgType, web

from ..access import LEVELS, SESSION_S, Access, Denied, TooMany
from ..aside import aside
from ..config import Endpoint
from ..console.client import Client
from ..console.console import Console
from ..folder import Folder, NotPermitted, TooLarge, Upload
from ..gate import IDLE_S, Gate, cut, is_loopback, listener, serve
from ..hub import Hub
from .answer import complaint
from .http import Handler, arrived_at, finish, guard
from .session import WHO, Session

COMMAND_MOST, SOCKET_LINE_MOST = 4096, 256
BODY_MOST, SOCKETS_MOST = 64 << 10, 64
ANSWER_S = 30.0             # how long a request waits for its command
CHUNK, RATE = 64 << 10, 4 << 20     # bytes, and bytes a second of an upload
UPLOADS_MOST, FILES_MOST, FIELDS_MOST, FIELD_MOST = 4, 64, 128, 4096
PIECE, FULL_S = 4 << 10, 0.05
TCP_CLOSED = 7, 8           # in tcp_info: reset, and closed by the other end (linux/tcp.h)
SEND, SNDBUF = 16 << 10, 32 << 10
BLOCKED_S = 60.0            # a client that takes nothing for so long is closed
PAGE, DATA = "webui-v3", "arduino"      # the subprotocols
FORWARDED = "ESP3D says: command forwarded"     # clients look for these words
LATE = "error: the machine takes nothing; what waits of this request is not sent\n"
UNDER_WAY = "error: still under way; lines of this request that come after it are not carried out\n"
COOKIE = "pokeys-console"
_LOG = logging.getLogger("pokeys-gateway")
# what ESP3D-WEBUI is made of; it is one file, with everything in it
SECURITY = {
    "Content-Security-Policy": "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
                               "connect-src 'self' ws: wss:; frame-ancestors 'self'; base-uri 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",       # see _not_by_others
    "Cache-Control": "no-store",
}
PAGES = frozenset(("index.html", "favicon.ico"))      # a page has to be there before anybody can log in
NO_PAGE = ("This is the console of pokeys-gateway. For a page here, set folder in section [esp3d] of the "
           "configuration, and copy index.html.gz of ESP3D-WEBUI 3.0 into that folder.\n")


def _not_by_others(handler: Handler) -> Handler:
    """A request that does something must not come from another page, not even by a link."""
    async def judged(request: web.Request) -> web.StreamResponse:
        headers = request.headers
        # browsers say it with https and on this computer, older ones never
        judged_by_it = "Sec-Fetch-Site" in headers or "Origin" in headers
        browser = {"Cookie", "Accept-Language"} & set(headers) or "Mozilla" in headers.get("User-Agent", "")
        same = urlsplit(headers.get("Referer", "")).netloc == headers["Host"]
        if headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin") or (
                browser and not judged_by_it and not same):
            return complaint(HTTPStatus.FORBIDDEN, "another page must not ask here")
        return await handler(request)
    return judged


class _Whole:
    """A body whose reads are as long as they may be: aiohttp 3.8 misses a boundary that comes in small pieces."""

    def __init__(self, content: StreamReader) -> None:
        self._content = content

    async def read(self, size: int) -> bytes:
        """So many bytes; fewer at the end of the body."""
        data = await self._content.read(size)
        while len(data) < size and (more := await self._content.read(size - len(data))):
            data += more
        return data

    def __getattr__(self, name: str) -> Any:
        return getattr(self._content, name)


def _gone(transport: asyncio.Transport | None) -> bool:
    """Has the client closed the connection? Nobody notices who does not read."""
    if not transport or transport.is_closing():
        return True
    try:
        state: int = transport.get_extra_info("socket").getsockopt(IPPROTO_TCP, TCP_INFO, 1)[0]
    except OSError:
        return True
    return state in TCP_CLOSED


async def _feed(client: Client, data: bytes, transport: asyncio.Transport | None, end: float) -> None:
    """Give what has come to the console, in pieces, between which others have their turn."""
    loop = asyncio.get_running_loop()
    for at in range(0, len(data), PIECE):
        client.receive(data[at:at + PIECE], loop.time())
        await asyncio.sleep(0)
        while client.full and loop.time() < end and not _gone(transport):
            await asyncio.sleep(FULL_S)
        if client.full:
            return


class Esp3d:
    """The door. Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, access: Access, console: Console) -> None:
        self._config = hub.config
        self._access = access
        self._console = console
        self._session = Session(hub.config, access, cookie=COOKIE, judges=False)
        self._gate = Gate(rate=RATE)
        self._servers: list[asyncio.Server] = []
        self._runner: web.AppRunner | None = None
        self._watch: asyncio.Task[None] | None = None
        self._folder = Folder(hub.config.esp3d_folder) if hub.config.esp3d_folder else None
        self._uploads = 0
        self._numbers = itertools.count(1)
        self._sockets: set[asyncio.Transport] = set()

    async def open(self, endpoints: tuple[Endpoint, ...]) -> list[str]:
        """Listen: at each endpoint for pages, and at the next port for their web sockets; where. OSError."""
        if not endpoints:
            return []
        if self._folder:
            try:
                await aside(self._folder.sweep)
            except OSError as error:
                _LOG.warning("[esp3d] folder: %s: %s", self._config.esp3d_folder, error.strerror)
        loop = asyncio.get_running_loop()
        self._watch = loop.create_task(self._gate.watch())
        self._runner = web.AppRunner(self.application(), access_log=None, keepalive_timeout=IDLE_S)
        await self._runner.setup()
        assert self._runner.server
        self._gate.make = self._runner.server
        for where in itertools.chain(*((one, Endpoint(one.host, one.port + 1)) for one in endpoints)):
            make = functools.partial(self._gate, where.loopback)
            self._servers.append(await serve(make, listener(where)))
        return [f"http://{where}/" for where in endpoints]

    async def close(self) -> None:
        """Listen no more, and end all connections."""
        for server in self._servers:
            server.close()
        for transport in list(self._sockets):
            cut(transport)
        await finish(self._runner, self._watch)

    def application(self) -> web.Application:
        """What is served."""
        app = web.Application(middlewares=[guard(self._config, self._gate, self._session, SECURITY, self._ports)],
                              client_max_size=BODY_MOST)
        for method in ("GET", "POST"):
            app.router.add_route(method, "/command", _not_by_others(self._command))
            app.router.add_route(method, "/login", _not_by_others(self._login))
            app.router.add_route(method, "/files", _not_by_others(self._files))
        app.router.add_get("/config", _not_by_others(self._settings), allow_head=False)
        app.router.add_get("/{path:.*}", self._file, allow_head=False)
        return app

    def _ports(self, request: web.Request) -> tuple[int, ...]:
        """A page's web socket is at the port behind its own."""
        name = request.transport.get_extra_info("sockname") if request.transport else None
        return (0, 1) if name and any(one.port + 1 == name[1] for one in self._config.esp3d_listen) else (0,)

    # ---- commands

    def _client(self, request: web.Request, kind: str, most: int) -> Client:
        name = request.transport.get_extra_info("peername") if request.transport else None
        client = self._console.client(kind, f"{name[0]}:{name[1]}" if name else "gone", most, self._address(request))
        client.here = arrived_at(request)
        who = request[WHO]
        client.who = who if who and who.name else None
        return client

    def _address(self, request: web.Request) -> str:
        """Of the client: whoever comes through a proxy is not of this computer because the proxy is."""
        return self._session.address(request) if self._config.behind_proxy else request.remote or ""

    @staticmethod
    async def _parameters(request: web.Request) -> dict[str, str]:
        """Of the address, and of a form."""
        found = dict(request.query)
        if request.method == "POST":
            try:
                form = await request.post()
            except (ValueError, LookupError, AssertionError):
                raise web.HTTPBadRequest(reason="this is no form") from None
            found |= {name: value for name, value in form.items() if isinstance(value, str)}
        return found

    async def _command(self, request: web.Request) -> web.Response:
        given = await self._parameters(request)
        if "cmd" not in given and "PING" in given:
            return web.Response(text="ok")      # the session goes on
        line = given.get("cmd", given.get("plain", "")).encode("utf-8", "surrogateescape")
        if not line.strip():
            return web.Response(status=HTTPStatus.BAD_REQUEST, text="error: cmd is missing\n")
        return await self._carry_out(request, line)

    async def _settings(self, request: web.Request) -> web.Response:
        as_json = request.query.get("json") == "yes"
        return await self._carry_out(request, b"[ESP420]json=yes" if as_json else b"[ESP420]")

    async def _carry_out(self, request: web.Request, line: bytes) -> web.Response:
        """One line, or several: each as if it came from a client of the console, which is gone then."""
        client = self._client(request, "http", COMMAND_MOST)
        client.hears = False
        loop = asyncio.get_running_loop()
        if not self._console.level(client):
            self._console.router.leave(client)
            return web.Response(status=HTTPStatus.UNAUTHORIZED, text="error: log in first\n")
        try:
            end, pause = loop.time() + ANSWER_S, 0.0
            await _feed(client, line if line.endswith(b"\n") else line + b"\n", request.transport, end)
            while client.pending and loop.time() < end and not _gone(request.transport):
                await asyncio.sleep(pause)
                pause = min(0.05, pause + 0.002)
            late = (UNDER_WAY if client.due else LATE) if client.pending else ""
            messages = client.outbox.take(1 << 30)
            text = b"".join(one.data for one in messages).decode("utf-8", "replace")
            for one in messages:
                one.release()
        finally:
            self._console.router.leave(client, at_once=client.pending)
        if late:
            return web.Response(status=HTTPStatus.SERVICE_UNAVAILABLE, text=late if late == LATE else text + late)
        if not text:
            return web.Response(text=FORWARDED)
        if client.refused:
            return web.Response(status=HTTPStatus.UNAUTHORIZED, text=text)
        if text.startswith("{"):
            return web.Response(text=text, content_type="application/json")
        # a command that cannot be carried out has an answer; a line for the machine has none
        refused = text.startswith("error: ") and not line.lstrip().startswith(b"[ESP")
        bad = refused or client.failed
        return web.Response(status=HTTPStatus.SERVICE_UNAVAILABLE if bad else HTTPStatus.OK, text=text)

    # ---- log-in

    async def _login(self, request: web.Request) -> web.Response:
        given = await self._parameters(request)
        if given.get("DISCONNECT", "").upper() == "YES":
            answer = self._identified("disconnected", LEVELS[0], HTTPStatus.UNAUTHORIZED)
            self._session.forget(request, answer)
            return answer
        if "NEWPASSWORD" in given:
            return self._identified("the gateway may not change passwords; run: sudo pokeys-gateway --set-user NAME",
                                    self._level(request), HTTPStatus.INTERNAL_SERVER_ERROR)
        if given.get("SUBMIT", "").upper() == "YES":
            try:
                token, who = await self._access.log_in(given.get("USER", ""), given.get("PASSWORD", ""),
                                                       self._session.address(request))
            except TooMany as error:
                return self._identified(str(error), LEVELS[0], HTTPStatus.UNAUTHORIZED)
            except Denied:
                return self._identified("Wrong authentication!", LEVELS[0], HTTPStatus.UNAUTHORIZED)
            answer = self._identified("Identified", who.level, HTTPStatus.OK)
            self._session.remember(request, answer, token)
            return answer
        if not self._may_read(request):
            return self._identified("Wrong authentication!", LEVELS[0], HTTPStatus.UNAUTHORIZED)
        return self._identified("Identified", self._level(request), HTTPStatus.OK)

    def _level(self, request: web.Request) -> str:
        """Of the console: it may be more than that of a guest, without a log-in."""
        client = self._client(request, "http", COMMAND_MOST)
        self._console.router.leave(client)
        return self._console.level(client) or LEVELS[0]

    def _may_read(self, request: web.Request) -> bool:
        near = self._config.console_level is not None and is_loopback(self._address(request))
        return near or request[WHO] is not None

    @staticmethod
    def _identified(status: str, level: str, code: HTTPStatus) -> web.Response:
        return web.json_response({"status": status, "authentication_lvl": level}, status=int(code))

    # ---- the page, and files

    async def _file(self, request: web.Request) -> web.StreamResponse:
        if request.headers.get("Upgrade", "").lower() == "websocket":
            return await self._socket(request)
        wanted = request.match_info["path"] or "index.html"
        if wanted not in PAGES and not self._may_read(request):
            return web.Response(status=HTTPStatus.UNAUTHORIZED, text="error: log in first\n")
        try:
            if not self._folder:
                raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
            file, size, packed = await self._folder.aside(self._folder.open, wanted)
        except OSError as error:
            if error.errno == errno.EBUSY:
                return complaint(HTTPStatus.SERVICE_UNAVAILABLE, f"{wanted}: {error.strerror}")
            if wanted == "index.html":
                return web.Response(text=NO_PAGE)
            return complaint(HTTPStatus.NOT_FOUND, f"{wanted}: {error.strerror}")
        kind = mimetypes.guess_type(wanted)[0] or "application/octet-stream"
        answer = web.StreamResponse(headers={
            **SECURITY, "Content-Type": f"{kind}; charset=utf-8" if kind.startswith("text/") else kind,
            **({"Content-Encoding": "gzip"} if packed else {})})
        answer.content_length = size
        try:
            await answer.prepare(request)
            at = 0
            while at < size and (chunk := await aside(os.pread, file, min(CHUNK, size - at), at)):
                await answer.write(chunk)
                self._gate.took(request.transport)
                at += len(chunk)
            await answer.write_eof()
        finally:
            aside(os.close, file)
        return answer

    async def _files(self, request: web.Request) -> web.Response:
        """List a folder, change it, or take files."""
        client = self._client(request, "http", COMMAND_MOST)
        self._console.router.leave(client)
        level = self._console.level(client)
        if not level:
            return web.Response(status=HTTPStatus.UNAUTHORIZED, text="error: log in first\n")
        if not self._folder:
            return web.Response(status=HTTPStatus.NOT_FOUND, text="error: no folder is configured\n")
        status = "ok"
        given = dict(request.query)
        try:
            if request.method == "POST":
                status = await self._upload(request, given, level)
            elif (action := given.get("action", "list")) != "list":
                status = await self._folder.aside(self._folder.act, action, given.get("path", "/"),
                                                  given.get("filename", ""), level)
            if given.get("quiet") == "yes":
                return web.json_response({"status": status})
            found = await self._folder.aside(self._folder.listing, given.get("path", "/"))
        except (ValueError, AssertionError):
            return web.Response(status=HTTPStatus.BAD_REQUEST, text="error: this is no form with files\n")
        except NotPermitted as error:
            return web.Response(status=HTTPStatus.UNAUTHORIZED, text=f"error: {error}; log in first\n")
        except FileNotFoundError as error:
            wanted = f"{given.get('path', '').rstrip('/')}/{given.get('filename', '')}"
            return web.Response(status=HTTPStatus.NOT_FOUND, text=f"error: {wanted[:256]}: {error.strerror}\n")
        except TooLarge as error:
            return web.Response(status=HTTPStatus.REQUEST_ENTITY_TOO_LARGE, text=f"error: {error}\n")
        except OSError as error:
            return web.Response(status=HTTPStatus.INTERNAL_SERVER_ERROR, text=f"error: {error.strerror}\n")
        return web.json_response({**found, "status": status})

    async def _upload(self, request: web.Request, given: dict[str, str], level: str) -> str:
        """Files of a form; what is said of it. Fields before a file say where, and how large it is."""
        assert self._folder
        if request.content_type != "multipart/form-data":
            raise OSError(errno.EINVAL, "a form with files is expected")
        if self._uploads >= UPLOADS_MOST:
            raise OSError(errno.EBUSY, f"{UPLOADS_MOST} uploads are under way, which is the most")
        if level not in LEVELS[1:]:
            raise NotPermitted(f"this needs level {LEVELS[1]}")
        self._uploads += 1
        uploads: list[tuple[str, Upload]] = []
        try:
            async for part in MultipartReader(request.headers, cast(StreamReader, _Whole(request.content))):
                if not isinstance(part, BodyPartReader):
                    continue
                if part.filename is None:
                    if part.name and len(given) < FIELDS_MOST:
                        given[part.name] = (await part.read_chunk(FIELD_MOST)).decode("utf-8", "replace")
                    continue
                # aiohttp takes away the / at the beginning
                size = given.get(f"/{part.filename}S", given.get(f"{part.filename}S", ""))
                if len(uploads) >= FILES_MOST:
                    raise OSError(errno.EINVAL, f"a form has at most {FILES_MOST} files")
                upload = await aside(self._folder.begin, given.get("path", "/"), part.filename, level,
                                     int(size) if re.fullmatch(r"[0-9]{1,15}", size) else None,
                                     given.get("createPath") in ("yes", "true"))
                uploads.append((Path(part.filename).name, upload))
                while chunk := await part.read_chunk(CHUNK):
                    await aside(upload.write, chunk)
                    self._gate.took(request.transport)
            # only now is it known that the last one is complete
            for _, upload in uploads:
                await aside(upload.finish)
        finally:
            self._uploads -= 1
            for _, upload in uploads:
                aside(upload.close)
        return f"{', '.join(name for name, _ in uploads)} uploaded" if uploads else "no file"

    # ---- web sockets

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        """webui-v3: what the machine says, as binary messages. arduino: lines, both ways."""
        if len(self._sockets) >= SOCKETS_MOST:
            self._console.refused += 1
            return web.Response(status=HTTPStatus.SERVICE_UNAVAILABLE, text="error: too many pages are open\n")
        socket = web.WebSocketResponse(protocols=(PAGE, DATA), max_msg_size=BODY_MOST, heartbeat=90.0)
        await socket.prepare(request)
        transport = request.transport
        if not transport:
            return socket
        transport.set_write_buffer_limits(high=SEND)
        transport.get_extra_info("socket").setsockopt(SOL_SOCKET, SO_SNDBUF, SNDBUF)
        client = self._client(request, "websocket" if socket.ws_protocol == DATA else "web", SOCKET_LINE_MOST)
        self._gate.stream(transport, lambda: client.full)
        self._sockets.add(transport)
        client.on_close = functools.partial(cut, transport)
        tasks = [asyncio.ensure_future(self._send(socket, client, transport))]
        try:
            if socket.ws_protocol != DATA:
                # ESP3D ends the page that was there before; here all may stay, so each is the active one
                number = next(self._numbers)
                await socket.send_str(f"currentID:{number}")
                await socket.send_str(f"activeID:{number}")
            tasks.append(asyncio.ensure_future(self._hear(socket, client, transport)))
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        except ConnectionError:
            pass
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._sockets.discard(transport)
            self._console.router.leave(client, at_once=True)
        return socket

    async def _hear(self, socket: web.WebSocketResponse, client: Client, transport: asyncio.Transport) -> None:
        async for message in socket:
            if message.type not in (WSMsgType.TEXT, WSMsgType.BINARY):
                continue
            data = message.data.encode("utf-8", "replace") if message.type is WSMsgType.TEXT else message.data
            if socket.ws_protocol != DATA and data.startswith(b"PING:"):
                await socket.send_str(f"PING:{int(self._access.left(client.who) * 1000)}:{int(SESSION_S * 1000)}")
                continue
            await _feed(client, data, transport, math.inf)
            if client.full:
                return

    async def _send(self, socket: web.WebSocketResponse, client: Client, transport: asyncio.Transport) -> None:
        outbox = client.outbox
        wake = asyncio.Event()
        outbox.on_put = wake.set
        while True:
            while outbox.empty:
                wake.clear()
                await wake.wait()
            messages = outbox.take(SEND)
            data = b"".join(one.data for one in messages)
            try:
                async with asyncio.timeout(BLOCKED_S):
                    if socket.ws_protocol == DATA:
                        await socket.send_str(data.decode("utf-8", "replace"))
                    else:
                        await socket.send_bytes(data)
            except TimeoutError:
                self._console.closed_slow += 1
                cut(transport)
                return
            except ConnectionError:
                return
            finally:
                for one in messages:
                    one.release()
