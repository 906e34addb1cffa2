"""Options of a verification."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.options import Level, Options, RigOption, Seed, SideOption, Within

LATER_MAX_MIN = 240.0


@dataclass(frozen=True)
class VerifyOptions(Options):
    """Options of `exograv verify`."""

    rig: RigOption = "recupera_like"
    side: SideOption = None
    level: Level = 2
    seed: Seed = 0

    calibration: Path | None = None
    """calibration.toml of this machine (`exograv calibrate`); without it the twin is calibrated first.
    On drives the one in the folder of --out."""

    before: Path | None = None
    """Figures of a former verification (its --json): says what changed since, and whether by more than chance."""

    later_min: Annotated[
        float,
        tyro.conf.arg(name="later", metavar="MIN"),
        Within(0.0, LATER_MAX_MIN, f"0 to {LATER_MAX_MIN:g} min.", " min"),
    ] = 0.0
    """On the twin: so many minutes the machine runs between identification and verification; friction warms [min]."""
