# SPDX-License-Identifier: GPL-2.0-or-later
"""Prometheus' text format, of the moment of the scrape.

Process values have units in their names; codes are given as words. A device whose data is old has
pokeys_up 0 and no process values, so that a graph has a gap instead of a line that stands still.
"""
from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate, groupby
from typing import Any

import pokeys
from prometheus_client import CollectorRegistry, GCCollector, PlatformCollector, ProcessCollector
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
    Metric,
    StateSetMetricFamily,
)
from prometheus_client.exposition import choose_encoder
from prometheus_client.registry import Collector

from .. import __version__
from ..access import Access
from ..board import is_set_up
from ..console.client import Client
from ..console.console import Console
from ..console.outbox import Outbox
from ..gate import Gate
from ..hub import LAGS_S, Hub
from ..model import Row
from ..source import Reading
from .rpc import Rpc

BUCKETS_AN_OCTAVE = 4       # of the daemon's histograms; every octave is one bucket here


class OwnProcess(ProcessCollector):
    """Memory, processor time and descriptors of this process, also where a unit hides the rest of /proc."""

    def _boot_time(self) -> float:
        return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME)


@dataclass(frozen=True)
class Family:
    """A metric whose samples are the values of one pattern of names."""

    metric: str
    pattern: str
    help: str
    label: str = ""         # of what has the number: axis, heater; "" = the value belongs to a terminal
    factor: float = 1.0
    counts: bool = False
    labels: tuple[tuple[str, str], ...] = ()


FAMILIES = (
    Family("pokeys_input", "pin.NN.in", "Digital input: 1 = high"),
    Family("pokeys_output", "pin.NN.out-fb", "Digital output as the device has it: 1 = on"),
    Family("pokeys_external_output", "external.NN.out-fb", "Output or relay of the board as the device has it: 1 = on"),
    Family("pokeys_analog_volts", "adc.NN.volts", "Voltage at an analog input"),
    Family("pokeys_pwm_duty_ratio", "pwm.NN.duty", "Duty of a PWM output, 0 to 1"),
    Family("pokeys_counter_value", "counter.NN.value", "Digital counter; wraps at 2^32"),
    Family("pokeys_encoder_counts", "encoder.NN.rawcounts", "Count of an encoder; wraps at 2^32", "encoder"),
    Family("pokeys_encoder_resyncs_total", "encoder.NN.resyncs", "Jumps of the count that were corrected", "encoder",
           counts=True),
    Family("pokeys_axis_position_pulses", "joint.NN.counts", "Position of an axis", "axis"),
    Family("pokeys_axis_command_pulses", "joint.NN.counts-cmd", "Position last sent to the device; in speed mode a "
           "speed in pulses per second", "axis"),
    Family("pokeys_axis_enabled", "joint.NN.enabled", "The daemon drives the axis", "axis"),
    Family("pokeys_axis_homed", "joint.NN.homed", "The device has homed the axis", "axis"),
    Family("pokeys_axis_error", "joint.NN.error", "Error input of the axis' motor driver", "axis"),
    Family("pokeys_axis_limit", "joint.NN.limit-neg", "Limit switch of an axis", "axis",
           labels=(("side", "negative"),)),
    Family("pokeys_axis_limit", "joint.NN.limit-pos", "Limit switch of an axis", "axis",
           labels=(("side", "positive"),)),
    Family("pokeys_axis_home_switch", "joint.NN.home-sw", "Home switch of an axis", "axis"),
    Family("pokeys_postep_supply_volts", "joint.NN.postep.supply", "Supply of a PoStep driver", "axis"),
    Family("pokeys_postep_temperature_celsius", "joint.NN.postep.temperature", "Temperature of a PoStep driver",
           "axis"),
    Family("pokeys_postep_fault", "joint.NN.postep.fault", "A PoStep driver reports a fault", "axis"),
    Family("pokeys_heater_temperature_celsius", "heater.NN.temperature", "Temperature of a heater", "heater"),
    Family("pokeys_heater_target_celsius", "heater.NN.target-in-effect", "Its target; 0 = off", "heater"),
    Family("pokeys_heater_power_ratio", "heater.NN.power", "Its power, 0 to 1", "heater"),
    Family("pokeys_heater_power_limited", "heater.NN.power-limited", "The supply gives it less than it asks for",
           "heater"),
    Family("pokeys_heater_at_temperature", "heater.NN.at-temperature", "It is at its target", "heater"),
    Family("pokeys_heater_fault", "heater.NN.fault", "A fault has switched it off, until it is reset", "heater"),
    Family("pokeys_heater_faults_total", "heater.NN.faults", "Its faults since the daemon's start", "heater",
           counts=True),
    Family("pokeys_servo_position_units", "servo.NN.pos-fb", "Position of a servo motor's axis", "servo"),
    Family("pokeys_servo_following_error_units", "servo.NN.error", "Its distance from the commanded position",
           "servo"),
    Family("pokeys_servo_output_ratio", "servo.NN.output", "Its part of the full voltage, -1 to 1", "servo"),
    Family("pokeys_servo_homed", "servo.NN.homed", "Its position is that of the machine", "servo"),
    Family("pokeys_servo_faults_total", "servo.NN.faults", "Its faults since the daemon's start", "servo", counts=True),
)
# one state set for each heater or motor
LOOPS = {"heater": ("pokeys_heater_state", "What a heater does"),
         "servo": ("pokeys_servo_state", "What a servo motor does")}

# one value each
SINGLE = (
    Family("pokeys_machine_on_permitted", "machine-on-permitted", "The daemon permits motion"),
    Family("pokeys_safe_state", "safe-state", "Outputs and axes are held in the safe state"),
    Family("pokeys_outputs_held", "outputs-held", "Outputs wait for machine-on after a loss"),
    Family("pokeys_emergency", "emergency", "The pulse engine is in emergency, or its input is active"),
    Family("pokeys_commander_alive", "commander-alive", "A commander drives the device"),
    Family("pokeys_engine_buffer_slots", "engine.buffer-level", "Slots of the motion buffer in use"),
    Family("pokeys_engine_buffer_underruns_total", "engine.buffer-underruns", "How often the motion buffer ran dry",
           counts=True),
    Family("pokeys_packet_error_level", "packets.error-level", "Rises with lost answers, falls with good ones"),
    Family("pokeys_cycles_total", "cycle", "Cycles of the realtime loop", counts=True),
    Family("pokeys_cycles_late_total", "cycles-late", "Cycles whose fast data did not arrive in time", counts=True),
    Family("pokeys_reconnects_total", "reconnects", "Times the device was found again", counts=True),
    Family("pokeys_commands_refused_total", "command-refused-count", "Values that the daemon refused", counts=True),
    Family("pokeys_cycles_skipped_total", "cycles-skipped", "Ticks that the daemon missed", counts=True),
)
HISTOGRAMS = {"data": "data_complete", "age": "age_at_read"}       # where the name alone says too little
RUNNING = 3
PACKETS = ("sent", "resent", "received", "accepted", "missed", "late", "lost", "timed-out", "stray", "duplicate",
           "stale", "corrupt", "wrong-source", "send-failed")
ENGINE = "engine.", "engine-state", "emergency"
STATES = {"pokeys_link": ("link-state", "Whether the device runs"),
          "pokeys_engine": ("engine-state", "State of the pulse engine")}


class _Sheet:
    """The families of one scrape, in the order in which they were begun."""

    def __init__(self) -> None:
        self._families: dict[str, Any] = {}

    def add(self, family: Family, labels: dict[str, str], value: float) -> None:
        """One sample."""
        kind = CounterMetricFamily if family.counts else GaugeMetricFamily
        if family.metric not in self._families:
            self._families[family.metric] = kind(family.metric.removesuffix("_total"), family.help,
                                                 labels=list(labels))
        self._families[family.metric].add_metric(list(labels.values()), value)

    def put(self, metric: Metric) -> Any:
        """A family of another kind, or the one of this name that is there."""
        return self._families.setdefault(metric.name, metric)

    def all(self) -> list[Metric]:
        """All of them."""
        return list(self._families.values())


def _histogram(histogram: pokeys.Histogram) -> tuple[list[tuple[str, float]], float]:
    """Cumulative buckets with upper bounds in seconds, and the sum."""
    rows = list(histogram.buckets())
    buckets, total = [], 0.0
    for i, (_lower, number) in enumerate(rows):
        total += number
        if i + 1 < len(rows) and (i + 1) % BUCKETS_AN_OCTAVE == 0:
            buckets.append((repr(rows[i + 1][0] / 1e6), total))
    return [*buckets, ("+Inf", float(histogram.count))], (histogram.mean_us or 0.0) * histogram.count / 1e6


def _most(outbox: Outbox) -> int:
    return outbox.most


def _kind(client: Client) -> str:
    return client.kind


class Values(Collector):
    """What prometheus_client asks for the values of all devices."""

    def __init__(self, hub: Hub, gate: Gate, rpc: Rpc, access: Access, console: Console) -> None:
        self._hub, self._gate, self._rpc, self._access, self._console = hub, gate, rpc, access, console
        model = hub.model
        self._rows = [(family, row) for family in FAMILIES for row in model.family(family.pattern)]
        self._loops = [(label, row) for label in LOOPS for row in model.family(f"{label}.NN.state")]
        self._single = [(family, model.rows[family.pattern]) for family in SINGLE]

    def collect(self) -> Iterator[Metric]:
        """All families. Called in another thread than the event loop's: it takes some milliseconds."""
        sheet = _Sheet()
        up = Family("pokeys_up", "", "1 = the device runs and its data is fresh")
        for name in self._hub.source.names():
            reading = self._hub.source.read(name, diagnostics=True)
            if not reading:
                continue
            sheet.add(up, {"device": name}, float(reading.connected))
            if reading.state:
                self._device(sheet, reading, reading.state)
        yield from sheet.all()
        yield GaugeMetricFamily("pokeys_daemon_up", "1 = a daemon is running", float(not self._hub.source.trouble))
        yield InfoMetricFamily("pokeys_gateway_build", "Version of the gateway", {"version": __version__})
        gate, rpc = self._gate, self._rpc
        yield GaugeMetricFamily("pokeys_gateway_connections", "Connections of all kinds", len(gate))
        yield CounterMetricFamily("pokeys_gateway_refused", "Connections refused because there were too many",
                                  gate.refused)
        yield CounterMetricFamily("pokeys_gateway_late", "Connections closed because nothing came, or was taken",
                                  gate.late)
        yield CounterMetricFamily("pokeys_gateway_denied", "Log-ins that were denied", self._access.denied)
        yield GaugeMetricFamily("pokeys_gateway_waiting", "Messages to WebSocket clients that wait", rpc.waiting)
        yield GaugeMetricFamily("pokeys_gateway_clients", "WebSocket clients", len(rpc.connections))
        yield GaugeMetricFamily("pokeys_gateway_feeds", "Different subscriptions; equal ones are one", len(rpc.feeds))
        yield CounterMetricFamily("pokeys_gateway_skipped", "States that slow clients did not get", rpc.skipped)
        yield CounterMetricFamily("pokeys_gateway_closed", "Clients that read nothing and were closed", rpc.closed_slow)
        lag = self._hub.lag
        total = list(accumulate(lag.counts))
        yield HistogramMetricFamily("pokeys_gateway_loop_lag_seconds", "How late the event loop was", [
            (bound, float(count)) for bound, count in zip((*map(str, LAGS_S), "+Inf"), total, strict=True)], lag.total)
        yield GaugeMetricFamily("pokeys_gateway_loop_lag_most_seconds", "The same, the most since the start", lag.most)
        yield CounterMetricFamily("pokeys_gateway_loop_late", "How often it was more than 10 ms late", lag.late)
        yield from self._of_console()

    def _of_console(self) -> Iterator[Metric]:
        console, router = self._console, self._console.router
        clients = list(router.clients)
        machine = [router.machine] if router.machine else []
        for name, text, value in (
                ("clients", "Clients of the console", len(clients)),
                ("machine_up", "1 = the machine behind the console is connected", len(machine)),
                ("messages", "Messages in memory", console.ledger.live)):
            yield GaugeMetricFamily(f"pokeys_gateway_console_{name}", text, value)
        for name, text, value in (
                ("machine_connections", "How often the machine was found", console.connections),
                ("routed", "Messages of clients and of the machine", router.routed),
                ("ended", "Lines that were ended because their client did not", router.ended),
                ("stops", "Stops that went past all other lines", router.stops),
                ("dropped", "Lines that slow clients did not get", router.dropped),
                ("refused", "Connections refused because there were too many", console.refused),
                ("closed", "Clients that read nothing and were closed", console.closed_slow)):
            yield CounterMetricFamily(f"pokeys_gateway_console_{name}", text, value)
        for name, text, of in (("waiting", "Messages that wait for clients", len),
                               ("waiting_most", "Messages that waited for one client at once, the most", _most)):
            family = GaugeMetricFamily(f"pokeys_gateway_console_{name}", text, labels=["kind"])
            for kind, found in groupby(sorted(clients + machine, key=_kind), _kind):
                numbers = [of(one.outbox) for one in found]
                family.add_metric([kind], max(numbers) if of is _most else sum(numbers))
            yield family

    def _device(self, sheet: _Sheet, reading: Reading, state: pokeys.State) -> None:
        name, info = reading.name, state.info
        if state.age_us is not None:
            sheet.add(Family("pokeys_data_age_seconds", "", "Age of the inputs and positions"), {"device": name},
                      state.age_us / 1e6)
        if info.SerialNumber:
            sheet.put(InfoMetricFamily("pokeys_device", "The device", labels=["device"])).add_metric(
                [name], {"serial": str(info.SerialNumber), "type": info.type, "address": info.address or "",
                         "firmware": f"{info.FirmwareMajor}.{info.FirmwareMinor}.{info.FirmwareRevision}"})
        if state.daemon_alive:
            self._words(sheet, reading, state)
        if reading.connected:
            self._values(sheet, name, state)
        for family, row in self._single:
            # counters go on while the daemon lives; all else would stand still at what it was
            value = self._take(reading, row.name) if reading.connected or family.counts else None
            if value is not None and (not row.name.startswith(ENGINE) or info.pulse_engine_version):
                sheet.add(family, {"device": name}, float(value) * family.factor)
        self._counters(sheet, reading, state)

    def _values(self, sheet: _Sheet, name: str, state: pokeys.State) -> None:
        self._loop_states(sheet, name, state)
        for family, row in self._rows:
            value = state[row.name] if is_set_up(row, state) else None
            place = self._place(family, row, state)
            # a PWM channel may be on no terminal; what is not known is not a number
            if value is not None and value == value and place.get("terminal") != "":
                sheet.add(family, {"device": name, **place, **dict(family.labels)}, float(value) * family.factor)

    @staticmethod
    def _take(reading: Reading, name: str) -> Any:
        for image in (reading.state, reading.diagnostics):
            if image is not None:
                try:
                    return image[name]
                except KeyError:
                    continue
        return None

    def _loop_states(self, sheet: _Sheet, name: str, state: pokeys.State) -> None:
        for label, row in self._loops:
            if is_set_up(row, state):
                metric, text = LOOPS[label]
                sheet.put(StateSetMetricFamily(metric, text, labels=["device", label])).add_metric(
                    [name, state[f"{label}.{row.number:02}.name"]],
                    {word: number == state[row.name] for number, word in row.words.items() if number})

    def _place(self, family: Family, row: Row, state: pokeys.State) -> dict[str, str]:
        if family.label in LOOPS:
            return {family.label: state[f"{family.label}.{row.number:02}.name"]}
        if family.label:
            return {family.label: str(row.number)}
        model, hardware = self._hub.model, state.info.DeviceTypeID
        return {"terminal": model.terminal(row, hardware) or model.label(row, hardware),
                "name": row.name}

    def _words(self, sheet: _Sheet, reading: Reading, state: pokeys.State) -> None:
        name = reading.name
        for metric, (value, text) in STATES.items():
            if value.startswith(ENGINE) and not (reading.connected and state.info.pulse_engine_version):
                continue
            words, now = self._hub.model.rows[value].words, state[value]
            sheet.put(StateSetMetricFamily(metric, text, labels=["device"])).add_metric(
                [name], {word: number == now for number, word in words.items()})
        fault = Family("pokeys_fault", "", "Why the device does not run; the word is in the label")
        if state.fault and state.link_state != RUNNING:
            sheet.add(fault, {"device": name, "fault": state.word("fault")}, 1.0)

    @staticmethod
    def _counters(sheet: _Sheet, reading: Reading, state: pokeys.State) -> None:
        packets = Family("pokeys_packets_total", "", "Packets, by kind", counts=True)
        for kind in PACKETS:
            sheet.add(packets, {"device": reading.name, "kind": kind}, float(state[f"packets.{kind}"]))
        if reading.diagnostics:
            for what, histogram in reading.diagnostics.histograms().items():
                metric = f"pokeys_{HISTOGRAMS.get(what, what.replace('-', '_'))}_seconds"
                text = pokeys.describe(f"latency.{what}-p50-us").split(":")[0]
                family = sheet.put(HistogramMetricFamily(metric, text, labels=["device"]))
                buckets, total = _histogram(histogram)
                family.add_metric([reading.name], buckets=buckets, sum_value=total)


class Metrics:
    """The page for Prometheus."""

    def __init__(self, hub: Hub, gate: Gate, rpc: Rpc, access: Access, console: Console) -> None:
        self._registry = CollectorRegistry(auto_describe=False)
        self._registry.register(Values(hub, gate, rpc, access, console))
        OwnProcess(registry=self._registry)
        PlatformCollector(registry=self._registry)
        GCCollector(registry=self._registry)

    def page(self, accept: str) -> tuple[bytes, str]:
        """The text and its content type, in the form that the client accepts. For another thread."""
        encoder, kind = choose_encoder(accept)
        return encoder(self._registry), kind
