"""Settings at the head of a twin's recording: machine, body data that the software gets, versions and hashes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from exograv.loop import run_settings as loop_settings
from exograv.loop.run_settings import RunSettings
from exograv.results import MERGED, json_value

from .virtual_laboratory import VirtualLaboratory

if TYPE_CHECKING:
    from .options import DemoOptions


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
    model = laboratory.wearer_model
    return loop_settings.run_settings(
        laboratory.description,
        laboratory.form,
        command,
        loop_settings.Draw(level, laboratory.world, seed),
        settings,
        {**({} if model is None else {"wearer_model": model.sha256}), **(hashes or {})},
    )
