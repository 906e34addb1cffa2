// Picture of a person in a machine in a box of the page, turned by mouse, finger or arrow keys, with gravity and floor.
import {
  ArrowHelper, DirectionalLight, GridHelper, HemisphereLight, OrbitControls, PerspectiveCamera, Scene,
  Vector3, WebGLRenderer,
} from "./vendor/three/three.min.js";
import { Figure } from "./figure3d.js";

const KEYS = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
const RADIUS_M = 0.7; // Head, arms, machine and seat fit into a ball of this radius around the trunk.
const PIXELS_MAX = 2; // A finer picture costs time, and shows no more.
const FRAME_MS = 20; // A frame that nothing delays takes 17 ms.
const SLOWEST_MS = 400; // A page that stood still for another reason must not stop the picture for long.
const PAUSE = 3;
const WITHOUT_CARD = /swiftshader|llvmpipe|softpipe|software|basic render/i;
const RARE_MS = 2000; // Pictures of a moving machine that a processor draws beside plots. The user's turns do not wait.

// Whether a processor draws in place of a graphics card, by the name that the browser gives it.
function isWithoutCard(context) {
  const about = context.getExtension("WEBGL_debug_renderer_info");
  return WITHOUT_CARD.test(context.getParameter(about?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
}

export class View3d {
  // isRare: the page has more urgent things to draw. Without a graphics card, pictures are then rare.
  constructor(box, without, isRare = false) {
    Object.assign(this, { box, figure: null, isChanged: false, isTurned: false, isSeen: true, drawn: 0 });
    Object.assign(this, { frameAt: 0, drawnAt: -Infinity, debt: 0, delayed: 0 });
    this.level = document.createElement("p");
    this.level.className = "scene-level figure";
    try {
      this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    } catch {
      this.sayWithout(without);
      return;
    }
    this.canvas = this.renderer.domElement;
    this.rest_ms = isRare && isWithoutCard(this.renderer.getContext()) ? RARE_MS : 0;
    this.nameCanvas();
    box.append(this.canvas, this.level);
    this.stage();
    this.listen();
  }

  sayWithout(without) {
    const text = document.createElement("p");
    text.className = "scene-without";
    text.textContent = without;
    this.box.append(text, this.level);
  }

  // The keyboard reaches the canvas, so it takes the name of the box, in the page's language.
  nameCanvas() {
    const { box, canvas } = this;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.ariaLabel = box.ariaLabel;
    if (box.dataset.label) canvas.dataset.label = box.dataset.label;
    for (const name of ["role", "aria-label", "data-label"]) box.removeAttribute(name);
  }

  stage() {
    this.world = new Scene();
    this.camera = new PerspectiveCamera(32, 1, 0.05, 30);
    this.camera.up.set(0, 0, 1);
    this.world.add(new HemisphereLight("#e8f0f7", "#4a4f55", 1.7));
    for (const [x, y, z, power] of [[2, -2, 3, 1.7], [1, 3, 1.5, 0.7]]) {
      const light = new DirectionalLight("#ffffff", power);
      light.position.set(x, y, z);
      this.world.add(light);
    }
    this.grid = new GridHelper(2.4, 12, "#44505c", "#2b343e").rotateX(Math.PI / 2);
    this.arrow = new ArrowHelper(new Vector3(0, 0, -1), new Vector3(), 0.3, "#2fc58f", 0.09, 0.06);
    this.grid.visible = this.arrow.visible = false;
    this.world.add(this.grid, this.arrow);
    this.controls = new OrbitControls(this.camera, this.canvas);
    // The wheel scrolls the page until the picture has been clicked.
    this.controls.enableZoom = false;
    Object.assign(this.controls, { minDistance: 0.6, maxDistance: 8, enablePan: true });
  }

  listen() {
    const change = () => (this.isChanged = this.isTurned = true);
    this.controls.addEventListener("change", change);
    this.canvas.addEventListener("focus", () => (this.controls.enableZoom = true));
    this.canvas.addEventListener("blur", () => (this.controls.enableZoom = false));
    this.canvas.addEventListener("webglcontextrestored", change);
    this.canvas.addEventListener("keydown", (event) => {
      if (!(event.key in KEYS)) return;
      event.preventDefault();
      this.turn(...KEYS[event.key]);
    });
    new ResizeObserver(change).observe(this.box);
    new IntersectionObserver(([entry]) => {
      this.isSeen = entry.isIntersecting;
      change();
    }).observe(this.box);
  }

  turn(around, up) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const distance = offset.length();
    const azimuth = Math.atan2(offset.y, offset.x) + around;
    const height = Math.min(Math.max(Math.asin(offset.z / distance) + up, -1.4), 1.4);
    this.place(azimuth, height, distance);
  }

  place(azimuth, height, distance) {
    const flat = distance * Math.cos(height);
    const { target } = this.controls;
    this.camera.position.set(flat * Math.cos(azimuth), flat * Math.sin(azimuth), distance * Math.sin(height)).add(target);
    this.controls.update();
    this.isChanged = this.isTurned = true;
  }

  // Replaces person and machine. The view stays as the user has turned it, unless the side changes.
  describe(scene) {
    if (!this.renderer) return;
    const before = this.figure?.scene.side;
    this.figure?.root.removeFromParent();
    this.figure?.close();
    this.figure = new Figure(scene);
    this.world.add(this.figure.root);
    this.grid.position.z = scene.floor;
    this.grid.visible = true;
    this.away = scene.side === "left" ? -1 : 1;
    this.arrow.position.set(scene.centre[0] + 0.3, scene.centre[1] + 0.42 * this.away, scene.centre[2] + 0.42);
    this.pose(new Map(), null);
    if (before === scene.side) return;
    this.controls.target.set(scene.centre[0] + 0.1, scene.centre[1] - 0.04 * this.away, scene.centre[2] - 0.02);
    this.resize();
    const angle = 0.5 * this.camera.fov * (Math.PI / 180);
    const narrow = Math.atan(Math.tan(angle) * Math.min(this.camera.aspect, 1));
    this.place(-0.85 * this.away, 0.2, RADIUS_M / Math.sin(narrow));
  }

  // positions: position of each joint by name; a joint without a position stays at rest.
  pose(positions, arms) {
    if (!this.figure) return;
    const q = this.figure.scene.joints.map((joint) => positions.get(joint.name) ?? joint.rest);
    this.figure.pose(q, arms);
    this.isChanged = true;
  }

  // level: share of the arm's weight that the person feels; null if it is not known.
  gravity(level) {
    const text = level === null ? "" : `${level.toFixed(2)} g`;
    if (this.level.textContent === text) return;
    this.level.textContent = text;
    if (!this.renderer) return;
    this.arrow.visible = level !== null && level > 0.01;
    this.arrow.setLength(0.08 + 0.3 * (level ?? 0), 0.07, 0.05);
    this.isChanged = true;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.box;
    const ratio = Math.min(devicePixelRatio, PIXELS_MAX);
    if (this.size === `${width} ${height} ${ratio}` || width === 0 || height === 0) return;
    this.size = `${width} ${height} ${ratio}`;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false); // The style sheet fits the canvas to the box, also between pictures.
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  // Call once per frame of the page. Nothing is drawn while nothing changes, or while nobody can see it. Without a
  // graphics card a picture delays the frames after it. Each delay is followed by a pause of `PAUSE` times its length.
  draw() {
    const now = performance.now();
    const gap = Math.min(now - this.frameAt, SLOWEST_MS);
    this.frameAt = now;
    this.debt = Math.max(this.debt - gap, 0);
    if (this.delayed > 0) this.debt += PAUSE * Math.max(gap - FRAME_MS, 0);
    this.delayed -= 1;
    if (!this.isChanged || !this.isSeen || document.hidden || !this.figure || this.debt > 0) return;
    if (!this.isTurned && now - this.drawnAt < this.rest_ms) return;
    this.isChanged = this.isTurned = false;
    this.drawnAt = now;
    this.drawn += 1;
    this.delayed = 2;
    this.resize();
    this.renderer.render(this.world, this.camera);
  }
}
