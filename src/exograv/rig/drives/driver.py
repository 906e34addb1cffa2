"""Life cycle of a driver on any bus: opening, clock, measurements, commands, enabling.

Another bus needs, with `moteus` as the shortest example (`udp` for one controller of all drives):

1. a `Settings` class, its name in `BUSES` and its field in `DrivesSettings` (`settings.py`);
2. a `FrameLink`, a `Cycle` (`cycle.py`) and an `AskedNode` (`node.py`);
3. a `NodesDriver` or `Driver`, whose `_configure` compares each drive with `drives.toml` before any motor is on;
4. the load of the bus in `bus_load.py`, and the name of the class in `DRIVERS` (`opening.py`);
5. `SimulatedDevices`, its name in `SIMULATED` (`simulated/opening.py`), and a row in `BUSES` of
   `tests/rig/drives/conftest.py`;
6. for the loop in C, its cycle in `native/` (`rig.drives.native` has the rest), and a row in `live/native_buses.py`.
"""

import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import ClassVar, Generic, NamedTuple, TypeVar

import numpy as np
from jaxtyping import Float

from exograv.errors import RigError
from exograv.rig.drive_status import DriveStatus
from exograv.signals import Command, JointState, TorqueSource

from .clock import ENDED, LOCK_STEP_S, Clock, DrivesEndedError
from .node import Node
from .settings import Drives
from .units import Units

ENABLE_S = 1.0
"""Time-out for switching all drives on [s]."""

Joints = Float[np.ndarray, " joint"]
AnyDriver = TypeVar("AnyDriver", bound="Driver")
AnyNode = TypeVar("AnyNode", bound=Node)


class Asked(NamedTuple):
    """Question that was answered."""

    t: float
    """Time of the question on the rig's clock [s]."""

    tick: int


class Driver(ABC, Generic[AnyNode]):
    """Machine of drives on a bus: a `Rig` and `Powered`. Each bus implements the abstract methods."""

    answer_share: ClassVar[float] = 0.55
    """Share of a period for which `read` waits for the drives."""

    not_open: ClassVar[str] = "The bus is not open. Use the machine inside `with rig:`."
    """Error message for use outside of `with`."""

    def __init__(self, drives: Drives, nodes: Sequence[AnyNode], answer_s: float | None, lock_step: bool):
        """Open nothing yet.

        Args:
            drives: Drives of the machine.
            nodes: Drives of the joints, in the order of the joints.
            answer_s: Longest time for which `read` waits for the drives [s]; `answer_share` of the period if absent.
            lock_step: True if simulated drives run in lock-step with this driver, and time is counted in periods.
        """
        self._drives, self._nodes, self._lock_step = drives, tuple(nodes), lock_step
        self._units, self._clock = Units(drives), Clock(drives.period_s, lock_step)
        patience_s = LOCK_STEP_S if lock_step else self.answer_share * drives.period_s
        self._answer_s = patience_s if answer_s is None else answer_s
        self._none, self._is_on = np.full(len(self._nodes), np.nan), False
        self._none.flags.writeable = False
        self._state = JointState(0.0, -1, self._none, self._none, self._none, TorqueSource.CURRENT)
        self._has_motor = drives.rad_per_motor_count is not None
        self._incomplete = self._expired = 0
        self._has_ended = False

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of every per-joint array."""
        return self._drives.joints

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        return self._drives.period_s

    @property
    def is_in_lock_step(self) -> bool:
        """True if time is counted in periods: simulated drives wait for this driver."""
        return self._lock_step

    @property
    def t(self) -> float:
        """Time since the rig was made, by this computer's monotonic clock [s]."""
        return self._clock.t

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of incomplete measurements, of commands that were limited or expired, and of failures of the link."""
        own = {"limited": self._units.limited, "expired": self._expired, "incomplete": self._incomplete}
        return Counter(own | self._link_counts())

    def __enter__(self: AnyDriver) -> AnyDriver:
        """Find the drives and check them against `drives.toml`; no drive is switched on.

        Raises:
            ConfigError: A drive differs from `drives.toml`, or a package is missing.
            RigError: The bus does not open, a drive is missing or lacks a function, or another host commands.
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
        """Switch all drives off without torque, and close the bus."""
        if not self._is_open:
            return
        try:
            self._leave()
        finally:
            self._close()

    def read(self) -> JointState:
        """Ask the drives and return their measurement; the previous one if not all answer in time.

        A joint in `faulty` keeps the last values of its drive.

        Raises:
            RigError: The bus is not open.
            DrivesEndedError: Simulated drives in lock-step do not answer.
        """
        if not self._is_open:
            raise RigError(self.not_open)
        now = Asked(self._clock.tick(), self._clock.ticks)
        asked = self._ask(now, 0.0 if self._clock.nobody_answers or self._has_ended else self._answer_s)
        is_silent = all(node.is_silent for node in self._nodes)
        if is_silent and self._lock_step and not self._clock.nobody_answers:
            self._has_ended = True  # A caller that reads again must not wait again.
            raise DrivesEndedError(ENDED)
        faulty = self._faulty()
        if asked is not None and not is_silent:
            self._state = self._measurement(asked, faulty)
        else:
            self._incomplete += 1
            if faulty != self._state.faulty:
                self._state = self._state._replace(faulty=faulty)
        return self._state

    def write(self, command: Command) -> None:
        """Send the command, unless it has expired. Then nothing is sent, and the drives' watchdogs keep running.

        Raises:
            RigError: A number is not finite; nothing is sent.
        """
        if not self._is_open:
            raise RigError(self.not_open)
        currents = self._units.drive_currents(command).tolist()
        if self.t > command.valid_until:
            self._expired += 1
            return
        self._tell(command, currents, [0.0] * len(currents) if command.damping is None else command.damping.tolist())

    def enable(self) -> None:
        """Switch all motors on at zero torque. Only this call acknowledges faults whose cause is gone.

        Raises:
            RigError: A drive stays off or is missing, or another host commands. The message names the drive and the
                reason. All drives brake then.
            ConfigError: A drive that was away now has other settings.
        """
        if self._is_on and not self._faulty():
            return
        self._is_on = False
        self._refresh()
        try:
            self._switch_on()
        except BaseException:
            self.disable()
            raise
        self._is_on = True

    @abstractmethod
    def disable(self) -> None:
        """Switch all motors off; the drives brake."""

    def status(self) -> tuple[DriveStatus, ...]:
        """Return the newest status of each drive, in the order of the joints."""
        return tuple(node.status for node in self._nodes)

    def begin_at(self, t: float) -> None:
        """Start the clock of a machine in lock-step at `t` [s], before it is opened.

        Raises:
            RigError: The machine runs on this computer's clock.
        """
        if not self._lock_step:
            raise RigError("The clock of a machine in real time begins at 0. Only lock-step can begin later.")
        self._clock.ticks = round(t / self.period_s)

    def expect_silence(self) -> None:
        """Expect no answers from now on while time passes. Only for examiners in lock-step."""
        self._clock.nobody_answers = True

    @property
    @abstractmethod
    def _is_open(self) -> bool:
        """True between `_open` and `_close`."""

    @abstractmethod
    def _open(self) -> None:
        """Open the bus; nothing is sent."""

    @abstractmethod
    def _begin(self) -> None:
        """Find and check the drives, and take a first measurement."""

    def _leave(self) -> None:
        """Switch all drives off before the bus is closed."""
        self.disable()

    @abstractmethod
    def _close(self) -> None:
        """Close the connection to the bus."""

    @abstractmethod
    def _link_counts(self) -> Counter[str]:
        """Return the number of failures of the link, by reason."""

    @abstractmethod
    def _ask(self, now: Asked, answer_s: float) -> Asked | None:
        """Ask the drives and wait for at most `answer_s` [s]; return the newest answered question, or None."""

    @abstractmethod
    def _tell(self, command: Command, currents: list[float], damping: list[float]) -> None:
        """Send currents in the drives' directions [A] and damping [N·m·s/rad] of a command that is still valid."""

    @abstractmethod
    def _refresh(self) -> None:
        """Process the frames that have arrived, and find lost drives again, before all are switched on."""

    @abstractmethod
    def _switch_on(self) -> None:
        """Switch every drive to torque mode, at zero torque.

        Raises:
            RigError: A drive stays off.
        """

    def _why_off(self, node: AnyNode) -> str:
        """Sentence with the reason why a drive is not on."""
        return node.status.sentence(node.drive.joint)

    def _refuse_off(self) -> None:
        if off := [node for node in self._nodes if node.fault or not node.is_on]:
            raise RigError(
                f"The motors are not switched on. {' '.join(map(self._why_off, off))} Correct this at the machine, "
                "then enable again."
            )

    def _each_period(self, ends: float, is_over: Callable[[], bool], tell: Callable[[], None]) -> None:
        """Call `read` and `tell` once per period until `is_over`, or until the rig's clock reaches `ends` [s]."""
        due = time.monotonic()
        while self.t < ends:
            self.read()
            if is_over():
                return
            tell()
            if not self._lock_step:
                due = max(due + self.period_s, time.monotonic() - self.period_s)
                time.sleep(max(due - time.monotonic(), 0.0))

    def _faulty(self) -> tuple[int, ...]:
        """Joints whose measurements or drives are not reliable."""
        is_on, each = self._is_on, enumerate(self._nodes)
        return tuple([j for j, node in each if node.fault or node.own_fault or (is_on and not node.is_wanted)])

    def _measurement(self, asked: Asked, faulty: tuple[int, ...]) -> JointState:
        units, nodes = self._units, self._nodes
        q = units.positions(np.array([node.position for node in nodes]))
        current = units.joint_currents(np.array([node.current for node in nodes]))
        q_motor = None
        if self._has_motor:
            q_motor = units.motor_positions(np.array([node.motor_position for node in nodes]))
        return JointState(*asked, q, current, self._none, TorqueSource.CURRENT, q_motor, faulty)
