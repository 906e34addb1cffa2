"""A live identification moves the arm from its posture along the machine's motion, and sends its measurements."""

import numpy as np
import pytest

from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live.live_identification import LiveIdentification
from exograv.loop.phases import FLOATING, IDENTIFICATION, TRAVEL_RAD_S, VERIFICATION
from exograv.model.assembly import Assembly
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.identify import V_MOTION, identification_motion
from exograv.procedures.verification.postures import NONE, all_passes
from exograv.runtime.control_loop.exchange import finding_dtype

PERIOD_S, SECONDS, NOW = 0.001, 12.0, 100.0
SEED = 1002


@pytest.fixture(scope="module")
def prepared() -> ControllerKnowledge:
    return ideal_knowledge(draw_laboratory("recupera_like", None, 0, SEED), 0.0)


class Told:
    """Mock of a worker: it keeps the samples of a live identification, and has findings."""

    def __init__(self, assembly: Assembly):
        self.rows: list[np.ndarray] = []
        self.newest: tuple[int, np.void] | None = None
        self.lesson = LiveIdentification(
            assembly, SECONDS, PERIOD_S, lambda row: self.rows.append(row.copy()), lambda: self.newest
        )

    def find(self, number: int, now: float, value: float) -> None:
        row = np.zeros(1, finding_dtype(1))
        row["now"], row["x"] = now, value
        self.newest = number, row[0]


def moved(told: Told, q: np.ndarray, start: float = NOW) -> np.ndarray:
    """Reference positions of all ticks. The arm follows without error."""
    lesson, asked, k = told.lesson, [], 0
    lesson.prepare(q)
    lesson.begin(start)
    while not lesson.is_over(now := start + k * PERIOD_S):
        asked.append(lesson.reference(now).q.copy())
        lesson.told(now, asked[-1], np.zeros(len(q)), asked[-1])
        k += 1
    for after in range(3):
        now = start + (k + after) * PERIOD_S
        lesson.told(now, asked[-1], np.zeros(len(q)), lesson.reference(now).q)
    return np.array(asked)


def test_the_arm_is_led_from_where_it_is_and_never_faster_than_the_motion_may_be(prepared: ControllerKnowledge):
    told, q = Told(prepared.assembly), prepared.assembly.description.donning_posture
    asked = moved(told, q)
    speed = np.abs(np.diff(asked, axis=0)).max() / PERIOD_S
    assert np.abs(asked[0] - q).max() < 1e-6
    assert TRAVEL_RAD_S < speed <= V_MOTION + 1e-6


def test_samples_are_those_of_the_motion_and_the_last_is_told_once(prepared: ControllerKnowledge):
    told = Told(prepared.assembly)
    moved(told, prepared.assembly.description.donning_posture)
    path = identification_motion(prepared.assembly, SECONDS, PERIOD_S)
    assert [int(row["is_last"]) for row in told.rows] == [0] * len(path) + [1]
    assert np.array_equal(np.array([row["q_asked"] for row in told.rows[:-1]]), path.q)


def test_a_lesson_that_is_begun_again_is_told_again_to_its_end(prepared: ControllerKnowledge):
    told, q = Told(prepared.assembly), prepared.assembly.description.donning_posture
    moved(told, q)
    first = len(told.rows)
    moved(told, q, NOW + 60.0)
    assert len(told.rows) == 2 * first


def test_a_finding_is_taken_once_and_one_of_an_earlier_time_never(prepared: ControllerKnowledge):
    told = Told(prepared.assembly)
    assert told.lesson.found() is None
    told.find(1, NOW, 1.0)
    first = told.lesson.found()
    assert first is not None
    assert first[0] == 1.0
    assert told.lesson.found() is None
    told.find(2, NOW - 1.0, 2.0)
    assert told.lesson.found() is None
    told.find(3, NOW + 1.0, 3.0)
    third = told.lesson.found()
    assert third is not None
    assert third[0] == 3.0
    told.find(4, NOW + 2.0, np.nan)
    assert told.lesson.found() is None
    told.find(5, np.nan, 5.0)
    assert told.lesson.found() is None


def test_who_is_known_is_led_past_every_posture_and_the_end_is_told_once_more(prepared: ControllerKnowledge):
    assembly, told = prepared.assembly, Told(prepared.assembly)
    q = assembly.description.donning_posture
    end = identification_motion(assembly, SECONDS, PERIOD_S).q[-1]
    passes = all_passes(np.array([end + 0.1, end - 0.1]), SEED, end, PERIOD_S)
    lesson = LiveIdentification(
        assembly, SECONDS, PERIOD_S, lambda row: told.rows.append(row.copy()), lambda: None, passes
    )
    told.lesson = lesson
    assert [lesson.phase(words) for words in range(4)] == [IDENTIFICATION, VERIFICATION, FLOATING, FLOATING]
    moved(told, q)
    before, begun = len(told.rows), NOW + 60.0
    assert {int(row["posture"]) for row in told.rows} == {NONE}
    lesson.enter(VERIFICATION, begun)
    for k in range(len(passes.path) + 3):
        lesson.enter(VERIFICATION, now := begun + k * PERIOD_S)
        lesson.told(now, q, np.zeros(len(q)), lesson.reference(now).q)
    rows = told.rows[before:]
    assert [int(row["is_last"]) for row in rows] == [0] * len(passes.path) + [1]
    assert np.array_equal([int(row["posture"]) for row in rows[:-1]], passes.posture)
    assert np.abs(rows[0]["q_asked"] - end).max() < 1e-6
    assert np.array_equal(np.array([row["q_asked"] for row in rows[:-1]]), passes.path.q)
    assert np.array_equal(np.unique(passes.posture), [NONE, 0, 1])
