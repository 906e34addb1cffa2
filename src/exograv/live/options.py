"""Options of the commands that run on a machine in real time."""

import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import (
    LEVEL_HELP,
    DrivesFile,
    GravityLevel,
    JointFactors,
    JointNames,
    Level,
    MachineOptions,
    Options,
    RigOption,
    SegmentLengths,
    Sex,
    StreamNames,
    Within,
    WornOptions,
)

if TYPE_CHECKING:
    from exograv.runtime.ros2.bridging import Ros2

MOTION_S = (10.0, 600.0)
"""Motion in which an arm is learned live, at least and at most [s]."""

AROUND_MOTION_S = 16.0
"""Rest, ramp, the way to the motion's beginning, and what the worker takes at its end [s]."""

NOT_RECORDED = ("drives", "simulate", "calibration", "ros2", "ros2_router", "ros2_accept_gravity_level")
"""Options that are absent from a recording, or stand in another form there."""


@dataclass(frozen=True)
class PersonForm(Options):
    """Person in a machine on drives, as far as scale, tape and form say."""

    height_m: Annotated[float | None, tyro.conf.arg(name="body-height", metavar="M")] = None
    """On drives: of the person in the machine [m]."""

    mass_kg: Annotated[float | None, tyro.conf.arg(name="body-mass", metavar="KG")] = None
    """On drives: of the person in the machine [kg]."""

    sex: Sex | None = None
    """On drives: which table of body segments is nearer."""

    lengths: SegmentLengths = ()
    """On drives: a measured segment of the arm, to which the machine is set, such as forearm=0.26. May be repeated."""


@dataclass(frozen=True)
class LiveOptions(WornOptions):
    """Options of `exograv live`."""

    seconds: Annotated[float, tyro.conf.arg(metavar="S"), Within(1.0, 7200.0, "1 to 7200.")] = 10.0
    """How long, in real time; with `--identify` after that."""

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S")] = 0.0
    """Move the arm for so long and learn it live, in a process of its own, before it floats; 10 or more. Without, it is
    identified before the live run."""

    gravity_level: GravityLevel = 0.0
    """Felt share of the arm's own weight: 0 on a space station, 1 on Earth."""

    self_test: bool = False
    """Test the empty machine first, as a real one has to be; without, the recording says that it is skipped."""

    lsl: bool = False
    """Publish joint state, torque and markers over Lab Streaming Layer, from the recorder's process."""

    calibration: Path | None = None
    """On drives: calibration.toml of this machine; that in the folder of --out if none is named."""

    record_streams: Annotated[StreamNames, tyro.conf.arg(name="record-stream")] = ()
    """Record another device's stream of this name, or all of this type, beside the run; may be repeated. See `exograv
    streams`."""

    ros2: bool = False
    """Publish joint states, gravity level and safe state as a node of ROS 2, by Zenoh; ROS 2 need not be installed."""

    ros2_router: Annotated[str, tyro.conf.arg(metavar="LOCATOR")] = "tcp/localhost:7447"
    """Where Zenoh's router is, with `--ros2`."""

    ros2_accept_gravity_level: bool = False
    """Let a gravity level be asked for over ROS 2; only before the first stop."""

    def __post_init__(self):
        super().__post_init__()
        least, most = MOTION_S
        if self.identify_s and not least <= self.identify_s <= most:
            raise ConfigError(
                f"--identify is {self.identify_s:g}; allowed: {least:g} to {most:g}, or 0 to identify the arm before "
                "the live run."
            )
        if self.identify_s and self.gravity_level:
            raise ConfigError(
                f"--gravity-level is {self.gravity_level:g}; with --identify allowed: 0, because an arm is learned "
                "while all of its weight is carried. Leave out one of the two."
            )
        if self.ros2_accept_gravity_level and not self.ros2:
            raise ConfigError(
                "--ros2-accept-gravity-level is given without --ros2, which is the way for it. Give both."
            )
        if not sys.platform.startswith("linux"):
            raise ConfigError(f"exograv live needs Linux, and this is {sys.platform}.")
        _ = self.bridge  # refused now, not after minutes of preparation

    @property
    def loop_s(self) -> float:
        """How long the loop runs [s]."""
        return self.seconds + (self.identify_s + AROUND_MOTION_S if self.identify_s else 0.0)

    @property
    def bridge(self) -> "Ros2 | None":
        """Bridge to ROS 2, if there is to be one.

        Raises:
            ConfigError: Zenoh is not installed, or ROS_DOMAIN_ID names no domain.
        """
        from exograv.runtime.ros2.bridging import Ros2

        return Ros2(self.ros2_router, self.ros2_accept_gravity_level) if self.ros2 else None

    def recorded(self) -> Mapping[str, object]:
        """Options as they stand in the recording of a live run."""
        options = {name: value for name, value in asdict(self).items() if name not in NOT_RECORDED}
        return options | {"ros2": None if (bridge := self.bridge) is None else asdict(bridge)}


@dataclass(frozen=True)
class RigTestOptions(MachineOptions):
    """Options of `exograv rig-test`."""

    rig: tyro.conf.Positional[RigOption] = "recupera_like"

    level: Annotated[Level, tyro.conf.arg(help=LEVEL_HELP.format("simulated machine"))] = 2

    drives: DrivesFile = None
    """drives.toml: how the motors of this machine are wired (docs/rig_test.md)."""

    simulate: bool = False
    """Practise on simulated drives in another process, with hands that are simulated too."""

    by: Annotated[str, tyro.conf.arg(metavar="INITIALS")] = ""
    """Who does it, for the sheet."""

    wrong_sign: JointNames = ()
    """With --simulate: joints whose motor turns the other way."""

    wrong_scale: JointFactors = ()
    """With --simulate: joints whose motor gives so many times the torque."""

    wrong_encoder: JointNames = ()
    """With --simulate: joints whose encoder counts the other way."""

    def __post_init__(self):
        super().__post_init__()
        if not self.is_on_drives:
            raise ConfigError(
                "--drives is missing: give the drives.toml of this machine (docs/rig_test.md), or --simulate to "
                "practise on simulated drives."
            )
        if not self.simulate and not self.by:
            raise ConfigError("--by is missing: the sheet needs the initials of whoever does this, such as --by ab.")

    @property
    def simulation(self) -> tuple[str, ...]:
        """Options of `exograv drive-sim` that spoil the simulated machine."""
        wrong = {"--wrong-sign": self.wrong_sign, "--wrong-scale": self.wrong_scale,
                 "--wrong-encoder": self.wrong_encoder}  # fmt: skip
        return tuple(word for flag, joints in wrong.items() if joints for word in (flag, *joints))
