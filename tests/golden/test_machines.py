"""Machines from published tables have their frames at the published poses, at any order and zeros of their joints.

The reference poses are built again from the published numbers: the frames of the NESM's model (MuJoCo: each body in its
parent by axes, or by axis and angle, and position), and the modified Denavit-Hartenberg table of the AGREE. Sources are
in docs/reference/robots.md.
"""

import casadi as ca
import numpy as np
import pytest
from scipy.stats import qmc

from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.model.kinematics import body_poses


def turn(axis: str, degrees: float) -> np.ndarray:
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return {"x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[axis]


def nesm_frames(q_deg: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    base = np.column_stack([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # xyaxes "0 0 1 0 -1 0"
    steps = [
        (base, np.zeros(3), turn("z", q_deg[0])),
        (turn("x", 90), np.zeros(3), turn("z", q_deg[1] + 90)),  # ref -90
        (turn("x", -90), np.array([0, 0.25, 0]), turn("z", q_deg[2])),
        (turn("x", 90), np.zeros(3), turn("z", -q_deg[3])),  # axis 0 0 -1
    ]
    R, p, frames = np.eye(3), np.array([0.0, -0.21, 0.5]), []
    for fixed, place, moved in steps:
        R, p = R @ fixed @ moved, p + R @ place
        frames.append((R, p))
    return frames


def agree_frames(q_deg: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    table = [(0, 0, 0, 0), (0, 0.8, 0.2, 0), (90, 0, 0, 90), (0, 0, 0, 90), (-90, 0.242, 0, -90), (0, 0, 0, 90)]
    R, p, frames = turn("z", -90), np.zeros(3), []  # x of the table's base is to the right, y forward
    theta = [0.0, 0.0, *q_deg]
    for i in range(1, 6):
        (_, _, a, alpha), (offset, d, _, _) = table[i - 1], table[i]
        p = p + R @ np.array([a, 0.0, 0.0])
        R = R @ turn("x", alpha) @ turn("z", offset + theta[i])
        p = p + R @ np.array([0.0, 0.0, d])
        frames.append((R, p))
    return frames[1:]


@pytest.mark.parametrize(("rig", "published"), [("nesm_like", nesm_frames), ("agree_like", agree_frames)])
def test_every_link_is_where_the_published_table_puts_it(rig: str, published):
    tree = read_exoskeleton(load_rig(rig))
    lower, upper = (np.rad2deg([getattr(joint, end) for joint in tree.joints]) for end in ("lower", "upper"))
    for share in qmc.Sobol(4, scramble=False).random(8):
        q_deg = lower + share * (upper - lower)
        for pose, (R, p) in zip(body_poses(tree, ca.SX(ca.DM(np.deg2rad(q_deg)))), published(q_deg), strict=True):
            np.testing.assert_allclose(np.array(ca.evalf(pose.R)), R, atol=1e-12)
            np.testing.assert_allclose(np.array(ca.evalf(pose.p)).ravel(), p, atol=1e-12)
