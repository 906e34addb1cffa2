"""The check at the end of an identification visits postures that the motion before leaves out, within its limits."""

import numpy as np
import pytest

from exograv.identification.excitation.limits import A_MAX, V_MAX
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.identification.check_motion import CHECK_S, CHECKED_FROM_S, ORDER, check_tour
from exograv.procedures.identification.identify import excitation_motion, identification_motion, planned_check

DT = 0.002


@pytest.fixture(scope="module", params=["recupera_like", "recupera_like_7"])
def assembly(request: pytest.FixtureRequest) -> Assembly:
    return assemble(load_rig(request.param), Body(1.75, 70.0, "female"))


def test_a_motion_lasts_as_long_as_asked_and_its_last_ten_seconds_are_the_check(assembly: Assembly):
    check = planned_check(assembly, 60.0)
    assert check is not None
    path, before = identification_motion(assembly, 60.0, DT), excitation_motion(assembly, 60.0 - CHECK_S, DT)
    assert path.seconds == pytest.approx(60.0, abs=2 * DT)
    assert check.from_s == 60.0 - CHECK_S
    np.testing.assert_array_equal(path.q[: len(before)], before.q)


def test_a_motion_that_is_too_short_has_no_check(assembly: Assembly):
    assert planned_check(assembly, CHECKED_FROM_S - 1.0) is None
    assert identification_motion(assembly, 20.0, DT).seconds == pytest.approx(20.0, abs=2 * DT)


def test_the_postures_lie_in_the_task_workspace_and_away_from_the_motion(assembly: Assembly):
    check = planned_check(assembly, 60.0)
    assert check is not None
    lower, upper = assembly.description.workspace
    assert ((check.postures > lower) & (check.postures < upper)).all()
    seen = excitation_motion(assembly, check.from_s, 0.05).q
    assert min(np.abs(seen - q).max(axis=1).min() for q in check.postures) > 0.15


def test_the_tour_is_as_gentle_as_an_excitation_and_does_not_jump(assembly: Assembly):
    check = planned_check(assembly, 60.0)
    assert check is not None
    start = excitation_motion(assembly, check.from_s, DT).q[-1]
    tour = check_tour(start, check.postures, DT)
    assert tour.seconds == pytest.approx(CHECK_S)
    assert np.abs(tour.v).max() <= 1.01 * V_MAX
    assert np.abs(tour.a).max() <= 1.01 * A_MAX
    assert np.abs(np.diff(np.vstack([start, tour.q]), axis=0)).max() <= 1.01 * V_MAX * DT
    lower, upper = assembly.description.workspace
    margin = np.deg2rad(12.0)
    assert ((tour.q > lower - margin) & (tour.q < upper + margin)).all()


def test_each_posture_is_visited_twice_each_time_from_another_one():
    before = (None, *ORDER[:-1])
    for k in set(ORDER):
        ways = [came for came, here in zip(before, ORDER, strict=True) if here == k]
        assert len(ways) == len(set(ways)) == 2
