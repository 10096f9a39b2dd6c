#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Users, sessions, tickets and TLS: who has not logged in reads nothing, and nothing is open to other computers by
mistake. In a network namespace of its own, whose second address stands for that of a network."""
import asyncio
import base64
import contextlib
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import ssl
import subprocess
import sys

from rig import PATIENCE, PYTHON, House, Skip, environment, need_libraries, run_in_fork
from house import equal, main, wait_equal, wait_for  # noqa: E402  (rig.py finds it)

try:
    import aiohttp
except ImportError:
    aiohttp = None

NEAR, FAR, PROXY, STRANGER = "127.0.0.1", "10.99.0.1", "10.99.0.2", "10.99.0.3"
PORT = 8580
PASSWORD = "correct horse"
WORD = "certificate read again|the certificate stays as it was"


def sh(*words, **options):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, timeout=PATIENCE,
                          **options)


def program(*words, given=None):
    """The gateway's program, to its end."""
    from pokeys_gateway import __main__
    return run_in_fork(__main__.main, *words, given=given or "")


class Place:
    """A folder with a configuration, users and a certificate."""

    def __init__(self, folder, runtime):
        self.folder, self.runtime = folder, runtime
        self.conf, self.users = folder / "gateway.conf", folder / "gateway.users"
        self.certificate, self.key = folder / "certificate.pem", folder / "key.pem"
        self.write()

    def write(self, http="", access=""):
        self.conf.write_text(f"[gateway]\nruntime-directory = {self.runtime}\n[http]\n{http}\n[access]\n"
                             f"users = {self.users}\n{access}\n", encoding="utf-8")

    def set_user(self, name, level, password=PASSWORD):
        ran = program("--config", self.conf, "--set-user", name, "--level", level, given=f"{password}\n")
        equal((ran.returncode, ran.stderr), (0, ""))
        assert f"{name} is {level}" in ran.stdout, ran.stdout

    def certify(self):
        ran = sh("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days",
                 "2", "-subj", "/CN=mill", "-addext", f"subjectAltName=IP:{FAR},DNS:mill.example", "-keyout", self.key, "-out",
                 self.certificate)
        equal(ran.returncode, 0, ran.stderr)

    def faults(self):
        ran = program("--config", self.conf, "--check-config")
        equal(ran.returncode, 78 if ran.stderr else 0, ran)
        return [line.removeprefix("pokeys-gateway: ").removeprefix(f"{self.folder}/") for line in
                ran.stderr.splitlines()]


class Server:
    """A gateway with that configuration."""

    def __init__(self, house, place):
        self.house, self.place = house, place
        self.child = house.spawn("python", "-B", House.programs["pokeys-gateway"], "--config", place.conf,
                                 log="gateway.log", env={**os.environ, **environment()})
        wait_for("the gateway", lambda: "the page is at" in house.log("gateway.log") and self.ask("/healthz")[0] == 200,
                 say=lambda: house.log("gateway.log"))

    def connect(self, host=NEAR, tls=False, source=None):
        source = source and (source, 0)
        if tls:
            return http.client.HTTPSConnection(host, PORT, timeout=PATIENCE, source_address=source, context=ssl.
                                               create_default_context(cafile=self.place.certificate))
        return http.client.HTTPConnection(host, PORT, timeout=PATIENCE, source_address=source)

    def ask(self, path, method="GET", body=None, cookie=None, basic=None, where=None, **headers):
        """Status, headers and document (or text) of an answer."""
        headers = {name.replace("_", "-"): value for name, value in headers.items()}
        if cookie:
            headers["Cookie"] = cookie
        if basic:
            headers["Authorization"] = "Basic " + base64.b64encode(":".join(basic).encode()).decode()
        if body is not None:
            headers.setdefault("Content-Type", "application/json")
        connection = self.connect(**(where or {}))
        try:
            connection.request(method, path, body=body if body is None or isinstance(body, str) else json.dumps(body),
                               headers=headers)
            answer = connection.getresponse()
            text = answer.read().decode()
            kind = answer.getheader("Content-Type", "")
            return answer.status, dict(answer.getheaders()), json.loads(text) if "json" in kind else text
        finally:
            connection.close()

    def log_in(self, name, password=PASSWORD, **how):
        """The cookie, and what was said of it."""
        status, headers, document = self.ask("/api/log-in", "POST", {"name": name, "password": password}, **how)
        equal((status, document["user"]), (200, name), document)
        return headers["Set-Cookie"].partition(";")[0], headers["Set-Cookie"], document

    def hang_up(self):
        said = self.house.log("gateway.log")
        before = len(re.findall(WORD, said))
        self.child.send_signal(signal.SIGHUP)
        wait_equal("the reload", lambda: len(re.findall(WORD, self.house.log("gateway.log"))), before + 1)


@contextlib.contextmanager
def machine(http="", access="", **users):
    if not aiohttp:
        raise Skip("python3-aiohttp is not installed")
    need_libraries()
    with House() as house:
        house.device_keys["mill"] |= {"lost-after-ms": 5000, "stale-after-ms": 4000}
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        place = Place(house.folder, house.runtime)
        place.certify()
        for name, level in users.items():
            place.set_user(name, level)
        place.write(http, access)
        yield house, place, Server(house, place)
        assert "Traceback" not in house.log("gateway.log"), house.log("gateway.log")


TLS = f"listen = {NEAR}:{PORT}, {FAR}:{PORT}\ncertificate = {{0}}/certificate.pem\nkey = {{0}}/key.pem"


# ---- the configuration

def test_nothing_is_open_to_others_by_mistake():
    with House() as house:
        place = Place(house.folder, house.runtime)
        place.certify()
        far = f"listen = {FAR}:{PORT}"
        tls = f"certificate = {place.certificate}\nkey = {place.key}"
        place.users.touch(0o600)
        nobody, plain = "there are no users; pokeys-gateway --set-user NAME makes one", "sent as plain text; set certificate"
        for http, said in ((far, [(4, nobody), (4, plain)]), (f"{far}\n{tls}", [(4, nobody)]),
                           (f"{far}\nplaintext = yes", [(4, nobody)])):
            place.write(http)
            found = place.faults()
            equal([int(line.split(":")[1]) for line in found], [line for line, _ in said], found)
            assert all(text in line for line, (_, text) in zip(found, said, strict=True)), found
        place.write(f"behind-proxy = {NEAR}")
        assert "a proxy lets others in, and there are no users" in place.faults()[0], place.faults()
        place.users.unlink()
        place.write()
        assert f"there is no file {place.users}; pokeys-gateway --set-user NAME makes it" in place.faults()[0]
        place.set_user("anna", "user")
        mode = place.users.stat().st_mode & 0o777
        equal((mode & 0o027, PASSWORD in place.users.read_text()), (0, False))
        for http, said in ((far, plain), (f"{far}\ncertificate = {place.certificate}", "certificate: key is missing"),
                           (f"key = {place.key}", "key: certificate is missing"),
                           (f"{far}\ncertificate = /nowhere.pem\nkey = {place.key}", "/nowhere.pem: No such file"),
                           (f"{far}\ncertificate = {place.key}\nkey = {place.key}", "no certificate with the key"),
                           (f"{far}\nbehind-proxy = mill", "allowed: addresses, such as 192.168.1.2"),
                           (f"{far}\nbehind-proxy = fe80::1%lo", "allowed: addresses, such as 192.168.1.2"),
                           (f"{far}\nplaintext = maybe", "allowed: yes, no"),
                           (f"{far}\n{tls}", ""), (f"{far}\nplaintext = yes", ""), (f"{far}\nbehind-proxy = {PROXY}", "")):
            place.write(http)
            found = place.faults()
            assert (said in "\n".join(found)) if said else not found, (http, found)
        # the command line is judged as the file is
        place.write()
        ran = program("--config", place.conf, "--listen", f"0.0.0.0:{PORT}", "--check-config")
        equal(ran.returncode, 64)
        assert ran.stderr.startswith(f"pokeys-gateway: --listen: 0.0.0.0:{PORT} is reached from other"), ran.stderr
        for text, said in (("anna\n", "gateway.users:1: expected NAME:LEVEL:SECRET"), ("anna:user:x\n", ":1: the secret is"),
                           ("\nAnna:user:x\n", ":2: expected"), ("anna:root:x\n", "the level one of guest, user, admin"),
                           ("anna:user:scrypt$40$8$1$AAAA$AAAA\n", "the secret is not one")):
            place.users.write_text(text)
            assert said in place.faults()[0], place.faults()
        place.users.write_text("")
        for mode in 0o644, 0o660:
            place.users.chmod(mode)
            assert "others may read or change it; chown root" in place.faults()[0], place.faults()


def test_users_are_made_and_removed():
    with House() as house:
        place = Place(house.folder, house.runtime)
        need_libraries()
        for words, given, said in ((("--set-user", "anna"), "short\n", "a password has 8 to 256 characters"),
                                   (("--set-user", "Anna"), f"{PASSWORD}\n", '"Anna" is not allowed; allowed: a to z'),
                                   (("--remove-user", "anna"), "", "there is no user anna in ")):
            ran = program("--config", place.conf, *words, given=given)
            equal((ran.returncode, ran.stdout, ran.stderr.count("\n")), (1, "", 1), ran)
            assert said in ran.stderr, ran
        assert not place.users.exists()
        for words, said in ((("--set-user", "anna", "--remove-user", "otto"), "not allowed with argument"),
                            (("--level", "user"), "--level is for --set-user"), (("--set-user", ""), '"" is not allowed')):
            ran = program("--config", place.conf, *words, given=f"{PASSWORD}\n")
            assert ran.returncode in (1, 64) and said in ran.stderr, (words, ran)
        place.set_user("anna", "user")
        place.set_user("otto", "guest")
        first = place.users.read_text()
        # another password, the same level
        ran = program("--config", place.conf, "--set-user", "anna", given="another one\n")
        assert "anna is user" in ran.stdout and place.users.read_text() != first, ran
        equal(program("--config", place.conf, "--remove-user", "otto").returncode, 0)
        place.users.rename(place.folder / "real.users")
        place.users.symlink_to("real.users")
        place.set_user("anna", "user")
        assert place.users.is_symlink()
        equal(re.findall(r"^(\w+):(\w+):scrypt", place.users.read_text(), re.M), [("anna", "user")])
        equal(sorted(path.name for path in place.folder.iterdir() if "users" in path.name),
              ["gateway.users", "real.users"])
        ran = program("--config", place.conf, "--remove-user", "anna")
        assert "that was the last user: nobody can log in" in ran.stdout, ran


# ---- who is there

def test_who_has_not_logged_in_reads_nothing():
    with machine(anna="user", otto="guest") as (_house, _place, server):
        for path in ("/api/devices", "/api/devices/mill", "/api/devices/mill/events", "/metrics", "/api/names", "/websocket",
                     "/nowhere", "/api/openapi.json"):
            status, headers, document = server.ask(path)
            equal((status, "log-in is needed" in document["error"]["message"]), (401, True), path)
            assert headers["WWW-Authenticate"].startswith("Basic "), headers
        # the page has a form; a browser must not open its own
        for how in {"Sec_Fetch_Mode": "cors"}, {"Accept": "text/html,*/*"}, {"Cookie": "x=1"}:
            assert "WWW-Authenticate" not in server.ask("/api/devices", **how)[1], how
        for path in "/", "/healthz":
            assert server.ask(path)[0] in (200, 404), path
        equal(server.ask("/api/session")[2], {"format": 1, "required": True, "user": None, "level": None, "users": True,
                                             "plaintext": False})
        equal(server.ask("/api/ticket", "POST")[0], 401)
        # Basic, as scripts and Prometheus use it
        equal([server.ask(path, basic=("otto", PASSWORD))[0] for path in ("/api/devices", "/metrics")], [200, 200])
        for basic in ("otto", "wrong"), ("nobody", PASSWORD), ("otto", ""):
            equal(server.ask("/api/devices", basic=basic)[0], 401, basic)
        for header in "Basic !", "Basic " + base64.b64encode(b"otto").decode(), "Bearer x", "Basic " + "A" * 4000:
            equal(server.ask("/api/devices", Authorization=header)[0], 401, header)
        # a session, and its end
        cookie, flags, document = server.log_in("anna")
        assert "HttpOnly" in flags and "SameSite=Strict" in flags and "Secure" not in flags, flags
        equal((document["level"], server.ask("/api/session", cookie=cookie)[2]["user"]), ("user", "anna"))
        # whatever else a browser has for this computer
        for others in "", "a@b=1; ", "a,b=1; ", 'x={"a":1}; ':
            equal(server.ask("/api/devices", cookie=others + cookie)[0], 200, others)
        # a wrong password that a browser has kept is of no interest where there is none asked for, or a session
        for path, shown in ("/", None), ("/api/devices", cookie):
            assert server.ask(path, cookie=shown, basic=("anna", "wrong one"))[0] in (200, 404), path
        equal(server.ask("/api/log-in", "POST", {"name": "anna", "password": PASSWORD}, Origin="http://evil.example")[0], 403)
        equal(server.ask("/api/log-out", "POST", cookie=cookie)[0], 200)
        equal(server.ask("/api/devices", cookie=cookie)[0], 401)
        for body, kind in (("{", "application/json"), ("[]", "application/json"), ('{"name": "anna"}', "application/json"),
                           ('{"name": 1, "password": 2}', "application/json"), ("[" * 4000, "application/json"),
                           ("x" * 5000, "application/json"), ("name=anna&password=x", "application/x-www-form-urlencoded")):
            equal(server.ask("/api/log-in", "POST", body, Content_Type=kind)[0], 400, body[:30])
        # a password is guessed five times a minute, and others log in meanwhile
        tried = [server.ask("/api/log-in", "POST", {"name": "anna", "password": f"wrong {i}"}) for i in range(6)]
        equal((tried[0][0], tried[-1][0]), (401, 429), tried)
        assert 0 < int(tried[-1][1]["Retry-After"]) <= 60, tried[-1]
        equal(server.ask("/api/log-in", "POST", {"name": "anna", "password": PASSWORD})[0], 429)
        equal(server.ask("/api/devices", basic=("otto", PASSWORD))[0], 200)


async def ended(ws):
    """Its other side ends a connection."""
    message = await asyncio.wait_for(ws.receive(), PATIENCE)
    assert message.type in (aiohttp.WSMsgType.CLOSED, aiohttp.WSMsgType.ERROR), message


def test_web_sockets_belong_to_somebody():
    async def watch(server):
        async def open_with(session, **how):
            async with session.ws_connect(f"http://{NEAR}:{PORT}/websocket{how.pop('query', '')}", **how) as ws:
                await ws.send_json({"jsonrpc": "2.0", "id": 1, "method": "server.info"})
                found = (await asyncio.wait_for(ws.receive_json(), PATIENCE))["result"]
                return found["user"], found["level"]
        async with aiohttp.ClientSession() as session:
            cookie, *_ = await asyncio.to_thread(server.log_in, "anna")
            equal(await open_with(session, headers={"Cookie": cookie}), ("anna", "user"))
            equal(await open_with(session, auth=aiohttp.BasicAuth("otto", PASSWORD)), ("otto", "guest"))
            ticket = (await asyncio.to_thread(lambda: server.ask("/api/ticket", "POST", cookie=cookie)))[2]["ticket"]
            equal(await open_with(session, query=f"?ticket={ticket}"), ("anna", "user"))
            # the session's end is that of what it has opened
            async with session.ws_connect(f"http://{NEAR}:{PORT}/websocket", headers={"Cookie": cookie}) as ws:
                await ws.send_json({"jsonrpc": "2.0", "id": 1, "method": "objects.list"})
                await ws.receive_json()
                await asyncio.to_thread(lambda: server.ask("/api/log-out", "POST", cookie=cookie))
                await ended(ws)
            # it was for one; and nobody is nobody
            for query in f"?ticket={ticket}", "?ticket=x", "":
                try:
                    await open_with(session, query=query)
                except aiohttp.WSServerHandshakeError as error:
                    equal(error.status, 401)
                else:
                    raise AssertionError(query)
    with machine(anna="user", otto="guest") as (_house, _place, server):
        asyncio.run(asyncio.wait_for(watch(server), 2 * PATIENCE))


def test_guests_read_where_they_may():
    with machine(access="guests = yes", anna="admin") as (_house, _place, server):
        equal(server.ask("/api/devices")[0], 200)
        equal(server.ask("/api/session")[2]["level"], "guest")
        equal(server.ask("/api/session", cookie=server.log_in("anna")[0])[2]["level"], "admin")
        equal(server.ask("/api/devices", basic=("anna", "wrong one"))[0], 401)


# ---- other computers

def test_others_come_over_tls():
    with machine(anna="user") as (house, place, server):
        server.child.send_signal(signal.SIGTERM)
        equal(server.child.wait(PATIENCE), 0)
        place.write(TLS.format(place.folder))
        (place.folder / "gateway.log").unlink()
        server = Server(house, place)
        far = {"host": FAR, "tls": True}
        assert f"the page is at https://{FAR}:{PORT}/" in house.log("gateway.log"), house.log("gateway.log")
        equal(server.ask("/api/devices", where=far)[0], 401)
        cookie, flags, _ = server.log_in("anna", where=far)
        assert "Secure" in flags, flags
        equal(server.ask("/api/devices", cookie=cookie, where=far)[0], 200)
        equal(server.ask("/api/devices", cookie=cookie, where=far, Host=f"{NEAR}:1")[0], 200)
        for host in "mill.example", STRANGER:
            equal(server.ask("/api/devices", cookie=cookie, where=far, Host=host)[0], 403, host)
        # who speaks no TLS gets no answer
        with contextlib.suppress(ConnectionError, http.client.HTTPException):
            raise AssertionError(server.ask("/healthz", where={"host": FAR}))
        # a renewed certificate, without a restart; who looks at the page stays
        before = ssl.get_server_certificate((FAR, PORT))
        place.certify()
        server.hang_up()
        assert ssl.get_server_certificate((FAR, PORT)) != before
        equal(server.ask("/api/devices", cookie=cookie, where=far)[0], 200)
        # the gateway logs that a certificate is broken or has another key, and keeps the old one
        good, key, before = place.certificate.read_text(), place.key.read_text(), ssl.get_server_certificate((FAR, PORT))
        place.certify()
        for certificate in "nothing", place.certificate.read_text():
            place.certificate.write_text(certificate)
            place.key.write_text(key)
            server.hang_up()
            assert house.log("gateway.log").endswith("the certificate stays as it was\n"), house.log("gateway.log")
            equal(ssl.get_server_certificate((FAR, PORT)), before)
        place.certificate.write_text(good)
        equal(server.ask("/api/devices", cookie=cookie, where=far)[0], 200)
        # who begins a handshake and goes no further is one of a few, and is ended
        silent = []
        while len(silent) < 40:
            silent.append(socket.create_connection((FAR, PORT), timeout=PATIENCE, source_address=(STRANGER, 0)))
        for one in silent:
            with contextlib.suppress(ConnectionResetError):
                equal(one.recv(1), b"")
            one.close()
        equal(server.ask("/api/devices", cookie=cookie, where=far)[0], 200)


def reload(server, house):
    """SIGHUP, until the users have been read again."""
    before = house.log("gateway.log").count("users read again")
    server.child.send_signal(signal.SIGHUP)
    wait_equal("the reload", lambda: house.log("gateway.log").count("users read again"), before + 1)


def test_a_user_that_is_removed_is_gone_at_once():
    async def watch(house, place, server):
        cookie, *_ = await asyncio.to_thread(server.log_in, "anna")
        other, *_ = await asyncio.to_thread(server.log_in, "otto")
        async with aiohttp.ClientSession() as session, session.ws_connect(
                f"http://{NEAR}:{PORT}/websocket", headers={"Cookie": cookie}) as hers, session.ws_connect(
                f"http://{NEAR}:{PORT}/websocket", headers={"Cookie": other}) as his:
            await hers.send_json({"jsonrpc": "2.0", "id": 1, "method": "objects.list"})
            await hers.receive_json()
            # another password is another user
            place.set_user("anna", "user", "another one")
            await asyncio.to_thread(reload, server, house)
            await ended(hers)
            equal(program("--config", place.conf, "--remove-user", "anna").returncode, 0)
            await asyncio.to_thread(reload, server, house)
            await his.send_json({"jsonrpc": "2.0", "id": 1, "method": "objects.list"})
            equal((await his.receive_json())["result"], {"objects": ["mill"]})
        equal([server.ask("/api/devices", cookie=one)[0] for one in (cookie, other)], [401, 200])
        # a file that is broken, or lost, opens nothing
        place.users.write_text("otto\n")
        server.child.send_signal(signal.SIGHUP)
        await asyncio.to_thread(wait_for, "the complaint", lambda: "gateway.users:1: expected" in house.log("gateway.log"))
        equal(server.ask("/api/devices", cookie=other)[0], 200)
        place.users.unlink()
        await asyncio.to_thread(reload, server, house)
        equal([server.ask("/api/devices", cookie=one)[0] for one in (None, other)], [401, 401])
    with machine(anna="user", otto="guest") as (house, place, server):
        asyncio.run(asyncio.wait_for(watch(house, place, server), 2 * PATIENCE))


def test_behind_a_proxy_nobody_comes_past_it():
    with machine(http=f"listen = {NEAR}:{PORT}, {FAR}:{PORT}\nbehind-proxy = {PROXY}\nhost-names = mill.example",
                 anna="user") as (_house, _place, server):
        def through(source, **headers):
            return {"where": {"host": FAR, "source": source}, "Host": "mill.example", **headers}
        equal(server.ask("/healthz", **through(STRANGER))[0], 503)
        equal(server.ask("/healthz", **through(PROXY))[0], 200)
        _, flags, _ = server.log_in("anna", **through(PROXY, X_Forwarded_Proto="https"))
        assert "Secure" in flags, flags
        # the page's origin is what the browser sees of the proxy; other servers of that computer are other origins
        for origin, given, status in (("https://mill.example", {}, 200), ("https://mill.example:443", {}, 200),
                                      ("http://mill.example", {}, 403), ("https://mill.example:8443", {}, 403),
                                      ("https://mill.example:8443", {"Host": "mill.example:8443"}, 200),
                                      ("https://mill.example:8443", {"X_Forwarded_Host": "mill.example:8443"}, 200),
                                      ("https://mill.example", {"X_Forwarded_Host": "mill.example:8443"}, 403),
                                      # two proxies, one behind the other
                                      ("https://mill.example:8443", {"X_Forwarded_Host": "mill.example:8443, inner",
                                                                     "X_Forwarded_Proto": "HTTPS, http"}, 200),
                                      ("https://mill.example", {"Host": f"{FAR}:{PORT}"}, 200),
                                      ("https://mill.example:8443", {"Host": f"{FAR}:{PORT}"}, 403),
                                      ("https://evil.example", {"X_Forwarded_Host": "evil.example"}, 403),
                                      ("https://evil.example", {}, 403)):
            answer = server.ask("/healthz", **(through(PROXY, Origin=origin, X_Forwarded_Proto="https") | given))
            equal(answer[0], status, (origin, given))
            assert status == 200 or "X-Forwarded-Host" in json.dumps(answer[2]), answer
        # the limit is for each client behind the proxy, and only the proxy's word for the address counts
        wrong = {"name": "anna", "password": "wrong one"}
        for i in range(5):
            server.ask("/api/log-in", "POST", wrong, **through(PROXY, X_Forwarded_For="1.1.1.1, 192.0.2.7"))
        equal([server.ask("/api/log-in", "POST", wrong, **through(PROXY, X_Forwarded_For=one))[0]
               for one in ("192.0.2.7", "192.0.2.8")], [429, 401])
        for i in range(4):
            server.ask("/api/log-in", "POST", wrong, X_Forwarded_For=f"192.0.2.{i}")
        equal([server.ask("/api/log-in", "POST", wrong, X_Forwarded_For=f"192.0.2.{i}")[0] for i in (100, 101)], [401, 429])


# ---- in virtual time

def test_sessions_and_tickets_end():
    if not aiohttp:
        raise Skip("python3-aiohttp is not installed")
    from pokeys_gateway import access
    now = 1000.0
    users = {name: access.User(name, "user", access.make_secret(PASSWORD)) for name in ("anna", "otto")}
    one = access.Access(users, False, lambda: now)

    async def log_in(name="anna", password=PASSWORD, address="x"):
        return (await one.log_in(name, password, address))[0]
    token = asyncio.run(log_in())
    for _ in range(3):
        now += access.SESSION_S - 1
        equal(one.session(token).name, "anna", "it is used")
    now += access.SESSION_S + 1
    equal(one.session(token), None)
    ticket = one.ticket(access.Who(users["anna"]))
    now += access.TICKET_S + 1
    equal(one.redeem(ticket), None)
    # there are so many, and the oldest goes
    tickets = [one.ticket(access.Who(users["anna"])) for _ in range(access.SESSIONS_MOST + 1)]
    equal([one.redeem(tickets[i]) is not None for i in (0, 1, -1, -1)], [False, True, True, False])

    # one that asks for many takes them from nobody else
    ottos = one.ticket(access.Who(users["otto"]))
    for _ in range(2 * access.SESSIONS_MOST):
        one.ticket(access.Who(None))
    equal(one.redeem(ottos).name, "otto")

    async def attempts():
        nonlocal now
        results = []
        for i in range(access.ATTEMPTS + 2):
            try:
                await log_in(password=f"wrong {i}")
            except access.Denied:
                results.append("denied")
            except access.TooMany as error:
                results.append(round(error.after))
        equal(results, ["denied"] * access.ATTEMPTS + [round(access.WINDOW_S)] * 2)
        now += access.WINDOW_S + 1
        assert await log_in()
        equal(one.denied, access.ATTEMPTS)
    asyncio.run(attempts())

    # a program that asks for much at once, with the same password, makes one attempt
    async def together(password, wanted):
        nonlocal now
        now += access.WINDOW_S + 1
        before = one.denied
        found = await asyncio.gather(*(log_in(password=password) for _ in range(50)), return_exceptions=True)
        equal({type(each) for each in found}, {wanted})
        equal(one.denied - before, int(wanted is access.Denied))
        equal(len(one._together), 0)  # pylint: disable=protected-access
    asyncio.run(together(PASSWORD, str))
    asyncio.run(together("wrong", access.Denied))
    # no name that is tried is kept for ever
    async def names():
        for i in range(access.ADDRESSES_MOST + 10):
            one._few.take(f"a{i}", "b")  # pylint: disable=protected-access
        assert len(one._few._of) <= access.ADDRESSES_MOST  # pylint: disable=protected-access
    asyncio.run(names())
    # the same password, written down twice, is two secrets
    assert users["anna"].secret != users["otto"].secret


def inside():
    """In a network namespace with these addresses, or not at all."""
    if os.environ.get("POKEYS_USERS_INSIDE"):
        sh("ip", "link", "set", "lo", "up")
        for address in FAR, PROXY, STRANGER:
            ran = sh("ip", "address", "add", f"{address}/32", "dev", "lo")
            equal(ran.returncode, 0, ran.stderr)
        return
    way = next((words for words in (("unshare", "--net"), ("unshare", "--net", "--map-root-user"))
                if sh(*words, "true").returncode == 0), None)
    if not way:
        print("not tried: no network namespace may be made here", file=sys.stderr)
        sys.exit(77)
    os.environ["POKEYS_USERS_INSIDE"] = "1"
    os.execvp(way[0], [*way, PYTHON, "-B", *sys.argv])


if __name__ == "__main__":
    inside()
    House.programs |= {"python": pathlib.Path(PYTHON)}
    sys.exit(main(sys.modules[__name__], beside=1))
