// Page of the participant: target, arrow, countdown, and every touch with its own time. It never shows the arm.
import { Line, now } from "./line.js";
import { lockPage } from "./lock.js";
import { showLine } from "./standing.js";
import { Touches } from "./touches.js";
import { Trails } from "./trails.js";
import { language, loadWords, number, say } from "./words.js";

const at = (id) => document.getElementById(id);
const ARROWS = {
  up: "M0 -46 L40 0 L17 0 L17 46 L-17 46 L-17 0 L-40 0 Z",
  down: "M0 46 L40 0 L17 0 L17 -46 L-17 -46 L-17 0 L-40 0 Z",
  left: "M-46 0 L0 -40 L0 -17 L46 -17 L46 17 L0 17 L0 40 Z",
  right: "M46 0 L0 -40 L0 -17 L-46 -17 L-46 17 L0 17 L0 40 Z",
};
const HALVES = {
  upper: [-1, -1, 2, 1],
  lower: [-1, 0, 2, 1],
  left: [-1, -1, 1, 2],
  right: [0, -1, 1, 2],
  whole: [-1, -1, 2, 2],
};
const PLACE = { x_fraction: 0.5, y_fraction: 0.5, visible: "upper" };
const LOOK_MS = 200;
// Picture without a protocol.
const IDLE = { screen: "idle", target: null, diameter_px: null, arrow: null, countdown_s: null, window: null, windows: null };

const touches = new Touches();
let sequence = 0;
let picture = null;
let notice = null;
let rest = null;
let pictureAt = 0;
let target = PLACE;

const line = new Line("participant", { picture: take, touched }, changed);
const trails = new Trails(line);

function take(message) {
  notice = message.notice;
  rest = message.rest;
  picture = message.picture ?? IDLE;
  pictureAt = now();
  target = picture.target ?? target;
  at("calibration").textContent = message.screen
    ? say("participant.calibrated", { pitch: number(message.screen.pitch_x_mm, 3) })
    : say("participant.uncalibrated");
  draw();
}

function touched(message) {
  touches.acknowledge(message.page, message.sequence);
}

function changed(state) {
  showLine(state, line);
  // A lost line ends the picture: an old countdown or arrow would mislead. Touches are still taken and kept.
  if (state === "ended" || state === "shut" || state === "gone") {
    picture = { ...IDLE, screen: "lost" };
    notice = rest = null;
    draw();
  }
}

// Touches wait until the page's clock is fitted: without the fit their time on the server's clock is unknown.
function send() {
  const message = touches.message(performance.now());
  if (message && line.pongs > 0 && line.send(message)) touches.sent(message, performance.now());
}

setInterval(send, LOOK_MS);

function draw() {
  at("notice").hidden = notice === null;
  if (notice !== null) at("notice").textContent = `${say(`participant.lost.${notice}`)} ${say("participant.lost.then")}`;
  if (picture === null) return;
  const isTask = picture.screen === "task";
  // The machine moves the arm in a rest only, so an announcement never covers the target.
  const announced = isTask ? null : rest;
  document.body.dataset.screen = announced === null ? picture.screen : "announced";
  place(picture.diameter_px);
  at("target").hidden = !isTask;
  const sign = picture.arrow;
  at("arrow").toggleAttribute("hidden", !isTask || sign === null || sign.shape === "none");
  if (sign !== null && sign.shape !== "none") {
    at("arrow").firstElementChild.setAttribute("d", ARROWS[sign.shape]);
    at("arrow").dataset.colour = sign.colour;
    at("arrow").dataset.shape = sign.shape;
    at("arrow").setAttribute("aria-label", say(`arrow.${sign.shape}`));
  }
  at("screen").hidden = isTask;
  if (!isTask) {
    const name = announced === null ? picture.screen : `learn_${announced.stage}`;
    const values = { window: picture.window, windows: picture.windows, seconds: announced?.seconds };
    at("headline").textContent = say(`participant.${name}`, values);
    at("more").textContent = say(`participant.${name}.more`, values, "");
  }
  at("agree").hidden = !picture.asks_consent;
  const isWelcome = picture.screen === "welcome" && announced === null;
  at("preparation").hidden = at("calibration").hidden = !isWelcome;
}

function place(diameter_px) {
  const element = at("target");
  element.style.left = `${100 * target.x_fraction}%`;
  element.style.top = `${100 * target.y_fraction}%`;
  // The diameter is in pixels of the panel; CSS pixels may be larger.
  const diameter = (diameter_px ?? 100) / devicePixelRatio;
  element.style.width = element.style.height = `${diameter}px`;
  const [x, y, width, height] = HALVES[target.visible];
  const part = at("shown-part");
  for (const [key, value] of Object.entries({ x, y, width, height })) part.setAttribute(key, value);
}

function count() {
  requestAnimationFrame(count);
  if (picture === null) return;
  const left = picture.countdown_s === null ? null : Math.max(picture.countdown_s - (now() - pictureAt), 0);
  const text = left === null ? "" : clockText(Math.ceil(left));
  if (at("countdown").textContent !== text) at("countdown").textContent = text;
}

function clockText(seconds) {
  return seconds < 100 ? `${seconds}` : `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}

function centre() {
  // The rendered element gives the position of the target. While it is hidden, the field and the fractions give it.
  const box = at("target").getBoundingClientRect();
  if (box.width > 0) return [box.left + box.width / 2, box.top + box.height / 2];
  const field = at("field").getBoundingClientRect();
  return [field.left + target.x_fraction * field.width, field.top + target.y_fraction * field.height];
}

function down(event) {
  if (event.target.closest("button, a")) return;
  event.preventDefault();
  const ratio = devicePixelRatio;
  const [x, y] = centre();
  const touch = {
    page: line.page,
    origin_ms: performance.timeOrigin,
    at: event.timeStamp / 1000,
    sequence,
    x_px: event.clientX * ratio,
    y_px: event.clientY * ratio,
    target_x_px: x * ratio,
    target_y_px: y * ratio,
    width_px: event.width * ratio,
    height_px: event.height * ratio,
    pressure: event.pressure,
    pointer: ["touch", "pen", "mouse"].includes(event.pointerType) ? event.pointerType : "mouse",
    is_primary: event.isPrimary,
    ratio,
    zoom: visualViewport?.scale ?? 1,
  };
  sequence += 1;
  touches.add(touch);
  send();
  trails.begin(event, touch.sequence);
}

async function main() {
  await loadWords();
  lockPage();
  at("field").addEventListener("pointerdown", down);
  for (const kind of ["pointermove", "pointerup", "pointercancel"]) {
    at("field").addEventListener(kind, (event) => trails.go(event));
  }
  at("stop").addEventListener("pointerdown", () => line.stop());
  at("stop").addEventListener("keydown", (event) => ["Enter", " "].includes(event.key) && line.stop());
  addEventListener("keydown", (event) => event.key === "Escape" && line.stop());
  at("agree").onclick = () => line.act("agree");
  at("full").onclick = () => document.documentElement.requestFullscreen({ navigationUI: "hide" }).catch(() => {});
  addEventListener("resize", draw);
  addEventListener("languagechange", draw);
  if ("wakeLock" in navigator) {
    const stayAwake = () => navigator.wakeLock.request("screen").catch(() => {});
    addEventListener("visibilitychange", () => document.visibilityState === "visible" && stayAwake());
    stayAwake();
  }
  changed(line.state);
  count();
  document.body.dataset.language = language;
}

main();
