"""What a recording must say about where it came from."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from exograv.loop.machine_limits import limits
from exograv.loop.replay_log import versions, written_rig, written_told

from .virtual_laboratory import VirtualLaboratory

if TYPE_CHECKING:
    from .demo_options import DemoOptions


def provenance(options: "DemoOptions", laboratory: VirtualLaboratory, targets: list[float]) -> dict[str, Any]:
    """The `/settings` of a demonstration on the twin."""
    whole = laboratory_settings(laboratory)
    # Neither the pace nor a file's place changes what is computed; which files were read stands in the hashes.
    whole["settings"]["options"] = asdict(options) | {"realtime": False, "calibration": None, "files": None}
    return whole | {
        "command": "exograv identify" if options.only_identify else "exograv demo",
        "method": options.method,
        "torque_source": options.torque_source,
        "disturbance_level": options.level,
        "seed": options.seed,
        "gravity_level": options.gravity_level,
        "targets_Nm": targets,
    }


def laboratory_settings(laboratory: VirtualLaboratory) -> dict[str, Any]:
    """What every `/settings` says of the machine and of what was told of the person."""
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
