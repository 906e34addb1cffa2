"""Tuning of the identification methods: the same budget for all, on training wearers only.

    python benchmarks/streams.py --seeds 1000-1005 --level 2 --folder out/streams
    python benchmarks/streams.py --seeds 1000-1001 --level 0 --folder out/streams
    python benchmarks/tune_methods.py --folder out/streams

Each method has at most nine settings (`CANDIDATES` in its file), tried on the first 60 s of the six streams of level 2.
The criterion is the larger of torque left over / target at shoulder (0.2 N·m, worst axis) and elbow (0.1 N·m): the mean
over 10, 20, 40 and 60 s of motion (nearly evenly spaced in log time), then the median over streams. The script chooses
the best setting that also reaches the target on the streams of level 0, or the best of all if none does. `recursive`
and `oracle` have no setting: their noise and their prior are not chosen by this criterion.
"""

import argparse
import math
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from exograv.campaigns.benchmark_identification.streams import RecordedStream
from exograv.errors import ExogravError
from exograv.identification import methods
from exograv.identification.baselines.gradient import Gradient
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Method
from exograv.identification.core.prior import prior
from exograv.laboratory.truth_score import Examination
from exograv.procedures.identification.estimator_session import setting_of, table_guess
from exograv.procedures.identification.method_names import MethodName
from streams import load

CANDIDATES: Mapping[str, tuple[Mapping[str, float], ...]] = {
    "gradient": tuple({"step": step} for step in (1e-8, 3e-8, 1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4)),
    **methods.CANDIDATES,
}
MARKS_S = (10.0, 20.0, 40.0, 60.0)
TARGET_NM = np.array([0.2, 0.2, 0.2, 0.1])
WORST = 20.0  # times the target: the score of a method that diverged
SETTLES = 1e-3  # s, so that the last mark lies within the motion


class Wearer:
    """Training stream with its examiner."""

    def __init__(self, recorded: RecordedStream):
        self._stream = recorded.stream
        self._examination = Examination(recorded.laboratory, self._stream.assembly, self._stream.machine)
        self._model = ArmModel(self._stream.assembly, self._stream.machine)

    def ratios(self, name: MethodName, tuning: Mapping[str, float]) -> list[float]:
        """Return torque left over / target at each mark."""
        method, left, found = self._built(name, tuning), list(MARKS_S), []
        for sample in self._stream.samples:
            method.update(sample)
            if sample.t >= left[0] - SETTLES:
                left.pop(0)
                found.append(self._ratio(method.estimate().x))
                if found[-1] >= WORST:
                    return found + [WORST] * len(left)
                if not left:
                    break
        return found

    def _built(self, name: MethodName, tuning: Mapping[str, float]) -> Method:
        assembly, machine = self._stream.assembly, self._stream.machine
        if name == "gradient":
            return Gradient(assembly, machine, table_guess(assembly, machine), **tuning)
        return methods.built(name, setting_of(self._model.again(), prior(assembly, machine)), tuning)

    def _ratio(self, x: np.ndarray) -> float:
        if not np.isfinite(x).all():
            return WORST
        left_over = self._examination.score(x).total
        ratio = float((left_over / TARGET_NM).max())
        return min(ratio, WORST) if math.isfinite(ratio) else WORST


def survived(wearer: Wearer, name: MethodName, tuning: Mapping[str, float]) -> list[float]:
    """Return the ratios; the worst ones if a gradient descent diverged to non-finite values."""
    with np.errstate(all="ignore"):
        try:
            return wearer.ratios(name, tuning)
        except (ExogravError, np.linalg.LinAlgError, ValueError):
            return [WORST] * len(MARKS_S)


def tune(name: MethodName, disturbed: list[Wearer], undisturbed: list[Wearer]) -> None:
    """Print every candidate and the chosen one."""
    merits: list[tuple[float, Mapping[str, Any]]] = []
    for tuning in CANDIDATES[name]:
        ratios = np.array([survived(wearer, name, tuning) for wearer in disturbed])
        merits.append((float(np.median(ratios.mean(axis=1))), tuning))
        row = " ".join(f"{value:6.2f}" for value in np.median(ratios, axis=0))
        print(f"{name:15} {_words(tuning):40} at 10, 20, 40, 60 s {row}   criterion {merits[-1][0]:6.2f}", flush=True)
    ranked = sorted(merits, key=lambda merit: merit[0])
    for merit, tuning in ranked:
        last = [survived(wearer, name, tuning)[-1] for wearer in undisturbed]
        if max(last) <= 1.0:
            print(f"{name:15} chosen: {_words(tuning)}, {merit:.2f}; at level 0 {max(last):.2f} of the target\n")
            return
        print(f"{name:15} {_words(tuning)} does not reach the target at level 0: {max(last):.2f} times it", flush=True)
    print(f"{name:15} chosen: {_words(ranked[0][1])}, {ranked[0][0]:.2f}; none reaches the target at level 0\n")


def _words(tuning: Mapping[str, float]) -> str:
    return ", ".join(f"{key} {value:g}" for key, value in tuning.items())


def main() -> None:
    """Load the streams once, then tune method by method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--profile", choices=("harmonic", "qdd"), default="harmonic")
    parser.add_argument("--methods", default=",".join(CANDIDATES))
    parser.add_argument("--streams", type=int, default=6, help="number of streams of level 2 from the folder")
    options = parser.parse_args()
    disturbed, undisturbed = (
        [Wearer(recorded) for recorded in islice(load(options.folder, f"{options.profile}-level{level}-*"), count)]
        for level, count in ((2, options.streams), (0, 2))
    )
    print(f"{len(disturbed)} streams of level 2, {len(undisturbed)} of level 0")
    for name in options.methods.split(","):
        tune(name, disturbed, undisturbed)


if __name__ == "__main__":
    main()
