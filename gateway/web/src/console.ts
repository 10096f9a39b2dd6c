// SPDX-License-Identifier: GPL-2.0-or-later
// The console of the gateway: lines to the machine, and what it says.

import { Hands } from "./hands.js";
import type { Link } from "./link.js";

export interface Heater {
	name: string;
	/** The daemon's number of it. */
	index: number;
	/** As M105 shows it: T0, B, C. */
	letter: string;
	most: number;
}

export interface Job {
	file: string;
	line: number;
	byte: number;
	size: number;
	waits: boolean;
}

/** As console.info has it. */
export interface Info {
	machine: string | null;
	why: string;
	send: boolean;
	device?: string | null;
	heaters?: Heater[];
	outputs?: { word: string; name: string }[];
	axes?: string[];
	files?: boolean;
	halted?: string;
	message?: string;
	job?: Job | null;
}

export interface Line {
	number: number;
	text: string;
	kind: "sent" | "said" | "bad";
}

export interface File {
	name: string;
	size: number;
}

const LINES_MOST = 500, HISTORY_MOST = 100, PART = 16384, JOG_MS = 60;
const LIST = { begin: "Begin file list", end: "End file list" };
const SECRET = /(\bpwd=).*/i;
/** Reports that come again and again are shown elsewhere. */
const REPORT = /^ (?:T\d*|B|C):-?\d/;

export class Console {
	info: Info | null = null;
	lines: Line[] = [];
	/** What was sent, the oldest first. */
	history: string[] = [];
	files: File[] | null = null;
	/** A file that is being sent. */
	upload: { name: string; done: number; all: number } | null = null;
	/** Why the last stop was not sent. */
	unsent = "";
	private numbers = 0;
	private listed: File[] | null = null;
	private subscribed = false;

	/** What is jogged. */
	readonly hands: Hands;

	constructor(private link: Link, private changed: () => void) {
		this.hands = new Hands(link, "console.jog", JOG_MS, why => {
			this.add(why, "bad");
			this.changed();
		});
	}

	/** May this browser command a device by G-code? */
	get commands(): boolean {
		return Boolean(this.info?.send && this.info.device);
	}

	/** Somebody else has logged in. */
	reset(): void {
		this.lines = [];
		this.history = [];
		this.files = null;
		this.info = null;
	}

	/** Is there a connection? */
	get reachable(): boolean {
		return this.link.lostSince === null;
	}

	/** There is a new connection, and nobody has subscribed. */
	forget(): void {
		this.hands.release();
		this.subscribed = false;
		this.listed = null;
	}

	/** What the machine is now. */
	async look(): Promise<void> {
		const info = await this.link.ask<Info>("console.info");
		if (info.machine !== null && !this.subscribed) {
			await this.link.ask("console.subscribe");
			this.subscribed = true;
			this.info = await this.link.ask<Info>("console.info");
			if (this.info.files && this.info.send)
				this.list();
		} else
			this.info = info;
		this.changed();
	}

	hear(lines: string[]): void {
		for (const text of lines) {
			if (text === LIST.begin)
				this.listed = [];
			else if (text === LIST.end && this.listed) {
				this.files = this.listed;
				this.listed = null;
			} else if (this.listed) {
				const found = /^(.*) (\d+)$/.exec(text);
				if (found)
					this.listed.push({ name: found[1]!, size: Number(found[2]) });
			} else if (!REPORT.test(text))
				this.add(text, /^(?:Error:|error: |\[not stopped|\[the stop is not)/.test(text) ? "bad" : "said");
		}
		this.changed();
	}

	/** Lines for the machine, one after the other; they are shown. */
	send(...lines: string[]): void {
		for (const line of lines) {
			const shown = line.replace(SECRET, "$1…");
			this.add(shown, "sent");
			this.link.ask("console.send", { line }).catch((error: Error) => {
				this.add(`${shown}: ${error.message}`, "bad");
				this.changed();
			});
		}
		this.changed();
	}

	/** What somebody has typed. */
	type(line: string): void {
		// the next one at this browser need not know a password
		if (!SECRET.test(line))
			this.history = [...this.history.filter(one => one !== line), line].slice(-HISTORY_MOST);
		this.send(line);
	}

	/** One of the stops; it is said where the button is if it was not sent. */
	stop(line: "M410" | "M112"): void {
		this.hands.release();
		this.unsent = "";
		this.add(line, "sent");
		this.link.ask("console.send", { line }).catch((error: Error) => {
			this.unsent = `${line === "M112" ? "Emergency stop" : "Stop"} was not sent: ${error.message}`;
			this.add(this.unsent, "bad");
			this.changed();
		});
		this.changed();
	}

	/** The files of the machine. */
	list(): void {
		this.link.ask("console.send", { line: "M20" }).catch(() => undefined);
	}

	/** Send a file. Of what is not sent as a whole, nothing is kept. */
	async put(name: string, text: string): Promise<void> {
		if (this.upload)
			return;
		this.upload = { name, done: 0, all: text.length };
		try {
			await this.link.ask("files.begin", { name });
			for (let at = 0; at < text.length; at += PART) {
				await this.link.ask("files.write", { data: text.slice(at, at + PART) });
				this.upload.done = at + PART;
				this.changed();
			}
			await this.link.ask("files.finish");
			this.add(`${name} was sent`, "said");
		} catch (error) {
			this.add(`${name}: ${error instanceof Error ? error.message : String(error)}; nothing is kept`, "bad");
		} finally {
			this.upload = null;
			this.list();
			this.changed();
		}
	}

	private add(text: string, kind: Line["kind"]): void {
		this.lines = [...this.lines, { number: ++this.numbers, text, kind }].slice(-LINES_MOST);
	}
}
