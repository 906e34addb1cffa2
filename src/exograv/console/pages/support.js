// Weight support: the one quantity, in one direction, of all pages. 100 % carries the whole arm, 0 % none of it.
import { number, say } from "./words.js";

const at = (id) => document.getElementById(id);

export function gravityLevelOf(support) {
  return 1 - support / 100;
}

export function supportText(share) {
  const support = Math.round(100 * share);
  // A number and its per cent sign stay on one line.
  return say("support.value", { support: number(support), felt: number(100 - support) }).replaceAll(" %", "\u00a0%");
}

// Show the support in force and the requested one; return the share in force. An arm that the machine does not carry has
// no support, whatever level was requested.
export function showSupport(shown) {
  const now = shown.arm_share * (1 - shown.gravity_level);
  at("support-now").textContent = say("support.now", { value: supportText(now) });
  at("support-asked").textContent = say("support.asked", { value: supportText(1 - shown.gravity_level_asked) });
  return now;
}
