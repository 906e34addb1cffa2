"""A participant starts when the target appears, aims at it, keeps the pace, learns from a touch, then lies still."""

import numpy as np
import pytest

from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.virtual_participant import Activity, PointingPerson
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.storage.session_checkpoint import LearnedState
from exograv.task.picture import ParticipantPicture
from exograv.task.protocol import load_protocol
from exograv.task.task_settings import Sign

ROOM, PROTOCOL = SimulatedRoom(), load_protocol("training").settings
DT = 0.001
AIM_MM = 2.0
STILL = np.zeros(4)


def picture(screen: str, countdown_s: float | None = 20.0, arrow: Sign | None = None) -> ParticipantPicture:
    is_task = screen == "task"
    return ParticipantPicture.model_validate(
        {
            "screen": screen, "target": PROTOCOL.target if is_task else None, "diameter_px": 150.0 if is_task else None,
            "arrow": arrow, "countdown_s": countdown_s, "window": 1, "windows": 31,
        }
    )  # fmt: skip


@pytest.fixture(scope="module")
def world():
    laboratory = draw_laboratory("recupera_like", "right", 0, 1014)
    own = ArmInverseDynamics(laboratory.description, laboratory.machine, laboratory.wearer)
    return own, ROOM.around(laboratory.assembly(), PROTOCOL.target)


@pytest.fixture
def person(world) -> PointingPerson:
    own, around = world
    target = ROOM.on_panel(*ROOM.target_px(PROTOCOL.target))
    sure = Habits(bias_sd_deg=0.0, felt_sd_deg=0.0, motor_noise=0.0, seen_sd_m=0.0, interval_sd=0.0)
    return PointingPerson(own, 0.1 * np.eye(4), around, target, PROTOCOL.pace.too_short.shape, 1014, DT, sure)


def acted(person: PointingPerson, t: float, seconds: float, q: np.ndarray) -> float:
    """Hold the arm at `q`, and return the time at the end."""
    for _ in range(round(seconds / DT)):
        person.act(t, q, STILL)
        t += DT
    return t


REST = np.deg2rad([5.0, 10.0, 25.0, 75.0])


def test_who_rests_gives_no_torque(person: PointingPerson):
    person.see(0.0, picture("rest", 100.0))
    assert not person.act(0.0, REST, STILL).any()


def test_the_arm_is_held_shortly_before_a_window_and_moves_only_in_it(person: PointingPerson):
    person.see(0.0, picture("rest", 2.0))
    t = acted(person, 0.0, 2.0, REST)
    assert person.doing is Activity.READY
    person.see(t, picture("task"))
    acted(person, t, 0.5, REST)
    assert person.doing is Activity.REACHING


def test_nobody_begins_what_cannot_arrive(person: PointingPerson):
    person.see(0.0, picture("rest", 2.0))
    t = acted(person, 0.0, 2.0, REST)
    person.see(t, picture("task", 0.5))
    acted(person, t, 0.45, REST)
    assert person.doing is Activity.READY


def test_a_reach_comes_to_the_target_from_before_the_glass(person: PointingPerson, world):
    own, around = world
    way = person._way_to_target()
    tips = np.array([around.screen_axes.T @ (own.fingertip(q) - around.screen_centre) for q in way.q[::25]])
    np.testing.assert_allclose(1e3 * tips[-1, :2], 1e3 * person._target, atol=AIM_MM)
    near = tips[tips[:, 2] < 0.3 * Habits().approach_m]
    assert 1e3 * np.abs(near[:, :2] - person._target).max() < 25.0
    assert np.abs(way.v).max() < 4.0


def reaching(person: PointingPerson) -> float:
    """Act until the finger is on its way, and return that time."""
    person.see(0.0, picture("rest", 2.0))
    t = acted(person, 0.0, 2.0, REST)
    person.see(t, picture("task"))
    return acted(person, t, 0.9, REST)


def test_a_deviation_aside_is_aimed_away_and_changes_no_expectation(person: PointingPerson):
    t = reaching(person)
    up = person._shift / np.linalg.norm(person._shift)
    aside, before = 0.01 * np.array([up[1], -up[0]]), person.gravity_expected
    person.touched(t, aside)
    np.testing.assert_allclose(person._aim_off, -person.habits.learns_aim * aside, atol=1e-12)
    assert person.gravity_expected == pytest.approx(before)


def test_a_touch_that_is_too_high_makes_the_arm_expected_lighter_and_the_aim_lower(person: PointingPerson):
    t = reaching(person)
    before = person.gravity_expected
    person.touched(t, 0.2 * person._shift)
    assert person._shift[1] > 0.05, "an arm that weighs nothing goes up"
    assert person.gravity_expected < before
    assert person._aim_off[1] < 0.0


@pytest.mark.parametrize(("held", "given_back"), [(-0.5, 1.0), (0.0, 0.0), (0.5, 0.0)])
def test_only_what_is_held_against_is_held_no_more(person: PointingPerson, held: float, given_back: float):
    """Learned weight replaces a held torque against an absent weight; otherwise it moves the arm."""
    t = reaching(person)
    weight, before = person._weight(person._wants), person.gravity_expected
    person._muscles.hold = held * weight
    person.touched(t, 0.2 * person._shift)
    learned = before - person.gravity_expected
    np.testing.assert_allclose(person._muscles.hold, (held + given_back * learned) * weight, atol=1e-12)


def test_more_weight_than_was_expected_replaces_what_holds_the_arm_up(person: PointingPerson):
    t = reaching(person)
    weight, before = person._weight(person._wants), person.gravity_expected
    person._muscles.hold = 0.5 * weight
    person.touched(t, -0.2 * person._shift)
    learned = person.gravity_expected - before
    assert learned > 0.0
    np.testing.assert_allclose(person._muscles.hold, (0.5 - learned) * weight, atol=1e-12)


def test_the_inner_ear_raises_the_target_in_hypergravity_and_lowers_it_without_weight(world):
    own, around = world
    habits = Habits(sees_higher_m=0.05)
    person = PointingPerson(own, 0.1 * np.eye(4), around, np.zeros(2), "down", 1014, DT, habits)
    for gravity, higher in ((0.0, -0.05), (1.0, 0.0), (1.8, 0.04)):
        person.inner_ear = lambda gravity=gravity: gravity
        np.testing.assert_allclose(person._seen_higher(), [0.0, higher], atol=1e-12)


def test_an_arm_that_feels_light_before_the_first_reach_is_expected_lighter(person: PointingPerson):
    person.see(0.0, picture("rest", 2.0))
    t = acted(person, 0.0, 2.0, REST)
    person._effort[:] = 0.2 * person._weight(person._rest)
    person._feel()
    assert person.adaptation.felt == pytest.approx(0.2, abs=3.0 * person.habits.rates.felt_sd)
    trusted = person.habits.trusts_felt
    assert person.gravity_expected == pytest.approx(1.0 - trusted * (1.0 - person.adaptation.felt))
    before = person.gravity_expected
    person._effort[:] = person._weight(person._rest)
    person._feel()
    assert person.gravity_expected == before, "once a window"
    assert t > 0.0


def test_what_was_learned_is_there_after_an_interruption(person: PointingPerson, world):
    t = reaching(person)
    person.touched(t, np.array([0.01, 0.03]))
    own, around = world
    again = PointingPerson(own, 0.1 * np.eye(4), around, person._target, "down", 1015, DT, person.habits)
    again.remember(LearnedState.model_validate_json(person.learned.model_dump_json()))
    assert again.learned == person.learned


@pytest.mark.parametrize(("sign", "slower"), [("too_short", True), ("too_long", False)])
def test_an_arrow_changes_the_own_pace(person: PointingPerson, sign: str, slower: bool):
    t = reaching(person)
    person._is_first = False
    person.see(t, picture("task", 10.0, getattr(PROTOCOL.pace, sign)))
    before = person._interval_s
    person.touched(t, np.zeros(2))
    assert (person._interval_s > before) is slower


def test_after_the_window_the_arm_comes_back_and_lies(person: PointingPerson):
    t = reaching(person)
    person.touched(t, np.zeros(2))
    person.see(t, picture("rest", 100.0))
    t = acted(person, t, 4.0, REST)
    assert person.doing is Activity.LYING
    assert not person.act(t, REST, STILL).any()
