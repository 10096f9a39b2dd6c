// SPDX-License-Identifier: GPL-2.0-or-later
// The connection to the gateway: JSON-RPC over a WebSocket. A cable that is pulled out closes nothing, so
// it asks when it has heard nothing, and gives up within two seconds. It comes back by itself.

export type Value = boolean | number | string | null;
export type Values = Record<string, Value>;

/** A device as the gateway has it; null = there is no such device any more. */
export interface State {
	connected: boolean;
	reason: string;
	values: Values;
}

interface Change extends Partial<State> {
	whole?: boolean;
}

type Update = [Record<string, Change | null>, number, { serial: number; full: boolean }];

interface Message {
	id?: number | null;
	method?: string;
	params?: Update | object;
	result?: unknown;
	error?: { code: number; message: string };
}

interface Waiting {
	resolve: (result: never) => void;
	reject: (error: Error) => void;
}

const ASK_AFTER_MS = 500, ANSWER_MS = 900, CONNECT_MS = 1500, WATCH_MS = 250, RETRY_MS = 500;

export class Link {
	/** Devices by name, as of the last message. */
	states = new Map<string, State | null>();
	/** When the last of them came (performance.now()). */
	statesAt = -Infinity;
	/** When the connection was lost, or null while there is one. */
	lostSince: Date | null = new Date();
	/** Was there ever a connection? */
	everLive = false;
	/** Why the last attempt failed, if the gateway has said so. */
	error = "";

	private socket: WebSocket | null = null;
	private ended = new AbortController();
	private heardAt = 0;
	private askedAt: number | null = null;
	private startedAt = -Infinity;
	private number = 0;
	private waiting = new Map<number, Waiting>();

	/**
	 * @param address of the WebSocket
	 * @param opened called at each new connection; the signal says that it is lost. What it throws ends it.
	 * @param changed called after each message that may have changed what is shown
	 * @param notified called at each message that is no answer and no state of a device
	 * @param held do not connect yet: it would be refused
	 */
	constructor(private address: string, private opened: (signal: AbortSignal) => Promise<void>,
			private changed: () => void, private notified: (method: string, params: object) => void, public held = false) {
		setInterval(() => this.watch(), WATCH_MS);
		// a tab that was hidden or frozen must not wait for the next turn of its timer
		for (const event of ["visibilitychange", "resume"])
			document.addEventListener(event, () => this.watch());
		this.watch();
	}

	/** Begin again, as somebody else. */
	restart(): void {
		if (this.socket)
			this.drop();
		this.startedAt = -Infinity;
		this.states.clear();
		this.watch();
	}

	/** The result of a method. Rejected if it fails, or if the connection is lost meanwhile. */
	ask<Result>(method: string, params: object = {}): Promise<Result> {
		return this.send<Result>(method, params).answer;
	}

	/** The same, and the number by which notifications name the request. */
	send<Result>(method: string, params: object = {}): { id: number; answer: Promise<Result> } {
		const id = ++this.number;
		const answer = new Promise<Result>((resolve, reject) => {
			if (this.socket?.readyState !== WebSocket.OPEN) {
				reject(new Error("no connection to the gateway"));
				return;
			}
			this.waiting.set(id, { resolve, reject });
			// LinuxCNC or a disk may hang while the gateway is well
			if (!/^(?:linuxcnc|files)\./.test(method) && method !== "emergency_stop")
				this.askedAt ??= performance.now();
			this.socket.send(JSON.stringify({ jsonrpc: "2.0", id, method, params }));
		});
		return { id, answer };
	}

	/** Want these values of these devices, so many times a second. */
	async subscribe(objects: Record<string, string[]>, rate: number): Promise<void> {
		const { status } = await this.ask<{ status: Record<string, State | null> }>(
			"objects.subscribe", { objects, rate });
		this.states = new Map(Object.entries(status));
		this.statesAt = performance.now();
	}

	private watch(): void {
		const now = performance.now();
		if (this.socket?.readyState === WebSocket.OPEN) {
			if (this.askedAt !== null && now - this.askedAt > ANSWER_MS)
				this.drop();
			else if (this.askedAt === null && now - this.heardAt > ASK_AFTER_MS)
				this.ask("server.info").catch(() => undefined);
		} else if (this.socket && now - this.startedAt > CONNECT_MS)
			this.drop();
		if (!this.socket && !this.held && now - this.startedAt > RETRY_MS)
			this.start(now);
	}

	private start(now: number): void {
		const socket = new WebSocket(this.address);
		const ended = new AbortController();
		this.socket = socket;
		this.ended = ended;
		this.startedAt = now;
		socket.onopen = () => {
			if (this.socket !== socket)
				return;
			this.heard();
			this.opened(ended.signal).then(() => {
				if (this.socket !== socket)
					return;
				this.error = "";
				this.lostSince = null;
				this.everLive = true;
				this.changed();
			}).catch((error: unknown) => {
				if (this.socket !== socket)
					return;
				this.error = error instanceof Error ? error.message : String(error);
				this.drop();
			});
		};
		socket.onmessage = ({ data }) => {
			if (this.socket === socket)
				this.take(JSON.parse(data as string) as Message);
		};
		socket.onclose = () => {
			if (this.socket === socket)
				this.drop();
		};
	}

	private heard(): void {
		this.heardAt = performance.now();
		this.askedAt = null;
	}

	private take(message: Message): void {
		this.heard();
		if (message.method === "notify_status_update" && message.params) {
			const [status, , { full }] = message.params as Update;
			for (const [device, change] of Object.entries(status))
				this.apply(device, change, full);
			this.statesAt = this.heardAt;
			this.changed();
			return;
		}
		if (message.method && message.params) {
			this.notified(message.method, message.params);
			return;
		}
		const waiting = typeof message.id === "number" ? this.waiting.get(message.id) : undefined;
		if (!waiting)
			return;
		this.waiting.delete(message.id as number);
		if (message.error)
			waiting.reject(new Error(message.error.message));
		else
			waiting.resolve(message.result as never);
	}

	private apply(device: string, change: Change | null, full: boolean): void {
		const had = this.states.get(device);
		if (!change || full || change.whole || !had) {
			this.states.set(device, change as State | null);
			return;
		}
		if (change.connected !== undefined)
			had.connected = change.connected;
		if (change.reason !== undefined)
			had.reason = change.reason;
		Object.assign(had.values, change.values);
	}

	private drop(): void {
		const socket = this.socket;
		this.socket = null;
		this.askedAt = null;
		this.ended.abort();
		socket?.close();
		const waiting = [...this.waiting.values()];
		this.waiting.clear();
		for (const one of waiting)
			one.reject(new Error("the connection to the gateway was lost"));
		this.lostSince ??= new Date();
		this.changed();
	}
}
