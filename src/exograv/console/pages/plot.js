// Scrolling plot: the last seconds of some series, drawn at the rate of the screen.
export const COLOURS = ["#56b4e9", "#e69f00", "#2fc58f", "#f0e442", "#cc79a7", "#ff7a4d", "#9ec1ff"];
const KEPT_S = 12;
// Height of the line with the title, above all curves.
const TITLE = 18;

export class Plot {
  // styles: series by name, each with { dash, alpha, width }.
  constructor(canvas, styles, seconds = 10) {
    Object.assign(this, { canvas, styles, seconds, title: "" });
    this.times = [];
    this.rows = Object.fromEntries(Object.keys(styles).map((name) => [name, []]));
    this.hidden = new Set();
    this.drawn = 0;
  }

  add(times, rows) {
    this.times.push(...times);
    for (const [name, values] of Object.entries(rows)) this.rows[name].push(...values);
    const oldest = this.times.at(-1) - KEPT_S;
    const many = this.times.findIndex((t) => t >= oldest);
    if (many > 0) {
      this.times.splice(0, many);
      for (const values of Object.values(this.rows)) values.splice(0, many);
    }
  }

  // latest: time at the right border, on the clock of the samples [s].
  draw(latest) {
    const { context, width, height } = fitted(this.canvas);
    const [left, bottom] = [38, 16];
    const [low, high] = this.range();
    const x = (t) => left + ((t - latest) / this.seconds + 1) * (width - left);
    const y = (value) => TITLE + ((high - value) / (high - low)) * (height - bottom - TITLE);
    this.axes(context, { left, bottom, width, height, low, high, y });
    context.save();
    context.beginPath();
    context.rect(left, 0, width - left, height - bottom);
    context.clip();
    for (const [name, style] of Object.entries(this.styles)) this.lines(context, this.rows[name], style, x, y);
    context.restore();
    this.drawn += 1;
  }

  lines(context, rows, style, x, y) {
    if (rows.length === 0) return;
    context.globalAlpha = style.alpha ?? 1;
    context.lineWidth = style.width ?? 2;
    context.setLineDash(style.dash ?? []);
    for (let joint = 0; joint < rows[0].length; joint += 1) {
      if (this.hidden.has(joint)) continue;
      context.strokeStyle = COLOURS[joint % COLOURS.length];
      context.beginPath();
      for (let i = 0; i < rows.length; i += 1) context.lineTo(x(this.times[i]), y(rows[i][joint]));
      context.stroke();
    }
    context.globalAlpha = 1;
    context.setLineDash([]);
  }

  axes(context, { left, bottom, width, height, low, high, y }) {
    context.font = "12px system-ui, sans-serif";
    context.fillStyle = "#9aa7b4";
    context.strokeStyle = "#2a333d";
    context.lineWidth = 1;
    context.textBaseline = "middle";
    context.textAlign = "right";
    const step = niceStep(high - low, 4);
    for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
      context.beginPath();
      context.moveTo(left, y(value));
      context.lineTo(width, y(value));
      context.stroke();
      context.fillText(String(Math.round(value * 100) / 100), left - 4, y(value));
    }
    context.textAlign = "left";
    context.fillText(this.title, left + 6, 10);
    context.textAlign = "center";
    for (let s = 0; s <= this.seconds; s += 2) {
      const at = left + (1 - s / this.seconds) * (width - left);
      context.fillText(s === 0 ? "0 s" : `−${s}`, Math.min(at, width - 12), height - 7);
    }
  }

  range() {
    let [low, high] = [Infinity, -Infinity];
    for (const rows of Object.values(this.rows)) {
      for (const row of rows) {
        row.forEach((value, joint) => {
          if (this.hidden.has(joint)) return;
          low = Math.min(low, value);
          high = Math.max(high, value);
        });
      }
    }
    if (!(low < high)) [low, high] = Number.isFinite(low) ? [low - 1, low + 1] : [-1, 1];
    const margin = 0.06 * (high - low);
    return [low - margin, high + margin];
  }
}

export function niceStep(span, most) {
  const raw = span / most;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= raw);
}

// Clear a canvas and set its resolution to that of the panel; drawing uses CSS pixels.
export function fitted(canvas) {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const [wide, high] = [Math.round(width * devicePixelRatio), Math.round(height * devicePixelRatio)];
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
  const context = canvas.getContext("2d");
  context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}
