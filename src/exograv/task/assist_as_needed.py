"""Assist as needed: adaptive support from the share of targets that the person reaches, with a reason for each step.

The rule makes one decision after each block of attempts. Within a session support decreases until a block fails.
    From
then on support only stays or increases, so it cannot oscillate. The rule has no access to a clock or to the
    machine. It
only asks for shares of the arm's weight; the guard applies ramp and limits (docs/explanation/safety.md).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from exograv.errors import ConfigError
from exograv.sentence import render

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "assist.lower": "{reached} of {tried} targets reached: support goes down from {before} to {after} %.",
        "assist.stay_between": (
            "{reached} of {tried} targets reached: enough to go on, too few for less support. Support "
            "stays at {after} %."
        ),
        "assist.stay_least": "{reached} of {tried} targets reached with the least allowed support, {after} %.",
        "assist.stay_session": (
            "{reached} of {tried} targets reached: support stays at {after} %, the lowest value allowed in this "
            "session."
        ),
        "assist.stay_failed": (
            "{reached} of {tried} targets reached. Support stays at {after} %, because less was too little today."
        ),
        "assist.raise": (
            "Only {reached} of {tried} targets reached: support goes up from {before} to {after} %, and does not go "
            "down again today."
        ),
        "assist.raise_sank": (
            "The arm sank: support goes up from {before} to {after} %, and does not go down again today."
        ),
        "assist.stay_most": "Only {reached} of {tried} targets reached with the highest allowed support, {after} %.",
        "assist.next": "The next session begins with {after} %: slightly more than at the end of this one.",
    }
)
"""Sentences in English, with fields. The pages have translations under the same codes."""


@dataclass(frozen=True)
class AssistSettings:
    """Parameters of the rule. All defaults are assumed; a therapist may change them."""

    least_percent: float = 0.0
    most_percent: float = 100.0
    step_down_percent: float = 5.0
    step_up_percent: float = 10.0
    """Step up of support. It is larger than the step down, so that a person who failed succeeds again at once."""

    session_percent: float = 20.0
    """Largest total decrease of support in one session."""

    begin_percent: float = 5.0
    """Support at the start of a session above the support at the end of the last one."""

    block: int = 12
    """Attempts before a decision."""

    lower_share: float = 0.85
    """Smallest share of reached targets in a block at which support decreases."""

    raise_share: float = 0.6
    """Share of reached targets in a block below which support increases. Between the two shares support stays."""

    def __post_init__(self):
        """Reject settings with which support would not adapt, or would oscillate.

        Raises:
            ConfigError: Names the setting.
        """
        if not 0.0 <= self.least_percent < self.most_percent <= 100.0:
            raise ConfigError(
                f"least_percent is {self.least_percent:g} and most_percent {self.most_percent:g}; allowed: 0 ≤ least < "
                "most ≤ 100."
            )
        for name in ("step_down_percent", "step_up_percent", "session_percent"):
            if not 0.0 < getattr(self, name) <= 50.0:
                raise ConfigError(f"{name} is {getattr(self, name):g}; allowed: above 0 to 50.")
        if self.step_up_percent < self.step_down_percent:
            raise ConfigError(
                f"step_up_percent is {self.step_up_percent:g}, less than step_down_percent {self.step_down_percent:g}: "
                "after a failure the person would not get back the support that was enough. Make it at least as large."
            )
        if not 0.0 <= self.begin_percent <= 50.0:
            raise ConfigError(f"begin_percent is {self.begin_percent:g}; allowed: 0 to 50.")
        if self.block < 4:
            raise ConfigError(f"block is {self.block}; allowed: 4 or more. A decision needs enough attempts.")
        if not 0.0 < self.raise_share < self.lower_share <= 1.0:
            raise ConfigError(
                f"raise_share is {self.raise_share:g} and lower_share {self.lower_share:g}; allowed: 0 < raise < lower "
                "≤ 1. Other values let support oscillate."
            )


@dataclass(frozen=True)
class AssistState:
    """Support of one person; stored from session to session."""

    support_percent: float
    began_percent: float
    """Support at the start of this session."""

    has_failed: bool = False
    """True if a block of this session failed. Support then does not decrease any more."""


@dataclass(frozen=True)
class Decision:
    """Decision after a block: the new state, and its reason as a sentence with code and fields."""

    state: AssistState
    code: str
    gaps: Mapping[str, float | int]

    @property
    def text(self) -> str:
        """Reason for the decision, in English, for the therapist."""
        return render(SENTENCES, self.code, self.gaps)


def first_session(settings: AssistSettings, needed_percent: float | None = None) -> AssistState:
    """State of the first session: full support, or slightly more than the result of `exograv run support-level`."""
    if needed_percent is None or not math.isfinite(needed_percent):
        begin = settings.most_percent
    else:
        begin = _within(settings, needed_percent + settings.begin_percent)
    return AssistState(begin, begin)


def next_session(settings: AssistSettings, state: AssistState) -> Decision:
    """Decision for the next session. Support starts slightly above the end of the last one."""
    begin = _within(settings, state.support_percent + settings.begin_percent)
    return Decision(AssistState(begin, begin), "assist.next", {"after": _shown(begin)})


def decide(settings: AssistSettings, state: AssistState, reached: Sequence[bool], sank: bool = False) -> Decision:
    """Decide after a block of attempts.

    Args:
        settings: Parameters of the rule.
        state: State before the block.
        reached: True for each attempt that met its target.
        sank: True if the arm sank in any attempt.

    Raises:
        ConfigError: The block is too short for a decision, and the arm did not sink.
    """
    if len(reached) < settings.block and not sank:
        raise ConfigError(
            f"A block of {len(reached)} attempts; {settings.block} are needed for a decision. Go on with the block."
        )
    before, hits = state.support_percent, sum(map(bool, reached))
    share = hits / len(reached) if reached else 0.0
    after, code, failed = before, "assist.stay_between", state.has_failed
    if sank or share < settings.raise_share:
        after, failed = _within(settings, before + settings.step_up_percent), True
        code = "assist.stay_most" if after == before else "assist.raise_sank" if sank else "assist.raise"
    elif share >= settings.lower_share:
        floor = max(settings.least_percent, state.began_percent - settings.session_percent)
        if state.has_failed:
            code = "assist.stay_failed"
        elif before <= settings.least_percent:
            code = "assist.stay_least"
        elif before <= floor:
            code = "assist.stay_session"
        else:
            after, code = max(before - settings.step_down_percent, floor), "assist.lower"
    gaps = {"reached": hits, "tried": len(reached), "before": _shown(before), "after": _shown(after)}
    return Decision(replace(state, support_percent=after, has_failed=failed), code, gaps)


def _within(settings: AssistSettings, percent: float) -> float:
    return min(max(percent, settings.least_percent), settings.most_percent)


def _shown(percent: float) -> int:
    return round(percent)
