"""Options of a calibration."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from exograv.errors import ConfigError
from exograv.options import CalibratedOptions, DrivesFile, SegmentLengths


@dataclass(frozen=True)
class CalibrateOptions(CalibratedOptions):
    """Options of `exograv rig calibrate`."""

    calibration: Path | None = None
    """File to keep the calibration in; calibration.toml in the folder of --out if none is named."""

    recheck: bool = False
    """Only check friction again, for the calibration in that file; its gains stay."""

    drives: DrivesFile = None
    """drives.toml of a real machine, empty and hanging, whose bring-up has passed (docs/howto/rig_test.md)."""

    lengths: SegmentLengths = ()
    """Length that the machine is set to, as forearm=0.26; nominal if not named. May be repeated; needs --drives."""

    motion: Path | None = None
    """Motion file that the empty machine flies after its sweeps, such as further_motion.toml of `exograv twin fit`."""

    prior: Literal["data-sheet", "twin"] = "data-sheet"
    """Knowledge before the calibration: rig.toml and URDF, or the machine's twin of `exograv twin fit`. With the twin,
    links may be heavier or lighter than their drawings."""

    recording: Path | None = None
    """Recording of the calibration, for `exograv twin fit`."""

    def __post_init__(self):
        super().__post_init__()
        if self.recheck and (self.motion is not None or self.recording is not None):
            raise ConfigError("--motion and --recording belong to a whole calibration. Leave out --recheck.")
        if self.recheck and self.prior == "twin":
            raise ConfigError("--prior twin belongs to a whole calibration. Leave out --recheck.")
        if self.lengths and self.drives is None:
            raise ConfigError(
                f"--length is {self.lengths[0]}, but a simulated machine is not adjusted. Leave it out, or give "
                "--drives."
            )
