# SPDX-License-Identifier: GPL-2.0-or-later
"""A folder of files for clients: list, take, give, remove. No path leaves it, and it has its limits.

All of this may wait for a disk: it is called in threads, see :mod:`.aside`.
"""
from __future__ import annotations

import contextlib
import errno
import mimetypes
import os
import re
import secrets
import threading
import time
from pathlib import Path
from typing import Any

from .access import LEVELS
from .aside import Few

FILE_MOST = 512 << 20       # bytes
FREE_LEAST = 64 << 20       # bytes of the file system that are left to others
LISTED_MOST = 4096
AT_ONCE = 16                # pieces of work
NAME_MOST = 255             # bytes
# what a browser runs, with the rights of whoever opens it
ACTIVE = re.compile(r"text/html|.*/(x-)?javascript|.*/ecmascript|.*/xml|.*\+xml|.*/wasm|multipart/.*|message/.*")
ICON = "favicon.ico"
_UPLOAD = ".upload-"


class NotPermitted(Exception):
    """It may not do this."""


class TooLarge(Exception):
    """There is no room for it."""


def _size(number: int) -> str:
    """As ESP3D writes it: two digits behind the point."""
    size, unit = float(number), "B"
    for unit in "B", "KB", "MB", "GB":
        if size < 1024 or unit == "GB":
            break
        size /= 1024
    return f"{number} B" if unit == "B" else f"{size:.2f} {unit}"


def _is_text(name: str) -> bool:
    """UTF-8 without control characters."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return not any(ord(one) < 32 or ord(one) == 127 for one in name)


class Upload:
    """A file that is being taken. It appears when it is complete."""

    def __init__(self, path: Path, size: int | None) -> None:
        self._path, self._wanted = path, size
        self._size = 0
        # a client may be gone while a thread writes
        self._lock = threading.Lock()
        self._temporary = path.with_name(f"{_UPLOAD}{secrets.token_hex(6)}")
        self._file: int | None = os.open(self._temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o640)

    def write(self, data: bytes) -> None:
        """More of it. OSError, :class:`TooLarge`."""
        with self._lock:
            if self._file is None:
                return
            self._size += len(data)
            if self._size > FILE_MOST:
                raise TooLarge(f"a file has at most {_size(FILE_MOST)}")
            left = os.fstatvfs(self._file)
            if left.f_bavail * left.f_frsize < FREE_LEAST + len(data):
                raise TooLarge("the disk is full")
            while data:
                data = data[os.write(self._file, data):]

    def finish(self) -> None:
        """It is complete. OSError."""
        with self._lock:
            if self._file is None:
                return
            if self._wanted is not None and self._size != self._wanted:
                raise OSError(errno.EIO, f"{self._size} of {self._wanted} bytes have come; nothing is kept")
            os.fsync(self._file)
            self._temporary.replace(self._path)

    def close(self) -> None:
        """Whether it is complete or not."""
        with self._lock:
            if self._file is not None:
                os.close(self._file)
                self._file = None
            with contextlib.suppress(OSError):
                self._temporary.unlink()


class Folder:
    """The folder. Names of paths begin with / or not, and mean the same."""

    def __init__(self, top: Path) -> None:
        self._top = top
        self.aside = Few(AT_ONCE)

    def _path(self, *names: str) -> Path:
        """Within the folder. OSError."""
        top = self._top.resolve(strict=True)
        path = top
        for name in names:
            # names in answers are UTF-8
            if not _is_text(name) or len(name.encode()) > os.pathconf(top, "PC_PATH_MAX"):
                raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
            path /= name.lstrip("/")
        try:
            path = path.resolve()
        except RuntimeError:        # links in a circle
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP)) from None
        if not path.is_relative_to(top) or any(part.startswith(_UPLOAD) for part in path.relative_to(top).parts):
            raise OSError(errno.ENOENT, os.strerror(errno.ENOENT))
        return path

    def sweep(self) -> None:
        """Remove what a gateway that was killed had not taken completely. OSError."""
        os.stat(self._top)
        for path in self._top.rglob(f"{_UPLOAD}*"):
            path.unlink()

    def open(self, name: str) -> tuple[int, int, bool]:
        """A file descriptor of a file, or of one with .gz, its size, and whether it is the latter. OSError."""
        path, packed = self._path(name), False
        if not path.is_file():
            path, packed = self._path(f"{name}.gz"), True
        # a pipe would wait for ever
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK | os.O_NOFOLLOW)
        status = os.fstat(file)
        if not path.is_file():
            os.close(file)
            raise OSError(errno.ENOENT, os.strerror(errno.ENOENT))
        return file, status.st_size, packed

    def listing(self, name: str) -> dict[str, Any]:
        """What is in a folder, as ESP3D's /files says it. OSError."""
        path = self._path(name)
        files: list[dict[str, str]] = []
        with os.scandir(path) as entries:
            for entry in entries:
                if len(files) >= LISTED_MOST:
                    break
                if entry.name.startswith(_UPLOAD):
                    continue
                with contextlib.suppress(OSError):
                    status = entry.stat(follow_symlinks=False)
                    at = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(status.st_mtime))
                    name_shown = os.fsencode(entry.name).decode("utf-8", "replace")
                    files.append({"name": name_shown, "size": "-1" if entry.is_dir() else _size(status.st_size),
                                  "time": "" if entry.is_dir() else at})
        disk = os.statvfs(path)
        total, free = disk.f_blocks * disk.f_frsize, disk.f_bavail * disk.f_frsize
        inside = path.relative_to(self._top.resolve())
        return {"files": sorted(files, key=lambda one: (one["size"] != "-1", one["name"])),
                "path": "/" if inside == Path() else f"/{inside}",
                "occupation": str(round(100 * (1 - free / max(1, total)))),
                "total": _size(total), "used": _size(total - free)}

    def files(self) -> list[tuple[str, int]]:
        """All files, also those in folders, by their names from the top, with their sizes in bytes. OSError."""
        top = self._top.resolve(strict=True)
        os.listdir(top)
        found: list[tuple[str, int]] = []
        for at, folders, names in os.walk(top):
            folders[:] = sorted(name for name in folders if not name.startswith("."))
            for name in sorted(names):
                path = Path(at, name)
                shown = os.fsencode(path.relative_to(top)).decode("utf-8", "replace")
                with contextlib.suppress(OSError):
                    if not name.startswith(".") and _is_text(shown) and path.is_file():
                        found.append((shown, path.stat().st_size))
                if len(found) >= LISTED_MOST:
                    return found
        return found

    def act(self, action: str, folder: str, name: str, level: str) -> str:
        """ESP3D's actions: delete, deletedir, createdir, create; what is said of it.

        OSError, :class:`NotPermitted`, :class:`TooLarge`.
        """
        if not name.strip("/"):
            raise OSError(errno.EINVAL, "filename is missing")
        path = self._path(folder, name)
        if path == self._top.resolve():
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        self._permit(path, level)
        if action == "delete":
            if path.is_dir():
                raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
            path.unlink()
            return f"{path.name} deleted"
        if action == "deletedir":
            path.rmdir()
            return f"{path.name} deleted"
        if action in ("createdir", "create"):
            self._need_room(path.parent)
        if action == "createdir":
            path.mkdir()
            return f"{path.name} created"
        if action == "create":
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o640))
            return f"{path.name} created"
        raise OSError(errno.EINVAL, "action is one of delete, deletedir, createdir, create")

    def exists(self, name: str) -> bool:
        """Is there a file or a folder of this name?"""
        try:
            return self._path(name).exists()
        except OSError:
            return False

    def begin(self, folder: str, name: str, level: str, size: int | None, create: bool) -> Upload:
        """A new file; `size` is what is announced. OSError, :class:`NotPermitted`, :class:`TooLarge`."""
        if size is not None and size > FILE_MOST:
            raise TooLarge(f"a file has at most {_size(FILE_MOST)}")
        # a page sends the whole path as the name, curl only a name
        path = self._path(name) if "/" in name else self._path(folder, name)
        if path == self._top.resolve() or len(os.fsencode(path.name)) > NAME_MOST - len(_UPLOAD):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        self._permit(path, level)
        if create:
            self._need_room(self._top)
            path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
        return Upload(path, size)

    @staticmethod
    def _need_room(path: Path) -> None:
        """For what has a name and no bytes yet. OSError, :class:`TooLarge`."""
        disk = os.statvfs(path)
        if disk.f_bavail * disk.f_frsize < FREE_LEAST:
            raise TooLarge("the disk is full")

    def _permit(self, path: Path, level: str) -> None:
        """:class:`NotPermitted`."""
        names = [part.lower().removesuffix(".gz") for part in path.relative_to(self._top.resolve()).parts]
        active = any(name == ICON or ACTIVE.fullmatch(mimetypes.guess_type(name)[0] or "") for name in names)
        need = LEVELS[2] if active else LEVELS[1]
        if LEVELS.index(level) < LEVELS.index(need):
            raise NotPermitted(f"this needs level {need}")
