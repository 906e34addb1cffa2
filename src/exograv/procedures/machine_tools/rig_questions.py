"""Text of a new `rig.toml`: known values with their reasons, and a "?" for each unknown value."""

import numpy as np

from exograv.files import toml_value
from exograv.model.limb import FREEDOMS
from exograv.model.open_questions import MARK
from exograv.model.rig_settings import FREEDOMS_OF_ARM, HAND_APART, ArmKind
from exograv.model.tree import Joint, Tree
from exograv.model.urdf_inference import UNKNOWN, ArmGuess, PlaceGuess, arms, side_of
from exograv.options import Side

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

MOTOR = """\
torque_constant_Nm_per_A = "?"  # of the motor by its data sheet; delete these seven lines for a passive joint
gear_ratio = "?"                # turns of the motor per turn of the joint
efficiency = "?"                # of the gear, 0 to 1; about 0.75 for a harmonic drive, 0.9 for a quasi-direct one
torque_max_Nm = {effort:g}  # effort limit of the URDF; the drive's peak torque at the joint, if that is lower
rotor_inertia_kgm2 = "?"        # of the rotor, times the square of the gear ratio
weak_kp_Nm_per_rad = {kp:g}  # proposed: a wrong model moves the joint by some degrees, and the wearer can push it away
weak_kd_Nms_per_rad = {kd:g}
"""

SWEEP_MARGIN, SWEEP_DEG = 0.1, 90.0
"""Limits of a proposed sweep: distance from the joint limits as a share of the range, and largest length [°]."""
PERIOD_S, HARMONICS = 20.0, 5
EXCITATION_SHARE, EXCITATION_DEG = 0.25, 25.0
"""Largest deviation of a proposed excitation from its centre: a share of the joint's range, and [°]."""


def rig_text(tree: Tree, name: str, file: str, side: Side | None = None) -> str:
    """Return the file for this machine; `side` is needed where the URDF's names do not show it."""
    side, found = side or side_of(tree), arms(tree)
    known = {i: guess for arm in found for i, guess in zip(arm.joints, arm.places, strict=True)}
    places = [known.get(i, UNKNOWN) for i in range(len(tree.joints))]
    parts = [
        HEAD.format(name=name, file=file, quoted=toml_value(name), title=toml_value(tree.name)),
        _urdf(file, side),
        _wearer(tree, found, side),
        *(_adjustment(arm) for arm in found),
        *(_cuffs(arm, _kind(found)) for arm in found),
        _donning(tree, found),
        *(_actuator(joint, place) for joint, place in zip(tree.joints, places, strict=True)),
        _task(tree),
        _calibration(tree, found),
        _excitation(tree),
    ]
    return "\n".join(part for part in parts if part)


def _urdf(file: str, side: Side | None) -> str:
    if side is not None:
        return f"[urdf]\n{side} = {toml_value(file)}\n"
    return (
        f"[urdf]\n"
        f'right = "?"  # {file} if this is the machine for the right arm; else delete this line\n'
        f'left = "?"   # {file} if it is for the left arm; else delete this line. One machine for both arms: both = …\n'
    )


def _kind(found: list[ArmGuess]) -> ArmKind | None:
    """Return the kind of arm, by the number of joints beyond the elbow; None if it is not known."""
    kinds: dict[int, ArmKind] = {n - 4: kind for kind, n in FREEDOMS_OF_ARM.items()}
    beyond = [0 if len(arm.joints) <= min(FREEDOMS_OF_ARM.values()) else arm.wrist_joints for arm in found]
    counts = [count for count in beyond if count is not None]
    return kinds[min(max(counts), max(kinds))] if len(counts) == len(beyond) else None


def _wearer(tree: Tree, found: list[ArmGuess], side: Side | None) -> str:
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
        return f"{toml_value(arm.shoulder_centre)}  # where the first three axes meet"
    what = "link, fixed to the base, where the machine has the wearer's shoulder"
    if arm.meeting is None:
        return f'"?"  # {what}; the first three axes do not meet in a point'
    x, y, z = arm.meeting
    return f'"?"  # {what}; the first three axes meet at {x:.4g} {y:.4g} {z:.4g} in the base: add such a link there'


def _adjustment(arm: ArmGuess) -> str:
    if arm.upper_arm is None:
        return ""
    length = arm.upper_arm
    return (
        "# Delete this table if the machine cannot be set to the wearer's upper arm.\n[[adjustments]]\n"
        f'joint = {toml_value(length.joint)}\nsegment = "upper_arm"\naxis = "{length.axis}"\n'
        f"nominal_m = {length.metres:.6g}  # as in the URDF, along {length.axis} of its parent\n"
        'min_m = "?"  # shortest upper arm that it can be set to [m]\nmax_m = "?"  # longest [m]\n'
    )


def _cuffs(arm: ArmGuess, kind: ArmKind | None) -> str:
    segments = ("upper_arm", "forearm", "hand") if kind in HAND_APART else ("upper_arm", "forearm")
    blocks = []
    for i, segment in enumerate(segments):
        prefix = f"{arm.side}_" if arm.side else ""
        frame = '"?"  # link whose z is along the limb, at the cuff on the ' + segment
        if len(arm.cuffs) == len(segments):
            frame = f"{toml_value(arm.cuffs[i])}  # by its name; z along the limb"
        side = f'side = "{arm.side}"\n' if arm.side else ""
        blocks.append(
            f'[[cuffs]]\nname = "{prefix}{segment}"\nexo_frame = {frame}\nsegment = "{segment}"\n{side}{CUFF_STIFFNESS}'
        )
    return "\n".join(blocks)


def _donning(tree: Tree, found: list[ArmGuess]) -> str:
    kind = _kind(found)
    freedoms = len(FREEDOMS) if kind is None else FREEDOMS_OF_ARM[kind]
    count = "first 4 to 7" if kind is None else str(freedoms * len(found))
    names = ", ".join(FREEDOMS[:freedoms])
    sides = ", first the right arm's" if len(found) > 1 else ""
    return (
        "# Where the cuffs are fastened and strain-free, inside the limits; best with the arm hanging, elbow at 90°.\n"
        f'[donning]\nposture_deg = "?"  # {_angles(tree)} of the machine: [{", ".join(tree.joint_names)}]\n'
        f'arm_posture_deg = "?"  # {count} angles of the wearer in that posture: [{names}]{sides}\n'
    )


def _actuator(joint: Joint, place: PlaceGuess) -> str:
    reason = place.reason or "shoulder, elbow or wrist (forearm roll counts as wrist)"
    shown = f'"{place.place or MARK}"  # {reason}'
    kp = min(80.0, 1.5 * joint.effort)
    motor = MOTOR.format(effort=joint.effort, kp=round(kp, 2), kd=round(kp / 8.0, 2))
    return (
        f"[[actuators]]\njoint = {toml_value(joint.name)}\nplace = {shown}\n"
        f'drive = "?"  # "harmonic", "quasi_direct", or "passive" for an encoder without motor\n{motor}'
    )


def _task(tree: Tree) -> str:
    limits = "; ".join(f"{joint.name} {low:.0f} to {high:.0f}" for joint, low, high in _limits(tree))
    return (
        f"# The box of postures in which the arm must be weightless. Limits of the joints: {limits}.\n"
        f'[task_workspace]\nlower_deg = "?"  # {_angles(tree)}\nupper_deg = "?"  # {_angles(tree)}\n'
    )


def _calibration(tree: Tree, found: list[ArmGuess]) -> str:
    # A weight on the forearm does not load the wrist, nor one on the right arm the left.
    main = {i for i, guess in zip(found[0].joints, found[0].places, strict=True) if guess.place != "wrist"}
    blocks = [
        "# How the empty machine is calibrated. Without any motor: delete [calibration], its sweeps and [excitation].\n"
        '[calibration]\nmount = "?"       # link on which known weights can be hung, far out\n'
        'weights_kg = "?"  # at least two, as [1.5, 3.0]; the heaviest like an arm if the drives hold it\n'
    ]
    for i, (joint, low, high) in enumerate(_limits(tree)):
        own = "" if i in main else f'mount = "{MARK}"  # link beyond {joint.name} on which the weights can be hung\n'
        middle, reach = 0.5 * (low + high), min(0.5 * SWEEP_DEG, (0.5 - SWEEP_MARGIN) * (high - low))
        blocks.append(
            f"[[calibration.sweeps]]\njoint = {toml_value(joint.name)}\n"
            f"from_deg = {middle - reach:.1f}  # proposed, off the limits\nto_deg = {middle + reach:.1f}\n"
            f'posture_deg = "?"  # {_angles(tree)}; the other joints so that the weight loads this one\n{own}'
        )
    return "\n".join(blocks)


def _excitation(tree: Tree) -> str:
    """Return harmonics with phases that never repeat, so that no joint follows another."""
    size = np.array([min(EXCITATION_DEG, EXCITATION_SHARE * (high - low)) for _, low, high in _limits(tree)])
    joints, harmonics = np.arange(len(size)), np.arange(1, HARMONICS + 1)[:, None]
    phase = 2 * np.pi * ((np.sqrt(5.0) - 1) / 2 * harmonics * (joints + 1) % 1.0)
    rows = {
        name: (size / HARMONICS * wave(phase)).round(1).tolist()
        for name, wave in (("sine", np.sin), ("cosine", np.cos))
    }
    return (
        "# The motion that identifies the arm: proposed and small; exograv rig motion finds a better one.\n"
        f"[excitation]\nperiod_s = {PERIOD_S}\n"
        f'centre_deg = "?"  # {_angles(tree)}: middle of the task workspace\n'
        f"sine_deg = {toml_value(rows['sine'])}\ncosine_deg = {toml_value(rows['cosine'])}\n"
    )


def _angles(tree: Tree) -> str:
    return f"{len(tree.joints)} angles"


def _limits(tree: Tree) -> list[tuple[Joint, float, float]]:
    """Limits of each joint [°]; those of an endless joint are a full turn."""
    ends = [np.clip([joint.lower, joint.upper], -np.pi, np.pi) for joint in tree.joints]
    return [(joint, *np.rad2deg(end).tolist()) for joint, end in zip(tree.joints, ends, strict=True)]
