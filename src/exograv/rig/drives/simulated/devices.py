"""Simulated drives of a machine at their bus: clock, cables and reported faults. Each bus adds its own frames."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TypeVar

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives

from .plant import Plant

STALL_S = 0.005
"""Length of a pause of this process after which its clock is set anew [s].

Real drives do not pause, so the drives' time stands still during a pause.
"""

STEP_AFTER, SHIFT_MAX = 0.1, 0.02
"""Delay of a step after the host's question, and largest shift of one step towards it, as shares of a step [-].

This process cannot answer while it steps the plant. Drives answer at once; many also synchronise their own cycle with
the master's.
"""

WAITED_S = 30e-6
"""Time after a step [s]; a question that is read within it may have waited for the end of the step."""

LISTEN_S = 0.01
"""Time between two checks of the stop condition in lock-step [s]."""

AT_ONCE = 64
"""Largest number of frames that are processed between two steps. More frames must not delay the drives' watchdogs."""

Say = Callable[[str], object]
AnyDevices = TypeVar("AnyDevices", bound="SimulatedDevices")


class SimulatedDevices(ABC):
    """Bus end of a plant, for a process of its own; a context manager that owns the bus.

    In real time the plant is stepped by the clock of this computer. In lock-step it is stepped by one period of the
    loop with each question of the host, also while the cable to the host is out.
    """

    def __init__(self, plant: Plant, drives: Drives, lock_step: bool = False, say: Say = print):
        """Prepare the drives; each bus opens its address after this.

        Args:
            plant: Twin with its drives.
            drives: Drives on the bus of this class.
            lock_step: True if time passes with the questions of the host.
            say: Prints a line for each event.
        """
        self.plant, self._drives, self._lock_step, self._say = plant, drives, lock_step, say
        self._unplugged: set[int] = set()
        self._is_cut = False
        self._faults = [drive.fault for drive in plant.each]
        self._asked_at: float | None = None
        self._has_waited, self._stepped_at = False, 0.0
        self.pauses: list[tuple[float, float]] = []
        """Pauses of `STALL_S` or more: end on the monotonic clock, and length [s]."""

    def __enter__(self: AnyDevices) -> AnyDevices:
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def run(self, until_stopped: Callable[[], bool]) -> None:
        """Serve the bus until `until_stopped`, which is called once per step."""
        step_s = self.plant.twin.period_s
        due = time.monotonic() + step_s
        while not until_stopped():
            if self._lock_step:
                self._serve(LISTEN_S)
                continue
            while (left := due - time.monotonic()) > 0.0:
                self._serve(left)
                if self._has_waited:
                    # It came at an unknown time during the step; one correction of up to half a step is enough.
                    due, self._has_waited = due + self._early(due, step_s), False
            if left < -STALL_S:
                due -= left
                self.pauses.append((due, -left))
            self._serve(0.0)  # frames that arrived in the meantime count before the next step
            self._step()
            self._stepped_at = time.monotonic()
            due += step_s + self._shift(due, step_s)

    def unplug(self, joint: int) -> None:
        """Disconnect this drive from the bus; it keeps its power."""
        self._unplugged.add(joint)

    def plug(self, joint: int) -> None:
        """Connect this drive to the bus again."""
        self._unplugged.discard(joint)

    def cut(self) -> None:
        """Disconnect the cable to the host."""
        self._is_cut = True

    def mend(self) -> None:
        """Connect the cable to the host again; frames sent in the meantime are lost."""
        self._serve(0.0)
        self._is_cut = False

    @property
    @abstractmethod
    def where(self) -> str:
        """Address of the bus in readable form."""

    @abstractmethod
    def _close(self) -> None:
        """Close the simulated bus."""

    @abstractmethod
    def _serve(self, seconds: float) -> None:
        """Process the frames that arrive within that time or have arrived, at most about `AT_ONCE`."""

    @abstractmethod
    def _step_drive(self, joint: int) -> None:
        """Let one drive act by itself after a step of the plant."""

    def _note_question(self) -> None:
        """Note that the host asks now for the measurement of a new period."""
        self._asked_at = time.monotonic()
        self._has_waited = self._asked_at - self._stepped_at < WAITED_S

    def _shift(self, due: float, step_s: float) -> float:
        """Shift of the next step [s], so that steps begin soon after the questions of the host."""
        return min(max(self._early(due, step_s), -SHIFT_MAX * step_s), SHIFT_MAX * step_s)

    def _early(self, due: float, step_s: float) -> float:
        """Time by which a step at `due` [s] comes too early after the host's question [s]; negative if too late."""
        if self._asked_at is None:
            return 0.0
        early = self._asked_at + STEP_AFTER * step_s - due
        return early - round(early / step_s) * step_s

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
                # A watchdog of the bus trips after the step, one of the drive before it. Each measures its own silence.
                told_ms = 1e3 * (drive.silence_s if DriveFault.WATCHDOG in drive.fault else at - drive.told_at)
                self._say(f"{at:.3f} s: {self._drives.joints[joint]}: {said}; last command {told_ms:.1f} ms before")
