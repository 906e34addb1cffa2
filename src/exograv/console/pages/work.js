// Progress of a calibration or an identification: phase, joint that moves, remaining time, and why it takes that long.
import { clockText } from "./parts.js";
import { nameOf, say, sentence } from "./words.js";

const at = (id) => document.getElementById(id);

export function showWork({ work }) {
  at("work").hidden = work === null;
  if (work === null) return;
  at("work-title").textContent = say(`work.${work.kind}`);
  at("work-phase").textContent = sentence(work.phase);
  at("work-joint").textContent = work.joint ? say("work.joint", { joint: nameOf("joint", work.joint) }) : say("work.no_joint");
  at("work-bar").value = work.share_done;
  const percent = Math.floor(100 * work.share_done);
  const left = work.left_s === null ? say("work.no_estimate") : say("work.left", { left: clockText(work.left_s) });
  at("work-left").textContent = `${percent} % · ${left}`;
  at("work-why").textContent = sentence(work.why);
}
