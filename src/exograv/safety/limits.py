"""Limits of a machine and of the person in it, checked before anything moves and only read in a tick.

Sources of all figures: docs/explanation/safety.md.
"""

import math
from dataclasses import dataclass, fields

import numpy as np

from exograv.errors import ConfigError
from exograv.signals import Joints

from .plausible import PlausibleTable


@dataclass(frozen=True)
class Limits:
    """Limits of the commands that may reach a joint. Sources: safety figures in docs/explanation/safety.md."""

    torque_max_Nm: Joints
    """Largest torque of the drive."""

    damping_Nms_per_rad: Joints
    """Damping of the joints in the soft descent [N·m·s/rad]."""

    torque_rate_max_Nm_per_s: float = 150.0
    """A wrong torque found after 10 ms is then at most 1.5 N·m."""

    v_damping_rad_s: float = 4.0
    """Joint speed above which the guard brakes [rad/s]."""

    v_trip_rad_s: float = 5.0
    """Speed at which the soft descent starts."""

    descent_s: float = 3.0
    """Time over which the soft descent fades the torque: the hand stays below about 0.6 m/s."""

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            for joint, one in enumerate(np.ravel(value).tolist()):
                if not 0.0 < one < math.inf:
                    of_joint = f" of joint {joint}" if np.ndim(value) else ""
                    raise ConfigError(
                        f"envelope.{field.name}{of_joint} is {one}; it must be positive and finite. "
                        "Correct it in the rig file: zero would let the arm fall."
                    )


@dataclass(frozen=True)
class PersonLimits:
    """Limits of one person in one machine."""

    table: PlausibleTable

    active_max_Nm: Joints
    """Torque beyond plausible compensation and friction that a weak adult can resist."""

    q_lower: Joints
    """Lower joint stops [rad]."""
    q_upper: Joints
    """Upper joint stops [rad]."""

    wall_rad: float = math.radians(10.0)
    """Width of the wall before a stop."""

    trip_rad: float = math.radians(2.0)
    """Distance past a stop that only a fault can explain."""

    v_trip_rad_s: float = math.inf
    """Speed at which the soft descent starts, if it is lower than the machine's own limit."""

    tank_start_J: float = 0.5
    tank_max_J: float = 1.0
    """Energy that control may put into the person beyond carrying [J].

    Braking and `path_W` fill the tank again.
    """

    power_max_W: float = math.inf
    """Largest power of all joints into the person beyond carrying and friction."""

    path_W: float = 0.0
    driven_W: float = 0.0
    driven_J: float = 0.0
    """Power and energy of a motion on a path beyond carrying, while control moves the arm along a path."""

    def __post_init__(self):
        not_negative = ("trip_rad", "path_W", "driven_W", "driven_J")
        most_J, is_active = self.tank_max_J, (self.active_max_Nm > 0.0) & np.isfinite(self.active_max_Nm)
        for name, is_allowed, allowed in (
            ("wall_rad", self.wall_rad > 0.0, "above 0"),
            ("active_max_Nm", is_active.all(), "above 0, finite"),
            *((name, getattr(self, name) > 0.0, "above 0") for name in ("v_trip_rad_s", "power_max_W")),
            *((name, 0.0 <= getattr(self, name) < math.inf, "0 and above, finite") for name in not_negative),
            ("tank_start_J", 0.0 < self.tank_start_J <= most_J < math.inf, f"above 0 and up to tank_max_J, {most_J}"),
        ):
            if not is_allowed:
                raise ConfigError(f"{name} is {getattr(self, name)}; allowed: {allowed}. Correct it.")
        for j, (lower, upper) in enumerate(zip(self.q_lower, self.q_upper, strict=True)):
            if not upper - lower > 2.0 * self.wall_rad:
                raise ConfigError(
                    f"Joint {j} moves from {lower} to {upper} rad: no range is left between two walls of "
                    f"{self.wall_rad:.3f} rad. Correct the limits in the URDF."
                )
