// SPDX-License-Identifier: GPL-2.0-or-later
// LinuxCNC, as the gateway tells of it, and what is asked of it.

import { Hands } from "./hands.js";
import type { Link } from "./link.js";

/** As linuxcnc.state has it; what is not there is not known. */
export interface Cnc {
	connected?: boolean;
	why?: string;
	task?: string;
	mode?: string;
	interpreter?: string;
	motion?: string;
	file?: string;
	line?: number;
	paused?: boolean;
	moving?: boolean;
	joints?: number;
	axes?: string[];
	position?: Record<string, number>;
	homed?: boolean[];
	feed_override?: number;
	rapid_override?: number;
	spindle_override?: number;
	max_feed_override?: number;
	max_rapid_override?: number;
	max_spindle_override?: number;
}

const SAID_MOST = 5, JOG_MS = 100;
const STOPS = { "linuxcnc.stop": "Stop", emergency_stop: "Emergency stop" };

export class LinuxCnc {
	state: Cnc = {};
	/** May this browser operate it? */
	allowed = false;
	/** The newest of what went wrong, and of LinuxCNC's messages. */
	said: { text: string; bad: boolean; number: number }[] = [];
	private numbers = 0;
	/** What is jogged. */
	readonly hands: Hands;

	constructor(private link: Link, private changed: () => void) {
		this.hands = new Hands(link, "linuxcnc.jog", JOG_MS, why => this.tell(why, true));
	}

	/** Does the gateway get what is asked? */
	get reachable(): boolean {
		return this.link.lostSince === null;
	}

	get connected(): boolean {
		return this.reachable && this.state.connected === true;
	}

	/** Ask for the state, if there is none. Call it now and then. */
	look(): void {
		if (this.allowed && !this.state.connected)
			this.link.ask("linuxcnc.subscribe").catch((error: Error) => {
				this.state = { connected: false, why: error.message };
				this.changed();
			});
	}

	/** The connection is a new one, or another one's. */
	forget(): void {
		this.state = {};
		this.hands.release();
	}

	/** A notification. */
	hear(method: string, params: object): void {
		if (method === "linuxcnc.state") {
			const state = params as Cnc, { motion } = this.state;
			// what came before it is to be forgotten
			this.state = state.connected === undefined ? { ...this.state, ...state } : state;
			// the buttons are those of other joints or axes
			if (this.state.motion !== motion)
				this.hands.release();
		} else if (method === "linuxcnc.done") {
			const { id, error } = params as { id: number; error: string | null };
			if (error) {
				// what was refused or stopped does not begin while the key is still down
				this.hands.refused(id);
				this.tell(error, true);
			}
		} else if (method === "linuxcnc.said") {
			const { kind, text } = params as { kind: string; text: string };
			this.tell(text, kind === "error");
		}
		if (this.state.task !== "on" || this.state.mode !== "manual")
			this.hands.release();
		this.changed();
	}

	/** Do it; what goes wrong is said. */
	ask(method: string, params: object = {}): void {
		this.link.ask(method, params).catch((error: Error) => this.tell(error.message, true));
	}

	/** Stop. The result is shown each time. */
	stop(method: keyof typeof STOPS): void {
		this.hands.release();
		const what = `${STOPS[method]} at ${new Date().toLocaleTimeString()}`;
		this.link.ask(method).then(() => this.tell(`${what}: done.`, false),
			(error: Error) => this.tell(`${what} is not confirmed: ${error.message}`, true));
	}

	private tell(text: string, bad: boolean): void {
		// the same again and again is one
		if (this.said[0]?.text !== text)
			this.said = [{ text, bad, number: ++this.numbers }, ...this.said].slice(0, SAID_MOST);
		this.changed();
	}
}
