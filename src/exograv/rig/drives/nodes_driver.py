"""Driver of a bus whose drives are asked, answer and are commanded separately, such as CAN."""

import time
from abc import abstractmethod
from collections import Counter
from collections.abc import Sequence
from typing import Any, ClassVar, Generic, TypeVar

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault
from exograv.signals import Command

from .clock import Clock
from .cycle import Cycle
from .driver import ENABLE_S, Asked, Driver
from .node import AskedNode
from .settings import Drives

START_S = 0.3
"""Time-out for the first answer of each drive after it has been set up [s]."""

AnyNode = TypeVar("AnyNode", bound=AskedNode)
AnyLink = TypeVar("AnyLink")


class NodesDriver(Driver[AnyNode], Generic[AnyNode, AnyLink]):
    """Driver whose `read` asks every drive and waits for the answers, and whose `write` sends a torque to each."""

    first_answer_s: ClassVar[float] = 0.004
    """Least time to wait for an answer before anything moves: the longest period [s]."""

    no_answer: ClassVar[str] = ""
    """Hint for a drive that answers questions but sends no measurement."""

    def __init__(self, drives: Drives, nodes: Sequence[AnyNode], answer_s: float | None, lock_step: bool):
        super().__init__(drives, nodes, answer_s, lock_step)
        self._link: AnyLink | None = None
        self._cycle: Cycle[Any, AnyNode] | None = None

    def disable(self) -> None:
        """Switch all motors off; the drives brake."""
        self._is_on = False
        for node in self._nodes:
            node.switch_off()
        self._running.tell([node.order(0.0, 0.0) for node in self._nodes])

    @abstractmethod
    def _opened(self) -> AnyLink:
        """Open the adapter and return it."""

    @abstractmethod
    def _cycle_on(self, link: AnyLink) -> Cycle[Any, AnyNode]:
        """Frames of this machine on the open adapter."""

    @abstractmethod
    def _configure(self, nodes: Sequence[AnyNode], link: AnyLink) -> None:
        """Check and set up these drives; none is switched on.

        Raises:
            RigError: A drive does not answer, or lacks a function.
            ConfigError: A drive differs from `drives.toml`.
        """

    @property
    def _running(self) -> Cycle[Any, AnyNode]:
        if self._cycle is None:
            raise RigError(self.not_open)
        return self._cycle

    @property
    def _is_open(self) -> bool:
        return self._cycle is not None

    def _open(self) -> None:
        self._link = self._opened()

    def _begin(self) -> None:
        assert self._link is not None
        self._clock, self._is_on = Clock(self.period_s, self._lock_step), False
        self._cycle = self._cycle_on(self._link)
        self._cycle.refuse_others()
        self._set_up(self._nodes)
        self._state = self._measurement(Asked(self.t, self._clock.ticks), self._faulty())

    def _close(self) -> None:
        link: Any = self._link
        self._link = self._cycle = None
        if link is not None:
            link.close()

    def _link_counts(self) -> Counter[str]:
        link: Any = self._link
        return Counter() if link is None else link.counts

    def _ask(self, now: Asked, answer_s: float) -> Asked | None:
        return now if self._running.ask(answer_s) else None

    def _tell(self, command: Command, currents: list[float], damping: list[float]) -> None:
        told = zip(self._nodes, currents, damping, strict=True)
        self._running.tell([node.order(current, brakes) for node, current, brakes in told])

    def _refresh(self) -> None:
        self._running.listen()  # older frames must not count as faults after enabling
        if lost := [node for node in self._nodes if node.was_lost]:
            self.disable()  # the drives receive no commands during the set-up
            self._set_up(lost)

    def _switch_on(self) -> None:
        nodes, cycle = self._nodes, self._running
        for node in nodes:
            node.begin_enabling()
        try:
            self._each_period(
                self.t + ENABLE_S,
                lambda: (
                    any(node.has_failed for node in nodes) or all(node.is_on and node.has_answered for node in nodes)
                ),
                lambda: cycle.tell([node.enabling_order() for node in nodes]),
            )
        finally:
            for node in nodes:
                node.end_enabling()
        self._refuse_off()

    def _why_off(self, node: AnyNode) -> str:
        if node.fault or node.own_fault:
            return super()._why_off(node)
        return (
            f"The drive of {node.drive.joint} (node {node.drive.node}) stays {node.stage}: read its own display, or "
            "use its maker's tool."
        )

    def _set_up(self, nodes: Sequence[AnyNode]) -> None:
        assert self._link is not None
        self._configure(nodes, self._link)
        self._await_answers(nodes)

    def _await_answers(self, nodes: Sequence[AnyNode]) -> None:
        """Wait until each drive that has been set up answers; none is switched on."""
        until = time.monotonic() + START_S
        while time.monotonic() < until:
            for node in nodes:
                node.start()
            self._running.ask(max(self._answer_s, self.first_answer_s))
            if all(node.has_answered and not node.was_lost for node in nodes):
                return
        if any(DriveFault.OTHER_MASTER in node.fault for node in nodes):
            raise RigError("Another host commands on this bus. End that program first.")
        names = ", ".join(f"{node.drive.joint} (node {node.drive.node})" for node in nodes if not node.has_answered)
        raise RigError(f"{names} sends no measurement after its start, but answers questions. {self.no_answer}")
