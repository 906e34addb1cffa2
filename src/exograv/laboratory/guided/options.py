"""Options of commands that move an arm along a path."""

from dataclasses import dataclass
from typing import Annotated, Literal

from exograv.options import RigArgument, TwinOptions, Within

PersonKind = Literal["relaxed", "pauses", "overrules", "lets-go"]


@dataclass(frozen=True)
class GuidedOptions(TwinOptions):
    """Options of `exograv run teach`, and of the other commands that move an arm of the twin."""

    rig: RigArgument = "recupera_like_qdd"


@dataclass(frozen=True)
class RepeatOptions(GuidedOptions):
    """Options of `exograv run repeat`."""

    speed: Annotated[float, Within(0.1, 1.0, "0.1 to 1, the speed of the path itself.")] = 1.0
    """Share of the path's own speed, 0.1 to 1."""

    repetitions: Annotated[int, Within(1, 100)] = 1
    """Number of repetitions."""

    person: PersonKind = "relaxed"
    """Action of the simulated person: none, hold the arm for two seconds, hold it, or ask to be let go."""


@dataclass(frozen=True)
class MirrorOptions(GuidedOptions):
    """Options of `exograv run mirror`."""

    rig: RigArgument = "recupera_like_dual"

    lead: Literal["right", "left"] = "right"
    """Side of the unaffected arm, which leads."""

    seconds: Annotated[float, Within(5.0, 600.0)] = 20.0
    """Duration, counted from the coupling of the following arm [s]."""

    person: Literal["relaxed", "overrules", "lets-go"] = "relaxed"
    """Action of the simulated person: none, hold the following arm, or ask to be let go."""
