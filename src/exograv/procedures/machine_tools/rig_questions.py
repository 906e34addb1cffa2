"""Text of a new `rig.toml`: known values with their reasons, and a "?" for each unknown value."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from exograv.files import toml_value
from exograv.model.limb import FREEDOMS
from exograv.model.open_questions import MARK
from exograv.model.rig_settings import EXCITATION_SHARE, FREEDOMS_OF_ARM, HAND_APART, ArmKind, sweep_ends
from exograv.model.tree import Joint, Tree
from exograv.model.urdf_inference import PLACED, UNKNOWN, ArmGuess, PlaceGuess
from exograv.options import Side

from .foreign_file.postures import Joints, Sweep, sweep_posture

HEAD = """\
# {name}: written by `exograv rig new` from {file}. Every "?" is a question: its comment explains the value.
# `exograv rig check {name}` lists open questions, then shows reach and heaviest arm of the machine.
# Angles are in degrees, in the order of [[actuators]]; every other unit is in the name.
name = {quoted}
title = {title}
"""

CUFF_STIFFNESS = """\
along_N_per_mm = 2.1            # these four: medians of a cuff on 21 people (Schiebl 2025, Sensors 25:4605); measure
across_N_per_mm = 4.5
about_limb_Nm_per_deg = 0.035
about_others_Nm_per_deg = 0.20
"""

DRIVES = """\
# Drives of all joints. A line in the entry of a joint in [[actuators]] overrides the one here for that joint.
[drives]
drive = "?"  # gear of the motors: "harmonic" or "quasi_direct". In a joint's entry also "passive": encoder, no motor
torque_constant_Nm_per_A = "?"  # N·m per A at the motor's shaft, from its data sheet (often in mN·m/A there)
gear_ratio = "?"  # turns of the motor per turn of the joint [-]
rotor_inertia_kgm2 = "?"  # kg·m² at the joint: inertia of the rotor times the square of gear_ratio
efficiency = 0.75  # [-] typical of a harmonic drive; 0.9 of a quasi-direct one. Calibration measures the product
"""

KP_MAX = 80.0  # N·m/rad: a wrong model moves the joint by some degrees, and the wearer can push it away
PERIOD_S, HARMONICS = 20.0, 5
ROUNDING_DEG = 0.6  # of ten amplitudes and a centre, each rounded to 0.1°
EXCITATION_DEG = 25.0
"""Largest deviation of a proposed excitation from its centre [°]."""


@dataclass(frozen=True)
class Draft:
    """Machine for which a `rig.toml` is written."""

    tree: Tree
    """Tree of the file, with placeholders for missing limits."""

    found: list[ArmGuess]
    side: Side | None
    missing: Mapping[str, set[str]] = field(default_factory=dict)
    """Attributes of `<limit>` that the file lacks, by joint."""

    rotors: Mapping[str, str] = field(default_factory=dict)
    """Inertia of the rotor at the joint [kg·m²], by joint, where the file states it."""

    closing: Joints | None = None
    """Posture in which the cuffs are fastened [rad]; None if it is not known."""

    @property
    def begins_at_elbow(self) -> bool:
        """True if the machine has no shoulder joints."""
        return [arm.places[0].place for arm in self.found if arm.places] == ["elbow"]

    def lacks(self, joint: Joint, *keys: str) -> bool:
        """Return True if the file lacks a limit of a joint."""
        return bool(self.missing.get(joint.name, set()) & set(keys))


def rig_text(draft: Draft, name: str, file: str) -> str:
    """Return the file for this machine."""
    tree, found = draft.tree, draft.found
    known = {i: guess for arm in found for i, guess in zip(arm.joints, arm.places, strict=True)}
    places = [known.get(i, UNKNOWN) for i in range(len(tree.joints))]
    parts = [
        HEAD.format(name=name, file=file, quoted=toml_value(name), title=toml_value(tree.name)),
        _urdf(file, draft.side),
        _wearer(found, draft.side),
        *(_adjustment(arm, draft.begins_at_elbow) for arm in found),
        *(_cuffs(arm, _kind(found)) for arm in found),
        _donning(draft),
        _drives(draft),
        *(_actuator(draft, joint, place) for joint, place in zip(tree.joints, places, strict=True)),
        _task(draft),
        _calibration(draft),
        _excitation(draft),
    ]
    return "\n".join(part for part in parts if part)


def _urdf(file: str, side: Side | None) -> str:
    if side is not None:
        return f"[urdf]\n{side} = {toml_value(file)}\n"
    return f'[urdf]\nfile = {toml_value(file)}\nside = "?"  # arm that the machine is for: "right", "left", or "both"\n'


def _kind(found: list[ArmGuess]) -> ArmKind | None:
    """Return the kind of arm, by the number of joints beyond the elbow; None if it is not known."""
    kinds: dict[int, ArmKind] = {n - 4: kind for kind, n in FREEDOMS_OF_ARM.items()}
    fewest = min(FREEDOMS_OF_ARM.values())
    beyond = [0 if arm.wrist_joints is None and len(arm.joints) <= fewest else arm.wrist_joints for arm in found]
    counts = [count for count in beyond if count is not None]
    return kinds[min(max(counts), max(kinds))] if len(counts) == len(beyond) else None


def _wearer(found: list[ArmGuess], side: Side | None) -> str:
    kind = _kind(found)
    others = ", ".join(f'"{name}"' for name in FREEDOMS_OF_ARM if name != kind)
    if kind is None:
        what = f"joints of the arm that it moves (docs/howto/seven_joints.md): one of {others}"
    else:
        moved = ", ".join(FREEDOMS[3 : FREEDOMS_OF_ARM[kind]])
        what = f"by its joints it moves shoulder, {moved}; otherwise one of {others}"
    lines = [f'[wearer]\narm = "{kind or MARK}"  # {what}']
    if side == "both":
        lines += ["", "[wearer.shoulder_centre]", *(f"{arm.side} = {_centre(arm)}" for arm in found)]
    else:
        lines += [f"shoulder_centre = {_centre(found[0])}"]
    return "\n".join(lines) + "\n"


def _centre(arm: ArmGuess) -> str:
    if arm.shoulder_centre is not None:
        where = arm.meets if arm.meeting is not None else "assumed at the length below"
        return f"{toml_value(arm.shoulder_centre)}  # {where}"
    what = "link, fixed to the base, where the machine has the wearer's shoulder"
    if arm.meeting is None:
        why = "its axes do not show this point"
        if arm.shoulder_axes:
            axes = "two shoulder axes" if arm.shoulder_axes == 2 else "first three axes"
            why = f"the {axes} do not meet in a point"
        return f'"?"  # {what}; {why}. Add such a link to the URDF if there is none'
    x, y, z = arm.meeting
    return f'"?"  # {what}; {arm.meets}: at {x:.4g} {y:.4g} {z:.4g} in the base. Add such a link there'


def _adjustment(arm: ArmGuess, begins_at_elbow: bool) -> str:
    if arm.upper_arm is None:
        return ""
    length = arm.upper_arm
    head = "# Delete this table if the machine cannot be set to the wearer's upper arm.\n"
    ends = 'range_m = "?"  # m: [shortest, longest] upper arm that the machine can be set to, as [0.2, 0.37]\n'
    if begins_at_elbow:
        head = "# The machine has no shoulder: it stands where the wearer's elbow is.\n"
        ends = "range_m = [0.2, 0.4]  # m: upper arm of the smallest and the tallest wearer, assumed\n"
    return (
        f'{head}[[adjustments]]\njoint = {toml_value(length.joint)}\nsegment = "upper_arm"\n'
        f'axis = "{length.axis}"\n'
        f"nominal_m = {length.metres:.9g}  # as in the URDF, along {length.axis} of its parent\n"
        f"{ends}"
    )


def _cuffs(arm: ArmGuess, kind: ArmKind | None) -> str:
    segments = ("upper_arm", "forearm", "hand") if kind in HAND_APART else ("upper_arm", "forearm")
    blocks = []
    for i, segment in enumerate(segments):
        prefix = f"{arm.side}_" if arm.side else ""
        frame = f'"?"  # link whose z is along the limb, at the cuff on the {segment}; add one if the URDF has none'
        if len(arm.cuffs) == len(segments):
            origin = "added to the URDF" if arm.cuffs[i].startswith(PLACED) else "by its name"
            frame = f"{toml_value(arm.cuffs[i])}  # {origin}; z along the limb"
        side = f'side = "{arm.side}"\n' if arm.side else ""
        blocks.append(
            f'[[cuffs]]\nname = "{prefix}{segment}"\nexo_frame = {frame}\nsegment = "{segment}"\n{side}{CUFF_STIFFNESS}'
        )
    return "\n".join(blocks)


def _donning(draft: Draft) -> str:
    tree, found = draft.tree, draft.found
    kind = _kind(found)
    freedoms = len(FREEDOMS) if kind is None else FREEDOMS_OF_ARM[kind]
    count = "first 4 to 7" if kind is None else str(freedoms * len(found))
    names = ", ".join(FREEDOMS[:freedoms])
    sides = ", first the right arm's" if len(found) > 1 else ""
    posture, arm = '"?"', '"?"'
    head = "# Where the cuffs are fastened and strain-free, inside the limits; best with the arm hanging, elbow at 90°."
    closing = draft.closing
    if closing is not None and kind is not None:
        posture = _degrees(closing)
        arm = str([0.0, 0.0, 0.0, 90.0, 0.0, 0.0, 0.0][:freedoms] * len(found))
        head = (
            "# Where the cuffs are fastened and strain-free. Proposed: the arm hangs, elbow at 90°, if the base has\n"
            "# z up and x forward. `exograv data view` shows it."
        )
    joints = ", ".join(tree.joint_names)
    return (
        f"{head}\n[donning]\nposture_deg = {posture}  # {_angles(tree)} of the machine: [{joints}]\n"
        f"arm_posture_deg = {arm}  # {count} angles of the wearer in that posture: [{names}]{sides}\n"
    )


def _drives(draft: Draft) -> str:
    lines = DRIVES
    if all(joint.name in draft.rotors for joint in draft.tree.joints):
        lines = "".join(line for line in DRIVES.splitlines(keepends=True) if not line.startswith("rotor_inertia"))
    if weak := _lacking(draft, "effort"):
        lines += f'torque_max_Nm = "?"  # N·m at the joint: peak torque of the drive; the URDF gives none for {weak}\n'
    if slow := _lacking(draft, "velocity"):
        lines += f'speed_max_deg_s = "?"  # °/s at the joint: largest speed; the URDF gives none for {slow}\n'
    return lines


def _lacking(draft: Draft, key: str) -> str:
    """Names of the joints whose limit the file lacks, or gives as zero; empty if there are none."""
    return ", ".join(joint.name for joint in draft.tree.joints if draft.lacks(joint, key))


def _actuator(draft: Draft, joint: Joint, place: PlaceGuess) -> str:
    reason = place.reason or "shoulder, elbow or wrist (forearm roll counts as wrist)"
    lines = [f"[[actuators]]\njoint = {toml_value(joint.name)}", f'place = "{place.place or MARK}"  # {reason}']
    if draft.lacks(joint, "lower", "upper"):
        inside = ""
        if draft.closing is not None:
            at = _degrees(draft.closing[[draft.tree.index(joint.name)]])[1:-1]
            inside = f"; the proposed donning.posture_deg is at {at}"
        lines.append(f'range_deg = "?"  # °: [lower, upper] limit of {joint.name}, which the URDF lacks{inside}')
    if joint.name in draft.rotors:
        lines.append(f"rotor_inertia_kgm2 = {draft.rotors[joint.name]}  # kg·m² at the joint: armature in the file")
    kp, source = KP_MAX, "of recupera_like"
    if not draft.lacks(joint, "effort"):
        lines.append(
            f"torque_max_Nm = {joint.effort:g}  # N·m: effort of the URDF; or the drive's peak, if that is lower"
        )
        kp, source = min(KP_MAX, 1.5 * joint.effort), "proposed: 1.5 per N·m of torque_max, at most 80"
    lines += [f"weak_kp_Nm_per_rad = {kp:.2f}  # {source}", f"weak_kd_Nms_per_rad = {kp / 8.0:.2f}"]
    return "\n".join(lines) + "\n"


def _task(draft: Draft) -> str:
    tree = draft.tree
    limits = "; ".join(f"{joint.name} {low:.0f} to {high:.0f}" for joint, low, high in _limits(tree))
    return (
        f"# The box of postures in which the arm must be weightless: those of the task. Limits [°]: {limits}.\n"
        f'[task_workspace]\nlower_deg = "?"  # °: {_angles(tree)}, the lowest of each joint in the task\n'
        f'upper_deg = "?"  # °: {_angles(tree)}, the highest of each joint in the task\n'
    )


def _calibration(draft: Draft) -> str:
    mount = _forearm_cuff(draft.found[0])
    shown = '"?"  # link on which known weights can be hung, far out'
    if mount is not None:
        shown = f"{toml_value(mount)}  # proposed; a link farther out finds the gains better"
    blocks = [
        "# How the empty machine is calibrated. Without any motor: delete [calibration], its sweeps and [excitation].\n"
        f"[calibration]\nmount = {shown}\n"
        'weights_kg = "?"  # kg: at least two, as [1.5, 3.0]; the heaviest like an arm, if the drives hold it '
        "(`rig check`)\n"
    ]
    blocks += [_sweep(draft, i) for i in range(len(draft.tree.joints))]
    return "\n".join(blocks)


def _forearm_cuff(arm: ArmGuess) -> str | None:
    return next((name for name in arm.cuffs if "forearm" in name), None)


def _mount(draft: Draft, i: int) -> tuple[str | None, bool]:
    """Return the place of the weight that loads a joint, None if it is not known, and True if it is the main one."""
    arm = next((arm for arm in draft.found if i in arm.joints), draft.found[0])
    place = dict(zip(arm.joints, arm.places, strict=True)).get(i, UNKNOWN).place
    if place != "wrist":
        # A weight on the right arm does not load the left.
        return _forearm_cuff(arm), arm is draft.found[0]
    bracket = f"{PLACED}{arm.side + '_' if arm.side else ''}wrist_mount"
    return (bracket if bracket in draft.tree.frames else None), False


def _held(draft: Draft) -> dict[int, float]:
    """Positions [rad] at which joints without known limits stay in proposed sweeps."""
    closing = draft.closing
    joints = draft.tree.joints
    unknown = [i for i, joint in enumerate(joints) if draft.lacks(joint, "lower", "upper")]
    return {i: 0.0 if closing is None else float(closing[i]) for i in unknown}


def _sweep(draft: Draft, i: int) -> str:
    tree = draft.tree
    joint, lower, upper = _limits(tree)[i]
    low, high = sweep_ends(lower, upper)
    mount, is_main = _mount(draft, i)
    lines = [f"[[calibration.sweeps]]\njoint = {toml_value(joint.name)}"]
    if not draft.lacks(joint, "lower", "upper"):
        lines += [f"from_deg = {low}  # °: proposed, off the limits", f"to_deg = {high}"]
    posture, why = '"?"', "the others so that the weight loads this one"
    if mount is not None and tree.frames[mount].body >= 0:
        at, ends = tree.frames[mount], (float(np.deg2rad(low)), float(np.deg2rad(high)))
        found = sweep_posture(tree, Sweep(i, ends, at.body, at.p_body_frame), _held(draft))
        posture, why = _degrees(found), "proposed: the weight loads this joint; is the way free?"
    lines.append(f"posture_deg = {posture}  # °: {_angles(tree)}; {why}")
    if not is_main:
        what = f"link beyond {joint.name} on which the weights can be hung"
        lines.append(f"mount = {toml_value(mount or MARK)}  # {'proposed: ' if mount else ''}{what}")
    return "\n".join(lines) + "\n"


def _excitation(draft: Draft) -> str:
    """Return harmonics with phases that never repeat, so that no joint follows another."""
    ends = [(low, high) for _, low, high in _limits(draft.tree)]
    size = np.array([min(EXCITATION_DEG, EXCITATION_SHARE * (high - low)) for low, high in ends])
    low, high = np.array(ends).T
    closing = draft.closing
    centre = 0.5 * (low + high) if closing is None else np.rad2deg(closing)
    # Rounded amplitudes may add to more than the size.
    size = np.maximum(size - ROUNDING_DEG, 0.0)
    centre = np.clip(centre, low + size + ROUNDING_DEG, high - size - ROUNDING_DEG).round(1) + 0.0
    joints, harmonics = np.arange(len(size)), np.arange(1, HARMONICS + 1)[:, None]
    phase = 2 * np.pi * ((np.sqrt(5.0) - 1) / 2 * harmonics * (joints + 1) % 1.0)
    rows = {
        name: (size / HARMONICS * wave(phase)).round(1).tolist()
        for name, wave in (("sine", np.sin), ("cosine", np.cos))
    }
    is_asked = any(draft.lacks(joint, "lower", "upper") for joint in draft.tree.joints)
    fitted = "# It is fitted into each range_deg above when the file is read.\n" if is_asked else ""
    return (
        "# The motion that identifies the arm: small, not designed for this machine. `exograv rig motion` designs it.\n"
        f'{fitted}[excitation]\nsource = "proposed"\nperiod_s = {PERIOD_S}\ncentre_deg = {centre.tolist()}\n'
        f"sine_deg = {toml_value(rows['sine'])}\ncosine_deg = {toml_value(rows['cosine'])}\n"
    )


def _degrees(posture: Joints) -> str:
    return str((np.rad2deg(posture).round(1) + 0.0).tolist())  # + 0.0 makes -0.0 a plain zero


def _angles(tree: Tree) -> str:
    return f"{len(tree.joints)} angles"


def _limits(tree: Tree) -> list[tuple[Joint, float, float]]:
    """Limits of each joint [°]; those of an endless joint are a full turn."""
    ends = [np.clip([joint.lower, joint.upper], -np.pi, np.pi) for joint in tree.joints]
    return [(joint, *np.rad2deg(end).tolist()) for joint, end in zip(tree.joints, ends, strict=True)]
