// Path of a finger after it came down, with the events that the browser coalesced: they are the rawest data.
const POINTS_MAX = 100;

export class Trails {
  constructor(line) {
    this.line = line;
    this.fingers = new Map();
  }

  begin(event, sequence) {
    this.fingers.set(event.pointerId, { sequence, points: [] });
  }

  go(event) {
    const finger = this.fingers.get(event.pointerId);
    if (finger === undefined) return;
    const events = event.type === "pointermove" ? (event.getCoalescedEvents?.() ?? [event]) : [event];
    for (const one of events.length > 0 ? events : [event]) {
      finger.points.push([
        one.timeStamp / 1000,
        Math.round(100 * one.clientX * devicePixelRatio) / 100,
        Math.round(100 * one.clientY * devicePixelRatio) / 100,
      ]);
    }
    const ended = { pointerup: "up", pointercancel: "cancel" }[event.type] ?? null;
    if (ended !== null) this.fingers.delete(event.pointerId);
    if (ended !== null || finger.points.length >= POINTS_MAX) this.tell(finger, ended);
  }

  tell(finger, ended) {
    const points = finger.points.splice(0).slice(-POINTS_MAX);
    this.line.send({ kind: "trail", page: this.line.page, sequence: finger.sequence, ended, points });
  }
}
