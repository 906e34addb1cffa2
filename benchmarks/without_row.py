"""Left over of simulated wearers with one row of the disturbances switched off: what limits the accuracy.

    python benchmarks/without_row.py --rows end_stops,donning_offset --seeds 2000-2004
    python benchmarks/without_row.py --rows all --seeds 2000-2000      # each row of the yardstick, one after another

Closed loop, 60 s, level 2, home. One line per wearer and row, and one with all rows: left over by joint [N·m], and the
range of each freedom of the true arm during the motion [°].
"""

import argparse

import numpy as np

from exograv.errors import ExogravError
from exograv.identification.core.interface import Sample
from exograv.laboratory.preparation import Preparation, WornTwin
from exograv.laboratory.truth_score import Examination
from exograv.laboratory.virtual_laboratory import laboratory_at
from exograv.model.description import load_rig
from exograv.rig.twin import Disturbances
from exograv.rig.twin.disturbances.levels import ROWS
from seeds import seed_range

RIG, LEVEL = "recupera_like", 2


class Postures:
    """Follower of an identification that keeps the range of the true arm's freedoms."""

    def __init__(self, worn: WornTwin):
        self._twin, self.found = worn.twin, list[np.ndarray]()

    def __call__(self, _sample: Sample) -> None:
        """Note the posture of this sample."""
        self.found.append(self._twin.arm_motion()[0].copy())

    def __str__(self) -> str:
        degrees = np.rad2deg(self.found)
        return ", ".join(f"{low:.0f} to {high:.0f}" for low, high in zip(degrees.min(0), degrees.max(0), strict=True))


def line(seed: int, disturbances: Disturbances) -> str:
    """Identify one wearer; return left over and range, or why it was not possible."""
    laboratory = laboratory_at(load_rig(RIG), disturbances, seed, seed)
    preparation = Preparation(laboratory, seed)
    try:
        worn = preparation.worn(preparation.calibrated())
        identifier, postures = worn.identifier(), Postures(worn)
        identifier.followers.append(postures)
        found = worn.identify(identifier)
    except ExogravError as error:
        return str(error).split(". ")[0]
    left = Examination(laboratory, worn.known.assembly, worn.known.machine).score(found.floated.x).total
    return f"{', '.join(f'{value:.3f}' for value in left)} N·m; {postures}°"


def main() -> None:
    """Print one line per wearer and row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", default="end_stops")
    parser.add_argument("--seeds", default="2000-2004")
    options = parser.parse_args()
    rows = list(ROWS) if options.rows == "all" else options.rows.split(",")
    everything = Disturbances.at_level(LEVEL)
    for seed in seed_range(options.seeds):
        print(f"{seed} all rows: {line(seed, everything)}", flush=True)
        for row in rows:
            print(f"{seed} without {row}: {line(seed, everything.without(row))}", flush=True)


if __name__ == "__main__":
    main()
