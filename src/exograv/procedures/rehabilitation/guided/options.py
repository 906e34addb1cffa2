"""Options of commands that move an arm along a path."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from exograv.options import ON_DRIVES, ON_TWIN, RigArgument, Within, WornOptions

PersonKind = Literal["relaxed", "pauses", "overrules", "lets-go"]


@dataclass(frozen=True)
class GuidedOptions(WornOptions):
    """Options of `exograv run teach`, `exograv run repeat` and `exograv run mirror`."""

    rig: RigArgument = "recupera_like_qdd"

    calibration: Annotated[Path | None, ON_DRIVES] = None
    """File calibration.toml of this machine, by default in the folder of --out; on drives only."""

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S"), ON_DRIVES] = 60.0
    """Duration of the motion with which an arm without a file is identified first, 10 or more; on drives only."""


@dataclass(frozen=True)
class RepeatOptions(GuidedOptions):
    """Options of `exograv run repeat`."""

    speed: Annotated[float, Within(0.1, 1.0, "0.1 to 1, the speed of the path itself.")] = 1.0
    """Share of the path's own speed, 0.1 to 1."""

    repetitions: Annotated[int, Within(1, 100)] = 1
    """Number of repetitions."""

    person: Annotated[PersonKind, ON_TWIN] = "relaxed"
    """Action of the simulated person: none, hold the arm for two seconds, hold it, or ask to be let go."""


@dataclass(frozen=True)
class MirrorOptions(GuidedOptions):
    """Options of `exograv run mirror`."""

    rig: RigArgument = "recupera_like_dual"

    lead: Literal["right", "left"] = "right"
    """Side of the unaffected arm, which leads."""

    seconds: Annotated[float, Within(5.0, 600.0)] = 20.0
    """Duration, counted from the coupling of the following arm [s]."""

    person: Annotated[Literal["relaxed", "overrules", "lets-go"], ON_TWIN] = "relaxed"
    """Action of the simulated person: none, hold the following arm, or ask to be let go."""
