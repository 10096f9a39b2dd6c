// SPDX-License-Identifier: GPL-2.0-or-later
// The daemon's histograms, asked for only while they are looked at.

import { useEffect, useState } from "preact/hooks";

const EVERY_MS = 2000;
const OCTAVES = 21, HEIGHT = 30;        // up to 1 µs, 2 µs, … 1 s and more

interface Histogram {
	name: string;
	help: string;
	count: number;
	max_us: number | null;
	p50_us: number | null;
	p99_us: number | null;
	/** Lower bound in microseconds and count, of the buckets that are not empty. */
	buckets: [number, number][];
}

type Get = <Answer>(path: string) => Promise<Answer>;

const us = (value: number | null): string => value === null ? "–" :
	value < 1000 ? `${value.toFixed(value < 10 ? 1 : 0)} µs` : `${(value / 1000).toFixed(2)} ms`;

/** Bars over a logarithmic axis. */
function Bars({ buckets }: { buckets: [number, number][] }) {
	const octaves = new Map<number, number>();
	for (const [lower, n] of buckets) {
		const octave = lower < 1 ? 0 : Math.min(OCTAVES - 1, Math.floor(Math.log2(lower)) + 1);
		octaves.set(octave, (octaves.get(octave) ?? 0) + n);
	}
	const highest = Math.max(...octaves.values(), 1);
	return <svg class="bars" viewBox={`0 0 ${OCTAVES * 10} ${HEIGHT}`} preserveAspectRatio="none" aria-hidden="true">
		{[...octaves].map(([octave, n]) => {
			// a logarithm, or the rare long ones would not be seen
			const height = 2 + (HEIGHT - 2) * Math.log(n + 1) / Math.log(highest + 1);
			return <rect key={octave} x={octave * 10 + 1} y={HEIGHT - height} width={8} height={height} />;
		})}
	</svg>;
}

/** The latencies of the daemon for one device. */
export function Latency({ name, get }: { name: string; get: Get }) {
	const [open, setOpen] = useState(false);
	const [rows, setRows] = useState<Histogram[] | null>([]);
	useEffect(() => {
		if (!open)
			return undefined;
		let asking = false, gone = false;
		const ask = () => {
			if (document.hidden || asking)
				return;
			asking = true;
			get<{ histograms: Histogram[] }>(`api/devices/${encodeURIComponent(name)}/histograms`)
				.then(({ histograms }) => gone || setRows(histograms), () => gone || setRows(null))
				.finally(() => asking = false);
		};
		ask();
		const timer = setInterval(ask, EVERY_MS);
		return () => {
			gone = true;
			clearInterval(timer);
		};
	}, [open, name, get]);
	return <details class="part" aria-label="Latencies" open={open} onToggle={event => setOpen(event.currentTarget.open)}>
		<summary><h3>Latencies since the daemon's start</h3></summary>
		{rows === null && <p class="bad">⚠ they cannot be read now</p>}
		{rows !== null && <div class="scroll"><table aria-label="Latencies">
			<thead><tr><th scope="col">what</th><th scope="col">median</th><th scope="col">99 %</th><th scope="col">longest</th>
				<th scope="col">how often: from 1 µs, each bar for twice as long</th></tr></thead>
			<tbody>{rows.filter(({ count }) => count).map(row => <tr key={row.name}>
				<th scope="row" title={row.help}>{row.name.replaceAll("-", " ")}</th><td class="number">{us(row.p50_us)}</td>
				<td class="number">{us(row.p99_us)}</td><td class="number">{us(row.max_us)}</td>
				<td><Bars buckets={row.buckets} /></td></tr>)}</tbody>
		</table></div>}
	</details>;
}
