# SPDX-License-Identifier: GPL-2.0-or-later
"""A router with clients and a machine, in virtual time, for tests."""
import functools

from pokeys_gateway import access, config, hub, model
from pokeys_gateway.console import commands, router, urgent
from pokeys_gateway.console.client import Client
from pokeys_gateway.console.message import Ledger
from pokeys_gateway.console.outbox import Outbox
from pokeys_gateway.console.table import TABLE

MACHINE_LINE, CLIENT_LINE = 1024, 1200


@functools.cache
def anybody():
    """Nobody has to log in; it takes a tenth of a second to make."""
    return access.Access(None, False)


def hub_of(**settings):
    """Without devices; nothing of it goes on."""
    return hub.Hub(config.Config(runtime_directory="/nowhere", **settings), model.Model({"names": [], "boards": []}))


class Table:
    """A router with clients; `now` goes on when it is said to."""

    def __init__(self, users=None, machine=True, lines=8192, size=256 << 10, firmware="marlin"):
        self.now = 100.0
        self.ledger = Ledger()
        self.access = access.Access(users, False) if users else anybody()
        self.commands = commands.Commands(self.access, TABLE, hub_of())
        self.router = router.Router(self.access, self.commands.execute, self.ledger, urgent.of(firmware))
        self.commands.router = self.router
        self.lines, self.size = lines, size
        self.machine = self.connect() if machine else None
        self.got = {}

    def connect(self):
        outbox = Outbox(self.ledger, router.MACHINE_LINES, router.MACHINE_BYTES, drops=False)
        self.machine = Client(self.ledger, "machine", "printer", most=MACHINE_LINE, level=lambda: "guest", outbox=outbox)
        self.router.connect(self.machine)
        return self.machine

    def client(self, name="a", level="user"):
        one = Client(self.ledger, "telnet", name, most=CLIENT_LINE, level=lambda: level,
                     outbox=Outbox(self.ledger, self.lines, self.size))
        self.router.join(one)
        return one

    def run(self, seconds=0.0):
        """Until nothing is to be done, and then so long; time passes only if nothing is to be done."""
        end = self.now + seconds
        while True:
            at = self.router.run(self.now)
            if at == 0:
                continue
            if at is None or at > end:
                self.now = end
                return
            assert at > self.now, "called again for nothing"
            self.now = at

    def send(self, one, data):
        one.receive(data, self.now)
        self.run()

    @staticmethod
    def take(one, size=1 << 30):
        """What would be sent to it."""
        found = one.outbox.take(size)
        data = b"".join(message.data for message in found)
        for message in found:
            message.release()
        return data

    def quiet(self):
        """Nobody has a message any more."""
        assert self.ledger.live == 0, self.ledger.live
