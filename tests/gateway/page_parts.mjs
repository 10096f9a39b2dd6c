// SPDX-License-Identifier: GPL-2.0-or-later
// The page's connection and its history, under node and in virtual time: no browser, no gateway, no waiting.
// usage: page_parts.mjs SOURCES NODE_MODULES

import assert from "node:assert/strict";
import { mkdtemp, rm } from "node:fs/promises";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const [sources, modules] = process.argv.slice(2);
const { build } = createRequire(join(modules, "x.js"))("esbuild");
const folder = await mkdtemp(join(tmpdir(), "pokeysd-test-"));
await build({ entryPoints: ["link", "model"].map(name => join(sources, `${name}.ts`)), outdir: folder,
	format: "esm", outExtension: { ".js": ".mjs" }, bundle: true });
const { Link } = await import(join(folder, "link.mjs"));
const { Device, EVENTS_MOST, History, KEPT_MS } = await import(join(folder, "model.mjs"));
await rm(folder, { recursive: true });

let now = 0;
let timers = [];
const listeners = {};
const realDate = Date;
const began = Date.now();
globalThis.performance = { now: () => now };
globalThis.setInterval = (call, every) => timers.push({ call, every, at: now + every });
globalThis.document = { addEventListener: (name, call) => (listeners[name] = call) };
let step = 0;                   // of the clock on the wall
globalThis.Date = class extends realDate {
	constructor(...given) {
		super(...(given.length ? given : [began + now + step]));
	}

	static now() {
		return began + now + step;
	}
};

const settle = () => new Promise(resolve => setImmediate(resolve));

/** Let time pass; what is due is called when it is due. */
async function pass(ms, each = () => undefined) {
	const end = now + ms;
	while (now < end) {
		const next = Math.min(end, ...timers.map(({ at }) => at));
		now = next;
		for (const timer of timers.filter(({ at }) => at <= now)) {
			timer.at += timer.every;
			timer.call();
		}
		each();
		await settle();
	}
}

class Socket {
	static OPEN = 1;
	static all = [];

	constructor(address) {
		Object.assign(this, { address, readyState: 0, sent: [], closed: false });
		Socket.all.push(this);
	}

	send(text) {
		this.sent.push(JSON.parse(text));
	}

	close() {
		this.closed = true;
		this.readyState = 3;
	}

	open() {
		this.readyState = 1;
		this.onopen();
	}

	say(message) {
		this.onmessage({ data: JSON.stringify({ jsonrpc: "2.0", ...message }) });
	}

	/** Answer all requests. */
	answer(result = {}) {
		for (const { id } of this.sent.splice(0))
			this.say({ id, result });
	}

	state(status, serial, full = false) {
		this.say({ method: "notify_status_update", params: [status, 0, { serial, full }] });
	}
}

globalThis.WebSocket = Socket;
const last = () => Socket.all.at(-1);

/** A link with a connection and a subscription. */
async function connected(opened = async () => undefined) {
	now += 1e6;
	timers = [];
	Socket.all = [];
	const link = new Link("ws://x/websocket", signal => opened(signal, link), () => undefined);
	assert.equal(Socket.all.length, 1);
	last().open();
	await settle();
	return link;
}

async function a_link_notices_silence_within_two_seconds() {
	for (let quiet = 0; quiet < 500; quiet += 50) {
		const link = await connected();
		assert.equal(link.lostSince, null);
		const socket = last();
		await pass(3000 + quiet, () => socket.answer());
		assert.equal(link.lostSince, null, "though it was asked, and answered");
		const before = now;
		while (link.lostSince === null)
			await pass(50);
		assert.ok(now - before <= 2000, `${now - before} ms`);
		assert.ok(socket.closed);
		// and comes back by itself, as soon as somebody answers
		await pass(2000);
		const waiting = last();
		assert.ok(waiting !== socket && !waiting.closed);
		waiting.open();
		await settle();
		assert.equal(link.lostSince, null);
	}
}

async function one_that_speaks_is_not_asked() {
	const link = await connected();
	let serial = 0;
	await pass(10000, () => last().state({ mill: { values: { x: ++serial } } }, serial));
	assert.deepEqual([last().sent, link.lostSince, Socket.all.length], [[], null, 1]);
}

async function a_tab_that_slept_asks_before_it_gives_up() {
	const link = await connected();
	await pass(1000, () => last().answer());
	now += 30000;           // frozen: no timer was called
	timers.forEach(timer => (timer.at = now + timer.every));
	listeners.resume();
	assert.equal(last().sent.length, 1);
	last().answer();
	await pass(5000, () => last().answer());
	assert.deepEqual([link.lostSince, Socket.all.length], [null, 1]);
	// the gateway has closed it meanwhile
	last().onclose();
	assert.notEqual(link.lostSince, null);
	listeners.visibilitychange();
	assert.equal(Socket.all.length, 2);
}

async function changes_are_put_together() {
	const link = await connected();
	const subscribed = link.subscribe({ mill: ["*"] }, 10);
	last().answer({ status: { mill: { connected: true, reason: "", values: { a: 1, b: 2 } }, lathe: null } });
	await subscribed;
	const is = (name, wanted) => assert.deepEqual(link.states.get(name), wanted);
	last().state({ mill: { values: { b: 3 } } }, 1);
	is("mill", { connected: true, reason: "", values: { a: 1, b: 3 } });
	last().state({ mill: { connected: false, reason: "lost" } }, 2);
	is("mill", { connected: false, reason: "lost", values: { a: 1, b: 3 } });
	last().state({ mill: null, lathe: { connected: true, reason: "", values: { c: 1 }, whole: true } }, 3);
	is("mill", null);
	assert.deepEqual(link.states.get("lathe").values, { c: 1 });
	last().state({ lathe: { connected: true, reason: "", values: { d: 2 }, whole: true } }, 4);
	assert.deepEqual(link.states.get("lathe").values, { d: 2 });
	last().state({ mill: { connected: true, reason: "", values: { a: 5 } }, lathe: null }, 9, true);
	is("mill", { connected: true, reason: "", values: { a: 5 } });
	is("lathe", null);
}

async function what_fails_is_said_and_tried_again() {
	let signal;
	const link = await connected(async (given, mine) => {
		signal = given;
		await mine.ask("objects.list");
	});
	last().say({ id: last().sent[0].id, error: { code: -32602, message: "no value is named 'x'" } });
	await settle();
	assert.deepEqual([link.error, link.everLive, signal.aborted], ["no value is named 'x'", false, true]);
	await pass(1000);
	last().open();
	last().answer();
	await settle();
	assert.deepEqual([link.error, link.everLive, link.lostSince], ["", true, null]);
	// what was asked of a connection that is lost is not waited for
	const asked = assert.rejects(link.ask("server.info"), /was lost/);
	const old = last();
	old.onclose();
	await asked;
	// and what an old connection still says is of no interest
	old.state({ mill: null }, 1);
	assert.equal(link.states.size, 0);
}

async function who_may_not_is_not_tried() {
	const link = await connected();
	link.held = true;
	link.restart();
	await pass(5000);
	assert.deepEqual([Socket.all.length, Socket.all[0].closed], [1, true]);
	link.held = false;
	link.restart();
	assert.equal(Socket.all.length, 2);
}

async function a_history_is_bounded_and_has_gaps() {
	now = 1e9;
	const history = new History();
	for (let i = 0; i < 20000; i++) {
		now += 100;
		history.take(["a"], { a: i });
	}
	const most = KEPT_MS / 250 + 110;
	assert.ok(history.times.length <= most && history.times.length >= KEPT_MS / 300 - 2, history.times.length);
	assert.equal(history.series.get("a").length, history.times.length);
	assert.ok(history.times.every((time, i) => i === 0 || time > history.times[i - 1]));
	assert.equal(history.series.get("a").includes(null), false);
	// a tab that slept for a minute draws no line over it
	now += 60000;
	history.take(["a"], { a: 1 });
	assert.deepEqual(history.series.get("a").slice(-2), [null, 1]);
	// nor is a short loss hidden
	now += 100;
	history.take(["a"], null);
	assert.equal(history.series.get("a").at(-1), null);
	const rows = history.times.length;
	now += 100;
	history.take(["a"], null);
	assert.equal(history.times.length, rows);
	// what was plotted once, and is no longer, goes when it is old
	for (let i = 0; i < 5000; i++) {
		now += 100;
		history.take(["b"], { b: i });
	}
	assert.deepEqual([...history.series.keys()], ["b"]);
	// the clock is set back: it begins again
	step = -3600e3;
	now += 300;
	history.take(["b"], { b: 1 });
	now += 300;
	history.take(["b"], { b: 2 });
	assert.deepEqual([history.times.length, history.series.get("b")], [2, [1, 2]]);
	step = 0;
}

async function a_device_is_fresh_only_while_states_come() {
	const device = new Device("mill");
	device.terminals = [{ name: "adc.02.volts", terminal: "43", label: "", kind: "analog" }];
	const values = { "adc.02.volts": 1.5, "age.analog-us": 900, "info.type": "PoKeys57CNC" };
	device.take({ connected: true, reason: "", values }, true);
	assert.deepEqual([device.fresh, device.volts("adc.02.volts")], [true, 1.5]);
	// an analog input that is no longer read is not shown as if it were
	device.take({ connected: true, reason: "", values: { ...values, "age.analog-us": 5e6 } }, true);
	assert.equal(device.volts("adc.02.volts"), null);
	device.take({ connected: true, reason: "", values }, false);
	assert.deepEqual([device.fresh, device.volts("adc.02.volts")], [false, null]);
	// the daemon is gone: what was known stays, and is old
	device.take({ connected: false, reason: "no daemon", values: {} }, true);
	assert.deepEqual([device.fresh, device.values["info.type"]], [false, "PoKeys57CNC"]);
	device.take(null, true);
	assert.equal(device.fresh, false);
}

async function events_go_on_from_the_last_one() {
	const device = new Device("mill");
	const event = (number, held = 0, epoch = 7) => ({ epoch, number, held, time: "", level: "info", text: `${number}` });
	const numbers = () => device.events.map(({ number, held }) => [number, held]);
	device.hear([event(1), event(2)]);
	device.hear([event(2), event(3)]);
	assert.deepEqual(numbers(), [[1, 0], [2, 0], [3, 0]]);
	// nothing is new, and nothing is drawn again
	const had = device.events;
	device.hear([event(3)]);
	device.hear([]);
	assert.equal(device.events, had);
	// the last one has happened again
	device.hear([event(3, 4)]);
	assert.deepEqual(numbers(), [[1, 0], [2, 0], [3, 4]]);
	// the daemon has forgotten it, or is another one
	device.hear([event(3, 0, 8), event(4, 0, 8)]);
	assert.deepEqual(numbers(), [[3, 0], [4, 0]]);
	for (let i = 4; i < 1000; i++)
		device.hear([event(i, 0, 8), event(i + 1, 0, 8)]);
	assert.deepEqual([device.events.length, device.events.at(-1).number], [EVENTS_MOST, 1000]);
}

async function heaters_are_asked_for_when_they_are_known() {
	const device = new Device("mill");
	assert.ok(device.wish().includes("heater.*.state"));
	assert.ok(!device.wish().some(name => name.endsWith(".temperature")));
	device.take({ connected: true, values: { "heater.00.state": 1, "heater.01.state": 4, "heater.02.state": 0, "servo.00.state": 0,
		"heater.00.temperature": 25, "heater.01.temperature": null } }, true);
	assert.deepEqual(device.loops("heater"), ["heater.00", "heater.01"]);
	assert.deepEqual(device.loops("servo"), []);
	assert.deepEqual(device.wish().filter(name => name.endsWith(".temperature")), ["heater.00.temperature", "heater.01.temperature"]);
	assert.deepEqual([device.history.series.get("heater.00.temperature"), device.history.series.get("heater.01.temperature")],
		[[25], [null]]);
}

for (const test of [a_link_notices_silence_within_two_seconds, one_that_speaks_is_not_asked,
	a_tab_that_slept_asks_before_it_gives_up, changes_are_put_together, what_fails_is_said_and_tried_again, who_may_not_is_not_tried,
	a_history_is_bounded_and_has_gaps, a_device_is_fresh_only_while_states_come,
	events_go_on_from_the_last_one, heaters_are_asked_for_when_they_are_known]) {
	await test();
	console.log(test.name);
}
