"""Simulated drives of a machine at their bus: their clock, cables and reported faults. Each bus adds its own frames."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TypeVar

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives

from .plant import Plant

STALL_S = 0.005
"""A pause of this process from which on its clock is set anew: real drives do not pause, so their time stands still."""

LISTEN_S = 0.01
"""Between two checks whether to stop, in lock-step."""

AT_ONCE = 64
"""Frames that are taken between two steps: a host that sends more does not keep the drives from their watchdogs."""

Say = Callable[[str], object]
AnyDevices = TypeVar("AnyDevices", bound="SimulatedDevices")


class SimulatedDevices(ABC):
    """Bus end of a plant, to be run in another process than the driver; a context manager, which owns the bus.

    Real time steps the plant by the clock of this computer. Lock-step steps it by one period of the loop with each
    question of the host, also while the cable to the host is out.
    """

    def __init__(self, plant: Plant, drives: Drives, lock_step: bool = False, say: Say = print):
        """Prepare the drives; each bus opens its address after this.

        Args:
            plant: What moves.
            drives: On the bus of this class.
            lock_step: True if time passes with the questions of the host.
            say: Takes a line for each event.
        """
        self.plant, self._drives, self._lock_step, self._say = plant, drives, lock_step, say
        self._unplugged: set[int] = set()
        self._is_cut = False
        self._faults = [drive.fault for drive in plant.each]
        self.pauses: list[tuple[float, float]] = []
        """Each pause of `STALL_S` or more: when it ended by the monotonic clock, and how long it was [s]."""

    def __enter__(self: AnyDevices) -> AnyDevices:
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def run(self, until_stopped: Callable[[], bool]) -> None:
        """Serve the bus until `until_stopped`, which is asked once a step."""
        step_s = self.plant.twin.period_s
        due = time.monotonic() + step_s
        while not until_stopped():
            if self._lock_step:
                self._serve(LISTEN_S)
                continue
            while (left := due - time.monotonic()) > 0.0:
                self._serve(left)
            if left < -STALL_S:
                due -= left
                self.pauses.append((due, -left))
            self._serve(0.0)  # what was sent meanwhile is heard before any time passes here
            self._step()
            due += step_s

    def unplug(self, joint: int) -> None:
        """Take the plug of this drive out of the bus; it keeps its power."""
        self._unplugged.add(joint)

    def plug(self, joint: int) -> None:
        """Put it back."""
        self._unplugged.discard(joint)

    def cut(self) -> None:
        """Take out the cable to the host."""
        self._is_cut = True

    def mend(self) -> None:
        """Put it in again; what was sent meanwhile is lost."""
        self._serve(0.0)
        self._is_cut = False

    @property
    @abstractmethod
    def where(self) -> str:
        """Address of the bus, for a person."""

    @abstractmethod
    def _close(self) -> None:
        """Give the bus back."""

    @abstractmethod
    def _serve(self, seconds: float) -> None:
        """Take what comes within that time and what has come already, at most about `AT_ONCE` frames."""

    @abstractmethod
    def _step_drive(self, joint: int) -> None:
        """Let one drive do what it does by itself after a step of the plant."""

    def _is_plugged(self, joint: int) -> bool:
        return not self._is_cut and joint not in self._unplugged

    def _step_loop(self) -> None:
        """Step the plant by one period of the loop."""
        for _ in range(round(self._drives.period_s / self.plant.twin.period_s)):
            self._step()

    def _step(self) -> None:
        plant, at = self.plant, self.plant.now
        plant.step()
        for joint, drive in enumerate(plant.each):
            self._step_drive(joint)
            if drive.fault != self._faults[joint]:
                self._faults[joint], said = drive.fault, drive.fault.name or "no fault"
                # A watchdog of the bus trips after the step, one of the drive before it: each tells its own time.
                told_ms = 1e3 * (drive.silence_s if DriveFault.WATCHDOG in drive.fault else at - drive.told_at)
                self._say(f"{at:.3f} s: {self._drives.joints[joint]}: {said}; told last {told_ms:.1f} ms before")
