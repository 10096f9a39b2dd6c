# SPDX-License-Identifier: GPL-2.0-or-later
"""HTTP: the page, the same data for scripts, and Prometheus' metrics.

Reading only. A page of another site must not be able to read through a browser on this computer
(DNS rebinding), so requests are answered only under the names that this gateway is known by.
"""
from __future__ import annotations

import asyncio
import ipaddress
import logging
import os
import socket
from collections.abc import Awaitable, Callable
from dataclasses import asdict
from http import HTTPStatus
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pokeys
from aiohttp import web

from .. import describe
from ..board import terminals
from ..config import Config, Endpoint, loopback
from ..feeds import encode
from ..gate import IDLE_S, Gate
from ..hub import Hub
from ..source import Reading
from .metrics import Metrics
from .rpc import Rpc

BODY_MOST = 64 * 1024
SHUTDOWN_S = 2
FORMAT = 1
PAGE = {"": ("index.html", "text/html"), "page.js": ("page.js", "text/javascript"),
        "page.css": ("page.css", "text/css"), "licenses.txt": ("licenses.txt", "text/plain")}
SECURITY = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'; "
                               "form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
_LOG = logging.getLogger("pokeys-gateway")
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def host_is_ours(hosts: list[str], config: Config) -> bool:
    """Are these the Host headers of a request to this gateway? One, and any port: it may be forwarded."""
    if len(hosts) != 1:
        return False
    host = hosts[0].strip()
    name = host[1:host.find("]")] if host.startswith("[") else host.partition(":")[0]
    name = name.lower().rstrip(".")
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name == "localhost" or name in config.host_names


def origin_is_ours(origins: list[str], config: Config) -> bool:
    """A browser says whose page asks. WebSockets are open to pages of all sites, if the server does not look."""
    try:
        names = [urlsplit(origin).hostname or "" for origin in origins]
    except ValueError:
        return False
    return not names or host_is_ours([f"[{name}]" if ":" in name else name for name in names], config)


def _endpoint_of(inherited: socket.socket) -> Endpoint:
    if inherited.family not in (socket.AF_INET, socket.AF_INET6):
        raise ValueError("an inherited socket is not one of TCP")
    host, port = inherited.getsockname()[:2]
    try:
        return loopback(host, port)
    except ValueError as error:
        raise ValueError(f"an inherited socket listens on {host}; allowed: {error}") from None


def _good(document: dict[str, Any]) -> web.Response:
    return web.Response(text=encode({"format": FORMAT, **document}), content_type="application/json")


def _complaint(status: HTTPStatus, text: str) -> web.Response:
    return web.json_response({"error": {"code": int(status), "message": text}}, status=int(status))


def guard(config: Config, gate: Gate) -> Any:
    """Judge requests before they are looked at, and put the security headers on every answer."""
    async def judged(request: web.Request, handler: Handler) -> web.StreamResponse:
        # not request.host, which asks the name server if there is none
        if not host_is_ours(request.headers.getall("Host", []), config):
            return _complaint(
                HTTPStatus.FORBIDDEN, "this host name is not allowed; see host-names in pokeys-gateway.conf(5)")
        if not origin_is_ours(request.headers.getall("Origin", []), config):
            return _complaint(HTTPStatus.FORBIDDEN, "a page of another site must not ask here")
        try:
            return await handler(request)
        except web.HTTPException as error:
            answer = _complaint(HTTPStatus(error.status), error.reason)
            for name in ("Allow", "Location"):
                if name in error.headers:
                    answer.headers[name] = error.headers[name]
            return answer
        except ConnectionError:
            return _complaint(HTTPStatus.SERVICE_UNAVAILABLE, "the client is gone")
        except Exception:
            _LOG.exception("%s %s", request.method, request.path)
            return _complaint(HTTPStatus.INTERNAL_SERVER_ERROR, "an error of the gateway; its log says more")

    @web.middleware
    async def judge(request: web.Request, handler: Handler) -> web.StreamResponse:
        with gate.request(request.transport):
            answer = await judged(request, handler)
        if not answer.prepared:
            answer.headers.update(SECURITY)
        return answer
    return judge


def _summary(hub: Hub, reading: Reading) -> dict[str, Any]:
    state = reading.state
    rows = hub.model.rows
    return {
        "name": reading.name,
        "connected": reading.connected,
        "reason": reading.reason,
        "type": state.info.type or None if state else None,
        "serial": state.info.SerialNumber or None if state else None,
        "address": state.info.address if state else None,
        "link": rows["link-state"].words.get(state.link_state) if state else None,
        "age_us": state.age_us if state else None,
    }


class Http:
    """The door. Belongs to the event loop's thread."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._gate = Gate()
        self._rpc = Rpc(hub, self._gate)
        self._metrics = Metrics(hub, self._gate, self._rpc)
        self._servers: list[asyncio.Server] = []
        self._watch: asyncio.Task[None] | None = None
        folder = Path(os.environ.get("POKEYS_GATEWAY_WEB") or Path(__file__).parents[1] / "web")
        # a build without npm has no page
        self._page = {path: ((folder / name).read_bytes(), kind) for path, (name, kind) in PAGE.items()
                      if (folder / name).exists()}
        self._runner: web.AppRunner | None = None

    async def open(self, sockets: list[socket.socket]) -> list[str]:
        """Listen: on sockets that were inherited, or on those of the configuration. Where, as addresses of pages.

        Raises OSError, and ValueError for a socket that others than this computer reach.
        """
        endpoints = [_endpoint_of(one) for one in sockets] or list(self._hub.config.listen)
        self._runner = web.AppRunner(self.application(), access_log=None, keepalive_timeout=IDLE_S)
        await self._runner.setup()
        assert self._runner.server
        self._gate.make = self._runner.server
        loop = asyncio.get_running_loop()
        self._watch = loop.create_task(self._gate.watch())
        for i, where in enumerate(endpoints):
            try:
                self._servers.append(await (loop.create_server(self._gate, sock=sockets[i]) if sockets else
                                            loop.create_server(self._gate, where.host, where.port)))
            except OSError as error:
                raise OSError(error.errno, f"{where}: {os.strerror(error.errno or 0)}") from error
        return [f"http://{one}/" for one in endpoints]

    async def close(self) -> None:
        """Let requests that are being answered end, for two seconds at most."""
        for server in self._servers:
            server.close()
        await self._rpc.close()
        if self._runner and self._runner.server:
            await self._runner.server.shutdown(SHUTDOWN_S)
            await self._runner.cleanup()
        if self._watch:
            self._watch.cancel()

    def application(self) -> web.Application:
        """What is served."""
        app = web.Application(middlewares=[guard(self._hub.config, self._gate)], client_max_size=BODY_MOST)
        for path in PAGE:
            app.router.add_get(f"/{path}", self._static)
        app.router.add_get("/websocket", self._rpc.handle)
        app.router.add_get("/metrics", self._scrape)
        app.router.add_get("/healthz", self._health)
        app.router.add_get("/api/devices", self._devices)
        app.router.add_get("/api/devices/{device}", self._device)
        app.router.add_get("/api/devices/{device}/diagnostics", self._diagnostics)
        app.router.add_get("/api/devices/{device}/events", self._events)
        app.router.add_get("/api/devices/{device}/histograms", self._histograms)
        app.router.add_get("/api/devices/{device}/terminals", self._terminals)
        app.router.add_get("/api/names", self._names)
        app.router.add_get("/api/words", self._words)
        for path, document in (("openapi", describe.openapi), ("schema", describe.messages)):
            app.router.add_get(f"/api/{path}.json", self._document(document(self._hub.model)))
        return app

    @staticmethod
    def _document(document: dict[str, Any]) -> Handler:
        text = encode(document)

        async def give(_request: web.Request) -> web.Response:
            return web.Response(text=text, content_type="application/json")
        return give

    async def _static(self, request: web.Request) -> web.Response:
        if request.path[1:] not in self._page:
            return _complaint(HTTPStatus.NOT_FOUND, "pokeysd was built without the page, as npm was missing; "
                                                    "the data is at /api/devices and /metrics")
        body, kind = self._page[request.path[1:]]
        answer = web.Response(body=body, content_type=kind, charset="utf-8")
        answer.enable_compression()
        return answer

    async def _scrape(self, request: web.Request) -> web.Response:
        body, kind = await asyncio.to_thread(self._metrics.page, request.headers.get("Accept", ""))
        return web.Response(body=body, headers={"Content-Type": kind})

    async def _health(self, _request: web.Request) -> web.Response:
        """Of the gateway itself; a machine that is off is no fault of it."""
        return _good({"status": "ok", "trouble": self._hub.source.trouble})

    async def _devices(self, _request: web.Request) -> web.Response:
        source = self._hub.source
        readings = [reading for name in source.names() if (reading := source.read(name))]
        return _good({"trouble": source.trouble, "devices": [_summary(self._hub, reading) for reading in readings]})

    async def _device(self, request: web.Request) -> web.Response:
        name = request.match_info["device"]
        reading = self._hub.source.read(name)
        if not reading:
            return _complaint(HTTPStatus.NOT_FOUND, self._hub.no_such_device(name))
        values: dict[str, Any] = {}
        words = {}
        if reading.state:
            values = reading.state.as_dict()
            words = {name: row.words.get(values[name], "unknown") for name, row in self._hub.model.rows.items()
                     if row.words and values.get(name) is not None}
        return _good({**_summary(self._hub, reading), "values": values, "words": words})

    async def _diagnostics(self, request: web.Request) -> web.Response:
        name = request.match_info["device"]
        reading = self._hub.source.read(name, diagnostics=True)
        if not reading:
            return _complaint(HTTPStatus.NOT_FOUND, self._hub.no_such_device(name))
        values = reading.diagnostics.as_dict() if reading.diagnostics else {}
        return _good({"values": values})

    async def _events(self, request: web.Request) -> web.Response:
        name = request.match_info["device"]
        if name not in self._hub.source.names():
            return _complaint(HTTPStatus.NOT_FOUND, self._hub.no_such_device(name))
        return _good({"events": self._hub.events(name)})

    async def _histograms(self, request: web.Request) -> web.Response:
        name = request.match_info["device"]
        reading = self._hub.source.read(name, diagnostics=True)
        if not reading:
            return _complaint(HTTPStatus.NOT_FOUND, self._hub.no_such_device(name))
        found = reading.diagnostics.histograms() if reading.diagnostics else {}
        return _good({"histograms": [
            {"name": name, "help": pokeys.describe(f"latency.{name}-p50-us").partition(":")[0], "count": one.count,
             "min_us": one.min_us, "mean_us": one.mean_us, "max_us": one.max_us, "p50_us": one.percentile_us(0.5),
             "p99_us": one.percentile_us(0.99), "buckets": [bucket for bucket in one.buckets() if bucket[1]]}
            for name, one in found.items()]})

    async def _terminals(self, request: web.Request) -> web.Response:
        name = request.match_info["device"]
        reading = self._hub.source.read(name)
        if not reading:
            return _complaint(HTTPStatus.NOT_FOUND, self._hub.no_such_device(name))
        found = terminals(self._hub.model, reading.state) if reading.state else []
        return _good({"terminals": [asdict(one) for one in found]})

    async def _words(self, _request: web.Request) -> web.Response:
        return _good({"words": {pattern: {str(number): word for number, word in row.words.items()}
                                for pattern, row in self._hub.model.patterns() if row.words}})

    async def _names(self, _request: web.Request) -> web.Response:
        rows = self._hub.model.rows.values()
        return _good({"names": [
            {"name": row.name, "type": row.type, "unit": row.unit, "help": row.help, "writable": row.writable,
             "words": {str(number): word for number, word in row.words.items()}} for row in rows]})
