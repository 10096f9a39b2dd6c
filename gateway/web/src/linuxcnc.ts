// SPDX-License-Identifier: GPL-2.0-or-later
// LinuxCNC, as the gateway tells of it, and what is asked of it.

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
}

const SAID_MOST = 5, JOG_MS = 100;

export class LinuxCnc {
	state: Cnc = {};
	/** May this browser operate it? */
	allowed = false;
	/** The newest of what went wrong, and of LinuxCNC's messages. */
	said: { text: string; bad: boolean; number: number }[] = [];
	private numbers = 0;
	private press = 0;
	/** What is held: the timer of its repetition, by axis. */
	private held = new Map<string, number>();

	constructor(private link: Link, private changed: () => void) {
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
		this.release();
	}

	/** A notification. */
	hear(method: string, params: object): void {
		if (method === "linuxcnc.state") {
			const state = params as Cnc;
			// what came before it is to be forgotten
			this.state = state.connected === undefined ? { ...this.state, ...state } : state;
		} else if (method === "linuxcnc.done" && (params as { error: string | null }).error)
			this.tell((params as { error: string }).error, true);
		else if (method === "linuxcnc.said") {
			const { kind, text } = params as { kind: string; text: string };
			this.tell(text, kind === "error");
		}
		if (this.state.task !== "on" || this.state.mode !== "manual")
			this.release();
		this.changed();
	}

	/** Do it; what goes wrong is said. */
	ask(method: string, params: object = {}): void {
		this.link.ask(method, params).catch((error: Error) => this.tell(error.message, true));
	}

	/** Stop, whatever it does. */
	stop(): void {
		this.release();
		this.ask("linuxcnc.stop");
	}

	emergencyStop(): void {
		this.release();
		this.ask("emergency_stop");
	}

	/** A key is pressed. It repeats its wish as long as the answers come back, until it is up. */
	hold(axis: string, speed: number): void {
		if (this.held.has(axis))
			return;
		const press = ++this.press;
		let waits = false;
		const jog = () => {
			if (waits)
				return;
			waits = true;
			this.link.ask("linuxcnc.jog", { axis, speed, press }).catch((error: Error) => {
				this.up(axis);
				this.tell(error.message, true);
			}).finally(() => waits = false);
		};
		this.held.set(axis, window.setInterval(jog, JOG_MS));
		jog();
	}

	/** It is up again. */
	up(axis: string): void {
		const timer = this.held.get(axis);
		if (timer === undefined)
			return;
		clearInterval(timer);
		this.held.delete(axis);
		this.link.ask("linuxcnc.jog", { axis, speed: 0, press: this.press }).catch(() => undefined);
	}

	/** Nobody holds anything any more. */
	release(): void {
		for (const axis of [...this.held.keys()])
			this.up(axis);
	}

	private tell(text: string, bad: boolean): void {
		// the same again and again is one
		if (this.said[0]?.text !== text)
			this.said = [{ text, bad, number: ++this.numbers }, ...this.said].slice(0, SAID_MOST);
		this.changed();
	}
}
