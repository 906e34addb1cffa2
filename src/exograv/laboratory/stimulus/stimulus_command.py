"""`exograv dev stimulus`: a simulated participant at the real participant's page of a session."""

import contextlib
import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import ValidationError

from exograv.errors import ConfigError, RigError
from exograv.files import replace_file
from exograv.laboratory.amplifier.pulse_line import ToAmplifier
from exograv.laboratory.options import StimulusOptions
from exograv.results import JsonObject
from exograv.runtime.processes.line_socket import Lines, connected_lines
from exograv.storage.session_checkpoint import LearnedState
from exograv.task.participant_line import (
    TO_SESSION,
    Contact,
    Electrodes,
    Introduced,
    Learned,
    Remember,
    Room,
    Seen,
    ToParticipant,
    ToSession,
)

from .devtools import chromium
from .page import ParticipantPage, Sight

LOOKS_EVERY_S = 0.05
"""Time between two looks at the page [s]."""

WAITS_S = 0.005
"""Longest wait for a contact before the page is looked at [s]."""

INTRODUCED_S = 60.0
"""Time-out for the participant's form [s]."""

BLIND_S = 15.0
"""Time without a page after which the stimulus gives up [s]."""

AGREES_EVERY_S = 2.0
"""Time after which a button that is still there is pressed again [s]."""

BUTTON_PX = 10.0
"""Width of the contact with a button [px]."""

IN_ROOM = frozenset({"rest", "task", "paused"})
"""Screens of a run, during which screen and support are before the participant."""


@dataclass(frozen=True)
class MadeTouch:
    """Touch that the participant made."""

    contact_s: float
    """Time at which the simulated finger met the panel, on the common monotonic clock [s]."""

    sent_s: float
    """Time at which the browser was told, on the same clock [s]."""

    x_px: float
    y_px: float


@dataclass
class StimulusResult:
    """Result of `exograv dev stimulus`."""

    is_complete: bool = False
    """True if the page has shown the end of the run, and has delivered all touches."""

    unsent: int = 0
    """Number of touches that the page had not delivered at the end."""

    made: list[MadeTouch] = field(default_factory=list)


def run_stimulus(options: StimulusOptions, say: Callable[[str], object]) -> StimulusResult:
    """Show the page to the participant, and make the participant's touches, until the run is over.

    Raises:
        RigError: No participant waits at the port, the browser does not start, or the page is lost.
    """
    with connected_lines(options.line) as lines:
        form = _form(lines)
        with chromium(options.chromium) as browser:
            page = ParticipantPage(browser, options.link, form.panel_px)
            say(f"The page is open on a panel of {form.panel_px[0]} × {form.panel_px[1]} pixels.")
            with contextlib.ExitStack() as stack:
                amplifier = None
                if options.amplifier is not None:
                    amplifier = stack.enter_context(contextlib.closing(ToAmplifier(options.amplifier)))
                    lines.send(Electrodes(port=options.amplifier).model_dump_json())
                if options.memory is not None and options.memory.exists():
                    lines.send(Remember(learned=_remembered(options.memory)).model_dump_json())
                stimulus = Stimulus(lines, page, say, form.screen.pitch_x_mm, amplifier)
                with contextlib.suppress(KeyboardInterrupt):
                    while not stimulus.is_over:
                        stimulus.step()
                if options.memory is not None and stimulus.learned is not None:
                    replace_file(options.memory, json.dumps(stimulus.learned))
            return stimulus.result


class Stimulus:
    """Eyes and fingertip of the participant."""

    def __init__(
        self,
        lines: Lines,
        page: ParticipantPage,
        say: Callable[[str], object],
        pitch_mm: float,
        amplifier: ToAmplifier | None = None,
    ):
        """Begin before the run.

        Args:
            lines: Line to the participant's process.
            page: Page of the participant.
            say: Function that shows a line.
            pitch_mm: True size of the panel's pixels [mm].
            amplifier: Amplifier that gets a pulse at each touch; None without one.
        """
        self._amplifier = amplifier
        self._pitch_mm: float | None = pitch_mm
        self._lines, self._page, self._say = lines, page, say
        self._looked_at = self._saw_at = time.monotonic()
        self._sight: Sight | None = None
        self._is_in_room = self._is_pressing = False
        self._agreed_at = -math.inf
        self.result = StimulusResult()
        self.learned: JsonObject | None = None
        """Skill of the participant as last told; None before."""
        self.is_over = False
        """True if the run is over, or the participant has gone."""

    def step(self) -> None:
        """Make the touches that have begun, and look at the page from time to time.

        Raises:
            RigError: The page is lost.
        """
        for line in self._lines.received(patience_s=WAITS_S):
            message = _read(line)
            if isinstance(message, Contact):
                self._touch(message)
            elif isinstance(message, Learned):
                self.learned = message.learned
        self.is_over = self.is_over or not self._lines.is_open
        now = time.monotonic()
        if now - self._looked_at >= LOOKS_EVERY_S and (sight := self._page.look()) is not None:
            self._looked_at = now
            self._see(sight, now)

    def _touch(self, contact: Contact) -> None:
        self._is_pressing = contact.is_down
        if not contact.is_down:
            self._page.release()
            return
        if self._amplifier is not None:
            self._amplifier.pulse()
        self._page.press(contact.x_px, contact.y_px, contact.contact_px)
        self.result.made.append(MadeTouch(contact.t, time.monotonic(), contact.x_px, contact.y_px))

    def _see(self, sight: Sight, now: float) -> None:
        before, self._sight = self._sight, sight
        if sight.picture is not None:
            self._saw_at = now
        elif self._is_in_room and now - self._saw_at > BLIND_S:
            raise RigError(f"The participant's page shows no run any more; its screen is '{sight.screen}'.")
        if before is None or before.screen != sight.screen:
            self._say(f"The page shows '{sight.screen}'.")
        if sight.screen == "welcome" and self._pitch_mm is not None:
            self._page.calibrate(self._pitch_mm)
            self._pitch_mm = None
            self._say("The participant has measured the panel with a card.")
            return
        if sight.agree_px is not None and now - self._agreed_at > AGREES_EVERY_S and not self._is_pressing:
            self._agreed_at = now
            self._page.press(*sight.agree_px, BUTTON_PX)
            self._page.release()
            self._say("The participant agrees that the machine pushes the arm down.")
        self.result.unsent = sight.unsent
        if sight.screen == "end" and not self._is_pressing and not sight.unsent:
            self.result.is_complete = self.is_over = True
        if sight.screen in IN_ROOM and not self._is_in_room:
            self._is_in_room = True
            self._tell(Room(is_there=True))
        if self._is_in_room and sight.picture is not None and (before is None or before[:3] != sight[:3]):
            self._tell(Seen(picture=sight.picture, target_px=sight.target_px))

    def _tell(self, message: ToParticipant) -> None:
        self._lines.send(message.model_dump_json())


def _form(lines: Lines) -> Introduced:
    ends = time.monotonic() + INTRODUCED_S
    while lines.is_open and time.monotonic() < ends:
        for line in lines.received(patience_s=0.1):
            message = _read(line)
            if isinstance(message, Introduced):
                return message
    raise RigError("No participant has introduced itself. Start the session with --stimulus and this port first.")


def _remembered(path: Path) -> JsonObject:
    try:
        return LearnedState.model_validate_json(path.read_text(encoding="utf-8")).model_dump()
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path} holds no skill of a participant. Delete it, or give another --memory.") from error


def _read(line: str) -> ToSession:
    try:
        return TO_SESSION.validate_json(line)
    except ValidationError as error:
        raise RigError(f"The participant's process has sent a message that is none: {line[:80]}") from error
