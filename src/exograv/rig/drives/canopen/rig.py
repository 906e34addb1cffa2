"""A machine whose drives speak CiA 402: we give the clock by SYNC, and they measure, obey and watch us."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from types import TracebackType

import numpy as np

from exograv.errors import ConfigError, RigError
from exograv.rig.drive_status import DriveStatus
from exograv.rig.drives.clock import ENDED, LOCK_STEP_S, Clock
from exograv.rig.drives.settings import Drives
from exograv.signals import Command, JointState, TorqueSource

from .bringing_up import enable_all, set_up
from .bus import Bus
from .bus_load import load
from .cycle import CanopenCycle
from .node import CanopenNode
from .objects import MASTER
from .scaling import Scaling
from .states import DISABLE_VOLTAGE, QUICK_STOP

ANSWER_SHARE = 0.55
"""Of a period, that the drives' answers are waited for: on 1 Mbit/s the SYNC and eight frames of four drives take up to
0.97 ms of 2 (docs/canopen.md)."""

WITHOUT_WIRE = ("udp_multicast", "virtual")
"""Adapters that are as fast as this computer."""

BEATS_PER_WATCHDOG = 4
"""Of our heartbeat: three may be lost."""


class CanopenRig:
    """A `Rig` and `Powered`. `read` sends the SYNC and waits for its answers, `write` sends a torque to each drive.

    A joint in `faulty` keeps the last numbers that its drive has said.
    """

    def __init__(self, drives: Drives, answer_s: float | None = None, lock_step: bool = False):
        """Nothing is opened yet.

        Args:
            drives: As the laboratory's `drives.toml` says.
            answer_s: How long `read` waits at most for the drives [s]; `ANSWER_SHARE` of the period where absent.
            lock_step: Whether time is counted in periods, each as long as it takes: simulated drives only.

        Raises:
            RigError: They are on another bus.
            ConfigError: One has our own number, or their frames do not fit the wire.
        """
        if drives.settings.canopen is None:
            raise RigError("These drives are not on a CAN bus: drives.toml has no [canopen].")
        if any(drive.node == MASTER for drive in drives.each):
            raise ConfigError(
                f"Node {MASTER} is our own on the bus: give that drive another number, 1 to {MASTER - 1}."
            )
        if drives.settings.canopen.interface not in WITHOUT_WIRE and (share := load(drives)) > 1.0:
            raise ConfigError(
                f"{len(drives.each)} drives at period_ms = {drives.settings.period_ms} need {share:.0%} of the CAN "
                "bus: it would fall behind for ever. Set period_ms to the next of 1, 2, 4, or use a higher bit rate."
            )
        self._drives, self._settings = drives, drives.settings.canopen
        self._scaling = Scaling(drives)
        self._none = [0] * len(drives.each)
        patience_s = LOCK_STEP_S if lock_step else ANSWER_SHARE * drives.period_s
        self._answer_s, self._lock_step = patience_s if answer_s is None else answer_s, lock_step
        self._patience_s = max(self._answer_s, drives.period_s)
        has_motor = drives.rad_per_motor_count is not None
        self._nodes = tuple(CanopenNode(drive, has_motor, drives.period_s) for drive in drives.each)
        self._bus: Bus | None = None
        self._cycle: CanopenCycle | None = None
        self._clock = Clock(drives.period_s, lock_step)
        self._state: JointState | None = None
        self._counts: Counter[str] = Counter()
        self.notes: tuple[str, ...] = ()
        """What the drives cannot that others can, in sentences."""

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
        """Since this was made, by this computer's monotonic clock [s]."""
        return self._clock.t

    @property
    def counts(self) -> Mapping[str, int]:
        """SYNCs that not every drive answered in time, commands that were too old to be sent, and that were limited."""
        return Counter({**self._counts, "limited": self._scaling.limited})

    def __enter__(self) -> "CanopenRig":
        """Find the drives, check and set them up; none is enabled.

        Raises:
            ConfigError: `drives.toml` says of a drive what is not so, or a package is missing.
            RigError: The bus does not open, a drive is missing or cannot what is needed, or somebody else commands.
        """
        self._bus = Bus(self._settings)
        try:
            self._begin(self._bus)
        except BaseException:
            self._bus.close()
            self._bus = self._cycle = None
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """No torque, all off, and the bus is given back."""
        cycle, bus = self._cycle, self._bus
        if cycle is None or bus is None:
            return
        try:
            self.disable()
            cycle.ask(self._answer_s)
            self.disable()
            cycle.leave()
        finally:
            self._bus = self._cycle = None
            bus.close()

    def read(self) -> JointState:
        """What the drives measured at a SYNC of now: the same as before where not all have answered in time."""
        cycle = self._running
        t = self._clock.tick()
        is_complete = cycle.ask(0.0 if self._clock.nobody_answers else self._answer_s)
        faulty = tuple(j for j, node in enumerate(self._nodes) if node.is_faulty)
        is_complete = is_complete and not all(node.is_lost for node in self._nodes)
        if is_complete or self._state is None:
            self._state = self._measurement(t, faulty)
        elif faulty != self._state.faulty:
            self._state = replace(self._state, faulty=faulty)
        if self._lock_step and not self._clock.nobody_answers and all(node.is_lost for node in self._nodes):
            raise RigError(ENDED)
        self._counts["incomplete"] += not is_complete
        return self._state

    def write(self, command: Command) -> None:
        """Send it, unless its time is over: then the drives are told nothing, and their watchdogs run on.

        Raises:
            RigError: A number is not finite.
        """
        cycle = self._running
        damping = np.zeros(len(self._nodes)) if command.damping is None else command.damping
        current = self._scaling.within_limits(command)
        if self.t > command.valid_until:
            self._counts["expired"] += 1
            return
        braking = self._scaling.damping(damping).tolist()
        self._stop_what_cannot_brake(braking)
        cycle.tell(self._scaling.per_mille(current).tolist(), braking)

    def enable(self) -> None:
        """Switch all motors on, at zero torque; what was held against the drives is forgiven if it is over.

        Raises:
            RigError: A drive stays off, is missing, or somebody else commands; says which, and why. All are off then.
        """
        cycle = self._running
        self.disable()
        cycle.listen()  # what was said before is not to be held against the drives afterwards
        lost = [node for node in self._nodes if node.is_lost or not node.is_configured]
        if lost and self._bus is not None:
            set_up(self._drives, self._bus, cycle, lost, self._patience_s)
        try:
            enable_all(
                self._nodes, self.period_s, lambda: self.t, self.read, lambda: cycle.tell(self._none, self._none)
            )
        except BaseException:
            self.disable()
            raise

    def disable(self) -> None:
        """Switch all motors off; the drives brake."""
        for node in self._nodes:
            node.is_wanted, node.control = False, DISABLE_VOLTAGE
        self._running.tell(self._none, self._none)

    def status(self) -> tuple[DriveStatus, ...]:
        """What each drive said last, in the order of the joints."""
        return tuple(node.status for node in self._nodes)

    def expect_silence(self) -> None:
        """For examiners in lock-step: nobody answers from now on, and time passes all the same."""
        self._clock.nobody_answers = True

    @property
    def _running(self) -> CanopenCycle:
        if self._cycle is None:
            raise RigError("The CAN bus is not open. Use the machine inside `with rig:`.")
        return self._cycle

    def _begin(self, bus: Bus) -> None:
        self._clock, self._state = Clock(self.period_s, self._lock_step), None
        beat_every = max(int(self._drives.watchdog_s / BEATS_PER_WATCHDOG / self.period_s), 1)
        cycle = CanopenCycle(bus, self._nodes, beat_every)
        self.notes = set_up(self._drives, bus, cycle, self._nodes, self._patience_s, first=True)
        self._cycle = cycle
        self._state = self._measurement(self.t, ())

    def _measurement(self, t: float, faulty: tuple[int, ...]) -> JointState:
        nodes, scaling = self._nodes, self._scaling
        q = scaling.positions(np.array([node.counts for node in nodes]))
        q_motor = scaling.motor_positions(np.array([node.motor_counts for node in nodes]))
        current = scaling.current(np.array([node.per_mille for node in nodes]))
        no_sensor = np.full(len(nodes), np.nan)
        return JointState(t, self._clock.ticks, q, current, no_sensor, TorqueSource.CURRENT, q_motor, faulty)

    def _stop_what_cannot_brake(self, braking: list[int]) -> None:
        """A drive that takes no damping brakes by its own quick stop instead, and is off after it."""
        for node, told in zip(self._nodes, braking, strict=True):
            if told and node.is_wanted and not node.has_damping and not node.fault:
                node.control = QUICK_STOP
