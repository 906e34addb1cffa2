"""Elasticity that the cuffs cannot hold does not turn the arm out of them; elasticity that they hold is carried."""

import numpy as np
import pytest

from exograv.control.tick import HELD_COSINE, ControlMode, Tick
from exograv.dynamics import parameters
from exograv.model.loops import TWIST_COSINE_MIN
from exograv.signals import Reference

DT = 1e-3
STILL = np.zeros(4)
SLOPE_MAX_Nm = 0.01  # beyond it the guard stops the run
TORQUE_STEP_MAX_Nm = 0.15  # limit of the envelope's rate of 150 N·m/s in one tick


@pytest.fixture(scope="module")
def tick(assembly, machine) -> Tick:
    return Tick(assembly, machine)


def straightened(seconds: float = 0.7) -> np.ndarray:
    """Joint angles (tick, 4) of a raised arm whose elbow is straightened: then only the upper arm's cuff holds it."""
    share = np.linspace(0.0, 1.0, round(seconds / DT))[:, None]
    return (1 - share) * np.array([0.0, 0.45, 1.0, 1.0]) + share * np.array([-0.15, 0.75, 0.82, 0.2])


@pytest.fixture
def restless(tick: Tick, wearer) -> np.ndarray:
    """Parameters as identified from a wearer who did not relax: the fit explained muscles by springs and soft cuffs."""
    x, layout = wearer.copy(), parameters.ParameterLayout.of(tick.assembly)
    x[layout.stiffness], x[layout.spring_offset] = [2.9, 2.55, 3.0, 1.2], [2.3, 1.9, -1.2, 2.0]
    x[layout.fit] = [-0.022, -0.019, -0.009, 0.021, -0.0065, 0.047, -0.57, *[0.0] * 16]
    return x


def flown(tick: Tick, x: np.ndarray) -> dict[str, np.ndarray]:
    path, driven = straightened(), tick.again()
    driven.mode = ControlMode(drive=1.0)
    speeds, found = np.asarray(np.gradient(path, DT, axis=0)), dict[str, list[np.ndarray]]()
    for q, v in zip(path, speeds, strict=True):
        driven.step(q, v, Reference(q, v, STILL), x)
        for name in ("tau_feedforward", "slope", "cosine", "held"):
            found.setdefault(name, []).append(driven._out[name].copy())
    return {name: np.array(values) for name, values in found.items()}


def test_an_elasticity_that_the_cuffs_cannot_hold_does_not_turn_the_arm_out_of_them(tick, restless):
    found = flown(tick, restless)
    assert found["held"].min() < 0.9
    assert found["slope"].max() < SLOPE_MAX_Nm
    assert found["cosine"].min() > TWIST_COSINE_MIN
    assert np.abs(np.diff(found["tau_feedforward"][1:], axis=0)).max() < TORQUE_STEP_MAX_Nm


def test_what_the_cuffs_hold_is_carried_in_full_to_the_last_bit(tick, wearer):
    found = flown(tick, wearer)
    assert found["cosine"].min() > HELD_COSINE
    np.testing.assert_array_equal(found["held"], 1.0)
