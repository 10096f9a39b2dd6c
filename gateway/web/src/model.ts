// SPDX-License-Identifier: GPL-2.0-or-later
// What the page knows of the devices, and the values of the last minutes.

import type { State, Value, Values } from "./link.js";

/** A value that belongs to a terminal of the board, and is set up as that. */
export interface Terminal {
	name: string;
	terminal: string;
	label: string;
	kind: "input" | "output" | "external" | "analog" | "pwm" | "counter";
}

/** What has happened to a device. */
export interface Event {
	epoch: number;
	number: number;
	time: string;
	level: string;
	text: string;
	held: number;
}

/** By name, in which %02u stands for a number, and by number. */
export type Words = Record<string, Record<string, string>>;

export const KEPT_MS = 5 * 60 * 1000;
export const EVENTS_MOST = 128;         // as many as the daemon keeps
const EVERY_MS = 250, GAP_MS = 1000, OLD_ANALOG_US = 1e6;
/** Some of them change always (age-us): that nothing comes says that something is wrong. */
const FIXED = [
	"age-us", "age.analog-us", "age.analog-slow-us", "reconnects", "cycles-late", "rtt-avg-us", "packets.resent",
	"packets.lost", "packets.error-level", "daemon.period-us", "engine-state", "emergency", "machine-on-permitted",
	"safe-state", "outputs-held", "commander-alive", "info.type", "info.SerialNumber", "info.address", "info.Axes",
	"info.FirmwareMajor", "info.FirmwareMinor", "info.FirmwareRevision", "info.pulse-engine-version",
];
const AXIS = ["counts", "counts-cmd", "state", "enabled", "homed", "limit-neg", "limit-pos", "home-sw", "error",
	"soft-limit", "mode-in-effect"];
const ENCODER = ["rawcounts", "enabled"];
/** The values of closed loops, of which a device may have none. */
const LOOPS = {
	heater: ["name", "temperature", "target-in-effect", "power", "power-limited", "fan", "at-temperature", "fault-code", "condition",
		"obstacle", "refused"],
	servo: ["name", "pos-fb", "error", "output", "fault-code", "condition", "obstacle", "refused", "homed", "limit-minus", "limit-plus"],
};

export const two = (number: number): string => String(number).padStart(2, "0");

/** The values of the last minutes, at most four rows a second; a row of nulls where there were none. */
export class History {
	/** Seconds since 1970, ascending. */
	times: number[] = [];
	series = new Map<string, (number | null)[]>();
	private last = -Infinity;
	private empty = false;

	/** Take these values, or note that there are none. */
	take(names: string[], values: Record<string, Value> | null): void {
		const now = performance.now(), passed = now - this.last;
		// the first row without values is a gap, however short
		if (passed < EVERY_MS && (values || this.empty))
			return;
		const time = Date.now() / 1000, before = this.times.at(-1);
		// the clock was set back: what there is cannot be drawn any more
		if (before !== undefined && time <= before) {
			this.times = [];
			this.series.clear();
		}
		for (const name of names)
			if (!this.series.has(name))
				this.series.set(name, this.times.map(() => null));
		// while a computer or a tab sleeps, nothing is called
		if (before !== undefined && time - before > GAP_MS / 1000)
			this.row(before + 0.001, null);
		this.row(time, values);
		this.last = now;
		this.empty = values === null;
		this.forget(time - KEPT_MS / 1000, names);
	}

	private row(time: number, values: Record<string, Value> | null): void {
		this.times.push(time);
		for (const [name, column] of this.series) {
			const value = values?.[name];
			column.push(typeof value === "number" ? value : null);
		}
	}

	private forget(until: number, names: string[]): void {
		const old = this.times.findIndex(time => time >= until);
		// not at each row: it moves all of them
		if (old < 100)
			return;
		this.times.splice(0, old);
		for (const [name, column] of this.series) {
			column.splice(0, old);
			if (!names.includes(name) && column.every(value => value === null))
				this.series.delete(name);
		}
	}
}

/** One device of the page. */
export class Device {
	terminals: Terminal[] = [];
	events: Event[] = [];
	history = new History();
	/** The last that were read; they stay when there are none any more. */
	values: Values = {};
	/** undefined = nothing was heard of it yet, null = there is none of this name any more */
	state: State | null | undefined = undefined;
	/** Are these the values of this moment? */
	fresh = false;

	constructor(readonly name: string) {
	}

	/** Take events: those from the last one on, or all of them if that one is no longer there. */
	hear(found: Event[]): void {
		const [first, had] = [found[0], this.events.at(-1)];
		if (!first)
			return;
		const goesOn = first.epoch === had?.epoch && first.number === had.number;
		if (!goesOn)
			this.events = found;
		else if (found.length > 1 || first.held !== had.held)
			this.events = [...this.events.slice(0, -1), ...found].slice(-EVENTS_MOST);
	}

	/** The names of its heaters or servo motors, such as heater.00. */
	loops(kind: keyof typeof LOOPS): string[] {
		const found = [];
		for (let i = 0; this.values[`${kind}.${two(i)}.state`]; i++)
			found.push(`${kind}.${two(i)}`);
		return found;
	}

	/** The patterns of names that are wanted of it. */
	wish(): string[] {
		const loops = (Object.keys(LOOPS) as (keyof typeof LOOPS)[]).flatMap(kind => [`${kind}.*.state`,
			...this.loops(kind).flatMap(one => LOOPS[kind].map(name => `${one}.${name}`))]);
		return [...FIXED, ...AXIS.map(name => `joint.*.${name}`), ...ENCODER.map(name => `encoder.*.${name}`),
			...loops, ...this.terminals.map(({ name }) => name)];
	}

	/** The voltage at an analog input, or null if it is not known now. */
	volts(name: string): number | null {
		// the first two inputs are read less often
		const age = this.values[name < "adc.02" ? "age.analog-slow-us" : "age.analog-us"];
		const value = this.values[name];
		return this.fresh && typeof age === "number" && age < OLD_ANALOG_US && typeof value === "number" ? value : null;
	}

	/** Take what the link has, and whether it is of this moment. */
	take(state: State | null | undefined, live: boolean): void {
		this.state = state;
		this.fresh = live && Boolean(state?.connected);
		if (state && Object.keys(state.values).length)
			this.values = state.values;
		const analog = this.terminals.filter(({ kind }) => kind === "analog").map(({ name }) => name);
		const volts = Object.fromEntries(analog.map(name => [name, this.volts(name)]));
		const heaters = this.loops("heater").flatMap(one => [`${one}.temperature`, `${one}.target-in-effect`]);
		// a target of 0 is none
		const celsius = Object.fromEntries(heaters.map(name => [name, this.values[name] || (name.endsWith(".temperature") ? this.values[name] ?? null : null)]));
		this.history.take([...analog, ...heaters], this.fresh ? { ...volts, ...celsius } : null);
	}
}
