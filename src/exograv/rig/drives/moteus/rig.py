"""A machine of moteus controllers: our clock asks them once in every period, and tells each a torque."""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from exograv.errors import ConfigError, RigError
from exograv.rig.drives.clock import LOCK_STEP_S
from exograv.rig.drives.driver import Joints, NodesDriver
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.units import Units
from exograv.signals import Command

from .bringing_up import enable_all, refuse_others, set_up
from .bus_load import load
from .cycle import MoteusCycle
from .fdcanusb import Fdcanusb
from .node import MoteusNode

ANSWER_SHARE = 0.55
"""Of a period, that the drives' answers are waited for: questions and answers of four take 0.8 ms of the wire."""

FIRST_ANSWER_S = 0.1
"""That is waited for in any case, before anything moves [s]."""

RAD_PER_TURN = 2.0 * math.pi


class MoteusRig(NodesDriver[MoteusNode]):
    """`read` asks every drive and waits for the answers, `write` sends a torque to each."""

    not_open: ClassVar[str] = "The adapter is not open. Use the machine inside `with rig:`."

    def __init__(self, drives: Drives, answer_share: float = ANSWER_SHARE, lock_step: bool = False):
        """Nothing is opened yet.

        Args:
            drives: Of the machine; with an adapter as their bus.
            answer_share: Of a period, for which `read` waits at most.
            lock_step: Whether time is counted in periods, each as long as it takes: simulated drives only.

        Raises:
            ConfigError: They have another bus, one has the number of all, or their frames do not fit the wire.
        """
        if drives.settings.moteus is None:
            raise ConfigError("drives.toml names no adapter: [moteus] with its path is missing. Add it there.")
        if (most := max(drive.node for drive in drives.each)) > 126:
            raise ConfigError(f"node {most} means all drives at once on this bus. Number them from 1 to 126.")
        if (share := load(drives)) > 1.0:
            raise ConfigError(
                f"{len(drives.each)} drives at period_ms = {drives.settings.period_ms} need {share:.0%} of the CAN "
                "bus: it would fall behind for ever. Set period_ms to the next of 1, 2, 4."
            )
        super().__init__(drives, lock_step)
        self._units, self._path = Units(drives), drives.settings.moteus.path
        self._answer_s = LOCK_STEP_S if lock_step else answer_share * drives.period_s
        self._nodes = tuple(MoteusNode(drive) for drive in drives.each)
        self._link: Fdcanusb | None = None
        self._cycle: MoteusCycle | None = None
        self._is_on = self._was_on = False

    @property
    def counts(self) -> Mapping[str, int]:
        """What was lost, late, limited or too old to be sent; and what the adapter complained of."""
        own = {"limited": self._units.limited, "expired": self._expired, "incomplete": self._incomplete}
        late = {} if self._cycle is None else {"late": self._cycle.late}
        return own | late | ({} if self._link is None else dict(self._link.counts))

    def enable(self) -> None:
        """Switch all motors on, at zero torque; faults that are over are acknowledged by it, and by nothing else.

        Raises:
            RigError: A drive stays off, is missing, or somebody else commands; says which, and why. All brake then.
            ConfigError: One that was away is set to something else now.
        """
        if self._is_on and not self._faulty():
            return
        cycle, self._is_on = self._running, False
        cycle.listen()  # what was said before is not to be held against the drives afterwards
        if lost := [node for node in self._nodes if node.was_lost]:
            self.disable()  # nobody is told anything meanwhile
            self._set_up(lost)
        self._was_on = True
        try:
            enable_all(self._nodes, cycle, self.read, 0.0 if self._lock_step else self.period_s)
        except BaseException:
            self.disable()
            raise
        self._is_on = True

    def disable(self) -> None:
        """Switch all motors off; the drives brake."""
        self._is_on = False
        for node in self._nodes:
            node.is_wanted = False
        if self._was_on:
            for _ in range(3):  # one may be lost; the watchdog is behind all of them
                self._running.tell([node.brake for node in self._nodes])

    @property
    def _running(self) -> MoteusCycle:
        if self._cycle is None:
            raise RigError(self.not_open)
        return self._cycle

    @property
    def _is_open(self) -> bool:
        return self._cycle is not None

    def _open(self) -> None:
        self._link = Fdcanusb(self._path)

    def _begin(self) -> None:
        link = self._link
        assert link is not None
        self._restart()
        self._was_on = False
        self._cycle = MoteusCycle(link, self._nodes)
        refuse_others(self._cycle)
        self._set_up(self._nodes)
        while not self._running.ask(FIRST_ANSWER_S):
            if lost := [node for node in self._nodes if node.is_silent]:
                raise RigError(" ".join(node.status.sentence(node.drive.joint) for node in lost))
        self._state = self._measurement(self.t, self._faulty())

    def _leave(self) -> None:
        self.disable()

    def _close(self) -> None:
        link, self._link, self._cycle = self._link, None, None
        if link is not None:
            link.close()

    def _set_up(self, nodes: Sequence[MoteusNode]) -> None:
        cycle, link = self._cycle, self._link
        if cycle is not None and link is not None:
            set_up(nodes, self._drives, link, cycle.ours[0])

    def _faulty(self) -> tuple[int, ...]:
        return tuple(j for j, node in enumerate(self._nodes) if node.fault or (self._is_on and not node.is_wanted))

    def _ask(self, answer_s: float) -> bool:
        return self._running.ask(answer_s)

    def _is_silent(self) -> bool:
        return all(node.is_silent for node in self._nodes)

    def _measured(self) -> tuple[Joints, Joints, Joints | None]:
        units, nodes = self._units, self._nodes
        q = units.positions(RAD_PER_TURN * np.array([node.said.turns for node in nodes]))
        return q, units.joint_currents(np.array([node.said.current_A for node in nodes])), None

    def _within_limits(self, command: Command) -> Joints:
        return self._units.drive_currents(command)

    def _tell(self, command: Command, currents: Joints, damping: Joints) -> None:
        if self._is_on:
            told = zip(self._nodes, currents.tolist(), damping.tolist(), strict=True)
            self._running.tell([node.torque(current, brakes) for node, current, brakes in told])
