// Touches without an acknowledgement of the server. They survive a lost line, a reload and a closed browser.
const KEY = "touches";
const AT_ONCE = 30;
const KEPT_MAX = 2000;

export class Touches {
  constructor(storage = localStorage) {
    this.storage = storage;
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
    this.keep();
  }

  keep() {
    try {
      this.storage.setItem(KEY, JSON.stringify(this.waiting));
    } catch {
      // Without storage the touches stay in memory until the page is closed.
    }
  }

  // The oldest waiting touches as one message; null if none waits.
  message() {
    return this.waiting.length === 0 ? null : { kind: "touches", touches: this.waiting.slice(0, AT_ONCE) };
  }
}
