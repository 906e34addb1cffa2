"""Figures in the code equal those of docs/explanation/safety.md and its sources, so a changed constant is noticed."""

import math

import numpy as np
import pytest

from exograv.safety import guard, ingress, modes, monitors, plausible
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.native import core


@pytest.mark.parametrize(
    ("figure", "published"),
    [
        (core.WITHOUT_MODEL_SHARE, 20.0 / 10.0),
        (core.V_CREDIBLE_RAD_S, 1000.0),
        (guard.GRAVITY_LEVEL_S, 5.0),
        (guard.COMMAND_LIFE_S, 0.005),
        (guard.CONSENT_S, 120.0),
        ((guard.WINDOW_MS, guard.IN_WINDOW_MAX_MS), (20, 3)),
        ((guard.SECOND_MS, guard.IN_SECOND_MAX), (1000, 10)),
        (core.STANDING_RAD_S, 0.05),
        (core.AGE_MAX_S, 0.003),
        ((ingress.JUMP_SHARE, core.JUMPS_MAX), (1.5, 3)),
        ((ingress.FROZEN_MS, ingress.FROZEN_FROM_RAD_S), (20, 0.2)),
        ((ingress.MOVING_MS, ingress.MOVING_COUNTS), (5, 4)),
        ((ingress.KEPT_MS, ingress.KEPT_JOINT_MS, ingress.NOISE_S), (40, 80, 1.0)),
        (ingress.COARSEST_COUNT_RAD, math.tau / 8192),
        ((modes.RAMP_IN_S, modes.RAMP_OUT_S), (5.0, 3.0)),
        (modes.DRIFT_MAX_RAD, np.deg2rad(5.0)),
        (modes.SPEED_MAX_RAD_S, 0.5),
        (modes.REST_BEFORE_RAMP_S, 1.0),
        (core.AGREE_RAD, 0.035),
        (core.TORQUE_OFF_NM, 3.0),
        (monitors.IN_A_ROW_MS, 10),
        ((monitors.SLOWEST_MS, monitors.STILL_MS, core.STILL_WAY_RAD), (30, 20, 0.003)),
        ((core.TORQUE_BIAS_NM, monitors.BIAS_S), (2.0, 0.1)),
        ((core.REFUSED_NM, monitors.REFUSED_S, core.SLOW_RAD_S), (3.0, 0.3, 0.1)),
        ((monitors.OPPOSITE_RAD_S, monitors.SPEED_MS, monitors.LATELY_MS), (0.15, 8, 12)),
        ((core.SHARE_MAX, core.MARGIN_NM), (1.3, 3.0)),
        (plausible.GRAVITY_LEVEL_MAX, 1.8),
    ],
)
def test_a_figure_is_the_published_one(figure, published):
    assert figure == pytest.approx(published)


def test_the_default_limits_of_a_machine_are_the_published_ones():
    limits = Limits(np.ones(1), np.ones(1))
    of_all = (limits.torque_rate_max_Nm_per_s, limits.v_damping_rad_s, limits.v_trip_rad_s, limits.descent_s)
    assert of_all == (150.0, 4.0, 5.0, 3.0)


def test_the_limits_of_a_person_are_the_published_ones():
    one = np.zeros(1)
    table = plausible.PlausibleTable((plausible.LimbTable((0,), 1, np.zeros((1, 3)), np.zeros((1, 3))),), one, one, one)
    limits = PersonLimits(table, one + 8.0, one - 2.0, one + 2.0)
    assert np.rad2deg([limits.wall_rad, limits.trip_rad]) == pytest.approx([10.0, 2.0])
    assert (limits.tank_start_J, limits.tank_max_J) == (0.5, 1.0)
    assert (limits.path_W, limits.driven_W, limits.driven_J) == (0.0, 0.0, 0.0)
    assert limits.v_trip_rad_s == math.inf


def test_the_limits_of_a_person_may_be_small():
    one = np.zeros(1)
    table = plausible.PlausibleTable((plausible.LimbTable((0,), 1, np.zeros((1, 3)), np.zeros((1, 3))),), one, one, one)
    limits = PersonLimits(table, one + 0.1, one - 2.0, one + 2.0, v_trip_rad_s=0.1, trip_rad=0.0)
    assert limits.v_trip_rad_s == 0.1
