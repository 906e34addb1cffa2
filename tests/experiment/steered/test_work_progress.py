"""A calibration and an identification say the joint that moves, what is done, what is left, and why it takes time."""

import itertools

import pytest

from exograv.experiment.steered.rehearsal import CALIBRATED_S, JOINTS, RehearsedFlight
from exograv.experiment.steered.requests import DonRequest
from exograv.experiment.steered.work_progress import PARTS, CalibrationProgress, identification_progress, left_s
from exograv.procedures.calibration.phase_texts import SENTENCES, say
from exograv.sentence import Sentence

WEIGHTS = ("1.5", "3")


def told_in_order() -> list[Sentence]:
    """Sentences of a calibration of two joints with two weights, in their order."""
    texts = [say("calibration.still")]
    names = [{"joint": f"joint_{i}", "number": i, "of": 2} for i in (1, 2)]
    texts += [say("calibration.push", **name) for name in names]
    for name in names:
        texts.append(say("calibration.sweep", **name, span=2, parts=4))
        for number, weight in enumerate(WEIGHTS):
            texts += [say("calibration.hang", weight=weight)]
            texts += [say("calibration.weight", **name, weight=weight, part=2 + number, parts=4)]
    return [*texts, *(say("calibration.friction", **name) for name in names), say("calibration.home")]


def test_the_share_of_a_calibration_only_rises_and_ends_at_one():
    progress, shares = CalibrationProgress(lambda: 0.0), list[float]()
    for text in told_in_order():
        for share in (0.0, 0.5, 1.0):
            progress(text, share)
            shares.append(progress.work.share_done)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_each_joint_has_an_equal_part_of_the_sweeps():
    progress, (begin, end) = CalibrationProgress(lambda: 0.0), PARTS["calibration.weight"]
    progress(say("calibration.weight", joint="a", number=1, of=2, weight="3", part=3, parts=4), 1.0)
    assert progress.work.share_done == pytest.approx((begin + end) / 2)


def test_every_phase_but_hanging_a_weight_and_cooling_has_its_place_in_the_whole():
    assert PARTS.keys() == SENTENCES.keys() - {"calibration.hang", "calibration.cool"}
    assert {end for _, end in PARTS.values()} >= {begin for begin, _ in PARTS.values()} - {0.0}


def test_the_joint_that_moves_is_named_and_none_while_a_weight_is_hung():
    progress = CalibrationProgress(lambda: 0.0)
    progress(say("calibration.sweep", joint="elbow_flexion", number=1, of=2, span=2, parts=4), 0.5)
    assert (progress.work.joint, progress.work.phase) == (
        "elbow_flexion",
        "Calibrating the empty machine: elbow_flexion (1/2)",
    )
    progress(say("calibration.hang", weight="3"), 0.5)
    assert progress.work.joint is None


def test_the_remaining_time_follows_the_rate_so_far():
    clock = itertools.count(0.0, 10.0)
    progress = CalibrationProgress(lambda: next(clock))
    progress(say("calibration.home"), 0.0)
    assert progress.work.left_s == pytest.approx(10.0 * 0.02 / 0.98)
    assert left_s(1.0, 0.01) is None


def test_a_rehearsed_machine_of_another_side_is_calibrated_first():
    t = 50.0
    flight = RehearsedFlight(lambda: t)
    flight.don(DonRequest(id="act-000001", made_at_s=t, seen_version=1, side="left"))
    joints = list[str | None]()
    while (moment := flight.moment()).mode is None:
        assert moment.work is not None
        assert moment.work.kind == "calibration"
        joints.append(moment.work.joint)
        t += 0.5
        assert t < 50.0 + CALIBRATED_S + 1.0
    assert tuple(dict.fromkeys(joints)) == JOINTS
    assert moment.work is None


def test_an_identification_names_the_fastest_joint_and_ends_with_its_motion():
    work = identification_progress(None, True, 60.0, ("a", "b"), (0.1, -0.4))
    assert work is not None
    assert (work.joint, work.left_s) == ("b", 60.0)
    assert "60 s" in work.why
    resting = identification_progress(None, True, 60.0, ("a", "b"), (0.0, 0.001))
    assert resting is not None
    assert resting.joint is None
    assert identification_progress(None, False, 60.0, ("a",), (1.0,)) is None
