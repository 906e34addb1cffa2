// Page of the therapist: one knob for the weight support, one button for the next step, and Stop.
import { Heart } from "./heart.js";
import { Line } from "./line.js";
import { lockPage } from "./lock.js";
import { choose } from "./parts.js";
import { ageText, Loss, showLine } from "./standing.js";
import { gravityLevelOf, showSupport, supportText } from "./support.js";
import { showWork } from "./work.js";
import { loadWords, say, sentence } from "./words.js";

// While the knob moves, the page requests its level a few times a second; the guard applies its ramp.
const ASK_EVERY_MS = 150;
// Acts of the button, by priority: the first possible act is the next step.
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
let steering = null;
let lastMode = null;
const loss = new Loss();
const line = new Line("therapist", { state: take }, changed);

function changed(where) {
  if (showLine(where, line)) return;
  state = null;
  at("mode").textContent = say("line.unknown");
  for (const id of ["why", "support-now", "support-asked", "support-percent"]) at(id).textContent = "";
  at("next").textContent = say("therapist.wait");
  at("lost").hidden = at("work").hidden = true;
  document.body.dataset.mode = "unknown";
  document.body.dataset.steers = "false";
}

function isSteering() {
  return state !== null && line.state === "open" && state.steers === line.number;
}

function next() {
  return NEXT.find(([act]) => state?.shown.possible.includes(act));
}

function take(message) {
  state = message;
  const { shown, steers } = message;
  steering = steers;
  at("lost").textContent = loss.text(message, line.number);
  at("lost").hidden = at("lost").textContent === "";
  showWork(shown);
  document.body.dataset.mode = shown.mode;
  document.body.dataset.steers = String(isSteering());
  at("mode").textContent = say(`mode.${shown.mode}`);
  at("steer").hidden = at("steer").disabled = steers !== null;
  // The large figure is the support in force; a turned knob shows its request at once, and the machine follows.
  at("support-percent").textContent = `${Math.round(100 * showSupport(shown))}\u00a0%`;
  if (!isTurned) at("knob").value = 100 * (1 - shown.gravity_level_asked);
  showWanted();
  at("knob").disabled = !isSteering() || message.run_sets_level || !shown.possible.includes("set_level");
  persons(shown);
  const step = next();
  at("next").textContent = say(step?.[1] ?? "therapist.wait");
  at("next").disabled = !isSteering() || step === undefined;
  if (shown.mode === "exo_only" && !shown.is_known) at("why").textContent = say("therapist.unknown");
  else if (shown.latch) at("why").textContent = sentence(shown.latch);
  if (shown.mode === "starting" || ageText(message)) at("why").textContent = ageText(message) || sentence(shown.mode_text);
  else if (shown.mode !== lastMode && !shown.latch) at("why").textContent = "";
  lastMode = shown.mode;
}

// Choice of side and person. A change takes effect at once, while the machine is off.
function persons(shown) {
  const may = isSteering() && shown.possible.includes("don");
  choose(at("side"), shown.sides, shown.side, (side) => say(`side.${side}`));
  at("side").disabled = !may || shown.sides.length < 2;
  const codes = new Set([...shown.participants, ...(shown.participant ? [shown.participant] : [])]);
  choose(at("person"), ["", ...codes], shown.participant ?? "", (code) => code || say("console.nobody"));
  at("person").disabled = !may;
}

async function put() {
  if (state === null) return;
  const code = at("person").value;
  // A participant's file belongs to one side.
  const isOther = at("side").value !== state.shown.side;
  const who = { side: at("side").value, ...(code && !isOther ? { participant: code } : {}) };
  const { taken } = await tell(line.act("don", who, state.shown.version));
  if (!taken) for (const select of [at("side"), at("person")]) delete select.dataset.key;
}

async function tell(question) {
  const answer = await question;
  at("why").textContent = answer.taken ? "" : answer.lost ? say("console.no_answer") : sentence(answer.why);
  return answer;
}

async function begin() {
  const [act] = next() ?? [];
  if (act !== undefined) await tell(line.act(act, {}, act === "give_back" ? undefined : state.shown.version));
}

function showWanted() {
  const wanted = supportText(at("knob").value / 100);
  at("support-asked").textContent = say("support.asked", { value: wanted });
  at("knob").setAttribute("aria-valuetext", wanted);
}

function turn() {
  const wanted = Number(at("knob").value);
  if (!isTurned || wanted === asked || !isSteering()) return;
  asked = wanted;
  tell(line.act("set_level", { gravity_level: gravityLevelOf(wanted) }));
}

async function main() {
  await loadWords();
  lockPage();
  at("knob").addEventListener("pointerdown", () => (isTurned = true));
  at("knob").addEventListener("input", () => {
    isTurned = true;
    showWanted();
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
  at("side").onchange = at("person").onchange = put;
  at("steer").onclick = () => tell(line.ask({ kind: "steer" }));
  at("stop").addEventListener("pointerdown", () => tell(line.stop()));
  at("stop").addEventListener("keydown", (event) => ["Enter", " "].includes(event.key) && tell(line.stop()));
  addEventListener("keydown", (event) => event.key === "Escape" && tell(line.stop()));
  new Heart(line, () => steering === line.number && line.state === "open");
  changed(line.state);
}

main();
