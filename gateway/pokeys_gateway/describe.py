# SPDX-License-Identifier: GPL-2.0-or-later
"""What the doors send, for programs that generate or check code: OpenAPI 3.1 for HTTP, JSON Schema
2020-12 for the messages of the WebSocket.

Written by hand, beside the doors; the tests hold every answer against it. Objects may get more keys.
"""
from __future__ import annotations

from http import HTTPStatus
from typing import Any

from . import __version__
from .access import LEVELS
from .board import KINDS
from .doctor import VERDICTS
from .feeds import RATE_LEAST, RATE_MOST
from .model import Model
from .recorder import KIND

Schema = dict[str, Any]
DIALECT = "https://json-schema.org/draft/2020-12/schema"
TYPES = {"bit": "boolean", "unsigned": "integer", "signed": "integer", "float": "number", "text": "string"}
TEXT: Schema = {"type": "string"}
FLAG: Schema = {"type": "boolean"}
COUNT: Schema = {"type": "integer", "minimum": 0}
TROUBLE: Schema = {"type": "string", "description": 'Why there are no devices; "" if a daemon is there'}
EVENTTIME: Schema = {"type": "number", "description": "When it was read, in seconds since 1970"}
SERIAL: Schema = {"type": "integer", "minimum": 0, "description": "Of the state; the next one has the next number"}
FORMAT: Schema = {"const": 1}
USER: Schema = {"type": ["string", "null"], "description": "null = a guest, who has not logged in"}
OBJECT = "application/json"


def _object(required: Schema, **optional: Schema) -> Schema:
    return {"type": "object", "properties": required | optional, "required": list(required)}


def _only(required: Schema, **optional: Schema) -> Schema:
    return {**_object(required, **optional), "additionalProperties": False}


def _list(of: Schema) -> Schema:
    return {"type": "array", "items": of}


def _map(of: Schema, what: str) -> Schema:
    return {"type": "object", "additionalProperties": of, "description": what}


def _null_or(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


def _shapes(model: Model, prefix: str) -> dict[str, Schema]:
    """The objects that both documents have."""
    def ref(name: str) -> Schema:
        return {"$ref": prefix + name}
    summary = {
        "name": TEXT, "connected": {"type": "boolean", "description": "The device runs, and the values are fresh"},
        "reason": {"type": "string", "description": "Why the values are old or missing"},
        "type": {"type": ["string", "null"]}, "serial": {"type": ["integer", "null"]},
        "address": {"type": ["string", "null"]}, "link": {"type": ["string", "null"]},
        "age_us": {"type": ["number", "null"], "description": "Age of the inputs and positions, microseconds"},
    }
    return {
        "Values": _values(model),
        "Summary": _object(summary),
        "Device": _object({"format": FORMAT, **summary, "values": ref("Values"),
                           "words": _map(TEXT, "The meanings of those values that are codes")}),
        "Event": _object({"device": {"type": ["string", "null"], "description": "null = of all of them"},
                          "epoch": COUNT, "number": COUNT, "time": {**TEXT, "format": "date-time"},
                          "level": {"type": "string"}, "kind": TEXT, "text": TEXT, "held": COUNT}),
        "Name": _object({"name": TEXT, "type": {"enum": sorted(TYPES)}, "unit": TEXT, "help": TEXT,
                         "writable": FLAG, "words": _map(TEXT, "By number, what it means")}),
        "State": _object({"connected": FLAG, "reason": TEXT, "values": ref("Values")}),
    }


def _values(model: Model) -> Schema:
    named: Schema = {}
    patterns: Schema = {}
    for pattern, row in model.patterns():
        if not row.writable:
            schema = {"type": [TYPES[row.type], "null"], "description": row.help}
            if "%" in pattern:
                numbered = pattern.replace(".", "[.]").replace("%02u", "[0-9]{2}").replace("%u", "[0-9]+")
                patterns[f"^{numbered}$"] = schema
            else:
                named[pattern] = schema
    return {"type": "object", "properties": named, "patternProperties": patterns,
            "description": "By name; null = not known"}


def _answer(schema: Schema, kind: str = OBJECT, text: str = "") -> Schema:
    return {"description": text or "The data", "content": {kind: {"schema": schema}}}


def openapi(model: Model) -> Schema:
    """The paths of the HTTP door."""
    def ref(name: str) -> Schema:
        return {"$ref": "#/components/schemas/" + name}
    refused = {"401": _answer(ref("Error"), text="A log-in is needed, or was wrong"),
               "403": _answer(ref("Error"), text="The Host or the Origin of the request is not one of this gateway's"),
               "429": _answer(ref("Error"), text="Too many log-ins; Retry-After says when to try again")}
    missing = {"404": _answer(ref("Error"), text="There is no device of this name")}
    many = {"503": _answer(ref("Error"), text="There is no record, or too many records are being sent")}
    binary: Schema = {"description": "pcapng"}
    device = [{"name": "device", "in": "path", "required": True, "schema": TEXT}]

    def get(summary: str, answer: Schema, more: Schema | None = None, **rest: Any) -> Schema:
        return {"get": {"summary": summary, "responses": {"200": answer, **refused, **(more or {})}, **rest}}

    def post(summary: str, answer: Schema, body: Schema | None = None, more: Schema | None = None) -> Schema:
        wrong = {"400": _answer(ref("Error"), text="The body is not what is expected")}
        expected = {"requestBody": {"required": True, "content": {OBJECT: {"schema": body}}}}
        return {"post": {"summary": summary, **(expected if body else {}), "responses": {
            "200": answer, **refused, **(more or {}), **(wrong if body else {})}}}

    switched: Schema = {"description": "The connection is a WebSocket now; its messages are in /api/schema.json"}
    return {
        "openapi": "3.1.0",
        "info": {"title": "pokeys-gateway", "version": __version__, "license": {
            "name": "GPL-2.0-or-later", "identifier": "GPL-2.0-or-later"},
            "description": "PoKeys devices of a running pokeysd, which can only be read. See pokeys-gateway(8)."},
        "servers": [{"url": "/"}],
        "paths": {
            "/": get("The page", _answer(TEXT, "text/html")),
            "/page.js": get("Its program", _answer(TEXT, "text/javascript")),
            "/page.css": get("Its style", _answer(TEXT, "text/css")),
            "/licenses.txt": get("Licences of the libraries in it", _answer(TEXT, "text/plain")),
            "/api/devices": get("All devices, without their values", _answer(_object(
                {"format": FORMAT, "trouble": TROUBLE, "devices": _list(ref("Summary"))}))),
            "/api/devices/{device}": get("A device with its values", _answer(ref("Device")), missing,
                                         parameters=device),
            "/api/devices/{device}/diagnostics": get(
                "Counters and latencies of a device", _answer(_object({"format": FORMAT, "values": ref("Values")})),
                missing, parameters=device),
            "/api/devices/{device}/events": get("What has happened to a device", _answer(_object(
                {"format": FORMAT, "events": _list(ref("Event"))})), missing, parameters=device),
            "/api/devices/{device}/histograms": get("Latencies of a device", _answer(_object(
                {"format": FORMAT, "histograms": _list(ref("Histogram"))})), missing, parameters=device),
            "/api/devices/{device}/terminals": get(
                "The terminals of the board that are set up, and the names of their values", _answer(_object(
                    {"format": FORMAT, "terminals": _list(ref("Terminal"))})), missing, parameters=device),
            "/api/words": get("The meanings of codes, by names in which %02u stands for a number", _answer(_object(
                {"format": FORMAT, "words": _map(_map(TEXT, "By number"), "By name")}))),
            "/api/doctor": post("Run pokeysctl doctor: its findings about the computer", _answer(_object({
                "format": FORMAT, "time": {**TEXT, "format": "date-time"},
                "limited": {"type": "boolean", "description": "It had the rights of the gateway only"},
                "findings": {**_list(ref("Finding")), "description": "The worst first"}})),
                more={"503": _answer(ref("Error"), text="There are no findings, and why")}),
            "/api/names": get("All names of values", _answer(_object({"format": FORMAT, "names": _list(ref("Name"))}))),
            "/api/devices/{device}/record": get(
                "Packets and events of the last seconds, for Wireshark", _answer(binary, KIND),
                {**missing, **many}, parameters=device),
            "/api/records": get("The files that the flight recorder has written at faults", _answer(_object(
                {"format": FORMAT, "folder": TEXT,
                 "trouble": {"type": "string", "description": 'Why the folder cannot be read; "" if it can'},
                 "records": _list(ref("Record"))}))),
            "/api/records/{name}": get("A file that the flight recorder has written", _answer(binary, KIND), {
                "404": _answer(ref("Error"), text="There is no record of this name"), **many},
                parameters=[{"name": "name", "in": "path", "required": True, "schema": TEXT}]),
            "/api/session": get("Who the client is, and whether a log-in is needed", _answer(ref("Session"))),
            "/api/log-in": post("Log in; the answer sets a cookie", _answer(ref("Session")),
                                _object({"name": TEXT, "password": TEXT})),
            "/api/log-out": post("End the session", _answer(ref("Session"))),
            "/api/ticket": post("What opens one WebSocket within 30 seconds, as /websocket?ticket=TICKET",
                                _answer(_object({"format": FORMAT, "ticket": TEXT}))),
            "/api/openapi.json": get("This document", _answer({"type": "object"})),
            "/api/schema.json": get("JSON Schema of the messages of /websocket", _answer({"type": "object"})),
            "/healthz": get("Whether the gateway serves requests", _answer(_object(
                {"format": FORMAT, "status": {"const": "ok"}, "trouble": TROUBLE}))),
            "/metrics": get("For Prometheus", {"description": "The metrics", "content": {
                "text/plain": {"schema": TEXT}, "application/openmetrics-text": {"schema": TEXT}}}),
            "/websocket": {"get": {"summary": "JSON-RPC 2.0 over a WebSocket", "responses": {
                "101": switched, **refused, "400": _answer(ref("Error"), text="This is no WebSocket handshake"),
                "503": _answer(ref("Error"), text="There are too many clients, or the gateway ends")}}},
        },
        "components": {"schemas": _shapes(model, "#/components/schemas/") | {
            "Histogram": _object({
                "name": TEXT, "help": TEXT, "count": COUNT, **{f"{what}_us": {"type": ["number", "null"]} for what in (
                    "min", "mean", "max", "p50", "p99")},
                "buckets": {**_list({"type": "array", "prefixItems": [
                    {"type": "number", "description": "Lower bound in microseconds"}, COUNT], "items": False,
                    "minItems": 2}), "description": "Those that are not empty"}}),
            "Finding": _object({
                "check": TEXT,
                "subject": {"type": "string", "description": 'A core, network interface or device; "" = the computer'},
                "verdict": {"enum": list(VERDICTS)}, "why": TEXT,
                "mend": {"type": "string", "description": 'What to do; "" = nothing'},
                "keep": {"type": "string", "description": 'How to keep it after the next boot; "" = it is kept'}}),
            "Record": _object({
                "name": TEXT, "time": {**TEXT, "format": "date-time"}, "reason": TEXT,
                "text": {"type": "string", "description": "The reason in words"}, "bytes": COUNT}),
            "Terminal": _object({
                "name": TEXT, "terminal": {"type": "string", "description": 'As printed on the board; "" = none'},
                "label": {"type": "string", "description": "Such as OC1"}, "kind": {"enum": list(KINDS.values())}}),
            "Session": _object({
                "format": FORMAT, "user": USER, "level": {"enum": [*LEVELS, None]},
                "required": {"type": "boolean", "description": "Nothing is to be read without a log-in"},
                "users": {"type": "boolean", "description": "There are users that may log in"},
                "plaintext": {"type": "boolean", "description": "Whoever is on the network can read passwords"}}),
            "Error": _object({"error": _object({"code": {"enum": [int(one) for one in HTTPStatus if one >= 400]},
                                                "message": TEXT})})}},
    }


def _methods() -> dict[str, tuple[str, Schema, Schema]]:
    """Methods of the WebSocket: what each does, its parameters, its result."""
    def ref(name: str) -> Schema:
        return {"$ref": "#/$defs/" + name}
    none = _object({})
    nothing = _only({})
    objects = {"objects": {**_map(_null_or(_list(TEXT)), "Names of values by device, with the wildcards *, ? and [ ]; "
                                                         "null = all of the state"), "minProperties": 1}}
    status = _map(_null_or(ref("State")), "By device; null = there is none of this name any more")
    return {
        "server.info": ("About the gateway and this connection", nothing, _object({
            "format": FORMAT, "version": TEXT, "user": USER, "level": {"enum": list(LEVELS)},
            "operate": {**FLAG, "description": "This client may operate LinuxCNC, if it runs"},
            "trouble": TROUBLE, "devices": _list(TEXT), "clients": COUNT,
            "skipped": {**COUNT, "description": "States that this client did not get, because it was slow"}})),
        "objects.list": ("Names of the devices", nothing, _object({"objects": _list(TEXT)})),
        "objects.query": ("Values of this moment", _only(objects), _object(
            {"eventtime": EVENTTIME, "status": status})),
        "objects.subscribe": (
            "Send values when they change, until the next subscription of this client; the answer is the first state",
            _only(objects, rate={"type": "number", "minimum": RATE_LEAST, "maximum": RATE_MOST, "default": 2,
                                   "description": "At most so often, a second"}),
            _object({"eventtime": EVENTTIME, "status": status, "serial": SERIAL,
                     "rate": {"type": "number", "description": "How often, a second"}})),
        "objects.unsubscribe": ("Send no more values", nothing, none),
        "events.list": ("What has happened to a device", _only({"device": TEXT}, since=_object(
            {"epoch": COUNT, "number": COUNT})),
                        _object({"events": _list(ref("Event"))})),
        **_console(none),
        **_operating(none),
    }


def _console(none: Schema) -> dict[str, tuple[str, Schema, Schema]]:
    """Methods of the console."""
    nothing = _only({})
    job = _object({"file": TEXT, "line": COUNT, "byte": COUNT, "size": COUNT, "waits": FLAG})
    heater = _object({"name": TEXT, "index": {**COUNT, "description": "Its number in names such as heater.00.target"},
                      "letter": {**TEXT, "description": "As M105 shows it: T0, B, C"},
                      "most": {"type": "number", "description": "Highest target, degrees C"}})
    return {
        "console.info": ("About the machine of the console", nothing, _object(
            {"machine": {"type": ["string", "null"], "description": "null = there is none now"},
             "why": {"type": "string", "description": 'Why there is none; "" if there is one'},
             "send": {**FLAG, "description": "Lines of this client go to the machine, after console.subscribe"}},
            device={"type": ["string", "null"], "description": "That G-code commands"}, heaters=_list(heater),
            axes={**_list(TEXT), "description": "Their letters"},
            outputs={**_list(_only({"word": {**TEXT, "description": "Behind M42, such as P31"},
                                    "name": {**TEXT, "description": "Of the value that shows it"}})),
                     "description": "What M42 may switch"},
            files={**FLAG, "description": "There is a folder of G-code files"},
            halted={"type": "string", "description": 'Why nothing is commanded until M999; "" = it is'},
            message={"type": "string", "description": "The text of the last M117"},
            job={**_null_or(job), "description": "Of a file; null = none is under way"})),
        "console.subscribe": ("Be a client of the console, and get what the machine says", nothing, none),
        "console.jog": (
            "Move an axis for a tenth of a second, to be repeated as long as a key is held; speed 0 ends it", _only({
                "axis": {**TEXT, "description": "Its letter"},
                "speed": {"type": "number", "description": "Units per second"},
                "press": {"type": "integer", "description": "Another number each time the key is pressed"}}), none),
        "files.begin": ("Begin a file of G-code for the machine; it appears with files.finish",
                        _only({"name": TEXT}), none),
        "files.write": ("More of it", _only({"data": TEXT}), none),
        "files.finish": ("It is complete", nothing, none),
        "console.send": ("Send a line to the machine, or a command of the console; replies come as console.said",
                         _only({"line": {**TEXT, "description": "Of at most 256 bytes, without its end"}}), none),
    }


def _operating(none: Schema) -> dict[str, tuple[str, Schema, Schema]]:
    """Methods that pokeys-remote carries out; the answer says that it has taken the command."""
    nothing = _only({})
    later = "; linuxcnc.done says what LinuxCNC has made of it"
    number: Schema = {"type": "number"}
    return {
        "emergency_stop": ("LinuxCNC's emergency stop, before all commands that wait", nothing, none),
        "linuxcnc.stop": ("Stop all movement, before all commands that wait", nothing, none),
        "linuxcnc.subscribe": ("Send LinuxCNC's state, and what changes", nothing, none),
        "linuxcnc.mode": ("Change the mode" + later, _only({"mode": {"enum": ["manual", "mdi", "auto"]}}), none),
        "linuxcnc.mdi": ("Carry out a line of G-code" + later, _only({"line": {**TEXT, "maxLength": 255}}), none),
        "linuxcnc.run": ("Run the loaded programme" + later, nothing, none),
        "linuxcnc.pause": ("Pause the programme" + later, nothing, none),
        "linuxcnc.resume": ("Go on with it" + later, nothing, none),
        "linuxcnc.home": ("Home a joint, or all with -1" + later, _only({"joint": {"type": "integer", "minimum": -1}}),
                          none),
        "linuxcnc.override": ("Set an override" + later, _only({
            "what": {"enum": ["feed", "rapid", "spindle"]}, "value": {**number, "minimum": 0}}), none),
        "linuxcnc.jog": (
            "Jog for half a second, to be repeated as long as a key is held; speed 0 ends it" + later, _only({
                "axis": {**TEXT, "description": "The letter of an axis, or the number of a joint"},
                "speed": {**number, "description": "Machine units per second"},
                "press": {"type": "integer", "description": "Another number each time the key is pressed"}}), none),
    }


def _notifications() -> dict[str, Schema]:
    """What comes from LinuxCNC between the answers."""
    def notification(name: str, params: Schema) -> Schema:
        return _object({"jsonrpc": {"const": "2.0"}, "method": {"const": name}, "params": params})
    number: Schema = {"type": "number"}
    known: Schema = {"type": ["number", "null"]}
    words = dict.fromkeys(("task", "mode", "interpreter", "motion", "file"), TEXT)
    return {
        "linuxcnc.done": notification("linuxcnc.done", _object({
            "id": {"type": ["string", "number", "null"], "description": "Of the request"},
            "error": {"type": ["string", "null"], "description": "Why LinuxCNC has not taken the command"}})),
        "console.said": notification("console.said", _object({"lines": _list(TEXT)})),
        "linuxcnc.said": notification("linuxcnc.said", _object({"kind": {"enum": ["error", "text"]}, "text": TEXT})),
        "linuxcnc.state": notification("linuxcnc.state", _object(
            {}, connected={**FLAG, "description": "What was sent before it is to be forgotten"}, why=TEXT, **words,
            paused=FLAG, moving=FLAG, line={"type": "integer"}, joints=COUNT, axes=_list(TEXT),
            position=_map(known, "By axis, in machine units"), homed={**_list(FLAG), "description": "By joint"},
            feed_override=known, rapid_override=known, spindle_override=known, spindle_speed=known,
            max_feed_override=number, max_rapid_override=number, max_spindle_override=number)),
    }


def messages(model: Model) -> Schema:
    """The messages of the WebSocket; the document itself describes what the gateway sends."""
    def ref(name: str) -> Schema:
        return {"$ref": "#/$defs/" + name}
    number: Schema = {"type": ["string", "number", "null"]}
    methods = _methods()
    requests = []
    for name, (what, params, _result) in methods.items():
        request = _object({"jsonrpc": {"const": "2.0"}, "method": {"const": name}}, id=number,
                          params=ref(f"{name}.params"))
        # without an id there is no answer, and the answer is the first state
        request["required"] += ["params"] * bool(params["required"]) + ["id"] * (name == "objects.subscribe")
        requests.append({**request, "description": what})
    change = _object({}, connected=FLAG, reason=TEXT, values=ref("Values"), whole={
        "const": True, "description": "It has all values of the device, and those before are to be forgotten"})
    update = _object({"jsonrpc": {"const": "2.0"}, "method": {"const": "notify_status_update"}, "params": {
        "type": "array", "minItems": 3, "maxItems": 3, "items": False, "prefixItems": [
            _map(_null_or(change), "By device, what has changed; all of it, if full"), EVENTTIME,
            _object({"serial": SERIAL, "full": FLAG})]}})
    error = _object({"jsonrpc": {"const": "2.0"}, "id": number,
                     "error": _object({"code": {"type": "integer"}, "message": TEXT})})
    result = _object({"jsonrpc": {"const": "2.0"}, "id": number, "result": {
        "type": "object", "description": "METHOD.result of the method of the request with this id"}})
    return {
        "$schema": DIALECT, "title": "Messages of pokeys-gateway's WebSocket",
        "anyOf": [ref("notify_status_update"), *map(ref, _notifications()), ref("answer"), _list(ref("answer"))],
        "$defs": {
            **_shapes(model, "#/$defs/"),
            **{f"{name}.params": params for name, (_what, params, _result) in methods.items()},
            **{f"{name}.result": result for name, (_what, _params, result) in methods.items()},
            "request": {"oneOf": requests},
            "answer": {"oneOf": [result, error]},
            "notify_status_update": update,
            **_notifications(),
        },
    }
