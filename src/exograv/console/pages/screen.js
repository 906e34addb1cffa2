// Size of the panel's pixels, measured with a bank card or a ruler. The size that the device reports is not used.
import { Line } from "./line.js";
import { showLine } from "./standing.js";
import { loadWords, number, say, sentence } from "./words.js";

const at = (id) => document.getElementById(id);
const CARD_RATIO = 53.98 / 85.6;
const line = new Line("participant", {}, (state) => {
  showLine(state, line);
});

function show() {
  at("card").style.width = `${at("width").value}px`;
  at("card").style.height = `${at("height").value}px`;
}

async function measure(question) {
  const answer = await line.ask({ kind: "calibrate", ...question });
  const { screen } = answer;
  at("found").dataset.taken = answer.taken;
  at("found").textContent = answer.taken
    ? say("screen.done", {
        x: number(screen.pitch_x_mm, 4),
        y: number(screen.pitch_y_mm, 4),
        error: number(100 * screen.relative_error, 1),
      })
    : sentence(answer.why) || say("console.no_answer");
}

async function main() {
  await loadWords();
  at("width").value = 320;
  at("height").value = 320 * CARD_RATIO;
  // The rectangle keeps the shape of a card. Its height can also be set alone, which shows if the pixels are square.
  at("width").oninput = () => {
    at("height").value = at("width").value * CARD_RATIO;
    show();
  };
  at("height").oninput = show;
  show();
  at("use-card").onclick = () => {
    const box = at("card").getBoundingClientRect();
    return measure({ card_px: [box.width * devicePixelRatio, box.height * devicePixelRatio] });
  };
  at("ruler").onsubmit = (event) => {
    event.preventDefault();
    const distance_mm = Number(at("length").value.replace(",", "."));
    if (!(distance_mm > 0)) return at("length").select();
    const dx_px = at("rule").getBoundingClientRect().width * devicePixelRatio;
    return measure({ spans: [{ dx_px, dy_px: 0, distance_mm }] });
  };
}

main();
