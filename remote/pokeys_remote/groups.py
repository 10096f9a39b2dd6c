# SPDX-License-Identifier: GPL-2.0-or-later
"""Groups of HAL signals that clients watch, with the group's name as the topic.

The configuration lists the signals. HAL files may make them later than the group, or remove them: subscribers get
all of it again then, because a handle that they do not know means nothing to them.
"""
from __future__ import annotations

import fnmatch
import logging
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pokeys_machinetalk_pb2 import Container

from . import message
from .definition import Kind, Value, Watched, differs
from .halsession import Hal
from .message import Type
from .topics import Topics
from .updates import KEEPALIVE

SIGNALS_MOST = 256          # of a group
ALL = ""                    # the topic of those who subscribe to every group
_LOG = logging.getLogger("pokeys-remote")


@dataclass(eq=False)
class _Group:
    """A group while somebody may watch it."""

    name: str
    watched: Watched
    signals: dict[str, Kind] = field(default_factory=dict)
    reported: dict[str, Value] = field(default_factory=dict)
    serial: int = 0
    due: float = -math.inf
    said: float = -math.inf             # when the last message was sent
    whole: bool = True                  # are subscribers to get everything?
    too_many: bool = False

    def matching(self, there: Mapping[str, object]) -> list[str]:
        """The signals of the group that are there, in the order of the configuration."""
        found = list(dict.fromkeys(name for pattern in self.watched.signals
                                   for name in (sorted(fnmatch.filter(there, pattern)) if _is_pattern(pattern) else
                                                [pattern] if pattern in there else [])))
        if len(found) > SIGNALS_MOST and not self.too_many:
            self.too_many = True
            _LOG.warning("group %s: %d signals have a name of it; it has the first %d", self.name, len(found),
                         SIGNALS_MOST)
        return found[:SIGNALS_MOST]


class Groups:
    """All groups of the configuration."""

    def __init__(self, groups: Mapping[str, Watched], hal: Hal, topics: Topics, handle: Callable[[], int]) -> None:
        """``handle`` gives a number that nothing else has."""
        self._groups = {name: _Group(name, watched) for name, watched in groups.items()}
        self._hal, self._topics, self._handle = hal, topics, handle
        self._handles: dict[str, int] = {}

    def listen(self) -> None:
        """Subscriptions that came and went."""
        for name, begins in self._topics.listen():
            if not begins:
                continue
            for group in self._groups.values() if name == ALL else filter(None, [self._groups.get(name)]):
                group.whole = True
            if name != ALL and name not in self._groups:
                self._topics.send(name, message.answer(
                    Type.NO_GROUP, [f"there is no group {name}; there are: {', '.join(self._groups) or 'none'}"]))

    def look(self, now: float) -> float:
        """Send what has changed in groups whose time has come; the time of the next one."""
        watched = [group for group in self._groups.values()
                   if self._topics.count(group.name) or self._topics.count(ALL)]
        there = self._hal.signals() if any(now >= group.due for group in watched) else {}
        for group in watched:
            if now >= group.due:
                # from now on, not from when it was due: what was missed is not caught up
                group.due = now + group.watched.interval
                self._look(group, there, now)
        return min((group.due for group in watched), default=math.inf)

    def _look(self, group: _Group, there: Mapping[str, tuple[Kind, Value]], now: float) -> None:
        found = {name: there[name] for name in group.matching(there)}
        signals = {name: kind for name, (kind, _) in found.items()}
        values = {name: value for name, (_, value) in found.items()}
        if group.whole or signals != group.signals:
            group.signals = signals
            self._send_all(group, values, now)
            return
        changed = [name for name, kind in signals.items()
                   if differs(kind, group.reported[name], values[name], group.watched.epsilon)]
        if changed:
            self._send_changes(group, {name: values[name] for name in changed}, now)
        elif now - group.said >= KEEPALIVE:
            group.said = now
            self._topics.send(group.name, message.answer(Type.PING))

    def _send_all(self, group: _Group, values: dict[str, Value], now: float) -> None:
        update = message.answer(Type.GROUP_FULL)
        part = update.group.add()
        part.name = group.name.encode()
        for name, value in values.items():
            member = part.member.add()
            member.mtype, member.epsilon = message.SIGNAL, group.watched.epsilon
            signal = member.signal
            signal.handle = member.handle = self._handle_of(name)
            signal.type, signal.name = int(group.signals[name]), name.encode()
            message.put_value(signal, group.signals[name], value)
        message.timers(update, KEEPALIVE, group.watched.interval)
        group.whole, group.reported = False, values
        self._send(group, update, now)

    def _send_changes(self, group: _Group, values: dict[str, Value], now: float) -> None:
        update = message.answer(Type.GROUP_INCREMENTAL)
        for name, value in values.items():
            signal = update.signal.add()
            signal.handle, signal.type = self._handle_of(name), int(group.signals[name])
            message.put_value(signal, group.signals[name], value)
        group.reported.update(values)
        self._send(group, update, now)

    def _send(self, group: _Group, update: Container, now: float) -> None:
        group.serial = group.serial + 1 & 0x7fffffff
        update.serial, group.said = group.serial, now
        self._topics.send(group.name, update)

    def _handle_of(self, name: str) -> int:
        if name not in self._handles:
            self._handles[name] = self._handle()
        return self._handles[name]


def _is_pattern(text: str) -> bool:
    return any(one in text for one in "*?[")
