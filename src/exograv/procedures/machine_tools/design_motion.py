"""Design of the identification motion of a machine: the block for its rig file, and the left over that it predicts."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv import motion
from exograv.errors import ConfigError
from exograv.files import replace_file
from exograv.identification.core.left_over import TARGET_NM
from exograv.identification.excitation import Basis, Designer, fixed_motion, harmonic
from exograv.identification.excitation.basis import Coefficients, excitation_block, excitation_text
from exograv.identification.excitation.design import Progress
from exograv.loop.machine_limits import refuse_motorless
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.rig_settings import Excitation
from exograv.model.support import assemble
from exograv.motion import Trajectory
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.results import OPTIONAL

from .options import DesignOptions

FORECAST_S = (20.0, 60.0, 120.0)
DT = 0.02  # s: step of the tables that are judged; the filter takes every eighth row
STANDARD_PERIOD_S = 20.0


@dataclass(frozen=True)
class DesignFigures:
    """Result of `exograv rig motion`."""

    rig: str
    joints: tuple[str, ...]
    excitation: Excitation
    targets_Nm: list[float]
    predicted_left_over_Nm: dict[str, dict[str, list[float]]]
    """Predicted left over of each joint [N·m], by motion and by seconds of motion.

    After Ctrl-C without `fourier`, because that motion needs a search of its own.
    """

    starts: int
    """Number of starts that were searched."""
    is_interrupted: bool
    """True if Ctrl-C ended the search."""
    seed: int
    wall_s: float
    picture: Path | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True)
class DesignedMotion:
    """Result of a design, with the tables that a picture needs."""

    figures: DesignFigures

    path: Trajectory
    """Trajectory of one period."""

    limits_deg: tuple[list[float], list[float]]
    """Lower and upper limits of the joints [°]."""


def design_motion(options: DesignOptions, progress: Progress) -> DesignedMotion:
    """Design the motion for a table person in a machine by its data sheets, without a twin.

    Raises:
        ConfigError: An option or the rig file cannot be used.
        ModelError: Machine and person do not fit.
    """
    began = time.monotonic()
    description = load_rig(options.rig, options.side)
    refuse_motorless(description)
    assembly = assemble(description, Body(options.height_m, options.mass_kg, options.sex))
    designer = Designer(assembly, nominal_machine(description, assembly.exo.phi))
    present = description.excitation
    starts = [_start_of(present), *designer.starts(options.period_s, options.harmonics, options.starts, options.seed)]
    search = designer.designs(starts, options.iterations, options.seconds, progress)
    best = search.designs[0]
    block = excitation_block(best.basis, best.coefficients)
    progress("Comparing with other motions", 0.0)
    seconds = max(FORECAST_S)
    paths = {
        "designed": periodic(block, seconds, DT),
        "present": periodic(present, seconds, DT),
        "fixed": fixed_motion(designer.limits, seconds, DT),
    }
    if not search.is_interrupted:
        standard = designer.standard(STANDARD_PERIOD_S, options.seed, options.seconds)
        paths["fourier"] = standard.basis.trajectory(standard.coefficients, seconds, DT)
    predicted = {name: _rounded(designer.forecast.left_over(path, FORECAST_S)) for name, path in paths.items()}
    progress("Comparing with other motions", 1.0)
    wall_s, targets = round(time.monotonic() - began, 1), _targets(assembly)
    figures = DesignFigures(
        description.name, description.joints, block, targets, predicted, search.starts, search.is_interrupted,
        options.seed, wall_s,
    )  # fmt: skip
    edges = designer.limits.lower, designer.limits.upper
    limits_deg = np.rad2deg(edges[0]).tolist(), np.rad2deg(edges[1]).tolist()
    return DesignedMotion(figures, periodic(block, block.period_s, DT), limits_deg)


def write_excitation(path: Path, block: Excitation) -> None:
    """Replace the block [excitation] of a `rig.toml`; every other line stays.

    Raises:
        ConfigError: The file cannot be read or written.
    """
    import tomlkit

    try:
        content = tomlkit.parse(path.read_text(encoding="utf-8"))
        content["excitation"] = tomlkit.parse(excitation_text(block))["excitation"]
        replace_file(path, tomlkit.dumps(content))
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error.strerror}. Check its permissions.") from error


def motion_note(rig: str) -> str | None:
    """Sentence that the motion of a machine is not designed for it; None if it is, or if the machine has no motion.

    Raises:
        ConfigError: The machine is unknown, or its `rig.toml` cannot be used.
    """
    plan = load_rig(rig).settings.excitation
    if plan is None or plan.source != "proposed":
        return None
    return (
        "The motion that identifies the arm is the proposal of `exograv rig new`, not designed for this machine: more "
        f"torque is left over. `exograv rig motion {rig} --write` designs it in some minutes; calibrate afterwards."
    )


def periodic(block: Excitation, seconds: float, dt: float) -> Trajectory:
    """Return the periodic motion, without a start from rest."""
    centre, sine, cosine = (np.deg2rad(part) for part in (block.centre_deg, block.sine_deg, block.cosine_deg))
    return motion.fourier(centre, sine, cosine, block.period_s, seconds, dt)


def _start_of(block: Excitation) -> tuple[Basis, Coefficients]:
    """Return the present motion as a start of the search.

    The result is then not worse than the part of the present motion within the limits.
    """
    rows = np.vstack([[block.centre_deg], block.sine_deg, block.cosine_deg])
    return harmonic(block.period_s, len(block.sine_deg)), np.deg2rad(rows)


def _targets(assembly: Assembly) -> list[float]:
    return [TARGET_NM[place] for place in assembly.description.places]


def _rounded(found: Mapping[float, np.ndarray]) -> dict[str, list[float]]:
    return {f"{t:g}": np.round(left, 4).tolist() for t, left in found.items()}
