"""Options of `exograv arm weigh`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from exograv.options import ON_DRIVES, HeldWeight, WornOptions

DRAWN_KG = (0.5, 1.0, 1.5, 2.0)


@dataclass(frozen=True)
class WeighOptions(WornOptions):
    """Options of `exograv arm weigh`."""

    hand_weight_kg: Annotated[float | None, tyro.conf.arg(name="hand-weight", metavar="KG"), HeldWeight] = None
    """Weight that the virtual wearer takes into the hand [kg].

    The software does not know it. Drawn if absent; 0 for none. On real drives it is the value of your own scale, which
    the result shows beside the estimate.
    """

    forearm_weight_kg: Annotated[float, tyro.conf.arg(name="forearm-weight", metavar="KG"), HeldWeight] = 0.0
    """Weight at the middle of the forearm [kg], also unknown to the software."""

    body_mass_kg: Annotated[float | None, tyro.conf.arg(name="body-mass", metavar="KG")] = None
    """Body mass that the operator entered [kg]; the wearer's own if absent."""

    calibration: Path | None = None
    """Calibration of this machine (`exograv rig calibrate`); without it the twin is calibrated first. On drives it is
    the calibration.toml in the folder of --out.
    """

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S"), ON_DRIVES] = 60.0
    """Duration of the motion with which an arm without a file is identified first, 10 or more; on drives only."""

    @property
    def weights(self) -> dict[Literal["hand", "forearm"], float]:
        """Weights on the arm [kg]. Without an option the weight in the hand is drawn from `DRAWN_KG` by the seed."""
        import numpy as np  # `--help` must not wait for this import.

        drawn = float(np.random.default_rng([self.seed, 9]).choice(DRAWN_KG))
        hand = drawn if self.hand_weight_kg is None else self.hand_weight_kg
        both: dict[Literal["hand", "forearm"], float] = {"hand": hand, "forearm": self.forearm_weight_kg}
        return {place: mass for place, mass in both.items() if mass > 0.0}
