"""Life of a driver from opening to closing, and rules that hold on every bus: its clock, deadlines, lost answers."""

from abc import ABC, abstractmethod
from dataclasses import replace
from types import TracebackType
from typing import ClassVar, Generic, Protocol, TypeVar

import numpy as np
from jaxtyping import Float

from exograv.errors import RigError
from exograv.rig.drive_status import DriveStatus
from exograv.signals import Command, JointState, TorqueSource

from .clock import ENDED, Clock
from .settings import Drives

Joints = Float[np.ndarray, " joint"]
AnyDriver = TypeVar("AnyDriver", bound="Driver")


class Driver(ABC):
    """A `Rig` and `Powered`: a machine of drives on a bus."""

    not_open: ClassVar[str] = "The bus is not open. Use the machine inside `with rig:`."
    """For a use outside of `with`."""

    def __init__(self, drives: Drives, lock_step: bool):
        """Nothing is opened yet; in lock-step time is counted in periods, each as long as it takes."""
        self._drives, self._lock_step = drives, lock_step
        self._clock = Clock(drives.period_s, lock_step)
        self._expired = 0

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of every per-joint array."""
        return self._drives.joints

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        return self._drives.period_s

    @property
    def t(self) -> float:
        """The rig's clock: since it was made, by this computer's monotonic clock [s]."""
        return self._clock.t

    def __enter__(self: AnyDriver) -> AnyDriver:
        """Find the drives and hold them against `drives.toml`; nothing is switched on.

        Raises:
            ConfigError: `drives.toml` says of a drive what is not so, or a package is missing.
            RigError: The bus does not open, a drive is missing or cannot what is needed, or somebody else commands.
        """
        self._open()
        try:
            self._begin()
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """No torque, all off, and the bus is given back."""
        if not self._is_open:
            return
        try:
            self._leave()
        finally:
            self._close()

    def write(self, command: Command) -> None:
        """Send it, unless its time is over: then the drives are told nothing, and their watchdogs run on.

        Raises:
            RigError: A number is not finite; nothing is sent.
        """
        if not self._is_open:
            raise RigError(self.not_open)
        currents = self._within_limits(command)
        if self.t > command.valid_until:
            self._expired += 1
            return
        self._tell(command, currents, np.zeros_like(currents) if command.damping is None else command.damping)

    @property
    @abstractmethod
    def _is_open(self) -> bool:
        """True between `_open` and `_close`."""

    @abstractmethod
    def _open(self) -> None:
        """Open the bus; nothing is said."""

    @abstractmethod
    def _begin(self) -> None:
        """Find and check the drives, and take a first measurement."""

    @abstractmethod
    def _leave(self) -> None:
        """Switch all off, before the bus is given back."""

    @abstractmethod
    def _close(self) -> None:
        """Give the bus back."""

    @abstractmethod
    def _within_limits(self, command: Command) -> Joints:
        """Currents of a command, limited to what the drives may give [A]."""

    @abstractmethod
    def _tell(self, command: Command, currents: Joints, damping: Joints) -> None:
        """Send currents [A] and damping [N·m·s/rad] of a command that is still valid."""


class Node(Protocol):
    """One drive of a bus on which each answers for itself."""

    @property
    def status(self) -> DriveStatus:
        """What it said last."""
        ...


AnyNode = TypeVar("AnyNode", bound=Node)


class NodesDriver(Driver, Generic[AnyNode]):
    """A driver of drives that answer one by one. A joint in `faulty` keeps the last numbers that its drive has said."""

    _nodes: tuple[AnyNode, ...]
    _answer_s: float
    """Time for which `read` waits for the drives at most [s]."""

    def __init__(self, drives: Drives, lock_step: bool):
        super().__init__(drives, lock_step)
        self._state: JointState | None = None
        self._incomplete = 0

    def read(self) -> JointState:
        """What the drives measured when they were asked just now: the same as before where not all answered in time."""
        if not self._is_open:
            raise RigError(self.not_open)
        t = self._clock.tick()
        is_complete = self._ask(0.0 if self._clock.nobody_answers else self._answer_s)
        faulty, is_silent = self._faulty(), self._is_silent()
        if self._lock_step and is_silent and not self._clock.nobody_answers:
            raise RigError(ENDED)
        if (is_complete and not is_silent) or self._state is None:
            self._state = self._measurement(t, faulty)
        elif faulty != self._state.faulty:
            self._state = replace(self._state, faulty=faulty)
        self._incomplete += not is_complete
        return self._state

    def status(self) -> tuple[DriveStatus, ...]:
        """What each drive said last, in the order of the joints."""
        return tuple(node.status for node in self._nodes)

    def _restart(self) -> None:
        """Begin a session: time from 0, no measurement yet."""
        self._clock, self._state = Clock(self.period_s, self._lock_step), None

    def _measurement(self, t: float, faulty: tuple[int, ...]) -> JointState:
        q, current, q_motor = self._measured()
        no_sensor = np.full(len(q), np.nan)
        return JointState(t, self._clock.ticks, q, current, no_sensor, TorqueSource.CURRENT, q_motor, faulty)

    @abstractmethod
    def _ask(self, answer_s: float) -> bool:
        """Ask every drive; true if all that are there have answered within so long [s]."""

    @abstractmethod
    def _faulty(self) -> tuple[int, ...]:
        """Joints that are not to be relied on."""

    @abstractmethod
    def _is_silent(self) -> bool:
        """True if no drive is heard."""

    @abstractmethod
    def _measured(self) -> tuple[Joints, Joints, Joints | None]:
        """Joint positions [rad], currents [A] and motor positions [rad] that were said last."""
