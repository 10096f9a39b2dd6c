#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The gateway's hub: it goes on whatever happens while it looks for devices; late loops are counted."""
import asyncio
import logging
import sys
import threading


class Lines(logging.Handler):
    def __init__(self):
        super().__init__()
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


async def looking_goes_on():
    hub.LOOK_S = 0.01
    one = hub.Hub(config.Config(runtime_directory="/nowhere"), model.Model({"names": [], "boards": []}))
    looks = []

    def look():
        looks.append(len(looks))
        if len(looks) in (2, 3):
            raise OSError(24, "Too many open files") if len(looks) == 2 else RuntimeError("anything")
    one.source.look = look
    await one.start()
    while len(looks) < 6:
        await asyncio.sleep(0.01)
    await one.close()
    assert [line for line in heard.lines if "looking for devices" in line] == 2 * ["looking for devices"], heard.lines


def lag_is_told_once_in_a_while():
    now = 0.0
    lag = hub.Lag(lambda: now)
    heard.lines.clear()
    for i in range(100):
        now = float(i)
        lag.take(0.06 if i % 2 else 0.001)
    assert (lag.late, lag.most, round(lag.total, 9)) == (50, 0.06, 3.05), vars(lag)
    lag.take(0.03)      # counted, and not worth a line
    lag.take(0.6)
    assert lag.counts == [50, 0, 0, 0, 0, 1, 50, 0, 1] and lag.late == 52, lag.counts
    assert len(heard.lines) == 10 and "60 ms late" in heard.lines[0], heard.lines


async def few_wait_for_a_disk():
    """What a disk does not answer has its place until it does, whoever waits for it."""
    few, go = aside.Few(2), threading.Event()
    work = [few(go.wait, 60), few(go.wait, 60)]
    for one in work[0], None:
        try:
            few(int)
        except OSError as error:
            assert "too much to do" in str(error), error
        else:
            raise AssertionError("a third one")
        if one:
            one.cancel()
            await asyncio.sleep(0)
    go.set()
    assert await work[1] is True
    while True:
        try:
            assert await few(int) == 0
            break
        except OSError:
            await asyncio.sleep(0.01)


if __name__ == "__main__":
    try:
        from pokeys_gateway import aside, config, hub, model
    except ImportError as error:
        print(f"not tried: {error} (Debian: python3-aiohttp, python3-prometheus-client)", file=sys.stderr)
        sys.exit(77)
    heard = Lines()
    logging.getLogger("pokeys-gateway").addHandler(heard)
    asyncio.run(asyncio.wait_for(looking_goes_on(), 60))
    asyncio.run(asyncio.wait_for(few_wait_for_a_disk(), 60))
    lag_is_told_once_in_a_while()
