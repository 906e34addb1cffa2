"""Through postures in which the arm's angles are singular the torque stays smooth, and the posture is recognised."""

import numpy as np
import pytest

from exograv.control.tick import ControlMode, Tick
from exograv.dynamics import parameters
from exograv.model.loops import NEAR_SINGULAR, SINGULAR
from exograv.signals import Reference

DT = 1e-3
TORQUE_STEP_MAX_Nm = {0.0: 0.15, 1.0: 0.2}
"""A tick, floating and driven. Floating: what the envelope's rate of 150 N·m/s lets through; driven the wearer's
damping, which fades, adds to it [N·m]."""
SPEED = 1.0  # rad/s
UPRIGHT = np.pi / 2
"""Abduction at which flexion and rotation turn the arm about one axis."""
START_TICKS = 20
"""The path begins with speed, which no joint does: over its first millirad the friction of the machine is returned."""


@pytest.fixture(scope="module")
def tick(assembly, machine) -> Tick:
    return Tick(assembly, machine)


def path_through(generator: np.random.Generator) -> np.ndarray:
    """Joint angles (tick, 4), straight through the singular posture or near it, 0.35 rad to either side."""
    middle = np.array([generator.uniform(0.0, 1.5), UPRIGHT, generator.uniform(-0.6, 0.6), generator.uniform(0.5, 1.8)])
    way = np.array([*generator.uniform(-0.3, 0.3, 1), 0.35, *generator.uniform(-0.3, 0.3, 2)])
    ticks = round(2 * 0.35 / SPEED / DT)
    return middle + way * np.linspace(-1.0, 1.0, ticks)[:, None]


@pytest.mark.parametrize("drive", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(6))
def test_no_torque_jumps_on_a_random_path_through_a_singular_posture(tick: Tick, wearer, seed: int, drive: float):
    generator = np.random.default_rng(seed)
    path, x = path_through(generator), wearer.copy()
    x[parameters.ParameterLayout.of(tick.assembly).fit][:3] = generator.uniform(-0.03, 0.03, 3) * (seed > 0)
    flown = tick.again()
    flown.mode = ControlMode(drive=drive)
    v = np.asarray(np.gradient(path, DT, axis=0))
    still, torques, clearances = np.zeros(4), [], []
    for q, v_now in zip(path, v, strict=True):
        flown.step(q, v_now, Reference(q, v_now, still), x)
        torques.append(flown.tau_feedforward.copy())
        clearances.append(flown.clearance)
    assert np.isfinite(torques).all()
    assert min(clearances) < SINGULAR
    assert np.abs(np.diff(torques[START_TICKS:], axis=0)).max() < TORQUE_STEP_MAX_Nm[drive]


def test_no_posture_of_the_task_workspace_is_near_singular(tick: Tick, wearer):
    flown, still = tick.again(), np.zeros(4)
    lower, upper = tick.assembly.description.workspace
    for q in np.random.default_rng(0).uniform(lower, upper, (50, 4)):
        flown.close(q, wearer)
        flown.step(q, still, Reference(q, still, still), wearer)
        assert flown.clearance > NEAR_SINGULAR
