"""Assist session: support follows the person block by block within its bounds, and an interruption changes nothing."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.procedures.rehabilitation.assist.participant_record import AssistBlock, AssistFile, AssistSession, opened
from exograv.procedures.rehabilitation.assist.session import fly_block, fly_session
from exograv.task.assist_as_needed import AssistSettings, AssistState

from .weak import Weak, usual

NOBODY = AssistFile(participant="P-07", options={})
USUAL = usual()


class CtrlC(KeyboardInterrupt):
    """Interrupt by a person who has to leave."""


def course(needs: list[float], breaks: list[int]) -> list[AssistSession]:
    """Sessions of a person with these needs, each interrupted after `breaks` blocks and continued."""
    file = NOBODY
    for needed, leaves_after in zip(needs, breaks, strict=True):

        def told(session: AssistSession, _block: AssistBlock, leaves_after: int = leaves_after) -> None:
            nonlocal file
            was = len(file.sessions[-1].blocks) if file.sessions and not file.sessions[-1].is_over else 0
            file = file.with_session(session)
            if len(session.blocks) == leaves_after > was and not session.is_over:
                raise CtrlC

        try:
            fly_session(Weak(needed), opened(file, USUAL, None, False), told)
        except CtrlC:
            fly_session(Weak(needed), opened(file, USUAL, None, False), told)
    return list(file.sessions)


needs = st.lists(st.tuples(st.floats(-0.2, 1.2), st.integers(0, 6)), min_size=1, max_size=6)


@given(people=needs)
def test_no_session_lowers_support_after_a_failure_nor_farther_than_it_may(people: list[tuple[float, int]]):
    sessions = course([needed for needed, _ in people], [leaves for _, leaves in people])
    assert [session.number for session in sessions] == list(range(1, len(people) + 1))
    for session in sessions:
        supports = [block.support_percent for block in session.blocks] + [session.state.support_percent]
        assert len(session.blocks) == USUAL.settings.blocks
        assert min(supports) >= session.began_percent - USUAL.settings.rule.session_percent - 1e-9
        for block, (before, after) in zip(session.blocks, itertools.pairwise(supports), strict=True):
            failed = block.sank or sum(block.reached) < USUAL.settings.rule.raise_share * len(block.reached)
            assert after >= before or not (failed or block.has_failed)


@given(people=needs)
def test_a_session_begins_where_the_last_one_ended_and_a_little_above(people: list[tuple[float, int]]):
    sessions = course([needed for needed, _ in people], [leaves for _, leaves in people])
    for before, after in itertools.pairwise(sessions):
        begin = before.state.support_percent + USUAL.settings.rule.begin_percent
        assert after.began_percent == pytest.approx(min(begin, USUAL.settings.rule.most_percent))


def test_a_break_changes_nothing_of_what_is_decided():
    whole, broken = (course([0.7, 0.6], breaks) for breaks in ([0, 0], [2, 4]))
    assert whole == broken


def test_a_person_who_gets_stronger_is_followed_down():
    sessions = course([0.6, 0.5, 0.4, 0.3, 0.2, 0.1], [0] * 6)
    ends = [session.state.support_percent for session in sessions]
    assert ends == sorted(ends, reverse=True)
    assert ends[-1] <= 35.0


def test_an_arm_that_sinks_ends_the_block_and_is_carried_more():
    person = Weak(0.9)
    block = fly_block(person, AssistSettings(), AssistState(50.0, 60.0))
    assert (block.sank, len(block.reached), block.code) == (True, 1, "assist.raise_sank")
    assert block.after_percent == 60.0


def test_what_is_asked_of_the_machine_is_what_was_decided():
    person = Weak(0.5)
    session = fly_session(person, opened(NOBODY, USUAL, None, False), lambda _session, _block: None)
    asked = [support for block in session.blocks for support in [block.support_percent / 100.0] * len(block.reached)]
    assert person.asked == asked
