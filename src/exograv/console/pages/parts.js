// Parts of the pages: alarms, and the estimate of the arm.
import { nameOf, number, say, sentence } from "./words.js";

const at = (id) => document.getElementById(id);

export function clockText(seconds) {
  const whole = Math.ceil(seconds);
  return whole < 100 ? `${whole} s` : `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

// Options of a select element that follow the server. They are replaced only when they change.
export function choose(select, values, chosen, text) {
  const key = JSON.stringify([values, chosen, document.documentElement.lang]);
  if (select.dataset.key === key) return;
  select.dataset.key = key;
  select.replaceChildren(...values.map((value) => new Option(text(value), value)));
  select.value = chosen;
}

// Alarms of machine, run and console in one list, the most urgent first.
export function listAlarms({ shown, run, alarms }, acknowledge, mayAcknowledge) {
  const RANK = { high: 0, medium: 1, low: 2 };
  const all = [
    ...shown.alarms.filter((alarm) => !alarm.acknowledged_by).map((alarm) => ({ of: "machine", ...alarm })),
    ...(run?.alarms ?? []).map((alarm) => ({ of: "run", priority: "medium", since_s: alarm.t, ...alarm })),
    ...alarms.map((alarm) => ({ of: "console", ...alarm })),
  ].sort((a, b) => RANK[a.priority] - RANK[b.priority] || b.since_s - a.since_s);
  const list = at("alarms").firstElementChild;
  const key = JSON.stringify([all, mayAcknowledge, document.documentElement.lang]);
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...all.map((alarm) => alarmItem(alarm, shown.t, acknowledge, mayAcknowledge)));
  at("alarms").hidden = all.length === 0;
}

function alarmItem(alarm, t, acknowledge, mayAcknowledge) {
  const item = document.createElement("li");
  item.dataset.priority = alarm.priority;
  const text = document.createElement("span");
  const mark = { high: "‼", medium: "!", low: "·" }[alarm.priority];
  const times = alarm.times > 1 ? ` (${say("console.times", { times: alarm.times })})` : "";
  text.textContent = `${mark} ${sentence(alarm.text)}${times}`;
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = say("console.acknowledge");
  button.disabled = !mayAcknowledge;
  button.onclick = () => acknowledge(alarm.of, alarm.number);
  item.append(text, button);
  return item;
}

// Intervals of the estimate beside those of the prior, and the predicted left over.
export function learning(shown) {
  const { learning: learned } = shown;
  at("learned").value = learned?.share_done ?? 0;
  at("learned").hidden = at("left-over-title").hidden = !learned;
  at("outcome").textContent = learned ? sentence(learned.outcome) : say("console.not_identified");
  at("parameters").replaceChildren(...(learned?.parameters ?? []).map(parameterRow));
  const worst = Math.max(0.3, ...(learned?.left_over_prior_Nm ?? []), ...(learned?.left_over_Nm ?? []));
  const rows = (learned?.left_over_Nm ?? []).map((value, i) => {
    const before = learned.left_over_prior_Nm[i];
    return leftOverRow(nameOf("joint", shown.joints[i] ?? ""), value, before, worst);
  });
  at("left-over").replaceChildren(...rows);
  const farthest = learned?.farthest ? `${nameOf("joint", learned.farthest)}: ` : "";
  at("learning-help").textContent = learned?.help.text ? `${farthest}${sentence(learned.help)}` : "";
}

// What the rests have taught: stated residual torque before and now beside its target, and what the operator may do.
export function rests(shown) {
  const { rests: told } = shown;
  at("rests").hidden = !told || told.before_Nm.length === 0;
  if (at("rests").hidden) return;
  at("rests-done").textContent = say("console.rests_done", { rests: told.rests, seconds: number(told.motion_s) });
  const worst = Math.max(0.3, ...told.before_Nm, ...told.stated_Nm, ...told.target_Nm);
  const rows = told.stated_Nm.map((value, i) => {
    const joint = nameOf("joint", shown.joints[i] ?? "");
    return restRow(joint, value, told.before_Nm[i], told.target_Nm[i], worst);
  });
  at("rests-stated").replaceChildren(...rows);
  at("rests-said").textContent = told.sentences.map(sentence).join(" ");
  at("rests-why").textContent = sentence(told.why_not);
}

function parameterRow(parameter) {
  const reach = 1.6 * Math.max(parameter.prior_half_width, parameter.half_width, Math.abs(parameter.mean - parameter.prior));
  const x = (value) => 100 * (0.5 + (0.5 * (value - parameter.prior)) / (reach || 1));
  const bar = interval([
    ["prior", x(parameter.prior - parameter.prior_half_width), x(parameter.prior + parameter.prior_half_width)],
    ["now", x(parameter.mean - parameter.half_width), x(parameter.mean + parameter.half_width)],
  ], x(parameter.mean));
  const digits = parameter.half_width < 0.1 ? 3 : 2;
  const value = `${number(parameter.mean, digits)} ± ${number(parameter.half_width, digits)} ${parameter.unit}`;
  return row(nameOf("parameter", parameter.name), bar, value);
}

function leftOverRow(joint, value, before, worst) {
  const bar = interval([["prior", 0, (100 * before) / worst], ["now", 0, (100 * value) / worst]]);
  const text = `${number(value, 2)} (${say("console.before", { value: number(before, 2) })})`;
  return row(joint, bar, text);
}

function restRow(joint, value, before, target, worst) {
  const spans = [["prior", 0, (100 * before) / worst], ["now", 0, (100 * value) / worst]];
  const text = `${number(before, 2)} → ${number(value, 2)} / ${number(target, 2)}`;
  return row(joint, interval(spans, (100 * target) / worst), text);
}

function row(name, bar, value) {
  const element = document.createElement("div");
  element.className = "estimate";
  const label = document.createElement("span");
  label.textContent = name;
  const figure = document.createElement("span");
  figure.className = "figure";
  figure.textContent = value;
  element.append(label, bar, figure);
  return element;
}

function interval(spans, mean = null) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 100 10");
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("aria-hidden", "true");
  for (const [kind, low, high] of spans) {
    const rect = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    const [from, to] = [Math.max(low, 0), Math.min(high, 100)];
    const values = { x: from, width: Math.max(to - from, 0.5), y: kind === "now" ? 2.5 : 0.5, height: kind === "now" ? 5 : 9 };
    for (const [key, value] of Object.entries(values)) rect.setAttribute(key, value);
    rect.setAttribute("class", kind);
    svg.append(rect);
  }
  if (mean !== null) {
    const line = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    for (const [key, value] of Object.entries({ x: mean - 0.6, width: 1.2, y: 0, height: 10 })) line.setAttribute(key, value);
    line.setAttribute("class", "mean");
    svg.append(line);
  }
  return svg;
}
