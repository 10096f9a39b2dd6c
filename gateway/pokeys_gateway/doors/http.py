# SPDX-License-Identifier: GPL-2.0-or-later
"""HTTP: the page, the same data for scripts, and Prometheus' metrics.

Reading only. A page of another site must not be able to read through a browser on this computer
(DNS rebinding), so requests are answered only under the names that this gateway is known by.
"""
from __future__ import annotations

import asyncio
import functools
import ipaddress
import logging
import os
import socket
import ssl
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import asdict
from datetime import UTC, datetime
from http import HTTPStatus
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pokeys
from aiohttp import web

from .. import describe
from ..access import Access
from ..board import terminals
from ..config import Config, Endpoint, doctor_socket
from ..console.console import Console
from ..doctor import Doctor, NoDoctor
from ..feeds import encode
from ..gate import IDLE_S, Gate, listener, plain, serve
from ..hub import Hub
from ..source import Reading
from .answer import SECURITY, complaint, good
from .metrics import Metrics
from .records import Records
from .rpc import Rpc
from .session import WHO, Session

BODY_MOST = 64 * 1024
SHUTDOWN_S = 2
PAGE = {"": ("index.html", "text/html"), "page.js": ("page.js", "text/javascript"),
        "page.css": ("page.css", "text/css"), "licenses.txt": ("licenses.txt", "text/plain")}
DEFAULT_PORTS = {"http": 80, "https": 443}
_LOG = logging.getLogger("pokeys-gateway")
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def host_is_ours(hosts: list[str], config: Config, here: str = "") -> bool:
    """Are these the Host headers of a request to this gateway? One, and any port: it may be forwarded.

    `here` is the address at which the request has arrived.
    """
    if len(hosts) != 1:
        return False
    host = hosts[0].strip()
    name = host[1:host.find("]")] if host.startswith("[") else host.partition(":")[0]
    name = name.lower().rstrip(".")
    try:
        address = ipaddress.ip_address(name)
        return address.is_loopback or str(address) == here
    except ValueError:
        return name == "localhost" or name in config.host_names


def _is_one_of(origin: str, hosts: Iterable[str], scheme: str, ports: tuple[int, ...]) -> bool:
    """One origin; ValueError if it is not a URL."""
    page = urlsplit(origin)
    usual = DEFAULT_PORTS.get(page.scheme)
    if not page.hostname or not usual or scheme not in ("", page.scheme):
        return False
    # a browser leaves out the usual port in both headers
    return any(page.hostname == asked.hostname and (asked.port or usual) - (page.port or usual) in ports
               for asked in (urlsplit(f"//{host}") for host in hosts))


def origin_is_ours(request: web.Request, config: Config, session: Session, ports: tuple[int, ...]) -> bool:
    """Did a page of ours send this request, whose Host is ours? A browser names the page's origin.

    WebSockets are open to the pages of all sites unless the server looks. Ours is the page of the same
    host and port; its port may also be lower by one of `ports`. A proxy may ask under another name: then the page's
    is the one that the proxy gives, or one of ours at the usual port.
    """
    hosts = [request.headers["Host"]]
    if given := session.forwarded(request, "Host"):
        # what the browser has asked for, which may be any name
        if not host_is_ours([given], config):
            return False
        hosts = [given]
    elif session.proxied(request):
        hosts += config.host_names
    scheme = session.scheme(request)
    try:
        return all(_is_one_of(origin, hosts, scheme, ports) for origin in request.headers.getall("Origin", []))
    except ValueError:
        return False


def endpoint_of(inherited: socket.socket) -> Endpoint:
    """Where a socket listens. ValueError."""
    if inherited.family not in (socket.AF_INET, socket.AF_INET6):
        raise ValueError("an inherited socket is not one of TCP")
    host, port = inherited.getsockname()[:2]
    return Endpoint(host, port)


def arrived_at(request: web.Request) -> str:
    """The address of this computer at which a request has arrived, without an interface."""
    name = request.transport.get_extra_info("sockname") if request.transport else None
    return plain(str(name[0])) if name else ""


def guard(config: Config, gate: Gate, session: Session, headers: dict[str, str],
          ports: Callable[[web.Request], tuple[int, ...]] = lambda _request: (0,)) -> Any:
    """Judge requests before they are looked at, and put the security headers on every answer.

    `ports` says how far a request's port may be from that of the page that sends it.
    """
    async def judged(request: web.Request, handler: Handler) -> web.StreamResponse:
        # not request.host, which asks the name server if there is none
        here = arrived_at(request)
        if not host_is_ours(request.headers.getall("Host", []), config, here):
            return complaint(
                HTTPStatus.FORBIDDEN, "this host name is not allowed; see host-names in pokeys-gateway.conf(5)")
        if not origin_is_ours(request, config, session, ports(request)):
            return complaint(HTTPStatus.FORBIDDEN, "a page of another site must not ask here" + (
                "; the proxy has to pass the page's host and port (X-Forwarded-Host)"
                if session.proxied(request) else ""))
        # browsers say so where they can; links to the page are good
        if request.headers.get("Sec-Fetch-Site") == "cross-site" and request.headers.get(
                "Sec-Fetch-Mode") != "navigate":
            return complaint(HTTPStatus.FORBIDDEN, "a page of another site must not ask here")
        try:
            refusal = await session.judge(request)
            # an answer is a mapping, and an empty one is false
            return await handler(request) if refusal is None else refusal
        except web.HTTPException as error:
            answer = complaint(HTTPStatus(error.status), error.reason)
            for name in ("Allow", "Location"):
                if name in error.headers:
                    answer.headers[name] = error.headers[name]
            return answer
        except ConnectionError:
            if request.transport and not request.transport.is_closing():
                raise
            return complaint(HTTPStatus.SERVICE_UNAVAILABLE, "the client is gone")
        except Exception:
            _LOG.exception("%s %s", request.method, request.path)
            return complaint(HTTPStatus.INTERNAL_SERVER_ERROR, "an error of the gateway; its log says more")

    @web.middleware
    async def judge(request: web.Request, handler: Handler) -> web.StreamResponse:
        with gate.request(request.transport):
            answer = await judged(request, handler)
        if not answer.prepared:
            answer.headers.update(headers)
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


async def finish(runner: web.AppRunner | None, watch: asyncio.Task[None] | None) -> None:
    """Let the requests that are being answered end, for some seconds at most, and the gate's watch."""
    if runner and runner.server:
        await runner.server.shutdown(SHUTDOWN_S)
        await runner.cleanup()
    if watch:
        watch.cancel()


class Http:
    """The door. Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, access: Access, console: Console, tls: ssl.SSLContext | None = None) -> None:
        self._hub = hub
        self._access = access
        self._tls = tls
        self._session = Session(hub.config, access)
        self._gate = Gate(hub.config.behind_proxy)
        self._rpc = Rpc(hub, self._gate, access, console, self._address)
        self._records = Records(hub, self._gate)
        self._doctor = Doctor(doctor_socket(hub.config), hub.config.runtime_directory)
        self._metrics = Metrics(hub, self._gate, self._rpc, access, console)
        self._servers: list[asyncio.Server] = []
        self._watch: asyncio.Task[None] | None = None
        folder = Path(os.environ.get("POKEYS_GATEWAY_WEB") or Path(__file__).parents[1] / "web")
        # a build without npm has no page
        self._page = {path: ((folder / name).read_bytes(), kind) for path, (name, kind) in PAGE.items()
                      if (folder / name).exists()}
        self._runner: web.AppRunner | None = None

    def _address(self, request: web.Request) -> str:
        """Of the client: whoever comes through a proxy is not of this computer because the proxy is."""
        return self._session.address(request) if self._hub.config.behind_proxy else request.remote or ""

    async def open(self, sockets: list[socket.socket]) -> list[str]:
        """Listen: on sockets that were inherited, or on those of the configuration. Where, as addresses of pages.

        Raises OSError, and ValueError for a socket that is none of TCP.
        """
        endpoints = [endpoint_of(one) for one in sockets] or list(self._hub.config.listen)
        self._runner = web.AppRunner(self.application(), access_log=None, keepalive_timeout=IDLE_S)
        await self._runner.setup()
        assert self._runner.server
        self._gate.make = self._runner.server
        loop = asyncio.get_running_loop()
        self._watch = loop.create_task(self._gate.watch())
        for i, where in enumerate(endpoints):
            # this computer's programs, and a proxy, are spared certificates
            make = functools.partial(self._gate, where.loopback, None if where.loopback else self._tls)
            self._servers.append(await serve(make, sockets[i] if sockets else listener(where)))
        return [f"http{'s' if self._tls and not one.loopback else ''}://{one}/" for one in endpoints]

    async def close(self) -> None:
        """Let requests that are being answered end, for some seconds at most."""
        for server in self._servers:
            server.close()
        await self._rpc.close()
        await finish(self._runner, self._watch)

    def application(self) -> web.Application:
        """What is served."""
        app = web.Application(middlewares=[guard(self._hub.config, self._gate, self._session, SECURITY)],
                              client_max_size=BODY_MOST)
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
        # no HEAD: it would run pokeysctl, as GET does
        app.router.add_get("/api/devices/{device}/record", self._records.now, allow_head=False)
        app.router.add_get("/api/devices/{device}/terminals", self._terminals)
        app.router.add_post("/api/doctor", self._diagnosis)
        app.router.add_get("/api/names", self._names)
        app.router.add_get("/api/words", self._words)
        app.router.add_get("/api/records", self._records.listed)
        app.router.add_get("/api/records/{name}", self._records.file)
        app.router.add_get("/api/session", self._session.session)
        app.router.add_post("/api/log-in", self._session.log_in)
        app.router.add_post("/api/log-out", self._session.log_out)
        app.router.add_post("/api/ticket", self._session.ticket)
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
            return complaint(HTTPStatus.NOT_FOUND, "pokeysd was built without the page, as npm was missing; "
                                                    "the data is at /api/devices and /metrics")
        body, kind = self._page[request.path[1:]]
        answer = web.Response(body=body, content_type=kind, charset="utf-8")
        answer.enable_compression()
        return answer

    async def _scrape(self, request: web.Request) -> web.Response:
        body, kind = await asyncio.to_thread(self._metrics.page, request.headers.get("Accept", ""))
        return web.Response(body=body, headers={"Content-Type": kind})

    async def _health(self, request: web.Request) -> web.Response:
        """Of the gateway itself; a machine that is off is no fault of it."""
        return good({"status": "ok", "trouble": self._hub.source.trouble if request[WHO] else ""})

    async def _devices(self, _request: web.Request) -> web.Response:
        source = self._hub.source
        readings = [reading for name in source.names() if (reading := source.read(name))]
        return good({"trouble": source.trouble, "devices": [_summary(self._hub, reading) for reading in readings]})

    def _name(self, request: web.Request) -> str:
        """The device of a path. HTTPNotFound."""
        name = request.match_info["device"]
        if name not in self._hub.source.names():
            raise web.HTTPNotFound(reason=self._hub.no_such_device(name))
        return name

    def _reading(self, request: web.Request, *, diagnostics: bool = False) -> Reading:
        """The device of a path, at this moment. HTTPNotFound."""
        name = self._name(request)
        reading = self._hub.source.read(name, diagnostics=diagnostics)
        if not reading:
            raise web.HTTPNotFound(reason=self._hub.no_such_device(name))
        return reading

    async def _device(self, request: web.Request) -> web.Response:
        reading = self._reading(request)
        values: dict[str, Any] = {}
        words = {}
        if reading.state:
            values = reading.state.as_dict()
            words = {name: row.words.get(values[name], "unknown") for name, row in self._hub.model.rows.items()
                     if row.words and values.get(name) is not None}
        return good({**_summary(self._hub, reading), "values": values, "words": words})

    async def _diagnostics(self, request: web.Request) -> web.Response:
        reading = self._reading(request, diagnostics=True)
        return good({"values": reading.diagnostics.as_dict() if reading.diagnostics else {}})

    async def _events(self, request: web.Request) -> web.Response:
        return good({"events": self._hub.events(self._name(request))})

    async def _histograms(self, request: web.Request) -> web.Response:
        reading = self._reading(request, diagnostics=True)
        found = reading.diagnostics.histograms() if reading.diagnostics else {}
        return good({"histograms": [
            {"name": name, "help": pokeys.describe(f"latency.{name}-p50-us").partition(":")[0], "count": one.count,
             "min_us": one.min_us, "mean_us": one.mean_us, "max_us": one.max_us, "p50_us": one.percentile_us(0.5),
             "p99_us": one.percentile_us(0.99), "buckets": [bucket for bucket in one.buckets() if bucket[1]]}
            for name, one in found.items()]})

    async def _terminals(self, request: web.Request) -> web.Response:
        reading = self._reading(request)
        found = terminals(self._hub.model, reading.state) if reading.state else []
        return good({"terminals": [asdict(one) for one in found]})

    async def _diagnosis(self, request: web.Request) -> web.Response:
        if self._access.users and not request[WHO].name:
            return complaint(HTTPStatus.UNAUTHORIZED, "guests may not run the doctor; log in first")
        try:
            found = await self._doctor.ask()
        except NoDoctor as error:
            return complaint(HTTPStatus.SERVICE_UNAVAILABLE, str(error))
        return good({"time": datetime.fromtimestamp(found.time, UTC).isoformat(), "limited": found.limited,
                     "findings": found.findings})

    async def _words(self, _request: web.Request) -> web.Response:
        return good({"words": {pattern: {str(number): word for number, word in row.words.items()}
                                for pattern, row in self._hub.model.patterns() if row.words}})

    async def _names(self, _request: web.Request) -> web.Response:
        rows = self._hub.model.rows.values()
        return good({"names": [
            {"name": row.name, "type": row.type, "unit": row.unit, "help": row.help, "writable": row.writable,
             "words": {str(number): word for number, word in row.words.items()}} for row in rows]})
