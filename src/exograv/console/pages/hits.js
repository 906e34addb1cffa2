// Touches on the target as they arrive, and the deviations of each window.
import { fitted, niceStep } from "./plot.js";
import { number } from "./words.js";

const GOOD = "#2fc58f";
const BAD = "#ff7a4d";
const FADE = 24;

export class Hits {
  constructor(canvas) {
    Object.assign(this, { canvas, touches: [], radius: 75 });
  }

  add(record) {
    this.touches.push(record);
    if (this.touches.length > 400) this.touches.shift();
  }

  // diameter_px: diameter of the target in pixels of the panel.
  draw(diameter_px) {
    const { context, width, height } = fitted(this.canvas);
    this.radius = 0.5 * diameter_px;
    const reach = Math.max(2.2 * this.radius, ...this.touches.slice(-FADE).map((touch) => 1.1 * touch.deviation_px));
    const scale = (0.5 * Math.min(width, height)) / Math.min(reach, 8 * this.radius);
    const [x0, y0] = [width / 2, height / 2];
    context.strokeStyle = "#9aa7b4";
    context.lineWidth = 1.5;
    context.beginPath();
    context.arc(x0, y0, this.radius * scale, 0, 2 * Math.PI);
    context.stroke();
    context.strokeStyle = "#2a333d";
    context.beginPath();
    context.moveTo(x0, 0);
    context.lineTo(x0, height);
    context.moveTo(0, y0);
    context.lineTo(width, y0);
    context.stroke();
    this.touches.forEach((touch, i) => this.mark(context, touch, this.touches.length - i, x0, y0, scale));
  }

  // A dot is a counted touch, a cross is a rejected one: the shape differs as well as the colour.
  mark(context, touch, age, x0, y0, scale) {
    const [x, y] = [x0 + scale * touch.deviation_x_px, y0 + scale * touch.deviation_y_px];
    context.globalAlpha = age <= FADE ? 1 - (0.7 * (age - 1)) / FADE : 0.2;
    context.fillStyle = context.strokeStyle = touch.is_accepted ? GOOD : BAD;
    context.lineWidth = 2;
    context.beginPath();
    if (touch.is_accepted) {
      context.arc(x, y, age === 1 ? 6 : 4, 0, 2 * Math.PI);
      context.fill();
    } else {
      for (const sign of [-1, 1]) {
        context.moveTo(x - 5, y - 5 * sign);
        context.lineTo(x + 5, y + 5 * sign);
      }
      context.stroke();
    }
    context.globalAlpha = 1;
  }
}

// Median and quartiles of each window, and its number of counted touches.
export function drawWindows(canvas, windows, count) {
  const { context, width, height } = fitted(canvas);
  const [left, bottom] = [38, 30];
  const inMm = windows.some((window) => window.deviation_mm !== null);
  const of = (window) => (inMm ? window.deviation_mm : window.deviation_px);
  const top = 1.15 * Math.max(inMm ? 5 : 20, ...windows.map((window) => of(window)?.q3 ?? 0));
  const y = (value) => 4 + (1 - value / top) * (height - bottom - 4);
  context.font = "12px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.fillStyle = "#9aa7b4";
  context.strokeStyle = "#2a333d";
  context.textAlign = "right";
  for (let value = 0; value <= top; value += niceStep(top, 3)) {
    context.beginPath();
    context.moveTo(left, y(value));
    context.lineTo(width, y(value));
    context.stroke();
    context.fillText(number(value), left - 4, y(value));
  }
  context.fillText(inMm ? "mm" : "px", left - 4, height - 8);
  context.textAlign = "center";
  const step = (width - left) / Math.max(count, 1);
  const latest = new Map(windows.map((window) => [window.number, window]));
  const first = Math.min(1, ...latest.keys());
  for (const window of latest.values()) {
    const x = left + (window.number - first + 0.5) * step;
    const quartiles = of(window);
    context.fillStyle = window.is_open ? "#f0e442" : "#9aa7b4";
    if (step > 14 || window.is_open) context.fillText(window.accepted, x, height - 22);
    if (step > 14 || window.number % 5 === 1) context.fillText(window.number, x, height - 8);
    if (quartiles === null) continue;
    context.fillStyle = "#56b4e9";
    context.globalAlpha = 0.45;
    context.fillRect(x - 0.3 * step, y(quartiles.q3), 0.6 * step, Math.max(y(quartiles.q1) - y(quartiles.q3), 1));
    context.globalAlpha = 1;
    context.fillRect(x - 0.4 * step, y(quartiles.median) - 1.5, 0.8 * step, 3);
  }
}
