"""The relaxed arm's shoulder follows the table, its joints resist as specified, and neither creates energy."""

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from exograv.rig.twin import Disturbances, draw_wearer
from exograv.rig.twin.wearer.passive import elastic_torque, passive_torque, shift_forces, shoulder_shift

DT = 0.0005
Q = ca.SX.sym("q", 4)
V = ca.SX.sym("v", 4)
WEARER = draw_wearer(Disturbances.at_level(4), 0)
JOINTS, SKELETON = WEARER.passive, WEARER.arms[0].skeleton


@pytest.mark.parametrize(("elevation_deg", "shift_mm"), [(0, 0), (30, 12), (60, 25), (90, 39), (120, 54), (150, 70)])
@pytest.mark.parametrize("plane", [0, 1])
def test_the_shoulder_centre_rises_with_elevation_in_any_plane(elevation_deg: float, shift_mm: float, plane: int):
    q = np.zeros(4)
    q[plane] = np.deg2rad(elevation_deg)
    assert 1e3 * float(ca.Function("shift", [Q], [shoulder_shift(SKELETON, Q, 1.0)])(q)) == pytest.approx(
        shift_mm, abs=1e-9
    )


def test_the_shoulder_never_sinks_on_the_way_up():
    shift = ca.Function("shift", [Q], [shoulder_shift(SKELETON, Q, 1.0)])
    path = [float(shift([angle, 0.0, 0.0, 0.0])) for angle in np.linspace(0.0, 2.6, 200)]
    assert (np.diff(path) > 0.0).all()


def test_what_the_shoulders_path_takes_it_gives_back_at_the_joints():
    x, v_x = ca.SX.sym("x"), ca.SX.sym("v_x")
    forces = ca.Function("forces", [Q, V, x, v_x], list(shift_forces(shoulder_shift(SKELETON, Q, 1.0), Q, V, x, v_x)))
    shift = ca.Function("shift", [Q], [shoulder_shift(SKELETON, Q, 1.0)])
    q, dq = np.array([0.8, 0.5, 0.2, 1.0]), np.array([1e-6, -2e-6, 1e-6, 0.0])
    along = float(shift(q + dq) - shift(q - dq))  # the shoulder led exactly along its path
    force, reaction = forces(q, np.zeros(4), float(shift(q)) + 1e-4, 0.0)
    assert float(force) * along + float(2.0 * ca.dot(reaction, dq)) == pytest.approx(0.0, abs=1e-10)


def test_end_stops_reach_fifteen_newton_metres_at_the_end_of_the_range():
    tau = ca.Function("tau", [Q], [elastic_torque(JOINTS, Q)])
    for elbow_deg, stop in ((150.0, -15.0), (0.0, 15.0)):
        q = np.array([0.3, 0.4, 0.0, np.deg2rad(elbow_deg)])
        spring = -JOINTS.stiffness[3] * (q[3] - JOINTS.neutral[3])
        assert float(tau(q)[3]) - spring == pytest.approx(stop)


def test_end_stops_are_silent_in_the_middle_of_the_range():
    tau = ca.Function("tau", [Q], [elastic_torque(JOINTS, Q)])
    q = np.deg2rad([60.0, 40.0, 0.0, 70.0])
    assert_allclose(np.asarray(tau(q)).ravel(), -JOINTS.stiffness * (q - JOINTS.neutral), atol=1e-12)


def test_a_fast_turn_meets_the_hysteresis_and_a_second_later_a_third_of_it():
    H = ca.SX.sym("h", 4)
    step = passive_torque(JOINTS, Q, V, H, DT)
    function = ca.Function("step", [Q, V, H], [step.tau, step.hysteresis_next])
    q, before = np.deg2rad([60.0, 40.0, 0.0, 70.0]), np.deg2rad([50.0, 30.0, -10.0, 60.0])
    lasting = np.asarray(ca.Function("rest", [Q], [elastic_torque(JOINTS, Q)])(q)).ravel()
    tau, hysteresis = function(q, np.zeros(4), before)
    extra = -JOINTS.hysteresis * JOINTS.stiffness * (q - before)
    assert_allclose(np.asarray(tau).ravel() - lasting, extra)
    for _ in range(round(1.0 / DT)):
        tau, hysteresis = function(q, np.zeros(4), hysteresis)
    assert_allclose(np.asarray(tau).ravel() - lasting, extra * np.exp(-1.0), rtol=1e-2)


def test_passive_joints_take_energy_on_every_closed_way():
    H = ca.SX.sym("h", 4)
    step = passive_torque(JOINTS, Q, V, H, DT)
    function = ca.Function("step", [Q, V, H], [step.tau, step.hysteresis_next])
    hysteresis, work = np.deg2rad([60.0, 40.0, 0.0, 70.0]), np.zeros(4)
    times = np.arange(0.0, 6.0, DT)
    for t in times:
        q = np.deg2rad([60.0, 40.0, 0.0, 70.0]) + 0.3 * np.sin(2.0 * np.pi * t / 2.0)
        v = np.full(4, 0.3 * np.pi * np.cos(2.0 * np.pi * t / 2.0))
        tau, hysteresis = function(q, v, hysteresis)
        work += (t >= 4.0) * np.asarray(tau).ravel() * v * DT
    assert (work < 0.0).all()
