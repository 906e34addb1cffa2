"""Identification of a wearer whose muscles are measured by EMG, beside the same motion without, on the twin.

    python benchmarks/muscle_signals.py --seeds 3100-3107                  # level 2, muscles of level 4
    python benchmarks/muscle_signals.py --seeds 3200-3207 --level 4 --no-restless

The machine moves each wearer for 120 s. One recorded motion is identified several times: without signals; with the
torque of the muscles itself, through gains that drift; with the published error of torque from EMG (0.96 to 1.43 N·m
RMS) and twice that; and with signals of another time of the same motion, which must gain nothing. Columns: left over at
the worst shoulder axis and at the elbow [N·m], medians; wearers within the coarse target (0.5 / 0.25 N·m) and the
target (0.2 / 0.1); torques at unused postures inside the 95 % interval.
"""

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np
import tyro

from active_information import inside
from exograv.campaigns.benchmark_identification.cases import Case, by_machine, population
from exograv.campaigns.benchmark_identification.streams import Calibrated, calibrate
from exograv.errors import ExogravError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Method, Sample
from exograv.identification.core.muscle_signals import MuscleSignals
from exograv.identification.core.sample_filter import SampleFilter
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.recursive.recursive import Recursive
from exograv.laboratory.amplifier.emg_envelopes import EmgEnvelopes
from exograv.laboratory.preparation import WornTwin
from exograv.laboratory.truth_score import Examination
from exograv.loop.phases import IDENTIFICATION
from exograv.loop.tick_sample import TickSample
from exograv.procedures.identification.estimator_session import build_method
from exograv.procedures.identification.identify import identification_motion

COARSE, TARGET = (0.5, 0.25), (0.2, 0.1)
"""Largest left over at the worst shoulder axis and at the elbow [N·m]."""

DURATIONS_S = (20.0, 60.0, 118.0)
SIGNALS = {"none": None, "exact": 0.0, "EMG": 1.0, "EMG, twice the error": 2.0, "EMG of another time": 1.0}
ANOTHER_TIME = "EMG of another time"


@dataclass(frozen=True)
class Options:
    """Options of the comparison."""

    seeds: str = "3100-3107"
    level: int = 2
    restless: bool = True
    """True for the muscles of level 4 in a wearer of `level`."""


class Recorder:
    """Listener that keeps the motion and, of each kind of signals, the envelopes."""

    def __init__(self, worn: WornTwin, seed: int):
        """Begin with the muscles of this wearer."""
        self._twin, period_s, joints = worn.twin, worn.pilot.rig.period_s, worn.known.assembly.n
        self._filter, freedoms = SampleFilter(joints, period_s), len(worn.twin.truth.tau_muscle)
        factors = {factor for factor in SIGNALS.values() if factor is not None}
        self._sources = {factor: EmgEnvelopes(freedoms, period_s, seed, factor) for factor in factors}
        self._filters = {factor: SampleFilter(2 * freedoms, period_s) for factor in factors}
        self._means = {factor: Averages(BATCH_PERIOD_S) for factor in factors}
        self.kept: dict[float, list[Sample]] = {factor: [] for factor in factors}
        """Samples with envelopes, means over `BATCH_PERIOD_S`, by factor of the error."""

    def __call__(self, moment: TickSample) -> None:
        """Take one tick."""
        sample = self._filter.update(moment.state.q, moment.tau_measured, moment.reference.q)
        torque = self._twin.truth.tau_muscle
        for factor, source in self._sources.items():
            shown = source.next(torque)
            sample.muscles = self._filters[factor].update(shown, shown).q
            if self._filter.settled and (mean := self._means[factor].take(sample)) is not None:
                self.kept[factor].append(mean)


def recorded(case: Case, calibrated: Calibrated) -> tuple[WornTwin, dict[float, list[Sample]]]:
    """Move the wearer, and return the samples by factor of the error."""
    worn = calibrated.worn(case, case.laboratory(), lambda _text, _share: None)
    worn.controller.mode.drive = IDENTIFICATION.drive.goal(is_known=False)
    path = identification_motion(worn.known.assembly, DURATIONS_S[-1] + 2.0, worn.pilot.rig.period_s)
    worn.pilot.run(worn.controller, IDENTIFICATION.approach(worn.pilot.q, path.q[0], path.dt), "")
    recorder = Recorder(worn, case.wearer_seed)
    worn.pilot.run(worn.controller, path, "", recorder)
    return worn, recorder.kept


def signals_of(kind: str, kept: dict[float, list[Sample]]) -> list[Sample]:
    """Return the samples as the estimator gets them."""
    factor = SIGNALS[kind]
    if factor is None:
        return [replace(sample, muscles=None) for sample in kept[0.0]]
    samples = kept[factor]
    if kind != ANOTHER_TIME:
        return samples
    third = len(samples) // 3
    return [
        replace(sample, muscles=other.muscles)
        for sample, other in zip(samples, samples[third:] + samples[:third], strict=True)
    ]


def identified(worn: WornTwin, samples: list[Sample]) -> list[tuple[float, float, float]]:
    """Worst shoulder axis, elbow [N·m], and share inside the interval, at each duration."""
    assembly, machine = worn.known.assembly, worn.known.machine
    signals = None if samples[0].muscles is None else MuscleSignals(len(samples[0].muscles))
    model, examination = ArmModel(assembly, machine), Examination(worn.laboratory, assembly, machine)
    method = build_method("recursive", assembly, machine, model.again(), muscles=signals)
    found, times = [], list(DURATIONS_S)
    for sample in samples:
        if times and sample.t > times[0]:
            times.pop(0)
            found.append(_score(examination, model, method))
        method.update(sample)
    if times:
        found.append(_score(examination, model, method))
    return found


def _score(examination: Examination, model: ArmModel, method: Method) -> tuple[float, float, float]:
    assert isinstance(method, Recursive)
    method.relinearise()
    estimate = method.estimate()
    left = examination.score(estimate.x).total
    return float(left[:3].max()), float(left[3]), inside(examination, model.again(), estimate)


def main() -> None:
    """Print a line per wearer and kind of signals, then the table."""
    options = tyro.cli(Options, description=__doc__)
    first, _, last = options.seeds.partition("-")
    count = int(last or first) - int(first) + 1
    found: dict[str, list[list[tuple[float, float, float]]]] = defaultdict(list)
    for cases in by_machine(population("harmonic", options.level, count, int(first), restless=options.restless)):
        calibrated = calibrate(cases[0], lambda _text, _share: None)
        for case in cases:
            try:
                worn, kept = recorded(case, calibrated)
            except ExogravError as error:
                print(f"wearer {case.wearer_seed}: stopped: {error}", flush=True)
                continue
            for kind in SIGNALS:
                rows = identified(worn, signals_of(kind, kept))
                found[kind].append(rows)
                columns = "   ".join(f"{shoulder:.2f} / {elbow:.2f}" for shoulder, elbow, _ in rows)
                print(f"wearer {case.wearer_seed}, {kind:20s} {columns}", flush=True)
    for k, seconds in enumerate(DURATIONS_S):
        print(f"\nafter {seconds:.0f} s: left over, within coarse target, within target, inside 95 %")
        for kind, wearers in found.items():
            shoulder, elbow, share = np.array([rows[k] for rows in wearers]).T
            within = [np.mean((shoulder <= most[0]) & (elbow <= most[1])) for most in (COARSE, TARGET)]
            print(
                f"{kind:20s} {np.median(shoulder):.2f} / {np.median(elbow):.2f}   {within[0]:4.0%}   {within[1]:4.0%}"
                f"   {share.mean():4.0%}   of {len(wearers)}"
            )


if __name__ == "__main__":
    main()
