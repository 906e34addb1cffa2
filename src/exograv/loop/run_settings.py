"""Settings at the head of a recording in lock-step: machine, body data that the software gets, versions and hashes."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from exograv.model.description import RigDescription
from exograv.model.rig_settings import RigSettings
from exograv.model.wearer_form import WearerForm
from exograv.options import WorldName
from exograv.results import MERGED

from .machine_limits import limits
from .replay_log import ToldPerson, versions, written_rig


@dataclass(frozen=True)
class RoundedBody:
    """Rounded body data for the reader. The exact ones are in the settings."""

    height_m: float
    mass_kg: float
    sex: str
    lengths_m: dict[str, float]


@dataclass(frozen=True)
class GuardLimits:
    """Limits of the guard's envelope, as the settings of a recording state them."""

    torque_max_Nm: list[float]
    torque_rate_max_Nm_per_s: float
    v_damping_rad_s: float
    v_trip_rad_s: float


@dataclass(frozen=True)
class MachineAndRun:
    """Machine and person in full precision, and the settings of the run itself."""

    rig: RigSettings
    rig_files: dict[str, str]
    told: ToldPerson
    run: Mapping[str, object] = field(metadata=MERGED)
    """Options, protocol and the like, by name."""


@dataclass(frozen=True)
class RunSettings:
    """The `/settings` of a run in lock-step."""

    rig: str
    title: str
    side: str
    wearer: RoundedBody
    limits: GuardLimits
    hashes: dict[str, str]
    """SHA-256 of the files that were read, by their kind."""
    versions: dict[str, str]
    settings: MachineAndRun
    command: str
    """Command as typed, without options."""
    disturbance_level: int
    world: WorldName
    seed: int


@dataclass(frozen=True)
class TwinRun:
    """Machine, disturbances and seed of a run on the twin."""

    rig: str
    disturbance_level: int
    world: WorldName
    seed: int


@dataclass(frozen=True)
class Draw:
    """Draw of a simulated machine and its wearer."""

    level: int
    """Disturbance level."""
    world: WorldName
    seed: int


def run_settings(
    description: RigDescription,
    form: WearerForm,
    command: str,
    draw: Draw,
    settings: Mapping[str, object],
    hashes: Mapping[str, str] | None = None,
) -> RunSettings:
    """Describe a run of this command.

    Args:
        description: Machine.
        form: Body data and lengths, as an operator measures them.
        command: Command as typed, without options.
        draw: Draw of machine and wearer.
        settings: Settings of the run itself, by name: options, protocol and the like.
        hashes: Hashes of the files that were read, by their kind.
    """
    body, envelope = form.body, limits(description)
    lengths = {name: round(length, 4) for name, length in (body.lengths_m or {}).items()}
    return RunSettings(
        rig=description.name,
        title=description.settings.title,
        side=description.side,
        wearer=RoundedBody(round(body.height_m, 3), round(body.mass_kg, 1), body.sex, lengths),
        limits=GuardLimits(
            envelope.torque_max_Nm.tolist(),
            envelope.torque_rate_max_Nm_per_s,
            envelope.v_damping_rad_s,
            envelope.v_trip_rad_s,
        ),
        hashes={"rig": description.sha256, **(hashes or {})},
        versions=versions(),
        settings=MachineAndRun(
            description.settings, written_rig(description), ToldPerson(body, form.lengths), settings
        ),
        command=command,
        disturbance_level=draw.level,
        world=draw.world,
        seed=draw.seed,
    )
