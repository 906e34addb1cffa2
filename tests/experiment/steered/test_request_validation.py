"""Each act is possible in the modes of one table, once, soon after its request, and only for the shown state."""

import pytest
from pydantic import ValidationError

from exograv.experiment.steered.request_validation import (
    ALWAYS,
    KINDS,
    REMEMBERED,
    RequestContext,
    RequestValidator,
    why_not,
)
from exograv.experiment.steered.requests import ACT, Act, Answer
from exograv.safety.modes import Mode

NOW = 100.0
POSSIBLE: dict[Mode, set[str]] = {
    Mode.OFF: {"don", "make_ready", "set_level"},
    Mode.SELF_TEST: {"switch_off", "set_level"},
    Mode.EXO_ONLY: {"make_ready", "take_arm", "switch_off", "set_level"},
    Mode.RAMP_IN: {"give_back", "set_level"},
    Mode.FLOATING: {"give_back", "set_level", "learn_rest", "agree"},
    Mode.MOVING: {"give_back"},
    Mode.WEIGHING: {"give_back"},
    Mode.RAMP_OUT: set(),
    Mode.SAFE: {"reset"},
}


def standing(mode: Mode | None = Mode.EXO_ONLY, **other) -> RequestContext:
    said = {
        "version": 7,
        "latch": None,
        "is_known": True,
        "is_learned": True,
        "is_ready": True,
        "is_leased": True,
        "participants": ("P-07",),
        "sides": ("right", "left"),
    }
    return RequestContext(mode=mode, **said | other)


def act(kind: str, number: int = 1, made_at_s: float = NOW, **fields) -> Act:
    return ACT.validate_python({"kind": kind, "id": f"act-{number:06d}", "made_at_s": made_at_s, **fields})


@pytest.mark.parametrize("mode", Mode)
def test_what_is_possible_of_a_known_arm_is_what_the_table_says(mode: Mode):
    assert {kind for kind in KINDS if not why_not(kind, standing(mode))} - ALWAYS == POSSIBLE[mode]


def test_the_weight_of_an_arm_is_not_set_before_its_file_was_checked():
    unchecked = standing(Mode.EXO_ONLY, is_learned=False)
    assert "checked" in why_not("set_level", unchecked)
    assert why_not("take_arm", unchecked) == ""


def test_while_the_machine_learns_in_a_rest_the_weight_stays_and_the_arm_may_be_given_back():
    resting = standing(Mode.FLOATING, is_in_rest=True, why_no_rest="The machine learns.")
    assert "learns the arm in this rest" in why_not("set_level", resting)
    assert why_not("learn_rest", resting) == "The machine learns."
    assert why_not("give_back", resting) == why_not("stop", resting) == ""


def test_an_arm_that_is_not_known_can_only_be_identified():
    unknown = standing(is_known=False)
    assert not why_not("identify", unknown)
    assert "not known" in why_not("take_arm", unknown)
    assert "not known" in why_not("set_level", unknown)
    assert "is known" in why_not("identify", standing())


@pytest.mark.parametrize("kind", sorted(set(KINDS) - ALWAYS))
@pytest.mark.parametrize("mode", Mode)
def test_where_nobody_steers_or_nothing_runs_only_stop_notes_and_acknowledgements_pass(kind, mode: Mode):
    assert "No operator steers" in why_not(kind, standing(mode, is_leased=False))
    assert "not begun" in why_not(kind, standing(None))
    for always in ALWAYS:
        assert not why_not(always, standing(mode, is_leased=False))


@pytest.mark.parametrize("kind", sorted(set(KINDS) - ALWAYS - {"reset"}))
@pytest.mark.parametrize("mode", Mode)
def test_after_a_stop_nothing_but_a_reset_is_possible(kind, mode: Mode):
    assert "Reset it first" in why_not(kind, standing(mode, latch="Stop was pressed."))
    assert not why_not("reset", standing(mode, latch="Stop was pressed."))


@pytest.mark.parametrize("kind", sorted(set(KINDS) - ALWAYS))
def test_where_the_processes_are_gone_somebody_can_only_be_put_in_anew(kind):
    assert (why_not(kind, standing(Mode.OFF, failure="The guard died.")) == "") is (kind == "don")


@pytest.mark.parametrize("kind", ["take_arm", "identify"])
def test_step_two_is_not_possible_without_step_one(kind):
    assert "Step one" in why_not(kind, standing(is_ready=False, is_known=kind == "take_arm"))


@pytest.mark.parametrize("age_s", [-0.6, 0.6, 3600.0])
def test_what_comes_late_or_from_the_future_is_refused_and_stop_is_not(age_s: float):
    reception = RequestValidator()
    assert "after it was made" in reception.refusal(act("give_back", made_at_s=NOW - age_s), NOW, standing())
    assert not reception.refusal(act("stop", made_at_s=NOW - age_s), NOW, standing())


def test_what_was_asked_for_something_that_has_changed_since_is_refused():
    reception = RequestValidator()
    for kind in ("make_ready", "take_arm"):
        assert not reception.refusal(act(kind, seen_version=7), NOW, standing())
        assert "changed" in reception.refusal(act(kind, seen_version=6), NOW, standing())


def test_somebody_without_a_file_is_not_put_in():
    reception, off = RequestValidator(), standing(Mode.OFF)
    assert "P-07" in reception.refusal(act("don", seen_version=7, participant="P-08"), NOW, off)
    assert not reception.refusal(act("don", seen_version=7, participant="P-07"), NOW, off)
    assert not reception.refusal(act("don", seen_version=7), NOW, off)


def test_an_act_that_comes_again_is_known_and_another_one_of_its_name_is_not_taken_for_it():
    reception, first = RequestValidator(), act("give_back")
    assert reception.known(first) is None
    answer = reception.remember(first, Answer(id=first.id, taken=True))
    assert reception.known(first) is answer
    other = reception.known(act("switch_off"))
    assert other is not None
    assert not other.taken


def test_answers_that_are_kept_do_not_grow_without_end():
    reception = RequestValidator()
    for number in range(REMEMBERED + 10):
        one = act("give_back", number)
        reception.remember(one, Answer(id=one.id, taken=True))
    assert reception.known(act("give_back", 9)) is None
    assert reception.known(act("give_back", 10)) is not None


@pytest.mark.parametrize(
    "message",
    [
        {"kind": "start"},
        {"kind": "take_arm"},
        {"kind": "take_arm", "seen_version": 1, "torque": 5.0},
        {"kind": "set_level", "gravity_level": 1.81},
        {"kind": "set_level", "gravity_level": float("nan")},
        {"kind": "set_level", "gravity_level": 0.5, "ramp_s": -1.0},
        {"kind": "don", "seen_version": 1, "participant": "../../etc/passwd"},
        {"kind": "note", "text": ""},
    ],
)
def test_what_is_no_act_is_refused_before_anybody_decides(message: dict):
    with pytest.raises(ValidationError):
        ACT.validate_python({"id": "act-000001", "made_at_s": NOW, **message})
    with pytest.raises(ValidationError):
        ACT.validate_python({"id": "act-000001", "made_at_s": float("inf"), "kind": "stop"})
