// SPDX-License-Identifier: GPL-2.0-or-later
// Who the browser is to the gateway, and the form for that.

import { useState } from "preact/hooks";

/** As /api/session has it. */
export interface Session {
	required: boolean;
	users: boolean;
	user: string | null;
	level: string | null;
	plaintext: boolean;
}

const PATIENCE_MS = 10000;

async function post(path: string, body?: object): Promise<Session> {
	const answer = await fetch(path, { method: "POST", signal: AbortSignal.timeout(PATIENCE_MS),
		...(body && { headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) }) });
	const found = await answer.json() as Session & { error?: { message: string } };
	if (!answer.ok)
		throw new Error(found.error?.message ?? `status ${answer.status}`);
	return found;
}

/** The form; `done` gets the session. */
export function Login({ done }: { done: (session: Session) => void }) {
	const [wrong, setWrong] = useState("");
	const [busy, setBusy] = useState(false);
	const submit = (event: SubmitEvent) => {
		event.preventDefault();
		const given = new FormData(event.currentTarget as HTMLFormElement);
		setBusy(true);
		post("api/log-in", { name: given.get("name"), password: given.get("password") })
			.then(session => done(session), (error: Error) => setWrong(error.message)).finally(() => setBusy(false));
	};
	return <form class="login" onSubmit={submit}>
		<h2>Log in</h2>
		<label>name <input name="name" autocomplete="username" autocapitalize="none" required /></label>
		<label>password <input name="password" type="password" autocomplete="current-password" required /></label>
		<button type="submit" disabled={busy}>{busy ? "logging in …" : "Log in"}</button>
		<p class="bad" role="alert">{wrong && `⚠ ${wrong}`}</p>
	</form>;
}

/** Who is logged in, and the way out. */
export function User({ session, done }: { session: Session; done: (session: Session) => void }) {
	const [wrong, setWrong] = useState("");
	if (!session.user)
		return null;
	const leave = () => void post("api/log-out").then(done, (error: Error) => setWrong(`still logged in: ${error.message}`));
	return <p class="user">{session.user} ({session.level}) <button type="button" onClick={leave}>Log out</button>
		<span class="bad" role="alert">{wrong && `⚠ ${wrong}`}</span></p>;
}
