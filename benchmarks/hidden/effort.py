"""Effort of a wearer in a hidden machine and in its fitted twin, by the procedure of `exograv dev transparency`.

Control gets the machine's description with the links of the fit: with those of the URDF, which are off by 10 to 40 %,
the calibration takes its weights for wrong and refuses. Its message advises to correct the URDF.
"""

import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from exograv.laboratory.effort import Effort
from exograv.laboratory.fitted_machine import fitted_machine
from exograv.laboratory.movements import pointing
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.transparency_trial import UNREST, worn_effort
from exograv.laboratory.virtual_laboratory import laboratory_at
from exograv.model.description import RigDescription, load_rig
from exograv.rig.twin import Disturbances
from exograv.rig.twin.twin import PERIOD
from exograv.storage.twin_file import NAME, StoredTwin, read_twin

from .draw import Hidden
from .geometry import Geometry, with_links
from .worn import HiddenLaboratory, HiddenPreparation

LEVEL = 2
"""Level of the wearer's disturbances, and of what a fitted twin does not tell."""

PreparationWithout = Callable[..., Preparation]
"""Function that prepares a run without the named disturbances."""


@dataclass(frozen=True)
class Ratio:
    """Effort of one wearer with the arm carried, and with the machine alone carried."""

    dam: Effort
    gcm: Effort

    @property
    def value(self) -> float:
        """DAM over GCM [-]."""
        return total(self.dam) / total(self.gcm)

    @property
    def keeps_path(self) -> bool:
        """True if both performances are the same movement."""
        return self.dam.keeps_path and self.gcm.keeps_path


def total(effort: Effort) -> float:
    """Effort of all joints [N·m·s]."""
    return float(effort.absolute.sum())


def ratio(prepared: PreparationWithout) -> Ratio:
    """Calibrate, identify the arm, and measure pointing in both conditions.

    Raises:
        ExogravError: Calibration, identification or a run was refused or stopped.
    """
    known = prepared().identified()
    movement = pointing(len(prepared().laboratory.description.arm_donning_posture), PERIOD)
    efforts = {name: worn_effort(prepared(*UNREST), name, known, movement, _no_note) for name in ("dam", "gcm")}
    return Ratio(**efforts)


def fitted(description: RigDescription, whole: StoredTwin, wearer: int, draw: int, run: int = 0) -> PreparationWithout:
    """Return a run of a wearer in a draw from the posterior of a fitted twin."""

    def prepared(*off: str) -> Preparation:
        disturbances = Disturbances.at_level(LEVEL).without(*off)
        worn = laboratory_at(description, disturbances, wearer, wearer)
        machine = fitted_machine(description, whole, disturbances, draw)
        return Preparation(replace(worn, machine=machine), seed_of(wearer, run))

    return prepared


def corrected(folder: Path, whole: StoredTwin) -> RigDescription:
    """Write the machine again, beside its folder, with the links of its fitted twin in the URDF."""
    before, out = load_rig(str(folder), "right"), folder.with_name(f"{folder.name}_corrected")
    shutil.copytree(folder, out, dirs_exist_ok=True, ignore=shutil.ignore_patterns(NAME))
    links = fitted_machine(before, whole, Disturbances.at_level(LEVEL), 0, is_mean=True).links
    if links is None:
        raise ValueError(f"The twin in {folder} has no links.")
    (out / before.urdf_path.name).write_text(with_links(before.urdf_text(), links), encoding="utf-8")
    return load_rig(str(out), "right")


def hidden_machine(
    description: RigDescription, wearer: int, hidden: Hidden, geometry: Geometry, ran_s: float, run: int = 0
) -> PreparationWithout:
    """Return a run of the same wearer in the hidden machine, which has run for this time [s]."""

    def prepared(*off: str) -> Preparation:
        disturbances = Disturbances.at_level(LEVEL).without(*off)
        worn = laboratory_at(description, disturbances, wearer, wearer)
        return HiddenPreparation(HiddenLaboratory.of(worn, hidden, geometry, ran_s), seed_of(wearer, run))

    return prepared


def draws_of(wearer: int, draws: int) -> list[int]:
    """Seeds of the draws from the posterior that predict the effort of a wearer."""
    return [1000 * wearer + number for number in range(draws)]


def seed_of(wearer: int, run: int) -> int:
    """Seed of the noise and the muscles in a run of a wearer."""
    return 1000 * run + wearer


def compare_effort(folder: Path, hidden: Hidden, geometry: Geometry, ran_s: float, wearers: int, draws: int) -> None:
    """Print DAM over GCM of several wearers: a run in the hidden machine for each draw from the twin that predicts it.

    The hidden machine is the same in all runs: their scatter is that of noise and muscles.
    """
    whole = read_twin(load_rig(str(folder), "right"))
    description, differences, scatter = corrected(folder, whole), list[float](), list[float]()
    print("| wearer | dam, hidden (predicted) N·m·s | gcm | dam/gcm by run, hidden | predicted by draw | difference |")
    print("|---|---|---|---|---|---|")
    for wearer in range(wearers):
        own = [ratio(hidden_machine(description, wearer, hidden, geometry, ran_s, run)) for run in range(draws)]
        found = [
            ratio(fitted(description, whole, wearer, draw, run)) for run, draw in enumerate(draws_of(wearer, draws))
        ]
        values, predicted = ([one.value for one in some] for some in (own, found))
        differences.append(float(np.mean(predicted) - np.mean(values)))
        if draws > 1:
            scatter.append(float(np.var(values, ddof=1)))
        row = (
            str(wearer),
            f"{_mean(one.dam for one in own):.0f} ({_mean(one.dam for one in found):.0f})",
            f"{_mean(one.gcm for one in own):.0f} ({_mean(one.gcm for one in found):.0f})",
            *(", ".join(f"{one:.3f}" for one in some) for some in (values, predicted)),
            f"{differences[-1]:+.3f}{'' if all(one.keeps_path for one in (*own, *found)) else ', path not kept'}",
        )
        print(f"| {' | '.join(row)} |", flush=True)
    half = 1.96 * float(np.std(differences, ddof=1)) / np.sqrt(wearers) if wearers > 1 else np.nan
    print(
        f"mean difference {np.mean(differences):+.3f} ± {half:.3f}, largest {np.abs(differences).max():.3f} (goal 0.05)"
    )
    if scatter:
        print(
            f"standard deviation between the runs of one wearer in the hidden machine {np.sqrt(np.mean(scatter)):.3f}"
        )


def _mean(efforts: Iterable[Effort]) -> float:
    return float(np.mean([total(one) for one in efforts]))


def _no_note(_share: float) -> None:
    """Ignore the progress of a performance."""
