"""Machines of the tasks: the one that comes with exograv, the same with roll and wrist, and chains of any length."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from exograv.model.anthropometry import Body, segment_lengths, segment_prior
from exograv.model.arm import build_arm
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription, RigSettings, load_rig
from exograv.model.support import assemble
from exograv.model.tree import Frame, Joint, Tree, inertial_parameters

RIG = "recupera_like"
BODY = Body(1.75, 75.0, "male")

WRIST = ("forearm_roll", "wrist_flexion", "wrist_deviation")
ROLL_BELOW_ELBOW, WRIST_BELOW_ROLL = 0.08, 0.18  # m
ROLL = 4
"""Index of the first additional joint of the larger machine."""


def machine_of_4() -> Assembly:
    """Return the machine that comes with exograv, around an arm of the table."""
    return assemble(load_rig(RIG), BODY)


def machine_of_7() -> Assembly:
    """Return the same machine with a forearm roll and a wrist; its forearm cuff sits behind the roll.

    For comparisons only. It is kept unchanged so that results stay comparable: its arm has four freedoms, where
    `recupera_like_7` has an arm of seven.
    """
    small = machine_of_4()
    description = RigDescription(_settings_of_7(small.description.settings), "right", small.description.folder)
    return Assembly(description, _with_wrist(small.exo), build_arm(BODY, "right"), small.cuffs)


def _settings_of_7(settings: RigSettings) -> RigSettings:
    raw = settings.model_dump()
    raw["actuators"] += [raw["actuators"][-1] | {"joint": name} for name in WRIST]
    raw["donning"]["arm_posture_deg"] = list(raw["donning"]["posture_deg"])
    raw["donning"]["posture_deg"] += [0.0, 0.0, 0.0]
    raw["task_workspace"]["lower_deg"] += [-30.0, -30.0, -15.0]
    raw["task_workspace"]["upper_deg"] += [30.0, 30.0, 15.0]
    for sweep in raw["calibration"]["sweeps"]:
        sweep["posture_deg"] += [0.0, 0.0, 0.0]
    raw["excitation"]["centre_deg"] += [0.0, 0.0, 0.0]
    for row in (*raw["excitation"]["sine_deg"], *raw["excitation"]["cosine_deg"]):
        row += [0.0, 0.0, 0.0]
    return RigSettings.model_validate(raw)


def _with_wrist(tree: Tree) -> Tree:
    elbow = tree.index("elbow_flexion")
    axes = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    origins = np.array([[0.0, 0.0, -ROLL_BELOW_ELBOW], [0.0, 0.0, -WRIST_BELOW_ROLL], [0.0, 0.0, 0.0]])
    joints = [
        Joint(name, "revolute", elbow + i, np.eye(3), origins[i], axes[i], -1.0, 1.0, 30.0, 3.0)
        for i, name in enumerate(WRIST)
    ]
    links = ((0.4, (0.0, -0.03, -0.08)), (0.25, (0.02, 0.0, 0.0)), (0.3, (0.0, -0.02, -0.06)))  # kg, m; assumed
    phi = [inertial_parameters(mass, np.array(com), 1e-3 * np.diag([1.0, 1.2, 0.5])) for mass, com in links]
    cuff = tree.frames["forearm_cuff"]
    moved = Frame(ROLL, cuff.R_body_frame, cuff.p_body_frame + np.array([0.0, 0.0, ROLL_BELOW_ELBOW]))
    return replace(
        tree,
        joints=(*tree.joints, *joints),
        bodies=(*tree.bodies, *(f"{name}_link" for name in WRIST)),
        phi=np.vstack([tree.phi, phi]),
        frames={**tree.frames, "forearm_cuff": moved},
    )


def aligned_arm(n: int) -> Tree:
    """Return an arm with the same joints as the machine of `n`, 4 or 7, and with its segments' masses.

    With 4 joints forearm and hand are one body, with 7 they are two.
    """
    usual, lengths = build_arm(BODY, "right"), segment_lengths(BODY)
    tree, (upper_arm, forearm_and_hand) = usual.tree, usual.bodies
    kept = [replace(tree.joints[i], parent=k - 1) for k, i in enumerate(usual.limbs[0].joints)]
    kept[3] = replace(kept[3], p_parent_joint=np.array([0.0, 0.0, -lengths["upper_arm"]]))
    empty = np.zeros(10)
    if n == 4:
        phi = np.array([empty, empty, tree.phi[upper_arm], tree.phi[forearm_and_hand]])
        return Tree("aligned arm", tuple(kept), tuple(f"arm_{i}" for i in range(4)), phi, {})
    axes = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    origins = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -lengths["forearm"]], [0.0, 0.0, 0.0]])
    more = [
        Joint(f"arm_{name}", "revolute", ROLL - 1 + i, np.eye(3), origins[i], axes[i], -1.0, 1.0, np.inf, np.inf)
        for i, name in enumerate(WRIST)
    ]
    forearm, hand = segment_prior(BODY, "forearm")[0], segment_prior(BODY, "hand")[0]
    phi = np.array([empty, empty, tree.phi[upper_arm], empty, forearm, empty, hand])
    return Tree("aligned arm", (*kept, *more), tuple(f"arm_{i}" for i in range(7)), phi, {})


def chain(n: int) -> Tree:
    """Return a chain of `n` joints with general rotations: a code generator finds no zero to leave out."""
    axes = np.eye(3)
    joints = tuple(
        Joint(
            f"joint_{i}", "revolute", i - 1, _turned(0.3 + 0.03 * i), np.array([0.02, -0.03, 0.15]), axes[2 - i % 3],
            -3.0, 3.0, 50.0, 5.0,
        )
        for i in range(n)
    )  # fmt: skip
    phi = np.array(
        [inertial_parameters(2.0 * 0.93**i, np.array([0.01, -0.02, 0.07]), 0.01 * np.eye(3)) for i in range(n)]
    )
    return Tree(f"chain of {n}", joints, tuple(f"link_{i}" for i in range(n)), phi, {})


def _turned(angle: float) -> Float[np.ndarray, "3 3"]:
    """Return the rotation by the same angle about x, y, then z."""
    c, s = np.cos(angle), np.sin(angle)
    x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return z @ y @ x
