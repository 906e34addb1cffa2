"""Stage 0 finds gain and friction from sweeps with known weights, and refuses a joint that did not move."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.errors import IdentificationError
from exograv.identification.empty_machine import SAMPLE_PERIOD_S, Sweeps, _Problem, calibrate
from exograv.model.anthropometry import Body
from exograv.model.arm import build_arm
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import load_rig
from exograv.motion import joined, sweep

NOISE_SD = 0.1  # N·m
GAIN_SHARE = np.array([1.05, 0.96, 1.02, 0.97])
COULOMB = np.array([1.8, 2.6, 3.1, 2.0])


@pytest.fixture(scope="module")
def exo():
    """Description and tree."""
    description = load_rig("recupera_like")
    arm = build_arm(Body(1.75, 75.0, "male"), "right")
    return description, adjusted(read_exoskeleton(description), description, arm.lengths)


@pytest.fixture(scope="module")
def sweeps(exo) -> Sweeps:
    """What the machine of the fit's own model measures, gains and friction hidden."""
    description, tree = exo
    problem = _Problem(description, tree)
    theta = problem.mean.copy()
    theta[:4], theta[4:8] = 1.0 / GAIN_SHARE, COULOMB
    noise = np.random.default_rng(0)
    columns: list[list[np.ndarray]] = [[], [], [], []]
    weights: list[np.ndarray] = []
    for plan in description.calibration.sweeps:
        joint = description.joints.index(plan.joint)
        start = np.deg2rad(plan.posture_deg)
        start[joint] = np.deg2rad(plan.from_deg)
        goal = float(np.deg2rad(plan.to_deg))
        path = joined([sweep(start, joint, goal, speed, SAMPLE_PERIOD_S) for speed in (0.3, 0.6)])
        for weight in (0.0, 1.5, 3.0):
            hung = np.full((1, len(path)), weight)
            tau = problem._batch.of(path.q.T, path.v.T, path.a.T, hung, theta)[0].T
            current = (tau + noise.normal(0.0, NOISE_SD, tau.shape)) / description.nominal_gain
            for column, value in zip(columns, (path.q, path.v, path.a, current), strict=True):
                column.append(value)
            weights.append(hung[0])
    q, v, a, measured = (np.concatenate(column) for column in columns)
    return Sweeps(q, v, a, measured, np.concatenate(weights))


def test_gains_and_friction_are_found_within_their_intervals(exo, sweeps: Sweeps):
    description, tree = exo
    machine = calibrate(description, tree, sweeps)
    gain = GAIN_SHARE * description.nominal_gain
    assert (np.abs(machine.actuators.gain - gain) < 3 * machine.actuators.gain_sd).all()
    assert (machine.actuators.gain_sd < 0.01 * gain).all()
    assert (np.abs(machine.friction.coulomb - COULOMB) < 3 * machine.friction_sd.coulomb).all()
    np.testing.assert_allclose(machine.friction.coulomb, COULOMB, atol=0.2)


def test_what_it_cannot_explain_is_the_noise_that_was_added(exo, sweeps: Sweeps):
    description, tree = exo
    machine = calibrate(description, tree, sweeps)
    np.testing.assert_allclose(machine.residual_sd, NOISE_SD * GAIN_SHARE, rtol=0.15)
    np.testing.assert_allclose(machine.correlation_s, SAMPLE_PERIOD_S, rtol=0.5)


def test_a_joint_that_did_not_move_is_named_and_refused(exo, sweeps: Sweeps):
    v = sweeps.v.copy()
    v[:, 2] = 0.0
    description, tree = exo
    with pytest.raises(IdentificationError, match=r"'shoulder_rotation' moved for only 0.0 s"):
        calibrate(description, tree, replace(sweeps, v=v))
