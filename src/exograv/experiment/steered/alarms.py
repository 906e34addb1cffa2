"""Alarms of a session. An alarm stays until a person has acknowledged it and its cause is over."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from .view_models import MachineAlarm

Priority = Literal["high", "medium", "low"]

KEPT = 50
"""Upper limit of stored alarms. The oldest are removed first."""


@dataclass
class AlarmBook:
    """List of the open alarms of one steered session."""

    _alarms: tuple[MachineAlarm, ...] = ()
    _raised: int = 0

    def look(self, causes: Mapping[str, Priority], now: float) -> None:
        """Raise an alarm for each new cause, and end alarms without a cause. Causes are sentences with a priority."""
        here = {alarm.text for alarm in self._alarms if not alarm.is_over}
        gone = [alarm if alarm.is_over or alarm.text in causes else _over(alarm) for alarm in self._alarms]
        for text, priority in causes.items():
            if text not in here:
                gone.append(MachineAlarm(number=self._next(), text=text, priority=priority, since_s=now, is_over=False))
        self._alarms = tuple(a for a in gone if not (a.is_over and a.acknowledged_by))[-KEPT:]

    def tell(self, text: str, priority: Priority, now: float) -> None:
        """Add an alarm for an event that is already over."""
        alarm = MachineAlarm(number=self._next(), text=text, priority=priority, since_s=now, is_over=True)
        self._alarms = (*self._alarms, alarm)[-KEPT:]

    def acknowledge(self, number: int, by: str) -> bool:
        """Acknowledge an alarm. Return True if there is one with this number."""
        found = any(alarm.number == number for alarm in self._alarms)
        seen = (_seen(a, by) if a.number == number else a for a in self._alarms)
        self._alarms = tuple(a for a in seen if not (a.is_over and a.acknowledged_by))
        return found

    @property
    def shown(self) -> tuple[MachineAlarm, ...]:
        """Alarms, the newest last."""
        return self._alarms

    def _next(self) -> int:
        self._raised += 1
        return self._raised


def _over(alarm: MachineAlarm) -> MachineAlarm:
    return alarm.model_copy(update={"is_over": True})


def _seen(alarm: MachineAlarm, by: str) -> MachineAlarm:
    return alarm.model_copy(update={"acknowledged_by": alarm.acknowledged_by or by})
