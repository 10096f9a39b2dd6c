#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""ESP3D's doors for pages: commands over HTTP, log-in, web sockets and files, and what pages of others may not do."""
import asyncio
import contextlib
import gzip
import http.client
import json
import os
import re
import socket
import subprocess
import sys
import threading
import time
import urllib.parse

import rig
from bridge import PAGES, Telnet, bridge, console, quiet
from house import PATIENCE, Skip, main

BOUNDARY = "----------0123456789"


class Page:
    """What a page does over HTTP."""

    def __init__(self, house):
        self.host = house.console
        self.cookie = ""

    def ask(self, path, method="GET", body=None, **headers):
        """Status and body."""
        connection = http.client.HTTPConnection(self.host, PAGES, timeout=PATIENCE)
        try:
            headers = {name.replace("_", "-"): value for name, value in headers.items()}
            connection.request(method, path, body, {**(
                {"Cookie": self.cookie, "Referer": f"http://{self.host}:{PAGES}/"} if self.cookie else {}), **headers})
            answer = connection.getresponse()
            if cookie := answer.getheader("Set-Cookie"):
                self.cookie = cookie.partition(";")[0]
            self.headers = answer.headers
            return answer.status, answer.read()
        finally:
            connection.close()

    def command(self, text, **headers):
        status, body = self.ask("/command?" + urllib.parse.urlencode({"cmd": text}), **headers)
        return status, body.decode()

    def files(self, **parameters):
        return self.ask("/files?" + urllib.parse.urlencode(parameters))

    def upload(self, folder, **files):
        """As ESP3D-WEBUI sends it: fields, then the files with their whole path."""
        parts = [("path", None, folder.encode())]
        for name, data in files.items():
            name = name.replace("_", ".")
            parts += [(f"{folder.rstrip('/')}/{name}S", None, str(len(data)).encode()),
                      ("myfiles", f"{folder.rstrip('/')}/{name}", data)]
        return self.form(parts)

    def form(self, parts):
        body = b""
        for name, file, data in parts:
            named = f'; filename="{file}"' if file else ""
            body += f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="{name}"{named}\r\n\r\n'.encode(
                "utf-8", "surrogateescape") + data + b"\r\n"
        return self.ask("/files", "POST", body + f"--{BOUNDARY}--\r\n".encode(),
                        Content_Type=f"multipart/form-data; boundary={BOUNDARY}")


def test_commands():
    with bridge() as (house, gateway, printer):
        page, other = Page(house), Telnet(house)
        assert other.ask("[ESP500]") == "user"
        assert page.command("M105") == (200, "ESP3D says: command forwarded")
        assert other.line() == "ok T:21.3 /0.0" and printer.lines == [b"M105"]
        assert page.command("[ESP500]") == (200, "user\n")
        status, body = page.command("[ESP800]json=yes time=2026-11-28T12:00:00 version=3.0.0")
        found = json.loads(body)["data"]
        assert (status, found["FWTarget"], found["WebSocketPort"]) == (200, "marlin", str(PAGES + 1))
        assert found["WebSocketIP"] == house.console and page.headers["Content-Type"].startswith("application/json")
        assert page.command("[ESP999]") == (200, "error: there is no command [ESP999]; [ESP0] lists them\n")
        # several lines, a form, and nothing
        assert page.command("G28\nM114")[0] == 200
        assert page.ask("/command", "POST", "cmd=M106+S255",
                        Content_Type="application/x-www-form-urlencoded") == (200, b"ESP3D says: command forwarded")
        gateway.wait("it has them", lambda: printer.lines == [b"M105", b"G28", b"M114", b"M106 S255"])
        assert page.command("")[0] == 400 and page.ask("/command?PING=Yes") == (200, b"ok")
        assert page.ask("/config")[1].startswith(b"Configuration:\n") and b'"cmd":"420"' in page.ask("/config?json=yes")[1]
        # a stop too
        assert page.command("M112")[0] == 200
        while not other.line().startswith("[stop by http"):
            pass
        printer.unplug()
        gateway.wait("it is gone", lambda: console(gateway, "machine_up") == 0)
        status, body = page.command("M105")
        assert status == 503 and body.startswith(f"error: {house.port}: ")
        quiet(gateway)


def names(answer):
    """Of a listing."""
    return [one["name"] for one in json.loads(answer[1])["files"]]


def test_pages_of_others():
    with bridge() as (house, gateway, printer):
        page = Page(house)
        here = f"http://{house.console}:{PAGES}"
        for headers in ({"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate"},
                        {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "no-cors"},
                        {"Sec_Fetch_Site": "same-site", "Sec_Fetch_Mode": "no-cors"},
                        {"Origin": "http://example.org"}, {"Origin": here.replace("http:", "https:") + "0"},
                        {"Origin": f"http://{house.console}"}, {"Origin": f"http://{house.console}:{PAGES - 1}"}, {"Host": f"example.org:{PAGES}"}):
            assert page.command("M104 S300", **headers)[0] == 403, headers
        for headers in ({"Origin": here}, {"Sec_Fetch_Site": "same-origin"}, {"Sec_Fetch_Site": "none"}):
            assert page.command("M105", **headers)[0] == 200, headers
        # a browser that says nothing of itself: at another address than this computer's, all do so
        old = {"User-Agent": "Mozilla/5.0 (Macintosh)"}
        for headers in (old, {"Cookie": "a=b"}, {**old, "Referer": "http://example.org/"}):
            assert page.command("M104 S300", **headers)[0] == 403, headers
            assert page.ask("/files?action=delete&filename=x", **headers)[0] == 403
        assert page.command("M106", **old, Referer=f"{here}/")[0] == 200
        gateway.wait("it has them", lambda: printer.lines == 3 * [b"M105"] + [b"M106"])
        for origin, good in ((here, True), ("http://example.org", False), (f"http://{house.console}:{PAGES + 2}", False)):
            answer = upgrade(house, origin)
            assert answer.startswith(b"HTTP/1.1 101" if good else b"HTTP/1.1 403"), answer


def upgrade(house, origin):
    """The answer to a web socket's request."""
    one = socket.create_connection((house.console, PAGES + 1), timeout=PATIENCE)
    one.sendall(f"GET / HTTP/1.1\r\nHost: {house.console}:{PAGES + 1}\r\nOrigin: {origin}\r\nUpgrade: websocket\r\n"
                "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: webui-v3\r\n"
                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode())
    answer = one.recv(4096)
    one.close()
    return answer


def test_log_in():
    secret = subprocess.run([rig.PYTHON, "-c", "from pokeys_gateway.access import make_secret as make\n"
                             "print(make('printer!!'))"], capture_output=True, text=True, check=True,
                            env={**os.environ, **rig.environment()}).stdout.strip()
    with bridge(level=None, users=f"anna:user:{secret}\nadmin:admin:{secret}\n") as (house, gateway, printer):
        page = Page(house)
        assert page.ask("/")[0] == 200 and page.ask("/preferences.json")[0] == 401 and page.files(path="/")[0] == 401
        assert page.command("M105")[0] == 401 and page.command("[ESP800]json=yes")[0] == 401
        status, body = page.ask("/login")
        assert (status, json.loads(body)) == (401, {"status": "Wrong authentication!", "authentication_lvl": "guest"})

        def log_in(**fields):
            status, body = page.ask("/login", "POST", urllib.parse.urlencode(fields),
                                    Content_Type="application/x-www-form-urlencoded")
            return status, json.loads(body)["authentication_lvl"]
        assert log_in(SUBMIT="YES", USER="anna", PASSWORD="wrong") == (401, "guest")
        assert log_in(SUBMIT="YES", USER="anna", PASSWORD="printer!!") == (200, "user")
        # the gateway's other page has a cookie of its own
        assert page.cookie.startswith("pokeys-console="), page.cookie
        assert page.command("M105")[0] == 200 and json.loads(page.ask("/login")[1])["authentication_lvl"] == "user"
        assert page.command("[ESP444]RESTART json")[0] == 401
        assert log_in(NEWPASSWORD="another one") == (500, "user")
        # a user does not change what others' browsers run
        for name in "index_html", "a_HTM", "a_svg", "a_js_gz", "a_xml":
            assert page.upload("/", **{name: b"<script>"})[0] == 401, name
        assert page.upload("/", part_gcode=b"G28\n")[0] == 200
        assert log_in(DISCONNECT="YES") == (401, "guest") and page.command("M105")[0] == 401
        assert log_in(SUBMIT="YES", USER="admin", PASSWORD="printer!!") == (200, "admin")
        assert page.upload("/", index_html=b"<p>")[0] == 200
        gateway.wait("it has it", lambda: printer.lines == [b"M105"])


async def sockets(house, gateway, printer):
    import websockets

    def connect(protocol, port):
        return websockets.connect(f"ws://{house.console}:{port}/", subprotocols=[protocol], ping_interval=None)

    async def hears(one, size):
        found = b""
        while len(found) < size:
            data = await asyncio.wait_for(one.recv(), PATIENCE)
            found += data if isinstance(data, bytes) else data.encode()
        return found
    one, two = await connect("webui-v3", PAGES + 1), await connect("webui-v3", PAGES)
    for page in one, two:
        assert page.subprotocol == "webui-v3"
        said = [await asyncio.wait_for(page.recv(), PATIENCE) for _ in range(2)]
        number = said[0].partition(":")[2]
        assert said == [f"currentID:{number}", f"activeID:{number}"] and number.isdigit()
    await one.send("PING:none")
    assert re.fullmatch(r"PING:43200000:43200000", await asyncio.wait_for(one.recv(), PATIENCE))
    data = await connect("arduino", PAGES + 1)
    await data.send("M1")
    await data.send("05\n")
    answer = b"ok T:21.3 /0.0\n"
    assert await hears(one, len(answer)) == await hears(two, len(answer)) == await hears(data, len(answer)) == answer
    await data.send(b"[ESP500]\n")
    assert await asyncio.wait_for(data.recv(), PATIENCE) == "user\n"
    # a page that is frozen: nobody else notices
    slow = socket.socket()
    slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    slow.connect((house.console, PAGES + 1))
    frozen = await websockets.connect(f"ws://{house.console}:{PAGES + 1}/", subprotocols=["webui-v3"], ping_interval=None,
                                      sock=slow)
    frozen.transport.pause_reading()
    size = sum(len(f"echo: setting {number} of a long list\n") for number in range(10_000))
    for _ in range(3):
        await data.send("M503\n")
        for page in one, two, data:
            text = await hears(page, size)
            assert len(text) == size and b"[dropped" not in text
    await asyncio.to_thread(gateway.wait, "it has missed some", lambda: console(gateway, "dropped_total") > 0)
    frozen.transport.resume_reading()
    text = b""
    while not text.endswith(b"setting 9999 of a long list\n") or count(text) < 30_000:
        found = await asyncio.wait_for(frozen.recv(), PATIENCE)
        text += found if isinstance(found, bytes) else b""
    assert count(text) == 30_000
    for page in one, two, data, frozen:
        await page.close()
    # there is a limit, and then room again
    many = [await connect("webui-v3", PAGES + 1) for _ in range(64)]
    with contextlib.suppress(websockets.exceptions.InvalidHandshake):
        await connect("webui-v3", PAGES + 1)
        raise AssertionError("one too many")
    for page in many:
        await page.close()
    await asyncio.to_thread(gateway.wait, "there is room", lambda: console(gateway, "clients") == 0)
    await (await connect("webui-v3", PAGES + 1)).close()
    await asyncio.to_thread(quiet, gateway)
    assert printer.lines.count(b"M105") == 1


def count(text):
    """The lines, those that were dropped included."""
    lines = text.splitlines()
    return sum(int(line[9:-1]) if line.startswith(b"[dropped") else 1 for line in lines)


def test_web_sockets():
    try:
        import websockets  # noqa: F401
    except ImportError as error:
        raise Skip(f"{error} (Debian: python3-websockets)") from None
    with bridge() as (house, gateway, printer):
        asyncio.run(sockets(house, gateway, printer))


def test_whoever_is_gone_is_not_obeyed():
    with bridge() as (house, gateway, printer):
        printer.reading.clear()
        for _ in range(6):
            one = socket.create_connection((house.console, PAGES), timeout=PATIENCE)
            body = "cmd=" + 8000 * "G1%0A"
            one.sendall(f"POST /command HTTP/1.1\r\nHost: {house.console}:{PAGES}\r\nContent-Length: {len(body)}\r\n"
                        f"Content-Type: application/x-www-form-urlencoded\r\n\r\n{body}".encode())
            gateway.wait("it waits", lambda: console(gateway, "clients") == 1)
            one.close()
            gateway.wait("it is gone", lambda: console(gateway, "clients") == 0)
        printer.reading.set()
        other = Telnet(house)
        other.send(b"M115\n")
        gateway.wait("it reads again", lambda: b"M115" in printer.lines)
        assert len(printer.lines) < 30_000, len(printer.lines)
        quiet(gateway)


def test_files():
    with bridge(level="admin") as (house, gateway, _printer):
        page, folder = Page(house), house.folder / "files"
        assert b"copy index.html.gz" in page.ask("/")[1]
        status, body = page.upload("/", index_html_gz=gzip.compress(b"<p>a page"), part_gcode=b"G28\n")
        found = json.loads(body)
        assert status == 200 and found["status"] == "index.html.gz, part.gcode uploaded", found
        assert [(one["name"], one["size"]) for one in found["files"]] == [("index.html.gz", found["files"][0]["size"]),
                                                                         ("part.gcode", "4 B")]
        status, body = page.ask("/")
        assert (status, page.headers["Content-Encoding"], gzip.decompress(body)) == (200, "gzip", b"<p>a page")
        assert "unsafe-inline" in page.headers["Content-Security-Policy"]
        assert page.ask("/part.gcode") == (200, b"G28\n")
        big = bytes(range(256)) * (24 << 10)
        assert page.upload("/", big_bin=big)[0] == 200 and page.ask("/big.bin")[1] == big
        assert json.loads(page.files(path="/", action="list")[1])["status"] == "ok"
        # folders
        found = json.loads(page.files(path="/", action="createdir", filename="parts")[1])
        assert found["status"] == "parts created" and found["files"][0] == {"name": "parts", "size": "-1", "time": ""}
        # many at once are all there, and too many are none
        many = {f"m{number}_gcode": b"G1" for number in range(65)}
        assert b"at most 64 files" in page.upload("/", **many)[1]
        assert not [one for one in names(page.files(path="/")) if one.startswith("m")]
        many.popitem()
        assert page.upload("/", **many)[0] == 200
        assert len([one for one in names(page.files(path="/")) if one.startswith("m")]) == 64
        for name in many:
            assert page.files(path="/", action="delete", filename=name.replace("_", "."))[0] == 200
        status, body = page.upload("/parts/", a_gcode=b"G1\n")
        assert status == 200, body
        assert [one["name"] for one in json.loads(page.files(path="/parts")[1])["files"]] == ["a.gcode"]
        assert page.files(path="/", action="deletedir", filename="parts")[0] == 500
        assert json.loads(page.files(path="/parts", action="delete", filename="a.gcode")[1])["files"] == []
        assert json.loads(page.files(path="/", action="deletedir", filename="parts", quiet="yes")[1]) == {
            "status": "parts deleted"}
        # no path leaves the folder
        (house.folder / "secret").write_text("secret", encoding="ascii")
        os.symlink(house.folder / "secret", folder / "link")
        os.symlink(house.folder, folder / "up")
        os.mkfifo(folder / "pipe")
        for path in "/../secret", "/..%2fsecret", "/link", "/up/secret", "/%2e%2e/secret", "/pipe", "/%00", "/nothing", "/up":
            assert page.ask(path)[0] in (404, 400), path
        for folder_asked in "/..", "../", "/up", "/up/..", "\0":
            assert page.files(path=folder_asked)[0] in (404, 500), folder_asked
            assert page.files(path=folder_asked, action="delete", filename="secret")[0] in (404, 500)
            assert page.form([("path", None, folder_asked.encode()), ("myfiles", "x", b"x")])[0] in (404, 500)
        assert page.files(path="/", action="createdir", filename="a\nb")[0] == 500
        assert page.form([("myfiles", "/n\udcff", b"x")])[0] == 500 and not list(folder.glob("n*"))
        assert page.files(path="/", action="deletedir", filename=".")[0] == 500 and folder.is_dir()
        assert page.ask("/part.gcode", "HEAD")[0] == 405
        (folder / "n\udcff").write_text("", encoding="ascii")
        assert "n\ufffd" in Telnet(house).ask("[ESP720]json")
        (folder / "n\udcff").unlink()
        for name in "/../x", "../x", "/up/x", "/", "", "/link", 300 * "n":
            assert page.form([("path", None, b"/"), ("myfiles", name or "/", b"x")])[0] in (404, 500), name
        assert (house.folder / "secret").read_text(encoding="ascii") == "secret" and not (house.folder / "x").exists()
        # what is not complete is not kept
        before = sorted(os.listdir(folder))
        assert page.form([("path", None, b"/"), ("/shortS", None, b"10"), ("myfiles", "/short", b"x")])[0] == 500
        assert page.form([("path", None, b"/"), ("/longS", None, b"9999999999"), ("myfiles", "/long", b"x")])[0] == 413
        one = socket.create_connection((house.console, PAGES), timeout=PATIENCE)
        one.sendall(f"POST /files HTTP/1.1\r\nHost: {house.console}:{PAGES}\r\nContent-Length: 100000\r\nContent-Type: "
                    f"multipart/form-data; boundary={BOUNDARY}\r\n\r\n--{BOUNDARY}\r\nContent-Disposition: form-data; "
                    'name="f"; filename="/half"\r\n\r\nhalf of it'.encode())
        gateway.wait("it has begun", lambda: any(name.startswith(".upload-") for name in os.listdir(folder)))
        assert not any(one["name"].startswith(".upload-") for one in json.loads(page.files(path="/")[1])["files"])
        one.close()
        # without the last boundary, and one that comes in small pieces
        head = f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="f"; filename="/%s"\r\n\r\n'
        status, _ = page.ask("/files", "POST", (head % "open").encode() + b"G28\n" + f"\r\n--{BOUNDARY}".encode(),
                             Content_Type=f"multipart/form-data; boundary={BOUNDARY}")
        assert status == 400 and not (folder / "open").exists()
        body = (head % "one").encode() + b"G28\r\n" + (head % "two").encode() + f"G29\r\n--{BOUNDARY}--\r\n".encode()
        slow = socket.create_connection((house.console, PAGES), timeout=PATIENCE)
        slow.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        slow.sendall(f"POST /files HTTP/1.1\r\nHost: {house.console}:{PAGES}\r\nContent-Length: {len(body)}\r\nContent-Type: "
                     f"multipart/form-data; boundary={BOUNDARY}\r\n\r\n".encode())
        for at in range(0, len(body), 7):
            slow.sendall(body[at:at + 7])
            time.sleep(0.005)
        assert slow.recv(4096).startswith(b"HTTP/1.1 200")
        slow.close()
        assert [(folder / name).read_bytes() for name in ("one", "two")] == [b"G28", b"G29"]
        for name in "one", "two":
            page.files(path="/", action="delete", filename=name)
        for body in b"garbage", b"--x\r\n\r\n":
            for path in "/files", "/login":
                assert page.ask(path, "POST", body, Content_Type="multipart/form-data; boundary=y")[0] == 400, (path, body)
        gateway.wait("nothing is left", lambda: sorted(os.listdir(folder)) == before)
        # several at once
        threads = [threading.Thread(target=Page(house).upload, args=("/",), kwargs={f"at_{number}": big}, daemon=True)
                   for number in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE)
        assert all((folder / f"at.{number}").read_bytes() == big for number in range(3))
        assert page.files(path="/", action="format", filename="x")[0] == 500
        assert page.files(path="/", action="delete", filename="none") == (404, b"error: /none: No such file or directory\n")
        other = Telnet(house)
        assert [other.ask(f"[ESP730]{text}") for text in ("mkdir=/of\\ one", "create=/of\\ one/a", "exists=/of\\ one/a")] == [
            "ok", "ok", "yes"]
        assert json.loads(other.ask("[ESP720]/of\\ one json"))["data"]["files"][0]["name"] == "a"
        assert other.ask("[ESP740]/of\\ one") == "Directory on Flash : /of one"
        assert other.line().startswith("     \ta \t0 B \t20") and other.line().startswith("Used ")
        assert other.ask("[ESP750]rmdir=/of\\ one") == "error: /of one: Directory not empty"
        assert [other.ask(f"[ESP790]{text}") for text in ("remove=/of\\ one/a", "rmdir=/of\\ one", "exists=/of\\ one")] == [
            "ok", "ok", "no"]
        assert other.ask("[ESP730]remove=/../secret") == "error: /../secret: No such file or directory"
        assert other.ask("[ESP730]").startswith("error: [ESP730] takes one of rmdir=PATH")
        one = Telnet(house)
        assert (one.ask("[ESP121]"), one.ask("[ESP160]"), one.ask("[ESP161]")) == (str(PAGES), "ON", str(PAGES + 1))


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=2))
