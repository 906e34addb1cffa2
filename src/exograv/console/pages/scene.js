// View of machine and arm as lines in space, turned by mouse, finger or arrow keys. x forward, y left, z up [m].
import { fitted } from "./plot.js";

const TURN = 0.01;
const KEYS = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };

export class Scene {
  constructor(canvas) {
    Object.assign(this, { canvas, azimuth: 2.4, height: 0.35, skeleton: null, extent: 0.3 });
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) this.turn(-TURN * event.movementX, TURN * event.movementY);
    });
    canvas.addEventListener("keydown", (event) => {
      if (event.key in KEYS) {
        event.preventDefault();
        this.turn(...KEYS[event.key]);
      }
    });
  }

  turn(azimuth, height) {
    this.azimuth += azimuth;
    this.height = Math.min(Math.max(this.height + height, -1.5), 1.5);
  }

  show(skeleton) {
    this.skeleton = skeleton;
    const points = [...skeleton.exo, ...skeleton.arm].flat();
    if (points.length === 0) return;
    // The box only grows: a scale that follows the arm would be hard to read.
    this.box ??= points[0].map((value) => [value, value]);
    for (const point of points) {
      point.forEach((value, axis) => {
        const range = this.box[axis];
        [range[0], range[1]] = [Math.min(range[0], value), Math.max(range[1], value)];
      });
    }
    this.middle = this.box.map(([low, high]) => 0.5 * (low + high));
    this.extent = Math.max(0.5 * Math.hypot(...this.box.map(([low, high]) => high - low)), 0.2);
  }

  draw() {
    const { context, width, height } = fitted(this.canvas);
    if (!this.skeleton || !this.middle) return;
    const scale = (0.48 * Math.min(width, height)) / this.extent;
    const flat = (point) => this.project(point, scale, width, height);
    this.floor(context, flat);
    this.polylines(context, this.skeleton.exo.map((line) => line.map(flat)), "#56b4e9", 4);
    this.polylines(context, this.skeleton.arm.map((line) => line.map(flat)), "#e69f00", 9);
  }

  project(point, scale, width, height) {
    const [x, y, z] = point.map((value, axis) => value - this.middle[axis]);
    const [c, s] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [right, away] = [x * s - y * c, x * c + y * s];
    const up = z * Math.cos(this.height) + away * Math.sin(this.height);
    return [width / 2 + scale * right, height / 2 - scale * up];
  }

  floor(context, flat) {
    const z = this.box[2][0];
    context.strokeStyle = "#2a333d";
    context.lineWidth = 1;
    const [cx, cy] = this.middle;
    for (let i = -3; i <= 3; i += 1) {
      for (const ends of [
        [[cx + 0.15 * i, cy - 0.45, z], [cx + 0.15 * i, cy + 0.45, z]],
        [[cx - 0.45, cy + 0.15 * i, z], [cx + 0.45, cy + 0.15 * i, z]],
      ]) {
        context.beginPath();
        ends.forEach((point) => context.lineTo(...flat(point)));
        context.stroke();
      }
    }
  }

  polylines(context, lines, colour, thick) {
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = thick;
    context.lineCap = context.lineJoin = "round";
    for (const points of lines) {
      context.beginPath();
      points.forEach((point) => context.lineTo(...point));
      context.stroke();
      for (const [x, y] of points) {
        context.beginPath();
        context.arc(x, y, 0.75 * thick, 0, 2 * Math.PI);
        context.fill();
      }
    }
  }
}
