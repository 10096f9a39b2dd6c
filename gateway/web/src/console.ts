// SPDX-License-Identifier: GPL-2.0-or-later
// The console of the gateway: lines to the machine, and what it says.

import type { Link } from "./link.js";

export interface Heater {
	name: string;
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
	axes?: string[];
	files?: boolean;
	halted?: string;
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

const LINES_MOST = 500, HISTORY_MOST = 100, AHEAD_MOST = 6, SILENT_MS = 20000;
const LIST = { begin: "Begin file list", end: "End file list" };
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
	private numbers = 0;
	private listed: File[] | null = null;
	private subscribed = false;
	/** Called at each reply that ends with ok or Error. */
	private replied: ((text: string) => void) | null = null;

	constructor(private link: Link, private changed: () => void) { }

	/** May this browser command a device by G-code? */
	get commands(): boolean {
		return Boolean(this.info?.send && this.info.device);
	}

	/** There is a new connection, and nobody has subscribed. */
	forget(): void {
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
			} else if (!REPORT.test(text) && !(this.upload && text === "ok"))
				this.add(text, /^(?:Error:|error: |\[not stopped|\[the stop is not)/.test(text) ? "bad" : "said");
			if (/^ok\b|^Error:|^error: /.test(text))
				this.replied?.(text);
		}
		this.changed();
	}

	/** Lines for the machine, one after the other; they are shown. */
	send(...lines: string[]): void {
		for (const line of lines) {
			this.add(line, "sent");
			this.link.ask("console.send", { line }).catch((error: Error) => this.add(`${line}: ${error.message}`, "bad"));
		}
		this.changed();
	}

	/** What somebody has typed. */
	type(line: string): void {
		this.history = [...this.history.filter(one => one !== line), line].slice(-HISTORY_MOST);
		this.send(line);
	}

	/** The files of the machine. */
	list(): void {
		this.link.ask("console.send", { line: "M20" }).catch(() => undefined);
	}

	/** Send a file, a line for each ok. */
	async put(name: string, text: string): Promise<void> {
		const lines = text.split(/\r?\n/).map(line => line.replace(/;.*/, "").trim()).filter(line => line);
		this.upload = { name, done: 0, all: lines.length };
		try {
			await this.flow([`M28 ${name}`]);
			await this.flow(lines);
			await this.flow(["M29"]);
			this.add(`${name}: ${lines.length} lines were sent`, "said");
		} catch (error) {
			this.add(`${name}: ${error instanceof Error ? error.message : String(error)}; nothing is kept`, "bad");
			this.link.ask("console.send", { line: "M28" }).catch(() => undefined);
			this.link.ask("console.send", { line: "M29" }).catch(() => undefined);
		} finally {
			this.upload = null;
			this.replied = null;
			this.list();
			this.changed();
		}
	}

	/** Lines whose replies are waited for, some at once. */
	private flow(lines: string[]): Promise<void> {
		let sent = 0, answered = 0, timer = 0;
		return new Promise((resolve, reject) => {
			const fail = (why: string) => {
				clearTimeout(timer);
				reject(new Error(why));
			};
			const go = () => {
				clearTimeout(timer);
				if (answered === lines.length) {
					resolve();
					return;
				}
				timer = window.setTimeout(() => fail("the machine does not answer"), SILENT_MS);
				while (sent < lines.length && sent < answered + AHEAD_MOST)
					this.link.ask("console.send", { line: lines[sent++]! }).catch((error: Error) => fail(error.message));
			};
			this.replied = text => {
				if (!text.startsWith("ok")) {
					fail(text);
					return;
				}
				answered++;
				if (this.upload)
					this.upload.done += lines.length > 1 ? 1 : 0;
				go();
			};
			go();
		});
	}

	private add(text: string, kind: Line["kind"]): void {
		this.lines = [...this.lines, { number: ++this.numbers, text, kind }].slice(-LINES_MOST);
	}
}
