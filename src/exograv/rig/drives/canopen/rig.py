"""A machine whose drives speak CiA 402: we give the clock by SYNC, and they measure, obey and watch us."""

from collections import Counter
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from exograv.errors import ConfigError, RigError
from exograv.rig.drives.clock import LOCK_STEP_S
from exograv.rig.drives.driver import Joints, NodesDriver
from exograv.rig.drives.settings import Drives
from exograv.signals import Command

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


class CanopenRig(NodesDriver[CanopenNode]):
    """`read` sends the SYNC and waits for its answers, `write` sends a torque to each drive."""

    not_open: ClassVar[str] = "The CAN bus is not open. Use the machine inside `with rig:`."

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
        super().__init__(drives, lock_step)
        self._settings = drives.settings.canopen
        self._scaling = Scaling(drives)
        self._none = [0] * len(drives.each)
        patience_s = LOCK_STEP_S if lock_step else ANSWER_SHARE * drives.period_s
        self._answer_s = patience_s if answer_s is None else answer_s
        self._patience_s = max(self._answer_s, drives.period_s)
        has_motor = drives.rad_per_motor_count is not None
        self._nodes = tuple(CanopenNode(drive, has_motor, drives.period_s) for drive in drives.each)
        self._bus: Bus | None = None
        self._cycle: CanopenCycle | None = None
        self.notes: tuple[str, ...] = ()
        """What the drives cannot that others can, in sentences."""

    @property
    def counts(self) -> Mapping[str, int]:
        """SYNCs that not every drive answered in time, commands that were too old to be sent, and that were limited."""
        own = {"incomplete": self._incomplete, "expired": self._expired, "limited": self._scaling.limited}
        return Counter(own)

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

    def expect_silence(self) -> None:
        """For examiners in lock-step: nobody answers from now on, and time passes all the same."""
        self._clock.nobody_answers = True

    @property
    def _running(self) -> CanopenCycle:
        if self._cycle is None:
            raise RigError(self.not_open)
        return self._cycle

    @property
    def _is_open(self) -> bool:
        return self._cycle is not None

    def _open(self) -> None:
        self._bus = Bus(self._settings)

    def _begin(self) -> None:
        bus = self._bus
        assert bus is not None
        self._restart()
        beat_every = max(int(self._drives.watchdog_s / BEATS_PER_WATCHDOG / self.period_s), 1)
        cycle = CanopenCycle(bus, self._nodes, beat_every)
        self.notes = set_up(self._drives, bus, cycle, self._nodes, self._patience_s, first=True)
        self._cycle = cycle
        self._state = self._measurement(self.t, ())

    def _leave(self) -> None:
        cycle = self._running
        self.disable()
        cycle.ask(self._answer_s)
        self.disable()
        cycle.leave()

    def _close(self) -> None:
        bus, self._bus, self._cycle = self._bus, None, None
        if bus is not None:
            bus.close()

    def _ask(self, answer_s: float) -> bool:
        return self._running.ask(answer_s) and not self._is_silent()

    def _faulty(self) -> tuple[int, ...]:
        return tuple(j for j, node in enumerate(self._nodes) if node.is_faulty)

    def _is_silent(self) -> bool:
        return all(node.is_lost for node in self._nodes)

    def _measured(self) -> tuple[Joints, Joints, Joints | None]:
        nodes, scaling = self._nodes, self._scaling
        q = scaling.positions(np.array([node.counts for node in nodes]))
        q_motor = scaling.motor_positions(np.array([node.motor_counts for node in nodes]))
        return q, scaling.current(np.array([node.per_mille for node in nodes])), q_motor

    def _within_limits(self, command: Command) -> Joints:
        return self._scaling.within_limits(command)

    def _tell(self, command: Command, currents: Joints, damping: Joints) -> None:
        braking = self._scaling.damping(damping).tolist()
        self._stop_what_cannot_brake(braking)
        self._running.tell(self._scaling.per_mille(currents).tolist(), braking)

    def _stop_what_cannot_brake(self, braking: list[int]) -> None:
        """A drive that takes no damping brakes by its own quick stop instead, and is off after it."""
        for node, told in zip(self._nodes, braking, strict=True):
            if told and node.is_wanted and not node.has_damping and not node.fault:
                node.control = QUICK_STOP
