// SPDX-License-Identifier: GPL-2.0-or-later
// The findings of pokeysctl doctor. It runs when the user asks, because it is work for the computer.

import { memo } from "preact/compat";
import { useState } from "preact/hooks";
import { moment } from "./parts.js";

type Verdict = "problem" | "advice" | "unknown" | "ok";

/** The answer of /api/doctor. */
interface Opinion {
	time: string;
	limited: boolean;
	findings: { check: string; subject: string; verdict: Verdict; why: string; mend: string; keep: string }[];
}

const PATIENCE_MS = 25000;
const TITLES: Record<Verdict, (count: number) => string> = {
	problem: count => `⚠ ${count} ${count === 1 ? "problem" : "problems"}`,
	advice: count => `${count} could be better`,
	unknown: count => `${count} could not be seen`,
	ok: count => `${count} in order`,
};
const ORDER = Object.keys(TITLES) as Verdict[];

async function ask(): Promise<Opinion> {
	let answer;
	try {
		answer = await fetch("api/doctor", { method: "POST", signal: AbortSignal.timeout(PATIENCE_MS) });
	} catch {
		throw new Error("the gateway does not answer");
	}
	const found = await answer.json().catch(() => ({})) as Opinion & { error?: { message: string } };
	if (!answer.ok)
		throw new Error(found.error?.message ?? `status ${answer.status}`);
	return found;
}

function Findings({ findings, verdict }: { findings: Opinion["findings"]; verdict: Verdict }) {
	const found = findings.filter(one => one.verdict === verdict);
	if (!found.length)
		return null;
	return <details aria-label={TITLES[verdict](found.length)} open={verdict === "problem" || verdict === "advice"}>
		<summary><h3 class={verdict === "problem" ? "bad" : ""}>{TITLES[verdict](found.length)}</h3></summary>
		<ul class="findings">{found.map(({ check, subject, why, mend, keep }) => <li key={`${check} ${subject}`}>
			<p><b>{check}</b>{subject && ` ${subject}`}: {why}</p>
			{mend && <p>→ {mend}</p>}
			{keep && <p>until the next boot; to keep it: {keep}</p>}
		</li>)}</ul>
	</details>;
}

/** The button, and the findings. */
export const Doctor = memo(() => {
	const [found, setFound] = useState<Opinion | null>(null);
	const [busy, setBusy] = useState(false);
	const [wrong, setWrong] = useState("");
	const look = () => {
		if (busy)
			return;
		setBusy(true);
		setWrong("");
		ask().then(setFound, (error: Error) => setWrong(error.message)).finally(() => setBusy(false));
	};
	const counts = found && ORDER.map(verdict => [verdict, found.findings.filter(one => one.verdict === verdict).length] as const)
		.filter(([, count]) => count).map(([verdict, count]) => TITLES[verdict](count)).join(", ");
	return <section class="device" aria-label="Computer"><h2>Computer</h2>
		<p>Settings and programs of the computer can make packets late. The check finds them, and says how to mend them.</p>
		<p class="save"><button type="button" aria-disabled={busy} onClick={look}>Check the computer</button></p>
		<p role="status">{busy ? "looking …" : found && `Checked at ${moment(new Date(found.time))}: ${counts}`}</p>
		<p class="bad" role="alert">{wrong && `⚠ ${wrong}`}</p>
		{found?.limited && <p>The gateway may not see all of the computer. To see the rest, run pokeysctl doctor as root.</p>}
		{found && ORDER.map(verdict => <Findings key={verdict} findings={found.findings} verdict={verdict} />)}
	</section>;
});
