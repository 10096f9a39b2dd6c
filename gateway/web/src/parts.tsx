// SPDX-License-Identifier: GPL-2.0-or-later
// The parts of a device. Colour never says anything alone: each state has a word or a sign too.

import type { ComponentChildren } from "preact";
import { memo } from "preact/compat";
import { two, type Device, type Event, type Terminal, type Words } from "./model.js";
import { Plot, type Line } from "./plot.js";

const whole = new Intl.NumberFormat("en");
const clock = new Intl.DateTimeFormat(undefined, { timeStyle: "medium" });
const calendar = new Intl.DateTimeFormat(undefined, { dateStyle: "medium" });

export const number = (value: unknown): value is number => typeof value === "number";
const ms = (us: unknown): string => number(us) ? `${(us / 1000).toFixed(us < 10000 ? 2 : 1)} ms` : "–";
const count = (value: unknown): string => number(value) ? whole.format(value) : "–";

/** A time of day, with the date if it is not today's. */
export function moment(time: Date): string {
	const day = calendar.format(time);
	return day === calendar.format(new Date()) ? clock.format(time) : `${day}, ${clock.format(time)}`;
}

export function Part({ device, title, children }: { device: Device; title: string; children: ComponentChildren }) {
	return <section class="part" aria-label={`${device.name}: ${title}`}><h3>{title}</h3>{children}</section>;
}

/** A table that scrolls by itself on a narrow screen. */
export function Table({ label, heads, rows }: { label: string; heads: string[]; rows: ComponentChildren[][] }) {
	return <div class="scroll"><table aria-label={label}>
		<thead><tr>{heads.map(head => <th key={head} scope="col">{head}</th>)}</tr></thead>
		<tbody>{rows.map((row, i) => <tr key={i}>{row.map((cell, j) => j === 0 ? <th key={j} scope="row">{cell}</th> :
			<td key={j}>{cell}</td>)}</tr>)}</tbody>
	</table></div>;
}

export function Mark({ text, kind }: { text: string; kind: "good" | "bad" | "plain" }) {
	return <span class={`mark ${kind}`}>{kind === "bad" ? "⚠ " : ""}{text}</span>;
}

/** What the machine is allowed to do, in words. What is old permits nothing. */
export function Machine({ device, words }: { device: Device; words: Words }) {
	const { values, fresh } = device;
	if (!fresh)
		return <p class="marks"><Mark kind="bad" text="state of the machine not known" /></p>;
	// what is not known is not shown as if it were good
	const held = (name: string, text: string) => values[name] === false ? null : values[name] === true ?
		<Mark kind="bad" text={text} /> : <Mark kind="plain" text={`${text}: not known`} />;
	const engine = values["info.pulse-engine-version"] ? words["engine-state"]?.[String(values["engine-state"])] : undefined;
	return <p class="marks">
		{held("emergency", "emergency stop")}
		{held("safe-state", "safe state")}
		{held("outputs-held", "outputs held until machine-on")}
		<Mark kind={values["commander-alive"] ? "good" : "plain"}
			text={values["commander-alive"] ? "commander present" : "no commander"} />
		<Mark kind={values["machine-on-permitted"] ? "good" : "plain"}
			text={values["machine-on-permitted"] ? "motion permitted" : "motion not permitted"} />
		{engine && <Mark kind="plain" text={`pulse engine ${engine}`} />}
	</p>;
}

/** The connection between daemon and device. */
export function Quality({ device }: { device: Device }) {
	const { values } = device;
	const losing = values["packets.error-level"];
	const rows: [string, string][] = [
		["age of inputs and positions", ms(values["age-us"])],
		["round trip, mean", ms(values["rtt-avg-us"])],
		["cycle", ms(values["daemon.period-us"])],
		["cycles late", count(values["cycles-late"])],
		["packets sent again", count(values["packets.resent"])],
		["packets lost", count(values["packets.lost"])],
		["lost recently", losing === null || losing === undefined ? "–" : losing ? "⚠ yes" : "no"],
		["reconnects", count(values["reconnects"])],
	];
	return <Part device={device} title="Connection"><dl>{rows.map(([name, text]) =>
		<div key={name}><dt>{name}</dt><dd class={text.startsWith("⚠") ? "bad" : ""}>{text}</dd></div>)}</dl></Part>;
}

const NOT_DRIVEN = 0, SPEED = 2;        // of joint.NN.mode-in-effect

/** Positions and what each axis is doing. */
export function Axes({ device, words }: { device: Device; words: Words }) {
	const { values } = device;
	const axes = [...Array(Number(values["info.Axes"] ?? 0)).keys()].filter(i => `joint.${two(i)}.counts` in values);
	if (!axes.length)
		return null;
	const rows = axes.map(i => {
		const of = (name: string) => values[`joint.${two(i)}.${name}`];
		const state = words["joint.%02u.state"]?.[String(of("state"))] ?? `state ${of("state")}`;
		const mode = of("mode-in-effect"), command = count(of("counts-cmd"));
		return [String(i), <span class="number">{count(of("counts"))}</span>, <span class="number">{
			mode === NOT_DRIVEN ? "–" : mode === SPEED ? `${command}/s` : command}</span>,
		<span class="marks">{state}
			{of("error") && <Mark kind="bad" text="driver error" />}
			{of("limit-neg") && <Mark kind="bad" text="limit −" />}
			{of("limit-pos") && <Mark kind="bad" text="limit +" />}
			{of("soft-limit") && <Mark kind="bad" text="soft limit" />}
			{of("enabled") && <Mark kind="good" text="enabled" />}
			{of("homed") && <Mark kind="good" text="homed" />}
			{of("home-sw") && <Mark kind="plain" text="home switch" />}
		</span>];
	});
	return <Part device={device} title="Axes, in pulses">
		<Table label="Axes, in pulses" heads={["axis", "position", "command", "state"]} rows={rows} /></Part>;
}

const SIGNS = { input: "in", output: "out", external: "out", analog: "analog", pwm: "PWM", counter: "count" };

function shown({ name, kind }: Terminal, device: Device): { text: string; on: boolean } {
	const value = device.values[name];
	if (kind === "analog") {
		const volts = device.fresh ? device.volts(name) : value;
		return { text: number(volts) ? `${volts.toFixed(2)} V` : "–", on: false };
	}
	if (kind === "pwm")
		return { text: number(value) ? `${(value * 100).toFixed(0)} %` : "–", on: Boolean(value) };
	if (kind === "counter")
		return { text: count(value), on: false };
	return { text: value === null || value === undefined ? "–" : value ? "on" : "off", on: value === true };
}

/** The board's terminals that are set up, in the order of the board. */
export function Strip({ device }: { device: Device }) {
	if (!device.terminals.length)
		return null;
	return <Part device={device} title="Terminals"><ul class="strip">{device.terminals.map(one => {
		const { text, on } = shown(one, device);
		return <li key={one.name} class={`${one.kind}${on ? " on" : ""}`} title={one.name}>
			<span class="terminal">{one.terminal || one.label}</span>
			{one.terminal && one.label && <span class="label" title={one.label}>{one.label}</span>}
			<span class="kind">{SIGNS[one.kind]}</span>
			<span class="level">{on ? "● " : ""}{text}</span>
		</li>;
	})}</ul></Part>;
}

/** The analog inputs of the last minutes. */
export function Analog({ device }: { device: Device }) {
	const lines: Line[] = device.terminals.filter(({ kind }) => kind === "analog").map(({ name, terminal, label }) => {
		const volts = device.volts(name);
		return { name, label: label ? `terminal ${terminal} ${label}` : `terminal ${terminal}`, now: volts === null ? "–" : `${volts.toFixed(3)} V` };
	});
	return lines.length ? <Part device={device} title="Analog inputs">
		<Plot history={device.history} lines={lines} unit="V" /></Part> : null;
}

/** Counts of the encoders that are set up. */
export function Encoders({ device }: { device: Device }) {
	const { values } = device;
	const rows: ComponentChildren[][] = [];
	for (let i = 0; `encoder.${two(i)}.enabled` in values; i++)
		if (values[`encoder.${two(i)}.enabled`])
			rows.push([String(i), <span class="number">{count(values[`encoder.${two(i)}.rawcounts`])}</span>]);
	return rows.length ? <Part device={device} title="Encoders"><Table label="Encoders" heads={["encoder", "count"]} rows={rows} /></Part> : null;
}

/** What has happened, the newest first. */
export const Events = memo(({ events, name }: { events: Event[]; name: string }) =>
	<section class="part" aria-label={`${name}: Events`}><h3>Events</h3><ul class="events">
		{events.slice().reverse().map(({ epoch, number, time, level, text, held }) =>
			<li key={`${epoch}.${number}`} class={level === "error" ? "bad" : ""}>
				<time dateTime={time}>{moment(new Date(time))}</time> {level === "error" || level === "warning" ? `⚠ ${level}: ` : ""}
				{text}{held ? ` (and ${held} more)` : ""}</li>)}
	</ul></section>);
