// Person and machine as rounded bodies, built once from a scene description and then moved. x forward, y left, z up [m].
import {
  BoxGeometry, BufferAttribute, BufferGeometry, CylinderGeometry, Group, LatheGeometry, Matrix4, Mesh,
  MeshLambertMaterial, Quaternion, SphereGeometry, TorusGeometry, Vector2, Vector3,
} from "./vendor/three/three.min.js";

const COLOURS = {
  machine: "#8fbfdd", drive: "#2f6d99", cuff: "#d1495b", stand: "#46525f",
  skin: "#dca384", shirt: "#e8e4da", trousers: "#5b6675", hair: "#3a2f2a",
};
const ROUND = 18;
const Z = new Vector3(0, 0, 1);
const vector = (point) => new Vector3(...point);

// Lathe turns about y: the profile runs from the first end to the second, and is then laid along z.
function roundCone(first, second, length) {
  const profile = [];
  for (let i = 0; i <= 6; i += 1) {
    const angle = (Math.PI / 2) * (i / 6 - 1);
    profile.push(new Vector2(Math.max(first * Math.cos(angle), 1e-5), first * Math.sin(angle)));
  }
  for (let i = 0; i <= 6; i += 1) {
    const angle = (Math.PI / 2) * (i / 6);
    profile.push(new Vector2(Math.max(second * Math.cos(angle), 1e-5), length + second * Math.sin(angle)));
  }
  return new LatheGeometry(profile, ROUND).rotateX(Math.PI / 2);
}

function rotation(rows) {
  return new Matrix4().set(rows[0], rows[1], rows[2], 0, rows[3], rows[4], rows[5], 0, rows[6], rows[7], rows[8], 0, 0, 0, 0, 1);
}

function mesh3(triangles) {
  const bytes = Uint8Array.from(atob(triangles), (letter) => letter.charCodeAt(0));
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(bytes.buffer), 3));
  geometry.computeVertexNormals();
  return geometry;
}

const between = (first, second) => new Quaternion().setFromUnitVectors(Z, second.clone().sub(first).normalize());

export class Figure {
  constructor(scene) {
    this.scene = scene;
    this.root = new Group();
    this.materials = {};
    this.bodies = scene.joints.map(() => this.body());
    this.base = this.body();
    for (const shape of scene.shapes) (this.bodies[shape.body] ?? this.base).add(this.solid(shape));
    this.arms = scene.arms.map((arm) => this.arm(arm));
  }

  body() {
    const group = new Group();
    group.matrixAutoUpdate = false;
    this.root.add(group);
    return group;
  }

  material(role) {
    this.materials[role] ??= new MeshLambertMaterial({ color: COLOURS[role] });
    return this.materials[role];
  }

  solid(shape) {
    const [first, second] = shape.points.map(vector);
    const material = this.material(shape.role);
    const [radius, other] = shape.radius;
    if (shape.kind === "mesh") return new Mesh(mesh3(shape.triangles), material);
    if (shape.kind === "box" || shape.kind === "ball") {
      const form = shape.kind === "box" ? new BoxGeometry(...shape.size) : new SphereGeometry(radius, 36, 24);
      const solid = new Mesh(form, material);
      solid.position.copy(first);
      if (shape.kind === "ball" && shape.size) solid.scale.set(...shape.size);
      if (shape.R) solid.quaternion.setFromRotationMatrix(rotation(shape.R));
      return solid;
    }
    const length = first.distanceTo(second);
    if (shape.kind === "hand") {
      const hand = this.hand(length, radius);
      hand.position.copy(first);
      this.turnHand(hand, first, second, vector(shape.points[2]));
      return hand;
    }
    if (shape.kind === "ring") {
      const ring = new Mesh(new TorusGeometry(radius, other, 12, 36), material);
      ring.position.copy(first);
      ring.quaternion.copy(between(first, second));
      return ring;
    }
    const form = shape.kind === "capsule"
      ? roundCone(radius, other, length).translate(0, 0, -length / 2)
      : new CylinderGeometry(radius, radius, length, 28).rotateX(Math.PI / 2);
    const solid = new Mesh(form, material);
    if (length > 1e-6) solid.quaternion.copy(between(first, second));
    const group = new Group();
    group.position.copy(first).add(second).multiplyScalar(0.5);
    if (shape.size) group.scale.set(...shape.size);
    return group.add(solid);
  }

  // Upper arm and forearm are as long as the arm of the model; the sleeve ends above the elbow.
  arm(arm) {
    const [upper, fore, hand] = arm.lengths;
    const [shoulder, elbow, wrist] = arm.radius;
    const skin = this.material("skin");
    const parts = [new Group(), new Group(), this.hand(hand, wrist)];
    parts[0].add(new Mesh(roundCone(shoulder, elbow, upper), skin));
    const middle = 0.5 * (shoulder + elbow) + 0.006;
    parts[0].add(new Mesh(roundCone(shoulder + 0.006, middle, 0.5 * upper), this.material("shirt")));
    parts[1].add(new Mesh(roundCone(elbow, wrist, fore), skin));
    this.root.add(...parts);
    return { parts, arm };
  }

  // The hand lies along z, with the thumb towards x.
  hand(length, wrist) {
    const group = new Group();
    const skin = this.material("skin");
    const palm = new Mesh(new SphereGeometry(1, 20, 14), skin);
    palm.scale.set(0.21 * length, 0.1 * length, 0.31 * length);
    palm.position.set(0, 0, 0.27 * length);
    group.add(palm, new Mesh(roundCone(wrist, 0.11 * length, 0.12 * length), skin));
    const finger = (from, to, radius) => {
      const [first, second] = [vector(from), vector(to)];
      const solid = new Mesh(roundCone(radius * length, 0.8 * radius * length, first.distanceTo(second)), skin);
      solid.position.copy(first);
      solid.quaternion.copy(between(first, second));
      group.add(solid);
    };
    [0.94, 1.0, 0.95, 0.84].forEach((end, i) => {
      const x = (0.135 - 0.09 * i) * length;
      finger([x, 0, 0.45 * length], [1.1 * x, 0, (end - 0.04) * length], 0.048);
    });
    finger([0.14 * length, 0, 0.16 * length], [0.34 * length, 0.02 * length, 0.5 * length], 0.052);
    return group;
  }

  // q: joint positions in the order of the scene; arms: points of each arm, or null for arms that move with the cuffs.
  pose(q, arms) {
    this.scene.joints.forEach((joint, i) => {
      const own = rotation(joint.R).setPosition(...joint.p);
      const axis = vector(joint.axis);
      const turn = joint.kind === "revolute"
        ? new Matrix4().makeRotationAxis(axis, q[i])
        : new Matrix4().makeTranslation(axis.multiplyScalar(q[i]));
      const parent = (this.bodies[joint.parent] ?? this.base).matrix;
      this.bodies[i].matrix.multiplyMatrices(parent, own).multiply(turn);
    });
    this.arms.forEach(({ parts, arm }, i) => this.poseArm(parts, arm, arms?.[i]));
  }

  poseArm(parts, arm, measured) {
    const matrix = (point) => (this.bodies[point.body] ?? this.base).matrix;
    const points = measured?.map(vector) ?? arm.points.map((point) => vector(point.p).applyMatrix4(matrix(point)));
    parts.forEach((part, i) => {
      const [first, second] = [points[i], points[i + 1]];
      part.position.copy(first);
      part.quaternion.copy(between(first, second));
      part.scale.set(1, 1, first.distanceTo(second) / arm.lengths[i]);
    });
    // The thumb's direction comes from the machine, because points alone do not tell how the hand is turned.
    this.turnHand(parts[2], points[2], points[3], vector(arm.thumb.p).transformDirection(matrix(arm.thumb)));
  }

  turnHand(hand, wrist, tip, thumb) {
    const along = tip.clone().sub(wrist).normalize();
    thumb.addScaledVector(along, -thumb.dot(along)).normalize();
    hand.quaternion.setFromRotationMatrix(new Matrix4().makeBasis(thumb, along.clone().cross(thumb), along));
  }

  close() {
    this.root.traverse((part) => part.geometry?.dispose());
    for (const material of Object.values(this.materials)) material.dispose();
  }
}
