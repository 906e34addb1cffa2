"""Alarms of the console itself: somebody said what he may not, whoever steers is silent, a file cannot be written."""

from typing import Literal

from exograv.model.rig_settings import Settings
from exograv.sentence import SentenceText

KEPT_MAX = 50
"""Not acknowledged; more of them say nothing new."""


class ConsoleAlarm(Settings):
    """One, until somebody has seen it."""

    number: int
    text: SentenceText
    priority: Literal["high", "medium", "low"]
    since_s: float
    """On the desk's clock [s]."""

    times: int = 1
    """How often it was raised since."""


class Alarms:
    """Those that nobody has seen yet."""

    def __init__(self) -> None:
        """None."""
        self._open = dict[str, ConsoleAlarm]()
        self._raised = 0

    @property
    def open(self) -> tuple[ConsoleAlarm, ...]:
        """The newest last."""
        return tuple(self._open.values())

    def sound(self, text: str, t: float, priority: Literal["high", "medium", "low"] = "medium") -> ConsoleAlarm:
        """Raise it; the same once more is counted."""
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

    def acknowledge(self, number: int) -> bool:
        """Whether there was such an alarm."""
        for text, alarm in self._open.items():
            if alarm.number == number:
                del self._open[text]
                return True
        return False
