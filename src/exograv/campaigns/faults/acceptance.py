"""Acceptance criteria of the fault table: measured quantities, their limits, and the misses whose cause is known."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol, runtime_checkable


class Measure(enum.Enum):
    """Quantity of a flight that the fault table limits; the value names it with its unit."""

    TIME = "time_ms"
    """Time from the fault's beginning to the first command of the safe state."""

    STATE = "safe_state"
    """Most restrictive safe state of a flight whose fault has to be tolerated."""

    STEP = "torque_step_Nm"
    """Largest change of a command from one tick to the next."""

    SPEED = "extra_speed"
    """Speed of a joint by the fault, before the safe state: the difference from the onset, or from the same flight
    without the fault if that is smaller."""

    WAY = "extra_way_deg"
    """The same for a joint's position."""

    ENERGY = "injected_J"
    """Energy into the person beyond compensation, before the safe state."""

    HAND = "flight_hand_m_s"
    """Fastest hand from the first onset to the end of the flight, while the wearer does not push."""

    DRIFT = "drift_deg_s"
    """Largest mean speed of a joint by the fault over half a second, in the same sense."""

    POWER = "power_W"
    """Largest power into the person beyond compensation."""

    TORQUE_CHANGE = "gravity_torque_change_Nm_s"
    """Largest change per second of the torque that carries the arm in one posture, by parameters alone."""

    ARM_BOUND = "arm_bound"
    """First moments of the arm in force, relative to the nearer plausible bound; above 1 they are outside."""


ALWAYS = (Measure.POWER, Measure.TORQUE_CHANGE, Measure.ARM_BOUND)
"""Measures that are judged for every wearer. The others hold for a relaxed arm, because a wearer who moves adds to
them."""

HAND_MAX_M_S = 1.0
"""Largest hand speed allowed after a fault with a relaxed arm [m/s]."""

MOTION: Mapping[Measure, float] = MappingProxyType(
    {Measure.SPEED: 0.5, Measure.WAY: 3.0, Measure.ENERGY: 0.5, Measure.HAND: HAND_MAX_M_S}
)
"""Limits of the motion that a fault may cause before the safe state acts, for a relaxed arm
(docs/explanation/safety.md, MOTION)."""

MOMENTS_MIN, MOMENTS_MAX = 0.4, 1.6
"""Plausible first moments of an arm, relative to those of the anthropometric table [-]."""


RELEASED_HAND_M_S = 6.3
"""Hand speed of an arm that falls with its full weight from the horizontal (docs/explanation/safety.md) [m/s]."""


@runtime_checkable
class ExplainedFlight(Protocol):
    """Data of a flight by which a known cause may explain its misses."""

    @property
    def falling_hand_m_s(self) -> float:
        """Largest hand speed [m/s] that the fault's unbalanced weight explains."""
        ...


@dataclass(frozen=True)
class KnownMiss:
    """Criterion that a fault misses for a known cause. It stays in the table and counts as missed."""

    fault: str
    measure: Measure

    up_to: float | None
    """Largest figure that the cause explains; None if the cause explains every figure, and a fault never found."""

    cause: str

    by_fall: bool = False
    """True if the cause explains hand speeds up to that of an arm that falls by the flight's unbalanced weight."""

    def explains(self, figure: float | None, flight: ExplainedFlight | None = None) -> bool:
        """Return True if the cause explains this figure of a flight; None is a fault that was not found in time."""
        if self.by_fall and (flight is None or figure is None or not figure <= flight.falling_hand_m_s):
            return False
        return self.up_to is None or (figure is not None and figure <= self.up_to)
