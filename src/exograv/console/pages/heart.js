// Heartbeat of the steering page. After a gap it tells the server the cause: only the page can know it.
const BEAT_MS = 200;
const GAP_S = 0.9;
// Timers of a page run late for seconds in a slow browser, and for longer only in a computer that slept.
const SLEPT_S = 30;

export class Heart {
  // isSteering: function that is true while this page holds the lease.
  constructor(line, isSteering) {
    Object.assign(this, { line, isSteering, gap: null, wasHidden: document.hidden });
    this.note();
    setInterval(() => this.beat(), BEAT_MS);
    // The server learns at once that the browser is going to slow this page down.
    document.addEventListener("visibilitychange", () => this.beat());
  }

  note() {
    this.at = { monotonic: performance.now(), wall: Date.now() };
  }

  beat() {
    const monotonic = (performance.now() - this.at.monotonic) / 1000;
    const wall = (Date.now() - this.at.wall) / 1000;
    this.note();
    const seconds = Math.max(monotonic, wall);
    if (seconds > GAP_S) this.gap = { cause: this.causeOf(seconds, wall - monotonic), seconds };
    this.wasHidden = document.hidden;
    if (!this.isSteering() && this.gap === null) return;
    const beat = { kind: "beat", hidden: document.hidden };
    if (this.line.send(this.gap === null ? beat : { ...beat, gap: this.gap })) this.gap = null;
  }

  // The page's clock stands still while most computers sleep; the calendar's does not.
  causeOf(seconds, standstill) {
    if (standstill > GAP_S || (seconds > SLEPT_S && !this.wasHidden)) return "asleep";
    return this.wasHidden || document.hidden ? "hidden" : "slow";
  }
}
