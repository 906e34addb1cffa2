"""Options of motions that lead an arm."""

from dataclasses import dataclass
from typing import Annotated, Literal

import tyro

from exograv.errors import ConfigError
from exograv.options import RigOption, TwinOptions, Within

PersonKind = Literal["relaxed", "pauses", "overrules", "lets-go"]


@dataclass(frozen=True)
class GuidedOptions(TwinOptions):
    """Options of `exograv run teach`, and of what else leads an arm of the twin."""

    rig: RigOption = "recupera_like_qdd"

    simulate: bool = False
    """On the twin; nothing else is led yet."""

    def __post_init__(self):
        if not self.simulate:
            raise ConfigError(
                "Only the twin is led so far: add --simulate. A real machine first needs its own risk analysis for "
                "motion that a person does not begin (docs/howto/guided.md)."
            )
        super().__post_init__()


@dataclass(frozen=True)
class RepeatOptions(GuidedOptions):
    """Options of `exograv run repeat`."""

    speed: Annotated[float, Within(0.1, 1.0, "0.1 to 1, the speed of the path itself.")] = 1.0
    """Share of the path's own speed, 0.1 to 1."""

    repetitions: Annotated[int, Within(1, 100)] = 1
    """How often."""

    person: PersonKind = "relaxed"
    """What the simulated person does: nothing, hold the arm for two seconds, hold it, or ask to be let go."""


@dataclass(frozen=True)
class MirrorOptions(GuidedOptions):
    """Options of `exograv run mirror`."""

    rig: Annotated[str, tyro.conf.arg(help="Name of a machine for both arms, or path of its folder.")] = (
        "recupera_like_dual"
    )

    lead: Literal["right", "left"] = "right"
    """The sound arm."""

    seconds: Annotated[float, Within(5.0, 600.0)] = 20.0
    """From when the other arm is taken hold of [s]."""

    person: Literal["relaxed", "overrules", "lets-go"] = "relaxed"
    """What the simulated person does: nothing, hold the led arm, or ask to be let go."""
