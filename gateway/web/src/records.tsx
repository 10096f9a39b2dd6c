// SPDX-License-Identifier: GPL-2.0-or-later
// The flight recorder's files, which a user sends to the person who looks for the cause of a fault.

import { moment } from "./parts.js";

/** The answer of /api/records. */
export interface Records {
	folder: string;
	trouble: string;
	records: { name: string; time: string; reason: string; text: string; bytes: number }[];
}

const SHOWN = 20;
const size = (bytes: number): string => bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;

/** A link that saves the last seconds of a device. */
export function SaveNow({ name }: { name: string }) {
	return <p class="save"><a href={`api/devices/${encodeURIComponent(name)}/record`} download
	>Save the last seconds</a> (packets and events, for Wireshark)</p>;
}

/** The files of all devices, the newest first. */
export function Recorder({ found }: { found: Records | null }) {
	if (!found)
		return null;
	const { folder, trouble, records } = found;
	return <section class="device" aria-label="Flight recorder"><h2>Flight recorder</h2>
		<p>At a fault, the daemon writes the packets and events of the last seconds to a file.</p>
		{trouble && <p class="bad">⚠ {trouble}</p>}
		{!trouble && !records.length && <p>There are no records in {folder}.</p>}
		<ul class="events">{records.slice(0, SHOWN).map(({ name, time, text, bytes }) => <li key={name}>
			<time dateTime={time}>{moment(new Date(time))}</time> <a href={`api/records/${encodeURIComponent(name)}`} download
			>{text}</a> ({size(bytes)})</li>)}</ul>
		{records.length > SHOWN && <p>Older records in {folder}: {records.length - SHOWN}</p>}
	</section>;
}
