"""Assist as needed: support comes down as the person reaches more, goes up when it was too much, and says why.

After each block of attempts one decision. Within a session support comes down until a block fails; from then on it only
stays or goes up, so it cannot swing. It knows no clock and no machine, and asks for shares of the arm's weight only:
ramp and limits are the guard's (docs/explanation/safety.md).
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
            "{reached} of {tried} targets reached: enough to go on, too few for less support. It stays at {after} %."
        ),
        "assist.stay_least": "{reached} of {tried} targets reached with the least support that is allowed, {after} %.",
        "assist.stay_session": (
            "{reached} of {tried} targets reached: support has come down as far as one session may take it, {after} %."
        ),
        "assist.stay_failed": (
            "{reached} of {tried} targets reached, but less than {after} % was too little today. It stays there."
        ),
        "assist.raise": (
            "Only {reached} of {tried} targets reached: support goes up from {before} to {after} %, and not down again "
            "today."
        ),
        "assist.raise_sank": "The arm sank: support goes up from {before} to {after} %, and not down again today.",
        "assist.stay_most": "Only {reached} of {tried} targets reached with the most support there is, {after} %.",
        "assist.next": "The next session begins with {after} %: a little more than this one ended with.",
    }
)
"""English, with gaps; a page has the same in its languages, by the code."""


@dataclass(frozen=True)
class AssistSettings:
    """How support follows; all assumed, for a therapist to change."""

    least_percent: float = 0.0
    most_percent: float = 100.0
    step_down_percent: float = 5.0
    step_up_percent: float = 10.0
    """Larger than down: who has failed is to succeed again at once."""

    session_percent: float = 20.0
    """That support may come down in one session."""

    begin_percent: float = 5.0
    """More than a session ended with, at the beginning of the next."""

    block: int = 12
    """Attempts before a decision."""

    lower_share: float = 0.85
    """Of a block's targets that have to be reached for less support."""

    raise_share: float = 0.6
    """Fewer ask for more support; between the two nothing changes."""

    def __post_init__(self):
        """Refuse what would not follow, or swing.

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
                "who failed after a step down would not get back what was enough. Make it as large at least."
            )
        if not 0.0 <= self.begin_percent <= 50.0:
            raise ConfigError(f"begin_percent is {self.begin_percent:g}; allowed: 0 to 50.")
        if self.block < 4:
            raise ConfigError(f"block is {self.block}; allowed: 4 and more. Fewer attempts say too little.")
        if not 0.0 < self.raise_share < self.lower_share <= 1.0:
            raise ConfigError(
                f"raise_share is {self.raise_share:g} and lower_share {self.lower_share:g}; allowed: 0 < raise < lower "
                "≤ 1, or support would swing."
            )


@dataclass(frozen=True)
class AssistState:
    """Where one person is; kept from session to session."""

    support_percent: float
    began_percent: float
    """With which this session began."""

    has_failed: bool = False
    """Whether a block of this session was too much: support does not come down any more."""


@dataclass(frozen=True)
class Decision:
    """What is done now, and why."""

    state: AssistState
    code: str
    gaps: Mapping[str, float | int]

    @property
    def text(self) -> str:
        """For the therapist, in English."""
        return render(SENTENCES, self.code, self.gaps)


def first_session(settings: AssistSettings, needed_percent: float | None = None) -> AssistState:
    """Fully supported, or a little more than a test of support has found (`exograv run support-level`)."""
    if needed_percent is None or not math.isfinite(needed_percent):
        begin = settings.most_percent
    else:
        begin = _within(settings, needed_percent + settings.begin_percent)
    return AssistState(begin, begin)


def next_session(settings: AssistSettings, state: AssistState) -> Decision:
    """Another day, from a little more than the last one ended with."""
    begin = _within(settings, state.support_percent + settings.begin_percent)
    return Decision(AssistState(begin, begin), "assist.next", {"after": _shown(begin)})


def decide(settings: AssistSettings, state: AssistState, reached: Sequence[bool], sank: bool = False) -> Decision:
    """After a block: whether each of its attempts met its target, and whether the arm sank in any.

    Raises:
        ConfigError: The block is too short to say anything; an arm that sank says enough.
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
