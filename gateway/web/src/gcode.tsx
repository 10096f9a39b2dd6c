// SPDX-License-Identifier: GPL-2.0-or-later
// The console: a line for the machine, what it says, and buttons for what is needed often. Buttons that move or heat
// are unlocked first, and not for long; to stop needs nothing.

import { useEffect, useRef, useState } from "preact/hooks";
import type { Console, Heater } from "./console.js";
import { two, type Device } from "./model.js";
import { Jog, StopButton, useArmed } from "./operate.js";

const HELD = 0, STEPS = [0.1, 1, 10, 100], SPEEDS = [60, 300, 1200, 3000, 6000];
const MACROS = "macros", MACROS_MOST = 24;
const kilobytes = (size: number): string => size < 1000 ? `${size} B` : `${(size / 1000).toFixed(size < 10000 ? 1 : 0)} kB`;

interface Macro {
	name: string;
	lines: string;
}

/** What the browser keeps; somebody else's page may have put something odd there. */
function kept(): Macro[] {
	try {
		const found = JSON.parse(localStorage.getItem(MACROS) ?? "[]") as Macro[];
		return found.filter(one => typeof one.name === "string" && typeof one.lines === "string").slice(0, MACROS_MOST);
	} catch {
		return [];
	}
}

/** Always to be seen. */
export function ConsoleStop({ console }: { console: Console }) {
	const device = console.info?.device ?? "";
	return <><StopButton look="stop" text={console.reachable ? `■ Stop ${device}` : `■ Stop ${device}: no connection`}
		stop={() => console.stop("M410")} />
		{console.unsent && <p class="bad" role="alert">⚠ {console.unsent}</p>}</>;
}

function Log({ console }: { console: Console }) {
	const place = useRef<HTMLUListElement>(null);
	const follows = useRef(true);
	useEffect(() => {
		if (follows.current && place.current)
			place.current.scrollTop = place.current.scrollHeight;
	}, [console.lines]);
	return <ul class="log" role="log" aria-label="Console: lines" tabIndex={0} ref={place} onScroll={({ currentTarget: at }) => {
		follows.current = at.scrollTop + at.clientHeight > at.scrollHeight - 20;
	}}>{console.lines.map(({ number, text, kind }) => <li key={number} class={kind}>
		{kind === "sent" ? "› " : kind === "bad" ? "⚠ " : ""}{text}</li>)}</ul>;
}

function Entry({ console, off }: { console: Console; off: boolean }) {
	const [line, setLine] = useState("");
	const at = useRef(0);
	const { history } = console;
	const send = (event: SubmitEvent) => {
		event.preventDefault();
		if (off || !line.trim())
			return;
		console.type(line.trim());
		at.current = 0;
		setLine("");
	};
	const step = (event: KeyboardEvent, by: number) => {
		event.preventDefault();
		at.current = Math.max(0, Math.min(history.length, at.current + by));
		setLine(at.current ? history[history.length - at.current] ?? "" : "");
	};
	return <form onSubmit={send}><label>Line <input value={line} maxLength={250} autocomplete="off" autocapitalize="characters"
		spellcheck={false} onInput={event => setLine(event.currentTarget.value)} onKeyDown={event => {
			if (event.key === "ArrowUp")
				step(event, 1);
			else if (event.key === "ArrowDown")
				step(event, -1);
		}} /></label><button type="submit" aria-disabled={off}>Send</button></form>;
}

/** How its target is set: T0 is a hot end. */
function command({ letter }: Heater, celsius: number): string {
	return letter === "B" ? `M140 S${celsius}` : letter === "C" ? `M141 S${celsius}` : `M104 ${letter} S${celsius}`;
}

/** How warm it is, and where it goes. */
function temperature({ values, fresh }: Device, { index }: Heater): string {
	const [celsius, target] = ["temperature", "target-in-effect"].map(name => values[`heater.${two(index)}.${name}`]);
	if (!fresh || typeof celsius !== "number")
		return "–";
	return `${celsius.toFixed(1)}${typeof target === "number" && target > 0 ? ` → ${target.toFixed(1)}` : ""} °C`;
}

function Target({ console, heater, device, off }: { console: Console; heater: Heater; device: Device | undefined; off: boolean }) {
	const [celsius, setCelsius] = useState("");
	const wanted = Number(celsius), good = celsius.trim() !== "" && wanted >= 0 && wanted <= heater.most;
	return <form class="target" onSubmit={event => {
		event.preventDefault();
		if (!off && good)
			console.send(command(heater, wanted));
	}}><label>{heater.name}, °C <input type="number" min="0" max={heater.most} step="any" inputMode="decimal" value={celsius}
		onInput={event => setCelsius(event.currentTarget.value)} /></label>
		<button type="submit" aria-disabled={off || !good}>Set</button>
		<button type="button" onClick={() => console.send(command(heater, 0))}>Off</button>
		{device && <span class="number">{temperature(device, heater)}</span>}</form>;
}

function Jogs({ console, off }: { console: Console; off: boolean }) {
	const [step, setStep] = useState(1), [speed, setSpeed] = useState(1200);
	const axes = console.info?.axes ?? [];
	const press = (...lines: string[]) => !off && console.send(...lines);
	return <div class="part"><h3>Move</h3>
		<p class="buttons"><button type="button" aria-disabled={off} onClick={() => press("G28")}>Home all</button>
			{axes.length > 1 && axes.map(axis => <button key={axis} type="button" aria-disabled={off}
				onClick={() => press(`G28 ${axis}`)}>Home {axis}</button>)}
			<button type="button" onClick={() => console.send("M84")}>Disable motors</button></p>
		<p class="buttons"><label>step <select value={step} onChange={event => setStep(Number(event.currentTarget.value))}>
			{STEPS.map(one => <option key={one} value={one}>{one}</option>)}<option value={HELD}>while held</option></select></label>
			<label>speed <select value={speed} onChange={event => setSpeed(Number(event.currentTarget.value))}>
				{SPEEDS.map(one => <option key={one} value={one}>{one}/min</option>)}</select></label></p>
		<div class="jogs" role="group" aria-label="Move">{axes.flatMap(axis => [-1, 1].map(sign => sign * step).map((way, i) =>
			step === HELD ? <Jog key={`${axis}${i}`} hands={console.hands} axis={axis} speed={(i ? speed : -speed) / 60} disabled={off} /> :
			<button key={`${axis}${Math.sign(way)}`} type="button" class="jog" aria-disabled={off}
				aria-label={`Move ${axis} by ${way}`}
				onClick={() => press(`$J=G91 G21 ${axis}${way} F${speed}`)}>{axis} {way < 0 ? "−" : "+"}</button>))}</div>
	</div>;
}

/** Digital outputs, as the device has them. */
function Outputs({ console, device, off }: { console: Console; device: Device; off: boolean }) {
	const { fresh, terminals, values } = device;
	return <div class="part"><h3>Outputs</h3><p class="buttons">{console.info?.outputs?.map(({ word, name }) => {
		const on = values[name];
		const place = terminals.find(one => one.name === name);
		const known = fresh && typeof on === "boolean";
		return <button key={word} type="button" aria-pressed={known && on} aria-disabled={off || !known}
			onClick={() => !off && known && console.send(`M42 ${word} S${on ? 0 : 255}`)}>
			{[place?.terminal, place?.label].filter(text => text).join(" ") || word}: {known ? on ? "● on" : "off" : "–"}</button>;
	})}</p></div>;
}

function Files({ console, off }: { console: Console; off: boolean }) {
	const { info, files, upload } = console;
	const job = info?.job;
	const input = useRef<HTMLInputElement>(null);
	const take = async () => {
		const file = input.current?.files?.[0];
		if (!file || upload)
			return;
		const text = await file.text();
		if (input.current)
			input.current.value = "";
		await console.put(file.name.replace(/[^A-Za-z0-9._-]+/g, "_"), text);
	};
	return <div class="part"><h3>Files</h3>
		{job && <><p>{job.file}, line {job.line}{job.waits ? ", waits" : ""}</p>
			<progress aria-label="Progress of the job" max={job.size || 1} value={job.byte} />
			<p class="buttons">{job.waits ? <button type="button" aria-disabled={off} onClick={() => !off && console.send("M24")}>Resume</button> :
				<button type="button" onClick={() => console.send("M25")}>Pause</button>}
			<button type="button" onClick={() => console.send("M524")}>End the job</button></p></>}
		{upload && <><p>sending {upload.name}</p><progress aria-label="Progress of the upload" max={upload.all || 1} value={upload.done} /></>}
		<ul class="files">{files?.map(({ name, size }) => <li key={name}><span class="name">{name}</span> <span class="faint">{kilobytes(size)}</span>
			<button type="button" aria-disabled={off || Boolean(job)} aria-label={`Start ${name}`}
				onClick={() => !off && !job && console.send(`M32 ${name}`)}>Start</button></li>)}</ul>
		{files && !files.length && <p>There are no files.</p>}
		<p class="buttons"><label class="upload">Upload <input ref={input} type="file" accept=".gcode,.gco,.g,.nc,.ngc,.txt" disabled={Boolean(upload)}
			onChange={() => void take()} /></label>
		<button type="button" onClick={() => console.list()}>Refresh</button></p>
	</div>;
}

function Macros({ console, off }: { console: Console; off: boolean }) {
	const [macros, setMacros] = useState(kept);
	const [edited, setEdited] = useState<Macro | null>(null);
	const keep = (now: Macro[]) => {
		setMacros(now);
		try {
			localStorage.setItem(MACROS, JSON.stringify(now));
		} catch {
			// a private window keeps nothing
		}
		setEdited(null);
	};
	const save = (event: SubmitEvent) => {
		event.preventDefault();
		if (edited?.name.trim() && edited.lines.trim())
			keep([...macros.filter(one => one.name !== edited.name.trim()),
				{ name: edited.name.trim(), lines: edited.lines }].slice(-MACROS_MOST));
	};
	return <div class="part"><h3>Macros</h3>
		<p class="buttons">{macros.map(one => <button key={one.name} type="button" aria-disabled={off} title={one.lines}
			onClick={() => !off && console.send(...one.lines.split("\n").map(line => line.trim()).filter(line => line))}>{one.name}</button>)}
		<button type="button" onClick={() => setEdited(edited ? null : { name: "", lines: "" })}>{edited ? "Close" : "Edit"}</button></p>
		{edited && <form class="macro" onSubmit={save}>
			<p class="buttons">{macros.map(one => <button key={one.name} type="button" onClick={() => setEdited(one)}>{one.name} …</button>)}</p>
			<label>Name <input value={edited.name} maxLength={24} onInput={event => setEdited({ ...edited, name: event.currentTarget.value })} /></label>
			<label>Lines <textarea rows={4} maxLength={2000} value={edited.lines} spellcheck={false}
				onInput={event => setEdited({ ...edited, lines: event.currentTarget.value })} /></label>
			<p class="buttons"><button type="submit">Save</button>
				<button type="button" onClick={() => keep(macros.filter(one => one.name !== edited.name))}>Delete</button></p>
		</form>}
	</div>;
}

/** The machine of the console; `device` is the one that G-code commands. */
export function Machine({ console, device }: { console: Console; device: Device | undefined }) {
	const { armed, setArmed, touch } = useArmed(() => console.hands.release());
	const { info } = console;
	if (!info || (info.machine === null && !console.lines.length))
		return null;
	const off = !armed || !info.send || Boolean(info.halted);
	return <section class={info.machine === null ? "device cnc old" : "device cnc"} aria-label="Console" onPointerDown={touch} onKeyDown={touch}>
		<header><h2>Console</h2>
			{console.commands && <button type="button" aria-pressed={armed} onClick={() => setArmed(!armed)}>
				{armed ? "Lock the buttons" : "Unlock the buttons"}</button>}
			{console.commands && <StopButton look="bad" text={`Emergency stop of ${info.device}`} stop={() => console.stop("M112")} />}
			<p>{info.device ? `G-code commands ${info.device}` : info.machine ?? ""}</p>
		</header>
		{info.machine === null && <p class="bad">⚠ {info.why}</p>}
		{info.halted && <p class="bad">⚠ {info.halted}. <button type="button" aria-disabled={!info.send}
			onClick={() => info.send && console.send("M999")}>Permit commands again (M999)</button></p>}
		{info.message && <p>{info.message}</p>}
		{!info.send && <p>Log in to send lines.</p>}
		<div class="parts">
			<div class="part"><Log console={console} /><Entry console={console} off={!info.send} /></div>
			{console.commands && Boolean(info.heaters?.length) && <div class="part"><h3>Targets</h3>
				{info.heaters?.map(heater => <Target key={heater.letter} console={console} heater={heater} device={device} off={off} />)}</div>}
			{console.commands && Boolean(info.axes?.length) && <Jogs console={console} off={off} />}
			{console.commands && device && Boolean(info.outputs?.length) && <Outputs console={console} device={device} off={off} />}
			{console.commands && info.files && <Files console={console} off={off} />}
			{info.send && <Macros console={console} off={info.device ? off : false} />}
		</div>
	</section>;
}
