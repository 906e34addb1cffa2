// State of the line on a page. Old values never pose as present ones: they are cleared, and the reason is shown at once.
import { say, sentence } from "./words.js";

const at = (id) => document.getElementById(id);

// Show the state of the line; return true while the page may show values and send requests.
export function showLine(where, line) {
  document.body.dataset.line = where;
  const isOpen = where === "open";
  at("away").hidden = isOpen;
  const ending = where === "ended" || (where === "shut" && line.ended);
  const silent = line.role === "participant" && where !== "shut" ? "participant.away" : `line.${where}`;
  if (!isOpen) at("away").textContent = ending ? endedText(line) : say(silent);
  for (const element of document.querySelectorAll("button, select, input")) {
    // On pages with a state, the next state enables what is possible; other pages have no state.
    if (element.matches(".needs-line") && (!isOpen || document.body.matches(".plain"))) element.disabled = !isOpen;
  }
  return isOpen;
}

function endedText(line) {
  return line.role === "participant" ? say("participant.ended") : sentence(line.ended.why);
}

// Reason why no page steers, for operator, therapist and viewer; empty while this page steers or nobody lost the lease.
export class Loss {
  constructor() {
    this.held = false;
  }

  text({ steers, lost }, number) {
    if (steers === number) this.held = true;
    if (steers === number || !lost) return "";
    if (steers === null) return sentence(lost.text);
    return this.held ? `${say("console.taken_over", { line: steers })} ${sentence(lost.text)}` : "";
  }
}

// Age from which values count as old: ten times the period of the state.
const OLD_S = 1.0;

export function ageText({ age_s: age, shown }) {
  return age > OLD_S && shown.mode !== "starting" ? say("console.old", { seconds: Math.floor(age) }) : "";
}
