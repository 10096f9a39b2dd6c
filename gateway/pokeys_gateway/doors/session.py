# SPDX-License-Identifier: GPL-2.0-or-later
"""Log-in over HTTP: a cookie for browsers, Basic for scripts and Prometheus, tickets for WebSockets."""
from __future__ import annotations

import contextlib
import json
from http import HTTPStatus

from aiohttp import web

from ..access import Access, Denied, TooMany, Who
from ..config import Config
from ..gate import exact, host_of, is_loopback, plain
from .answer import complaint, good

COOKIE = "pokeys-session"
BODY_MOST = 4096
WRONG = "there is no such user, or the password is another one"
WHO = "pokeys-who"          # where the middleware leaves it in the request
# what may be had without a log-in: the page, which has the form, and whether the gateway is there
OPEN = frozenset(("/", "/page.js", "/page.css", "/licenses.txt", "/healthz", "/api/session", "/api/log-in",
                  "/api/log-out"))


class Session:
    """Who a request is from, and the paths for that. Belongs to the event loop's thread."""

    def __init__(self, config: Config, access: Access, *, cookie: str = COOKIE, judges: bool = True) -> None:
        """Without `judges`, a request from nobody is the door's business. Doors of one computer share their cookies,
        whatever their ports, and one without TLS cannot replace the cookie of one with it: so each has its `cookie`."""
        self._config = config
        self._access = access
        self._cookie_name = cookie
        self._judges = judges
        self._proxies = frozenset(map(exact, config.behind_proxy))

    def proxied(self, request: web.Request) -> bool:
        """Does it come from a proxy of ours?"""
        return exact(request.remote or "") in self._proxies

    def forwarded(self, request: web.Request, name: str) -> str:
        """What a proxy of ours says of the browser's request. Of several proxies, the first knows."""
        return request.headers.get(f"X-Forwarded-{name}", "").partition(",")[0].strip() if self.proxied(request) else ""

    def scheme(self, request: web.Request) -> str:
        """Of the page's URL; empty if only a proxy would know."""
        return self.forwarded(request, "Proto").lower() or ("https" if request.secure else "")

    def address(self, request: web.Request) -> str:
        """Of the client, as what counts as one; behind a proxy, the one that the proxy has added."""
        peer = request.remote or ""
        if self.proxied(request):
            last = ",".join(request.headers.getall("X-Forwarded-For", [])).rpartition(",")[2].strip()
            with contextlib.suppress(ValueError):
                peer = plain(last)
        return host_of(peer)

    def _cookie(self, request: web.Request) -> str:
        """Ours. All servers of a computer share their cookies, and not all are what aiohttp can parse."""
        for part in ";".join(request.headers.getall("Cookie", [])).split(";"):
            name, _, value = part.strip().partition("=")
            if name == self._cookie_name:
                return value
        return ""

    async def _who(self, request: web.Request) -> Who | None:
        """None: nobody. :class:`Denied`, :class:`TooMany`."""
        if who := self._access.session(self._cookie(request)):
            return who
        if request.path == "/websocket" and (ticket := request.query.get("ticket")):
            return self._access.redeem(ticket)
        # a password costs time, and attempts: only where it is asked for
        if (header := request.headers.get("Authorization")) and self._access.users and (
                not self._judges or request.path not in OPEN or request.path == "/api/session"):
            return await self._access.basic(header, self.address(request))
        return self._access.anybody

    async def judge(self, request: web.Request) -> web.Response | None:
        """Leave in the request who it is from. An answer, if that may not be."""
        why = "a log-in is needed: POST /api/log-in, or HTTP Basic"
        try:
            found = await self._who(request)
        except TooMany as error:
            return self._wait(error)
        except Denied:
            found, why = None, WRONG
        request[WHO] = found
        return None if found or not self._judges or request.path in OPEN else self._refuse(request, why)

    @staticmethod
    def _wait(error: TooMany) -> web.Response:
        return complaint(HTTPStatus.TOO_MANY_REQUESTS, str(error), **{"Retry-After": str(round(error.after) or 1)})

    @staticmethod
    def _refuse(request: web.Request, text: str) -> web.Response:
        # a browser would open a window of its own, and keep the password; our page has a form
        browser = {"Cookie", "Origin", "Sec-Fetch-Mode"} & set(request.headers) or "text/html" in request.headers.get(
            "Accept", "")
        return complaint(HTTPStatus.UNAUTHORIZED, text, **({} if browser else {
            "WWW-Authenticate": 'Basic realm="pokeys-gateway", charset="UTF-8"'}))

    def _secure(self, request: web.Request) -> bool:
        return self.scheme(request) == "https"

    def _state(self, request: web.Request, who: Who | None) -> web.Response:
        return good({"required": self._access.required, "user": who.name or None if who else None,
                     "level": who.level if who else None, "users": bool(self._access.users),
                     "plaintext": self._config.plaintext and not self._secure(request) and
                     not is_loopback(request.remote or "")})

    async def session(self, request: web.Request) -> web.Response:
        """GET /api/session"""
        return self._state(request, request[WHO])

    async def log_in(self, request: web.Request) -> web.Response:
        """POST /api/log-in"""
        if request.content_type != "application/json" or (request.content_length or 0) > BODY_MOST:
            return complaint(HTTPStatus.BAD_REQUEST, "expected a JSON object with name and password")
        try:
            given = json.loads(await request.text())
            name, password = given["name"], given["password"]
        except (ValueError, TypeError, LookupError, RecursionError):
            name = password = None
        if not isinstance(name, str) or not isinstance(password, str):
            return complaint(HTTPStatus.BAD_REQUEST, "expected a JSON object with name and password")
        try:
            token, who = await self._access.log_in(name, password, self.address(request))
        except TooMany as error:
            return self._wait(error)
        except Denied:
            return complaint(HTTPStatus.UNAUTHORIZED, WRONG)
        answer = self._state(request, who)
        self.remember(request, answer, token)
        return answer

    def remember(self, request: web.Request, answer: web.Response, token: str) -> None:
        """Whoever gets this answer is logged in."""
        answer.set_cookie(self._cookie_name, token, httponly=True, samesite="Strict", secure=self._secure(request))

    def forget(self, request: web.Request, answer: web.Response) -> None:
        """Whoever gets this answer is not logged in any more."""
        self._access.log_out(self._cookie(request))
        answer.del_cookie(self._cookie_name)

    async def log_out(self, request: web.Request) -> web.Response:
        """POST /api/log-out"""
        answer = self._state(request, self._access.anybody)
        self.forget(request, answer)
        return answer

    async def ticket(self, request: web.Request) -> web.Response:
        """POST /api/ticket"""
        return good({"ticket": self._access.ticket(request[WHO])})
