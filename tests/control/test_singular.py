"""The torque stays smooth through postures in which the arm's angles are singular, and these are recognised."""

import numpy as np
import pytest

from exograv.control.tick import ControlMode, Tick
from exograv.dynamics import parameters
from exograv.model.loops import NEAR_SINGULAR, SINGULAR
from exograv.signals import Reference

DT = 1e-3
TORQUE_STEP_MAX_Nm = {0.0: 0.15, 1.0: 0.2}
"""Largest torque step per tick, floating and driven [N·m]. Floating: the limit of the envelope's rate of 150 N·m/s.
Driven: the wearer's damping, which is faded, adds to it."""
SPEED = 1.0  # rad/s
UPRIGHT = np.pi / 2
"""Abduction at which flexion and rotation turn the arm about the same axis [rad]."""
START_TICKS = 20
"""Ticks at the start that are not checked. The path starts at full speed, which no real joint does, and in its first
millirad the compensation of friction builds up."""


@pytest.fixture(scope="module")
def tick(assembly, machine) -> Tick:
    return Tick(assembly, machine)


def path_through(generator: np.random.Generator) -> np.ndarray:
    """Joint angles (tick, 4) on a straight path through or near the singular posture, 0.35 rad to either side."""
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
