#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Daemon and guard on interfaces of every kind that this kernel has, and what may happen
to an interface while they run: after it everything is as before, without a restart.
A kind that this kernel does not have is named.
Arguments: as guard.py.
"""
import fcntl
import re
import struct
import sys

from guard import DEVICE, HERE, MOVED, PORT, STATUS, STRANGER, far, main, program_on, send_far, sh, wait_for, \
    whole_checksums

ALL = (DEVICE, STRANGER, MOVED)
BEYOND = "10.99.0.1"
NOBODY = "10.77.0.99"
# soon lost, so that the way to it is looked for anew
HASTY = "lost-after-ms = 300\n"
SLOW = {"period-us": 4000}  # for an emulated machine as well


def runs(w, daemon, least=100):
    """Fresh, and more replies than now."""
    try:
        wait_for("fresh data", lambda: daemon.poll() is not None or w.fresh())
        before = w.state()["statistics"]["accepted"]
        wait_for("replies", lambda: w.state()["statistics"]["accepted"] > before + least)
    except (AssertionError, KeyError):
        print(daemon.log.read_text(), sh("ip", "address").stdout, sh("ss", "-uan").stdout, flush=True)
        raise


def grows(w, counter):
    before = w.counters()[counter]
    wait_for(f"{counter} to grow", lambda: w.counters()[counter] > before + 100)


def flood_is_counted(w):
    got = w.counted(lambda: send_far(STRANGER, PORT, 50, bytes(64)), drop_foreign=50)
    assert got.get("drop_foreign") == 50, got


def bound_to():
    """The interfaces that the daemon's sockets to the device are bound to."""
    return set(re.findall(rf"{re.escape(HERE)}(?:%(\S+?))?:\d+\s+{re.escape(DEVICE)}:{PORT}",
                          sh("ss", "-Huan").stdout))


# What may happen to an interface, up to a yield and back again.

def down(_w):
    sh("ip", "link", "set", "pk0", "down")
    yield
    sh("ip", "link", "set", "pk0", "up")


def carrier_lost(_w):
    far("ip", "link", "set", "pk1", "down")
    yield
    far("ip", "link", "set", "pk1", "up")


def without_address(_w):
    sh("ip", "addr", "flush", "dev", "pk0")
    yield
    sh("ip", "addr", "add", f"{HERE}/24", "broadcast", "+", "dev", "pk0")


def rename(before, after):
    sh("ip", "link", "set", before, "down")
    sh("ip", "link", "set", before, "name", after)
    sh("ip", "link", "set", after, "up")


def renamed(w):
    """The device is lost while the interface is down, and not looked for at one of another name."""
    def times_said():
        return w.children[-1].log.read_text().count("the interface is not there")

    sh("ip", "link", "set", "pk0", "down")
    yield
    before = times_said()
    sh("ip", "link", "set", "pk0", "name", "pkx")
    sh("ip", "link", "set", "pkx", "up")
    wait_for("the daemon to say so", lambda: times_said() > before)
    assert w.lost() and not bound_to(), (w.state(), bound_to())
    rename("pkx", "pk0")


def renamed_at_once(_w):
    """So fast that the daemon may not have noticed it, and goes on."""
    rename("pk0", "pkx")
    yield
    rename("pkx", "pk0")


def deleted(w):
    sh("ip", "link", "del", "pk0")
    yield
    w.connect()
    whole_checksums()


def other_mtu(_w):
    sh("ip", "link", "set", "pk0", "mtu", 1200)
    yield
    sh("ip", "link", "set", "pk0", "mtu", 1500)


def other_mac(_w):
    sh("ip", "link", "set", "pk0", "address", "02:00:00:00:07:01")
    yield


def other_device_mac(_w):
    """Another one at the same place, which does not announce itself: the kernel notices by itself."""
    # as always, but some times faster
    sh("ip", "ntable", "change", "name", "arp_cache", "dev", "pk0", "base_reachable", "1000", "retrans", "100",
       "delay_probe", "200")
    sh("ip", "neigh", "flush", "dev", "pk0")
    wait_for("a new entry", lambda: "lladdr" in sh("ip", "neigh", "show", DEVICE).stdout)
    far("ip", "link", "set", "pk1", "address", "02:00:00:00:07:02")
    yield


LOSSES = (down, carrier_lost, without_address, renamed, deleted)
# deleted twice: a socket's binding has to be renewed each time
EVENTS = (*LOSSES, deleted, renamed_at_once, other_mtu, other_mac, other_device_mac)


def happens(w, event, daemon, sim):
    """The event, what holds while it lasts, and the way back. The simulator, which may be another."""
    steps = event(w)
    next(steps)
    if event in LOSSES:
        wait_for(f"{event.__name__}: the device lost", w.lost)
    for _ in steps:
        pass
    if event is deleted:  # its socket was on the far end
        w.end(sim)
        sim = w.start_sim()
    runs(w, daemon)
    wait_for(f"{event.__name__}: the guard", lambda: sh(w.guard_exe, "status", check=False).returncode == 0)
    wait_for(f"{event.__name__}: a socket bound to pk0 and none to another", lambda: bound_to() == {"pk0"})
    flood_is_counted(w)
    return sim


def whatever_happens_to_an_interface_passes(w):
    for transport in ("auto", "socket", "xdp"):
        w.write_conf(f"address = {DEVICE}\n{HASTY}", transport=transport, **SLOW)
        whole_checksums()
        w.start_guard()
        sim, daemon = w.start_sim(), w.start_daemon()
        runs(w, daemon)
        for event in EVENTS:
            sim = happens(w, event, daemon, sim)
            if transport == "xdp":
                grows(w, "pass_socket")
        assert w.end(daemon) == 0, daemon.log.read_text()
        w.end(sim)
        w.end_guard()


def daemon_that_comes_before_the_address_finds_its_device(w):
    """As with DHCP, when a machine starts."""
    for transport in ("auto", "socket", "xdp"):
        w.write_conf(f"address = {DEVICE}\n{HASTY}", transport=transport, **SLOW)
        whole_checksums()
        w.start_guard()
        sh("ip", "addr", "flush", "dev", "pk0")
        sim, daemon = w.start_sim(), w.start_daemon()
        wait_for("the daemon to say so", lambda: "has no address of its own" in daemon.log.read_text())
        sh("ip", "addr", "add", f"{HERE}/24", "broadcast", "+", "dev", "pk0")
        runs(w, daemon)
        assert daemon.log.read_text().count("has no address") == 1, daemon.log.read_text()
        w.end(daemon)
        w.end(sim)
        w.end_guard()


# Kinds. Each is made over pk0, with the addresses on it; what it returns takes it away.

class Missing(Exception):
    pass


def make(*words):
    """ip link add; this kernel may not have the kind."""
    out = sh("ip", "link", "add", *words, check=False)
    if out.returncode:
        raise Missing(out.stderr.strip())


def move_here(to):
    sh("ip", "addr", "flush", "dev", "pk0")
    sh("ip", "link", "set", to, "up")
    sh("ip", "addr", "add", f"{HERE}/24", "broadcast", "+", "dev", to)


def move_far(to):
    far("ip", "addr", "flush", "dev", "pk1")
    far("ip", "link", "set", to, "up")
    for address in ALL:
        far("ip", "addr", "add", f"{address}/24", "broadcast", "+", "dev", to)


def vlan(protocol):
    name = "pk0.5"
    make("link", "pk0", "name", name, "type", "vlan", "proto", protocol, "id", 5)
    far("ip", "link", "add", "link", "pk1", "name", "pk1.5", "type", "vlan", "proto", protocol, "id", 5)
    move_here(name)
    move_far("pk1.5")
    return name


def vlan_q(_w):
    return vlan("802.1Q")


def vlan_ad(_w):
    return vlan("802.1ad")


def vlan_in_vlan(_w):
    vlan("802.1ad")
    make("link", "pk0.5", "name", "pk0.5.7", "type", "vlan", "id", 7)
    far("ip", "link", "add", "link", "pk1.5", "name", "pk1.5.7", "type", "vlan", "id", 7)
    sh("ip", "addr", "flush", "dev", "pk0.5")
    far("ip", "addr", "flush", "dev", "pk1.5")
    move_here("pk0.5.7")
    move_far("pk1.5.7")
    return "pk0.5.7"


def vlan_unordered(_w):
    """With its tag left in the frame (reorder_hdr off)."""
    vlan("802.1Q")
    sh("ip", "link", "set", "pk0.5", "type", "vlan", "reorder_hdr", "off")
    return "pk0.5"


def bridge(_w):
    make("br0", "type", "bridge")
    sh("ip", "link", "set", "pk0", "master", "br0")
    move_here("br0")
    return "br0"


def macvlan(_w):
    make("link", "pk0", "name", "mv0", "type", "macvlan", "mode", "bridge")
    move_here("mv0")
    return "mv0"


def ipvlan(_w):
    make("link", "pk0", "name", "iv0", "type", "ipvlan", "mode", "l2")
    move_here("iv0")
    return "iv0"


RELAY = """
import ctypes, fcntl, os, select, struct, sys
def tap(name):
    fd = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(fd, 0x400454ca, struct.pack("16sH22x", name, 0x1002))  # TUNSETIFF, IFF_TAP | IFF_NO_PI
    return fd
ends = [tap(b"tap0")]
with open("/run/netns/far") as there:
    assert ctypes.CDLL(None).setns(there.fileno(), 0) == 0
ends.append(tap(b"tap1"))
print("there", flush=True)
while True:
    for end in select.select(ends, [], [])[0]:
        try:
            os.write(ends[end == ends[0]], os.read(end, 65536))
        except OSError:
            pass  # one of them is down
"""


def tap(w):
    relay = w.relay = w.spawn("/usr/bin/python3", "-c", RELAY)
    wait_for("taps", lambda: relay.poll() is not None or "there" in relay.log.read_text().split())
    if relay.poll() is not None:
        raise Missing(relay.log.read_text().strip().splitlines()[-1])
    move_here("tap0")
    move_far("tap1")
    return "tap0"


def bond(_w):
    """Of two cables, of which one is used at a time."""
    make("bond0", "type", "bond", "mode", "active-backup", "miimon", "50")
    sh("ip", "link", "add", "pk2", "type", "veth", "peer", "name", "pk3", "netns", "far")
    far("ip", "link", "add", "br1", "type", "bridge")
    sh("ip", "addr", "flush", "dev", "pk0")
    for end in ("pk0", "pk2"):
        sh("ip", "link", "set", end, "down")
        sh("ip", "link", "set", end, "master", "bond0")
    for end in ("pk1", "pk3"):
        far("ip", "link", "set", end, "master", "br1", "up")
    move_here("bond0")
    move_far("br1")
    return "bond0"


def veth(_w):
    return "pk0"


def clear(w):
    """As at the beginning."""
    if hasattr(w, "relay"):
        w.end(w.relay)
        del w.relay
    for name in ("pk0", "pk2", "br0", "bond0"):
        sh("ip", "link", "del", name, check=False)
    far("ip", "link", "del", "br1", check=False)
    w.connect()


# How the guard is on it, and what a daemon with transport = xdp says.
XDP_IS = {
    veth: ("native", " over xdp in "),
    vlan_q: ("generic", "no VLAN and no bond"),
    vlan_ad: ("generic", "no VLAN and no bond"),
    vlan_in_vlan: ("generic", "no VLAN and no bond"),
    vlan_unordered: ("generic", "no VLAN and no bond"),
    bridge: ("generic", "the generic one gains nothing"),
    macvlan: ("generic", "the generic one gains nothing"),
    ipvlan: ("generic", "the generic one gains nothing"),
    bond: ("native", "no VLAN and no bond"),
    tap: ("native", " over xdp in "),
}


def try_kind(w, kind, name):
    mode, said = XDP_IS[kind]
    for transport, guard in (("auto", "shared"), ("xdp", "dedicated")):
        whole_checksums()
        w.write_conf(f"address = {DEVICE}\n{HASTY}", interface=name, transport=transport, guard=guard, **SLOW)
        w.start_guard()
        w.guarded_in_mode(mode)
        sim, daemon = w.start_sim(), w.start_daemon()
        runs(w, daemon)
        wait_for("the flag", lambda: w.state()["flags"]["guard"])
        text = daemon.log.read_text()
        assert transport != "xdp" or said in text, text
        grows(w, "pass_socket" if "over xdp" in text else "pass_device")
        flood_is_counted(w)
        sh("ip", "link", "set", name, "down")
        wait_for("the device lost", w.lost)
        sh("ip", "link", "set", name, "up")
        runs(w, daemon)
        if kind is bond:
            far("ip", "link", "set", "pk1", "down")
            wait_for("the other cable", lambda: "pk2" in sh("ip", "-d", "link", "show", "bond0").stdout)
            runs(w, daemon)
            far("ip", "link", "set", "pk1", "up")
            flood_is_counted(w)
        assert w.end(daemon) == 0, daemon.log.read_text()
        w.end(sim)
        w.end_guard()
        assert program_on(name) is None


def every_kind_works_or_falls_back(w):
    for kind in XDP_IS:
        try:
            name = kind(w)
        except Missing as why:
            print(f"not tried: {kind.__name__}: {why}", flush=True)
        else:
            try_kind(w, kind, name)
            print(f"   {kind.__name__}", flush=True)
        clear(w)


def offload_of_tags(on):
    """Whether pk0 and pk1 leave tags beside the frame, as cards do (ethtool -K ... rxvlan ... txvlan ...)."""
    code = f"""
import array, fcntl, socket, struct, sys
value = array.array("B", struct.pack("II", 0x25, 0))  # ETHTOOL_GFLAGS, ETHTOOL_SFLAGS
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
    request = struct.pack("16sP", sys.argv[1].encode(), value.buffer_info()[0])
    fcntl.ioctl(s, 0x8946, request)
    flags = struct.unpack("II", value)[1]
    struct.pack_into("II", value, 0, 0x26, flags | 0x180 if {on} else flags & ~0x180)
    fcntl.ioctl(s, 0x8946, request)
"""
    sh("/usr/bin/python3", "-c", code, "pk0")
    far("/usr/bin/python3", "-c", code, "pk1")


def guard_on_the_parent_of_a_vlan_judges_what_is_in_it(w):
    """Daemon and device in the VLAN, the guard below it; tags in the frame and beside it."""
    for kind in (vlan_q, vlan_ad, vlan_in_vlan):
        try:
            name = kind(w)
        except Missing as why:
            print(f"not tried: {kind.__name__}: {why}", flush=True)
            clear(w)
            continue
        for on, guard in ((True, "shared"), (False, "shared"), (True, "dedicated"), (False, "dedicated")):
            offload_of_tags(on)
            w.write_conf(f"address = {DEVICE}\n{HASTY}", guard=guard)
            w.start_guard()
            w.write_conf(f"address = {DEVICE}\n{HASTY}", interface=name, **SLOW)
            sim, daemon = w.start_sim(), w.start_daemon()
            runs(w, daemon)
            grows(w, "pass_device")
            flood_is_counted(w)
            got = w.counted(lambda: send_far(STRANGER, 5000, 50, bytes(64)))
            assert got.get("drop_else" if guard == "dedicated" else "pass_else", 0) >= 50, (kind, on, got)
            runs(w, daemon)
            assert w.end(daemon) == 0
            w.end(sim)
            w.end_guard()
        clear(w)


def tunnel_without_ethernet_is_refused(w):
    try:
        tun = open("/dev/net/tun", "r+b", buffering=0)
    except OSError as why:
        print(f"not tried: {why}", flush=True)
        return
    with tun:
        fcntl.ioctl(tun, 0x400454ca, struct.pack("16sH22x", b"tun0", 0x1001))  # TUNSETIFF, IFF_TUN | IFF_NO_PI
        sh("ip", "link", "set", "tun0", "up")
        for transport in ("auto", "xdp"):
            w.write_conf(f"address = {DEVICE}\n", interface="tun0", transport=transport, **SLOW)
            out = sh(w.guard_exe, "-c", w.conf, "run", check=False)
            lines = out.stderr.splitlines()
            assert out.returncode == 69 and len(lines) == 1 and "no Ethernet" in lines[0], out
            assert program_on("tun0") is None and not STATUS.exists()
            daemon = w.start_daemon()
            wait_for("the daemon", lambda d=daemon: "ready:" in d.log.read_text())
            assert transport == "auto" or "needs an Ethernet interface" in daemon.log.read_text()
            assert w.end(daemon) == 0


def part_of_a_bridge_or_bond_is_told(w):
    """Its packets are the whole's: the daemon hears nothing and says what to name."""
    for kind, whole in ((bridge, "br0"), (bond, "bond0")):
        try:
            kind(w)
        except Missing as why:
            print(f"not tried: {kind.__name__}: {why}", flush=True)
        else:
            w.write_conf(f"address = {DEVICE}\n{HASTY}")
            daemon = w.start_daemon()
            wait_for("the daemon", lambda d=daemon: "ready:" in d.log.read_text())
            assert f"pk0 is a part of {whole}" in daemon.log.read_text(), daemon.log.read_text()
            w.end(daemon)
            # a guard on it is as good as on the whole
            w.start_guard()
            w.guarded_in_mode("native")
            w.write_conf(f"address = {DEVICE}\n{HASTY}", interface=whole, **SLOW)
            sim, daemon = w.start_sim(), w.start_daemon()
            runs(w, daemon)
            assert "is a part" not in daemon.log.read_text()
            grows(w, "pass_device")
            flood_is_counted(w)
            for child in (daemon, sim):
                w.end(child)
            w.end_guard()
        clear(w)


def devices_each_have_a_way_of_their_own(w):
    """Over AF_XDP: one beside us, one behind a router, which becomes another one."""
    whole_checksums()
    far("ip", "addr", "add", f"{BEYOND}/32", "dev", "lo")
    sh("ip", "route", "add", f"{BEYOND}/32", "via", STRANGER)
    w.write_conf(f"address = {DEVICE}\n{HASTY}[device lathe]\naddress = {BEYOND}\n{HASTY}", transport="xdp", **SLOW)
    w.start_guard()
    sims = [w.start_sim(), w.start_sim(BEYOND, 777)]
    daemon = w.start_daemon()

    def both_past_the_kernel():
        runs(w, daemon)
        wait_for("lathe", lambda: w.device("lathe").get("fresh"))
        grows(w, "pass_socket")
        before = w.counters()["pass_device"]
        mill, lathe = (w.device(name)["state"]["statistics"]["accepted"] for name in ("mill", "lathe"))
        wait_for("replies of both", lambda: w.device("lathe")["state"]["statistics"]["accepted"] > lathe + 100 and
                 w.device("mill")["state"]["statistics"]["accepted"] > mill + 100)
        return w.counters()["pass_device"] - before

    wait_for("both past the kernel", lambda: both_past_the_kernel() == 0)
    sh("ip", "route", "replace", f"{BEYOND}/32", "via", MOVED)
    wait_for("both past the kernel by another router", lambda: both_past_the_kernel() == 0)
    # without any route the kernel would look for it on this very wire: the socket is the interface's
    sh("ip", "route", "replace", f"{BEYOND}/32", "via", NOBODY)
    wait_for("lathe lost", lambda: w.lost("lathe"))
    runs(w, daemon)
    sh("ip", "route", "replace", f"{BEYOND}/32", "via", MOVED)
    wait_for("both past the kernel again", lambda: both_past_the_kernel() == 0)
    for child in (daemon, *sims):
        w.end(child)
    w.end_guard()
    sh("ip", "route", "del", f"{BEYOND}/32")
    far("ip", "addr", "del", f"{BEYOND}/32", "dev", "lo")


CHECKS = [
    daemon_that_comes_before_the_address_finds_its_device,
    whatever_happens_to_an_interface_passes,
    every_kind_works_or_falls_back,
    guard_on_the_parent_of_a_vlan_judges_what_is_in_it,
    tunnel_without_ethernet_is_refused,
    part_of_a_bridge_or_bond_is_told,
    devices_each_have_a_way_of_their_own,
]

if __name__ == "__main__":
    sys.exit(main(CHECKS))
