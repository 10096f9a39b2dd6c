# SPDX-License-Identifier: GPL-2.0-or-later
"""A simulator, a daemon and pokeysctl with a folder, an address and a notify
socket of their own, so that any number of tests run beside each other.

The machine may be busy, so any process may stop for a second at any moment. A test
therefore waits for what it expects, for at most PATIENCE; this limit only decides
when to give up. The bench measures how fast things are."""
import atexit
import concurrent.futures
import json
import os
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import safety  # noqa: E402  pylint: disable=wrong-import-position

SEED = int(os.environ.get("POKEYS_SEED", "0")) or random.SystemRandom().randrange(1, 2**31)
rng = random.Random(SEED)
PATIENCE = 60  # seconds; whatever takes longer hangs
copies = {}  # of programs, for_everybody()


def free_address():
    """An address of the loopback network. Never by the seed: tests beside each other have the
    same one. Nor is it tried: a simulator searches at 0.0.0.0, so while any runs, nobody
    else may bind its port without sharing it; of 13 million two are not the same."""
    chance = random.SystemRandom()
    return f"127.{chance.randrange(10, 250)}.{chance.randrange(1, 250)}.{chance.randrange(1, 250)}"


def shared_memory():
    """What iceoryx2 has put into /dev/shm; other programs may add and remove everything else there."""
    return {entry.name for entry in os.scandir("/dev/shm") if "iox" in entry.name}


class House:
    """Programs come from argv: pokeysd, pokeysctl, pokeys-sim, commander."""
    programs = {}

    def __init__(self, **daemon):
        parent = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="pokeysd-test-", dir=parent))
        self.folder.chmod(0o711)
        self.runtime = self.folder / "run"
        self.conf = self.folder / "pokeysd.conf"
        self.address = free_address()
        self.children = []
        self.notify = None
        self.daemon_keys = {"runtime-directory": self.runtime, "realtime": "optional", **daemon}
        self.device_keys = {"mill": {"address": self.address}}
        self.heater_keys, self.servo_keys = {}, {}

    def __enter__(self):
        return self

    def __exit__(self, _kind, fault, _where):
        if fault and not isinstance(fault, Skip):
            for path in sorted(self.folder.glob("*.log")):
                fault.add_note(f"{path.name}:\n{path.read_text(errors='replace')[-3000:]}")
        for child in reversed(self.children):
            if child.poll() is None:
                child.kill()
            child.wait()
        if self.notify:
            self.notify.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def spawn(self, program, *arguments, log=None, **options):
        output = open(self.folder / log, "ab") if log else subprocess.PIPE
        options = {"stdout": output, "stderr": subprocess.STDOUT, "stdin": subprocess.DEVNULL, **options}
        child = subprocess.Popen([self.programs[program], *map(str, arguments)], **options)
        if log:
            output.close()
        self.children.append(child)
        return child

    def log(self, name="pokeysd.log"):
        return (self.folder / name).read_text(errors="replace")

    def complaint(self, name="pokeysd.log"):
        """The one line that it ended with; what it goes on without is not it."""
        lines = [line for line in self.log(name).splitlines() if "going on without" not in line]
        assert len(lines) == 1, lines
        return lines[0]

    def write_conf(self):
        lines = ["[daemon]", *(f"{k} = {v}" for k, v in self.daemon_keys.items())]
        for kind, sections in (("device", self.device_keys), ("heater", self.heater_keys), ("servo", self.servo_keys)):
            for name, keys in sections.items():
                lines += [f"[{kind} {name}]", *(f"{k} = {v}" for k, v in keys.items())]
        self.conf.write_text("\n".join(lines) + "\n")

    def start_sim(self, *options, address=None):
        control = self.folder / f"sim{len(self.children)}.sock"
        sim = self.spawn("pokeys-sim", "--address", address or self.address, "--control", control,
                         "--quiet", *options, log="sim.log")
        wait_for("the simulator", control.exists)
        sim.control = control
        return sim

    def ask_sim(self, sim, *words):
        return run(self.programs["pokeys-sim"], "--ctl", sim.control, *words).stdout

    def start_daemon(self, *options, wait=True, **spawn):
        self.write_conf()
        daemon = self.spawn("pokeysd", "--config", self.conf, *options, **{"log": "pokeysd.log", **spawn})
        if wait:
            def ready():
                assert daemon.poll() is None, f"pokeysd ended with {daemon.returncode}: {self.log()}"
                return (self.runtime / "current").exists()
            wait_for("the daemon", ready)
        return daemon

    def open_notify(self):
        path = self.folder / "notify"
        self.notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.notify.bind(str(path))
        self.notify.settimeout(PATIENCE)
        return {**os.environ, "NOTIFY_SOCKET": str(path)}

    def ctl(self, *words):
        return run(self.programs["pokeysctl"], "-r", self.runtime, *words)

    def says(self, *words, **wanted):
        """pokeysctl's answer to these words, once it is the wanted one (returncode=, stdout=, stderr=)."""
        found = None

        def answered():
            nonlocal found
            found = self.ctl(*words)
            return {name: getattr(found, name) for name in wanted}
        wait_equal(f"pokeysctl {words}", answered, wanted)
        return found

    def tells(self, text, *words):
        """pokeysctl's answer to these words, once this text is in it."""
        found = None

        def told():
            nonlocal found
            found = self.ctl(*words)
            return text in found.stdout + found.stderr
        wait_for(f"pokeysctl {words}: {text!r}", told, say=lambda: found)
        return found

    def device(self, name="mill"):
        out = self.ctl("status", name, "--json")
        return json.loads(out.stdout)["devices"][0] if out.stdout else None

    def state(self, name="mill"):
        """The state image; {} if nothing can be read."""
        return (self.device(name) or {}).get("state") or {}

    def fresh(self, name="mill"):
        device = self.device(name)
        return bool(device and device["fresh"])

    def wait_fresh(self, name="mill", limit=PATIENCE):
        wait_for(f"{name} fresh", lambda: self.fresh(name), limit)


def for_everybody(program):
    """A copy of the program that every user may run: the checkout may be in a folder that only its owner can enter."""
    if program not in copies:
        folder = pathlib.Path(tempfile.mkdtemp(prefix="pokeysd-test-", dir="/tmp"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        folder.chmod(0o755)
        copies[program] = pathlib.Path(shutil.copy(House.programs[program], folder))
        copies[program].chmod(0o755)
    return copies[program]


def run(*command, **options):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=2 * PATIENCE,
                          check=False, **options)


def wait_for(what, test, limit=PATIENCE, say=None):
    """Until test() is true; what it gave then. say() adds to the complaint that it never was."""
    begun = time.monotonic()
    while not (found := test()):
        assert time.monotonic() < begun + limit, f"{what}: not within {limit} s, still {say() if say else found!r}"
        pause(begun)
    return found


def pause(begun):
    """Before looking again for what is awaited since then: what takes long is not found much later, and costs less."""
    time.sleep(min(0.1, max(0.01, (time.monotonic() - begun) / 10)))


def wait_equal(what, get, wanted, limit=PATIENCE):
    """Until get() gives what is wanted."""
    begun = time.monotonic()
    while (found := get()) != wanted:
        assert time.monotonic() < begun + limit, f"{what}: {found!r} after {limit} s, not {wanted!r}"
        pause(begun)


def equal(found, wanted, why=""):
    assert found == wanted, f"{found!r}, not {wanted!r} {why}"


def end(child, number=signal.SIGTERM, limit=PATIENCE):
    """Send it the signal and wait; its exit status."""
    child.send_signal(number)
    return child.wait(limit)


class Skip(Exception):
    """Why a test cannot run here."""


def attempt(test):
    """What it raised, or None."""
    try:
        test()
    except Exception as fault:  # pylint: disable=broad-except
        return fault
    return None


def main(module, beside=1):
    """Run the functions of a module that begin with test_; argv has the programs.

    Several run beside each other in threads, where a module asks for it: because they mostly wait,
    and have nothing in common but their House."""
    for argument in sys.argv[1:]:
        path = pathlib.Path(argument).resolve()
        House.programs[path.name] = path
    print(f"POKEYS_SEED={SEED}")
    names = [name for name in dir(module) if name.startswith("test_")]
    assert names, f"{module} has no tests"
    tests = [getattr(module, name) for name in names]
    faults, skipped = [], 0
    with concurrent.futures.ThreadPoolExecutor(beside) as pool:
        for name, fault in zip(names, pool.map(attempt, tests) if beside > 1 else map(attempt, tests), strict=True):
            if fault is None:
                print(f"ok      {name[5:]}", flush=True)
            elif isinstance(fault, Skip):
                skipped += 1
                print(f"not tried: {name[5:]}: {fault}", file=sys.stderr, flush=True)
            else:
                faults.append(fault)
                print(f"FAILED  {name[5:]}: {type(fault).__name__}: {fault}")
                print("".join(traceback.format_exception(fault)), flush=True)
    return 77 if skipped == len(names) else safety.status(faults)
