"""What comes out of a simulated flight: where each touch landed, of whom, after which training."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from exograv.errors import RigError
from exograv.task.records import TouchRecord

FAMILIARISED = "familiarised"
"""Condition of those who did nothing before the flight but get used to the passive machine."""

FIRST_WINDOW = 1

Group = Literal["trained", "untrained", "comparison"]


@dataclass(frozen=True)
class FlownTouch:
    """One accepted touch."""

    window: int
    """From 1."""

    number: int
    """Within the window, from 1; accepted ones only."""

    right_mm: float
    """Of the target's centre, as the person sees it."""

    up_mm: float
    deviation_px: float
    deviation_mm: float

    @classmethod
    def of(cls, touch: TouchRecord, number: int) -> "FlownTouch":
        """Touch number `number` of its window, from a record of the task.

        Raises:
            RigError: The screen was not calibrated.
        """
        right, down, off = touch.deviation_x_mm, touch.deviation_y_mm, touch.deviation_mm
        if right is None or down is None or off is None or touch.window is None:
            raise RigError("The simulated screen is not calibrated. Give the plan a room's calibration.")
        return cls(touch.window, number, right, -down, touch.deviation_px, off)


@dataclass(frozen=True)
class VirtualFlight:
    """One person in one flight."""

    person: int
    """The same number is the same person in every condition: body, habits and noise seed."""

    condition: str
    """Name of the training, or `FAMILIARISED`."""

    group: Group
    """Of the main study, or "comparison" for flights that only compare conditions."""

    sessions: int
    """Before this flight."""

    left_over_Nm: float | None
    """By the machine of the training, worst shoulder axis; None without motors."""

    friction_Nm: float | None
    """Of that machine, mean Coulomb friction over its joints; None without motors."""

    touches: tuple[FlownTouch, ...]

    @property
    def first_window(self) -> tuple[FlownTouch, ...]:
        """Touches of window 1; none where it held none, whatever later windows held."""
        return tuple(touch for touch in self.touches if touch.window == FIRST_WINDOW)


def flight_of(plain: Mapping[str, Any]) -> VirtualFlight:
    """What `dataclasses.asdict` made of a flight, after any way through JSON."""
    return VirtualFlight(**{**plain, "touches": tuple(FlownTouch(**touch) for touch in plain["touches"])})


def compared(flights: Iterable[VirtualFlight]) -> dict[str, tuple[VirtualFlight, ...]]:
    """Flights that compare conditions, by condition in the order in which they come, one flight a person.

    Those of group "comparison"; of a condition that has none, those of the main study. Where a condition was flown
    after different numbers of sessions, each is a condition of its own: "dam, 4 sessions".
    """
    by_name = dict[str, list[VirtualFlight]]()
    for flight in flights:
        by_name.setdefault(flight.condition, []).append(flight)
    found = dict[str, tuple[VirtualFlight, ...]]()
    for name, all_of_it in by_name.items():
        apart = [flight for flight in all_of_it if flight.group == "comparison"]
        chosen = apart or all_of_it
        numbers = sorted({flight.sessions for flight in chosen})
        for sessions in numbers:
            label = name if len(numbers) == 1 else f"{name}, {sessions} sessions"
            people = {flight.person: flight for flight in chosen if flight.sessions == sessions}
            found[label] = tuple(people[person] for person in sorted(people))
    return found


def familiarised(flights: Iterable[VirtualFlight]) -> dict[int, VirtualFlight]:
    """What every condition is compared with, by person: a flight of "comparison" before one of the main study."""
    known = [flight for flight in flights if flight.condition == FAMILIARISED]
    found = {flight.person: flight for flight in known if flight.group != "comparison"}
    return found | {flight.person: flight for flight in known if flight.group == "comparison"}
