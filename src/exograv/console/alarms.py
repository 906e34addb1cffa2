"""Alarms of the console itself: a role asked for too much, the steering page is silent, a file cannot be written."""

from typing import Literal

from exograv.model.rig_settings import Settings
from exograv.sentence import SentenceText

KEPT_MAX = 50
"""Largest number of open alarms. Beyond it the oldest is dropped."""


class ConsoleAlarm(Settings):
    """Alarm that stays open until it is acknowledged."""

    number: int
    text: SentenceText
    priority: Literal["high", "medium", "low"]
    since_s: float
    """Time at which it was first raised, on the desk's clock [s]."""

    times: int = 1
    """Number of times it was raised."""


class Alarms:
    """Open alarms: raised, and not acknowledged yet."""

    def __init__(self) -> None:
        """Start with no open alarm."""
        self._open = dict[str, ConsoleAlarm]()
        self._raised = 0

    @property
    def open(self) -> tuple[ConsoleAlarm, ...]:
        """Open alarms, the newest last."""
        return tuple(self._open.values())

    def sound(self, text: str, t: float, priority: Literal["high", "medium", "low"] = "medium") -> ConsoleAlarm:
        """Raise an alarm, or count a repetition of the same text."""
        known = self._open.get(text)
        if known is None:
            self._raised += 1
            alarm = ConsoleAlarm(number=self._raised, text=text, priority=priority, since_s=t)
        else:
            alarm = known.model_copy(update={"times": known.times + 1})
        self._open[text] = alarm
        while len(self._open) > KEPT_MAX:
            del self._open[next(iter(self._open))]
        return alarm

    def explain(self, before: str, text: str) -> bool:
        """Replace the text of an open alarm by a better one; return True if there was one."""
        known = self._open.pop(before, None)
        if known is not None:
            self._open[text] = known.model_copy(update={"text": text})
        return known is not None

    def acknowledge(self, number: int) -> bool:
        """Acknowledge an alarm; return True if it was open."""
        for text, alarm in self._open.items():
            if alarm.number == number:
                del self._open[text]
                return True
        return False
