# SPDX-License-Identifier: GPL-2.0-or-later
"""Files of G-code in a folder, which printers have on an SD card, and the job that carries one out.

A job belongs to the machine and to no client: it goes on when whoever has started it is gone. Its lines are carried
out one after the other, as those of a client are. It ends at the first line that cannot be carried out: who skips a
move or a tool change makes the next move from the wrong place.

How far it has come is written into the folder. If the gateway dies, the next one says where the job was; nothing
is resumed by itself.

A disk may hang. So no file stays open between two pieces of work, and each piece is done by one thread as a whole.
"""
from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import logging
import os
import re
import threading
from collections.abc import AsyncGenerator, Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from ..aside import aside
from ..folder import Folder, NotPermitted, TooLarge, Upload
from ..wire import NotDone
from .blocks import MODAL, MOTION
from .lane import Job, Modes
from .lines import ALL, CHUNK, find, good, unusual, unusual_of
from .parser import LINE_MOST, BadLine, BadWords, Line, parse
from .prefix import modes_before

LOOK_S = 0.02
SAVE_S = 5.0                # from one note of the progress to the next
CLOSE_S = 2.0               # for the last note
NAMED_MOST = 8              # unknown commands, at the end
NOTE = ".job"
JUDGED_MOST = 32            # lines at once, before a job begins
END, DELETE = "M2", "M30"   # a program may end with M30, too; with the name of a file, that deletes it
# lines of a file have numbers for people
_NUMBER = re.compile(rb"[ \t]*[Nn][ \t]*\d+[ \t]*")
Result = TypeVar("Result")
_LOG = logging.getLogger("pokeys-gateway")


class _Ended(Exception):
    """The program says that it ends."""


class Storing:
    """Lines of a client that go into a file, from M28 to M29. A file with a hole is not kept."""

    def __init__(self, card: Card | None, name: str) -> None:
        """Without a card: of lines that are not to be carried out."""
        self.name = name.strip("/") or "the file"
        # nothing is kept; "": all is well
        self.why = "the machine has no folder of files" if not card else "" if name.strip("/") else "M28 needs its name"
        self._card = card
        self._upload: Upload | None = None
        self._tasks: set[asyncio.Task[Any]] = set()

    async def begin(self) -> None:
        """M28."""
        self._check()
        # a stop ends the wait for it, and the file must not stay
        opening = self._begin(self._open())
        await asyncio.shield(opening)
        self._check()

    async def write(self, line: str) -> None:
        """One more line."""
        await self.add(f"{line}\n".encode())

    async def add(self, data: bytes) -> None:
        """More of it."""
        self._check()
        upload, card = self._upload, self._card
        if not upload or not card:
            raise NotDone(f"lines go into {self.name}, which is not begun; M29 ends that")
        try:
            await card.aside(upload.write, data)
        except NotDone as error:
            self.spoil(str(error))
            raise
        self._check()

    async def finish(self) -> None:
        """M29."""
        self._check()
        (upload, self._upload), card = (self._upload, None), self._card
        if not upload or not card:
            raise NotDone("nothing is being written")
        try:
            card.need_free(self.name)
            await card.aside(_finish, upload)
        except NotDone:
            self._begin(self._discard(upload))
            raise

    def spoil(self, why: str) -> None:
        """A line is missing: nothing of it is kept."""
        self.why = self.why or why
        upload, self._upload = self._upload, None
        if upload:
            self._begin(self._discard(upload))

    def _check(self) -> None:
        if self.why:
            raise NotDone(f"{self.name} is not kept: {self.why}; M29 ends the writing")

    async def _open(self) -> None:
        assert self._card
        upload = await self._card.begin_file(self.name)
        if self.why:
            await self._discard(upload)
        else:
            self._upload = upload

    @staticmethod
    async def _discard(upload: Upload) -> None:
        # by a thread of its own: there may be too much to do
        with contextlib.suppress(OSError):
            await aside(upload.close)

    def _begin(self, work: Awaitable[Any]) -> asyncio.Task[Any]:
        task = asyncio.ensure_future(work)
        assert isinstance(task, asyncio.Task)
        self._tasks.add(task)
        task.add_done_callback(self._done)
        return task

    def _done(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()        # whoever waits for it has it


class Card:
    """Belongs to the event loop's thread. What is asked for raises :class:`NotDone`."""

    def __init__(self, folder: Path, say: Callable[[str], None]) -> None:
        """``say`` tells all clients."""
        # the commands of a line, each with whether it exists; raises why it can never be carried out
        self.judge: Callable[[Line], list[tuple[Line, bool]]]
        self.axes: Callable[[], list[str]]              # their letters
        self.run: Callable[[Job], Awaitable[None]]      # carries it out
        self._top, self._say = folder, say
        self._folder = Folder(folder)
        self._order = asyncio.Lock()        # of what chooses a file and begins its job
        self._name = ""                     # of the selected file; "": none
        self._made = (0, 0)                 # its size, and when it was changed
        self._at = self._line = 0           # how far the job has come: bytes, lines
        self._modes = Modes()               # it begins with
        self._job: asyncio.Task[None] | None = None
        self._go_on = asyncio.Event()
        self._between = False               # the job waits between two lines
        self._interrupted = ""              # a job of a gateway that has died
        self._notes = threading.Lock()
        self._generation = 0                # of the note: jobs that have begun or ended
        self._noting: set[asyncio.Future[None]] = set()
        self._saving: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Look for a job that was not ended. The disk may hang: nobody waits for this."""
        try:
            await self._folder.aside(self._folder.sweep)
        except OSError as error:
            _LOG.warning("[machine] folder: %s: %s", self._top, error.strerror)
        try:
            note = json.loads(await self._folder.aside((self._top / NOTE).read_text, "utf-8"))
            name, at, size, line = str(note["name"]), int(note["byte"]), int(note["size"]), int(note["line"])
            self._interrupted = (f"{name} was under way when the gateway ended, at line {line} (byte {at} of {size}); "
                                 f"to go on when axes and heaters are ready: M23 {name}, M26 and M24")
            _LOG.warning("%s", self._interrupted)
        except FileNotFoundError:
            pass
        except (OSError, ValueError, KeyError, TypeError) as error:
            _LOG.warning("[machine] folder: %s: %s", self._top / NOTE, error)

    # ---- what is said of it

    @property
    def running(self) -> bool:
        """A job is under way, or waits."""
        return self._job is not None

    @property
    def goes_on(self) -> bool:
        """A job is under way, and does not wait between two lines."""
        return self._job is not None and not self._between

    def progress(self) -> str:
        """As M27 says it."""
        if self._job:
            waits = "" if self._go_on.is_set() else "\necho:it waits; M24 lets it go on"
            return f"SD printing byte {self._at}/{self._made[0]}\necho:{self._name}, line {self._line}{waits}"
        more = f"\necho:{self._interrupted}" if self._interrupted else ""
        return f"Not SD printing{more}"

    def about(self) -> dict[str, Any] | None:
        """The job, for a page."""
        if not self._job:
            return None
        return {"file": self._name, "line": self._line, "byte": self._at, "size": self._made[0],
                "waits": not self._go_on.is_set()}

    async def listing(self) -> str:
        """M20: names and sizes."""
        found = await self.aside(self._folder.files)
        return "\n".join(("Begin file list", *(f"{name} {size}" for name, size in found), "End file list"))

    # ---- commands

    async def select(self, name: str) -> str:
        """M23: the file of the next job."""
        async with self._alone():
            return await self._select(name)

    async def start(self, job: Job) -> None:
        """M24: begin, or go on."""
        async with self._alone():
            await self._start(job)

    async def select_and_start(self, job: Job, name: str) -> str:
        """M32."""
        async with self._alone():
            said = await self._select(name)
            await self._start(job)
        return said

    def pause(self, why: str = "") -> None:
        """M25, and M0 of its file: no further line, until M24. Moves that are in the queue are still carried out."""
        if not self._job:
            raise NotDone("no job is under way")
        self._go_on.clear()
        if why:
            self._say(f"echo:{self._name}, line {self._line}: {why}: it waits; M24 lets it go on")

    async def begin_at(self, byte: float | None, line: float | None) -> None:
        """M26: where the job begins: a byte, or a line, from 1. A job that waits is ended by it."""
        async with self._alone():
            wanted, least = (byte, 0) if line is None else (line, 1)
            if wanted is None or wanted != int(wanted) or not least <= wanted <= max(1, self._made[0]):
                raise BadWords("needs S and a byte, or L and the number of a line")
            # its line is carried out, or begun moves and searches would go on without it
            while self._job and not self._go_on.is_set():
                if self._between:
                    self.abort("ended by M26")
                else:
                    await asyncio.sleep(LOOK_S)
            self._need_no_job()
            if not self._name:
                raise NotDone("no file is selected; M23 and its name select one")
            lines = None if line is None else int(line) - 1
            self._at, self._line, self._modes = await self.aside(self._find, self._name, self._made, lines, int(wanted))

    async def remove(self, name: str) -> str:
        """M30."""
        name = (await self.aside(self._look, name))[0]
        self.need_free(name)
        await self.aside(self._folder.act, "delete", "/", name, "user")
        return f"File deleted: {name}"

    async def begin_file(self, name: str) -> Upload:
        """A file that is to be written."""
        self.need_free(name)
        return await self.aside(self._folder.begin, "/", name, "user", None, False)

    def need_free(self, name: str) -> None:
        """:class:`NotDone` if a job of this file is under way: it would end."""
        if self._job and name.strip("/") == self._name:
            raise NotDone("a job of this file is under way")

    def abort(self, why: str) -> int:
        """A stop or a fault: no further line; how many jobs that were."""
        if not self._job:
            return 0
        self._job.cancel()
        self._end(f"{self._name} has ended at line {self._line} (byte {self._at} of {self._made[0]}): {why}")
        return 1

    async def close(self) -> None:
        """The gateway ends. The job's note stays."""
        if self._saving:
            self._saving.cancel()
        if self._job:
            self._job.cancel()
            self._job = None
            self._note(self._text())
        if self._noting:
            await asyncio.wait(set(self._noting), timeout=CLOSE_S)

    # ---- the job

    @contextlib.asynccontextmanager
    async def _alone(self) -> AsyncGenerator[None, None]:
        """Nobody else chooses a file; nobody waits for a disk that hangs for somebody else."""
        if self._order.locked():
            raise NotDone("another client is choosing a file")
        async with self._order:
            yield

    async def _pause(self) -> None:
        """Until it may go on."""
        self._between = True
        try:
            await self._go_on.wait()
        finally:
            self._between = False

    async def _select(self, name: str) -> str:
        self._need_no_job()
        self._name = ""     # M24 must not begin another one if this fails
        found, made = await self.aside(self._look, name)
        self._name, self._made, self._at, self._line, self._modes = found, made, 0, 0, Modes()
        return f"File opened: {found} Size: {made[0]}\nFile selected"

    async def _start(self, job: Job) -> None:
        if not self._name:
            raise NotDone("no file is selected; M23 and its name select one")
        if self._job:
            self._go_on.set()
            return
        await self._look_through()
        if job.gone:
            raise NotDone("its client is gone")
        self._go_on.set()
        self._interrupted = ""
        self._generation += 1
        self._job = asyncio.get_running_loop().create_task(self._print())
        self._saving = asyncio.get_running_loop().create_task(self._save())
        _LOG.info("%s: begins at line %d", self._name, self._line + 1)

    async def _look_through(self) -> None:
        """:class:`NotDone` if a line can never be carried out: better now than in the middle of the job."""
        at, number, moves = self._at, self._line, bool(self._modes.motion)
        pattern = unusual_of("".join(self.axes()))
        while True:
            lines, at, count = await self.aside(self._unusual, self._name, self._made, at, pattern if moves else ALL)
            for i, (line, data) in enumerate(lines):
                # nobody else waits for this
                if i % JUDGED_MOST == 0:
                    await asyncio.sleep(0)
                try:
                    for one, _ in self._understand(good(bytearray(data))):
                        if one.name == END:
                            return
                        if one.name == MODAL and not moves:
                            raise BadWords(f'"{one.argument}" needs a G0, G1, G2 or G3 before it')
                        moves = moves or one.name in MOTION
                except (NotDone, BadWords, BadLine) as why:
                    raise NotDone(f"{self._name}, line {number + line}: {why}; the job has not begun") from None
            number += count
            if not count:
                return

    async def _print(self) -> None:
        modes, unknown = self._modes, dict[str, None]()
        text, error = "", True
        try:
            with contextlib.suppress(_Ended):
                async for data in self._lines():
                    await self._pause()
                    unknown.update(dict.fromkeys(await self._carry_out(data, modes)))
            # it has ended when its last move has
            await self._carry_out(b"M400", modes)
            error = False
        except (NotDone, BadWords, BadLine) as why:
            text = f"{self._name}, line {self._line}: {why}; the job has ended"
        except Exception:
            _LOG.exception("%s, line %d", self._name, self._line)
            text = f"{self._name}, line {self._line}: internal error of the gateway; see its log"
        # a fault that it has met itself has ended it already
        if self._job is asyncio.current_task():
            more = f"; commands that do not exist: {', '.join([*unknown][:NAMED_MOST])}" if unknown else ""
            self._end(text or f"{self._name} has ended, {self._line} lines{more}", error=error, done=not error)

    async def _carry_out(self, data: bytes, modes: Modes) -> list[str]:
        """A line; names of its commands that were skipped, because they do not exist and nothing depends on them."""
        skipped = []
        for line, known in self._understand(data):
            if not known:
                skipped.append(line.name)
                continue
            await self.run(Job(None, line, modes, lambda text: None))
            await self._pause()
            if line.name == END:
                raise _Ended
        return skipped

    def _understand(self, data: bytes) -> list[tuple[Line, bool]]:
        """The commands of a line, each with whether it exists. Raises why it can never be carried out."""
        if b"*" not in data:
            data = _NUMBER.sub(b"", data, 1) if _NUMBER.match(data) else data
        line = parse(data) if data.strip() != b"%" else None
        if not line or not line.text:
            return []
        if line.name == DELETE and not line.arguments:
            line = replace(line, name=END)
        judged = self.judge(line)
        if any(not known and one.name[:1] != "M" for one, known in judged):
            raise NotDone(f'"{line.text[:LINE_MOST]}" cannot be carried out: there is no such command')
        return judged

    async def _lines(self) -> AsyncGenerator[bytes, None]:
        """The lines from where the job begins, without comments; it has come so far when the next one is asked for."""
        at, size = self._at, 0
        code, comment = bytearray(), False
        while True:
            data = await self.aside(self._read, self._name, self._made, at)
            at += len(data)
            if not data:
                if size:
                    self._line += 1
                    yield good(code)
                    self._at += size
                return
            for i, piece in enumerate(data.split(b"\n")):
                if i:
                    self._line += 1
                    yield good(code)
                    self._at += size + 1
                    size, comment = 0, False
                    code.clear()
                before, semicolon, _ = piece.partition(b";")
                code += b"" if comment else before
                comment = comment or bool(semicolon)
                size += len(piece)
            if len(code) > 4 * LINE_MOST:
                self._line += 1
                good(code)

    def _end(self, text: str, *, error: bool = False, done: bool = False) -> None:
        self._job = None
        if self._saving:
            self._saving.cancel()
            self._saving = None
        self._at, self._line, self._modes = 0, 0, Modes()
        self._generation += 1
        self._note(None)
        _LOG.log(logging.WARNING if error else logging.INFO, "%s", text)
        self._say("\n".join((f"{'Error' if error else 'echo'}:{text}", *["Done printing file"] * done)))

    # ---- its note

    async def _save(self) -> None:
        while True:
            self._note(self._text())
            await asyncio.sleep(SAVE_S)

    def _text(self) -> str:
        return json.dumps({"name": self._name, "size": self._made[0], "byte": self._at, "line": self._line})

    def _note(self, text: str | None) -> None:
        """Write it, or remove it; a thread that was slow writes nothing over what came after it."""
        generation = self._generation

        def write() -> None:
            with self._notes, contextlib.suppress(OSError):
                if generation != self._generation:
                    return
                if text is None:
                    (self._top / NOTE).unlink(missing_ok=True)
                    return
                new = self._top / f"{NOTE}.new"
                new.write_text(text, "utf-8")
                new.replace(self._top / NOTE)
        try:
            noting = self._folder.aside(write)
        except OSError:
            return      # the disk has too much to do
        self._noting.add(noting)
        noting.add_done_callback(self._noting.discard)

    # ---- the folder; in threads

    def _need_no_job(self) -> None:
        if self._job:
            raise NotDone(f"{self._name} is under way; M524 ends it")

    def _open(self, name: str, made: tuple[int, int] | None = None) -> int:
        """OSError, also if it is not as it was."""
        file, _size, packed = self._folder.open(name)
        try:
            status = os.fstat(file)
            if packed:
                raise OSError(errno.ENOENT, os.strerror(errno.ENOENT))
            if made and made != (status.st_size, status.st_mtime_ns):
                raise OSError(errno.ESTALE, "the file has changed; M23 selects it again")
        except OSError:
            os.close(file)
            raise
        return file

    def _look(self, name: str) -> tuple[str, tuple[int, int]]:
        """The name of a file, which may be written in other cases, as on a card; its size, and when it was changed."""
        name = name.strip("/")
        try:
            file = self._open(name)
        except FileNotFoundError:
            found = [one for one, _ in self._folder.files() if one.lower() == name.lower()]
            if len(found) != 1:
                raise
            name, file = found[0], self._open(found[0])
        try:
            status = os.fstat(file)
            return name, (status.st_size, status.st_mtime_ns)
        finally:
            os.close(file)

    def _read(self, name: str, made: tuple[int, int], at: int) -> bytes:
        """What comes there; nothing at its end."""
        file = self._open(name, made)
        try:
            return os.pread(file, CHUNK, at)
        finally:
            os.close(file)

    def _unusual(self, name: str, made: tuple[int, int], at: int,
                 pattern: re.Pattern[bytes]) -> tuple[list[tuple[int, bytes]], int, int]:
        file = self._open(name, made)
        try:
            return unusual(file, at, pattern)
        finally:
            os.close(file)

    def _find(self, name: str, made: tuple[int, int], lines: int | None, byte: int) -> tuple[int, int, Modes]:
        """The place behind so many lines, or at the beginning of the line that this byte is in: its byte and line, and
        what the lines before it have set."""
        file = self._open(name, made)
        try:
            at, line = find(file, lines, byte)
            return at, line, modes_before(file, at)
        finally:
            os.close(file)

    async def aside(self, work: Callable[..., Result], *arguments: Any) -> Result:
        """By a thread that may wait for the disk."""
        try:
            return await self._folder.aside(work, *arguments)
        except (TooLarge, NotPermitted) as error:
            raise NotDone(str(error)) from None
        except OSError as error:
            name = next((one for one in arguments if isinstance(one, str) and one not in ("/", "user", "delete")), "")
            missing = error.errno in (errno.EISDIR, errno.EINVAL) and name
            why = os.strerror(errno.ENOENT) if missing and error.errno == errno.EISDIR else error.strerror or str(error)
            raise NotDone(f"{name}: {why}" if name else why) from None


def _finish(upload: Upload) -> None:
    try:
        upload.finish()
    finally:
        upload.close()
