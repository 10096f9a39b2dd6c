// SPDX-License-Identifier: GPL-2.0-or-later
// Heaters and servo motors: what they do, and what is wrong with them.

import type { Device, Words } from "./model.js";
import { Mark, number, Part, Table } from "./parts.js";
import { Plot } from "./plot.js";

const FAN_ON = 2;
// of heater.NN.state and servo.NN.state
const HEATER = { off: 1, heating: 2, tuning: 3, stopping: 5 }, SERVO = { enabled: 2, stopping: 4 };

const fixed = (value: unknown, digits: number, unit = ""): string => number(value) ?
	// no "-0"
	`${(Number(value.toFixed(digits)) + 0).toFixed(digits)}${unit}` : "–";
const percent = (value: unknown): string => fixed(number(value) ? value * 100 : value, 0, " %");

/** Why it is off, and why it cannot be on: below the table, where it is seen on a narrow screen as well. */
function Troubles({ device, one, words, refusal }: { device: Device; one: string; words: Words; refusal: string }) {
	const of = (name: string) => device.values[`${one}.${name}`];
	const word = (name: string) => words[`${one.replace(/\d+$/, "%02u")}.${name}`]?.[String(of(name))] ?? `${name} ${of(name)}`;
	const [fault, condition] = [of("fault-code"), of("condition")];
	const why = of("obstacle") ? ` (${word("obstacle")})` : "";
	const texts = [
		fault && `fault: ${word("fault-code")}, off until it is reset${condition === fault ? why : ""}`,
		condition && condition !== fault && `not ready: ${word("condition")}${why}`,
		of("refused") && `${refusal}: ${word("refused")}`,
	];
	return <>{texts.filter(Boolean).map(text => <p class="bad trouble">⚠ {of("name") ?? one}: {text}</p>)}</>;
}

/** Temperatures and targets, now and of the last minutes. */
export function Heaters({ device, words }: { device: Device; words: Words }) {
	const heaters = device.loops("heater");
	if (!heaters.length)
		return null;
	const of = (one: string, name: string) => device.values[`${one}.${name}`];
	const name = (one: string) => String(of(one, "name") ?? one);
	const now = (one: string) => (of(one, "target-in-effect") ? `${fixed(of(one, "temperature"), 1)} → ${
		fixed(of(one, "target-in-effect"), 1, " °C")}` : fixed(of(one, "temperature"), 1, " °C"));
	const rows = heaters.map(one => {
		const state = of(one, "state");
		return [name(one), <span class="number">{fixed(of(one, "temperature"), 1, " °C")}</span>,
			<span class="number">{of(one, "target-in-effect") ? fixed(of(one, "target-in-effect"), 1, " °C") : "off"}</span>,
			<span class="number">{percent(of(one, "power"))}</span>,
			<span class="marks">
				{state === HEATER.heating && <Mark kind="plain" text="heating" />}
				{state === HEATER.tuning && <Mark kind="plain" text="searching for gains" />}
				{state === HEATER.off && !of(one, "condition") && <Mark kind="plain" text="off" />}
				{state === HEATER.stopping && <Mark kind="bad" text="off is not acknowledged: it may still heat" />}
				{of(one, "fault-code") ? <Mark kind="bad" text="fault" /> : of(one, "condition") ? <Mark kind="bad" text="not ready" /> : null}
				{of(one, "at-temperature") && <Mark kind="good" text="at temperature" />}
				{of(one, "power-limited") && <Mark kind="plain" text="power limited" />}
				{of(one, "fan") === FAN_ON && <Mark kind="plain" text="fan on" />}
			</span>];
	});
	const lines = heaters.map(one => ({ name: `${one}.temperature`, label: name(one), now: now(one),
		target: `${one}.target-in-effect` }));
	return <Part device={device} title="Heaters">
		<Table label="Heaters" heads={["heater", "temperature", "target", "power", "state"]} rows={rows} />
		{heaters.map(one => <Troubles key={one} device={device} one={one} words={words} refusal="target refused" />)}
		<Plot history={device.history} lines={lines} unit="°C" /></Part>;
}

/** Where the axes of servo motors are, and how far from where they should be. */
export function Servos({ device, words }: { device: Device; words: Words }) {
	const servos = device.loops("servo");
	const rows = servos.map(one => {
		const of = (name: string) => device.values[`${one}.${name}`];
		const state = of("state");
		return [String(of("name") ?? one), <span class="number">{fixed(of("pos-fb"), 3)}</span>,
			<span class="number">{fixed(of("error"), 3)}</span>, <span class="number">{percent(of("output"))}</span>,
			<span class="marks">
				{state === SERVO.enabled && <Mark kind="good" text="enabled" />}
				{state === SERVO.stopping && <Mark kind="bad" text="off is not acknowledged: it may still run" />}
				{of("fault-code") ? <Mark kind="bad" text="fault" /> : of("condition") ? <Mark kind="bad" text="not ready" /> : null}
				{of("homed") && <Mark kind="good" text="homed" />}
				{of("limit-minus") && <Mark kind="bad" text="limit −" />}
				{of("limit-plus") && <Mark kind="bad" text="limit +" />}
			</span>];
	});
	return rows.length ? <Part device={device} title="Servo motors">
		<Table label="Servo motors" heads={["motor", "position", "error", "output", "state"]} rows={rows} />
		{servos.map(one => <Troubles key={one} device={device} one={one} words={words} refusal="not enabled" />)}</Part> : null;
}
