"""Options of the commands that run on a machine in real time."""

import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import (
    HEAVIEST_KG,
    ON_DRIVES,
    ON_TWIN,
    SESSIONS_MAX,
    Acts,
    CalibratedOptions,
    DrivesFile,
    GravityLevel,
    JointFactors,
    JointNames,
    MachineOptions,
    Options,
    PersonCode,
    SegmentLengths,
    Sex,
    StreamNames,
    Within,
    WornOptions,
)

if TYPE_CHECKING:
    from exograv.runtime.ros2.bridging import Ros2

MOTION_S = (10.0, 600.0)
"""Shortest and longest motion for a live identification [s]."""

AROUND_MOTION_S = 16.0
"""Time for rest, ramp, approach to the motion, and the worker's last computation [s]."""

WITH_SIMULATE = Acts(lambda all_: all_.simulate, "with --simulate")
WITH_ROS2 = Acts(lambda all_: all_.ros2, "with --ros2")

OF_PERSON = Acts(lambda all_: all_.participant is not None, "with --participant")

NO_DRIVES = (
    "--drives is missing: give the drives.toml of this machine (docs/howto/rig_test.md), or --simulate to practise on "
    "simulated drives."
)

NOT_RECORDED = ("drives", "simulate", "calibration", "ros2", "ros2_router", "ros2_accept_gravity_level")
"""Options that are absent from a recording, or that have another form in it."""


@dataclass(frozen=True)
class PersonForm(Options):
    """Form of the wearer of a machine on drives: body height, mass, sex and measured segment lengths."""

    height_m: Annotated[float | None, tyro.conf.arg(name="body-height", metavar="M"), ON_DRIVES] = None
    """Body height of the wearer [m]; on drives only."""

    mass_kg: Annotated[float | None, tyro.conf.arg(name="body-mass", metavar="KG"), ON_DRIVES] = None
    """Body mass of the wearer [kg]; on drives only."""

    sex: Annotated[Sex | None, ON_DRIVES] = None
    """Sex whose table of body segments fits the wearer better; on drives only."""

    lengths: Annotated[SegmentLengths, ON_DRIVES] = ()
    """Measured length of an arm segment, to which the machine is adjusted [m], such as forearm=0.26; on drives only.
    Can be repeated."""


@dataclass(frozen=True)
class ParticipantChoice(Options):
    """Choice of a person whose arm is stored in a file, for a command on drives."""

    participant: Annotated[str | None, PersonCode("Give the code of a stored arm, such as P-07."), ON_DRIVES] = None
    """Code of a person whose arm is stored, such as P-07, never a name. The arm is then only checked, in 20 s of motion
    in place of an identification, and the file is written again; on drives only."""

    participants: Annotated[Path | None, OF_PERSON] = None
    """Folder of the participants' files; by default `participants` in the folder of --out."""


@dataclass(frozen=True)
class ReturningPerson(PersonForm, ParticipantChoice):
    """Wearer of a machine on drives: a person whose arm is stored, or an unknown one with a form."""


@dataclass(frozen=True)
class LiveOptions(WornOptions):
    """Options of `exograv run live`."""

    seconds: Annotated[float, tyro.conf.arg(metavar="S"), Within(1.0, 7200.0, "1 to 7200.")] = 10.0
    """Duration of floating in real time; with `--identify` after the identification."""

    identify_s: Annotated[float, tyro.conf.arg(name="identify", metavar="S")] = 0.0
    """Duration of motion for a live identification before the arm floats, 10 or more. Without it, the arm is identified
    before the live run; on drives it is needed for an arm without a file."""

    gravity_level: Annotated[GravityLevel, ON_TWIN] = 0.0
    """Share of the arm's own weight that the wearer feels: 0 on a space station, 1 on Earth."""

    self_test: Annotated[bool, ON_TWIN] = False
    """Test the empty machine first, as a real machine requires. Otherwise the recording notes a skipped self-test."""

    lsl: bool = False
    """Publish joint state, torque and markers over Lab Streaming Layer, from the recorder's process."""

    calibration: Annotated[Path | None, ON_DRIVES] = None
    """File calibration.toml of this machine, by default in the folder of --out; on drives only."""

    record_streams: StreamNames = ()
    """Record the stream of another device with this name, or all streams of this type. Can be repeated. See `exograv
    streams`."""

    ros2: bool = False
    """Publish joint states, gravity level and safe state as a node of ROS 2, by Zenoh; ROS 2 need not be installed."""

    ros2_router: Annotated[str, tyro.conf.arg(metavar="LOCATOR"), WITH_ROS2] = "tcp/localhost:7447"
    """Address of the Zenoh router."""

    ros2_accept_gravity_level: bool = False
    """Accept requests for a gravity level over ROS 2, until the first stop."""

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
            raise ConfigError("--ros2-accept-gravity-level needs --ros2, which is not given. Give both.")
        if not sys.platform.startswith("linux"):
            raise ConfigError(f"exograv run live needs Linux, and this is {sys.platform}.")
        _ = self.bridge  # An unusable bridge is refused now, not after minutes of preparation.

    @property
    def loop_s(self) -> float:
        """Duration of the loop [s]."""
        return self.seconds + (self.identify_s + AROUND_MOTION_S if self.identify_s else 0.0)

    @property
    def bridge(self) -> "Ros2 | None":
        """Bridge to ROS 2; None without `--ros2`.

        Raises:
            ConfigError: Zenoh is not installed, or ROS_DOMAIN_ID names no domain.
        """
        from exograv.runtime.ros2.bridging import Ros2

        return Ros2(self.ros2_router, self.ros2_accept_gravity_level) if self.ros2 else None

    def recorded(self) -> Mapping[str, object]:
        """Return the options in the form of the recording of a live run."""
        options = {name: value for name, value in asdict(self).items() if name not in NOT_RECORDED}
        return options | {"ros2": None if (bridge := self.bridge) is None else asdict(bridge)}


@dataclass(frozen=True)
class NextOptions(CalibratedOptions):
    """Options of `exograv next`."""

    drives: DrivesFile = None
    """File drives.toml of the machine."""

    participant: Annotated[str | None, PersonCode()] = None
    """Code of the person, such as P-07, never a name. Without it the checklist ends with the machine."""

    participants: Annotated[Path | None, OF_PERSON] = None
    """Folder of the participants' files; by default `participants` in the folder of --out."""

    protocol: Annotated[str, OF_PERSON] = "training"
    """Protocol of the session: a name, or the path of a file."""

    session: Annotated[int | None, Within(1, SESSIONS_MAX), OF_PERSON] = None
    """Number of the session with this protocol; by default the first that is not over."""

    study: Annotated[Path | None, OF_PERSON] = None
    """Folder of the study in which the person takes part."""

    def __post_init__(self):
        super().__post_init__()
        if not self.is_on_drives:
            raise ConfigError(NO_DRIVES)


@dataclass(frozen=True)
class AcceptOptions(WornOptions):
    """Options of `exograv rig accept`."""

    by: Annotated[str, tyro.conf.arg(metavar="INITIALS")] = ""
    """Initials of the operator, for the protocol."""

    dummy: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File of the dummy arm with its masses; by default that of docs/howto/accept.md."""

    weight_kg: Annotated[
        float,
        tyro.conf.arg(name="weight", metavar="KG"),
        Within(0.5, HEAVIEST_KG, f"0.5 to {HEAVIEST_KG:g} kg.", " kg"),
    ] = 1.0
    """Mass of the weight that is hung on the dummy's hook [kg]. Give the value of your own scale."""

    resume: bool = False
    """Keep the parts of an earlier call that have passed, and run the others."""

    simulated_dummy: Annotated[Path | None, tyro.conf.arg(metavar="FILE"), WITH_SIMULATE] = None
    """File of the dummy that is in the simulated machine, if it is another one than `--dummy`."""

    def __post_init__(self):
        super().__post_init__()
        if not self.is_on_drives:
            raise ConfigError(NO_DRIVES)
        if not self.simulate and not self.by:
            raise ConfigError("--by is missing: the protocol needs the initials of the operator, such as --by ab.")


@dataclass(frozen=True)
class RigTestOptions(MachineOptions):
    """Options of `exograv rig test`."""

    drives: DrivesFile = None
    """File drives.toml with the wiring of this machine's motors (docs/howto/rig_test.md)."""

    by: Annotated[str, tyro.conf.arg(metavar="INITIALS")] = ""
    """Initials of the operator, for the sheet."""

    wrong_sign: Annotated[JointNames, WITH_SIMULATE] = ()
    """Joints whose simulated motor turns in the wrong direction."""

    wrong_scale: Annotated[JointFactors, WITH_SIMULATE] = ()
    """Joints with a wrong torque constant: the simulated motor gives FACTOR times the torque."""

    wrong_encoder: Annotated[JointNames, WITH_SIMULATE] = ()
    """Joints whose simulated encoder counts in the wrong direction."""

    def __post_init__(self):
        super().__post_init__()
        if not self.is_on_drives:
            raise ConfigError(NO_DRIVES)
        if not self.simulate and not self.by:
            raise ConfigError("--by is missing: the sheet needs the initials of the operator, such as --by ab.")

    @property
    def simulation(self) -> tuple[str, ...]:
        """Options of `exograv dev drive-sim` for the faults of the simulated machine."""
        wrong = {"--wrong-sign": self.wrong_sign, "--wrong-scale": self.wrong_scale,
                 "--wrong-encoder": self.wrong_encoder}  # fmt: skip
        return tuple(word for flag, joints in wrong.items() if joints for word in (flag, *joints))
