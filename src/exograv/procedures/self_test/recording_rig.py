"""Rig that records all ticks, and can hold commands back like a dead computer."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType

import numpy as np
from jaxtyping import Float

from exograv.rig import Rig
from exograv.rig.drive_status import DriveStatus
from exograv.rig.drives.opening import DrivenRig
from exograv.signals import Command, JointState

Rows = Float[np.ndarray, "tick joint"]


@dataclass(frozen=True)
class RecordedTicks:
    """Recorded ticks of a run."""

    t: Float[np.ndarray, " tick"]
    """Time of the command on the rig's clock [s]."""

    age: Float[np.ndarray, " tick"]
    """Age of the measurement when it was read [s]."""

    sequence: Float[np.ndarray, " tick"]
    q: Rows
    """Joint position [rad]."""

    q_motor: Rows | None
    """Joint position by the motor's encoder [rad]."""

    current: Rows
    """Measured motor current [A]."""

    tau_commanded: Rows
    """Commanded torque [N·m]."""


class RecordingRig:
    """Rig that wraps another rig and records its ticks."""

    def __init__(self, rig: Rig):
        self._rig = rig
        self._rows: list[tuple[Command, JointState]] = []
        self._state: JointState | None = None
        self._last: Command | None = None
        self.is_silent = False
        """True while the machine gets only the last command, again and again, until it expires."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints of the machine."""
        return self._rig.joints

    @property
    def period_s(self) -> float:
        """Period of the machine [s]."""
        return self._rig.period_s

    @property
    def t(self) -> float:
        """Time on the machine's clock [s]."""
        return self._rig.t

    @property
    def ticks(self) -> int:
        """Number of recorded ticks."""
        return len(self._rows)

    def read(self) -> JointState:
        """Read the joint state of the machine."""
        self._state = self._rig.read()
        return self._state

    def write(self, command: Command) -> None:
        """Record a command, and pass it on unless the rig is silent."""
        if not self.is_silent or self._last is None:
            self._last = command
        if self._state is not None:
            self._rows.append((command, self._state))
        self._rig.write(self._last)

    def passed(self, start: int, end: int | None = None) -> RecordedTicks:
        """Return the ticks from `start` on, up to `end`."""
        rows = self._rows[start:end]
        commands, states = [command for command, _ in rows], [state for _, state in rows]
        motors = [state.q_motor for state in states if state.q_motor is not None]
        t = np.array([command.t for command in commands])
        return RecordedTicks(
            t=t,
            age=t - np.array([state.t for state in states]),
            sequence=np.array([float(state.sequence) for state in states]),
            q=_stacked([state.q for state in states]),
            q_motor=_stacked(motors) if len(motors) == len(states) else None,
            current=_stacked([state.current for state in states]),
            tau_commanded=_stacked([command.tau for command in commands]),
        )

    def __enter__(self) -> "RecordingRig":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Do nothing: the owner of the machine closes it."""


class PoweredRecordingRig(RecordingRig):
    """Recording rig of a machine whose drives must be switched on."""

    def __init__(self, rig: DrivenRig):
        super().__init__(rig)
        self._powered = rig

    def enable(self) -> None:
        """Switch the drives on."""
        self._powered.enable()

    def disable(self) -> None:
        """Switch the drives off."""
        self._powered.disable()

    def status(self) -> tuple[DriveStatus, ...]:
        """Return the status of each drive."""
        return self._powered.status()


def _stacked(rows: Sequence[np.ndarray]) -> Rows:
    return np.array(rows, dtype=float)
