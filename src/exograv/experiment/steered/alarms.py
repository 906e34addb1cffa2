"""Alarms: each stays until somebody has seen it and what raised it is over."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from .view_models import MachineAlarm

Priority = Literal["high", "medium", "low"]

KEPT = 50
"""Alarms that are over and not seen; of more the oldest go."""


@dataclass
class AlarmBook:
    """Of one desk."""

    _alarms: tuple[MachineAlarm, ...] = ()
    _raised: int = 0

    def look(self, causes: Mapping[str, Priority], now: float) -> None:
        """Raise what is new among these causes, each a sentence, and end what is not there any more."""
        here = {alarm.text for alarm in self._alarms if not alarm.is_over}
        gone = [alarm if alarm.is_over or alarm.text in causes else _over(alarm) for alarm in self._alarms]
        for text, priority in causes.items():
            if text not in here:
                gone.append(MachineAlarm(number=self._next(), text=text, priority=priority, since_s=now, is_over=False))
        self._alarms = tuple(a for a in gone if not (a.is_over and a.acknowledged_by))[-KEPT:]

    def tell(self, text: str, priority: Priority, now: float) -> None:
        """Something has happened, and is over."""
        alarm = MachineAlarm(number=self._next(), text=text, priority=priority, since_s=now, is_over=True)
        self._alarms = (*self._alarms, alarm)[-KEPT:]

    def acknowledge(self, number: int, by: str) -> bool:
        """Whether there is one of this number."""
        found = any(alarm.number == number for alarm in self._alarms)
        seen = (_seen(a, by) if a.number == number else a for a in self._alarms)
        self._alarms = tuple(a for a in seen if not (a.is_over and a.acknowledged_by))
        return found

    @property
    def shown(self) -> tuple[MachineAlarm, ...]:
        """The newest last."""
        return self._alarms

    def _next(self) -> int:
        self._raised += 1
        return self._raised


def _over(alarm: MachineAlarm) -> MachineAlarm:
    return alarm.model_copy(update={"is_over": True})


def _seen(alarm: MachineAlarm, by: str) -> MachineAlarm:
    return alarm.model_copy(update={"acknowledged_by": alarm.acknowledged_by or by})
