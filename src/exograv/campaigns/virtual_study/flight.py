"""Results of a simulated flight: the person, the training, and the place of each touch."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from exograv.errors import RigError
from exograv.task.records import TouchRecord

FAMILIARISED = "familiarised"
"""Condition of people who only got used to the passive machine before the flight."""

FIRST_WINDOW = 1

Group = Literal["trained", "untrained", "comparison"]


@dataclass(frozen=True)
class FlownTouch:
    """Accepted touch in flight."""

    window: int
    """Number of the window, from 1."""

    number: int
    """Number within the window, from 1; only accepted touches count."""

    right_mm: float
    """Distance to the right of the target's centre, as the person sees it [mm]."""

    up_mm: float
    deviation_px: float
    deviation_mm: float

    @classmethod
    def of(cls, touch: TouchRecord, number: int) -> "FlownTouch":
        """Make touch number `number` of its window from a record of the task.

        Raises:
            RigError: The screen was not calibrated.
        """
        right, down, off = touch.deviation_x_mm, touch.deviation_y_mm, touch.deviation_mm
        if right is None or down is None or off is None or touch.window is None:
            raise RigError("The simulated screen is not calibrated. Give the plan a room's calibration.")
        return cls(touch.window, number, right, -down, touch.deviation_px, off)


@dataclass(frozen=True)
class VirtualFlight:
    """Flight of one person."""

    person: int
    """Number of the person. A number means the same body, habits and noise seed in every condition."""

    condition: str
    """Name of the training, or `FAMILIARISED`."""

    group: Group
    """Group of the main study, or "comparison" for flights that only compare conditions."""

    sessions: int
    """Number of sessions before this flight."""

    left_over_Nm: float | None
    """Left over of the training's machine at the worst shoulder axis [N·m]; None without motors."""

    friction_Nm: float | None
    """Mean Coulomb friction over that machine's joints [N·m]; None without motors."""

    touches: tuple[FlownTouch, ...]

    @property
    def first_window(self) -> tuple[FlownTouch, ...]:
        """Touches of window 1; empty if it has none, even if later windows have some."""
        return tuple(touch for touch in self.touches if touch.window == FIRST_WINDOW)


def flight_of(plain: Mapping[str, Any]) -> VirtualFlight:
    """Restore a flight from the result of `dataclasses.asdict`, also after JSON."""
    return VirtualFlight(**{**plain, "touches": tuple(FlownTouch(**touch) for touch in plain["touches"])})


def compared(flights: Iterable[VirtualFlight]) -> dict[str, tuple[VirtualFlight, ...]]:
    """Return flights that compare conditions, one per person, by condition in order of appearance.

    These are the flights of group "comparison", or those of the main study if a condition has none. If a condition was
    flown after different numbers of sessions, each number is a separate condition: "dam, 4 sessions".
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
    """Return each person's flight after familiarisation: of "comparison" if one exists, else of the main study."""
    known = [flight for flight in flights if flight.condition == FAMILIARISED]
    found = {flight.person: flight for flight in known if flight.group != "comparison"}
    return found | {flight.person: flight for flight in known if flight.group == "comparison"}
