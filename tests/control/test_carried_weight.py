"""A known weight is carried in addition to the arm, in full at every gravity level, and can be removed exactly."""

import numpy as np
import pytest

from exograv.control.tick import ControlMode, Tick
from exograv.dynamics.parameters import ParameterLayout
from exograv.model.arm import held_weight
from exograv.signals import Reference

PARITY = 1e-9  # N·m: rounding, and postures closed to 1e-10 rad
Q = np.array([0.8, 0.3, -0.2, 1.3])
STILL = np.zeros(4)
KG = 1.3


@pytest.fixture
def tick(assembly, machine) -> Tick:
    return Tick(assembly, machine)


@pytest.fixture
def held(assembly) -> np.ndarray:
    return held_weight(assembly.arm, KG)


def at_rest(tick: Tick, x: np.ndarray, level: float, payload: np.ndarray | float = 0.0) -> np.ndarray:
    tick.mode = ControlMode(gravity_level=level)
    tick.payload[:] = payload
    return tick.at_rest(Q, x, Q)[0]


def with_phi(assembly, x: np.ndarray, phi: np.ndarray) -> np.ndarray:
    x = x.copy()
    x[ParameterLayout.of(assembly).phi] = phi
    return x


def test_without_gravity_a_weight_beside_the_arm_is_as_good_as_one_in_it(assembly, tick, wearer, held):
    in_it = with_phi(assembly, wearer, wearer[ParameterLayout.of(assembly).phi] + held)
    np.testing.assert_allclose(at_rest(tick, wearer, 0.0, held), at_rest(tick, in_it, 0.0), atol=PARITY)


def test_on_earth_the_weight_is_carried_and_the_arm_is_not(assembly, tick, wearer, held):
    alone = with_phi(assembly, wearer, held)
    np.testing.assert_allclose(at_rest(tick, wearer, 1.0, held), at_rest(tick, alone, 0.0), atol=PARITY)


def test_a_weight_taken_out_is_gone_to_the_last_bit(tick, wearer, held):
    before = at_rest(tick, wearer, 0.378)
    assert np.abs(at_rest(tick, wearer, 0.378, held) - before).max() > 1.0
    np.testing.assert_array_equal(at_rest(tick, wearer, 0.378), before)


def test_a_driven_arm_gets_what_moves_the_weight_too(assembly, tick, wearer, held):
    in_it = with_phi(assembly, wearer, wearer[ParameterLayout.of(assembly).phi] + held)
    v, a = np.full(4, 0.4), np.full(4, 1.5)
    asked = []
    for x, payload in ((wearer, held), (in_it, 0.0 * held)):
        at_rest(tick, x, 0.0, payload)
        tick.mode = ControlMode(drive=1.0)
        for _ in range(10):
            tick.step(Q, v, Reference(Q, v, a), x)
        asked.append(tick.tau_desired.copy())
    np.testing.assert_allclose(asked[0], asked[1], atol=PARITY)
