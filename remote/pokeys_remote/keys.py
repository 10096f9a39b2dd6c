# SPDX-License-Identifier: GPL-2.0-or-later
"""Keys of ZeroMQ's CURVE, in the certificate files that its tools share: NAME.key and NAME.key_secret."""
from __future__ import annotations

import logging
import os
import stat
import struct
import threading
import time
from pathlib import Path

import zmq.auth
from zmq.utils import z85

SUFFIX, SECRET_SUFFIX = ".key", ".key_secret"
KEY_BYTES = 32
CLIENTS_MOST = 256
LOOK = 0.5                  # s between looks at the folder
_LOG = logging.getLogger("pokeys-remote")


def make(path: Path) -> tuple[Path, Path]:
    """A new pair of keys: the public file and the secret one. :class:`OSError`; nothing is overwritten."""
    if not path.name:
        raise FileNotFoundError(f"{path}: a name for the keys is missing")
    public, secret = (path.with_name(path.name + suffix) for suffix in (SUFFIX, SECRET_SUFFIX))
    for one in (public, secret):
        if one.exists():
            raise FileExistsError(f"{one} is there already, and is not overwritten")
    before = os.umask(0o077)
    try:
        zmq.auth.create_certificates(path.parent, path.name)
        public.chmod(0o644)
    except OSError as error:
        raise OSError(f"{error.filename or path}: {error.strerror}") from None
    finally:
        os.umask(before)
    return public, secret


def secret_of(path: Path) -> bytes:
    """The secret key in a file. ValueError says what is wrong."""
    try:
        mode = path.stat().st_mode
        _, secret = _load(path)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}") from None
    if not secret:
        raise ValueError(f"{path}: it has no secret key; pokeys-remote --make-key makes one")
    if stat.S_IMODE(mode) & 0o077:
        raise ValueError(f"{path}: other users may read it; chmod 600 {path}")
    return secret


def judge_folder(path: Path) -> None:
    """Whoever can write into a folder of clients' keys can let anybody in. ValueError says what is wrong."""
    try:
        found = path.stat()
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    if not stat.S_ISDIR(found.st_mode):
        raise ValueError(f"{path} is no folder")
    if stat.S_IMODE(found.st_mode) & 0o022 or found.st_uid not in (0, os.geteuid()):
        raise ValueError(f"{path}: other users may write into it; it has to belong to user {os.geteuid()} or root, "
                         "with chmod 755 or less")


class Known:
    """The public keys of a folder, by which clients are known.

    A thread reads the folder, because a disk may be slow: it follows what is in it within :data:`LOOK` s.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._seen: object = None
        self._names: dict[bytes, str] = {}
        self._faults: set[str] = set()
        self._look()
        threading.Thread(target=self._follow, daemon=True).start()

    def name(self, key: bytes) -> str | None:
        """Of the client with this public key (32 bytes), or None if it is not known. Never waits."""
        return self._names.get(key)

    def _follow(self) -> None:
        while True:
            time.sleep(LOOK)
            self._look()

    def _look(self) -> None:
        try:
            self._look_now()
        except (FileNotFoundError, NotADirectoryError, PermissionError):
            # without the folder nobody is known
            self._seen, self._names = None, {}
        except OSError:
            pass                        # too many open files, for example, which changes no key

    def _look_now(self) -> None:
        files = {entry.name: entry.stat() for entry in os.scandir(self.folder) if entry.name.endswith(SUFFIX)}
        seen = {name: (one.st_ino, one.st_size, one.st_mtime_ns, one.st_ctime_ns) for name, one in files.items()}
        # what was just written may be written again in the same tick of the clock
        newest = max((one.st_ctime for one in files.values()), default=0.0)
        if seen != self._seen or time.time() - newest < 2 * LOOK:
            self._names, self._seen = self._read(sorted(files)), seen

    def _read(self, names: list[str]) -> dict[bytes, str]:
        found: dict[bytes, str] = {}
        faults = set()
        for name in names:
            try:
                if len(found) >= CLIENTS_MOST:
                    raise ValueError(f"there are {CLIENTS_MOST} keys already, which is the most")
                label = name.removesuffix(SUFFIX)
                label.encode()
                found[_public(self.folder / name)] = label
            except FileNotFoundError:
                continue
            except ValueError as error:
                faults.add(f"{self.folder / name} is not used: {error}".encode(errors="replace").decode())
        for fault in sorted(faults - self._faults):
            _LOG.warning("%s", fault)
        self._faults = faults
        return found


def _public(path: Path) -> bytes:
    """The public key in a file, 32 bytes. OSError, ValueError."""
    key, _ = _load(path)
    if key is None:
        raise ValueError("it has no public key")
    return key


def _load(path: Path) -> tuple[bytes | None, bytes | None]:
    """Both keys in a file, 32 bytes each, as far as they are there. OSError."""
    try:
        found = zmq.auth.load_certificate(path)
    except (ValueError, LookupError):
        return None, None               # which is also the library's answer to a file that ends too early
    public, secret = (_bytes(key) for key in found)
    return public, secret


def _bytes(key: bytes | None) -> bytes | None:
    """Of a key that is written in Z85; None if it is not one."""
    try:
        decoded: bytes = z85.decode(key or b"")         # type: ignore[no-untyped-call]
    except (ValueError, LookupError, struct.error):
        return None
    return decoded if len(decoded) == KEY_BYTES else None
