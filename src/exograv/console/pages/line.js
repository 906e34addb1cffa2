// Line to the server: it reconnects by itself, measures the clock offset, and settles every request.
const PING_S = 1.0;
const SILENT_S = 3.5;
// Silence of the server after which the page marks its values as old.
const QUIET_S = 1.5;
const WATCH_MS = 250;
const BACK_AFTER_MS = [200, 400, 800, 1500];
const ANSWER_MS = 4000;

export function name(bytes = 12) {
  const raw = crypto.getRandomValues(new Uint8Array(bytes));
  return Array.from(raw, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

// Time since this opening of the page [s], on the clock of events.
export function now() {
  return performance.now() / 1000;
}

export class Line {
  // hear: handlers by kind of message; changed: called with the state of the line:
  // "open"; "quiet" (open, but nothing comes); "away" (lost, being opened again); "gone" (the server does not answer);
  // "ended" (the server said goodbye); "shut" (logged out, no reconnection).
  constructor(role, hear, changed) {
    this.role = role;
    this.hear = hear;
    this.changed = changed;
    this.page = name(8);
    this.state = "away";
    this.waiting = new Map();
    this.tries = 0;
    this.heardAt = 0;
    this.stopWanted = null;
    this.offset = null;
    this.best = Infinity;
    addEventListener("online", () => this.connect());
    setInterval(() => this.ping(), 1000 * PING_S);
    this.watched = now();
    setInterval(() => this.watch(), WATCH_MS);
    this.connect();
  }

  async connect() {
    if (this.socket || this.state === "shut") return;
    this.socket = "coming";
    try {
      const response = await fetch(`/${this.role}/ticket`, { method: "POST", headers: { "X-Exograv": "1" } });
      if (response.status === 403) return this.become("shut");
      this.open((await response.json()).ticket);
    } catch {
      this.socket = null;
      if (this.state === "away") this.become("gone");
      this.later();
    }
  }

  open(ticket) {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/${this.role}/line`);
    this.socket = socket;
    socket.onopen = () => socket.send(JSON.stringify({ kind: "hello", ticket, page: this.page }));
    socket.onmessage = (event) => this.take(JSON.parse(event.data));
    socket.onclose = (event) => this.closed(event);
  }

  closed(event) {
    this.socket = null;
    this.closeCode = event.code;
    for (const settle of this.waiting.values()) settle({ taken: false, why: "", lost: true });
    this.waiting.clear();
    if (this.state !== "ended") this.become("away");
    this.later();
  }

  later() {
    const after = BACK_AFTER_MS[Math.min(this.tries, BACK_AFTER_MS.length - 1)];
    this.tries += 1;
    setTimeout(() => this.connect(), after);
  }

  become(state) {
    this.state = state;
    this.isQuiet = false;
    this.changed(state);
  }

  // A page that was busy itself cannot judge the server: its messages wait until the page reads them.
  watch() {
    const late = now() - this.watched > (2 * WATCH_MS) / 1000;
    this.watched = now();
    if (!late && this.state === "open" && !this.isQuiet && now() - this.heardAt > QUIET_S) {
      this.isQuiet = true;
      this.changed("quiet");
    }
  }

  take(message) {
    // After its farewell the server may still send values, which would pose as present ones.
    if (this.state === "ended" && message.kind !== "welcome") return;
    this.heardAt = now();
    if (this.isQuiet) {
      this.isQuiet = false;
      this.changed(this.state);
    }
    if (message.kind === "welcome") {
      this.tries = 0;
      this.number = message.line;
      this.ended = null;
      this.become("open");
      for (let i = 0; i < 4; i += 1) setTimeout(() => this.ping(), 60 * i);
      if (this.stopWanted) this.stop(this.stopWanted);
    } else if (message.kind === "pong") {
      this.previous = { asked: message.asked, back: now() };
      const way = this.previous.back - message.asked;
      if (way <= this.best * 1.5 + 0.002) {
        this.best = Math.min(way, this.best);
        this.offset = 0.5 * (message.heard + message.answered) - 0.5 * (message.asked + this.previous.back);
      }
      if (this.pongs === undefined) this.pongs = 0;
      this.pongs += 1;
    } else if (message.kind === "ended") {
      this.ended = message;
      this.become("ended");
    } else if (message.kind === "answer") {
      this.waiting.get(message.answer.id)?.({ ...message, ...message.answer });
      this.waiting.delete(message.answer.id);
    }
    this.hear[message.kind]?.(message);
  }

  ping() {
    if (this.state === "open" && now() - this.heardAt > SILENT_S) {
      // A network that drops all packets never closes the socket, so the page closes it.
      this.socket.onclose = this.socket.onmessage = null;
      this.socket.close();
      return this.closed({ code: 1006 });
    }
    const { previous } = this;
    this.previous = undefined;
    this.send(previous ? { kind: "ping", asked: now(), previous } : { kind: "ping", asked: now() });
  }

  send(message) {
    if (this.state !== "open") return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  // Send a request; the promise always settles, with { taken, why } and with lost: true if no answer came.
  ask(message) {
    const id = message.id ?? name();
    return new Promise((settle) => {
      if (!this.send({ ...message, id })) return settle({ taken: false, why: "", lost: true });
      this.waiting.set(id, settle);
      setTimeout(() => {
        if (this.waiting.delete(id)) settle({ taken: false, why: "", lost: true });
      }, ANSWER_MS);
    });
  }

  act(kind, fields = {}, seen_version = undefined) {
    const version = seen_version === undefined ? {} : { seen_version };
    return this.ask({ kind: "do", made: now(), act: { kind, ...fields }, ...version });
  }

  // A Stop without an answer is sent again as soon as the line is open.
  async stop(id = name()) {
    this.stopWanted = id;
    const answer = await this.ask({ kind: "do", id, made: now(), act: { kind: "stop" } });
    if (!answer.lost && this.stopWanted === id) this.stopWanted = null;
    return answer;
  }
}
