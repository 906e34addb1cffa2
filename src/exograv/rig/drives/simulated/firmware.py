"""What runs inside one drive, on any bus: enabling, limits, heat, faults, and a watchdog that brakes by itself.

Heat is one capacity behind one resistance: at rated current the winding ends at its rated rise.
"""

import math
from dataclasses import dataclass

from exograv.rig.drive_status import DriveFault, DriveStatus
from exograv.rig.drives.settings import Drive

AMBIENT_C, RISE_C, MAX_C = 25.0, 60.0, 110.0
"""Of the winding: around it, at rated current for ever, and where the drive gives up. Assumed, class F is 155 °C."""

DERATE_FROM_C = 95.0
"""From here to `MAX_C` the current that it still gives falls to none."""

HEAT_S = 60.0
"""Time constant of a small motor's winding, assumed [s]."""


@dataclass(frozen=True, slots=True)
class Output:
    """What a drive does to its motor."""

    current: float
    """[A]"""

    damping: float
    """[N·m·s/rad]"""


class SimulatedDrive:
    """One drive; time is told to it, so that it runs on any clock."""

    def __init__(self, settings: Drive, watchdog_s: float):
        self.settings, self.watchdog_s = settings, watchdog_s
        self.fault = DriveFault.NONE
        self.is_enabled = False
        self.temperature_C = AMBIENT_C
        self.brake_Nms_per_rad = settings.brake_Nms_per_rad
        """With which it brakes when it gives no torque; a kind of drive that lets go meanwhile sets 0 [N·m·s/rad]."""
        self.silence_s = math.nan
        """How long it had been told nothing when its watchdog tripped last; for examiners [s]."""
        self.told_at = -math.inf
        """When it was last told something that it could obey, or enabled [s]."""
        self._current, self._damping, self._until = 0.0, 0.0, math.inf

    def tell(self, current: float, damping: float, now: float, until: float = math.inf) -> None:
        """A command has come: it holds until its life or the watchdog ends it; without a number it is a fault.

        Args:
            current: [A]
            damping: With which it brakes besides [N·m·s/rad].
            now: [s]
            until: When its life ends [s]: from then on the drive brakes, until the next.
        """
        if not (math.isfinite(current) and 0.0 <= damping < math.inf):
            self.fail(DriveFault.INTERNAL)
            return
        self.told_at = now
        self._current, self._damping, self._until = current, damping, until

    def enable(self, now: float) -> bool:
        """Whether it is on now; not while a fault lasts. It begins with no torque."""
        if self.fault:
            return False
        if not self.is_enabled:
            self.is_enabled, self.told_at = True, now
            self._current, self._damping, self._until = 0.0, 0.0, math.inf
        return True

    def disable(self) -> None:
        """Off, and braking."""
        self.is_enabled, self._current = False, 0.0

    def fail(self, fault: DriveFault) -> None:
        """Off and braking, until somebody acknowledges it."""
        self.fault |= fault
        self.disable()

    def starve(self, now: float) -> None:
        """Nobody tells it anything any more, by its own watchdog or its bus's [s]."""
        self.silence_s = now - self.told_at
        self.fail(DriveFault.WATCHDOG)

    def acknowledge(self) -> bool:
        """Forget faults whose cause is over; whether all are."""
        lasting = DriveFault.NONE
        if self.temperature_C > DERATE_FROM_C:
            lasting |= DriveFault.TEMPERATURE
        self.fault &= lasting | DriveFault.STOP_LINE | DriveFault.ENCODER
        return not self.fault

    def step(self, dt: float, now: float) -> Output:
        """So much time has passed; what it does to its motor for the next."""
        if self.is_enabled and now - self.told_at > self.watchdog_s:
            self.starve(now)
        if self.temperature_C >= MAX_C:
            self.fail(DriveFault.TEMPERATURE)
        if not self.is_enabled or now >= self._until:
            self._warm(0.0, dt)
            return Output(0.0, self.brake_Nms_per_rad)
        cool = min(max((MAX_C - self.temperature_C) / (MAX_C - DERATE_FROM_C), 0.0), 1.0)
        limit = self.settings.current_max_A * cool
        current = min(max(self._current, -limit), limit)
        self._warm(current, dt)
        return Output(current, self._damping)

    @property
    def status(self) -> DriveStatus:
        """What it would say."""
        return DriveStatus(self.is_enabled, self.fault, temperature_C=self.temperature_C)

    def _warm(self, current: float, dt: float) -> None:
        ends_at = AMBIENT_C + RISE_C * (current / self.settings.current_rated_A) ** 2
        self.temperature_C += (ends_at - self.temperature_C) * dt / HEAT_S
