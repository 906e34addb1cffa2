// Page of the operator and of viewers: state and requests of the machine, progress of the protocol, open pages.
import { drawWindows, Hits } from "./hits.js";
import { Heart } from "./heart.js";
import { Line, now } from "./line.js";
import { choose, clockText, learning, listAlarms, rests } from "./parts.js";
import { COLOURS, Plot } from "./plot.js";
import { View3d } from "./view3d.js";
import { gravityLevelOf, showSupport, supportText } from "./support.js";
import { ageText, Loss, showLine } from "./standing.js";
import { showWork } from "./work.js";
import { language, loadWords, nameOf, number, say, sentence } from "./words.js";

const at = (id) => document.getElementById(id);
const role = location.pathname.split("/")[1];
const degrees = (rows) => rows.map((row) => row.map((value) => (180 / Math.PI) * value));

// Texts about the present state. They are cleared when the state is unknown.
const TOLD = ["latch", "lost", "said", "steering", "support-now", "support-asked", "run", "late", "recorded", "g", "feed"];

let state = null;
let isSupportHeld = false;
let steers = null;
const loss = new Loss();
const line = new Line(role, { state: takeState, trace: takeTrace, pose: takePose, record: takeRecord }, changed);
const position = new Plot(at("position"), { q: {} });
const torque = new Plot(at("torque"), {
  measured: { dash: [1, 4], alpha: 0.8 },
  desired: { dash: [6, 5], alpha: 0.6, width: 1.5 },
  commanded: {},
});
let [view, described] = [null, null];
const hits = new Hits(at("hits"));

function changed(where) {
  if (showLine(where, line)) return;
  // The state is unknown from now on. Only Stop stays, and it is sent again when the line is back.
  state = null;
  at("mode").textContent = say("line.unknown");
  for (const id of TOLD) at(id).textContent = "";
  at("lost").hidden = at("work").hidden = true;
  document.body.dataset.mode = "unknown";
  document.body.dataset.steers = "false";
}

function isSteering() {
  return state !== null && line.state === "open" && state.steers === line.number;
}

function takeState(message) {
  state = message;
  steers = message.steers;
  const { shown, run } = message;
  at("rig").textContent = shown.title;
  at("arm").textContent = say(`side.${shown.side}`);
  at("person").textContent = shown.participant ?? say("console.nobody");
  at("mode").textContent = say(`mode.${shown.mode}`);
  at("mode").title = sentence(shown.mode_text);
  document.body.dataset.mode = shown.mode;
  at("latch").textContent = ageText(message) || why(shown);
  at("lost").textContent = loss.text(message, line.number);
  at("lost").hidden = at("lost").textContent === "";
  showSteering(message);
  showButtons(shown, run);
  showKnob(shown);
  learning(shown);
  rests(shown);
  showWork(shown);
  at("late").textContent = shown.lateness
    ? say("console.late", mapped(shown.lateness, { p50: "p50_us", p99: "p99_us", max: "max_us" }))
    : "";
  at("recorded").textContent = shown.recorded
    ? `${say("console.recorded", mapped(shown.recorded, { samples: "samples", lost: "lost" }))} ${shown.recorded.why}`
    : "";
  showStreams(shown.streams);
  showRun(message);
  showAircraft(message.aircraft);
  listAlarms(message, (of, alarm) => seen(of, alarm), isSteering());
}

// Streams of other devices that are recorded: EEG, EMG, ECG.
function showStreams(streams) {
  const items = streams.map((stream) => {
    const item = document.createElement("li");
    const rate = stream.rate_Hz === null ? "–" : number(stream.rate_Hz, 1);
    const clock = stream.uncertainty_s === null ? "–" : number(1000 * stream.uncertainty_s, 2);
    item.textContent = `${stream.name} (${stream.type}): ${say(`stream.${stream.condition}`, { rate, gaps: stream.gaps, clock })}`;
    return item;
  });
  at("streams").replaceChildren(...items);
}

function why({ mode, mode_text: modeText, latch, safe_state: safeState }) {
  // A machine that is off says why: it starts, or a fault ended it.
  if (mode === "starting" || (mode === "off" && modeText.code !== "mode.off")) return sentence(modeText);
  return latch ? sentence(latch) : say(`safe.${safeState}`);
}

function mapped(values, names) {
  return Object.fromEntries(Object.entries(names).map(([key, name]) => [key, number(values[name])]));
}

function showSteering({ steers, lines }) {
  const text = steers === line.number ? "console.steering" : steers === null ? "console.nobody_steers" : "console.other_steers";
  at("steering").textContent = role === "viewer" ? say("console.viewer") : say(text, { line: steers });
  at("steer").hidden = at("steer").disabled = role === "viewer" || steers !== null;
  document.body.dataset.steers = String(isSteering());
  const items = lines.map((each) => {
    const item = document.createElement("li");
    item.className = "tag";
    item.textContent = `${each.line} ${say(`role.${each.role}`)}`;
    return item;
  });
  at("lines").replaceChildren(...items);
}

function showButtons(shown, run) {
  for (const button of document.querySelectorAll("[data-act]")) {
    button.disabled = !isSteering() || !shown.possible.includes(button.dataset.act);
  }
  // There are two kinds of step two. Only the one that this arm needs is shown.
  document.querySelector("[data-act=take_arm]").hidden = !shown.is_known;
  document.querySelector("[data-act=identify]").hidden = shown.is_known && !shown.possible.includes("identify");
  at("don").disabled = !isSteering() || !shown.possible.includes("don");
  // While a protocol sets the level, no other level is accepted.
  const isSet = state.run_sets_level || !shown.possible.includes("set_level");
  at("set-support").disabled = at("support").disabled = !isSteering() || isSet;
  for (const button of document.querySelectorAll("[data-support]")) button.disabled = at("set-support").disabled;
  const status = run?.status;
  const clocked = state.protocol?.opening === "clock";
  const may = {
    start: status === "ready",
    pause: status === "running",
    resume: status === "paused",
    open: status === "running" && !clocked,
    close: status === "running" && !clocked,
    end: status === "running" || status === "paused",
  };
  for (const button of document.querySelectorAll("[data-run]")) {
    button.disabled = !isSteering() || !may[button.dataset.run];
    button.hidden = run === null || (clocked && ["open", "close"].includes(button.dataset.run));
  }
  choose(at("side"), shown.sides, shown.side, (side) => say(`side.${side}`));
  at("participants").disabled = at("don").disabled;
  at("side").disabled = at("don").disabled || shown.sides.length < 2;
  choose(at("participants"), ["", ...shown.participants], shown.participant ?? "", (code) => code || say("console.nobody"));
}

function showKnob(shown) {
  showSupport(shown);
  if (!isSupportHeld) at("support").value = 100 * (1 - shown.gravity_level_asked);
  showWanted();
}

function showWanted() {
  at("support-wanted").textContent = `${at("support").value} %`;
  at("support").setAttribute("aria-valuetext", supportText(at("support").value / 100));
}

function showRun({ run, protocol }) {
  at("protocol").textContent = protocol?.title ?? "";
  for (const id of ["words", "progress", "touches", "window-deviations"]) at(id).hidden = run === null;
  if (run === null) {
    at("run").textContent = say("console.no_protocol");
    return;
  }
  const parts = [say(`status.${run.status}`)];
  if (run.status === "running" && run.phase !== "window") parts.push(say(`phase.${run.phase}`));
  if (run.window !== null) parts.push(say("console.window_of", { window: run.window, windows: protocol.windows }));
  if (run.countdown_s !== null) parts.push(clockText(run.countdown_s));
  if (run.left_s !== null) parts.push(say("console.left", { left: clockText(run.left_s) }));
  at("run").textContent = parts.join(" · ");
  at("progress").value = run.left_s !== null ? 1 - run.left_s / protocol.duration_s : run.totals.windows / protocol.windows;
  const { totals } = run;
  const median = totals.deviation_mm ?? totals.deviation_px;
  const unit = totals.deviation_mm ? "mm" : "px";
  at("totals").textContent =
    `${totals.touches} ${say("console.touches")}, ${totals.accepted} ${say("console.accepted")}` +
    (median ? `, ${say("console.median")} ${number(median.median, 1)} ${unit}` : "");
}

function showAircraft(aircraft) {
  at("aircraft").hidden = aircraft === null;
  if (aircraft === null) return;
  const { sample, age_s: age, is_lost: isLost, is_window: isWindow } = aircraft;
  at("g").textContent = sample ? say("console.aircraft_says", { ...sample, g: number(sample.g, 2) }) : "";
  const feed = sample === null ? "none" : isLost ? "lost" : isWindow ? "window" : "heard";
  at("aircraft").dataset.feed = feed;
  at("feed").textContent = say(`feed.${feed}`, { port: aircraft.port, age: number(age, 1) });
}

function takeTrace({ trace }) {
  position.add(trace.t, { q: degrees(trace.q_rad) });
  torque.add(trace.t, {
    measured: trace.tau_measured_Nm,
    desired: trace.tau_desired_Nm,
    commanded: trace.tau_commanded_Nm,
  });
}

// The picture of machine and person is fetched when its key changes; a message holds the positions only.
async function takePose(pose) {
  if (view === null || state === null || pose.scene === null) return;
  if (pose.scene !== described) {
    described = pose.scene;
    try {
      view.describe(await (await fetch(`/${role}/scene`)).json());
    } catch {
      described = null; // The next message tries again.
    }
    if (state === null) return; // The line was lost while the picture was fetched.
  }
  const { joints, gravity_level: level, arm_share: share } = state.shown;
  const position = new Map(joints.map((joint, i) => [joint, pose.q_rad[i]]));
  view.pose(position, pose.arms.length ? pose.arms : null);
  view.gravity(1 - share * (1 - level)); // A machine that does not carry the arm leaves it all of its weight.
}

function takeRecord({ record }) {
  // A touch that the participant's page sent twice is one touch.
  if (record.kind === "touch" && record.reason !== "repeated") hits.add(record);
}

let jointsShown = "";
function legend() {
  const joints = state?.shown.joints ?? [];
  const key = [language, ...joints].join();
  if (jointsShown === key) return;
  jointsShown = key;
  const buttons = joints.map((joint, i) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "joint";
    button.setAttribute("aria-pressed", "true");
    button.innerHTML = '<svg width="18" height="6" aria-hidden="true"><rect width="18" height="6" rx="3"/></svg>';
    button.firstChild.firstChild.setAttribute("fill", COLOURS[i % COLOURS.length]);
    button.append(` ${nameOf("joint", joint)}`);
    button.onclick = () => {
      const isOn = button.getAttribute("aria-pressed") === "true";
      button.setAttribute("aria-pressed", String(!isOn));
      for (const plot of [position, torque]) isOn ? plot.hidden.add(i) : plot.hidden.delete(i);
    };
    return button;
  });
  at("legend").replaceChildren(...buttons);
}

function draw() {
  requestAnimationFrame(draw);
  if (state === null) return;
  legend();
  // The right border follows this page's clock, so that the lines move smoothly between messages.
  const latest = line.offset === null ? (position.times.at(-1) ?? 0) : now() + line.offset - 0.06;
  position.title = say("console.position");
  torque.title = say("console.torque");
  position.draw(latest);
  torque.draw(latest);
  view.draw();
  // Slow content is drawn every fourth time, to save time on a computer without a graphics card.
  if (position.drawn % 4 !== 0) return;
  if (state.run !== null) {
    const { target, screen } = state.protocol;
    hits.draw(screen ? target.diameter_mm / screen.pitch_x_mm : target.diameter_px);
    drawWindows(at("windows"), state.run.windows, state.protocol.windows);
  }
}

async function tell(question) {
  const answer = await question;
  at("said").textContent = answer.taken
    ? ""
    : answer.lost
      ? say("console.no_answer")
      : say("console.refused", { why: sentence(answer.why) });
  return answer;
}

function seen(of, alarm) {
  return tell(of === "machine" ? line.act("acknowledge", { alarm }) : line.ask({ kind: "seen", of, alarm }));
}

function setSupport(support) {
  isSupportHeld = false;
  return tell(line.act("set_level", { gravity_level: gravityLevelOf(support) }));
}

function wire() {
  for (const button of document.querySelectorAll("[data-act], #don")) {
    button.disabled ||= state === null; // No button may be pressed before the first state has arrived.
  }
  for (const button of document.querySelectorAll("[data-act]")) {
    button.onclick = () => tell(line.act(button.dataset.act, {}, versionFor(button.dataset.act)));
  }
  for (const button of document.querySelectorAll("[data-run]")) {
    button.onclick = () => tell(line.ask({ kind: "run", made: now(), word: button.dataset.run }));
  }
  for (const button of document.querySelectorAll("[data-support]")) {
    button.onclick = () => setSupport(Number(button.dataset.support));
  }
  at("support").oninput = () => {
    isSupportHeld = true;
    showWanted();
  };
  at("set-support").onclick = () => setSupport(Number(at("support").value));
  at("don").onclick = () => {
    if (state === null) return;
    const [code, side] = [at("participants").value, at("side").value];
    // A participant's file belongs to one side.
    const known = code && side === state.shown.side ? { participant: code } : {};
    return tell(line.act("don", { side, ...known }, state.shown.version));
  };
  at("steer").onclick = () => tell(line.ask({ kind: "steer" }));
  at("note").onsubmit = async (event) => {
    event.preventDefault();
    const text = at("note-text").value.trim();
    if (text && (await tell(line.act("note", { text }))).taken) at("note-text").value = "";
  };
  at("stop").addEventListener("pointerdown", () => tell(line.stop()));
  at("stop").addEventListener("keydown", (event) => ["Enter", " "].includes(event.key) && tell(line.stop()));
  addEventListener("keydown", (event) => event.key === "Escape" && tell(line.stop()));
  if (role !== "viewer") new Heart(line, () => steers === line.number && line.state === "open");
}

function versionFor(kind) {
  return ["make_ready", "take_arm", "identify", "reset", "learn_rest"].includes(kind) ? state?.shown.version : undefined;
}

function links() {
  const label = document.createElement("span");
  label.textContent = say("console.link_for");
  const buttons = ["participant", "therapist", "viewer", "operator"].map((invited) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = say(`role.${invited}`);
    button.dataset.invite = invited;
    button.onclick = async () => {
      const answer = await tell(line.ask({ kind: "invite", role: invited }));
      at("link").hidden = !answer.taken;
      at("link").querySelector("code").textContent = answer.link ?? "";
    };
    return button;
  });
  at("links").replaceChildren(label, ...(role === "operator" ? buttons : []));
  at("links").hidden = role !== "operator";
}

async function main() {
  await loadWords();
  document.body.dataset.role = role;
  view = new View3d(at("scene"), say("console.no_webgl"), true);
  wire();
  links();
  at("copy").onclick = () => navigator.clipboard?.writeText(at("link").querySelector("code").textContent);
  addEventListener("languagechange", () => {
    links();
    if (state) takeState(state);
    else changed(line.state);
  });
  changed(line.state);
  // Counter of drawn plots, for tests and measurements.
  window.drawnPlots = () => position.drawn;
  window.drawnPictures = () => view.drawn;
  draw();
}

main();
