#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl doctor before machines that nobody has: made-up trees of /proc, /sys
and ethtool's answers. Each says what every check has to find in it; a check that
no tree makes fail, or that has no documentation, fails the test."""
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

CORE = "sys/devices/system/cpu"
CONF = "[daemon]\ncpu = 3\nmode = {mode}\n[device mill]\naddress = 10.0.0.2\n"
ROUTE = "Iface\tDestination\tGateway\tFlags\n"
LIMITS = "Max locked memory         {lock}            {lock}            bytes\n" \
         "Max realtime priority     {priority}                    {priority}\n"


def stat(policy, priority):
    """Fields 3 to 41; the name is hostile on purpose."""
    return "77 (a) b 1 2) S " + "0 " * 36 + f"{priority} {policy} 0"


def process(number, name, threads, **more):
    tree = {f"proc/{number}/comm": name}
    for i, (policy, priority, cores) in enumerate(threads):
        tree[f"proc/{number}/task/{number + i}/stat"] = stat(policy, priority)
        tree[f"proc/{number}/task/{number + i}/status"] = f"Name:\tx\nCpus_allowed_list:\t{cores}\n"
    return tree | {f"proc/{number}/{key}": value for key, value in more.items()}


GOOD = {
    "etc/pokeysd/pokeysd.conf": CONF.format(mode="spin"),
    "proc/version": "Linux version 6.12.9-rt (a@b) #1 SMP PREEMPT_RT",
    "proc/cmdline": "quiet isolcpus=2,3 nohz_full=2-3 rcu_nocbs=2-3",
    "proc/cpuinfo": "flags\t\t: fpu tsc",
    "proc/sys/kernel/sched_rt_runtime_us": "950000",
    "proc/sys/kernel/sched_rt_period_us": "1000000",
    "proc/sys/kernel/timer_migration": "0",
    f"{CORE}/online": "0-3", f"{CORE}/isolated": "2-3", f"{CORE}/nohz_full": "2-3",
    f"{CORE}/cpu3/topology/thread_siblings_list": "3",
    f"{CORE}/cpu3/cpufreq/scaling_governor": "performance",
    f"{CORE}/cpu3/cpuidle/state0/latency": "0", f"{CORE}/cpu3/cpuidle/state0/name": "POLL",
    f"{CORE}/cpu3/cpuidle/state1/latency": "2", f"{CORE}/cpu3/cpuidle/state1/name": "C1",
    f"{CORE}/cpu3/cpuidle/state2/latency": "300", f"{CORE}/cpu3/cpuidle/state2/name": "C10",
    f"{CORE}/cpu3/cpuidle/state2/disable": "1",
    "dev/cpu_dma_latency": struct.pack("i", 0),
    "proc/irq/30/effective_affinity_list": "0", "proc/irq/30/smp_affinity_list": "0-3",
    "proc/irq/31/smp_affinity_list": "0-1",
    "sys/class/net/enp1/device/msi_irqs/30": "",
    "sys/class/net/enp1/carrier": "1", "sys/class/net/enp1/speed": "100", "sys/class/net/enp1/duplex": "full",
    "ethtool/enp1": "rx-usecs 0\nadaptive-rx 0\ngro 0\nlro 0\neee 0\nchannels 1\n",
    "proc/net/route": ROUTE + "wlan0\t00000000\t0100A8C0\t0003\t0\t0\t0\t00000000\t0\t0\t0\n"
                              "enp1\t0000000A\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n",
    "proc/net/arp": "IP address HW type Flags\n10.0.0.20  0x1 0x0 00:00:00:00:00:00 * enp1\n"
                    "10.0.0.2   0x1 0x6 02:00:00:00:00:01 * enp1\n",
    **process(500, "pokeysd", [(0, 0, "0-1"), (1, 80, "3")],
              limits=LIMITS.format(lock="unlimited", priority="98"), status="CapEff:\t0000000000000000\n"),
    **process(600, "rtapi_app", [(0, 0, "0-1"), (1, 98, "2")]),
}

# everything that can be bad at once
BAD = GOOD | {
    "proc/version": "Linux version 6.1.0-amd64 (a@b) #1 SMP PREEMPT_DYNAMIC",
    "proc/cmdline": "quiet isolcpus=1 rcu_nocbs=1",
    "proc/cpuinfo": "flags\t\t: fpu hypervisor tsc",
    "proc/sys/kernel/sched_rt_runtime_us": "0",
    "proc/sys/kernel/timer_migration": "1",
    f"{CORE}/isolated": "1", f"{CORE}/nohz_full": "",
    f"{CORE}/cpu3/topology/thread_siblings_list": "2-3",
    f"{CORE}/cpu3/cpufreq/scaling_governor": "powersave",
    f"{CORE}/cpu3/cpuidle/state2/disable": "0",
    "dev/cpu_dma_latency": struct.pack("i", 2000000000),
    "proc/irq/30/effective_affinity_list": "3",
    "sys/class/net/enp1/carrier": "0",
    "ethtool/enp1": "rx-usecs 50\nadaptive-rx 0\ngro 1\nlro 1\neee 1\nchannels 4\n",
    "proc/net/arp": "IP address HW type Flags\n10.0.0.2   0x1 0x2 02:00:00:00:00:01 * enp1\n",
    **process(500, "pokeysd", [(0, 0, "0-3")],
              limits=LIMITS.format(lock="8388608", priority="0"), status="CapEff:\t0000000000000000\n"),
    "proc/500/task/501/stat": None,
    **process(600, "rtapi_app", [(0, 0, "0-1"), (1, 98, "3")]),
    **process(700, "irqbalance", [(0, 0, "0-3")]),
    **process(800, "\x1b[2J\xe4\n\"", [(0, 0, "0-3")]), "proc/800/fd/3": pathlib.PurePath("/dev/cpu_dma_latency"),
}
BAD_VERDICTS = {
    "kernel": "problem", "virtual": "advice", "throttling": "problem", "timer-migration": "advice",
    "irqbalance": "advice", "core": "ok", "isolcpus": "problem", "nohz-full": "advice", "rcu-nocbs": "advice",
    "smt-sibling": "advice", "dma-latency": "advice", "idle-states": "advice", "governor": "advice",
    "interrupts": "advice", "nic-interrupts": "advice", "route": "ok", "neighbour": "advice",
    "nic-link": "problem", "nic-coalescing": "advice", "nic-offloads": "advice", "nic-queues": "advice",
    "nic-eee": "advice", "memory-lock": "problem", "priority": "problem", "daemon-thread": "problem",
    "linuxcnc-core": "problem",
}
DAEMON = {"daemon", "daemon-realtime", "daemon-transport", "daemon-faults", "daemon-cycles"}

NO_THREAD = process(500, "pokeysd", [(0, 0, "0-3"), (1, 80, "0-3")])

# (what changes, what a check then says): None removes a file, a path is a link there
VARIANTS = [
    ({f"{CORE}/online": "0-2"}, {"core": "problem", "isolcpus": "unknown", "governor": "unknown"}),
    ({"etc/pokeysd/pokeysd.conf": CONF.format(mode="sleep").replace("cpu = 3", "cpu = any"),
      **process(500, "pokeysd", [(0, 0, "0-3"), (1, 80, "0-3")])},
     {"core": "advice", "isolcpus": "unknown", "governor": "unknown", "daemon-thread": "ok"}),
    ({"etc/pokeysd/pokeysd.conf": "[device mill]\naddress = 10.0.0.2\n"}, {"core": "ok", "isolcpus": "ok"}),
    ({"etc/pokeysd/pokeysd.conf": CONF.format(mode="sleep"), f"{CORE}/isolated": ""}, {"isolcpus": "advice"}),
    ({"etc/pokeysd/pokeysd.conf": CONF.format(mode="spin\nduty = 1")}, {"throttling": "advice"}),
    ({"etc/pokeysd/pokeysd.conf": CONF.format(mode="spin\nduty = 0.9")}, {"throttling": "ok"}),
    ({"etc/pokeysd/pokeysd.conf": CONF.format(mode="spin\nduty = 0.92")}, {"throttling": "advice"}),
    ({"proc/sys/kernel/sched_rt_runtime_us": "-1"}, {"throttling": "ok"}),
    # without a list it takes nothing away; the last of two counts; N is the last core
    ({"proc/cmdline": "rcu_nocbs", f"{CORE}/nohz_full": ""}, {"rcu-nocbs": "advice", "nohz-full": "advice"}),
    ({"proc/cmdline": "rcu_nocbs=3 rcu_nocbs=2", f"{CORE}/nohz_full": ""}, {"rcu-nocbs": "advice"}),
    ({"proc/cmdline": "rcu_nocbs=2 rcu_nocbs=1,3-N", f"{CORE}/nohz_full": ""}, {"rcu-nocbs": "ok"}),
    # comments as the daemon takes them, and what is no number
    ({"etc/pokeysd/pokeysd.conf": "[daemon]\ncpu = 3\t# the last\nmode = spin # fast\nduty = 1 ; all\n"
                                  "[device mill]\naddress = 10.0.0.2 # here\n"},
     {"core": "ok", "throttling": "advice", "route": "ok"}),
    ({"etc/pokeysd/pokeysd.conf": "[daemon]\ncpu = any # core\n"} | NO_THREAD, {"core": "advice"}),
    ({"etc/pokeysd/pokeysd.conf": "[daemon]\ncpu = two\n"} | NO_THREAD, {"core": "advice"}),
    # auto spins on an isolated core, but not on the last one, which LinuxCNC takes
    ({"etc/pokeysd/pokeysd.conf": CONF.format(mode="auto\nduty = 1")}, {"throttling": "ok"}),
    ({"etc/pokeysd/pokeysd.conf": CONF.format(mode="auto\nduty = 1"), f"{CORE}/isolated": "2-4"},
     {"throttling": "advice"}),
    ({"etc/pokeysd/pokeysd.conf": "[daemon]\ncpu = 3\nduty = 1\n", f"{CORE}/isolated": "2-4"},
     {"throttling": "advice"}),
    ({"etc/pokeysd/pokeysd.conf": CONF.format(mode="sleep"), f"{CORE}/isolated": "",
      "sys/fs/cgroup/cpuset.cpus.isolated": "3"}, {"isolcpus": "ok"}),
    # a limit below what is wanted
    (process(500, "pokeysd", [(1, 80, "3")], limits=LIMITS.format(lock="unlimited", priority="50"),
             status="CapEff:\t0000000000000000\n"), {"priority": "problem"}),
    (process(500, "pokeysd", [(1, 80, "3")], limits=LIMITS.format(lock="unlimited", priority="50"),
             status="CapEff:\t0000000000000000\n") |
     {"etc/pokeysd/pokeysd.conf": CONF.format(mode="sleep\npriority = 50")}, {"priority": "ok"}),
    # somebody has it open, but at more than the state takes
    ({f"{CORE}/cpu3/cpuidle/state2/disable": "0", "dev/cpu_dma_latency": struct.pack("i", 500),
      "proc/500/fd/7": pathlib.PurePath("/dev/cpu_dma_latency")}, {"idle-states": "advice"}),
    ({f"{CORE}/cpu3/cpuidle/state2/disable": "0", "dev/cpu_dma_latency": None,
      "proc/500/fd/7": pathlib.PurePath("/dev/cpu_dma_latency")}, {"idle-states": "ok"}),
    # it keeps off isolated cores by itself
    (process(700, "irqbalance", [(0, 0, "0-3")]), {"irqbalance": "ok"}),
    (process(700, "irqbalance", [(0, 0, "0-3")]) | {f"{CORE}/isolated": "", f"{CORE}/nohz_full": "1"},
     {"irqbalance": "advice"}),
    # a number without a handler goes nowhere, whatever it may
    ({"proc/irq/5/effective_affinity_list": "", "proc/irq/5/smp_affinity_list": "0-3"}, {"interrupts": "ok"}),
    ({"proc/irq/5/effective_affinity_list": "", "proc/irq/5/smp_affinity_list": "0-3",
      "proc/irq/5/ahci/x": ""}, {"interrupts": "advice"}),
    # two ways there: the one of the least metric
    ({"proc/net/route": ROUTE + "enp1\t0000000A\t00000000\t0001\t0\t0\t100\t00FFFFFF\t0\t0\t0\n"
                                "wlan0\t0000000A\t00000000\t0001\t0\t0\t600\t00FFFFFF\t0\t0\t0\n"
                                "any\t00000000\t0100A8C0\t0003\t0\t0\t0\t00000000\t0\t0\t0\n",
      "sys/class/net/wlan0/phy80211/name": "phy0"}, {"nic-link": "ok", "route": "ok"}),
    # what such a driver calls 3 us is its own choice
    ({"ethtool/enp1": "rx-usecs 3\nadaptive-rx 0\n"}, {"nic-coalescing": "ok"}),
    ({"ethtool/enp1": "rx-usecs 3\nadaptive-rx 0\n",
      "sys/class/net/enp1/device/driver": pathlib.PurePath("../../bus/pci/drivers/igb")},
     {"nic-coalescing": "advice"}),
    ({f"{CORE}/cpu3/topology/thread_siblings_list": "2-3"}, {"smt-sibling": "ok"}),
    ({f"{CORE}/cpu3/cpuidle/state2/disable": "0"}, {"idle-states": "ok"}),
    ({f"{CORE}/cpu3/cpuidle/state2/disable": "0", "dev/cpu_dma_latency": None}, {"idle-states": "unknown"}),
    ({f"{CORE}/cpu3/cpufreq/scaling_governor": None}, {"governor": "ok"}),
    ({"proc/net/route": ROUTE}, {"route": "problem", "nic-link": "unknown"}),
    ({"proc/net/route": ROUTE + "enp1\t00000000\t0100A8C0\t0003\t0\t0\t0\t00000000\t0\t0\t0\n"},
     {"route": "advice", "neighbour": "unknown"}),
    # two interfaces in one network: the one at which it answers
    ({"proc/net/arp": "IP address HW type Flags\n10.0.0.2 0x1 0x0 00:00:00:00:00:00 * enp1\n"
                      "10.0.0.2 0x1 0x6 02:00:00:00:00:01 * wlan0\n",
      "sys/class/net/wlan0/phy80211/name": "phy0"},
     {"route": "advice", "neighbour": "ok", "nic-link": "problem"}),
    ({"proc/net/arp": GOOD["proc/net/arp"] + "10.0.0.2 0x1 0x2 02:00:00:00:00:01 * wlan0\n"},
     {"route": "ok", "neighbour": "ok", "nic-link": "ok"}),
    # what the file names goes before the routes
    ({"etc/pokeysd/pokeysd.conf": GOOD["etc/pokeysd/pokeysd.conf"].replace("cpu = 3", "cpu = 3\ninterface = wlan0"),
      "sys/class/net/wlan0/phy80211/name": "phy0"}, {"route": "advice", "nic-link": "problem"}),
    ({"etc/pokeysd/pokeysd.conf": GOOD["etc/pokeysd/pokeysd.conf"].replace("cpu = 3", "cpu = 3\ninterface = wlan0"),
      "proc/net/route": ROUTE, "sys/class/net/wlan0/phy80211/name": "phy0"}, {"route": "ok", "nic-link": "problem"}),
    ({"etc/pokeysd/pokeysd.conf": GOOD["etc/pokeysd/pokeysd.conf"].replace("cpu = 3", "cpu = 3\ninterface = enp9")},
     {"route": "problem", "nic-link": "unknown"}),
    ({"etc/pokeysd/pokeysd.conf": "[daemon]\ncpu = 3\n[device mill]\nserial = 5\n"}, {"route": "unknown"}),
    ({"sys/class/net/enp1/duplex": "half"}, {"nic-link": "problem"}),
    ({"sys/class/net/enp1/phy80211/name": "phy0"}, {"nic-link": "problem"}),
    ({"ethtool/enp1": "rx-usecs 0\nadaptive-rx 1\n"},
     {"nic-coalescing": "advice", "nic-offloads": "unknown", "nic-queues": "unknown", "nic-eee": "unknown"}),
    ({"sys/class/net/enp1/device/msi_irqs/30": None, "proc/irq/30/effective_affinity_list": "3",
      "proc/interrupts": "  CPU0 CPU1\n 30:  1  2  PCI-MSI  enp1-rx-0\n 31: 0 0 PCI-MSI wenp1\n"},
     {"nic-interrupts": "advice"}),
    # sent elsewhere, and not come since
    ({"proc/irq/30/effective_affinity_list": "3", "proc/irq/30/smp_affinity_list": "0"},
     {"interrupts": "ok", "nic-interrupts": "ok"}),
    (process(500, "pokeysd", [(1, 80, "2-3")]), {"daemon-thread": "problem"}),
    # dead, and nobody has asked for its status yet
    ({"proc/500/task/500/stat": stat(0, 0).replace(" S ", " Z "), "proc/500/task/501/stat": None,
      "proc/500/task/501/status": None}, {"daemon-thread": "unknown"}),
    (process(500, "pokeysd", [(1, 80, "3")], limits=LIMITS.format(lock="8388608", priority="0"),
             status="CapEff:\t0000000000804000\n"), {"memory-lock": "ok", "priority": "ok"}),
]


FIRST = {"etc/pokeysd/pokeysd.conf": CONF.format(mode="sleep").replace("cpu = 3", "cpu = 0")}

# (what is bad besides, the check, what its command has to say, and what it must not)
MENDS = [
    # the cores that are isolated already stay so
    ({}, "isolcpus", "isolcpus=managed_irq,domain,1,3 nohz_full=3 rcu_nocbs=1,3", None),
    ({f"{CORE}/isolated": "3", f"{CORE}/nohz_full": "(null)"}, "nohz-full", "domain,3 nohz_full=3 rcu", None),
    (FIRST, "isolcpus", "another cpu", "isolcpus="),
    # core 0 cannot be switched off; nosmt would switch off the daemon's own
    ({f"{CORE}/cpu3/topology/thread_siblings_list": "0,3"}, "smt-sibling", "another cpu", "echo"),
    ({f"{CORE}/cpu3/topology/thread_siblings_list": "2-3"}, "smt-sibling", "cpu2/online", "nosmt"),
    ({f"{CORE}/cpu3/topology/thread_siblings_list": "3,7"}, "smt-sibling", "cpu7/online, or nosmt", None),
    # one word that a driver does not know makes it refuse all
    ({}, "nic-coalescing", "ethtool -C enp1 rx-usecs 0", "rx-frames"),
    ({}, "nic-queues", "ethtool -L enp1 combined 1", None),
    ({"ethtool/enp1": "channels 4\nrx-channels 4\n"}, "nic-queues", "ethtool -L enp1 rx 1", "combined"),
    ({"ethtool/enp1": "rx-usecs 50\nrx-frames 64\nadaptive-rx 1\n"}, "nic-coalescing",
     "ethtool -C enp1 adaptive-rx off rx-usecs 0 rx-frames 1", None),
    # what is known stands in it
    ({}, "neighbour", "10.0.0.2 lladdr 02:00:00:00:00:01 dev enp1", None),
    ({"proc/net/arp": "IP address HW type Flags\n10.0.0.2   0x1 0x0 00:00:00:00:00:00 * enp1\n"}, "neighbour",
     "10.0.0.2 lladdr ITS-MAC dev enp1", None),
    ({}, "nic-interrupts", "for i in 30; do echo 0 > /proc/irq/$i/smp_affinity_list; done", None),
    ({f"{CORE}/isolated": "0-1", "proc/irq/31/smp_affinity_list": "2-3"}, "interrupts",
     "for i in 30 31; do echo 2 > /proc/irq/$i/smp_affinity_list; done", None),
    ({f"{CORE}/isolated": "0-3"}, "interrupts", "echo OTHER-CORE >", None),
]


def plant(root, tree):
    for name, content in tree.items():
        if content is None:
            continue
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, pathlib.PurePath):
            path.symlink_to(content)
            continue
        path.write_bytes(content if isinstance(content, bytes) else (content + "\n").encode())


def examine(program, tree, *options):
    with tempfile.TemporaryDirectory() as folder:
        plant(pathlib.Path(folder), tree)
        out = subprocess.run([program, "doctor", "--root", folder, "--json", *options], capture_output=True,
                             text=True, timeout=120, check=False)
        text = subprocess.run([program, "doctor", "--root", folder, *options], capture_output=True,
                              text=True, timeout=120, check=False)
    assert out.stderr == "" and text.stderr == "", out.stderr
    assert re.fullmatch(r"[\n -~]*", text.stdout), "somebody else's bytes for the terminal"
    document = json.loads(out.stdout)
    findings = document["findings"]
    verdicts = {finding["check"]: finding["verdict"] for finding in findings}
    assert set(document) == {"format", "problems", "advice", "unknown", "findings"}
    for word, key in ("problem", "problems"), ("advice", "advice"), ("unknown", "unknown"):
        assert document[key] == list(f["verdict"] for f in findings).count(word), key
    assert out.returncode == text.returncode == (1 if document["problems"] else 0)
    for finding in findings:
        assert finding["why"], finding
        # what is gone after the next boot says so, and how it stays
        fleeting = re.match(r"(for each: |for i in .*; do )?(echo|sysctl|ethtool|ip) ", finding["mend"])
        assert bool(finding["keep"]) == bool(fleeting) or finding["check"] in ("route", "core"), finding
        assert finding["keep"] in text.stdout, finding
        assert f"{finding['verdict']:8} {finding['check']}" in text.stdout, finding
        if finding["verdict"] in ("advice", "problem"):
            assert finding["mend"], f"nothing mends {finding}"
        elif finding["verdict"] == "ok":
            assert not finding["mend"], f"what is in order is not mended: {finding}"
    return verdicts, findings


def expect(found, wanted, what):
    wrong = {check: (found.get(check), verdict) for check, verdict in wanted.items()
             if found.get(check) != verdict}
    assert not wrong, f"{what}: found, wanted: {wrong}"


def main():
    program, page, guide = sys.argv[1:]
    good, _ = examine(program, GOOD)
    expect(good, {check: "unknown" if check in DAEMON else "ok" for check in good}, "the good machine")
    bad, _ = examine(program, BAD)
    expect(bad, BAD_VERDICTS, "the bad machine")
    assert set(bad) == set(BAD_VERDICTS) | DAEMON == set(good), "a check is without a verdict here"

    blind, _ = examine(program, {})
    expect(blind, {c: "unknown" for c in good if c not in ("core", "irqbalance")}, "the unreadable machine")
    folders = {name + "/instead/of": "a file" for name in GOOD if "/msi_irqs/" not in name and name.count("/") > 0}
    blind, _ = examine(program, folders, "--cpu", "3")
    wrong = {c: v for c, v in blind.items() if v != "unknown" and c not in ("irqbalance", "linuxcnc-core")}
    assert not wrong, f"what cannot be read is judged: {wrong}"

    for changes, wanted in VARIANTS:
        found, _ = examine(program, GOOD | changes)
        expect(found, wanted, f"with {changes}")

    _, findings = examine(program, BAD)
    link = next(f for f in findings if f["check"] == "neighbour")
    assert link["subject"] == "mill" and "10.0.0.2 lladdr" in link["mend"], link
    for changes, check, wanted, unwanted in MENDS:
        _, findings = examine(program, BAD | changes)
        mend = next(f for f in findings if f["check"] == check)["mend"]
        assert wanted in mend and not (unwanted and unwanted in mend), (changes, check, mend)

    _, findings = examine(program, GOOD | {f"proc/irq/{n}/smp_affinity_list": "3" for n in range(300, 700)})
    told = next(f for f in findings if f["check"] == "interrupts")["why"]
    assert told.startswith("400 of 402 ") and told.endswith(" and others"), told

    for text in page, guide:
        known = set(re.findall(r"[*`]([a-z-]+)[*`]", pathlib.Path(text).read_text(encoding="utf-8")))
        assert set(good) <= known, f"{text} does not know {sorted(set(good) - known)}"
    print(f"{len(good)} checks, {len(VARIANTS) + 4} machines")
    return 0


if __name__ == "__main__":
    sys.exit(main())
