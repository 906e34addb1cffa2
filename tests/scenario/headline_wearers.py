"""Medians and interval coverage of some wearers, by the name of a world and the number of wearers, as JSON.

This is a script, so that shape checks do not slow the ticks.
"""

import json
import sys
from typing import NamedTuple, get_args

import numpy as np

from exograv.campaigns.benchmark_identification.cases import Case, by_machine
from exograv.campaigns.benchmark_identification.work import WearerTask, run_machine
from exograv.options import WorldName

MOTION_S = 60.0


class Headline(NamedTuple):
    """Medians over the wearers of a battery after 60 s of motion, and shares of intervals that hold the truth."""

    shoulder_Nm: float
    """Left over of the worst shoulder axis."""
    elbow_Nm: float
    parameters: float
    torque: float


def headline(world: WorldName, wearers: int) -> Headline:
    cases = [Case("harmonic", 2, wearer_seed=40 + k, machine_seed=40, turn=k, world=world) for k in range(wearers)]
    runs = [
        run
        for group in by_machine(cases)
        for run in run_machine([WearerTask(case, ("recursive",), ()) for case in group], lambda _: None, MOTION_S)
    ]
    assert [run.failed for run in runs] == [None] * wearers
    left_over = np.array([run.left_over_Nm[-1] for run in runs], dtype=float)
    parameters = [held for run in runs for held in run.intervals["60"].parameters.values()]
    held, counted = np.sum([run.intervals["60"].torque for run in runs], axis=0)
    return Headline(
        float(np.median(left_over[:, :3].max(axis=1))),
        float(np.median(left_over[:, 3])),
        float(np.mean(parameters)),
        float(held / counted),
    )


if __name__ == "__main__":
    worlds = {name: name for name in get_args(WorldName)}
    print(json.dumps(headline(worlds[sys.argv[1]], int(sys.argv[2]))))
