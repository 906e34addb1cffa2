// Touches without an acknowledgement of the server. They survive a lost line, a reload and a closed browser.
const KEY = "touches";
const AT_ONCE = 30;
const KEPT_MAX = 2000;
// Time without an acknowledgement after which a touch is sent again.
const RESEND_MS = 700;
const name = (touch) => `${touch.page} ${touch.sequence}`;

export class Touches {
  constructor(storage = localStorage) {
    this.storage = storage;
    this.sentAt = new Map();
    try {
      this.waiting = JSON.parse(storage.getItem(KEY)) ?? [];
    } catch {
      this.waiting = [];
    }
  }

  add(touch) {
    this.waiting.push(touch);
    if (this.waiting.length > KEPT_MAX) this.waiting.shift();
    this.keep();
  }

  acknowledge(page, sequence) {
    this.waiting = this.waiting.filter((touch) => touch.page !== page || touch.sequence !== sequence);
    this.sentAt.delete(name({ page, sequence }));
    this.keep();
  }

  keep() {
    try {
      this.storage.setItem(KEY, JSON.stringify(this.waiting));
    } catch {
      // Without storage the touches stay in memory until the page is closed.
    }
  }

  // The oldest touches that must be sent now [ms], as one message; null if there are none. A touch whose acknowledgement
  // may still be on its way is not sent again: the server would have to reject it as repeated.
  message(now) {
    const due = this.waiting.filter((touch) => now - (this.sentAt.get(name(touch)) ?? -Infinity) >= RESEND_MS);
    return due.length === 0 ? null : { kind: "touches", touches: due.slice(0, AT_ONCE) };
  }

  sent(message, now) {
    for (const touch of message.touches) this.sentAt.set(name(touch), now);
  }
}
