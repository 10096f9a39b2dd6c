# SPDX-License-Identifier: GPL-2.0-or-later
"""XPUB sockets with the same messages: who subscribes to what.

A subscription takes effect when it is confirmed here, so that the first message of a subscriber is a full
update. Machinekit's client would end its thread at an incremental one, whose handles it does not know.
"""
from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

import zmq
from pokeys_machinetalk_pb2 import Container

TOPIC_MOST = 256            # bytes
TOPICS_MOST = 256
BATCH = 64                  # subscriptions in a turn


class Topics:
    """The subscriptions of all of them."""

    def __init__(self, known: Callable[[str], bool], *publishers: zmq.Socket[bytes]) -> None:
        """A topic is ``known`` if it exists; there may be so many others, and no more."""
        self._known = known
        for publisher in publishers:
            publisher.setsockopt(zmq.XPUB_MANUAL, 1)
        self._counts: dict[zmq.Socket[bytes], dict[str, int]] = {publisher: {} for publisher in publishers}

    def count(self, name: str) -> int:
        """So many subscribe to it."""
        return sum(counts.get(name, 0) for counts in self._counts.values())

    def listen(self) -> Iterator[tuple[str, bool]]:
        """Names of subscriptions that came (true) and went."""
        for publisher, counts in self._counts.items():
            yield from self._listen(publisher, counts)

    def _listen(self, publisher: zmq.Socket[bytes], counts: dict[str, int]) -> Iterator[tuple[str, bool]]:
        with contextlib.suppress(zmq.Again):
            for _ in range(BATCH):
                said = publisher.recv(zmq.NOBLOCK)
                topic, begins = said[1:], said[:1] == b"\x01"
                name = topic.decode(errors="replace")
                # a client may send anything here
                if said[:1] not in (b"\x00", b"\x01"):
                    continue
                if len(topic) > TOPIC_MOST or (
                        name not in counts and len(counts) >= TOPICS_MOST and not self._known(name)):
                    continue
                publisher.setsockopt(zmq.SUBSCRIBE if begins else zmq.UNSUBSCRIBE, topic)
                count = counts.pop(name, 0) + (1 if begins else -1)
                if count > 0:
                    counts[name] = count
                yield name, begins

    def send(self, name: str, message: Container) -> None:
        """To all who subscribe to it. One that does not read loses messages, and nobody waits for it."""
        data = [name.encode(), message.SerializeToString()]
        for publisher in self._counts:
            with contextlib.suppress(zmq.Again):
                publisher.send_multipart(data, zmq.NOBLOCK)
