"""Path guide: the path waits for the arm, continues with it, and releases a person who stays away."""

import numpy as np
import pytest

from exograv import motion
from exograv.model.description import load_rig
from exograv.procedures.rehabilitation.guided.grip import DROP_S, FREE, GIVE_S, GRIP_S, GripOutcome
from exograv.procedures.rehabilitation.guided.path_guide import Anchor, PathGuide
from exograv.procedures.rehabilitation.guided.pull import REACH_RAD, PullStrength

DT = 0.005
STRENGTH = PullStrength.of(load_rig("recupera_like_qdd"))
START, GOAL, STILL = np.full(4, 0.5), np.full(4, 1.0), np.zeros(4)


def guide(speed: float = 1.0, grip: float = 1.0) -> PathGuide:
    one = PathGuide(motion.go_to(START, GOAL, 0.5, DT), STRENGTH, speed, grip)
    one.lead()
    return one


def follow(one: PathGuide, seconds: float) -> None:
    """Let a perfect arm follow the path."""
    for _ in range(round(seconds / DT)):
        one(one.target, STILL)


def hold(one: PathGuide, q: np.ndarray, seconds: float) -> None:
    for _ in range(round(seconds / DT)):
        one(q, STILL)


def test_the_path_ends_at_its_goal_and_holds_there():
    one = guide()
    follow(one, one.path.seconds + 3.0)
    assert one.has_arrived
    assert one.target == pytest.approx(GOAL, abs=1e-3)


@pytest.mark.parametrize("speed", [0.1, 0.5])
def test_a_share_of_the_speed_takes_as_much_longer(speed: float):
    one = guide(speed)
    seconds = one.path.seconds / speed
    follow(one, 0.95 * seconds)
    assert one.state is GripOutcome.LED
    follow(one, 0.05 * seconds + 1.0)
    assert one.has_arrived


def test_the_path_stands_for_an_arm_that_is_held_and_goes_on_when_it_is_let_go():
    one = guide()
    follow(one, 1.0)
    held = one.target.copy()
    hold(one, held, 1.5)
    assert np.abs(one.target - held).max() <= REACH_RAD
    assert one.waited_s > 0.0
    follow(one, one.path.seconds + 3.0)
    assert one.has_arrived


def test_who_holds_on_is_let_go_and_nothing_takes_hold_again():
    one = guide()
    follow(one, 1.0)
    held = one.target.copy()
    hold(one, held, 2.0 + GIVE_S + DROP_S)
    assert one.state is GripOutcome.OVERRULED
    assert one.has_let_go
    follow(one, 5.0)
    assert one.has_let_go
    assert not one.tau.any()


def test_who_jumps_away_is_let_go_in_a_moment():
    one = guide()
    follow(one, 1.0)
    hold(one, one.target + 3.0 * REACH_RAD, DROP_S + 2 * DT)
    assert one.has_let_go


def test_who_asks_for_it_is_let_go_in_a_moment():
    one = guide()
    follow(one, 1.0)
    one.let_go()
    follow(one, DROP_S + DT)
    assert one.state is GripOutcome.RELEASED
    assert one.has_let_go


def test_a_guide_that_leads_nobody_gives_no_torque():
    one = PathGuide(motion.go_to(START, GOAL, 0.5, DT), STRENGTH, 1.0)
    hold(one, START + 1.0, 0.5)
    assert not one.tau.any()


def test_the_pull_comes_by_a_ramp():
    one = guide(grip=0.0)
    one(START, STILL)
    assert one.grip == pytest.approx(DT / GRIP_S)


def test_an_arm_that_moves_on_while_it_is_taken_hold_of_takes_its_place_along():
    anchor = Anchor(START, STRENGTH, DT)
    for k in range(300):
        anchor(START + k * 0.001, STILL)
    assert np.abs(anchor.target - (START + 0.299)).max() <= FREE * REACH_RAD + 1e-12
