// SPDX-License-Identifier: GPL-2.0-or-later
// The page: all devices of the gateway, live. Whatever comes from a device is put in as text, never as HTML.

import "uplot/dist/uPlot.min.css";
import "./page.css";
import { render } from "preact";
import { Console } from "./console.js";
import { ConsoleStop, Machine as Gcode } from "./gcode.js";
import { Doctor } from "./doctor.js";
import { Latency } from "./latency.js";
import { Link } from "./link.js";
import { LinuxCnc } from "./linuxcnc.js";
import { Heaters, Servos } from "./loops.js";
import { Login, User, type Session } from "./login.js";
import { Device, type Event, type Terminal, type Words } from "./model.js";
import { Operate, Stop } from "./operate.js";
import { Analog, Axes, Encoders, Events, Machine, moment, Quality, Strip } from "./parts.js";
import { Recorder, SaveNow, type Records } from "./records.js";

const RATE = 10, LOOK_MS = 2000, OLD_MS = 1500, RECORDS_MS = 5000;
const devices = new Map<string, Device>();
let words: Words = {};
let trouble = "";
let version = "";
let wished = "";
let looking = false;
let tried = false;
let session: Session | null = null;
let records: Records | null = null;

async function get<Answer>(path: string): Promise<Answer> {
	const answer = await fetch(path, { signal: AbortSignal.timeout(LOOK_MS) });
	if (!answer.ok)
		throw new Error(`${path}: status ${answer.status}`);
	return await answer.json() as Answer;
}

/** What the terminals of a device are now, and what has happened to it. What fails is as it was. */
async function lookAt(device: Device): Promise<void> {
	const terminals = async () => {
		const found = await get<{ terminals: Terminal[] }>(`api/devices/${encodeURIComponent(device.name)}/terminals`);
		// a device that has just been found has none yet
		if (found.terminals.length)
			device.terminals = found.terminals;
	};
	const events = async () => {
		const had = device.events.at(-1);
		const { events } = await link.ask<{ events: Event[] }>("events.list", {
			device: device.name, ...(had && { since: { epoch: had.epoch, number: had.number } }) });
		device.hear(events);
	};
	await Promise.allSettled([terminals(), events()]);
}

/** Ask for the flight recorder's files. A disk may be slow, so nothing else waits for this. */
async function lookAtRecords(): Promise<void> {
	const whose = session?.user ?? null;
	const found = await get<Records>("api/records");
	if (whose !== (session?.user ?? null) || JSON.stringify(found) === JSON.stringify(records))
		return;
	records = found;
	draw();
}

/** Find devices that are new, and subscribe to what there is. */
async function look(signal: AbortSignal | null): Promise<void> {
	const info = await link.ask<{ devices: string[]; trouble: string; version: string; operate: boolean }>("server.info");
	signal?.throwIfAborted();
	// of another version are the names, and the page
	if (version && info.version !== version)
		location.reload();
	({ trouble, version } = info);
	cnc.allowed = info.operate;
	cnc.look();
	await gcode.look();
	signal?.throwIfAborted();
	for (const name of devices.keys())
		if (!info.devices.includes(name))
			devices.delete(name);
	for (const name of info.devices)
		devices.set(name, devices.get(name) ?? new Device(name));
	await Promise.all([...devices.values()].map(lookAt));
	signal?.throwIfAborted();
	const objects = Object.fromEntries([...devices].map(([name, device]) => [name, device.wish()]));
	const wish = JSON.stringify(objects);
	if (wish !== wished && devices.size)
		await link.subscribe(objects, RATE);
	wished = wish;
}

/** Whose page this is now. Another one's devices are not shown to the next. */
function belong(found: Session): void {
	const other = session !== null && session.user !== found.user, held = link.held;
	session = found;
	link.held = found.required && !found.user;
	if (other) {
		devices.clear();
		gcode.reset();
		records = null;
	}
	if (other || held !== link.held)
		link.restart();
	draw();
}

async function opened(signal: AbortSignal): Promise<void> {
	wished = "";
	cnc.forget();
	gcode.forget();
	const [found] = await Promise.all([get<{ words: Words }>("api/words"), look(signal)]);
	signal.throwIfAborted();
	({ words } = found);
	lookAtRecords().catch(() => undefined);
}

function One({ device }: { device: Device }) {
	const { values, fresh, state } = device;
	const known = Boolean(values["info.type"]);
	const firmware = ["Major", "Minor", "Revision"].map(part => values[`info.Firmware${part}`]).join(".");
	const reason = state === null ? "The daemon has no device of this name any more." : state?.connected ? "" : state?.reason;
	return <article class={fresh ? "device" : "device old"} aria-label={device.name}>
		<header><h2>{device.name}</h2>
			{state === undefined ? <span class="mark plain">connecting …</span> : <span class={`mark ${fresh ? "good" : "bad"}`}>
				{fresh ? "data fresh" : known ? "⚠ what is shown is old" : "⚠ no data"}</span>}
			{known && <p>{String(values["info.type"])} {String(values["info.SerialNumber"])} at {String(values["info.address"])},
				firmware {firmware}</p>}
		</header>
		{reason && <p class="bad">{reason}</p>}
		{known && <div class="parts">
			<Machine device={device} words={words} />
			<Axes device={device} words={words} />
			<Servos device={device} words={words} />
			<Heaters device={device} words={words} />
			<Strip device={device} />
			<Encoders device={device} />
			<Analog device={device} />
			<Quality device={device} />
			<Latency name={device.name} get={get} />
		</div>}
		<Events events={device.events} name={device.name} />
		<SaveNow name={device.name} />
	</article>;
}

/** For the one line that is always to be seen, and read out: it must not change without a reason. */
function status(): { text: string; bad: boolean } {
	if (link.lostSince) {
		const why = link.error && ` (${link.error})`;
		return link.everLive ? { bad: true, text: `No connection to the gateway since ${moment(link.lostSince)}${why}. ` +
			"What is shown is old. Trying again …" } :
			{ text: tried ? `No connection to the gateway${why}. Trying again …` : "Connecting …", bad: tried };
	}
	if (trouble)
		return { text: trouble, bad: true };
	const old = [...devices.values()].filter(({ fresh, state }) => !fresh && state !== undefined).map(({ name }) => name);
	return old.length ? { text: `No fresh data of ${old.join(", ")}`, bad: true } : { text: "live", bad: false };
}

function Page() {
	const { text, bad } = status();
	const top = (line: string, wrong: boolean) => <header class="top"><h1>PoKeys</h1>
		<p role="status" class={wrong ? "bad" : ""}>{wrong ? "⚠ " : "● "}{line}</p>
		{session?.plaintext && <p class="bad">⚠ not encrypted: whoever is on the network can read passwords</p>}
		{cnc.allowed && <Stop cnc={cnc} />}
		{gcode.commands && <ConsoleStop console={gcode} />}
		{session && <User session={session} done={belong} />}</header>;
	if (session?.required && !session.user)
		return <>{top("not logged in", true)}<main><Login done={belong} /></main></>;
	return <>
		{top(text, bad)}
		<main>{cnc.allowed && <Operate cnc={cnc} />}<Gcode console={gcode} device={devices.get(gcode.info?.device ?? "")} />{[...devices.values()].map(device => <One key={device.name} device={device} />)}
			<Recorder found={records} /><Doctor /></main>
		<footer><a href="api/devices">data</a> <a href="api/openapi.json">interface</a> <a href="metrics">metrics</a> <a
			href="licenses.txt">licences</a></footer>
	</>;
}

let drawing = false;

function draw(): void {
	// age-us changes at each state of a device that is connected
	const live = link.lostSince === null && performance.now() - link.statesAt < OLD_MS;
	for (const device of devices.values())
		device.take(link.states.get(device.name), live);
	if (drawing)
		return;
	drawing = true;
	requestAnimationFrame(() => {
		drawing = false;
		const page = document.getElementById("page");
		if (page)
			render(<Page />, page);
	});
}

const link = new Link(new URL("websocket", location.href.replace(/^http/, "ws")).href, opened, draw,
	(method, params) => method === "console.said" ? gcode.hear((params as { lines: string[] }).lines) : cnc.hear(method, params), true);
const cnc = new LinuxCnc(link, draw);
const gcode = new Console(link, draw);
setInterval(draw, OLD_MS / 3);
get<Session>("api/session").then(belong, () => undefined);
setInterval(() => {
	tried = true;
	if (link.lostSince !== null)
		get<Session>("api/session").then(belong, () => undefined);
	if (looking || link.lostSince !== null)
		return;
	looking = true;
	look(null).catch(() => undefined).finally(() => looking = false);
}, LOOK_MS);
setInterval(() => {
	if (link.lostSince === null && !document.hidden)
		lookAtRecords().catch(() => undefined);
}, RECORDS_MS);
draw();
