"""Firmware of one drive on any bus: enabling, limits, heat, faults, and a watchdog that brakes by itself.

The thermal model has one capacity behind one resistance. At rated current the winding reaches its rated rise.
"""

import math
from dataclasses import dataclass

from exograv.rig.drive_status import DriveFault, DriveStatus
from exograv.rig.drives.settings import Drive

AMBIENT_C, RISE_C, MAX_C = 25.0, 60.0, 110.0
"""Ambient temperature, rise at continuous rated current, and switch-off temperature of the winding [°C].

Assumed; class F is 155 °C.
"""

DERATE_FROM_C = 95.0
"""Temperature from which the available current falls, to zero at `MAX_C` [°C]."""

HEAT_S = 60.0
"""Thermal time constant of a small motor's winding, assumed [s]."""


@dataclass(frozen=True, slots=True)
class Output:
    """Output of a drive to its motor."""

    current: float
    """Current in the motor [A]."""

    damping: float
    """Damping that the drive adds to the torque of the current [N·m·s/rad]."""


class SimulatedDrive:
    """Simulated drive. Each call passes the time, so that the drive runs on any clock."""

    def __init__(self, settings: Drive, watchdog_s: float):
        self.settings, self.watchdog_s = settings, watchdog_s
        self.fault = DriveFault.NONE
        self.is_enabled = False
        self.temperature_C = AMBIENT_C
        self.brake_Nms_per_rad = settings.brake_Nms_per_rad
        """Damping of the drive when it gives no torque; 0 for a kind of drive that lets go [N·m·s/rad]."""
        self.silence_s = math.nan
        """Time without a command when the watchdog tripped last; for examiners [s]."""
        self.told_at = -math.inf
        """Time of the last valid command, or of enabling [s]."""
        self._current, self._damping, self._until = 0.0, 0.0, math.inf

    def tell(self, current: float, damping: float, now: float, until: float = math.inf) -> None:
        """Take a command. It holds until its life or the watchdog ends it; a value that is not finite is a fault.

        Args:
            current: Motor current [A].
            damping: Additional damping by the drive [N·m·s/rad].
            now: Present time [s].
            until: End of the command's life [s]; the drive then brakes until the next command.
        """
        if not (math.isfinite(current) and 0.0 <= damping < math.inf):
            self.fail(DriveFault.INTERNAL)
            return
        self.told_at = now
        self._current, self._damping, self._until = current, damping, until

    def enable(self, now: float) -> bool:
        """Switch the drive on at zero torque; return True if it is on. A lasting fault keeps it off."""
        if self.fault:
            return False
        if not self.is_enabled:
            self.is_enabled, self.told_at = True, now
            self._current, self._damping, self._until = 0.0, 0.0, math.inf
        return True

    def disable(self) -> None:
        """Switch the drive off; it brakes."""
        self.is_enabled, self._current = False, 0.0

    def fail(self, fault: DriveFault) -> None:
        """Note a fault and switch the drive off; it brakes until the fault is acknowledged."""
        self.fault |= fault
        self.disable()

    def starve(self, now: float) -> None:
        """Note that commands have stopped, by the drive's own watchdog or that of its bus [s]."""
        self.silence_s = now - self.told_at
        self.fail(DriveFault.WATCHDOG)

    def acknowledge(self) -> bool:
        """Clear faults whose cause is gone; return True if no fault is left."""
        lasting = DriveFault.NONE
        if self.temperature_C > DERATE_FROM_C:
            lasting |= DriveFault.TEMPERATURE
        self.fault &= lasting | DriveFault.STOP_LINE | DriveFault.ENCODER
        return not self.fault

    def step(self, dt: float, now: float) -> Output:
        """Advance by `dt` [s]; return the output to the motor for the next step."""
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
        """Status that the drive would report."""
        return DriveStatus(self.is_enabled, self.fault, temperature_C=self.temperature_C)

    def _warm(self, current: float, dt: float) -> None:
        ends_at = AMBIENT_C + RISE_C * (current / self.settings.current_rated_A) ** 2
        self.temperature_C += (ends_at - self.temperature_C) * dt / HEAT_S
