"""Further motion of a fitted twin on its hidden machine: intervals that its design predicts beside those reached."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from exograv.identification.machine_twin.machine_fit import MachineFit, fit_machine
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.calibration.empty_motion import read_empty_motion
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.procedures.machine_twin.fit_command import shown_parameters
from exograv.procedures.machine_twin.further_motion import MOTION, write_further_motion
from exograv.procedures.machine_twin.read_motions import read_motions

from .draw import Hidden
from .engine import Joints
from .geometry import Geometry
from .parts import shortened
from .plain_fit import public_notes
from .session import RIG, Session


class Reached(NamedTuple):
    """Parameter before and after the further motion; ratios are of standard deviations [-]."""

    joint: str
    name: str
    sd_before: float
    predicted: float
    reached: float
    errors: tuple[float, float] | None
    """Errors before and after, in standard deviations; None for a parameter that a hidden machine does not have."""


def further(folder: Path, name: str, seconds: float, hidden: Hidden, geometry: Geometry) -> Iterator[Reached]:
    """Fit a part of a recording [s], fly the motion that its fit designs, and fit both."""
    description = load_rig(RIG, "right")
    tree = adjusted(read_exoskeleton(description), description, settings_of_lengths(description, ()))
    recording, flown = folder / f"{name}.mcap", folder / f"{name}_further.mcap"
    (first,) = read_motions(description, [recording], {}, is_torque=False)
    notes = public_notes(recording)
    starts = [float(note["t"]) for note in notes if "phase" in note]
    motions = shortened(first.motions, starts, min(seconds / first.seconds, 1.0))
    before = fit_machine(description, tree, motions)
    shown = shown_parameters(description, before)
    design = write_further_motion(folder / f"{name}_{MOTION}", description, tree, before, shown)
    session = Session(geometry, lambda _gain: hidden, float(notes[-1]["t"]))
    session.record_motion(flown, read_empty_motion(design.file, description))
    (second,) = read_motions(description, [flown], {}, is_torque=False)
    after = fit_machine(description, tree, (*motions, *second.motions))
    truth = _truth(hidden, description.nominal_gain)
    predicted = {(one.joint, one.parameter): one.sd_ratio for one in design.expected}
    for j, of in shown:
        (value, sd), (later, sd_later) = (_value(found, of, j) for found in (before, after))
        true = truth.get(of)
        errors = None if true is None else ((value - true[j]) / sd, (later - true[j]) / sd_later)
        joint = description.joints[j]
        yield Reached(joint, of, sd, predicted[joint, of], sd_later / sd, errors)


def further_table(rows: list[Reached]) -> str:
    """Table of all parameters, and of each name the median ratios."""
    lines = [
        "| joint | parameter | SD before | ratio predicted | reached | error before, after [SD] |",
        "|" + "---|" * 6,
    ]
    for row in rows:
        errors = "-" if row.errors is None else ", ".join(f"{error:+.1f}" for error in row.errors)
        cells = (row.joint, row.name, f"{row.sd_before:.4g}", f"{row.predicted:.2f}", f"{row.reached:.2f}", errors)
        lines.append(f"| {' | '.join(cells)} |")
    for name in dict.fromkeys(row.name for row in rows):
        of = [row for row in rows if row.name == name]
        told = [float(np.median([getattr(row, kind) for row in of])) for kind in ("predicted", "reached")]
        lines.append(f"{name}: median ratio predicted {told[0]:.2f}, reached {told[1]:.2f}")
    return "\n".join(lines)


def _value(found: MachineFit, name: str, joint: int) -> tuple[float, float]:
    place = found.fit.prior.layout.of(name).start + joint
    return float(found.fit.theta[place]), float(found.fit.sd[place])


def _truth(hidden: Hidden, nominal_gain: Joints) -> dict[str, Joints]:
    """Return true values that a hidden machine shares with the model of the fit."""
    values = hidden.values
    return {
        "inverse_gain": nominal_gain / values["gain"],
        "rotor": values["rotor"],
        "offset": hidden.sensing.encoder_offset,
    }
