# SPDX-License-Identifier: GPL-2.0-or-later
"""The commands of ESP3D 3.0 that there are, and what they do.

ESP3D's settings are in its flash memory. Here they are in the configuration and in the file of users, which
the gateway may only read: a command that would change one says where it is set instead.
"""
from __future__ import annotations

import asyncio
import re
import socket
from collections.abc import Callable
from typing import Any

from .. import __version__, config
from ..access import SESSION_S
from ..board import terminals
from ..folder import NotPermitted, TooLarge
from .client import Client
from .commands import Command, Commands, Listing, Refused, Words
from .urgent import FIRMWARES

PAUSE_MOST_MS = 60_000
NEVER_SET = "by the gateway, and cannot be changed"
NO_PORT = "the machine has no port: the gateway itself takes its lines"
HIDDEN = "********"         # ESP3D's word for a password


def _nothing(number: int, words: Words) -> None:
    if words.plain or words.named:
        raise Refused(f"[ESP{number}] takes no parameters")


def _set_elsewhere(words: Words, where: str) -> None:
    """Refuse to set what this command shows."""
    if words.plain or words.named:
        raise Refused(f"this is set {where}")


def _in_file(commands: Commands, key: str) -> str:
    return f"with {key} in {commands.config.file}; restart the gateway then"


def _help(commands: Commands, _client: Client, words: Words) -> str:
    table = commands.table
    if not words.plain:
        return "\n".join(f"[ESP{number}]{one.usage} - {one.help}" for number, one in table.items())
    number = int(words.plain[0]) if re.fullmatch(r"[0-9]{1,3}", words.plain[0]) else -1
    if not (one := table.get(number)):
        raise Refused(f"there is no command [ESP{words.plain[0][:16]}]; [ESP0] lists them")
    return f"[ESP{number}]{one.usage} - {one.help}"


def _address(_commands: Commands, client: Client, words: Words) -> Any:
    if words.plain not in ((), ("ALL",)):
        raise Refused("[ESP111] takes ALL, or nothing")
    return Listing("", {"ip": client.here}) if words.plain else client.here


def _host_name(_commands: Commands, _client: Client, words: Words) -> str:
    _set_elsewhere(words, "with hostnamectl")
    return socket.gethostname()


def _service(kind: str, section: str) -> Callable[[Commands, Client, Words], str]:
    """Whether a door is open; CLOSE ends its connections."""
    def run(commands: Commands, client: Client, words: Words) -> str:
        if words.plain == ("CLOSE",):
            commands.need("admin", client)
            for one in [one for one in commands.clients() if one.kind == kind]:
                one.on_close()
            return "ok"
        _set_elsewhere(words, _in_file(commands, f"listen in [{section}]"))
        return "ON" if commands.listens(section) else "OFF"
    return run


def _port(section: str, further: int = 0) -> Callable[[Commands, Client, Words], str]:
    """Where a door listens."""
    def run(commands: Commands, _client: Client, words: Words) -> str:
        _set_elsewhere(words, _in_file(commands, f"listen in [{section}]"))
        return ", ".join(str(one.port + further) for one in commands.listens(section)) or "none"
    return run


def _pin(commands: Commands, _client: Client, words: Words) -> str:
    """The value of a terminal, or of any name, of a PoKeys device."""
    if "V" in words.named:
        raise Refused("the gateway only reads devices")
    if not (wanted := words.named.get("P")):
        raise Refused("[ESP201] takes P=TERMINAL, or P= a name of pokeysctl names; D=DEVICE if there are several")
    name, state = commands.device(words.named.get("D"))
    if re.fullmatch(r"[0-9]{1,3}", wanted):
        found = [one.name for one in terminals(commands.model(), state) if one.terminal == str(int(wanted))]
        if not found:
            raise Refused(f"terminal {int(wanted)} of {name} is not set up")
        wanted = found[0]
    try:
        value = state[wanted]
    except KeyError:
        raise Refused(f"no value is named {wanted[:64]!r}; pokeysctl names lists the names") from None
    return str(int(value) if isinstance(value, bool) else value)


def _pins(commands: Commands, _client: Client, words: Words) -> Listing:
    name, state = commands.device(words.named.get("D"))
    return Listing(f"Pins of {name}:", [
        {"id": one.terminal or one.label, "value": f"{one.kind} {one.name}"}
        for one in terminals(commands.model(), state)])


async def _pause(_commands: Commands, _client: Client, words: Words) -> str:
    text = words.plain[0] if len(words.plain) == 1 else ""
    if not re.fullmatch(r"[0-9]{1,5}", text) or int(text) > PAUSE_MOST_MS:
        raise Refused(f"[ESP290] takes the milliseconds to wait, 0 to {PAUSE_MOST_MS}")
    await asyncio.sleep(int(text) / 1000)
    return "ok"


def _settings(commands: Commands, _client: Client, words: Words) -> Listing:
    """As ESP3D-WEBUI shows them: filter, position, type, value, label, choices, limits."""
    _nothing(400, words)
    settings = commands.config
    switch = [{"no": "0"}, {"yes": "1"}]
    rows: list[dict[str, Any]] = [
        {"F": "network/network", "P": "130", "T": "S", "V": socket.gethostname(), "H": "hostname", "S": "32", "M": "1"}]
    for section, on, port in (("esp3d", "328", "121"), ("telnet", "329", "125")):
        where = f"service/{'http' if section == 'esp3d' else 'telnetp'}"
        found = commands.listens(section)
        rows.append({"F": where, "P": on, "T": "B", "V": str(int(bool(found))), "H": "enable", "O": switch})
        if found:
            rows.append({"F": where, "P": port, "T": "I", "V": str(found[0].port), "H": "port", "S": "65535", "M": "1"})
    rows += [
        {"F": "system/system", "P": "648", "T": "B", "V": str(FIRMWARES[settings.machine_firmware]), "H": "targetfw",
         "O": [{name: str(number)} for name, number in FIRMWARES.items()]},
        {"F": "system/system", "P": "112", "T": "I", "V": str(settings.machine_baud), "H": "baud",
         "S": str(config.BAUD_MOST), "M": str(config.BAUD_LEAST)},
        {"F": "security/security", "P": "1040", "T": "B", "V": str(int(SESSION_S / 60)), "H": "session timeout",
         "S": "720", "M": "0"}]
    return Listing("Settings:", rows, lambda row: f"{row['F']}/{row['H']}: {row['V']}")


def _set(commands: Commands, _client: Client, words: Words) -> str:
    for name in "P", "T", "V":
        if name not in words.named:
            raise Refused(f"Invalid parameter {name}")
    if words.named["P"] not in SETTINGS:
        raise Refused("This setting is unknown; [ESP400] lists them")
    key = SETTINGS[words.named["P"]]
    raise Refused("this is set " + (_in_file(commands, key) if key else
                                    NEVER_SET if key is None else "with hostnamectl"))


def _networks(_commands: Commands, _client: Client, words: Words) -> Listing:
    """This computer's networks are not the gateway's business."""
    _nothing(410, words)
    return Listing("", [], text="Start Scan\nEnd Scan")


def _queue(client: Client) -> str:
    outbox = client.outbox
    return f"lines sent: {client.lines}, waiting: {len(outbox)}, most waiting: {outbox.most}, dropped: {outbox.dropped}"


def _status(commands: Commands, client: Client, _words: Words) -> Listing:
    router = commands.router
    assert router
    machine = router.machine
    rows = {
        "FW ver": f"pokeys-gateway {__version__}",
        "hostname": socket.gethostname(),
        "machine": f"{machine.name}, {_queue(machine)}" if machine else router.why_no_machine,
        **({"baud": str(commands.config.machine_baud)} if commands.port else {}),
        "stops": str(router.stops),
        "messages": f"in memory: {router.ledger.live}, since the start: {router.ledger.made}"}
    found = [{"id": name, "value": value} for name, value in rows.items()]
    return Listing("Configuration:", found + [
        {"id": "this client" if one is client else "client",
         "value": f"{one}, {one.level(commands.access) or 'not logged in'}, {_queue(one)}"} for one in router.clients])


def _state(commands: Commands, _client: Client, words: Words) -> str:
    if words.plain == ("RESTART",):
        commands.on_restart()
        return "Now restarting..."
    if words.plain == ("RESET",):
        raise Refused(f"settings are in {commands.config.file}; remove it for the defaults, and restart the gateway")
    raise Refused("[ESP444] takes RESTART")


def _level(commands: Commands, client: Client, words: Words) -> str:
    if words.plain:
        raise Refused("[ESP500] takes user=NAME and pwd=PASSWORD, or nothing")
    return client.level(commands.access) or "Not authenticated"


def _session(_commands: Commands, _client: Client, words: Words) -> str:
    """In minutes; of log-ins to pages."""
    _set_elsewhere(words, NEVER_SET)
    return str(int(SESSION_S / 60))


def _password(user: str) -> Callable[[Commands, Client, Words], str]:
    def run(_commands: Commands, _client: Client, words: Words) -> str:
        if words.plain:
            raise Refused(f"the gateway may not change passwords; run: sudo pokeys-gateway --set-user {user}")
        return HIDDEN
    return run


async def _files(commands: Commands, _client: Client, words: Words) -> Listing:
    path = words.plain[0] if words.plain else "/"
    try:
        found = await commands.folder().aside(commands.folder().listing, path)
    except OSError as error:
        raise Refused(f"{path[:64]}: {error.strerror}") from None

    rows = (f"[DIR] \t{one['name']}" if one["size"] == "-1" else f"     \t{one['name']} \t{one['size']} \t{one['time']}"
            for one in found["files"])
    return Listing("", found, text="\n".join((
        f"Directory on Flash : {found['path']}", *rows, f"Used {found['used']} of {found['total']}")))


async def _file(commands: Commands, client: Client, words: Words) -> str:
    """rmdir, remove, mkdir, create, exists."""
    if len(words.named) != 1 or not words.named.keys() <= FILE_ACTIONS.keys():
        raise Refused(f"[ESP730] takes one of {', '.join(f'{name}=PATH' for name in FILE_ACTIONS)}")
    (name, path), = words.named.items()
    folder = commands.folder()
    try:
        if name == "exists":
            return "yes" if await folder.aside(folder.exists, path) else "no"
        await folder.aside(folder.act, FILE_ACTIONS[name], "/", path, client.level(commands.access))
    except (NotPermitted, TooLarge) as error:
        raise Refused(str(error)) from None
    except OSError as error:
        raise Refused(f"{path[:64]}: {error.strerror}") from None
    return "ok"


def _abilities(commands: Commands, client: Client, _words: Words) -> Listing:
    """What a page can expect; time, tz, version and setup are taken and not needed."""
    settings = commands.config
    pages = commands.listens("esp3d")
    return Listing("Capabilities:", {
        "FWVersion": f"pokeys-gateway {__version__}", "FWTarget": settings.machine_firmware,
        "FWTargetID": str(FIRMWARES[settings.machine_firmware]), "Setup": "Disabled", "SDConnection": "none",
        "SerialProtocol": "Raw", "Authentication": "Enabled" if commands.access.users else "Disabled",
        "WebCommunication": "Synchronous", "WebSocketIP": client.here,
        "WebSocketPort": str(pages[0].port + 1) if pages else "0", "Hostname": socket.gethostname(),
        "WiFiMode": "STA", "WebUpdate": "Disabled", "FlashFileSystem": "LittleFS" if settings.esp3d_folder else "none",
        "HostPath": "/", "Time": "Auto", "Screen": "none"})


def _serial(commands: Commands, client: Client, words: Words) -> str:
    port = commands.port
    if commands.config.machine_kind == config.POKEYS:
        raise Refused(NO_PORT)
    if not port:
        raise Refused(f"no machine is configured; it is set {_in_file(commands, 'port in [machine]')}")
    if words.plain in (("ENABLE",), ("DISABLE",)):
        commands.need("admin", client)
        port.enable(words.plain == ("ENABLE",))
        return "ok"
    if words.plain:
        raise Refused("[ESP900] takes ENABLE or DISABLE, or nothing")
    return f"{'ENABLED' if port.enabled else 'DISABLED'} - {port.path}"


def _baud(commands: Commands, _client: Client, words: Words) -> str:
    if commands.config.machine_kind == config.POKEYS:
        raise Refused(NO_PORT)
    _set_elsewhere(words, _in_file(commands, "baud in [machine]"))
    return str(commands.config.machine_baud)


# where the settings of _settings are set, by their position
SETTINGS = {"130": "", "328": "listen in [esp3d]", "121": "listen in [esp3d]", "329": "listen in [telnet]",
            "125": "listen in [telnet]", "648": "firmware in [machine]", "112": "baud in [machine]", "1040": None}
# ESP3D's words for actions, and those of its /files
FILE_ACTIONS = {"rmdir": "deletedir", "remove": "delete", "mkdir": "createdir", "create": "create", "exists": ""}

TABLE = {
    0: Command("", "[NUMBER]", "list the commands, or explain one", _help),
    111: Command("guest", "[ALL]", "show the address at which this client reaches the gateway", _address),
    112: Command("guest", "", "show the name of the computer", _host_name),
    120: Command("guest", "[CLOSE]", "show whether pages are served; CLOSE ends their connections",
                 _service("web", "esp3d")),
    121: Command("guest", "", "show the port for pages", _port("esp3d")),
    130: Command("guest", "[CLOSE]", "show whether telnet is served; CLOSE ends its connections",
                 _service("telnet", "telnet")),
    131: Command("guest", "", "show the port for telnet", _port("telnet")),
    160: Command("guest", "[CLOSE]", "show whether web sockets are served; CLOSE ends those for lines",
                 _service("websocket", "esp3d")),
    161: Command("guest", "", "show the port for web sockets", _port("esp3d", 1)),
    201: Command("guest", "P=TERMINAL [D=DEVICE]", "show the value at a terminal of a PoKeys device", _pin),
    220: Command("guest", "[D=DEVICE]", "show the terminals of a PoKeys device that are set up", _pins),
    290: Command("user", "MILLISECONDS", "wait before the next line of this client", _pause),
    400: Command("guest", "", "show the settings", _settings),
    401: Command("admin", "P=POSITION T=TYPE V=VALUE", "say where a setting is set", _set),
    410: Command("guest", "", "list wireless networks: none", _networks),
    420: Command("guest", "", "show the machine, the clients and what waits for them", _status),
    444: Command("admin", "RESTART", "start the gateway again", _state),
    500: Command("", "[user=NAME pwd=PASSWORD]", "show what this client may do; log in", _level),
    510: Command("guest", "", "show after how many minutes without requests a page has to log in again", _session),
    550: Command("admin", "", "say how the password of user admin is changed", _password("admin")),
    555: Command("admin", "", "say how the password of user user is changed", _password("user")),
    **{number: Command("guest", "[PATH]", "list the files of a folder", _files) for number in (720, 740, 780)},
    **{number: Command("user", "ACTION=PATH", "rmdir, remove, mkdir or create a file or folder; exists?", _file)
       for number in (730, 750, 790)},
    800: Command("guest", "", "show what a page can expect", _abilities),
    900: Command("guest", "[ENABLE|DISABLE]",
                 "show whether the machine's port is used; DISABLE leaves it to another program", _serial),
    901: Command("guest", "", "show the bits per second of the machine's port", _baud),
}
