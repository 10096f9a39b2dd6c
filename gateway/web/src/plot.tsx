// SPDX-License-Identifier: GPL-2.0-or-later
// Values of the last minutes, drawn by uPlot.

import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import { KEPT_MS, type History } from "./model.js";

const COLOURS = 6, HEIGHT_REM = 12, EVERY_MS = 500;
// what a colour does not tell apart: whole, dashes, dots
const DASHES = [[], [9, 5], [2, 4]], TARGET_DASH = [1, 3];

/** A line of a plot. */
export interface Line {
	name: string;
	label: string;
	/** its value now, as it is written beside its name */
	now: string;
	/** the name of what it should be, a thin line of the same colour */
	target?: string;
}

const clock = new Intl.DateTimeFormat(undefined, { timeStyle: "short" });
const dash = (i: number): number[] => DASHES[i % DASHES.length] ?? [];

/** A plot of some of the values of a history; `unit` is written at the axis. */
export function Plot({ history, lines, unit }: { history: History; lines: Line[]; unit: string }) {
	const place = useRef<HTMLDivElement>(null);
	// lines, and then their targets
	const drawn = [...lines.map(({ name }, i) => ({ name, i, target: false })),
		...lines.flatMap(({ target }, i) => target ? [{ name: target, i, target: true }] : [])];
	const what = drawn.map(({ name }) => name).join();
	useEffect(() => {
		const element = place.current;
		if (!element)
			return undefined;
		const style = getComputedStyle(element);
		const ink = () => style.getPropertyValue("--faint");
		const grid = { stroke: () => style.getPropertyValue("--line"), width: 1 };
		const rem = parseFloat(getComputedStyle(document.documentElement).fontSize);
		const font = `${rem * 0.75}px system-ui, sans-serif`, height = rem * HEIGHT_REM;
		const width = () => Math.max(200, element.clientWidth);
		const data = (): uPlot.AlignedData => [history.times,
			...drawn.map(({ name }) => history.series.get(name) ?? history.times.map(() => null))];
		const plot = new uPlot({
			width: width(), height, pxAlign: false, cursor: { show: false }, legend: { show: false },
			scales: { x: { range: () => [(Date.now() - KEPT_MS) / 1000, Date.now() / 1000] } },
			axes: [
				{ stroke: ink, grid, ticks: grid, font, size: rem * 2, space: rem * 5, incrs: [60, 120, 300],
					values: (_, times) => times.map(time => clock.format(time * 1000)) },
				{ stroke: ink, grid, ticks: grid, font, size: rem * 3, label: unit, labelFont: font, labelSize: rem * 1.2 },
			],
			series: [{}, ...drawn.map(({ i, target }) => ({ width: target ? 1 : 2, dash: target ? TARGET_DASH : dash(i), spanGaps: false, points: { show: false },
				stroke: () => style.getPropertyValue(`--series-${i % COLOURS}`) }))],
		}, data(), element);
		const timer = setInterval(() => {
			if (!document.hidden)
				plot.setData(data());
		}, EVERY_MS);
		const resized = new ResizeObserver(() => plot.setSize({ width: width(), height }));
		resized.observe(element);
		return () => {
			clearInterval(timer);
			resized.disconnect();
			plot.destroy();
		};
	}, [history, what, unit]);
	const minutes = KEPT_MS / 60000;
	return <>
		<ul class="legend">{lines.map(({ name, label, now }, i) => <li key={name} title={name}>
			<svg viewBox="0 0 24 6" aria-hidden="true"><line x1="0" y1="3" x2="24" y2="3" stroke-dasharray={dash(i).join(" ")}
				class={`series-${i % COLOURS}`} /></svg>
			{label}: <span class="number">{now}</span></li>)}</ul>
		<div class="plot" ref={place} role="img" aria-label={`the last ${minutes} minutes`} />
	</>;
}
