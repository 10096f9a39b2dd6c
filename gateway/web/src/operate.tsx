// SPDX-License-Identifier: GPL-2.0-or-later
// The buttons for LinuxCNC. They are armed first, and not for long; to stop needs nothing.

import { useEffect, useRef, useState } from "preact/hooks";
import { KEY, type Hands } from "./hands.js";
import type { LinuxCnc } from "./linuxcnc.js";

const ARMED_MS = 120000, SET_MS = 500;
const MODES = { manual: "Manual", mdi: "MDI", auto: "Automatic" };
const TASKS: Record<string, string> = { estop: "emergency stop", off: "off", on: "on" };
const SPEEDS = [1, 2, 5, 10, 20, 50, 100];
const OVERRIDES = { feed: "Feed", rapid: "Rapid", spindle: "Spindle" };

/** One touch, also while another finger holds something: then there is no click. A key makes a click without a pointer. */
export function StopButton({ look, text, stop }: { look: string; text: string; stop: () => void }) {
	return <button type="button" class={look} onPointerDown={event => event.button === 0 && stop()}
		onClick={event => event.detail === 0 && stop()}>{text}</button>;
}

/** Always to be seen. */
export function Stop({ cnc }: { cnc: LinuxCnc }) {
	return <StopButton look="stop" text={cnc.reachable ? "■ Stop" : "■ Stop: no connection"} stop={() => cnc.stop("linuxcnc.stop")} />;
}

/** A button that jogs as long as it is held, by hand or by the space bar. */
export function Jog({ hands, axis, speed, disabled }: { hands: Hands; axis: string; speed: number; disabled: boolean }) {
	const name = `${axis.toUpperCase()} ${speed < 0 ? "−" : "+"}`;
	const down = (hand: number | typeof KEY) => !disabled && hands.hold(axis, speed, hand);
	const up = () => hands.up(axis);
	// a button that is gone gets no event
	useEffect(() => up, [hands, axis]);
	return <button type="button" class="jog" aria-disabled={disabled} aria-label={`Jog ${name} while it is held`}
		onPointerDown={event => {
			if (event.button === 0)
				down(event.pointerId);
		}} onPointerUp={up} onPointerCancel={up} onPointerLeave={up} onBlur={up} onContextMenu={event => event.preventDefault()}
		onKeyDown={event => {
			if (event.key === " ") {
				event.preventDefault();
				if (!event.repeat)
					down(KEY);
			}
		}} onKeyUp={up}>{name}</button>;
}

function Manual({ cnc, off }: { cnc: LinuxCnc; off: boolean }) {
	const [speed, setSpeed] = useState(10);
	const { state } = cnc;
	const joints = [...Array(state.joints ?? 0).keys()];
	const moved = state.motion === "joints" ? joints.map(String) : state.axes ?? [];
	return <>
		<p class="buttons"><button type="button" aria-disabled={off} onClick={() => !off && cnc.ask("linuxcnc.home", { joint: -1 })}>Home all</button>
			{joints.length > 1 && joints.map(joint => <button key={joint} type="button" aria-disabled={off}
				onClick={() => !off && cnc.ask("linuxcnc.home", { joint })}>Home joint {joint}</button>)}</p>
		<p><label> speed <select value={speed} onChange={event => setSpeed(Number(event.currentTarget.value))}>
				{SPEEDS.map(one => <option key={one} value={one}>{one} units/s</option>)}</select></label></p>
		<div class="jogs" role="group" aria-label="Jog">{moved.flatMap(axis => [-speed, speed].map(way =>
			<Jog key={`${axis}${Math.sign(way)}`} hands={cnc.hands} axis={axis} speed={way} disabled={off} />))}</div>
	</>;
}

function Mdi({ cnc, off }: { cnc: LinuxCnc; off: boolean }) {
	const [line, setLine] = useState("");
	const send = (event: SubmitEvent) => {
		event.preventDefault();
		if (!off && line.trim())
			cnc.ask("linuxcnc.mdi", { line });
	};
	return <form onSubmit={send}><label>G-code <input value={line} maxLength={255} autocomplete="off" autocapitalize="characters"
		spellcheck={false} onInput={event => setLine(event.currentTarget.value)} /></label>
		<button type="submit" aria-disabled={off}>Send</button></form>;
}

function Auto({ cnc, off }: { cnc: LinuxCnc; off: boolean }) {
	const { file, line, interpreter, paused } = cnc.state;
	const runs = interpreter !== "idle";
	const button = (text: string, method: string, may: boolean) => <button type="button" aria-disabled={off || !may}
		onClick={() => !off && may && cnc.ask(method)}>{text}</button>;
	return <>
		<p>{file ? `${file.replace(/^.*\//, "")}${runs ? `, line ${line}` : ""}` : "No programme is loaded."}</p>
		<p class="buttons">{button("Run", "linuxcnc.run", !runs && Boolean(file))}
			{button("Pause", "linuxcnc.pause", runs && !paused)} {button("Resume", "linuxcnc.resume", Boolean(paused))}</p>
	</>;
}

function Override({ cnc, what, off }: { cnc: LinuxCnc; what: keyof typeof OVERRIDES; off: boolean }) {
	// while it is pulled, it shows where it is, and not what LinuxCNC has
	const [pulled, setPulled] = useState<number | null>(null);
	const input = useRef<HTMLInputElement>(null);
	useEffect(() => {
		let timer = 0;
		const pull = () => {
			clearTimeout(timer);
			setPulled(input.current!.valueAsNumber);
		};
		// when the slider is released; Preact's onChange is called for each movement
		const set = () => {
			cnc.ask("linuxcnc.override", { what, value: input.current!.valueAsNumber / 100 });
			timer = window.setTimeout(() => setPulled(null), SET_MS);
		};
		input.current!.addEventListener("input", pull);
		input.current!.addEventListener("change", set);
		for (const event of ["blur", "pointercancel"])
			input.current!.addEventListener(event, () => setPulled(null));
		return () => clearTimeout(timer);
	}, []);
	useEffect(() => setPulled(null), [off]);
	const value = pulled ?? (cnc.state[`${what}_override`] ?? 1) * 100;
	return <label>{OVERRIDES[what]} <output>{value.toFixed(0)} %</output>
		<input ref={input} type="range" min="0" max={(cnc.state[`max_${what}_override`] ?? 1) * 100} step="5" value={value}
			disabled={off} /></label>;
}

function State({ cnc }: { cnc: LinuxCnc }) {
	const { task, interpreter, paused, moving, axes, position, homed } = cnc.state;
	const all = homed?.length && homed.every(Boolean);
	return <>
		<p class="marks"><span class={`mark ${task === "on" ? "good" : task === "estop" ? "bad" : "plain"}`}>
			{task === "estop" ? "⚠ " : ""}{TASKS[task ?? ""] ?? "state not known"}</span>
			<span class="mark plain">{paused ? "paused" : interpreter === "idle" ? "no programme runs" : "a programme runs"}</span>
			<span class="mark plain">{moving ? "moving" : "standing"}</span>
			<span class={`mark ${all ? "good" : "plain"}`}>{all ? "homed" : "not homed"}</span></p>
		<dl class="position">{axes?.map(axis => <div key={axis}><dt>{axis.toUpperCase()}</dt>
			<dd>{position?.[axis]?.toFixed(3) ?? "–"}</dd></div>)}</dl>
	</>;
}

/** Buttons that are unlocked, until nobody has touched them for two minutes, or the page is not seen. */
export function useArmed(locked: () => void): { armed: boolean; setArmed: (armed: boolean) => void; touch: () => void } {
	const [armed, setArmed] = useState(false);
	const [touched, setTouched] = useState(0);
	useEffect(() => {
		if (!armed)
			return;
		const hidden = () => document.hidden && setArmed(false);
		const timer = setTimeout(() => setArmed(false), ARMED_MS);
		document.addEventListener("visibilitychange", hidden);
		return () => {
			clearTimeout(timer);
			document.removeEventListener("visibilitychange", hidden);
		};
	}, [armed, touched]);
	useEffect(() => locked, [armed]);
	return { armed, setArmed, touch: () => setTouched(Date.now()) };
}

/** LinuxCNC's state, and its buttons. */
export function Operate({ cnc }: { cnc: LinuxCnc }) {
	const { state, connected } = cnc;
	// locked buttons hold nothing
	const { armed, setArmed, touch } = useArmed(() => cnc.hands.release());
	const off = !armed || !connected;
	const busy = state.interpreter !== "idle";
	const mode = (state.mode ?? "") as keyof typeof MODES;
	return <section class={connected ? "device cnc" : "device cnc old"} aria-label="LinuxCNC" onPointerDown={touch} onKeyDown={touch}>
		<header><h2>LinuxCNC</h2>
			{connected && <button type="button" aria-pressed={armed} onClick={() => setArmed(!armed)}>
				{armed ? "Lock the buttons" : "Unlock the buttons"}</button>}
			<StopButton look="bad" text="Emergency stop" stop={() => cnc.stop("emergency_stop")} />
		</header>
		{connected ? <State cnc={cnc} /> : <p class="bad">⚠ {state.why ?? "LinuxCNC's state is not known."}</p>}
		{connected && <div class="parts">
			<div class="part"><h3>Mode</h3>
				<p class="buttons" role="group" aria-label="Mode">{Object.entries(MODES).map(([name, text]) => <button key={name} type="button"
					aria-pressed={name === mode} aria-disabled={off || busy}
					onClick={() => !off && !busy && cnc.ask("linuxcnc.mode", { mode: name })}>{text}</button>)}</p>
				{mode === "manual" && <Manual cnc={cnc} off={off || state.task !== "on"} />}
				{mode === "mdi" && <Mdi cnc={cnc} off={off || state.task !== "on"} />}
				{mode === "auto" && <Auto cnc={cnc} off={off || state.task !== "on"} />}
			</div>
			<div class="part overrides"><h3>Override</h3>
				{(Object.keys(OVERRIDES) as (keyof typeof OVERRIDES)[]).map(what => <Override key={what} cnc={cnc} what={what} off={off} />)}</div>
		</div>}
		<ul class="events" role="log" aria-label="LinuxCNC: messages">{cnc.said.map(({ text, bad, number }) =>
			<li key={number} class={bad ? "bad" : ""}>{bad ? "⚠ " : ""}{text}</li>)}</ul>
	</section>;
}
