// Page of `exograv data view`: a machine with a slider for each joint, or a recording with a time slider.
import { View3d } from "./view3d.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const NO_WEBGL = "This browser shows no 3D pictures: WebGL is off or missing. Turn on hardware acceleration, or use another browser.";
const DEGREES = 180 / Math.PI;
const at = (id) => document.getElementById(id);
const data = JSON.parse(at("data").textContent);
const { scene, motion } = data;
const view = new View3d(at("scene"), NO_WEBGL);

function element(tag, fields = {}, ...children) {
  const made = Object.assign(document.createElement(tag), fields);
  made.append(...children);
  return made;
}

const named = (name) => name.replaceAll("_", " ");
const unitOf = (joint) => (joint.kind === "revolute" ? [DEGREES, "°"] : [1000, "mm"]);
const shown = (joint, value) => {
  const [factor, unit] = unitOf(joint);
  return `${Math.round(factor * value) + 0} ${unit}`; // + 0 makes -0 a 0.
};

const pose = (q, arms) => view.pose(new Map(scene.joints.map((joint, i) => [joint.name, q[i]])), arms);

// A machine: one slider per joint, within its limits.
function sliders() {
  at("joints-title").textContent = "Joints";
  const q = scene.joints.map((joint) => joint.rest);
  const move = () => pose(q, null);
  const rows = scene.joints.map((joint, i) => {
    const [factor] = unitOf(joint);
    const output = element("output", { className: "figure", textContent: shown(joint, q[i]) });
    const slider = element("input", {
      type: "range", step: "0.1", min: factor * (joint.lower ?? -Math.PI), max: factor * (joint.upper ?? Math.PI), value: factor * q[i],
    });
    slider.dataset.joint = joint.name;
    slider.oninput = () => {
      q[i] = Number(slider.value) / factor;
      output.textContent = shown(joint, q[i]);
      move();
    };
    slider.rest = () => {
      slider.value = factor * joint.rest;
      slider.oninput();
    };
    const name = element("span", { textContent: named(joint.name) + (joint.has_motor ? "" : " (no motor)") });
    return element("label", { className: "slide" }, name, output, slider);
  });
  at("joints").replaceChildren(...rows);
  at("rest").hidden = false;
  at("rest").onclick = () => document.querySelectorAll("[data-joint]").forEach((slider) => slider.rest());
  view.gravity(1);
  move();
}

// A recording: position and torques of each joint at the time of the slider.
function player() {
  const { t } = motion;
  const end = t.at(-1);
  let [now, isPlaying, last] = [0, false, null];
  at("player").hidden = false;
  at("joints-title").textContent = "Position, measured and commanded torque";
  at("time").max = end;
  at("speed").replaceChildren(...SPEEDS.map((speed) => element("option", { value: speed, textContent: `${speed}×`, selected: speed === 1 })));
  const most = Math.max(1, ...[motion.tau_measured, motion.tau_commanded].flat(2).map((value) => Math.abs(value ?? 0)));
  const rows = scene.joints.map((joint) => {
    const [position, torque] = [0, 1].map(() => element("output", { className: "figure" }));
    const bars = ["measured", "commanded"].map((kind) => element("meter", { min: 0, max: most, className: kind, title: `${kind} torque` }));
    at("joints").append(element("div", { className: "measure" }, element("span", { textContent: named(joint.name) }), position, torque, ...bars));
    return { position, torque, bars };
  });

  function show(time) {
    now = Math.min(Math.max(time, 0), end);
    at("time").value = now;
    at("clock").textContent = `${now.toFixed(2)} of ${end.toFixed(2)} s`;
    const { number, share } = between(t, now);
    const q = motion.q[number].map((value, i) => value + share * (motion.q[Math.min(number + 1, t.length - 1)][i] - value));
    pose(q, armsAt(now));
    view.gravity(motion.felt[number]);
    at("phase").textContent = named(motion.phases.findLast((phase) => phase.t <= now)?.name ?? "");
    rows.forEach(({ position, torque, bars }, i) => {
      const pair = [motion.tau_measured[number][i], motion.tau_commanded[number][i]];
      position.textContent = shown(scene.joints[i], q[i]);
      torque.textContent = `${pair.map((value) => value?.toFixed(1) ?? "–").join(" / ")} N·m`;
      bars.forEach((bar, k) => (bar.value = Math.abs(pair[k] ?? 0)));
    });
    leftOver();
  }

  function leftOver() {
    const found = motion.left_over.findLast((each) => each.t <= now);
    at("left-over").hidden = found === undefined;
    if (!found) return;
    at("left-over-about").textContent = found.about;
    at("left-over-rows").replaceChildren(
      ...scene.joints.map((joint, i) =>
        element("p", { className: "measure" }, element("span", { textContent: named(joint.name) }), element("output", { className: "figure", textContent: found.Nm[i].toFixed(2) }))),
    );
  }

  function play(isOn) {
    isPlaying = isOn;
    at("play").textContent = isOn ? "Pause" : "Play";
    last = null;
  }
  at("play").onclick = () => {
    if (!isPlaying && now >= end) show(0);
    play(!isPlaying);
  };
  at("time").oninput = () => show(Number(at("time").value));
  show(0);
  return (stamp) => {
    if (!isPlaying) return;
    if (last !== null) show(now + (Number(at("speed").value) * (stamp - last)) / 1000);
    last = stamp;
    if (now >= end) play(false);
  };
}

// Number of the last sample at or before a time, and the share of the way to the next one.
function between(times, time) {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (times[middle] <= time) low = middle;
    else high = middle - 1;
  }
  const gap = (times[low + 1] ?? times[low]) - times[low];
  return { number: low, share: gap > 0 ? Math.min(Math.max((time - times[low]) / gap, 0), 1) : 0 };
}

// The recorded arm where the recording has one near this time; otherwise it moves with its cuffs.
function armsAt(time) {
  const { t, arms } = motion.arm;
  if (t.length === 0) return null;
  const { number, share } = between(t, time);
  const next = Math.min(number + 1, t.length - 1);
  if (Math.min(Math.abs(time - t[number]), Math.abs(t[next] - time)) > motion.arm.gap_s) return null;
  return arms[number].map((arm, i) => arm.map((point, k) => point.map((value, axis) => value + share * (arms[next][i][k][axis] - value))));
}

at("title").textContent = document.title = data.title;
at("about").textContent = data.about;
at("simulated").hidden = !data.is_simulated;
at("note").textContent = scene.note;
view.describe(scene);
let advance = null;
if (motion) advance = player();
else sliders();
window.drawnPictures = () => view.drawn;

function frame(stamp) {
  requestAnimationFrame(frame);
  advance?.(stamp);
  view.draw();
}
requestAnimationFrame(frame);
