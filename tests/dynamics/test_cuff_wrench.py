"""A wrench at a cuff does the work of its force along the arm's path, and of its moment along the arm's turn."""

import casadi as ca
import numpy as np
import pytest
from tests.shoulder_path import FURTHER_PATH

from exograv.dynamics.cuff_wrench import cuff_torque
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.kinematics import body_poses
from exograv.model.loops import arm_poses, cuff_pairs
from exograv.model.support import assemble

FIT_OF_WEARER = [0.015, -0.012, 0.008, 0.02, 0.006, 0.2, -0.3, 0.12, 0.08, 0.008, -0.006, *FURTHER_PATH]
STEP = 1e-6  # rad
TOLERANCE = 1e-6  # N·m, for torques of some tens of N·m


@pytest.mark.parametrize("seed", range(3))
def test_torque_is_work_per_angle(seed: int):
    assembly = assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))
    y, z, fit = ca.SX.sym("y", 4), ca.SX.sym("z", 4), ca.SX(ca.DM(FIT_OF_WEARER))
    arm = arm_poses(assembly, z, fit)
    pairs = [pair.T_exo_arm for pair in cuff_pairs(assembly, body_poses(assembly.exo, y), arm, fit)]
    poses = ca.Function("poses", [y, z], [value for T in pairs for value in (T.p, T.R)])
    wrenches = ca.SX.sym("wrenches", 6, 2)
    torque = ca.Function("torque", [y, z, wrenches], [cuff_torque(assembly, y, z, fit, wrenches)])

    generator = np.random.default_rng(seed)
    q = np.array([0.6, 0.3, -0.2, 1.2])
    # The arm is misaligned in its cuffs, so that a wrong point of action would show.
    at, applied = q + generator.normal(0.0, 0.2, 4), 20.0 * generator.standard_normal((6, 2))
    works = []
    for direction in STEP * np.eye(4):
        before, after = ([np.array(value) for value in poses(q, at + sign * direction)] for sign in (-1.0, 1.0))
        middle, work = [np.array(value) for value in poses(q, at)], 0.0
        for cuff, (force, moment) in enumerate(zip(applied[:3].T, applied[3:].T, strict=True)):
            p, turn = middle[2 * cuff].ravel(), after[2 * cuff + 1] @ before[2 * cuff + 1].T
            way = (after[2 * cuff] - before[2 * cuff]).ravel()
            angle = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
            work += force @ way + (moment - np.cross(p, force)) @ angle
        works.append(work / (2.0 * STEP))
    np.testing.assert_allclose(np.array(torque(q, at, applied)).ravel(), works, atol=TOLERANCE)
