"""Settings at the head of a twin's recording: machine, body data as told to the software, versions and hashes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from exograv.loop.machine_limits import limits
from exograv.loop.replay_log import ToldPerson, versions, written_rig
from exograv.model.rig_settings import RigSettings
from exograv.options import WorldName
from exograv.results import MERGED, json_value

from .virtual_laboratory import VirtualLaboratory

if TYPE_CHECKING:
    from .options import DemoOptions


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
    """The `/settings` of a run on the twin."""

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
class DemoSettings:
    """The `/settings` of a demonstration."""

    run: RunSettings = field(metadata=MERGED)
    method: str
    torque_source: str
    gravity_level: float
    targets_Nm: list[float]


def provenance(
    options: "DemoOptions", laboratory: VirtualLaboratory, targets: list[float], hashes: Mapping[str, str]
) -> DemoSettings:
    """Describe a demonstration on the twin; `hashes` as in `run_settings`."""
    # Neither the speed nor a file's path changes the result. The hashes state which files were read.
    given = json_value(options) | {"realtime": False, "calibration": None, "files": None}
    command = "exograv arm identify" if options.only_identify else "exograv demo"
    run = run_settings(laboratory, command, options.level, options.seed, {"options": given}, hashes)
    return DemoSettings(run, options.method, options.torque_source, options.gravity_level, targets)


def run_settings(
    laboratory: VirtualLaboratory,
    command: str,
    level: int,
    seed: int,
    settings: Mapping[str, object],
    hashes: Mapping[str, str] | None = None,
) -> RunSettings:
    """Describe a run of this command in the laboratory.

    Args:
        laboratory: Machine and wearer.
        command: Command as typed, without options.
        level: Disturbance level.
        seed: Seed of the run.
        settings: Settings of the run itself, by name: options, protocol and the like.
        hashes: Hashes of the files that were read, by their kind.
    """
    description, body, model = laboratory.description, laboratory.body, laboratory.wearer_model
    envelope = limits(description)
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
        hashes={
            "rig": description.sha256, **({} if model is None else {"wearer_model": model.sha256}), **(hashes or {})
        },
        versions=versions(),
        settings=MachineAndRun(
            description.settings,
            written_rig(description),
            ToldPerson(body, laboratory.wearer.lengths_given),
            settings,
        ),
        command=command,
        disturbance_level=level,
        world=laboratory.world,
        seed=seed,
    )  # fmt: skip
