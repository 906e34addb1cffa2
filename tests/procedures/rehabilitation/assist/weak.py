"""Virtual person without a machine: reaches a target with enough support, and sinks with far too little."""

from exograv.procedures.rehabilitation.support_level.flight import Attempt
from exograv.procedures.rehabilitation.support_level.targets import TARGETS
from exograv.task.assist_protocol import LoadedAssist, load_assist_protocol

SINKS_BELOW = 0.3
"""Support below the person's need at which the arm sinks [share of the weight]."""


class Weak:
    """Person who needs `needed` plus k percent of support for target k."""

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
