#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl latency and doctor beside a real daemon and the simulator, and as
somebody without any right. No times are judged: this machine may be busy."""
import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import threading
import xml.etree.ElementTree

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
from house import House, Skip, for_everybody, main, wait_for  # pylint: disable=wrong-import-position

NOBODY = 65534
KEYS = {"format", "kernel", "virtual_machine", "priority", "seconds", "period_us", "note", "series", "daemon"}
SERIES = {"name", "cpu", "samples", "mean_us", "min_us", "p50_us", "p99_us", "p999_us", "max_us", "buckets"}
CORE = min(os.sched_getaffinity(0))


def judge(document, may_be_empty=False):
    assert set(document) == KEYS and document["format"] == 1, document.keys()
    for series in document["series"]:
        assert set(series) == SERIES, series.keys()
        assert series["samples"] == sum(count for _, count in series["buckets"]), series
        if not series["samples"]:
            assert may_be_empty, series
            continue
        assert series["p50_us"] <= series["p99_us"] <= series["p999_us"] <= series["max_us"], series
        if series["name"].startswith("sleeper"):  # of the others only buckets are known
            assert series["min_us"] <= series["p50_us"], series


def measure(house, *words):
    out = house.ctl("latency", "--json", "--seconds", "0.5", *words)
    if "is refused" in out.stderr or "cannot be locked" in out.stderr:
        raise Skip(out.stderr.strip())
    assert out.returncode == 0 and out.stderr == "", out.stderr
    document = json.loads(out.stdout)
    judge(document, may_be_empty=True)  # in half a second a busy machine may leave no time for a single one
    return document


def measure_all(house, *words):
    """Once there are samples in every series."""
    def document():
        found = measure(house, *words)
        return all(series["samples"] for series in found["series"]) and found["series"] and found
    return wait_for("samples of all", document, 120)


def findings(out):
    found = {}
    for finding in json.loads(out.stdout)["findings"]:
        found.setdefault(finding["check"], finding)
    return found


def without_rights(*words, locked=None):
    """As nobody, who may lock so many bytes of memory (None: as many as users may here)."""
    def drop():
        if locked is not None:
            resource.setrlimit(resource.RLIMIT_MEMLOCK, (locked, locked))
        if os.geteuid() == 0:
            os.setgroups([])
            os.setgid(NOBODY)
            os.setuid(NOBODY)
    return subprocess.run([for_everybody("pokeysctl"), *map(str, words)], capture_output=True, text=True,
                          timeout=120, check=False, preexec_fn=drop)


def test_the_daemon_is_measured_beside_the_sleepers():
    with House(cpu=CORE, **{"period-us": 2000}) as house:
        picture = house.folder / "latency.svg"
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        document = measure_all(house, "--svg", picture, "--config", house.conf)
        assert document["period_us"] == 2000
        names = [series["name"] for series in document["series"]]
        assert names[0] == f"sleeper, core {CORE}" and names[-1].startswith("pokeysd"), names
        assert document["note"] == ""
        daemon, shown = document["daemon"], house.device()["diag"]["latency_us"]
        assert set(daemon) == set(shown), set(daemon) ^ set(shown)
        for name, part in daemon.items():
            assert part["samples"] <= shown[name]["count"], name
        assert daemon["age_at_read"] == {**daemon["age_at_read"], "samples": 0, "p50_us": None}
        root = xml.etree.ElementTree.parse(picture).getroot()
        paths = root.findall("{http://www.w3.org/2000/svg}path")
        assert len(paths) == len(document["series"])
        text = house.ctl("latency", "--seconds", "0.3").stdout
        assert "samples" in text and "p99.9" in text and "pokeysd" in text, text
        # in a third of a second a busy machine may leave no time for a single answer
        wait_for("a round trip within a measurement", lambda: "\nround trip" in house.ctl(
            "latency", "--seconds", "0.3").stdout, 120)
        assert "\nage at read" not in text, text


def test_without_a_daemon_the_sleepers_are_alone():
    with House() as house:
        document = measure_all(house)
        assert all(series["name"].startswith("sleeper") for series in document["series"])
        assert "no daemon" in document["note"] and document["daemon"] == {}


def stop_and_wait(daemon):
    daemon.send_signal(signal.SIGSTOP)
    status = pathlib.Path(f"/proc/{daemon.pid}/status")
    wait_for("the daemon to stand", lambda: "T (stopped)" in status.read_text())


def test_a_daemon_that_stands_still_is_not_told_as_none():
    with House() as house:
        house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        stop_and_wait(daemon)
        document = measure(house)
        assert document["daemon"] == {} and "daemon not publishing for" in document["note"], document["note"]
        daemon.send_signal(signal.SIGCONT)


def test_a_daemon_that_is_silent_for_a_while_is_waited_for():
    with House() as house:
        house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        wait_for("the diagnostic image", lambda: house.device()["diag"])
        stop_and_wait(daemon)
        threading.Timer(1.5, daemon.send_signal, (signal.SIGCONT,)).start()
        document = measure(house)
        # a machine that is held for seconds may let it come too late; then that is what is said
        assert document["daemon"] or "not publishing" in document["note"], document["note"]
        assert "no daemon runs" not in document["note"], document["note"]


def test_a_daemon_that_is_started_anew_meanwhile_is_found():
    def measured(house, daemon):
        """One daemon killed, the next one begun, and at once asked for; is it found?"""
        daemon.kill()
        daemon.wait()
        house.start_daemon(wait=False)
        document = measure(house)
        assert document["daemon"] or document["note"], document
        return document["daemon"] != {}

    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        found = [measured(house, house.children[-1]) for _ in range(5)]
        assert any(found), "never found: a start takes less than the patience"


def test_a_daemon_that_goes_while_it_is_looked_for_is_no_error():
    def come_and_go():
        while not enough.is_set():
            (house.runtime / "current").rename(house.runtime / "away")
            (house.runtime / "away").rename(house.runtime / "current")

    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        enough = threading.Event()
        goer = threading.Thread(target=come_and_go)
        goer.start()
        try:
            said = [house.ctl("latency", "--json", "--no-realtime", "--seconds", "0.1").stderr for _ in range(20)]
        finally:
            enough.set()
            goer.join()
        assert not any(said), said


def test_a_daemon_that_is_started_anew_within_a_measurement_counts_from_then_on():
    def samples():
        seen = house.device() or {}  # the old one's image is fresh until the new one clears it away
        return seen["diag"]["latency_us"]["wakeup"]["count"] if seen.get("publishing") and seen["diag"] else 0

    with House() as house:
        house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        first = wait_for("its first samples", samples)
        child = house.spawn("pokeysctl", "-r", house.runtime, "latency", "--no-realtime", "--seconds", "600",
                            "--json", stderr=subprocess.PIPE, text=True)
        status = pathlib.Path(f"/proc/{child.pid}/status")
        wait_for("the measurement", lambda: int(status.read_text().split("SigCgt:")[1].split()[0], 16)
                 >> signal.SIGINT - 1 & 1)
        daemon.kill()
        daemon.wait()
        house.start_daemon()
        house.wait_fresh()
        wait_for("more than it had", lambda: samples() > 3 * first + 2000)
        child.send_signal(signal.SIGINT)
        document = json.loads(child.communicate(timeout=120)[0])
        judge(document)
        assert "restarted" in document["note"], document["note"]
        counted = document["series"][-1]["samples"]
        assert 3 * first + 2000 < counted <= samples(), (counted, first)


def test_who_may_not_look_is_told_so():
    if os.geteuid() != 0:
        raise Skip("only root can have a folder that is not mine")
    with House() as house:
        house.runtime.mkdir(0o700)
        out = without_rights("latency", "--seconds", "0.1", "--no-realtime", "--json", "-r", house.runtime)
        assert out.returncode == 0, out.stderr
        assert "permission denied" in json.loads(out.stdout)["note"], out.stdout


def test_a_core_that_is_not_there_is_told():
    with House() as house:
        out = house.ctl("latency", "--cpu", "1023", "--seconds", "0.1", "--no-realtime")
        assert out.returncode == 1 and "core 1023 is not there" in out.stderr, out.stderr


def test_a_picture_that_cannot_be_written_is_told():
    with House() as house:
        out = house.ctl("latency", "--seconds", "0.1", "--no-realtime", "--svg", "/nowhere/x.svg")
        assert out.returncode == 1 and "--svg: /nowhere/x.svg" in out.stderr, out.stderr
        assert out.stdout == "", "it is told before anything is measured"


def test_who_has_no_right_to_a_priority_is_refused_in_words():
    out = without_rights("latency", "--seconds", "0.1")
    if out.returncode == 0:
        raise Skip("here everybody has the right")
    assert out.returncode == 1 and "--no-realtime" in out.stderr and out.stdout == "", out.stderr
    out = without_rights("latency", "--seconds", "0.2", "--no-realtime", "--json")
    assert out.returncode == 0, out.stderr
    document = json.loads(out.stdout)
    judge(document, may_be_empty=True)
    assert document["priority"] is None


def test_a_limit_of_locked_memory_does_not_keep_it_from_measuring():
    # enough for the program, and not for its threads, is somewhere among these
    most = resource.getrlimit(resource.RLIMIT_MEMLOCK)[1]
    for limit in range(0, 24 << 20, 512 << 10):
        if 0 <= most < limit:
            break
        out = without_rights("latency", "--seconds", "0.1", "--no-realtime", "--json", locked=limit)
        assert out.returncode == 0, (limit, out.stderr)


def test_odd_histograms_stay_documents_and_pictures():
    def put(what):
        return subprocess.run([House.programs["test_tools_latency_report"], what], capture_output=True,
                              timeout=120, check=True).stdout
    xml.etree.ElementTree.fromstring(put("--svg"))
    one, late, none = json.loads(put("--json"))["series"]
    assert one["samples"] == 1 and late["samples"] == 2
    assert none["p50_us"] is None and none["cpu"] is None and none["buckets"] == []


def test_a_folder_of_others_is_told_with_what_to_do():
    if os.geteuid() != 0:
        raise Skip("only root can have a folder that is not mine")
    with House() as house:
        house.runtime.mkdir(0o700)
        out = without_rights("status", "--runtime-directory", house.runtime)
        assert out.returncode == 1 and "only its owner may enter" in out.stderr, out.stderr


def test_doctor_sees_a_running_daemon():
    with House(cpu=CORE) as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        wait_for("the diagnostic image", lambda: house.device()["diag"])
        out = house.ctl("doctor", "--json", "--config", house.conf)
        found = findings(out)
        assert found["core"]["verdict"] == "ok" and found["route"]["why"] == "directly at lo", found
        realtime = house.device()["state"]["flags"]["realtime"]
        assert found["daemon-realtime"]["verdict"] == ("ok" if realtime else "problem")
        assert found["daemon-thread"]["verdict"] == ("ok" if realtime else "problem")
        assert found["daemon-transport"]["verdict"] in ("ok", "advice")
        assert found["daemon"]["subject"] == "mill"
        assert out.returncode == (1 if json.loads(out.stdout)["problems"] else 0)
        if realtime:  # without the file the core is that of the running thread
            found = findings(house.ctl("doctor", "--json", "--config", "/dev/null"))
            assert found["core"]["why"].startswith(f"core {CORE} of"), found["core"]


def test_doctor_looks_where_it_is_asked_to_although_the_file_names_another_folder():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        house.conf.write_text(house.conf.read_text().replace("[daemon]", f"[daemon]\nruntime-directory = {house.runtime}"))
        for folder, subject in ((None, "mill"), ("/run/pokeysd", "")):
            where = ["--runtime-directory", folder] if folder else []
            found = findings(subprocess.run([House.programs["pokeysctl"], "doctor", "--json", "--config", house.conf, *where],
                                            capture_output=True, text=True, timeout=120, check=False))
            assert found["daemon"]["subject"] == subject, (folder, found["daemon"])


def test_doctor_works_without_daemon_and_without_rights():
    out = without_rights("doctor", "--json", "--runtime-directory", "/nowhere")
    assert out.returncode in (0, 1) and out.stderr == "", out.stderr
    found = findings(out)
    assert found["daemon"]["verdict"] == "unknown" and found["daemon"]["mend"]
    assert found["kernel"]["verdict"] in ("ok", "problem")


def test_doctor_does_not_start_a_daemon_that_it_may_not_see():
    if os.geteuid() != 0:
        raise Skip("only root can have a folder that is not mine")
    with House() as house:
        house.runtime.mkdir(0o700)
        daemon = findings(without_rights("doctor", "--json", "--runtime-directory", house.runtime))["daemon"]
        assert "this user may not read" in daemon["why"] and "start" not in daemon["mend"], daemon


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
