"""A participant in another process is told the page, and the touches come back on the session's clock."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from tests.waiting import wait_until

from exograv.errors import RigError
from exograv.experiment.train.remote_seat import ParticipantLine, RemoteSeat
from exograv.laboratory.participant.screen_session import ScreenSession
from exograv.runtime.processes.line_socket import Lines, LinesListener
from exograv.storage.session_checkpoint import LearnedState
from exograv.task.events import Touch
from exograv.task.participant_line import TO_PARTICIPANT, Introduced, Learned, Remember, Seen, ToSession, Touched
from exograv.task.picture import ParticipantPicture
from exograv.task.plan import TaskPlan
from exograv.task.protocol import load_protocol
from exograv.task.run import TaskRun
from exograv.task.screen import ScreenCalibration

SCREEN = ScreenCalibration(pitch_x_mm=0.3, pitch_y_mm=0.3, method="ruler", anisotropy=0.0, relative_error=0.0)
FORM = Introduced(
    height_m=1.7, mass_kg=65.0, sex="female", lengths_m={"forearm": 0.25}, screen=SCREEN, panel_px=(1920, 1080),
    recorded={},
)  # fmt: skip
PICTURE = ParticipantPicture(
    screen="welcome", target=None, diameter_px=None, arrow=None, countdown_s=None, window=None, windows=2
)
SOON_S, LATER_S = 10.0, 0.015
"""Time-out of a test; time between a tick and the next look of the session at the touches [s]."""

LEARNED = LearnedState(slow=(0.5,), aim=(0.001, -0.002))


def touch(t: float) -> Touch:
    return Touch(
        t=t, received=t + 0.06, page="theirs", sequence=0, x_px=9.0, y_px=8.0, target_x_px=9.0, target_y_px=8.0
    )


@dataclass
class Pair:
    line: ParticipantLine
    participant: Lines

    def tell(self, message: Touched | Learned) -> None:
        self.participant.send(message.model_dump_json())


@pytest.fixture
def pair(monkeypatch: pytest.MonkeyPatch) -> Iterator[Pair]:
    with contextlib.closing(LinesListener(0)) as listener:
        made: list[Lines] = []

        def first(line: ParticipantLine) -> ToSession | None:
            accepted = listener.accepted()
            assert accepted is not None
            made.append(accepted)
            accepted.send(FORM.model_dump_json())
            return original(line)

        original = ParticipantLine._first
        monkeypatch.setattr(ParticipantLine, "_first", first)
        with contextlib.closing(ParticipantLine(listener.port)) as line, made[0]:
            yield Pair(line, made[0])


def session_of(seat: RemoteSeat) -> ScreenSession:
    return seat.session(TaskRun(TaskPlan(load_protocol("training"), "active", SCREEN)))


def touches_at(seat: RemoteSeat, t: float) -> list[Touch]:
    """Wait for the touches that arrive in the tick at `t`, and return them as the session gets them."""
    (source,) = session_of(seat).sources
    found: list[Touch] = []

    def have_arrived() -> bool:
        seat.touch(t)
        found.extend(event for event in source(t + LATER_S) if isinstance(event, Touch))
        return bool(found)

    wait_until(have_arrived, "a touch", SOON_S)
    assert not list(source(t + LATER_S))
    return found


def test_the_form_comes_with_the_first_message(pair: Pair):
    assert pair.line.introduced == FORM


def test_a_touch_keeps_its_age_on_the_sessions_clock(pair: Pair):
    seat = RemoteSeat(pair.line, "simulated-1", None)
    pair.tell(Touched(now=12.5, touch=touch(12.4)))
    (found,) = touches_at(seat, 102.5)
    assert (found.t, found.received, found.page) == (pytest.approx(102.4), pytest.approx(102.46), "simulated-1")


def test_no_touch_arrives_later_than_now(pair: Pair):
    seat = RemoteSeat(pair.line, "simulated-1", None)
    pair.tell(Touched(now=12.5, touch=touch(12.49)))
    (found,) = touches_at(seat, 102.5)
    assert found.received == 102.5


def test_the_participant_sees_the_page_and_remembers_the_last_session(pair: Pair):
    seat = RemoteSeat(pair.line, "simulated-1", LEARNED)
    see = session_of(seat).see
    assert see is not None
    see(0.0, PICTURE)
    first, second = (TO_PARTICIPANT.validate_json(line) for line in pair.participant.received(patience_s=1.0))
    assert isinstance(first, Remember)
    assert LearnedState.model_validate(first.learned) == LEARNED
    assert second == Seen(picture=PICTURE)


def test_what_the_participant_has_learned_is_kept_for_the_checkpoint(pair: Pair):
    seat = RemoteSeat(pair.line, "simulated-1", None)
    pair.tell(Learned(learned=LEARNED.model_dump()))
    pair.tell(Touched(now=1.0, touch=touch(0.9)))
    assert touches_at(seat, 1.0)
    assert pair.line.learned == LEARNED


def test_a_checkpoint_before_the_first_touch_keeps_what_was_learned_before(pair: Pair):
    RemoteSeat(pair.line, "simulated-2", LEARNED)
    assert pair.line.learned == LEARNED


def test_a_participant_whose_process_has_ended_is_named(pair: Pair):
    pair.participant.close()
    seat = RemoteSeat(pair.line, "simulated-1", None)
    with pytest.raises(RigError, match="participant has ended"):
        touches_at(seat, 1.0)


def test_a_message_that_is_none_is_refused(pair: Pair):
    pair.participant.send('{"kind": "gravity"}')
    with pytest.raises(RigError, match="message that is none"):
        touches_at(RemoteSeat(pair.line, "simulated-1", None), 1.0)
