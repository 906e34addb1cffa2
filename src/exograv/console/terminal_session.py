"""Session with a person at a terminal: the steps of the operator's page, each after the operator has pressed Enter."""

import sys
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from exograv.errors import RigError
from exograv.loop.keyboard import is_line_typed
from exograv.safety.modes import Mode

from .keys import Role
from .terminal_page import TerminalPage
from .trial import REST_NEEDED_S

Say = Callable[[str], object]

STARTS_WITHIN_S, TAKES_WITHIN_S, LEARNS_WITHIN_S, LEAVES_WITHIN_S = 120.0, 20.0, 300.0, 30.0
"""Longest start of the processes, ramp, identification, and end of the carrying [s]."""

OPENS_WITHIN_S = 90.0
"""Longest wait for the page of a participant whom a stimulus process plays [s]."""

MEASURES_WITHIN_S = 30.0
"""Longest wait for such a participant to measure the panel [s]."""

LISTENS_S = 0.5

ALARM_ENDS_WITHIN_S = 5.0
"""Longest time until the pages show that the alarm of an earlier request is over [s]."""

ASKS_AGAIN_MAX = 4
STARTS_MAX = 3
"""Number of times that the operator is asked to make the machine ready before the session ends."""

LATE_START = "flight.late_start"
"""Code of the alarm that the motors did not switch on in time."""


@dataclass(frozen=True)
class Keyboard:
    """Keyboard of the operator."""

    say: Say
    is_over: threading.Event
    """Set when the session ends, such as by Ctrl-C."""
    is_simulated: bool = False
    """True if a simulated operator presses Enter at once."""

    def enter(self, text: str) -> None:
        """Show what the operator does next, and wait for Enter.

        Raises:
            SessionEndedError: The session ended before.
        """
        self.say(text)
        while not self.is_simulated and not is_line_typed(sys.stdin, LISTENS_S):
            if self.is_over.is_set():
                raise SessionEndedError

    def is_pressed(self) -> bool:
        """Return True if Enter was pressed since the last look."""
        return self.is_simulated or is_line_typed(sys.stdin, 0.0)


class SessionEndedError(Exception):
    """End of the session while the operator was asked."""


@dataclass(frozen=True)
class SessionOutcome:
    """Result of the operator's steps."""

    identified: str
    """Outcome of the identification, or of the check of a known arm."""
    from_file: bool
    """True if the identification began with the participant's file."""
    windows: int
    """Number of complete windows."""
    finished: bool
    """True if the protocol has come to its end."""


class TerminalSession:
    """Steps of one session, from the machine that is off to the machine that is off again."""

    def __init__(
        self,
        page: TerminalPage,
        keyboard: Keyboard,
        resumes: bool,
        awaits_page: bool = False,
        learns_in_rests: bool = False,
    ):
        """Steer with this page.

        Args:
            page: Page of this terminal.
            keyboard: Keyboard of the operator.
            resumes: True to continue an interrupted run.
            awaits_page: True to wait for the participant's page before the motors are on.
            learns_in_rests: True to offer in each long rest that the machine learns the arm.
        """
        self._rests = RestOffers(page, keyboard) if learns_in_rests else None
        self._awaits_page = awaits_page
        self._conditions = dict[str, str]()
        """Condition of each stream of another device as last said, by its name."""
        self._page, self._keyboard, self._resumes, self._say = page, keyboard, resumes, keyboard.say

    def run(self) -> SessionOutcome:
        """Take the arm, run the protocol, and give the arm back.

        Raises:
            RigError: The machine has stopped, or a step was refused.
            SessionEndedError: The operator has ended the session.
        """
        self._await_mode("off", STARTS_WITHIN_S)
        self._say(f"Open on the participant's screen: {self._page.invite(Role.PARTICIPANT)}")
        if self._awaits_page and not self._page.until(lambda: self._page.is_open_for(Role.PARTICIPANT), OPENS_WITHIN_S):
            raise RigError(
                f"No participant's page was opened within {OPENS_WITHIN_S:g} s. Start `exograv dev stimulus` with the "
                "link above and the port of --stimulus."
            )
        self._make_ready(
            "Check that the arm lies in its cuffs, supported and relaxed. Then press Enter: the motors switch on, and "
            "the machine carries itself."
        )
        known = bool(self._page.shown["is_known"])
        identified = self._take_arm(known)
        windows, is_finished = self._run_protocol()
        self._leave()
        return SessionOutcome(identified, known, windows, is_finished)

    def _make_ready(self, text: str) -> None:
        """Make the machine ready; ask again if its motors did not switch on in time, as on a busy computer.

        Raises:
            RigError: As `_await_mode`, or the motors did not switch on several times in a row.
        """
        for _ in range(STARTS_MAX):
            self._keyboard.enter(text)
            self._check()
            self._do("make_ready")
            self._page.until(lambda: not self._late_start(), ALARM_ENDS_WITHIN_S)  # of the request before
            if self._await_mode("exo_only", STARTS_WITHIN_S, fails=self._late_start):
                return
            text = "Press Enter to make it ready again."
        raise RigError(self._late_start())

    def _late_start(self) -> str:
        """Return the sentence of the alarm that the motors did not switch on in time; empty without it."""
        alarms = self._page.shown.get("alarms", ())
        told = (alarm["text"] for alarm in alarms if not alarm["is_over"])
        return next((text["text"] for text in told if text["code"] == LATE_START), "")

    def _take(self, kind: str, what: str) -> None:
        """Take the arm within 30 s of the step before; after that time the operator repeats this step."""
        self._keyboard.enter(
            f"Support the arm with your hand. Press Enter within 30 s: the machine takes the arm{what}."
        )
        while self._page.shown["take_within_s"] is None:
            self._make_ready("The 30 s are over. Press Enter to make the machine ready again, then take the arm.")
            self._keyboard.enter("Press Enter within 30 s: the machine takes the arm.")
        self._do(kind)
        if not self._page.until(lambda: self._page.shown["mode"] != "exo_only", TAKES_WITHIN_S):
            self._check()
            raise RigError(f"The machine did not take the arm within {TAKES_WITHIN_S:g} s.")

    def _take_arm(self, is_known: bool) -> str:
        what = "checks the arm against the participant's file" if is_known else "identifies the arm"
        self._say("Ctrl-C lowers the arm softly at any time; it is no emergency stop.")
        self._take("take_arm" if is_known else "identify", f", moves it and {what}, until it floats")
        while not self._is_taken():
            self._take_again("take_arm" if self._page.shown["is_known"] else "identify")
        learning = self._page.shown["learning"]
        outcome = "" if learning is None else str(learning["outcome"]["text"])
        left_over = [] if learning is None else [f"{value:.2f}" for value in learning["left_over_Nm"]]
        self._say(f"{outcome} Predicted left over: {', '.join(left_over)} N·m.")
        if learning is not None and learning["help"]["text"]:
            farthest = "" if learning["farthest"] is None else f"{learning['farthest']}: "
            self._say(f"{farthest}{learning['help']['text']}")
        for stream in self._page.shown["streams"]:
            self._say(stream_text(stream))
        return outcome

    def _is_taken(self) -> bool:
        """Wait until the arm floats after its motion; it floats shortly before, too. False if it was given back."""
        moves = self._await_mode("moving", TAKES_WITHIN_S, fails=self._given_back)
        return moves and self._await_mode("floating", LEARNS_WITHIN_S, fails=self._given_back)

    def _run_protocol(self) -> tuple[int, bool]:
        """Run the windows; return the number of complete ones, and True if the protocol has come to its end."""
        word = "resume" if self._resumes else "start"
        self._await_screen()
        self._keyboard.enter(f"Press Enter to {word} the protocol. It begins with a rest.")
        self._run(word)
        told = set[tuple[int, int]]()
        while True:
            self._check()
            self._tell_streams()
            if self._rests is not None:
                self._rests.look()
            run = self._run_state()
            for window in run["windows"]:
                key = window["number"], window["attempt"]
                if key not in told and not window["is_open"]:
                    told.add(key)
                    self._tell(window, run)
            if run["status"] in ("finished", "stopped"):
                return sum(window["is_complete"] for window in run["windows"]), run["status"] == "finished"
            if run["status"] == "paused":
                self._resume()
            if self._keyboard.is_over.wait(LISTENS_S):
                raise SessionEndedError

    def _await_screen(self) -> None:
        """Have the participant's screen measured, which is not possible once the protocol runs."""
        if self._resumes or self._is_screen_measured():
            return
        if self._awaits_page and self._page.until(self._is_screen_measured, MEASURES_WITHIN_S):
            return
        self._keyboard.enter(
            "The participant's screen is not measured, so the touches would have no millimetres. Measure it with a "
            "bank card on the participant's page; once the protocol runs that is too late. Press Enter to go on."
        )

    def _is_screen_measured(self) -> bool:
        state = self._page.state
        return state is not None and state["protocol"]["screen"] is not None

    def _resume(self) -> None:
        """Take the arm again if the machine has given it back, then resume the run."""
        while self._page.shown["mode"] != "floating":
            self._await_mode("exo_only", LEAVES_WITHIN_S)
            self._take_again("take_arm")
            self._await_mode("floating", TAKES_WITHIN_S, fails=self._given_back)
        self._keyboard.enter("The protocol is paused. Press Enter to resume it at the next window.")
        self._run("resume")

    def _take_again(self, kind: str) -> None:
        """Make the machine ready again and take the arm, after the machine has given it back by itself."""
        self._make_ready("The machine has given the arm back. Press Enter to make it ready again.")
        self._take(kind, " again")

    def _run(self, word: str) -> None:
        """Give a command to the protocol, and wait until the state shows it: an older state would ask again."""
        before = self._run_state()["status"]
        self._refuse(self._page.run(word))
        self._page.until(lambda: self._run_state()["status"] != before, LEAVES_WITHIN_S)

    def _tell(self, window: dict[str, Any], run: dict[str, Any]) -> None:
        state = "complete" if window["is_complete"] else "not complete, it is repeated"
        rest = "" if run["countdown_s"] is None else f" Next window in {run['countdown_s']:.0f} s."
        self._say(
            f"Window {window['number']} is {state}: {window['accepted']} of {window['touches']} touches count.{rest}"
        )

    def _tell_streams(self) -> None:
        """Say when a stream of another device is lost, silent or back."""
        for stream in self._page.shown["streams"]:
            before = self._conditions.setdefault(stream["name"], stream["condition"])
            if stream["condition"] != before:
                self._conditions[stream["name"]] = stream["condition"]
                self._say(stream_text(stream))

    def _leave(self) -> None:
        self._keyboard.enter("Support the arm with your hand. Press Enter: the machine gives its weight back.")
        self._do("give_back")
        self._await_mode("exo_only", LEAVES_WITHIN_S)
        self._do("switch_off")
        self._await_mode("off", LEAVES_WITHIN_S)

    def _run_state(self) -> dict[str, Any]:
        state = self._page.state
        assert state is not None
        return state["run"]

    def _do(self, kind: str) -> None:
        """Ask for an act; again if the state changed while the operator read, a few times on a busy computer.

        Raises:
            RigError: The act was refused.
        """
        why = self._page.act(kind)
        for _ in range(ASKS_AGAIN_MAX):
            if not why:
                break
            time.sleep(LISTENS_S)
            why = self._page.act(kind)
        self._refuse(why)

    def _refuse(self, why: str) -> None:
        if why:
            raise RigError(f"The session cannot go on: {why}")

    def _given_back(self) -> str:
        """Return the sentence of the mode in which the machine carries itself only; empty in another mode."""
        return str(self._page.shown["mode_text"]["text"]) if self._page.shown["mode"] == "exo_only" else ""

    def _await_mode(self, mode: str, within_s: float, fails: Callable[[], str] = lambda: "") -> bool:
        """Wait for a mode. Return False if it does not come.

        Args:
            mode: The mode.
            within_s: Time-out [s].
            fails: Function that returns the sentence of a cause for which the mode does not come; empty without one.

        Raises:
            RigError: The machine has stopped, or the mode did not come.
            SessionEndedError: The session ended before.
        """
        told = ""
        ends = time.monotonic() + within_s
        while self._page.shown.get("mode") != mode:
            self._check()
            if why := fails():
                self._say(why)
                return False
            text = str(self._page.shown["mode_text"]["text"])
            if text != told:
                self._say(text)
                told = text
            if time.monotonic() > ends:
                wanted = Mode[mode.upper()].value
                raise RigError(f"The machine is not in this mode after {within_s:g} s: {wanted} It says: {told}")
            if self._keyboard.is_over.wait(0.1):
                raise SessionEndedError
        self._say(Mode[mode.upper()].value)
        return True

    def _check(self) -> None:
        """Raise the cause of a stop.

        Raises:
            RigError: The machine has stopped, or the pages have ended.
        """
        page = self._page
        if page.ended:
            raise RigError(page.ended)
        if page.shown.get("latch") is not None:
            raise RigError(f"The machine has let the arm down: {page.shown['latch']['text']}")
        high = [alarm["text"]["text"] for alarm in page.shown.get("alarms", ()) if alarm["priority"] == "high"
                and not alarm["is_over"]]  # fmt: skip
        if not page.steers:
            self._keyboard.enter(
                "This terminal was silent for too long, so that it does not steer any more. Press Enter to steer again."
            )
            self._refuse(page.steer())
            page.until(lambda: page.steers, LISTENS_S)
        if high and page.shown["mode"] in ("off", "starting"):
            raise RigError(" ".join(high))


class RestOffers:
    """Offers to learn the arm in the rests, one in each rest, and what was learned."""

    def __init__(self, page: TerminalPage, keyboard: Keyboard):
        """Begin without an offer."""
        self._page, self._keyboard = page, keyboard
        self._offered: int | None = None
        self._was_active = self._is_open = False

    def look(self) -> None:
        """Offer a rest, request it when Enter is pressed, or say what it has taught. Call it twice a second."""
        state, rests = self._page.state, self._page.shown.get("rests")
        if state is None or rests is None:
            return
        was_active, self._was_active = self._was_active, bool(rests["is_active"])
        if was_active and not rests["is_active"]:
            self._keyboard.say(" ".join(sentence["text"] for sentence in rests["sentences"]))
        window = self._window_after_rest(state["run"])
        if window is None or rests["is_active"] or rests["why_not"]["text"]:
            return
        if self._offered != window:
            self._offered = window
            self._keyboard.say(
                "The rest is long enough to learn the arm. If the arm is relaxed and has room, press Enter within "
                "the rest: the machine moves it for 10 s."
            )
            self._is_open = True
            while not self._keyboard.is_simulated and self._keyboard.is_pressed():
                pass  # lines from before the offer
        elif self._is_open and self._keyboard.is_pressed():
            self._is_open = False
            why = self._page.act("learn_rest")
            self._keyboard.say(why or "The machine learns the arm in this rest.")

    def _window_after_rest(self, run: dict[str, Any]) -> int | None:
        """Return the number of the window after this rest; None without a rest, or if too little of it is left."""
        countdown_s = run["countdown_s"]
        is_rest = run["status"] == "running" and run["phase"] != "window"
        return run["window"] if is_rest and countdown_s is not None and countdown_s >= REST_NEEDED_S else None


def stream_text(stream: Mapping[str, Any]) -> str:
    """Return a line about a recorded stream of another device: condition, rate, gaps and clock."""
    head = f"Stream {stream['name']} ({stream['type']})"
    if stream["condition"] != "recorded":
        return f"{head}: {CONDITION_TEXTS[stream['condition']]}"
    rate, clock_s = stream["rate_Hz"], stream["uncertainty_s"]
    measured = "rate not known yet" if rate is None else f"{rate:.1f} Hz"
    nominal = f" of {stream['nominal_rate_Hz']:g} Hz" if rate is not None and stream["nominal_rate_Hz"] else ""
    clock = "clock not measured yet" if clock_s is None else f"clock known within {1e3 * clock_s:.2f} ms"
    return f"{head}: {measured}{nominal}, {stream['gaps']} gaps, {clock}."


CONDITION_TEXTS = {
    "awaited": "found, not recorded yet.",
    "silent": "it sends nothing. Check its device.",
    "lost": "it is gone. It is recorded again when its program returns.",
}
"""Texts of the conditions of a stream that brings no samples."""
