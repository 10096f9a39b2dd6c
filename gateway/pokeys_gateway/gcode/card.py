# SPDX-License-Identifier: GPL-2.0-or-later
"""Files of G-code in a folder, which printers have on an SD card, and the job that carries one out.

A job belongs to the machine and to no client: it goes on when whoever has started it is gone. Its lines are carried
out one after the other, as those of a client are. It ends at the first line that cannot be carried out.

How far it has come is written into the folder. If the gateway dies, the next one says where the job was; nothing
is resumed by itself.
"""
from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import logging
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from ..folder import Folder, TooLarge, Upload
from ..wire import NotDone
from .lane import Job, Modes
from .parser import LINE_MOST, BadLine, BadWords, parse

CHUNK = 64 << 10            # bytes that are read at once
LONG = 4 * LINE_MOST        # a line is not longer, with its comment
SAVE_S = 5.0                # from one note of the progress to the next
NAMED_MOST = 8              # unknown commands, at the end
NOTE = ".job"
_LOG = logging.getLogger("pokeys-gateway")


class Card:
    """Belongs to the event loop's thread. What is asked for raises :class:`NotDone`."""

    def __init__(self, folder: Path, say: Callable[[str], None]) -> None:
        """``say`` tells all clients."""
        # carries out a line, and says if there is such a command
        self.run: Callable[[Job], Awaitable[bool]]
        self._top, self._say = folder, say
        self._folder = Folder(folder)
        self._file: int | None = None       # the selected one
        self._name, self._size = "", 0
        self._at = self._line = 0           # how far the job has come: bytes, lines
        self._job: asyncio.Task[None] | None = None
        self._saving: asyncio.Task[None] | None = None
        self._go_on = asyncio.Event()
        self._interrupted = ""              # a job of a gateway that has died

    async def open(self) -> None:
        """Look for a job that was not ended."""
        try:
            await self._folder.aside(self._folder.sweep)
            note = json.loads(await self._folder.aside((self._top / NOTE).read_text, "utf-8"))
            name, at, size, line = str(note["name"]), int(note["byte"]), int(note["size"]), int(note["line"])
            self._interrupted = (f"{name} was under way when the gateway ended, at line {line} (byte {at} of {size}); "
                                 f"to go on when axes and heaters are ready: M23 {name}, M26 and M24")
            _LOG.warning("%s", self._interrupted)
        except FileNotFoundError:
            pass
        except (OSError, ValueError, KeyError, TypeError) as error:
            _LOG.warning("[machine] folder: %s: %s", self._top, error)

    # ---- what is said of it

    @property
    def running(self) -> bool:
        """A job is under way, or waits."""
        return self._job is not None

    def progress(self) -> str:
        """As M27 says it."""
        if self._job:
            waits = "" if self._go_on.is_set() else "\necho:it waits; M24 lets it go on"
            return f"SD printing byte {self._at}/{self._size}\necho:{self._name}, line {self._line}{waits}"
        more = f"\necho:{self._interrupted}" if self._interrupted else ""
        return f"Not SD printing{more}"

    async def listing(self) -> str:
        """M20: names and sizes."""
        found = await self._aside(self._folder.files)
        return "\n".join(("Begin file list", *(f"{name} {size}" for name, size in found), "End file list"))

    # ---- commands

    async def select(self, name: str) -> str:
        """M23: the file of the next job."""
        self._need_no_job()
        file, size, packed = await self._aside(self._folder.open, name)
        if packed:
            await self._aside(os.close, file)
            raise NotDone(f"{name}: No such file or directory")
        await self._close()
        self._file, self._name, self._size = file, name.strip("/"), size
        self._at = self._line = 0
        return f"File opened: {self._name} Size: {size}\nFile selected"

    def start(self) -> None:
        """M24: begin, or go on."""
        if self._file is None:
            raise NotDone("no file is selected; M23 and its name select one")
        self._go_on.set()
        if not self._job:
            self._interrupted = ""
            self._job = asyncio.get_running_loop().create_task(self._print(self._file))
            self._saving = asyncio.get_running_loop().create_task(self._save())
            _LOG.info("%s: begins at line %d", self._name, self._line)

    def pause(self) -> None:
        """M25: no further line, until M24. Moves that are in the queue are still carried out."""
        if not self._job:
            raise NotDone("no job is under way")
        self._go_on.clear()

    async def begin_at(self, byte: float | None, line: float | None) -> None:
        """M26: where the job begins: a byte, or a line, from 1."""
        self._need_no_job()
        if self._file is None:
            raise NotDone("no file is selected; M23 and its name select one")
        wanted = byte if line is None else line
        if wanted is None or wanted != int(wanted) or not 0 <= wanted <= self._size:
            raise BadWords("takes S and a byte, or L and the number of a line")
        self._at, self._line = await self._aside(_find, self._file, None if line is None else int(line) - 1,
                                                 0 if byte is None else int(byte))

    async def remove(self, name: str) -> str:
        """M30."""
        if self._job and name.strip("/") == self._name:
            raise NotDone("a job of this file is under way")
        await self._aside(self._folder.act, "delete", "/", name, "user")
        return f"File deleted: {name.strip('/')}"

    async def begin_file(self, name: str) -> Upload:
        """M28: a file that is to be written."""
        upload: Upload = await self._aside(self._folder.begin, "/", name, "user", None, False)
        return upload

    async def write(self, upload: Upload, data: bytes) -> None:
        """More of it."""
        await self._aside(upload.write, data)

    async def finish(self, upload: Upload) -> None:
        """It is complete."""
        await self._aside(upload.finish)
        await self._aside(upload.close)

    async def discard(self, upload: Upload) -> None:
        """It is not kept."""
        with contextlib.suppress(NotDone):
            await self._aside(upload.close)

    def abort(self, why: str) -> int:
        """A stop, a fault, or M524: no further line; how many jobs that were."""
        if not self._job:
            return 0
        self._job.cancel()
        self._end(f"{self._name} has ended at line {self._line} (byte {self._at} of {self._size}): {why}")
        return 1

    async def close(self) -> None:
        """The gateway ends. The job's note stays."""
        if self._job:
            self._job.cancel()
            self._job = None
            await self._note()
        if self._saving:
            self._saving.cancel()
        await self._close()

    # ---- the job

    async def _print(self, file: int) -> None:
        modes, unknown = Modes(), dict[str, None]()
        try:
            async for data in self._lines(file):
                await self._go_on.wait()
                name = await self._carry_out(data, modes)
                if name:
                    unknown[name] = None
        except (NotDone, BadWords, BadLine, OSError) as error:
            why = error.strerror if isinstance(error, OSError) else str(error)
            self._end(f"{self._name}, line {self._line}: {why}; the job has ended", error=True)
        except Exception:
            _LOG.exception("%s, line %d", self._name, self._line)
            self._end(f"{self._name}, line {self._line}: internal error of the gateway; see its log", error=True)
        else:
            more = f"; commands that do not exist: {', '.join([*unknown][:NAMED_MOST])}" if unknown else ""
            self._end(f"{self._name} has ended, {self._line} lines{more}", done=True)

    async def _carry_out(self, data: bytes, modes: Modes) -> str:
        """A line; the name of its command if there is none of it."""
        line = parse(data)
        if line and line.text:
            job = Job(None, line, modes, lambda text: None)
            if not await self.run(job):
                return line.name or line.text.split()[0][:LINE_MOST]
        return ""

    async def _lines(self, file: int) -> Any:
        """The lines from where the job begins; it has come so far when the next one is asked for."""
        rest, at = b"", self._at
        while True:
            data = await self._folder.aside(os.pread, file, CHUNK, at)
            at += len(data)
            *lines, rest = (rest + data).split(b"\n")
            if not data and rest:
                lines, rest = [rest], b""
            for line in lines:
                self._line += 1
                if len(line) > LONG:
                    raise BadLine(f"a line has at most {LINE_MOST} characters")
                yield line
                self._at = min(self._size, self._at + len(line) + 1)
            if not data:
                return
            if len(rest) > LONG:
                self._line += 1
                raise BadLine(f"a line has at most {LINE_MOST} characters")

    def _end(self, text: str, *, error: bool = False, done: bool = False) -> None:
        self._job = None
        if self._saving:
            self._saving.cancel()
            self._saving = None
        self._at = self._line = 0
        _LOG.log(logging.WARNING if error else logging.INFO, "%s", text)
        self._say("\n".join((f"{'Error' if error else 'echo'}:{text}", *["Done printing file"] * done)))
        self._saving = asyncio.get_running_loop().create_task(self._unnote())

    async def _save(self) -> None:
        while True:
            await self._note()
            await asyncio.sleep(SAVE_S)

    async def _note(self) -> None:
        text = json.dumps({"name": self._name, "size": self._size, "byte": self._at, "line": self._line})

        def write() -> None:
            new = self._top / f"{NOTE}.new"
            new.write_text(text, "utf-8")
            new.replace(self._top / NOTE)
        with contextlib.suppress(OSError):
            await self._folder.aside(write)

    async def _unnote(self) -> None:
        with contextlib.suppress(OSError):
            await self._folder.aside((self._top / NOTE).unlink)

    # ---- the folder

    def _need_no_job(self) -> None:
        if self._job:
            raise NotDone(f"{self._name} is under way; M524 ends it")

    async def _close(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            with contextlib.suppress(NotDone):
                await self._aside(os.close, file)

    async def _aside(self, work: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return await self._folder.aside(work, *arguments)
        except TooLarge as error:
            raise NotDone(str(error)) from None
        except OSError as error:
            name = next((one for one in arguments if isinstance(one, str) and one not in ("/", "user", "delete")), "")
            why = os.strerror(errno.ENOENT) if error.errno == errno.EISDIR else error.strerror or str(error)
            raise NotDone(f"{name}: {why}" if name else why) from None


def _find(file: int, lines: int | None, byte: int) -> tuple[int, int]:
    """The place behind so many lines, or at the beginning of the line that this byte is in: its byte and line."""
    at = start = count = 0
    while data := os.pread(file, CHUNK, at):
        begin = 0
        while (end := data.find(b"\n", begin)) >= 0:
            if (lines is not None and count >= lines) or (lines is None and at + end >= byte):
                return start, count
            count, begin = count + 1, end + 1
            start = at + begin
        at += len(data)
    if lines is not None and count < lines:
        raise OSError(errno.EINVAL, f"the file has {count + (at > start)} lines")
    return start, count
