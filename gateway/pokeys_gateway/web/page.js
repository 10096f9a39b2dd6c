// SPDX-License-Identifier: GPL-2.0-or-later
// A plain page: it asks twice a second and shows what it gets. Whatever comes from a device is
// put in as text, never as HTML.

const EVERY_MS = 500, PATIENCE_MS = 1500, EVENTS_EVERY = 4;

/** An element with classes, text and children. */
function make(tag, {text, className, ...attributes} = {}, ...children) {
	const element = document.createElement(tag);
	if (className)
		element.className = className;
	if (text !== undefined)
		element.textContent = text;
	for (const [name, value] of Object.entries(attributes))
		element.setAttribute(name, value);
	element.append(...children);
	return element;
}

async function ask(path) {
	const answer = await fetch(path, {signal: AbortSignal.timeout(PATIENCE_MS)});
	if (!answer.ok)
		throw new Error(`${path}: status ${answer.status}`);
	return answer.json();
}

const two = number => String(number).padStart(2, "0");

/** The numbers for which there is a value of this name; NN stands for the number. */
function numbers(values, name) {
	const found = [];
	for (let i = 0; name.replace("NN", two(i)) in values; i++)
		found.push(i);
	return found;
}

function pins(title, list) {
	if (!list.length)
		return [];
	const items = list.map(({terminal, on}) => make("li", {
		text: on ? `${terminal} ●` : terminal, className: on ? "on" : "",
		"aria-label": `terminal ${terminal} ${on ? "on" : "off"}`,
	}));
	return [make("h3", {text: title}), make("ul", {className: "pins"}, ...items)];
}

function table(title, heads, rows) {
	if (!rows.length)
		return [];
	const kind = column => typeof rows[0][column] === "number" ? "number" : "";
	const head = make("tr", {}, ...heads.map((text, i) => make("th", {text, scope: "col", className: kind(i)})));
	const body = rows.map(row => make("tr", {}, ...row.map((text, i) => make("td", {text, className: kind(i)}))));
	return [make("div", {className: "scroll", tabindex: "0", role: "group", "aria-label": title},
		make("table", {}, make("caption", {text: title}), make("thead", {}, head), make("tbody", {}, ...body)))];
}

function axes({values, words}) {
	return numbers(values, "joint.NN.counts").filter(i => i < values["info.Axes"]).map(i => {
		const of = name => values[`joint.${two(i)}.${name}`];
		const marks = [of("enabled") && "enabled", of("homed") && "homed", of("limit-neg") && "limit −",
			of("limit-pos") && "limit +", of("home-sw") && "home switch", of("error") && "error"];
		return [String(i), of("counts"), words[`joint.${two(i)}.state`] ?? "", marks.filter(Boolean).join(", ")];
	});
}

function parts(device) {
	const {values} = device;
	// bits of a terminal's function: 2 digital input, 4 digital output, 8 analog input
	const terminals = numbers(values, "pin.NN.in").filter(i => i < values["info.PinCount"]);
	const of = (i, name) => values[`pin.${two(i)}.${name}`];
	const has = (i, function_) => of(i, "function-in-effect") & function_;
	const inputs = terminals.filter(i => has(i, 2));
	const outputs = terminals.filter(i => has(i, 4));
	const analog = numbers(values, "adc.NN.volts").filter(i => has(i + 40, 8));
	const encoders = numbers(values, "encoder.NN.rawcounts").filter(i => values[`encoder.${two(i)}.enabled`]);
	return [
		...table("Axes", ["axis", "position (pulses)", "state", "signals"], axes(device)),
		...table("Encoders", ["encoder", "count"], encoders.map(i => [String(i), values[`encoder.${two(i)}.rawcounts`]])),
		...pins("Outputs", outputs.map(i => ({terminal: i + 1, on: of(i, "out-fb")}))),
		...pins("Inputs", inputs.map(i => ({terminal: i + 1, on: of(i, "in")}))),
		...table("Analog inputs", ["terminal", "volts"], analog.map(i =>
			[String(i + 41), values[`adc.${two(i)}.volts`].toFixed(3)])),
	];
}

class Card {
	constructor(name) {
		this.name = name;
		this.count = 0;
		this.reason = make("p", {className: "reason"});
		this.values = make("div", {className: "values"});
		this.events = make("ul", {className: "events", tabindex: "0", "aria-label": `events of ${name}`});
		this.element = make("section", {className: "device", "aria-label": name},
			make("h2", {text: name}), this.reason, this.values, make("h3", {text: "Events"}), this.events);
	}

	/** What goes wrong here concerns this device alone. */
	async update() {
		try {
			this.show(await ask(`api/devices/${this.name}`));
			if (this.count++ % EVENTS_EVERY === 0)
				this.list((await ask(`api/devices/${this.name}/events`)).events);
		} catch (error) {
			console.error(error);
			this.age(`${error.message}; what is shown is old`);
		}
	}

	/** Mark what is shown as old, and say why; an empty reason: it is fresh. */
	age(reason) {
		this.element.classList.toggle("old", reason !== "");
		this.reason.className = reason ? "reason bad" : "reason";
		if (reason)
			this.reason.textContent = reason;
	}

	show(device) {
		const known = device.type !== null;     // or nothing was ever read
		this.age(device.connected ? "" : `${device.reason}${known ? "; what is shown is old" : ""}`);
		if (device.connected)
			this.reason.textContent = `${device.type} ${device.serial} at ${device.address} is running; ` +
				`data is ${(device.age_us / 1000).toFixed(1)} ms old`;
		this.values.replaceChildren(...(known ? parts(device) : []));
	}

	list(events) {
		this.events.replaceChildren(...events.slice(-30).reverse().map(event => {
			const time = new Date(event.time);
			return make("li", {className: event.level === "error" ? "bad" : ""},
				make("time", {text: time.toLocaleTimeString(), datetime: event.time}), event.text);
		}));
	}
}

const link = document.getElementById("link");
const main = document.getElementById("devices");
const cards = new Map();

function arrange(names) {
	for (const name of names)
		if (!cards.has(name)) {
			cards.set(name, new Card(name));
			main.append(cards.get(name).element);
		}
	for (const [name, card] of cards)
		if (!names.includes(name)) {
			card.element.remove();
			cards.delete(name);
		}
}

let since = null;

/** A screen reader reads it out, so it is written only when it changes. */
function say(text, bad) {
	if (link.textContent !== text)
		link.textContent = text;
	link.className = bad ? "bad" : "";
}

async function round() {
	try {
		const {devices, trouble} = await ask("api/devices");
		arrange(devices.map(device => device.name));
		await Promise.all([...cards.values()].map(card => card.update()));
		since = null;
		say(trouble || "live", trouble);
	} catch {
		since ??= new Date();
		say(`no connection to the gateway since ${since.toLocaleTimeString()}; what is shown is old`, true);
		for (const card of cards.values())
			card.element.classList.add("old");
	}
	setTimeout(round, EVERY_MS);
}

round();
