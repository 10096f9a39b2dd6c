# SPDX-License-Identifier: GPL-2.0-or-later
"""Files of the flight recorder over HTTP.

A file has megabytes, and a client may be slow: the gateway reads a chunk when the last one has been
taken, and goes on for ten minutes at most.
"""
from __future__ import annotations

import asyncio
import contextlib
import os
import time
from collections.abc import Callable, Iterator
from http import HTTPStatus

from aiohttp import web

from ..aside import aside
from ..gate import Gate, cut
from ..hub import Hub
from ..recorder import KIND, NoRecord, NoSuchRecord, Record, Recorder
from .answer import SECURITY, complaint, good

CHUNK = 64 * 1024
SENT_MOST = 4               # records that are being sent at the same time
SEND_S = 600.0
LOOK_S = 1.5                # the page waits for 2 s


class Records:
    """The handlers of these paths. Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, gate: Gate) -> None:
        self._hub = hub
        self._gate = gate
        self._recorder = Recorder(hub.config.record_folder, hub.config.runtime_directory)
        self._sending = 0
        self._looking: asyncio.Future[tuple[list[Record], str]] | None = None

    async def listed(self, _request: web.Request) -> web.Response:
        """GET /api/records"""
        # one look for all who ask meanwhile
        if not self._looking or self._looking.done():
            self._looking = aside(self._recorder.look)
        done, _ = await asyncio.wait((self._looking,), timeout=LOOK_S)
        found, trouble = self._looking.result() if done else ([], f"{self._recorder.folder}: the disk does not answer")
        return good({"folder": str(self._recorder.folder), "trouble": trouble, "records": [
            {"name": one.name, "time": one.time.isoformat(), "reason": one.reason, "text": one.text,
             "bytes": one.bytes} for one in found]})

    async def file(self, request: web.Request) -> web.StreamResponse:
        """GET /api/records/NAME"""
        name = request.match_info["name"]
        return await self._give(request, name, lambda: self._recorder.open(name))

    async def now(self, request: web.Request) -> web.StreamResponse:
        """GET /api/devices/DEVICE/record"""
        device = request.match_info["device"]
        if device not in self._hub.source.names():
            return complaint(HTTPStatus.NOT_FOUND, self._hub.no_such_device(device))
        name = f"pokeysd-{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())}-{device}.pcapng"
        return await self._give(request, name, lambda: self._recorder.now(device))

    @contextlib.contextmanager
    def _place(self) -> Iterator[None]:
        """While a record is sent. HTTPServiceUnavailable if SENT_MOST are being sent already."""
        if self._sending >= SENT_MOST:
            raise web.HTTPServiceUnavailable(reason=f"{SENT_MOST} records are being sent; try again later")
        self._sending += 1
        try:
            yield
        finally:
            self._sending -= 1

    async def _give(self, request: web.Request, name: str,
                    opening: Callable[[], tuple[int, int]]) -> web.StreamResponse:
        """The file that `opening` gives, with its size, aside."""
        with self._place():
            try:
                file, size = await aside(opening)
            except NoSuchRecord as error:
                return complaint(HTTPStatus.NOT_FOUND, str(error))
            except NoRecord as error:
                return complaint(HTTPStatus.SERVICE_UNAVAILABLE, str(error))
            try:
                return await self._send(request, name, file, size)
            finally:
                os.close(file)

    async def _send(self, request: web.Request, name: str, file: int, size: int) -> web.StreamResponse:
        answer = web.StreamResponse(headers={
            **SECURITY, "Content-Type": KIND, "Content-Disposition": f'attachment; filename="{name}"'})
        answer.content_length = size
        await answer.prepare(request)
        try:
            async with asyncio.timeout(SEND_S):
                at = size if request.method == "HEAD" else 0
                while at < size:
                    chunk = await aside(os.pread, file, min(CHUNK, size - at), at)
                    if not chunk:
                        raise EOFError
                    at += len(chunk)
                    await answer.write(chunk)
                    self._gate.took(request.transport)
        except (OSError, EOFError):
            # the client has a part only, and must notice
            if request.transport:
                cut(request.transport)
            raise ConnectionResetError from None
        await answer.write_eof()
        return answer
