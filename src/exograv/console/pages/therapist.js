// One knob: how much of the arm's weight is taken away. One button for what comes next, and Stop.
import { Line } from "./line.js";
import { lockPage } from "./lock.js";
import { loadWords, number, say } from "./words.js";

const BEAT_MS = 200;
// A knob that is turned asks a few times a second; the guard's ramp does the rest.
const ASK_EVERY_MS = 150;
// What the button does next; the first that is possible.
const NEXT = [
  ["reset", "therapist.reset"],
  ["take_arm", "therapist.start"],
  ["give_back", "therapist.give_back"],
  ["make_ready", "therapist.ready"],
];
const at = (id) => document.getElementById(id);

let state = null;
let isTurned = false;
let asked = null;
const line = new Line("therapist", { state: take }, changed);

function changed(where) {
  at("away").hidden = where === "open";
  at("away").textContent = say(where === "shut" ? "line.shut" : "line.away");
  document.body.dataset.line = where;
}

function isSteering() {
  return state !== null && line.state === "open" && state.steers === line.number;
}

function next() {
  return NEXT.find(([act]) => state.shown.possible.includes(act));
}

function take(message) {
  state = message;
  const { shown, steers } = message;
  document.body.dataset.mode = shown.mode;
  document.body.dataset.steers = String(isSteering());
  at("mode").textContent = say(`mode.${shown.mode}`, {}, shown.mode_text);
  at("side").textContent = say(`therapist.side.${shown.side}`);
  at("steer").hidden = steers !== null;
  at("now").textContent = say("therapist.now", { now: number(100 * (1 - shown.gravity_level)) });
  if (!isTurned) at("knob").value = 100 * (1 - shown.gravity_level_asked);
  at("knob-value").textContent = `${at("knob").value} %`;
  at("knob").disabled = !isSteering() || message.run_sets_level || !shown.possible.includes("set_level");
  persons(shown);
  const step = next();
  at("next").textContent = say(step?.[1] ?? "therapist.wait");
  at("next").disabled = !isSteering() || step === undefined;
  if (shown.mode === "exo_only" && !shown.is_known) at("why").textContent = say("therapist.unknown");
  else if (shown.latch) at("why").textContent = shown.latch;
}

function persons(shown) {
  const select = at("person");
  const codes = shown.participant && !shown.participants.includes(shown.participant)
    ? [shown.participant, ...shown.participants]
    : shown.participants;
  if (select.dataset.codes !== codes.join()) {
    select.dataset.codes = codes.join();
    select.replaceChildren(...codes.map((code) => new Option(code, code)));
    if (shown.participant) select.value = shown.participant;
  }
  select.disabled = !isSteering() || !shown.possible.includes("don");
}

async function tell(question) {
  const answer = await question;
  at("why").textContent = answer.taken ? "" : answer.lost ? say("console.no_answer") : answer.why;
  return answer;
}

async function begin() {
  const [act] = next() ?? [];
  if (act === undefined) return;
  const { shown } = state;
  const person = at("person").value;
  if (act === "make_ready" && person && person !== shown.participant) {
    const put = await tell(line.act("don", { participant: person }, shown.version));
    if (!put.taken) return;
    // The person has changed, and with it the version; the next state brings it.
    await new Promise((settle) => setTimeout(settle, 300));
  }
  const version = act === "give_back" ? undefined : state.shown.version;
  await tell(line.act(act, {}, version));
}

function turn() {
  const wanted = Number(at("knob").value);
  if (!isTurned || wanted === asked || !isSteering()) return;
  asked = wanted;
  tell(line.act("set_level", { gravity_level: 1 - wanted / 100 }));
}

async function main() {
  await loadWords();
  lockPage();
  at("knob").addEventListener("pointerdown", () => (isTurned = true));
  at("knob").addEventListener("input", () => {
    isTurned = true;
    at("knob-value").textContent = `${at("knob").value} %`;
  });
  at("knob").addEventListener("change", () => {
    turn();
    setTimeout(() => {
      isTurned = false;
      asked = null;
    }, 500);
  });
  setInterval(turn, ASK_EVERY_MS);
  at("next").disabled ||= state === null;
  at("next").onclick = begin;
  at("steer").onclick = () => tell(line.ask({ kind: "steer" }));
  at("stop").addEventListener("pointerdown", () => tell(line.stop()));
  at("stop").addEventListener("keydown", (event) => ["Enter", " "].includes(event.key) && tell(line.stop()));
  addEventListener("keydown", (event) => event.key === "Escape" && tell(line.stop()));
  setInterval(() => isSteering() && line.send({ kind: "beat" }), BEAT_MS);
  changed(line.state);
}

main();
