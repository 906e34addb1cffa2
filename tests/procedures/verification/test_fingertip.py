"""Displacement of a fingertip: centimetres at 0.5 N·m at the shoulder, and twice as much at twice the torque."""

import numpy as np
import pytest

from exograv.procedures.verification.fingertip import Fingertip

HALF_NM = 0.5
RANGE_MM = (5.0, 20.0)
"""Expected range [mm]: 5-15 mm at 0.6 m from the shoulder (docs/howto/verify.md), and more for a stretched arm."""

STRETCHED = np.deg2rad([[60.0, 10.0, 0.0, 30.0]])


@pytest.fixture(scope="module")
def fingertip(model, arm) -> Fingertip:
    return Fingertip(model, arm.x, STRETCHED)


def moved(fingertip: Fingertip, *tau: float) -> float:
    return float(fingertip.moved_mm(np.array([[tau]]))[0, 0])


def test_half_a_newton_metre_of_flexion_moves_it_by_a_centimetre(fingertip):
    low, high = RANGE_MM
    assert low < moved(fingertip, HALF_NM, 0.0, 0.0, 0.0) < high


def test_it_moves_in_proportion_and_whichever_way_the_torque_is(fingertip):
    once = moved(fingertip, 0.1, 0.2, -0.1, 0.3)
    assert moved(fingertip, -0.2, -0.4, 0.2, -0.6) == pytest.approx(2.0 * once)
