"""The rest posture creeps by a power of time, by its logarithm or late, by its angle after the span."""

import casadi as ca
import numpy as np
import pytest

from exograv.rig.twin.wearer.rest_creep import CREEP_END, CreepCourse, LateCreep, PowerCreep, draw_course
from exograv.rig.twin.wearer.tissue import CREEP_SPAN

COURSES = [PowerCreep(0.4, 3.0), PowerCreep(0.0, 3.0), LateCreep()]


def share(course: CreepCourse, time: float) -> float:
    return float(ca.evalf(course.share(ca.SX(time))))


@pytest.mark.parametrize("course", COURSES)
def test_every_course_is_zero_at_the_start_one_after_the_span_and_never_turns(course: CreepCourse):
    at = [share(course, time) for time in np.linspace(0.0, 2.0 * CREEP_END, 200)]
    assert at[0] == 0.0
    assert share(course, CREEP_SPAN) == pytest.approx(1.0)
    assert np.diff(at).min() >= 0.0
    assert at[-1] == share(course, CREEP_END)


@pytest.mark.parametrize("time", [0.5, 20.0, 300.0])
def test_the_courses_have_their_forms(time: float):
    at_span = 1.0 + CREEP_SPAN / 3.0
    now = 1.0 + time / 3.0
    assert share(COURSES[0], time) == pytest.approx((now**0.4 - 1.0) / (at_span**0.4 - 1.0))
    assert share(COURSES[1], time) == pytest.approx(np.log(now) / np.log(at_span))
    u = min(time / CREEP_SPAN, 1.0)
    assert share(COURSES[2], time) == pytest.approx(3.0 * u**2 - 2.0 * u**3)


def test_the_logarithm_is_the_power_of_a_vanishing_exponent():
    assert share(PowerCreep(1e-7, 3.0), 40.0) == pytest.approx(share(PowerCreep(0.0, 3.0), 40.0), rel=1e-5)


@pytest.mark.parametrize("rate", [1.0 / 30.0, 1.0 / 60.0, 1.0 / 120.0])
@pytest.mark.parametrize("course", COURSES)
def test_no_course_is_an_exponential(course: CreepCourse, rate: float):
    times = np.linspace(1.0, CREEP_SPAN, 40)
    exponential = -np.expm1(-rate * times) / -np.expm1(-rate * CREEP_SPAN)
    assert np.abs([share(course, t) for t in times] - exponential).max() > 0.05


def test_every_course_is_drawn():
    generator = np.random.default_rng(0)
    drawn = [draw_course(generator) for _ in range(60)]
    powers = [one.exponent for one in drawn if isinstance(one, PowerCreep)]
    assert 0.0 in powers
    assert max(powers) > 0.5
    assert any(isinstance(one, LateCreep) for one in drawn)
