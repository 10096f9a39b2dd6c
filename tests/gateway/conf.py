#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""gateway.conf: every fault in one line with its place, and nothing happens before all is judged."""
import pathlib
import subprocess
import sys
import tempfile

PROGRAM = pathlib.Path(sys.argv[1])

GOOD = """# a comment
[gateway]
runtime-directory = /run/mill   # where pokeysd is

[http]
listen = 127.0.0.1:8580, [::1]:8581
host-names = mill.local, Mill
"""

# what is written, and what is said: line, then text
BAD = (
    ("listen = 127.0.0.1:1\n", 1, "a section such as [http] has to come first"),
    ("[http]\nlisten\n", 2, "neither a section nor KEY = VALUE"),
    ("[http]\n\nlisten = 127.0.0.1:1\nlisten = 127.0.0.1:2\n", 4, "[http] listen: is there already"),
    ("[http]\n[gateway]\n[http]\n", 3, "[http] is there already"),
    ("[web]\nlisten = 127.0.0.1:1\n", 1, "there is no section [web]; there are [gateway], [http]"),
    ("[http]\nport = 80\n", 2, "[http] port: there is no such key; there are listen, host-names"),
    ("[DEFAULT]\nlisten = 127.0.0.1:1\n", 1, "there is no section [DEFAULT]; there are [gateway], [http]"),
    ("[http]\nlisten = 8580\n", 2, '[http] listen: "8580" is not allowed; allowed: ADDRESS:PORT, such as '
                                   "127.0.0.1:8580 or [::1]:8580"),
    ("[http]\nlisten = 127.0.0.1:70000\n", 2, '[http] listen: "127.0.0.1:70000" is not allowed; allowed: ADDRESS:PORT'),
    ("[http]\nlisten = localhost:80\n", 2, '[http] listen: "localhost:80" is not allowed; allowed: ADDRESS:PORT'),
    ("[http]\nlisten = 0.0.0.0:8580\n", 2, '[http] listen: "0.0.0.0:8580" is not allowed; allowed: addresses of this '
                                           "computer alone"),
    ("[http]\nlisten = 192.168.1.2:8580\n", 2, "there is no access control yet"),
    ("[http]\nlisten = 127.0.0.1:1,127.0.0.1:1\n", 2, "allowed: each address once"),
    ("[http]\nlisten =\n", 2, '[http] listen: "" is not allowed'),
    ("[http]\nhost-names = a b\n", 2, '[http] host-names: "a b" is not allowed; allowed: names of this computer'),
    ("[gateway]\nruntime-directory = run\n", 2, '[gateway] runtime-directory: "run" is not allowed; allowed: a path '
                                                "from /"),
    ("[gateway]\nruntime-directory = /" + 49 * "x" + "\n", 2, "at most 49 characters"),
)


def run(*words, **options):
    return subprocess.run(["/usr/bin/python3", "-B", PROGRAM, *words], capture_output=True, text=True, timeout=60,
                          check=False, **options)


def main():
    with tempfile.TemporaryDirectory() as folder:
        conf = pathlib.Path(folder, "gateway.conf")

        def check():
            return run("--check-config", "--config", conf)
        conf.write_text(GOOD, encoding="utf-8")
        ran = check()
        assert (ran.returncode, ran.stderr, ran.stdout) == (0, "", f"pokeys-gateway: {conf} is valid\n"), ran
        for text, line, said in BAD:
            conf.write_text(text, encoding="utf-8")
            ran = check()
            first = f"pokeys-gateway: {conf}:{line}: "
            assert (ran.returncode, ran.stdout) == (78, ""), (text, ran)
            assert ran.stderr.startswith(first) and said in ran.stderr and ran.stderr.count("\n") == 1, (text, ran)
        # all of them in one reading
        conf.write_text("[http]\nlisten = x\nport = 1\n[gateway]\nruntime-directory = y\n", encoding="utf-8")
        assert [int(line.split(":")[2]) for line in check().stderr.splitlines()] == [2, 3, 5], check()
        conf.write_bytes(b"[http]\n\xff\n")
        assert f"{conf}: not a text file (UTF-8)" in check().stderr, check()
        conf.unlink()
        ran = check()
        assert (ran.returncode, ran.stderr) == (78, f"pokeys-gateway: {conf}: No such file or directory\n"), ran
        for words, said in ((["--bogus"], "unrecognized arguments: --bogus; pokeys-gateway --help lists the options"),
                            (["--listen", "0.0.0.0:1"], '--listen: "0.0.0.0:1" is not allowed; allowed: addresses of'),
                            (["--runtime-directory", "run"], '--runtime-directory: "run" is not allowed; allowed: a')):
            ran = run(*words)
            assert ran.returncode == 64 and ran.stderr.startswith(f"pokeys-gateway: {said}"), (words, ran)
            assert ran.stderr.count("\n") == 1, ran
        assert run("--version").stdout.startswith("pokeys-gateway 0."), run("--version")
    print(f"{len(BAD)} mistakes")


if __name__ == "__main__":
    try:
        import aiohttp  # noqa: F401
        import prometheus_client  # noqa: F401
    except ImportError as error:
        print(f"not tried: {error} (Debian: python3-aiohttp, python3-prometheus-client)", file=sys.stderr)
        sys.exit(77)
    main()
