"""A person without a machine, who reaches a target when enough is carried, and sinks when far too little is."""

from exograv.laboratory.support_level.flight import Attempt
from exograv.procedures.rehabilitation.support_level.targets import TARGETS
from exograv.task.assist_protocol import LoadedAssist, load_assist_protocol

SINKS_BELOW = 0.3
"""Of the weight, under one's need."""


class Weak:
    """Target k needs `needed` plus k percent."""

    def __init__(self, needed: float):
        self.needed, self.asked = needed, list[float]()

    def attempt(self, target: int, support: float) -> Attempt:
        self.asked.append(support)
        short = self.needed + 0.01 * target - support
        return Attempt(target, support, short <= 0.0, 0.1, short > SINKS_BELOW)


def usual() -> LoadedAssist:
    loaded = load_assist_protocol("assist-as-needed")
    assert loaded.settings.rule.block == len(TARGETS)
    return loaded
