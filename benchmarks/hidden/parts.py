"""Fits to parts of a recording: the same share of each phase, as a shorter session would hold it."""

import json
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from exograv.identification.machine_twin.axis_inertia import axis_inertia
from exograv.identification.machine_twin.machine_fit import fit_machine, recording_residual
from exograv.identification.machine_twin.measured_motion import MeasuredMotion
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.procedures.machine_twin.fit_command import stored_twin
from exograv.procedures.machine_twin.machine_folder import copy_machine
from exograv.procedures.machine_twin.read_motions import read_motions
from exograv.signals import Joints
from exograv.storage.twin_file import NAME, write_twin

from .fitted import write_fitted
from .plain_fit import public_notes
from .session import RIG

PIECE_LEAST_S = 1.5
"""Shortest piece of a phase [s]: the filter of the samples settles first."""


@dataclass(frozen=True)
class PartFit:
    """Fit to a part of a recording."""

    fit: Path
    """File in the form that `judge` reads."""

    seconds: float
    """Length of the part [s]."""

    held_out_Nm: Joints
    """Torque of the held-out recording that the twin leaves unexplained, per tick in clear motion [N·m]."""


def fit_part(folder: Path, name: str, seconds: float) -> PartFit:
    """Fit a part of this length [s], or the whole recording if it is shorter."""
    description = load_rig(RIG, "right")
    lengths = settings_of_lengths(description, ())
    tree = adjusted(read_exoskeleton(description), description, lengths)
    path, held_out = folder / f"{name}.mcap", folder / f"{name}_held_out.mcap"
    recording, judged = read_motions(description, [path, held_out], {}, is_torque=False)
    starts = [float(note["t"]) for note in public_notes(path) if "phase" in note]
    part = replace(recording, motions=shortened(recording.motions, starts, min(seconds / recording.seconds, 1.0)))
    found = fit_machine(description, tree, part.motions)
    out = folder / f"{name}_{seconds:.0f}s"
    copy_machine(description, out)
    write_twin(out / NAME, stored_twin(description, found, (part,), lengths, datetime.now(UTC).replace(microsecond=0)))
    axes = [{"inertia_kgm2": value} for value in axis_inertia(tree, found.fit)[0].tolist()]
    figures = {"figures": {"recorded_s": float(part.motions[-1].t[-1]), "axis_inertia": axes}}
    (out / "figures.json").write_text(json.dumps(figures), encoding="utf-8")
    write_fitted(out, out / "figures.json", out / "fit.json")
    held_out_Nm = recording_residual(description, tree, found.fit.theta, judged.motions).per_tick_Nm
    return PartFit(out / "fit.json", part.seconds, held_out_Nm)


def shortened(motions: tuple[MeasuredMotion, ...], starts: list[float], share: float) -> tuple[MeasuredMotion, ...]:
    """Return this share of each phase, from its start."""
    if share == 1.0:
        return motions
    pieces = list[MeasuredMotion]()
    for motion in motions:
        edges = [start for start in starts if motion.t[0] <= start < motion.t[-1]]
        for first, last in zip(edges, [*edges[1:], float(motion.t[-1])], strict=True):
            length = max(share * (last - first), PIECE_LEAST_S)
            rows = (motion.t >= first) & (motion.t < min(first + length, last))
            columns = (motion.t, motion.q, motion.current, motion.current_asked, motion.hung)
            q_motor = None if motion.q_motor is None else motion.q_motor[rows]
            warmth = None if motion.temperature is None else motion.temperature[rows]
            kept = (column[rows] for column in columns)
            pieces.append(MeasuredMotion(motion.name, *kept, q_motor=q_motor, temperature=warmth))
    return tuple(pieces)
