"""Options of the commands for the twin of a machine."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import RIG_HELP, Options, Repeated, SegmentLengths, SideOption, Within

RigName = Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="RIG", help=RIG_HELP)]
Weights = Annotated[Repeated, tyro.conf.arg(name="weight", metavar="FILE:MOUNT=KG")]


@dataclass(frozen=True)
class TwinFitOptions(Options):
    """Options of `exograv twin fit`."""

    machine: RigName = field(default=tyro.MISSING)

    recordings: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RECORDINGS")] = field(
        default=tyro.MISSING
    )
    """Recordings of the empty machine in motion, in the order in which they were made: exograv's MCAP, CSV with named
    columns, ROS recordings, or LeRobot datasets. An MCAP in which the machine identifies an arm tells the cuffs."""

    side: SideOption = None

    torque: bool = False
    """The efforts of ROS recordings are joint torques [N·m] in place of currents."""

    degrees: bool = False
    """The positions of CSV files and LeRobot datasets are degrees in place of radians."""

    weights: Weights = ()
    """Known weight that hangs at a mount during a whole recording. May be repeated. Recordings of exograv's calibration
    state their weights themselves."""

    force_frame: str | None = None
    """Frame of the machine's URDF at which a force sensor measures; the mount of the calibration if not named."""

    lengths: SegmentLengths = ()
    """Length that the machine was set to, as forearm=0.26; nominal if not named. May be repeated."""

    def weight_of_file(self) -> Mapping[str, tuple[str, float]]:
        """Return mount and mass [kg] by recording.

        Raises:
            ConfigError: A word is not FILE:MOUNT=KG.
        """
        return dict(_weight(text) for text in self.weights)


def _weight(text: str) -> tuple[str, tuple[str, float]]:
    file, colon, rest = text.rpartition(":")
    mount, equals, mass = rest.partition("=")
    try:
        if not (colon and equals and file and mount and float(mass) >= 0.0):
            raise ValueError
        return file, (mount, float(mass))
    except ValueError:
        raise ConfigError(
            f"--weight is '{text}'; give FILE:MOUNT=KG, such as swing.csv:calibration_mount=1.5."
        ) from None


@dataclass(frozen=True)
class TwinCompareOptions(Options):
    """Options of `exograv twin compare`."""

    machine: RigName = field(default=tyro.MISSING)

    recording: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RECORDING")] = field(default=tyro.MISSING)
    """Recording of the empty machine, with its commands."""

    side: SideOption = None

    weights: Weights = ()
    """Known weight that hangs at a mount during the whole recording."""

    seconds: Annotated[float, Within(5.0, 600.0)] = 60.0
    """Length of the recording that is replayed, from its start [s]."""

    allowed: Annotated[float, Within(1.0, 100.0)] = 2.0
    """Largest torque departure over that on the held-out part of the fit. Above it the command ends with status 1."""

    def weight_of_file(self) -> Mapping[str, tuple[str, float]]:
        """Return mount and mass [kg] by recording.

        Raises:
            ConfigError: A word is not FILE:MOUNT=KG.
        """
        return dict(_weight(text) for text in self.weights)
