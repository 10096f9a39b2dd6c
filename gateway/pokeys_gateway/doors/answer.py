# SPDX-License-Identifier: GPL-2.0-or-later
"""The two shapes of an answer in JSON, and the headers that every answer has."""
from __future__ import annotations

from http import HTTPStatus
from typing import Any

from aiohttp import web

from ..feeds import encode

FORMAT = 1
SECURITY = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'; "
                               "form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


def good(document: dict[str, Any]) -> web.Response:
    """What was asked for."""
    return web.Response(text=encode({"format": FORMAT, **document}), content_type="application/json")


def complaint(status: HTTPStatus, text: str, **headers: str) -> web.Response:
    """Why there is nothing."""
    return web.json_response({"error": {"code": int(status), "message": text}}, status=int(status), headers=headers)
