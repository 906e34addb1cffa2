"""Head of a recording on the twin: machine, person as told, settings, versions and hashes."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from exograv.loop.machine_limits import limits
from exograv.loop.replay_log import versions, written_rig, written_told

from .virtual_laboratory import VirtualLaboratory

if TYPE_CHECKING:
    from .options import DemoOptions


def provenance(options: "DemoOptions", laboratory: VirtualLaboratory, targets: list[float]) -> dict[str, Any]:
    """The `/settings` of a demonstration on the twin."""
    # Neither the pace nor a file's place changes what is computed; which files were read stands in the hashes.
    given = asdict(options) | {"realtime": False, "calibration": None, "files": None}
    command = "exograv identify" if options.only_identify else "exograv demo"
    return run_settings(laboratory, command, options.level, options.seed, {"options": given}) | {
        "method": options.method,
        "torque_source": options.torque_source,
        "gravity_level": options.gravity_level,
        "targets_Nm": targets,
    }


def run_settings(
    laboratory: VirtualLaboratory,
    command: str,
    level: int,
    seed: int,
    settings: Mapping[str, Any],
    hashes: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """The `/settings` of a run of this command in the laboratory.

    Args:
        laboratory: Machine and wearer.
        command: As typed, without options.
        level: Disturbance level.
        seed: Of the run.
        settings: Settings of the run itself, by name: options, protocol and the like.
        hashes: Of the files that were read, by their kind.
    """
    whole = _laboratory_settings(laboratory)
    whole["settings"] |= settings
    whole["hashes"] |= hashes or {}
    return whole | {"command": command, "disturbance_level": level, "seed": seed}


def _laboratory_settings(laboratory: VirtualLaboratory) -> dict[str, Any]:
    description, body = laboratory.description, laboratory.body
    envelope = limits(description)
    return {
        "rig": description.name,
        "title": description.settings.title,
        "side": description.side,
        "wearer": {
            "height_m": round(body.height_m, 3),
            "mass_kg": round(body.mass_kg, 1),
            "sex": body.sex,
            "lengths_m": {name: round(length, 4) for name, length in (body.lengths_m or {}).items()},
        },
        "limits": {
            "torque_max_Nm": envelope.torque_max_Nm.tolist(),
            "torque_rate_max_Nm_per_s": envelope.torque_rate_max_Nm_per_s,
            "v_damping_rad_s": envelope.v_damping_rad_s,
            "v_trip_rad_s": envelope.v_trip_rad_s,
        },
        "hashes": {"rig": description.sha256, **_wearer_hash(laboratory)},
        "versions": versions(),
        "settings": {
            "rig": description.settings.model_dump(),
            "rig_files": written_rig(description),
            "told": written_told(body, laboratory.wearer.lengths_given),
        },
    }


def _wearer_hash(laboratory: VirtualLaboratory) -> dict[str, str]:
    model = laboratory.wearer_model
    return {} if model is None else {"wearer_model": model.sha256}
