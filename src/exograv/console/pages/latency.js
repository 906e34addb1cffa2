// Delay of the panel: touches compared with flashes in a steady rhythm. The person's own timing error is included.
import { Line } from "./line.js";
import { lockPage } from "./lock.js";
import { showLine } from "./standing.js";
import { loadWords, number, say, sentence } from "./words.js";

const EVERY_MS = 1000;
const FLASHES = 12;
const PRACTICE = 4;
const LIT_MS = 120;
const LEAST = 5;
const at = (id) => document.getElementById(id);
const line = new Line("participant", {}, (state) => showLine(state, line));

function run() {
  return new Promise((settle) => {
    const flashes = [];
    const touches = [];
    const down = (event) => {
      event.preventDefault();
      touches.push(event.timeStamp);
    };
    at("flash").hidden = false;
    at("flash").addEventListener("pointerdown", down);
    const begun = performance.now() + EVERY_MS;
    const frame = (t) => {
      const since = t - begun - EVERY_MS * flashes.length;
      if (flashes.length < FLASHES && since >= 0) flashes.push(t);
      at("flash").classList.toggle("on", flashes.length > 0 && t - flashes.at(-1) < LIT_MS);
      if (flashes.length < FLASHES || t - flashes.at(-1) < EVERY_MS) return requestAnimationFrame(frame);
      at("flash").hidden = true;
      at("flash").removeEventListener("pointerdown", down);
      settle(delays(flashes.slice(PRACTICE), touches));
    };
    requestAnimationFrame(frame);
  });
}

function delays(flashes, touches) {
  const nearest = (flash) => touches.map((touch) => touch - flash).sort((a, b) => Math.abs(a) - Math.abs(b))[0];
  return flashes.map(nearest).filter((delay) => delay !== undefined && Math.abs(delay) < EVERY_MS / 2);
}

async function measure() {
  const delays_ms = await run();
  if (delays_ms.length < LEAST) {
    at("found").textContent = say("latency.too_few");
    return;
  }
  const mean = delays_ms.reduce((sum, value) => sum + value, 0) / delays_ms.length;
  const squares = delays_ms.reduce((sum, value) => sum + (value - mean) ** 2, 0);
  const spread = Math.sqrt(squares / (delays_ms.length - 1));
  const answer = await line.ask({ kind: "latency", method: "flash", delays_ms });
  at("found").textContent = answer.taken
    ? say("latency.done", { mean: number(mean), spread: number(spread) })
    : sentence(answer.why) || say("console.no_answer");
}

async function main() {
  await loadWords();
  lockPage();
  at("begin").onclick = measure;
}

main();
