"""Parent's side of the bridge: starts it, takes its requests, and goes on without it when it dies."""

import contextlib
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from exograv.errors import ConfigError, RigError
from exograv.runtime.control_loop.exchange import FeltLevel
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.processes.supervisor import Supervisor
from exograv.runtime.recorder.recorder import Recorder

from .bridge import OVER, BridgeJob, bridge_process
from .levels import Levels
from .library import require_zenoh

READY_MAX_S = 60.0
"""Time for a fresh interpreter on a slow computer, and for Zenoh's search of half a second [s]."""

HANGS_S, END_S = 5.0, 2.0
"""Time without a sign of life after which the bridge hangs; and time for it to end at the end of the run [s]."""

DOMAIN_MAX = 232
"""Largest domain of ROS 2: the ports of higher ones would exceed 65535. Source: docs.ros.org, The ROS_DOMAIN_ID."""


def domain() -> int:
    """Return the domain in ROS_DOMAIN_ID; 0 if it is not set.

    Raises:
        ConfigError: ROS_DOMAIN_ID is not a domain.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if not text.isdecimal() or int(text) > DOMAIN_MAX:
        raise ConfigError(f"ROS_DOMAIN_ID is '{text}'; allowed: 0 to {DOMAIN_MAX}. Correct it, or unset it.")
    return int(text)


@dataclass(frozen=True)
class Ros2:
    """Settings of the bridge."""

    router: str = "tcp/localhost:7447"
    """Locator of Zenoh's router."""

    accepts_level: bool = False
    """True if a gravity level may be requested over ROS 2."""

    domain: int = field(default_factory=domain)

    def __post_init__(self):
        require_zenoh()  # checked before minutes of preparation


@dataclass(frozen=True)
class AcceptedLevel:
    """Gravity level that was requested over ROS 2 and passed on."""

    t: float
    gravity_level: float


@dataclass(frozen=True)
class Ros2Figures:
    """Figures of the ROS 2 bridge: published messages, accepted and refused gravity levels."""

    joint_states: int | None
    """Number of joint-state messages that were published."""

    levels: list[AcceptedLevel]
    refused: dict[str, int]
    """Number of refused levels, by reason."""

    ended: str
    """Reason why the bridge ended before the run; empty if it did not."""


class Bridging:
    """Bridge of a run, from before its start to its end; one that was not begun does nothing."""

    def __init__(self, wanted: Ros2, joints: tuple[str, ...]):
        """Prepare a bridge; no process starts yet."""
        self._wanted, self._joints, self.levels = wanted, joints, Levels(wanted.accepts_level)
        self._child: Supervisor[BridgeJob] | None = None
        self._published: int | None = None
        self._ended = ""
        self._heard_s = self._checked_s = 0.0

    @property
    def pid(self) -> int:
        """Process identifier of the bridge."""
        return 0 if self._child is None else self._child.pid

    def begin(self, recorder: Recorder, states: Mailbox, tell: Callable[[FeltLevel], object]) -> None:
        """Start the bridge, and wait until it has joined the graph; before anything moves.

        Args:
            recorder: Recorder whose ticks the bridge reads, and that records the requests.
            states: Mailbox of the guard's states for control.
            tell: Function that sends a message to the guard.

        Raises:
            ConfigError: Zenoh does not start.
            RigError: The bridge has died, or takes too long.
        """
        self._states, self._tell, self._record = states, tell, recorder.write
        job = BridgeJob(recorder.inlet, self._joints, self._wanted.router, self._wanted.domain)
        self._child = Supervisor("ros2", bridge_process, job)
        word = self._child.next_word(READY_MAX_S)
        if isinstance(word, ConfigError):
            raise word
        if word is None:
            raise RigError("The bridge to ROS 2 did not start. Correct the reason in its output above, or omit --ros2.")

    def check(self) -> None:
        """Pass on new messages, several times per second. If the bridge dies or hangs, the run goes on without it."""
        if self._child is None or self._ended:
            return
        newest = self._states.read()
        if newest is not None:
            self.levels.look(int(newest[1]["safe_state"]))
        for word in self._child.heard():
            self._heard_s = time.monotonic()
            if type(word) is int:
                self._published = word
            elif isinstance(word, float):
                self._child.send(self._answer(word, 0.0 if newest is None else float(newest[1]["now"])))
        if self._child.has_hung_up:
            status = self._child.exit_status
            self._ended = f"The bridge to ROS 2 has ended (exit status {status}), and the run went on without it."
        elif self._hangs():
            self._child.kill()
            self._ended = (
                f"The bridge to ROS 2 was silent for {HANGS_S:g} s and was ended, and the run went on without it."
            )

    def _hangs(self) -> bool:
        now = time.monotonic()
        if not self._heard_s or now - self._checked_s > 0.5 * HANGS_S:
            self._heard_s = now  # the first look, or this process stood still, not the bridge
        self._checked_s = now
        return now - self._heard_s > HANGS_S

    def figures(self) -> Ros2Figures:
        """Return the numbers of published messages and of accepted and refused levels."""
        levels = [AcceptedLevel(round(t, 3), level) for t, level in self.levels.accepted]
        return Ros2Figures(self._published, levels, dict(self.levels.refused), self._ended)

    def close(self) -> None:
        """End the bridge process."""
        if self._child is None:
            return
        self._child.send(None)
        until, word = time.monotonic() + END_S, None
        while word != OVER and (left_s := until - time.monotonic()) > 0.0 and not self._child.has_hung_up:
            if type(word := self._child.next_word(left_s)) is int:
                self._published = word
        if word != OVER and not self._ended:
            self._ended = "The bridge to ROS 2 did not answer at the end of the run, and was ended."
        self._child.end(1.0)
        self._child = None

    def _answer(self, level: float, now: float) -> str:
        why = self.levels.ask(level, now)
        if why:
            return f"{level:g} is refused: {why}."
        self._record("/control", now, {"act": "level", "gravity_level": level})
        with contextlib.suppress(OSError):  # the guard has died, which its parent notices by itself
            self._tell(FeltLevel(level))
        return f"{level:g} of the arm's weight is asked for; the guard decides."
