#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl config against a running daemon and a simulated device: what the
device has, what is wanted otherwise, applied from the file, saved."""
import json
import re
import os
import signal
import socket
import subprocess
import sys

from house import PATIENCE, House, end, equal, main, run, wait_equal, wait_for


# a machine that is held for a moment has not lost its device: what was on its way to it
# would be found done, and told by nobody
PATIENT = {"lost-after-ms": 60000}


def started(house, **keys):
    house.device_keys["mill"] |= PATIENT | keys
    house.start_sim("--preset", "demo")
    daemon = house.start_daemon()
    house.wait_fresh("mill")
    wait_for("the settings", lambda: house.ctl("config", "show", "mill").returncode == 0)
    return daemon


def value(house, key):
    shown = house.ctl("config", "show", "mill").stdout
    found = re.search(rf"^{re.escape(key)} = (.*)$", shown, re.M)
    return found and found[1]


def wait_value(house, key, wanted):
    """A device that is being looked for again is not told about, so this is never asked once."""
    wait_equal(key, lambda: value(house, key), wanted)


def no_difference(house):
    return house.ctl("config", "diff", "mill").returncode == 0


def test_what_is_shown_can_be_put_into_the_file():
    with House() as house:
        started(house)
        shown = house.says("config", "show", "mill", returncode=0, stderr="")
        assert shown.stdout.startswith("[device mill]\n"), shown.stdout
        copy = house.folder / "copy.conf"
        copy.write_text(shown.stdout)
        out = run(house.programs["pokeysd"], "--check-config", "--config", copy)
        assert out.returncode == 0, out.stderr + shown.stdout
        document = json.loads(house.ctl("config", "show", "mill", "--json").stdout)
        equal((document["format"], document["device"]), (1, "mill"))
        equal(len(document["pin_functions"]), 55)
        speed = re.search(r"^axis\.0\.max-speed = (.*)$", shown.stdout, re.M)
        equal(document["settings"]["axis.0.max-speed"], float(speed[1]), shown.stdout)


def test_apply_reads_the_file_again_and_diff_tells_when_it_is_done():
    with House() as house:
        daemon = started(house, **{"axis.0.max-speed": 5000})
        wait_value(house, "axis.0.max-speed", "5000")
        house.device_keys["mill"] |= {"axis.0.max-speed": 7000, "digital-outputs": "31,32"}
        house.write_conf()
        out = house.tells("mill: the device has all that is wanted", "config", "apply", "mill")
        equal(out.returncode, 0, out)
        wait_value(house, "axis.0.max-speed", "7000")
        wait_value(house, "digital-outputs", "31-34")  # in no other list now
        house.says("config", "diff", "mill", returncode=0, stdout="")
        equal(json.loads(house.ctl("config", "diff", "mill", "--json").stdout)["differences"], [])
        # and the same by signal
        house.device_keys["mill"]["axis.0.max-speed"] = 8000
        house.write_conf()
        daemon.send_signal(signal.SIGHUP)
        wait_value(house, "axis.0.max-speed", "8000")
        wait_for("the answer", lambda: "its settings go to 1 of 1 devices" in house.log())


def test_a_broken_file_changes_nothing_and_its_faults_come_back():
    with House() as house:
        daemon = started(house, **{"axis.0.max-speed": 5000})
        wait_value(house, "axis.0.max-speed", "5000")
        house.device_keys["mill"]["axis.0.max-speed"] = "999999"
        house.write_conf()
        out = house.ctl("config", "apply", "mill")
        assert out.returncode == 1 and not out.stdout, out
        assert f"{house.conf}:" in out.stderr and "axis.0.max-speed" in out.stderr, out.stderr
        assert "1..125000" in out.stderr, out.stderr
        daemon.send_signal(signal.SIGHUP)
        wait_for("the answer", lambda: "nothing was changed" in house.log())
        wait_value(house, "axis.0.max-speed", "5000")
        equal(daemon.poll(), None, house.log())


def test_save_keeps_the_settings_in_the_device():
    with House() as house:
        started(house)
        house.tells("in its flash memory now", "config", "save", "mill")


# nearly every key, each with a value that the simulated device does not begin with
EVERY = """
digital-inputs = 9-16,52
digital-outputs = 31-34
analog-inputs = 41-45
counter-inputs = 19
inverted-pins = 32
axes = 4
generator = external
generator-swap = on
generator-extended-io = on
charge-pump = off
emergency-pin = 52
emergency-invert = on
power-states = 1
axis.0.mode = position
axis.0.invert = on
axis.0.max-speed = 12345.6
axis.0.max-acceleration = 54321
axis.0.soft-limits = on
axis.0.soft-minimum = -1000
axis.0.soft-maximum = 1000
axis.0.limit-minus = on
axis.0.limit-plus = off
axis.0.home = on
axis.0.home-shared = limit-minus
axis.0.limit-minus-invert = on
axis.0.limit-minus-pin = 9
axis.0.limit-plus-pin = dedicated
axis.0.home-pin = 10
axis.0.limit-minus-filter = 3
axis.0.probe-filter = 2
axis.0.enable-pin = 35
axis.0.enable-invert = on
axis.0.enable-masked = on
axis.0.homing-invert = on
axis.0.homing-algorithm = 131
axis.0.homing-speed = 30
axis.0.homing-return-speed = 20
axis.0.homing-back-off = 17
axis.0.mpg-encoder = 3
axis.0.mpg-multiplier = -4
axis.0.mpg-divider = 5
axis.0.step-invert = on
axis.0.index-falling = on
backlash = on
backlash-speed = 9
axis.0.backlash-width = 24
axis.0.backlash-acceleration = 3000000
postep = on
axis.0.postep-type = 1
axis.0.postep-address = 33
axis.0.postep-microsteps = 32
axis.0.postep-temperature-limit = 70
axis.3.mode = buffered
synced-pwm = on
synced-pwm-axis = 3
synced-pwm-channel = 4
synced-outputs = on
synced-outputs-axis = 3
synced-outputs-pins = 33,0,0,95,0,0,0,34
encoder.3.pins = 11,12
encoder.4.enable = off
fast-encoders = on
fast-encoder-sampling = 1
fast-encoder.1.invert = on
fast-encoder-index = on
ultra-fast-encoder = on
ultra-fast-encoder-mode = direction
ultra-fast-encoder-invert = on
ultra-fast-encoder-filter = 100
pwm-period = 2500
analog-filter = 7
poextbus-connector = dedicated
poextbus-crc = off
matrix-keyboard = on
matrix-rows = 26,25,24,23
matrix-columns = 28,29
failsafe-timeout-ms = 700
failsafe-parts = 7
failsafe-on = 33
failsafe-poextbus = 1,2,255,0,0,0,0,0,0,9
failsafe-pwm = 10,100,0,0,0,1
device-name = my mill
"""


def test_every_key_reaches_the_device():
    keys = dict(line.split(" = ", 1) for line in EVERY.strip().splitlines())
    with House() as house:
        started(house, **keys)
        wait_for("all of it", lambda: no_difference(house))
        shown = house.says("config", "show", "mill", returncode=0).stdout
        have = dict(line.split(" = ", 1) for line in shown.splitlines() if " = " in line)
        missing = {key: (wanted, have.get(key)) for key, wanted in keys.items() if have.get(key) != wanted}
        assert not missing, missing
        # each is told
        for what in ("terminal 19: counter input", "axis 0 configured", "backlash of axis 0 configured", "PoStep driver of axis 0 configured", "device name configured", "failsafe configured"):
            wait_for(what, lambda: what in house.log())  # pylint: disable=cell-var-from-loop


def test_status_and_top_show_the_drivers():
    with House() as house:
        house.device_keys["mill"] |= PATIENT | {"postep": "on"}
        for axis, address in enumerate((33, 99)):  # there is none at 99
            house.device_keys["mill"] |= {f"axis.{axis}.postep-type": 1, f"axis.{axis}.postep-address": address}
        sim = house.start_sim("--preset", "demo")
        house.start_daemon()
        house.tells("  PoStep 0    24 V 40 C active", "status", "mill")
        house.tells("  PoStep 1    NOT HEARD OF", "status")
        shown = house.tells("PoStep 0: 24 V 40 C active", "top", "mill", "--count", "1").stdout
        assert "PoStep 2" not in shown and "threading" not in shown, shown
        house.ask_sim(sim, "field", "postep.faults", "0", "32")
        house.tells(", FAULT: undervoltage\n", "status", "mill")
        house.tells("PoStep 0 FAULT: undervoltage\n", "top", "mill", "--count", "1")
        house.ask_sim(sim, "field", "postep.powered", "0", "0")
        house.tells("  PoStep 0    SILENT for ", "status", "mill")


def commander(house):
    """A commander in Python. It is never closed: that is done by its end."""
    library = next(path for name, path in house.programs.items() if name.startswith("libpokeys_shm.so"))
    binding = house.programs["binding.py"].parent
    child = subprocess.Popen([sys.executable, "-c", COMMANDER, binding, house.runtime], stdin=subprocess.PIPE,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                             env=dict(os.environ, POKEYS_SHM_LIBRARY=str(library)))
    house.children.append(child)
    return child


# answers "ready" when it is attached; "wish GENERATION SPEED" writes; "report" answers with epoch, generation and speed;
# "machine 1" keeps a heartbeat from then on and permits motion, "machine 0" ends that
COMMANDER = """
import sys
import threading
import time
sys.path.insert(0, sys.argv[1])
import binding
client = binding.Client("mill", sys.argv[2], "wisher", binding.COMMANDER)
command = binding.Command(session=77)
lock = threading.Lock()

def beat():
    while True:
        time.sleep(0.005)
        with lock:
            command.heartbeat += 1
            client.read()
            command.t_ns = command.t_thread_ns = time.monotonic_ns()
            client.write(command)

while client.poll() != binding.ATTACHED:
    time.sleep(0.01)
print("ready", flush=True)
for line in sys.stdin:
    with lock:
        client.poll()
    words = line.split()
    if words[0] == "machine":
        command.flags = 0
        if not command.heartbeat:
            threading.Thread(target=beat, daemon=True).start()
        while words[1] == "1" and client.read().command_heartbeat < 3:
            time.sleep(0.01)  # until it has been seen off
        command.flags = int(words[1])
        print("yes", flush=True)
    elif words[0] == "wish":
        wish = binding.Wish(session=77, generation=int(words[1]))
        wish.settings.axis[0].set = 1 << 16
        wish.settings.axis[0].max_speed = float(words[2])
        print(client.write_wish(wish), flush=True)
    else:
        report = client.read_report()
        print(*(report and (report.epoch, report.generation, report.device.axis[0].max_speed) or (0, 0, 0)), flush=True)
"""


def say(child, text):
    child.stdin.write(text + "\n")
    child.stdin.flush()
    return child.stdout.readline().strip()


def report(child):
    epoch, generation, speed = say(child, "report").split()
    return int(epoch), int(generation), float(speed)


def test_a_wish_is_applied_reported_and_written_again_to_the_next_daemon():
    with House() as house:
        daemon = started(house, **{"axis.0.max-speed": 5000})
        wisher = commander(house)
        equal(wisher.stdout.readline(), "ready\n")
        equal(say(wisher, "wish 1 6000"), "True")
        wait_equal("the wish", lambda: report(wisher)[1:], (1, 6000))
        wait_value(house, "axis.0.max-speed", "6000")
        # killed with a wish on its way: the next one knows nothing of it
        equal(say(wisher, "wish 2 7000"), "True")
        daemon.kill()
        daemon.wait()
        before = report(wisher)[0]
        house.start_daemon()
        wait_for("the next daemon", lambda: report(wisher)[0] not in (0, before))
        house.wait_fresh("mill")
        wait_equal("what the file wants", lambda: report(wisher)[1:], (0, 5000))
        equal(say(wisher, "wish 2 7000"), "True")
        wait_equal("the wish again", lambda: report(wisher)[1:], (2, 7000))
        # a commander that dies takes nothing back
        wisher.kill()
        wisher.wait()
        wait_value(house, "axis.0.max-speed", "7000")


def test_nothing_is_written_while_the_machine_is_on():
    with House() as house:
        # on a machine that is held now and then: permission shall not be lost meanwhile
        started(house, **{"axis.0.max-speed": 5000, "heartbeat-timeout-ms": 60000})
        wisher = commander(house)
        equal(wisher.stdout.readline(), "ready\n")
        say(wisher, "machine 1")
        wait_for("motion", lambda: house.state().get("flags", {}).get("machine_on"))
        house.device_keys["mill"]["axis.0.max-speed"] = 6000
        house.write_conf()
        house.tells("waits until the machine is off", "config", "apply", "mill")
        house.says("config", "diff", "mill", returncode=1,
                   stdout="axis.0.max-speed: 6000 is wanted, the device has 5000\n")
        differences = json.loads(house.ctl("config", "diff", "mill", "--json").stdout)["differences"]
        equal(differences, [{"key": "axis.0.max-speed", "wanted": "6000", "has": "5000"}])
        out = house.tells("switch the machine off first", "config", "save", "mill")
        equal(out.returncode, 1, out)
        say(wisher, "machine 0")
        wait_value(house, "axis.0.max-speed", "6000")
        wait_for("no difference", lambda: no_difference(house))


def ask(address, operation, *parameters, payload=b""):
    """One request to the device itself; its answer."""
    packet = bytearray(64)
    packet[0:2] = 0xBB, operation
    packet[2:2 + len(parameters)] = parameters
    packet[6] = 1
    packet[7] = sum(packet[:7]) & 255
    packet[8:8 + len(payload)] = payload
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as to:
        to.settimeout(PATIENCE)
        to.sendto(packet, (address, 20055))
        return to.recv(64)


def test_a_password_comes_from_its_file_and_is_never_told():
    with House() as house:
        house.start_sim("--enforce-security")
        ask(house.address, 0xE3, 255, payload=b"open sesame")
        ask(house.address, 0x50, 0xAA, 0x55)
        ask(house.address, 0xF3)
        wait_for("the lock", lambda: ask(house.address, 0xE1)[8] == 255)
        daemon = house.start_daemon()
        wait_equal("the lock", lambda: house.state().get("fault"), "configuration locked")
        wait_for("what to do", lambda: "password" in house.ctl("status").stdout)
        daemon.kill()
        daemon.wait()
        secret = house.folder / "secret"
        secret.write_text("open sesame\n")
        secret.chmod(0o644)
        house.device_keys["mill"]["password-file"] = secret
        daemon = house.start_daemon(wait=False)
        equal(daemon.wait(PATIENCE), 78, house.log())
        assert "may be read by others" in house.log(), house.log()
        secret.chmod(0o600)
        house.start_daemon()
        house.wait_fresh("mill")
        assert "sesame" not in house.log(), house.log()


def test_orders_of_a_device_that_is_away():
    with House() as house:
        house.start_daemon()
        out = house.ctl("config", "save", "mill")
        assert out.returncode == 1 and "mill: the device is away" in out.stderr, out
        out = house.ctl("config", "apply", "mill")
        assert out.returncode == 0 and "when it is back" in out.stdout, out
        out = house.tells("have not been read", "config", "show", "mill")
        equal(out.returncode, 1, out)
        house.says("config", "diff", "mill", returncode=2)


def test_what_was_read_last_is_shown_of_a_device_that_is_lost():
    # of a device that is lost, and of a daemon that is dead
    with House() as house:
        house.device_keys["mill"] |= {"axis.0.max-speed": 5000}
        sim = house.start_sim("--preset", "demo")
        daemon = house.start_daemon()
        house.wait_fresh()
        wait_value(house, "axis.0.max-speed", "5000")
        end(sim)
        wait_equal("the loss", lambda: house.state().get("link"), "lost")
        out = house.tells("lost: no answer", "config", "show", "mill")
        assert "axis.0.max-speed = 5000\n" in out.stdout and "were read last" in out.stderr, out
        equal(out.returncode, 0, out)
        out = house.says("config", "diff", "mill", returncode=2)
        assert "not been read since it was lost" in out.stderr and not out.stdout, out
        end(daemon, signal.SIGKILL)
        out = house.tells("not publishing", "config", "show", "mill")
        assert "axis.0.max-speed = 5000\n" in out.stdout and "were read last" in out.stderr, out
        equal(out.returncode, 0, out)
        house.says("config", "diff", "mill", returncode=2)


def test_a_daemon_that_was_killed_is_followed_by_one_that_takes_orders():
    with House() as house:
        daemon = started(house)
        daemon.kill()
        daemon.wait()
        out = house.ctl("config", "save", "mill")
        assert out.returncode == 1 and "no daemon takes orders" in out.stderr, out
        house.start_daemon()
        house.wait_fresh("mill")
        wait_for("an order", lambda: house.ctl("config", "save", "mill").returncode == 0)


def test_the_socket_is_removed_at_a_clean_end():
    with House() as house:
        daemon = started(house)
        wait_for("the socket", (house.runtime / "control").is_socket)
        wait_equal("its mode", lambda: (house.runtime / "control").stat().st_mode & 0o777, 0o660)
        daemon.send_signal(signal.SIGTERM)
        equal(daemon.wait(PATIENCE), 0, house.log())
        assert not (house.runtime / "control").exists(), list(house.runtime.iterdir())


def test_mistakes_are_told():
    with House() as house:
        started(house)
        for words in (["config"], ["config", "show"], ["config", "erase", "mill"], ["config", "show", "a", "b"]):
            out = house.ctl(*words)
            assert out.returncode == 64 and "pokeysctl config show | diff | apply | save DEVICE" in out.stderr, out
        out = house.ctl("config", "show", "lathe")
        assert out.returncode == 1 and 'has no device "lathe"' in out.stderr, out
        out = house.ctl("config", "apply", "lathe")
        assert out.returncode == 1 and 'there is no device "lathe"' in out.stderr, out


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
