"""Summary of several machines' efforts, to print, draw and compare: medians, ratios, and each machine."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.model.limb import FREEDOMS
from exograv.recording.rounding import rounded
from exograv.report.figures.transparency_data import (
    ConditionEffort,
    EffortRatios,
    MachineEffort,
    MachineTransparency,
    OffPath,
)

from .effort import TRACKING_MAX_DEG, Effort
from .movements import WantedMovement
from .options import TransparencyOptions

ELBOW = FREEDOMS.index("elbow")

Efforts = Mapping[str, Sequence[Effort]]
"""Efforts by condition, one per machine."""


def rig_result(
    description: RigDescription,
    options: TransparencyOptions,
    seeds: Sequence[int],
    movement: WantedMovement,
    efforts: Efforts,
) -> MachineTransparency:
    """Return all figures of one kind of machine. Medians are over its machines."""
    return MachineTransparency(
        rig=description.name,
        profile=profile(description),
        disturbance_level=options.level,
        world=options.world,
        seeds=list(seeds),
        movement=movement.name,
        movement_s=round(movement.repeats * movement.path.seconds, 3),
        recorded_samples=movement.samples,
        clipped_samples=movement.clipped,
        joints=list(FREEDOMS[: movement.path.q.shape[1]]),
        conditions={condition: _condition(seeds, of_machines) for condition, of_machines in efforts.items()},
        dam_over_gcm=_ratios(efforts),
        dam_minus_ideal_Nms=round(float(np.median(_totals(efforts["dam"]) - _totals(efforts["dam_ideal"]))), 3),
        off_path=[
            OffPath(condition, seed, round(float(effort.tracking_deg.max()), 2))
            for condition, of_machines in efforts.items()
            for seed, effort in zip(seeds, of_machines, strict=True)
            if not effort.keeps_path
        ],
        tracking_error_max_deg=TRACKING_MAX_DEG,
    )


def profile(description: RigDescription) -> str:
    """Return the kind of its drives: "harmonic" if any joint has a harmonic drive, else "qdd"."""
    drives = {actuator.drive for actuator in description.settings.actuators}
    return "harmonic" if "harmonic" in drives else "qdd"


def _condition(seeds: Sequence[int], efforts: Sequence[Effort]) -> ConditionEffort:
    by_joint = np.array([effort.absolute for effort in efforts])
    worst = np.array([effort.tracking_deg.max() for effort in efforts])
    return ConditionEffort(
        effort_Nms=round(float(np.median(by_joint.sum(axis=1))), 3),
        by_joint_Nms=rounded(np.median(by_joint, axis=0)),
        tracking_error_deg=round(float(np.median(worst)), 3),
        squared_N2m2s=round(float(np.median([effort.squared.sum() for effort in efforts])), 3),
        machines=[
            MachineEffort(
                seed=seed,
                effort_Nms=round(float(effort.absolute.sum()), 3),
                by_joint_Nms=rounded(effort.absolute),
                squared_N2m2s=round(float(effort.squared.sum()), 3),
                tracking_error_deg=rounded(effort.tracking_deg),
                practice=effort.repetitions,
            )
            for seed, effort in zip(seeds, efforts, strict=True)
        ],
    )


def _ratios(efforts: Efforts) -> EffortRatios:
    """Return the medians of the machines' own ratios. Both efforts of a ratio have the same machine and wearer."""
    dam, gcm = efforts["dam"], efforts["gcm"]
    zero_g = _totals(efforts["zero_g"])
    elbows = [d.absolute[ELBOW] / g.absolute[ELBOW] for d, g in zip(dam, gcm, strict=True)]
    squares = [d.squared.sum() / g.squared.sum() for d, g in zip(dam, gcm, strict=True)]
    return EffortRatios(
        effort=round(float(np.median(_totals(dam) / _totals(gcm))), 3),
        elbow=round(float(np.median(elbows)), 3),
        squared=round(float(np.median(squares)), 3),
        beyond_zero_g=round(float(np.median((_totals(dam) - zero_g) / (_totals(gcm) - zero_g))), 3),
    )


def _totals(efforts: Sequence[Effort]) -> Float[np.ndarray, " machine"]:
    return np.array([effort.absolute.sum() for effort in efforts])
