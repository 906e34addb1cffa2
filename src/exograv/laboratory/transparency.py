"""Transparency of a kind of machine: muscle effort of one movement in six conditions, over several machines."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.errors import ConfigError, ExogravError
from exograv.loop.pilot import Progress
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.report.figures.transparency_data import MachineTransparency
from exograv.results import MERGED, OPTIONAL
from exograv.rig.twin.twin import PERIOD
from exograv.storage.self_test_pass import NOT_NEEDED

from .effort import Effort
from .movements import WantedMovement, pointing, recorded
from .options import MovementName, TransparencyOptions
from .transparency_summary import rig_result
from .transparency_trial import CONDITIONS, TransparencyTrial, run_trial

BOTH_PROFILES = ("recupera_like", "recupera_like_qdd")
"""The same machine on harmonic and on quasi-direct drives."""


@dataclass(frozen=True)
class TransparencyResult:
    """Result of `exograv dev transparency`."""

    machine: MachineTransparency | None = field(metadata=MERGED)
    """Figures of the requested machine."""
    profiles: Mapping[str, MachineTransparency] | None = field(metadata=OPTIONAL)
    """Figures of both kinds of drives, if no machine was requested."""
    self_test: str
    wall_s: float
    report: Path


def run_transparency(options: TransparencyOptions, folder: Path, progress: Progress) -> TransparencyResult:
    """Run the test on every kind of machine and write the page.

    Raises:
        ConfigError: An option or a machine cannot be used.
        ModelError: Machine or wearer cannot be modelled.
        RigError: The envelope stopped a run.
        RecordingError: Recorded movements are missing, or the folder cannot be written.
    """
    start = time.perf_counter()
    rigs = BOTH_PROFILES if options.rig is None else (options.rig,)
    # All refusals come before the first minute of computation.
    plans = [(description, movement_for(options.movement, description)) for description in map(_loaded(options), rigs)]
    results = []
    for k, (description, movement) in enumerate(plans):

        def note(text: str, share: float, k: int = k) -> None:
            progress(text, (k + share) / len(plans))

        results.append(_run_rig(options, description, movement, note))
    from exograv.report.of_benchmarks.transparency_report import write_transparency_report  # Matplotlib: 0.4 s

    report = write_transparency_report(results, folder / "transparency.html")
    return TransparencyResult(
        machine=None if options.rig is None else results[0],
        profiles={one.profile: one for one in results} if options.rig is None else None,
        self_test=NOT_NEEDED,
        wall_s=round(time.perf_counter() - start, 1),
        report=report,
    )


def movement_for(name: MovementName, description: RigDescription) -> WantedMovement:
    """Return the movement of the wearer of this machine.

    Raises:
        ConfigError: The machine has no motors or two arms, or the recorded movement does not fit it.
        RecordingError: The recordings are missing.
    """
    if description.motorless:
        raise ConfigError(
            f"{description.name} has no motor at {', '.join(description.motorless)}: nothing can be compensated there. "
            "Choose a machine with motors (see `exograv rigs`)."
        )
    if len(description.arm_sides) > 1:
        raise ConfigError(
            f"{description.name} moves both arms; effort is measured on one. Choose a machine for one arm, for example "
            f"{BOTH_PROFILES[0]}."
        )
    if name == "pointing":
        return pointing(len(description.arm_donning_posture), PERIOD)
    if len(description.joints) != 4 or description.settings.donning.arm_posture_deg is not None:
        raise ConfigError(
            f"--movement recorded needs a machine with four joints like the arm's; those of {description.name} are "
            f"{', '.join(description.joints)}. Choose --movement pointing."
        )
    joints = read_exoskeleton(description).joints
    return recorded(np.array([j.lower for j in joints]), np.array([j.upper for j in joints]), PERIOD)


def _loaded(options: TransparencyOptions):
    return lambda rig: load_rig(rig, options.side)


def _run_rig(
    options: TransparencyOptions, description: RigDescription, movement: WantedMovement, note: Progress
) -> MachineTransparency:
    efforts: dict[str, list[Effort]] = {condition: [] for condition in CONDITIONS}
    seeds = list(range(options.seed, options.seed + options.machines))
    for k, seed in enumerate(seeds):

        def tell(text: str, share: float, k: int = k) -> None:
            note(f"{description.name}, machine {k + 1} of {len(seeds)}: {text}", (k + share) / len(seeds))

        try:
            trial = TransparencyTrial(description, options.level, seed, options.world, options.twin)
            of_machine = run_trial(trial, movement, tell)
        except ExogravError as error:
            raise type(error)(f"{description.name}, seed {seed}: {error}") from error
        for condition, effort in of_machine.items():
            efforts[condition].append(effort)
    return rig_result(description, options, seeds, movement, efforts)
