#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""gateway.conf: every fault in one line with its place, and nothing happens before all is judged."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from rig import run_in_fork

PROGRAM = pathlib.Path(sys.argv[1])

GOOD = """# a comment
  ; and one more
[gateway] # one space is enough
runtime-directory = /run/mill # where pokeysd is
record-folder = /srv/records
doctor-socket = /run/doctor

  [http]
listen=127.0.0.1:8580, [::1]:8581	; and a tab
  host-names = mill.local, Mill
[http]
[machine]
kind = serial
port = /dev/serial/by-id/usb-a
baud = 250000
flow-control = hardware
firmware = grbl
[telnet]
listen = 127.0.0.1:2323
[pty]
path = /run/pokeys-gateway/printer
group = root
[esp3d]
listen = 127.0.0.1:8081
folder = /srv/pages
[console]
level = admin
"""

# what is written, and what is said: line, then text
BAD = (
    ("listen = 127.0.0.1:1\n", 1, "a section such as [gateway] has to come first"),
    ("[http]\nlisten\n", 2, "neither a section in brackets nor KEY = VALUE"),
    ("[http]x]\n", 1, "neither a section in brackets nor KEY = VALUE"),
    ("[http]\n\nlisten = 127.0.0.1:1\n[gateway]\n[http]\nlisten = 127.0.0.1:2\n", 6, "[http] listen: is there already"),
    ("  [web]\n", 1, "there is no section [web]"),
    ("[gateway]\nruntime-directory = /run/mill\n  listen = 1.1.1.1:1\n", 3, "[gateway] listen: there is no such key"),
    ("[gateway]\nrecord-folder = records\n", 2, '[gateway] record-folder: "records" is not allowed; allowed: a path from /'),
    ("[gateway]\ndoctor-socket = /" + 107 * "x" + "\n", 2, "allowed: a path from / of at most 107 bytes"),
    ("[gateway]\nruntime-directory = /run/a\x0cb\n", 2, "allowed: a path from /"),
    ("[web]\nlisten = 127.0.0.1:1\n", 1, "there is no section [web]; there are [gateway], [http], [access], [linuxcnc]"),
    ("[http]\nport = 80\n", 2, "[http] port: there is no such key; there are listen, host-names, certificate"),
    ("[DEFAULT]\nlisten = 127.0.0.1:1\n", 1, "there is no section [DEFAULT]; there are [gateway], [http], [access], [linuxcnc]"),
    ("[http]\nlisten = 8580\n", 2, '[http] listen: "8580" is not allowed; allowed: ADDRESS:PORT, such as '
                                   "127.0.0.1:8580 or [::1]:8580"),
    ("[http]\nlisten = 127.0.0.1:70000\n", 2, '[http] listen: "127.0.0.1:70000" is not allowed; allowed: ADDRESS:PORT'),
    ("[http]\nlisten = localhost:80\n", 2, '[http] listen: "localhost:80" is not allowed; allowed: ADDRESS:PORT'),
    ("[http]\nkey = key.pem\n", 2, '[http] key: "key.pem" is not allowed; allowed: a path from /'),
    ("[http]\nbehind-proxy = 10.0.0\n", 2, "allowed: addresses, such as 192.168.1.2"),
    ("[access]\nguests = true\n", 2, '[access] guests: "true" is not allowed; allowed: yes, no'),
    ("[http]\nlisten = 127.0.0.1:1,127.0.0.1:1\n", 2, "allowed: each address once"),
    ("[linuxcnc]\nproxy = a.b\n", 2, '"a.b" is not allowed; allowed: the name of a pokeys-remote'),
    ("[linuxcnc]\noperate = on\n", 2, "allowed: yes, no"),
    ("[machine]\nport = ttyUSB0\n", 2, '[machine] port: "ttyUSB0" is not allowed; allowed: a path from /'),
    ("[machine]\nkind = usb\n", 2, '[machine] kind: "usb" is not allowed; allowed: serial, pokeys'),
    ("[machine]\nkind = serial\n", 2, "[machine] kind: kind = serial needs port"),
    ("[machine]\nport = /dev/ttyUSB0\nkind = pokeys\n", 3, "kind = pokeys has no port"),
    ("[machine]\nkind = pokeys\nfirmware = grbl\n", 3, "[machine] firmware: kind = pokeys takes lines as marlin does"),
    ("[machine]\ndevice = mill\n", 2, "[machine] device: device needs kind = pokeys"),
    ("[linuxcnc]\noperate = yes\nhotend = 1\n", 3, "[linuxcnc] hotend: hotend needs operate = yes and kind = pokeys"),
    ("[linuxcnc]\nbed = 64\n", 2, '[linuxcnc] bed: "64" is not allowed; allowed: the N of motion.analog-out-N, 0 to 63'),
    ("[machine]\nkind = pokeys\nfan = pwm 1\n", 3, "[machine] fan: outputs need device"),
    ("[machine]\nfan = pwm 6\n", 2, 'fan: "pwm 6" is not allowed; allowed: pin and a terminal, 1 to 55, external and the number of an output, 0 to 7, pwm and a channel, 0 to 5'),
    ("[machine]\nspindle = pwm 1\n", 2, '"pwm 1" is not allowed; allowed: pin and a terminal, 1 to 55, external and the number of an output, 0 to 7'),
    ("[machine]\nkind = pokeys\ndevice = mill\nfan = external 3\nspindle = external 3\n", 5, "external 3 is used twice"),
    ("[machine]\nspindle-max = 0\n", 2, '"0" is not allowed; allowed: revolutions per minute, such as 24000'),
    ("[machine]\nkind = pokeys\ndevice = mill\nspindle-speed = pwm 1\n", 4, "spindle-max is missing"),
    ("[machine]\nkind = pokeys\ndevice = mill\nspindle-max = 100\n", 4, "spindle-speed is missing"),
    ("[machine]\nkind = pokeys\ndevice = mill\nspindle-reverse = pin 1\n", 4, "spindle or spindle-speed is missing"),
    ("[machine]\nkind = pokeys\ndevice = mill\nfan = pin 1, pin 2\nspindle = pin 2\n", 5, "pin 2 is used twice"),
    ("[machine]\nkind = pokeys\nfolder = /tmp\n", 3, "[machine] folder: folder needs device"),
    ("[machine]\nkind = pokeys\ndevice = a mill\n", 3, '"a mill" is not allowed; allowed: the name of a device in pokeysd.conf'),
    ("[machine]\nkind = pokeys\ndevice = mill\n[linuxcnc]\noperate = yes\n", 3, "G-code either commands a device or stops"),
    ("[machine]\nport = /dev/a\n[pty]\npath = /dev/a\n", 4, "[pty] path: this is the machine's port"),
    ("[machine]\nbaud = 0\n", 2, '[machine] baud: "0" is not allowed; allowed: bits a second, 50 to 4000000'),
    ("[machine]\nfirmware = klipper\n", 2, '"klipper" is not allowed; allowed: marlin, grbl, grblhal, smoothieware'),
    ("[machine]\nflow-control = yes\n", 2, "allowed: none, hardware, software"),
    ("[telnet]\nlistn = 1.1.1.1:1\n", 2, "[telnet] listn: there is no such key; did you mean listen?"),
    ("[telnet]\nport = 23\n", 2, "[telnet] port: there is no such key; there are listen, plaintext"),
    ("[pty]\ngroup = nosuchgroup\n", 2, '"nosuchgroup" is not allowed; allowed: the name of a group that is there'),
    ("[esp3d]\nfolder = pages\n", 2, '[esp3d] folder: "pages" is not allowed; allowed: a path from /'),
    ("[esp3d]\nlisten = 127.0.0.1:65535\n", 2, "[esp3d] listen: the port behind it is needed for web sockets"),
    ("[esp3d]\nlisten = 192.168.1.5:8081\n", 2, "esp3d has no encryption"),
    ("[console]\nlevel = root\n", 2, '[console] level: "root" is not allowed; allowed: guest, user, admin'),
    ("[http]\nlisten =\n", 2, '[http] listen: "" is not allowed'),
    ("[http]\nhost-names = a b\n", 2, '[http] host-names: "a b" is not allowed; allowed: names of this computer'),
    ("[gateway]\nruntime-directory = run\n", 2, '[gateway] runtime-directory: "run" is not allowed; allowed: a path '
                                                "from /"),
    ("[gateway]\nruntime-directory = /" + 49 * "x" + "\n", 2, "at most 49 characters"),
    ("[gateway]\nruntime-directory = /" + 30 * "é" + "\n", 2, "at most 49 characters"),
)


def start(*words):
    """The program, as a user starts it."""
    return subprocess.run(["/usr/bin/python3", "-B", PROGRAM, *words], capture_output=True, text=True, timeout=60,
                          check=False)


def run(*words):
    """The same without a start."""
    return run_in_fork(__main__.main, *words)


def main():
    with tempfile.TemporaryDirectory() as folder:
        conf = pathlib.Path(folder, "gateway.conf")

        def check():
            return run("--check-config", "--config", conf)
        conf.write_text(GOOD, encoding="utf-8")
        for ran in check(), start("--check-config", "--config", conf):
            assert (ran.returncode, ran.stderr, ran.stdout) == (0, "", f"pokeys-gateway: {conf} is valid\n"), ran
        for text, line, said in BAD:
            conf.write_text(text, encoding="utf-8")
            ran = check()
            first = f"pokeys-gateway: {conf}:{line}: "
            assert (ran.returncode, ran.stdout) == (78, ""), (text, ran)
            assert ran.stderr.startswith(first) and said in ran.stderr and ran.stderr.count("\n") == 1, (text, ran)
        # all of them in one reading
        conf.write_text("[http]\nlisten = x\nport = 1\n?\n\n[gateway]\nruntime-directory = y\n[z]\n", encoding="utf-8")
        assert [int(line.split(":")[2]) for line in check().stderr.splitlines()] == [2, 3, 4, 7, 8], check()
        conf.write_bytes(b"[http]\n\xff\n")
        assert f"{conf}: not a text file (UTF-8)" in check().stderr, check()
        conf.unlink()
        ran = check()
        assert (ran.returncode, ran.stderr) == (78, f"pokeys-gateway: {conf}: No such file or directory\n"), ran
        for words, said in ((["--bogus"], "unrecognized arguments: --bogus; pokeys-gateway --help lists the options"),
                            (["--listen", "0.0.0.0"], '--listen: "0.0.0.0" is not allowed; allowed: ADDRESS:PORT'),
                            (["--level", "root"], "argument --level: invalid choice: 'root'"),
                            (["--runtime-directory", "run"], '--runtime-directory: "run" is not allowed; allowed: a'),
                            (["--runtime-directory", b"/run/\xff"], "--runtime-directory: ")):
            ran = run(*words)
            assert ran.returncode == 64 and ran.stderr.startswith(f"pokeys-gateway: {said}"), (words, ran)
            assert ran.stderr.count("\n") == 1, ran
        # each key is in the manual page, and no other
        page = (pathlib.Path(__file__).parents[2] / "man/pokeys-gateway.conf.5.scd").read_text(encoding="utf-8")
        keys = re.findall(r"^\*([a-z-]+)\* = ", page, re.M)
        assert keys == [key.name for key in config.KEYS], keys
        ran = start("--version")
        assert ran.stdout.startswith("pokeys-gateway 0."), ran
    print(f"{len(BAD)} mistakes")


if __name__ == "__main__":
    try:
        from pokeys_gateway import __main__, config
    except ImportError as error:
        print(f"not tried: {error} (Debian: python3-aiohttp, python3-prometheus-client)", file=sys.stderr)
        sys.exit(77)
    main()
