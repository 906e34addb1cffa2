"""World of a live loop that follows a script: clock, drives and control.

No time passes but by sleep and by waiting for a packet, so that loops in Python and in C see the same times.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import pytest

from exograv.live.native_buses import NativeBus
from exograv.rig.drives.canopen.rig import CanopenRig
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.udp.host import UdpRig

JOINTS = 4

ANSWER, LOST, LATE, CORRUPT, TWICE, NOT_A_NUMBER, ABSENT, FAULT, OFF, NO_MOTOR = range(10)
"""Behaviour of the drives at one poll."""
SPEAK, SILENT, DAWDLE, NAN, HUGE, WRONG_NUMBER, WRONG_MODE, OPEN_LOOPS, DEAD, OTHER_MODE = range(10)
"""Behaviour of control in one tick."""


TIMED = (
    "exograv.rig.drives.clock", "exograv.rig.drives.driver", "exograv.rig.drives.udp.host",
    "exograv.rig.drives.udp.link", "exograv.rig.drives.cycle", "exograv.rig.drives.nodes_driver",
    "exograv.rig.drives.canopen.bus", "exograv.live.guard_process", "exograv.runtime.control_loop.guard_commands",
)  # fmt: skip
"""Modules of the Python loop that read the clock or sleep."""


@dataclass
class Script:
    """Course of a run, by tick."""

    drives: np.ndarray
    control: np.ndarray
    overslept_ns: np.ndarray
    """Lateness of the tick [ns]."""
    q: np.ndarray
    tau: np.ndarray


def calm(ticks: int, seed: int = 0) -> Script:
    """Return a course without any fault: a slow motion, and torques that the guard allows."""
    rng, t = np.random.default_rng(seed), 1e-3 * np.arange(ticks)[:, None]
    rate = rng.uniform(0.5, 2.0, JOINTS)
    q = 0.3 * np.sin(rate * t) + 1e-5 * rng.standard_normal((ticks, JOINTS))
    tau = 2.0 * np.sin(rate * t + rng.uniform(0.0, 6.0, JOINTS)) * np.minimum(5.0 * t, 1.0)
    nothing = np.zeros(ticks, dtype=int)
    return Script(nothing, nothing.copy(), rng.integers(0, 200_000, ticks), q, tau)


def wild(ticks: int, seed: int, share: float) -> Script:
    """Return a course in which drives or control misbehave in some ticks."""
    script, rng = calm(ticks, seed), np.random.default_rng([seed, 1])
    script.drives = np.where(rng.random(ticks) < share, rng.integers(1, 10, ticks), ANSWER)
    script.drives[0] = ANSWER  # a machine that never answered does not open
    script.control = np.where(rng.random(ticks) < share, rng.integers(1, 10, ticks), SPEAK)
    script.overslept_ns = np.where(rng.random(ticks) < 0.3 * share, 4_000_000, script.overslept_ns)
    return script


@dataclass
class World(ABC):
    """Clock, bus, drives and control of one loop."""

    script: Script
    now: int = 5_000_000_000
    tick: int = 0
    sent: list[Any] = field(default_factory=list)
    arrivals: list[tuple[int, Any]] = field(default_factory=list)
    currents: np.ndarray = field(default_factory=lambda: np.zeros(JOINTS))
    control_looks: Callable[[], None] = lambda: None
    """Function that lets control look for a new state; of `Side`."""

    example: ClassVar[str]
    """File of these drives in `examples/drives`."""
    bus: ClassVar[NativeBus]

    def monotonic_ns(self) -> int:
        return self.now

    def monotonic(self) -> float:
        return self.now / 1e9

    def sleep(self, seconds: float) -> None:
        self.sleep_until(self.now + round(1e9 * seconds))

    def sleep_until(self, until_ns: int) -> None:
        self.now = max(self.now, until_ns)
        self.control_looks()

    def arriving(self, until_ns: int) -> Any:
        """Return the next packet or frame that arrives before `until_ns`; otherwise time passes until then."""
        if self.arrivals and self.arrivals[0][0] <= max(until_ns, self.now):
            at, data = self.arrivals.pop(0)
            self.now = max(self.now, at)
            return data
        self.now = max(self.now, until_ns)
        return None

    @abstractmethod
    def machine(self, drives: Drives) -> UdpRig | CanopenRig:
        """Return the machine of these drives, switched on."""

    def use(self, patch: pytest.MonkeyPatch) -> None:
        """Let the loop in Python live in this world."""
        for module in TIMED:
            patch.setattr(f"{module}.time", self)

    @abstractmethod
    def sent_by_c(self, data: bytes) -> int:
        """Take what the loop in C sends."""

    @abstractmethod
    def received_by_c(self, until_ns: int) -> bytes | None:
        """Return what the loop in C receives."""
