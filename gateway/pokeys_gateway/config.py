# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-gateway.conf(5): one table of keys."""
from __future__ import annotations

import grp
import ipaddress
import os
import re
import ssl
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from pokeys._ini import Faults, File, Key, yes_or_no

from .access import LEVELS, User, parse_users
from .console.urgent import FIRMWARES
from .gate import is_loopback, plain

PATH = Path("/etc/pokeysd/gateway.conf")
USERS = Path("/etc/pokeysd/gateway.users")
RUNTIME, PORT = "/run/pokeysd", 8580
RECORDS = Path("/var/log/pokeysd")
DOCTOR = Path("/run/pokeys-doctor")     # for the daemon of RUNTIME
BAUD_LEAST, BAUD_MOST = 50, 4_000_000
PINS, CHANNELS, EXTERNALS = 55, 6, 8        # of a PoKeys device
ANALOG = 64                 # outputs of LinuxCNC's motion
SERIAL, POKEYS = "serial", "pokeys"     # kinds of machines
SOCKET_MOST = 107           # bytes of a socket's path (unix(7))
DIRECTORY_MOST = 49         # pokeysd's sockets lie below it
_PROXY = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,46}")
_DEVICE = re.compile(r"[A-Za-z0-9_-]{1,31}")
_NAME = re.compile(r"[a-z0-9]([a-z0-9.-]{0,252}[a-z0-9])?")


@dataclass(frozen=True)
class Endpoint:
    """An address to listen on."""

    host: str
    port: int

    @property
    def loopback(self) -> bool:
        """Only this computer reaches it."""
        return is_loopback(self.host)

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


@dataclass(frozen=True)
class Output:
    """An output of a PoKeys device."""

    kind: str               # "pin": a digital one; "pwm": a channel of PWM; "external": a relay or the like
    number: int             # of the terminal, as printed on the board; else that in names of values

    @property
    def place(self) -> str:
        """In names of values."""
        return f"{self.kind}.{self.number - (self.kind == 'pin'):02}"

    @property
    def title(self) -> str:
        """In messages."""
        return f"terminal {self.number}" if self.kind == "pin" else f"{self.kind} {self.number}"


@dataclass(frozen=True)
class Config:
    """All settings."""

    file: Path = PATH
    runtime_directory: str = RUNTIME
    record_folder: Path = RECORDS
    doctor_socket: Path | None = None
    listen: tuple[Endpoint, ...] = (Endpoint("127.0.0.1", PORT),)
    host_names: tuple[str, ...] = ()
    certificate: Path | None = None
    key: Path | None = None
    behind_proxy: tuple[str, ...] = ()
    plaintext: bool = False
    users: Path = USERS
    guests: bool = False
    operate: bool = False
    proxy: str = "pokeys-remote"
    hotend: int | None = None               # numbers of motion.analog-out, for G-code's targets
    bed: int | None = None
    chamber: int | None = None
    fan: int | None = None
    machine_kind: str | None = None         # None: as there is a port or not
    machine_device: str | None = None       # that G-code commands
    machine_folder: Path | None = None      # of files of G-code
    machine_fan: tuple[Output, ...] = ()
    machine_spindle: Output | None = None           # on
    machine_spindle_speed: Output | None = None
    machine_spindle_reverse: Output | None = None
    machine_spindle_max: float = 0.0                # revolutions/min, at the full duty
    machine_port: Path | None = None
    machine_baud: int = 115200
    machine_flow_control: str = "none"
    machine_firmware: str = "marlin"
    telnet_listen: tuple[Endpoint, ...] = ()
    telnet_plaintext: bool = False
    pty_path: Path | None = None
    pty_group: str | None = None
    esp3d_listen: tuple[Endpoint, ...] = ()
    esp3d_folder: Path | None = None
    esp3d_plaintext: bool = False
    console_level: str | None = None        # None: as for HTTP


def directory(text: str) -> str:
    """An absolute path that is short enough. ValueError says what is allowed."""
    try:
        size = len(text.encode())
    except UnicodeEncodeError:
        size = DIRECTORY_MOST + 1
    if not text.startswith("/") or size > DIRECTORY_MOST or not text.isprintable():
        raise ValueError(f"a path from / of at most {DIRECTORY_MOST} characters (bytes of UTF-8)")
    return text


def endpoint(text: str) -> Endpoint:
    """ADDRESS:PORT. ValueError says what is allowed."""
    found = re.fullmatch(r"(?:\[([^]]+)\]|([^:]+)):(\d{1,5})", text)
    try:
        if not found or not 1 <= int(found[3]) <= 65535:
            raise ValueError
        address = ipaddress.ip_address(found[1] or found[2])
    except ValueError:
        raise ValueError(f"ADDRESS:PORT, such as 127.0.0.1:{PORT} or [::1]:{PORT}") from None
    return Endpoint(str(address), int(found[3]))


def endpoints(text: str) -> tuple[Endpoint, ...]:
    """One or several endpoints, separated by commas."""
    found = tuple(endpoint(word.strip()) for word in text.split(","))
    if len(set(found)) < len(found):
        raise ValueError("each address once")
    return found


def host_names(text: str) -> tuple[str, ...]:
    """Names of this computer, separated by commas."""
    names = tuple(word.strip().lower() for word in text.split(",") if word.strip())
    if not all(_NAME.fullmatch(name) for name in names):
        raise ValueError("names of this computer, such as mill.local")
    return names


def path(text: str) -> Path:
    """An absolute path."""
    if not text.startswith("/") or not text.isprintable():
        raise ValueError("a path from /")
    return Path(text)


def socket_path(text: str) -> Path:
    """An absolute path that a socket can have."""
    if len(os.fsencode(path(text))) > SOCKET_MOST:
        raise ValueError(f"a path from / of at most {SOCKET_MOST} bytes")
    return Path(text)


def addresses(text: str) -> tuple[str, ...]:
    """One or several addresses, separated by commas."""
    try:
        if "%" in text:
            raise ValueError
        return tuple(plain(word.strip()) for word in text.split(","))
    except ValueError:
        raise ValueError("addresses, such as 192.168.1.2") from None


def proxy_name(text: str) -> str:
    """The name of a HAL component, which a proxy has."""
    if not _PROXY.fullmatch(text):
        raise ValueError("the name of a pokeys-remote, as its --name says")
    return text


def device(text: str) -> str:
    """A device's name in pokeysd.conf."""
    if not _DEVICE.fullmatch(text):
        raise ValueError("the name of a device in pokeysd.conf, of letters, digits, _ and -")
    return text


def outputs(text: str) -> tuple[Output, ...]:
    """One or several outputs, separated by commas. ValueError says what is allowed."""
    return tuple(_output(word.strip(), "pin", "external", "pwm") for word in text.split(","))


def pin(text: str) -> Output:
    """An output that is on or off."""
    return _output(text, "pin", "external")


def pwm(text: str) -> Output:
    """A channel of PWM."""
    return _output(text, "pwm")


def _output(text: str, *kinds: str) -> Output:
    numbers = {"pin": range(1, PINS + 1), "external": range(EXTERNALS), "pwm": range(CHANNELS)}
    names = {"pin": "a terminal", "external": "the number of an output", "pwm": "a channel"}
    found = re.fullmatch(r"(pin|external|pwm)\s+(\d{1,2})", text)
    if not found or found[1] not in kinds or int(found[2]) not in numbers[found[1]]:
        raise ValueError(", ".join(f"{kind} and {names[kind]}, {numbers[kind][0]} to {numbers[kind][-1]}"
                                   for kind in kinds))
    return Output(found[1], int(found[2]))


def analog(text: str) -> int:
    """The number of an analog output of LinuxCNC."""
    if not re.fullmatch(r"\d{1,2}", text) or int(text) >= ANALOG:
        raise ValueError(f"the N of motion.analog-out-N, 0 to {ANALOG - 1}")
    return int(text)


def revolutions(text: str) -> float:
    """Revolutions a minute."""
    if not re.fullmatch(r"[0-9]{1,6}(\.[0-9]{1,3})?", text) or not float(text):
        raise ValueError("revolutions per minute, such as 24000")
    return float(text)


def baud(text: str) -> int:
    """Bits a second. ValueError says what is allowed."""
    if not re.fullmatch(r"[0-9]{2,8}", text) or not BAUD_LEAST <= int(text) <= BAUD_MOST:
        raise ValueError(f"bits a second, {BAUD_LEAST} to {BAUD_MOST}")
    return int(text)


def group(text: str) -> str:
    """A group of this computer. ValueError says what is allowed."""
    try:
        return grp.getgrnam(text).gr_name
    except KeyError:
        raise ValueError("the name of a group that is there") from None


def one_of(*words: str) -> Callable[[str], str]:
    """A word of these, for a :class:`Key`."""
    def convert(text: str) -> str:
        if text not in words:
            raise ValueError(", ".join(words))
        return text
    return convert


KEYS = (
    Key("gateway", "runtime-directory", directory),
    Key("gateway", "record-folder", path),
    Key("gateway", "doctor-socket", socket_path),
    Key("http", "listen", endpoints),
    Key("http", "host-names", host_names),
    Key("http", "certificate", path),
    Key("http", "key", path),
    Key("http", "behind-proxy", addresses),
    Key("http", "plaintext", yes_or_no),
    Key("access", "users", path),
    Key("access", "guests", yes_or_no),
    Key("linuxcnc", "operate", yes_or_no),
    Key("linuxcnc", "proxy", proxy_name),
    Key("linuxcnc", "hotend", analog),
    Key("linuxcnc", "bed", analog),
    Key("linuxcnc", "chamber", analog),
    Key("linuxcnc", "fan", analog),
    Key("machine", "kind", one_of(SERIAL, POKEYS)),
    Key("machine", "device", device),
    Key("machine", "folder", path),
    Key("machine", "fan", outputs),
    Key("machine", "spindle", pin),
    Key("machine", "spindle-speed", pwm),
    Key("machine", "spindle-reverse", pin),
    Key("machine", "spindle-max", revolutions),
    Key("machine", "port", path),
    Key("machine", "baud", baud),
    Key("machine", "flow-control", one_of("none", "hardware", "software")),
    Key("machine", "firmware", one_of(*FIRMWARES)),
    Key("telnet", "listen", endpoints),
    Key("telnet", "plaintext", yes_or_no),
    Key("pty", "path", path),
    Key("pty", "group", group),
    Key("esp3d", "listen", endpoints),
    Key("esp3d", "folder", path),
    Key("esp3d", "plaintext", yes_or_no),
    Key("console", "level", one_of(*LEVELS)),
)
OWN = "machine", "telnet", "pty", "esp3d", "console"       # sections whose name begins the names of their attributes


def _attribute(section: str, key: str) -> str:
    """Of a :class:`Config`."""
    return f"{section}_{key}" if section in OWN else key


def doctor_socket(config: Config) -> Path | None:
    """The doctor's, if one is named, or if the usual one is for our daemon."""
    return config.doctor_socket or (DOCTOR if config.runtime_directory == RUNTIME else None)


def read(file: Path | None) -> tuple[Config, dict[str, str]]:
    """The configuration of a file, and the places of its keys; without one, PATH if it is there. :class:`Faults`."""
    wanted = file or PATH
    try:
        found = File(wanted, KEYS).read()
    except FileNotFoundError as error:
        if not file:
            return Config(), {}
        raise Faults([f"{wanted}: {error.strerror}"]) from None
    values = {_attribute(section, key): value
              for (section, _), keys in found.values.items() for key, value in keys.items()}
    places = {_attribute(section, key): place for (section, _, key), place in found.places.items()}
    return replace(Config(), file=wanted, **values), places


def read_users(config: Config) -> dict[str, User] | None:
    """The users that there are; None if there is no file of them. :class:`Faults`."""
    try:
        status = config.users.stat()
        text = config.users.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except OSError as error:
        raise Faults([f"{config.users}: {error.strerror}"]) from None
    except UnicodeDecodeError:
        raise Faults([f"{config.users}: not a text file (UTF-8)"]) from None
    if status.st_mode & 0o027 or status.st_uid not in (0, os.geteuid()):
        raise Faults([f"{config.users}: others may read or change it; chown root and chmod 640 {config.users}"])
    users, faults = parse_users(text)
    if faults:
        raise Faults([f"{config.users}:{line}: {text}" for line, text in faults])
    return users


def _judge_outputs(config: Config) -> Iterator[tuple[str, str]]:
    for name in "hotend", "bed", "chamber", "fan":
        if getattr(config, name) is not None and (not config.operate or config.machine_kind != POKEYS):
            yield name, f"{name} needs operate = yes and kind = {POKEYS} in [machine]: it is for G-code of the console"
    given = [name for name in ("machine_fan", "machine_spindle", "machine_spindle_speed", "machine_spindle_reverse",
                               "machine_spindle_max") if getattr(config, name)]
    if given and not config.machine_device:
        yield given[0], "outputs need device: they are that device's"
        return
    if bool(config.machine_spindle_speed) != bool(config.machine_spindle_max):
        yield (("machine_spindle_speed", "spindle-max is missing") if config.machine_spindle_speed else
               ("machine_spindle_max", "spindle-speed is missing"))
    if config.machine_spindle_reverse and not (config.machine_spindle or config.machine_spindle_speed):
        yield "machine_spindle_reverse", "spindle or spindle-speed is missing"
    used: set[Output] = set()
    for name in given:
        value = getattr(config, name)
        for one in value if isinstance(value, tuple) else (value,) if isinstance(value, Output) else ():
            if one in used:
                yield name, f"{one.kind} {one.number} is used twice"
            used.add(one)


def judge(config: Config, users: dict[str, User] | None) -> Iterator[tuple[str, str]]:
    """What does not go together: the key's attribute, and why."""
    if (config.certificate is None) != (config.key is None):
        yield ("certificate", "key is missing") if config.certificate else ("key", "certificate is missing")
    if users is None and config.users != USERS:
        yield "users", f"there is no file {config.users}; pokeys-gateway --set-user NAME makes it"
    if config.behind_proxy and not users:
        yield "behind_proxy", "a proxy lets others in, and there are no users; pokeys-gateway --set-user NAME makes one"
    far = [str(one) for one in config.listen if not one.loopback]
    if far and not users:
        yield "listen", (f"{far[0]} is reached from other computers, and there are no users; "
                         "pokeys-gateway --set-user NAME makes one")
    if far and not (config.certificate or config.behind_proxy or config.plaintext):
        yield "listen", (f"{far[0]} is reached from other computers, and passwords would be sent as plain text; "
                         "set certificate and key, behind-proxy, or plaintext = yes")
    if config.machine_kind == SERIAL and not config.machine_port:
        yield "machine_kind", f"kind = {SERIAL} needs port"
    if config.machine_kind == POKEYS and config.machine_port:
        yield "machine_kind", f"kind = {POKEYS} has no port"
    if config.machine_device and config.machine_kind != POKEYS:
        yield "machine_device", f"device needs kind = {POKEYS}"
    if config.machine_folder and not config.machine_device:
        yield "machine_folder", "folder needs device: files are carried out by it"
    yield from _judge_outputs(config)
    if config.machine_device and config.operate:
        yield "machine_device", ("G-code either commands a device or stops LinuxCNC, which has its own devices; set "
                                 "either device or operate = yes in [linuxcnc]")
    if config.pty_path and config.pty_path == config.machine_port:
        yield "pty_path", "this is the machine's port; the pseudoterminal needs a path of its own"
    if config.machine_kind == POKEYS and config.machine_firmware != "marlin":
        yield "machine_firmware", f"kind = {POKEYS} takes lines as marlin does"
    for section in "telnet", "esp3d":
        listen: tuple[Endpoint, ...] = getattr(config, f"{section}_listen")
        far = [str(one) for one in listen if not one.loopback]
        missing = ["plaintext = yes"] if not getattr(config, f"{section}_plaintext") else []
        if far and not users:
            missing.append("a user, which pokeys-gateway --set-user NAME makes")
        if far and missing:
            yield f"{section}_listen", (
                f"{far[0]} is reached from other computers, and {section} has no encryption; use a tunnel to a "
                f"loopback address (ssh -L); otherwise, this needs {' and '.join(missing)}")
        if section == "esp3d" and any(one.port == 65535 for one in listen):
            yield f"{section}_listen", "the port behind it is needed for web sockets"
    taken: dict[tuple[str, int], str] = {}
    for name, what, far_ports in (("listen", "[http]", (0,)), ("telnet_listen", "[telnet]", (0,)),
                                  ("esp3d_listen", "[esp3d]", (0, 1))):
        for one in getattr(config, name):
            for further in far_ports:
                place = one.host, one.port + further
                if other := taken.get(place):
                    yield name, f"{Endpoint(*place)} is used by {other} already" + (
                        " (esp3d needs the port behind its own too)" if further else "")
                taken[place] = what


def tls(config: Config) -> ssl.SSLContext | None:
    """For connections from other computers. :class:`Faults`."""
    if not config.certificate or not config.key:
        return None
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    load_certificate(context, config)
    return context


def load_certificate(context: ssl.SSLContext, config: Config) -> None:
    """Also again, when it has been renewed: new connections get it. :class:`Faults`, and nothing has changed."""
    assert config.certificate and config.key
    with tempfile.TemporaryDirectory(prefix="pokeys-gateway-") as folder:
        # the same files for the trial and for what is used, whoever renews them meanwhile
        copies = Path(folder, "certificate"), Path(folder, "key")
        for file, copy in zip((config.certificate, config.key), copies, strict=True):
            try:
                copy.write_bytes(file.read_bytes())
            except OSError as error:
                raise Faults([f"{file}: {error.strerror}"]) from None
        try:
            for one in ssl.create_default_context(ssl.Purpose.CLIENT_AUTH), context:
                # a key with a password would be asked for at the terminal
                one.load_cert_chain(*copies, password=lambda: "")
        except (OSError, ValueError) as error:
            what = getattr(error, "reason", "") or str(error)
            raise Faults([f"{config.certificate}: no certificate with the key {config.key}: {what}"]) from None
