"""A session at a terminal takes the steps of the operator's page, over the same line and with the same checks."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.console.of_process import Page, short_training
from tests.console.test_trial_request import kept_until

from exograv.console.options import Address
from exograv.console.run import run_console
from exograv.console.terminal_page import TerminalPage
from exograv.console.terminal_session import Keyboard, RestOffers, SessionEndedError, SessionOutcome, TerminalSession
from exograv.console.trial import REST_NEEDED_S
from exograv.console.trial_request import TrialRequest
from exograv.errors import RigError
from exograv.experiment.steered.rehearsal import RehearsedFlight
from exograv.experiment.steered.request_validation import EVENTS
from exograv.experiment.steered.session_controller import SessionController
from exograv.safety.modes import Mode
from exograv.storage.session_checkpoint import SESSION_FILE
from exograv.task.state import RunState

MOVES_S = 1.0
"""Duration of a rehearsed identification [s]."""


class Session:
    """Rehearsed session at a terminal, without a machine."""

    def __init__(self, folder: Path, participant: str | None = None):
        self.folder, self.lines = folder, list[str]()
        self.flight = RehearsedFlight(participants=("P-07",))
        self.flight._identify_s = MOVES_S
        if participant is not None:
            self.flight._participant, self.flight._is_known = participant, True
        self.protocol = short_training(folder)
        self.outcome: list[SessionOutcome] = []

    def run(self, says: Callable[[str], object] = lambda _: None, resumes: bool = False) -> Any:
        trial = TrialRequest(self.folder, str(self.protocol), "P-07", resumes=resumes)

        def say(line: str) -> None:
            self.lines.append(line)
            says(line)

        def operate(link: str, is_over: threading.Event) -> None:
            page = TerminalPage(link)
            try:
                self.outcome.append(TerminalSession(page, Keyboard(say, is_over, True), resumes).run())
            except SessionEndedError:
                say("ended")
            finally:
                page.close()

        desk = SessionController(self.flight)
        return run_console(Address(port=0, browser=False), self.folder, desk, trial, say, operate)

    @property
    def kept(self) -> RunState:
        return RunState.model_validate_json(SESSION_FILE.read(next(self.folder.glob("*.run.json"))).run)


@pytest.mark.long
def test_an_unknown_arm_is_identified_and_the_protocol_runs_to_its_end_with_touches_from_the_page(tmp_path: Path):
    session, pages, touched = Session(tmp_path), list[Page](), list[int]()

    def participant(line: str) -> None:
        if line.startswith("Open on the participant's screen"):
            pages.append(Page(line.split()[-1]))
            threading.Thread(target=touch, daemon=True).start()

    def touch() -> None:
        page, sequence = pages[0], 0
        while len(touched) < 2:
            picture = page.heard.get("picture", {}).get("picture")
            if picture is not None and picture["screen"] == "task" and picture["window"] not in touched:
                touched.append(picture["window"])
                sequence += 1
                page.touch(sequence)
            threading.Event().wait(0.05)

    result = session.run(participant)
    (outcome,) = session.outcome
    assert (outcome.windows, outcome.finished, outcome.from_file) == (2, True, False)
    assert session.kept.status == "finished"
    assert result.totals is not None
    assert result.totals.touches == 2
    text = "\n".join(session.lines)
    motors, takes, begins, gives = (
        text.index(words)
        for words in (
            "the motors switch on",
            "the machine takes the arm",
            "start the protocol",
            "gives its weight back",
        )
    )
    assert motors < takes < begins < gives
    assert takes < text.index("screen is not measured") < begins
    assert "Window 2 is complete" in text
    assert not session.flight.moment().arm_share


class LatePage(TerminalPage):
    """Page of a machine whose motors do not switch on in time at the first requests."""

    def __init__(self, late: int):
        self.late, self.requests, self.ended = late, 0, ""

    @property
    def steers(self) -> bool:
        return True

    @property
    def shown(self) -> dict[str, Any]:
        is_late = 0 < self.requests <= self.late
        alarm = {"text": {"text": "Too late.", "code": "flight.late_start"}, "is_over": False, "priority": "medium"}
        mode = "exo_only" if self.requests > self.late else "off"
        return {"mode": mode, "mode_text": {"text": mode}, "alarms": [alarm] if is_late else [], "version": 1}

    def act(self, kind: str, **fields: Any) -> str:
        self.requests += 1
        return ""

    def until(self, condition: Callable[[], object], within_s: float) -> bool:
        return bool(condition())


def test_an_operator_whose_motors_started_too_late_is_asked_again_and_not_without_end():
    lines = list[str]()
    keyboard = Keyboard(lines.append, threading.Event(), True)
    page = LatePage(late=2)
    TerminalSession(page, keyboard, False)._make_ready("Press Enter.")
    assert (page.requests, lines.count("Too late.")) == (3, 2)
    never = LatePage(late=9)
    with pytest.raises(RigError, match="Too late"):
        TerminalSession(never, keyboard, False)._make_ready("Press Enter.")


@pytest.mark.long
def test_a_run_that_is_resumed_goes_on_at_its_next_window_to_its_end(tmp_path: Path):
    session = Session(tmp_path)
    kept_until(TrialRequest(tmp_path, str(session.protocol), "P-07"), 15.0)
    session.run(resumes=True)
    (outcome,) = session.outcome
    assert (outcome.windows, outcome.finished) == (2, True)
    assert [window.number for window in session.kept.windows] == [1, 2]
    assert not any("paused" in line for line in session.lines)


@pytest.mark.long
def test_an_arm_that_the_machine_gives_back_by_itself_is_taken_again(tmp_path: Path):
    session = Session(tmp_path)
    session.flight._identify_s, given = 5.0, list[str]()

    def give_back(line: str) -> None:
        if line == Mode.MOVING.value and not given:
            given.append(line)
            assert not session.flight.ask(EVENTS["give_back"])

    session.run(give_back)
    (outcome,) = session.outcome
    assert outcome.finished
    assert sum("has given the arm back" in line for line in session.lines) == 1


@pytest.mark.long
def test_a_stop_ends_the_session_with_its_cause(tmp_path: Path):
    session = Session(tmp_path)

    def stop(line: str) -> None:
        if "start the protocol" in line:
            session.flight.stop()

    with pytest.raises(RigError, match="The machine has let the arm down: Stop was pressed"):
        session.run(stop)
    assert not session.outcome


class RestPage(TerminalPage):
    """Page of a session in a rest, whose machine can learn."""

    def __init__(self, countdown_s: float):
        self.acts, self.countdown_s = list[str](), countdown_s
        self.tell(is_active=False)

    def tell(self, *, is_active: bool) -> None:
        """Set the state in which the machine learns, or does not."""
        run = {"status": "running", "phase": "rest", "countdown_s": self.countdown_s, "window": 2}
        told = {"is_active": is_active, "why_not": {"text": ""}, "sentences": [{"text": "It is renewed."}]}
        self.state = {"run": run, "shown": {"rests": told}}

    def act(self, kind: str, **fields: Any) -> str:
        self.acts.append(kind)
        self.tell(is_active=True)
        return ""


def test_each_long_rest_is_offered_once_and_what_it_taught_is_said():
    lines = list[str]()
    page = RestPage(REST_NEEDED_S + 1.0)
    offers = RestOffers(page, Keyboard(lines.append, threading.Event(), True))
    for _ in range(3):
        offers.look()
    assert page.acts == ["learn_rest"]
    page.tell(is_active=False)
    for _ in range(3):
        offers.look()
    assert page.acts == ["learn_rest"]
    assert lines[-1] == "It is renewed."


def test_a_rest_that_is_too_short_is_not_offered():
    lines = list[str]()
    page = RestPage(REST_NEEDED_S - 1.0)
    offers = RestOffers(page, Keyboard(lines.append, threading.Event(), True))
    for _ in range(3):
        offers.look()
    assert (page.acts, lines) == ([], [])
