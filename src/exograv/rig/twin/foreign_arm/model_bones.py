"""Bones of a third party's arm: rigidly connected bodies merged into one, in our axes, as the arm hangs straight."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError
from exograv.model.limb import FREEDOMS
from exograv.model.rig_settings import HAND_APART, ArmKind
from exograv.rig.twin.wearer.arm_bodies import MASS_LEAST
from exograv.rig.twin.wearer.regressions import SAMPLE, TABLE
from exograv.rig.twin.wearer.skeleton import GRIP_FRACTION, Bone, BoneJoint, Skeleton, axis_of

from .model_joints import SLIDE, HangingPosture, find_body, joint_names, listed
from .wearer_map import BodyPoint, WearerMap

Vector = Float[np.ndarray, " 3"]

SNAP = 1e-9
"""Tolerance within which an axis is taken as the usual one [-]."""

TILT_MAX = np.deg2rad(25.0)
"""Largest angle between the vertical and a hanging upper arm or forearm [rad]."""

GYRATION_MAX = 0.5
"""Largest radius of gyration of a body of an arm [m]: no segment is longer than this."""

INTERMEDIATE_MASS_MAX = 0.01
"""Largest mass of a body that only carries one hinge of a joint [kg]. Converted models give it an arbitrary inertia."""


@dataclass
class Anatomy:
    """Bodies of a model, relative to the shoulder centre in our axes."""

    model: mujoco.MjModel
    data: mujoco.MjData
    told: WearerMap
    stand: HangingPosture
    chain: list[int]
    """Bodies from the arm's first to the hand."""

    leader: dict[int, int]
    """Body that carries the joints of a rigid group, by each body of the group."""

    shoulder: Vector
    """Centre of the shoulder in the model's world [m]."""

    def place(self, point: Vector) -> Vector:
        """Convert a point of the model's world to our axes, relative to the shoulder [m]."""
        return self.told.axes @ (point - self.shoulder)

    def joints_of(self, body: int) -> list[int]:
        """Movable joints of a body."""
        first = int(self.model.body_jntadr[body])
        return [j for j in range(first, first + int(self.model.body_jntnum[body])) if j in self.stand.moving]


def build_skeleton(model: mujoco.MjModel, told: WearerMap, stand: HangingPosture, kind: ArmKind) -> Skeleton:
    """Build the arm of a model, whose parts the map names.

    Raises:
        ModelError: Bodies or joints are not in the order of an arm, or the map does not name all joints.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = stand.qpos
    mujoco.mj_kinematics(model, data)
    seen = _anatomy(model, data, told, stand)
    bones = _bones(seen)
    held = {name: _bone_name(seen, getattr(told.segments, name)) for name in ("upper_arm", "forearm", "hand")}
    segment_of = {bone.name: bone.segment for bone in bones}
    for name, bone in held.items():
        wanted = "forearm" if name == "hand" and kind not in HAND_APART else name
        if segment_of[bone] != wanted:
            raise ModelError(
                f"segments.{name} is '{getattr(told.segments, name)}', which moves with the {segment_of[bone]} of this "
                f"map. Name the body between the joints that begin and end the {wanted}."
            )
    centres = _centres(seen)
    _refuse_tilted(centres)
    lengths = {
        "upper_arm": float(np.linalg.norm(centres["forearm"] - centres["upper_arm"])),
        "forearm": float(np.linalg.norm(centres["hand"] - centres["forearm"])),
    }
    if told.points.finger_tip is not None:
        lengths["hand"] = float(np.linalg.norm(_point(seen, told.points.finger_tip) - centres["hand"]))
    origins = _origins(bones)
    firsts = {segment: next(bone for bone in bones if bone.segment == segment) for segment in segment_of.values()}
    return Skeleton(
        told.side,
        kind,
        bones,
        lengths,
        held,
        centres={
            name: (first.name, centres[name] - origins[first.name]) for name, first in firsts.items() if name in centres
        },
        wrist=(held["hand"], centres["hand"] - origins[held["hand"]]),
        grip=(held["hand"], _grip(seen, centres["hand"], lengths.get("hand")) - origins[held["hand"]]),
        couplings=tuple(stand.coupled.values()),
        follows_elevation=bones[0].segment == "upper_arm",
    )


def _anatomy(model: mujoco.MjModel, data: mujoco.MjData, told: WearerMap, stand: HangingPosture) -> Anatomy:
    chain = [find_body(model, told.segments.hand, "segments.hand")]
    while model.body_parentid[chain[0]] > 0:
        chain.insert(0, int(model.body_parentid[chain[0]]))
    bodies_with_joints = {int(model.jnt_bodyid[joint]) for joint in stand.moving}
    for joint, freedom in [*stand.freedoms.items(), *((joint, "shoulder") for joint in stand.ball)]:
        if int(model.jnt_bodyid[joint]) not in chain:
            raise ModelError(
                f"{freedom}: joint '{model.joint(joint).name}' is not between the trunk and segments.hand "
                f"('{told.segments.hand}'). Name a joint of this arm."
            )
    chain = chain[next(k for k, body in enumerate(chain) if body in bodies_with_joints) :]
    leader = {chain[0]: chain[0]}
    shoulder_bodies = sorted({int(model.jnt_bodyid[joint]) for joint in stand.ball})
    for body in range(chain[0] + 1, model.nbody):
        parent = int(model.body_parentid[body])
        if parent in leader:
            moves = body in bodies_with_joints and body not in shoulder_bodies[1:]
            leader[body] = body if moves else leader[parent]
    stand.coupled = {j: one for j, one in stand.coupled.items() if int(model.jnt_bodyid[j]) in leader}
    _refuse_unnamed(model, told, stand, leader)
    _clean_inertias(model, stand, leader)
    anchors = [data.xanchor[j] for j in (*stand.ball, *(j for j, f in stand.freedoms.items() if f in FREEDOMS[:3]))]
    return Anatomy(model, data, told, stand, chain, leader, np.mean(anchors, axis=0))


def _refuse_unnamed(model: mujoco.MjModel, told: WearerMap, stand: HangingPosture, leader: dict[int, int]) -> None:
    names = joint_names(model)
    left = [
        names[j]
        for j in range(model.njnt)
        if int(model.jnt_bodyid[j]) in leader and j not in stand.moving and j not in stand.locked
    ]
    if left and not told.lock_others:
        raise ModelError(
            f"The arm has more joints than the map names: {listed(left)}. Give each an angle under [locked], couple "
            "it, or set lock_others = true, which leaves them as the file has them."
        )


def _clean_inertias(model: mujoco.MjModel, stand: HangingPosture, leader: dict[int, int]) -> None:
    """Turn intermediate bodies with an impossible inertia into point masses, and refuse such a body of more mass."""
    cleaned = []
    for body in leader:
        mass, inertia = float(model.body_mass[body]), float(model.body_inertia[body].max())
        if inertia <= mass * GYRATION_MAX**2:
            continue
        name = model.body(body).name
        if mass > INTERMEDIATE_MASS_MAX:
            raise ModelError(
                f"Body '{name}' weighs {mass:.3g} kg and has an inertia of {inertia:.3g} kg·m². Its radius of gyration "
                f"is {np.sqrt(inertia / mass):.3g} m; allowed: at most {GYRATION_MAX} m. Correct the file; check its "
                "units."
            )
        model.body_inertia[body] = 0.0
        cleaned.append(name)
    if cleaned:
        stand.notes.append(
            f"The masses of {listed(cleaned)} are too small for their inertias: these bodies count as point masses."
        )


def _bones(seen: Anatomy) -> tuple[Bone, ...]:
    leaders = sorted(set(seen.leader.values()))
    segments: dict[int, str] = {}
    bones = []
    for body in leaders:
        parent = seen.leader.get(int(seen.model.body_parentid[body]))
        segments[body] = _segment(seen, body, segments.get(parent, "girdle") if parent is not None else "girdle")
        origin = seen.data.xpos[body]
        mass, com, inertia = _together(seen, body)
        bones.append(
            Bone(
                _name(seen, body),
                segments[body],
                None if parent is None else _name(seen, parent),
                seen.place(origin) if parent is None else seen.told.axes @ (origin - seen.data.xpos[parent]),
                mass,
                com,
                inertia,
                _joints(seen, body),
            )
        )
    return tuple(bones)


def _segment(seen: Anatomy, body: int, above: str) -> str:
    own = {seen.stand.freedoms.get(joint, "") for joint in seen.joints_of(body)}
    if own & set(FREEDOMS[5:]):
        return "hand"
    if "elbow" in own:
        return "forearm"
    if own & set(FREEDOMS[:3]) or set(seen.joints_of(body)) & set(seen.stand.ball):
        return "upper_arm"
    return above


def _together(seen: Anatomy, leader: int) -> tuple[float, Vector, Float[np.ndarray, "3 3"]]:
    """Mass, centre of mass and inertia about it of all bodies that are rigid with `leader`, in its frame."""
    model, data, R = seen.model, seen.data, seen.told.axes
    mass, moment, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    for body, own in seen.leader.items():
        m = seen.told.mass_scale * float(model.body_mass[body])
        if own != leader or m <= 2.0 * MASS_LEAST:
            continue
        com = R @ (data.xipos[body] - data.xpos[leader])
        axes = R @ data.ximat[body].reshape(3, 3)
        mass, moment = mass + m, moment + m * com
        inertia = inertia + seen.told.mass_scale * (axes * model.body_inertia[body]) @ axes.T
        inertia = inertia + m * (com @ com * np.eye(3) - np.outer(com, com))
    if mass == 0.0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    com = moment / mass
    return mass, com, inertia - mass * (com @ com * np.eye(3) - np.outer(com, com))


def _joints(seen: Anatomy, body: int) -> tuple[BoneJoint, ...]:
    stand, side = seen.stand, seen.told.side
    joints: list[BoneJoint] = []
    for joint in seen.joints_of(body):
        anchor = seen.told.axes @ (seen.data.xanchor[joint] - seen.data.xpos[body])
        axis = seen.told.axes @ seen.data.xaxis[joint] * stand.signs.get(joint, 1)
        if joint in stand.ball:
            if not any(one.name == FREEDOMS[0] for one in joints):
                centre = seen.told.axes @ (seen.shoulder - seen.data.xpos[body])
                joints += [BoneJoint(name, axis_of(name, side), centre) for name in FREEDOMS[:3]]
        elif joint in stand.freedoms:
            name = stand.freedoms[joint]
            usual = axis_of(name, side)
            joints.append(BoneJoint(name, usual if np.allclose(axis, usual, atol=SNAP) else axis, anchor))
        else:
            is_slide = int(seen.model.jnt_type[joint]) == SLIDE
            joints.append(BoneJoint(stand.coupled[joint].joint, axis, anchor, is_slide))
    return tuple(joints)


def _centres(seen: Anatomy) -> dict[str, Vector]:
    """Shoulder, elbow and wrist, by the segment that begins there [m]."""
    anchors = {name: seen.place(seen.data.xanchor[joint]) for joint, name in seen.stand.freedoms.items()}
    wrist = [anchors[name] for name in FREEDOMS[5:] if name in anchors]
    if seen.told.points.wrist is not None:
        wrist = [_point(seen, seen.told.points.wrist)]
    if not wrist:
        hand, forearm = (
            find_body(seen.model, name, "segments") for name in (seen.told.segments.hand, seen.told.segments.forearm)
        )
        if hand == forearm:
            raise ModelError(
                f"Forearm and hand are one body, '{seen.told.segments.hand}', so the wrist is unknown. Give "
                "[points.wrist] with body and at_m."
            )
        wrist = [seen.place(seen.data.xpos[hand])]
    return {"upper_arm": np.zeros(3), "forearm": anchors["elbow"], "hand": np.mean(wrist, axis=0)}


def _refuse_tilted(centres: dict[str, Vector]) -> None:
    for name, begin, end in (("upper arm", "upper_arm", "forearm"), ("forearm", "forearm", "hand")):
        along = centres[end] - centres[begin]
        tilt = float(np.arccos(np.clip(-along[2] / max(float(np.linalg.norm(along)), 1e-9), -1.0, 1.0)))
        if tilt > TILT_MAX:
            shown = " ".join(f"{x:.2f}" for x in along)
            raise ModelError(
                f"With its joints at the map's zero_deg the model's {name} does not hang: it is "
                f"{np.rad2deg(tilt):.0f}° off straight down, along ({shown}) m forward, left, up. Check zero_deg, and "
                "forward, left and up."
            )


def _grip(seen: Anatomy, wrist: Vector, length: float | None) -> Vector:
    if seen.told.points.finger_tip is not None:
        return wrist + GRIP_FRACTION * (_point(seen, seen.told.points.finger_tip) - wrist)
    sex = seen.told.body.sex
    mean = TABLE[sex]["hand"].length * seen.told.body.height_m / SAMPLE[sex].height
    return wrist - np.array([0.0, 0.0, GRIP_FRACTION * (length or mean)])


def _point(seen: Anatomy, point: BodyPoint) -> Vector:
    body = find_body(seen.model, point.body, "points")
    return seen.place(seen.data.xpos[body] + seen.data.xmat[body].reshape(3, 3) @ np.array(point.at_m))


def _origins(bones: tuple[Bone, ...]) -> dict[str, Vector]:
    origins: dict[str, Vector] = {}
    for bone in bones:
        origins[bone.name] = bone.origin if bone.parent is None else origins[bone.parent] + bone.origin
    return origins


def _bone_name(seen: Anatomy, body_name: str) -> str:
    body = find_body(seen.model, body_name, "segments")
    if body not in seen.leader:
        raise ModelError(f"segments: body '{body_name}' is not part of the arm of '{seen.told.segments.hand}'.")
    return _name(seen, seen.leader[body])


def _name(seen: Anatomy, body: int) -> str:
    return seen.model.body(body).name or f"body_{body}"
