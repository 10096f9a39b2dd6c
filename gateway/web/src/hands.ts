// SPDX-License-Identifier: GPL-2.0-or-later
// What is held: a key that repeats its wish as long as the answers come back and a hand is there.

import type { Link } from "./link.js";

/** What holds something: a pointer's number, or a key. */
export const KEY = "key";
export type Hand = number | typeof KEY;

interface Held {
	hand: Hand;
	timer: number;
	press: number;
	/** Its requests. */
	ids: Set<number>;
}

export class Hands {
	private press = 0;
	/** What is held, by axis. */
	private held = new Map<string, Held>();

	/**
	 * @param method takes axis, speed and press; speed 0 says that it is up
	 * @param everyMs from one wish to the next
	 * @param failed called with the reason when a wish was refused
	 */
	constructor(private link: Link, private method: string, private everyMs: number, private failed: (why: string) => void) {
		// a button may be gone before the hand is: nothing is held without a hand
		for (const event of ["pointerup", "pointercancel"] as const)
			document.addEventListener(event, ({ pointerId }) => this.release(pointerId), true);
		document.addEventListener("keyup", () => this.release(KEY), true);
		document.addEventListener("visibilitychange", () => document.hidden && this.release());
		for (const event of ["blur", "pagehide"])
			window.addEventListener(event, () => this.release());
	}

	/** A key is pressed. It repeats its wish as long as the answers come back, until it is up. */
	hold(axis: string, speed: number, hand: Hand): void {
		if (this.held.has(axis))
			return;
		const press = ++this.press;
		let waits = false;
		const wish = () => {
			if (waits)
				return;
			waits = true;
			const { id, answer } = this.link.send(this.method, { axis, speed, press });
			held.ids.add(id);
			answer.catch((error: Error) => {
				this.up(axis);
				this.failed(error.message);
			}).finally(() => waits = false);
		};
		const held = { hand, timer: window.setInterval(wish, this.everyMs), press, ids: new Set<number>() };
		this.held.set(axis, held);
		wish();
	}

	/** It is up again. */
	up(axis: string): void {
		const held = this.held.get(axis);
		if (!held)
			return;
		clearInterval(held.timer);
		this.held.delete(axis);
		this.link.ask(this.method, { axis, speed: 0, press: held.press }).catch(() => undefined);
	}

	/** A request was refused later: what it was for does not begin while the key is still down. */
	refused(id: number): void {
		for (const [axis, { ids }] of [...this.held])
			if (ids.has(id))
				this.up(axis);
	}

	/** Nobody holds anything any more; or not with this hand. */
	release(hand?: Hand): void {
		for (const [axis, held] of [...this.held])
			if (hand === undefined || held.hand === hand)
				this.up(axis);
	}
}
