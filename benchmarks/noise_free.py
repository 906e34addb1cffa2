"""Residual torque that the form of the arm alone leaves: relaxed motion without noise, restlessness and tissue.

    python benchmarks/noise_free.py --seed 2006

The twin has the usual friction of level 0; only geometry, cuffs and linear springs of the wearer are at level 2. Two
rows: with and without the shift of the shoulder's centre with elevation. Per row the residual torque of the arm after
60 and 120 s, by joint [N·m], of the estimator without tissue, slip and discrepancy.
"""

import argparse
from dataclasses import dataclass, fields, replace

import numpy as np

from exograv.campaigns.benchmark_identification.cases import Case, population
from exograv.campaigns.benchmark_identification.stream_replay import replay
from exograv.campaigns.benchmark_identification.streams import calibrate, record_stream
from exograv.campaigns.benchmark_identification.wearer_judge import WearerJudge, latest
from exograv.identification import methods
from exograv.identification.core.prior import prior
from exograv.laboratory.truth_score import Examination
from exograv.procedures.identification.estimator_session import setting_of
from exograv.rig.twin import Disturbances

LEVEL, SHIFT = 2, "glenohumeral_shift"
GEOMETRY = (
    "cuff_stiffness", "cuff_rotation", "cuff_damping", "carrying_angle", "elbow_axis", "donning_offset",
    "length_error", "between_study", "centre_off_axis", "passive_stiffness", "passive_damping",
)  # fmt: skip
SECONDS = (60.0, 120.0)


@dataclass(frozen=True)
class GeometryCase(Case):
    """Case in which only some disturbances are at `LEVEL`, and all others at level 0."""

    rows: tuple[str, ...] = ()

    @property
    def disturbances(self) -> Disturbances:
        """Disturbances of the twin."""
        found = Disturbances.at_level(0, self.world)
        for row in self.rows:
            found = found.with_row(row, LEVEL)
        return found


def left_over(case: Case) -> list[str]:
    """Record the motion of a case, and return the residual torque of its arm after `SECONDS`."""

    def silent(_text: str, _share: float) -> None:
        """Ignore progress: one line per case is enough."""

    recorded = record_stream(case, calibrate(case, silent), silent, SECONDS[-1])
    stream = recorded.stream
    judge = WearerJudge(recorded.case, stream.assembly, stream.machine, recorded.laboratory)
    setting = setting_of(judge.model.again(), prior(stream.assembly, stream.machine))
    plain = replace(setting, springs=None, cuffs=None, discrepancy=None)
    estimates = replay(methods.built("recursive", plain), stream.samples).estimates
    examination, cells = Examination(recorded.laboratory, stream.assembly, stream.machine), list[str]()
    for seconds in SECONDS:
        estimate = latest(estimates, seconds)
        assert estimate is not None
        rms = np.sqrt(np.mean(examination.arm_error(estimate.x) ** 2, axis=0))
        cells.append(f"{seconds:.0f} s: " + " ".join(f"{value:.3f}" for value in rms))
    return cells


def main() -> None:
    """Print both rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=2006)
    seed = parser.parse_args().seed
    (base,) = population("harmonic", LEVEL, 1, seed)
    same = {one.name: getattr(base, one.name) for one in fields(Case)}
    for name, rows in (("with shift", (*GEOMETRY, SHIFT)), ("without shift", GEOMETRY)):
        print(f"{name:14}", *left_over(GeometryCase(**same, rows=rows)), sep="   ", flush=True)


if __name__ == "__main__":
    main()
