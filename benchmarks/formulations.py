"""Formulations of what the estimator's model cannot explain, compared on the same recorded streams.

    python benchmarks/formulations.py --worlds home,tissue --seeds 2000-2005 --formulations "present,linear cuffs"

One row per world and formulation: left over after 60 and 120 s, worst shoulder axis / elbow, median over the wearers
and largest of them [N·m], stated 95 % intervals of the arm's torque that hold [%], and wearers who reach the target.
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from jaxtyping import Float

from exograv.campaigns.benchmark_identification import measures
from exograv.campaigns.benchmark_identification.cases import by_machine, population
from exograv.campaigns.benchmark_identification.runs import MethodRun
from exograv.campaigns.benchmark_identification.stream_replay import replay
from exograv.campaigns.benchmark_identification.streams import RecordedStream, calibrate, record_stream
from exograv.campaigns.benchmark_identification.wearer_judge import WearerJudge
from exograv.identification import methods
from exograv.identification.core.interface import Method, Sample, TorqueModel
from exograv.identification.core.prior import prior
from exograv.identification.core.setting import Setting
from exograv.identification.core.tissue import TISSUE, Hidden, Springs, TissueModel
from exograv.identification.recursive.recursive import Recursive
from exograv.model.loops import PATH_ENTRIES
from exograv.options import WorldName
from exograv.procedures.identification.estimator_session import setting_of
from seeds import seed_range

FIELD_NM, FIELD_LENGTH_RAD, FIELD_FEATURES = 0.2, 0.5, 16
"""Size [N·m], correlation length [rad] and number of features of the fields that are estimated."""

UNMOVED = 1e-6
"""Factor on the prior standard deviation of a shape that is left out [-]."""


class FieldModel:
    """Model with smooth fields of torque over the posture as further hidden parameters."""

    def __init__(self, model: TissueModel):
        generator, n = np.random.default_rng(3), model.n_joints
        self._model = model
        self._frequencies = generator.standard_normal((FIELD_FEATURES, n)) / FIELD_LENGTH_RAD
        self._phases = generator.uniform(0.0, 2 * np.pi, FIELD_FEATURES)
        self._count = n * FIELD_FEATURES
        sd = np.full(self._count, FIELD_NM * np.sqrt(2.0 / FIELD_FEATURES))
        self.hidden = Hidden(
            np.append(model.hidden.sd, sd), np.append(model.hidden.group, np.full(self._count, TISSUE))
        )
        """Prior of the hidden parameters."""
        self.n_joints, self.n_parameters = n, model.n_parameters + self._count

    def linearise(
        self, sample: Sample, x: Float[np.ndarray, " parameter"]
    ) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] and its derivative."""
        tau, derivative = self._model.linearise(sample, x[: -self._count])
        columns = np.kron(np.eye(self.n_joints), np.cos(self._frequencies @ sample.q + self._phases)[None])
        return tau + columns @ x[-self._count :], np.hstack([derivative, columns])

    def restart(self) -> None:
        """Start a new motion."""
        self._model.restart()

    def direction_uncertainty(self, v: Float[np.ndarray, " joint"]) -> Float[np.ndarray, " joint"]:
        """Return the standard deviation of the torque [N·m], as of the arm model."""
        return self._model.direction_uncertainty(v)


def present(setting: Setting) -> Method:
    """Return the estimator as it is: tissue, considered fields, goodness of fit."""
    return methods.built("recursive", setting)


def straight_springs(setting: Setting) -> Method:
    """Return the estimator without hidden tissue: linear springs only."""
    s = setting
    return Recursive(s.model, s.mean, s.covariance, s.noise, s.bodies, s.discrepancy, None, s.path)


def nothing_considered(setting: Setting) -> Method:
    """Return the estimator with tissue and without considered fields."""
    s, tissue = setting, _tissue(setting)
    return Recursive(tissue, s.mean, s.covariance, s.noise, s.bodies, None, tissue.hidden)


def estimated_fields(setting: Setting) -> Method:
    """Return the estimator with tissue, and with fields that are estimated in place of considered."""
    s, fields = setting, FieldModel(_tissue(setting))
    model: TorqueModel = fields
    return Recursive(model, s.mean, s.covariance, s.noise, s.bodies, None, fields.hidden)


def linear_cuffs(setting: Setting) -> Method:
    """Return the estimator without hidden stiffening and slip of the cuffs."""
    return methods.built("recursive", replace(setting, cuffs=None))


def usual_path(setting: Setting) -> Method:
    """Return the estimator without further shapes of the path of the shoulder's centre."""
    return _with_path(setting, UNMOVED)


def wide_path(setting: Setting) -> Method:
    """Return the estimator with four times the prior standard deviation of these shapes."""
    return _with_path(setting, 4.0)


def known_path(setting: Setting) -> Method:
    """Return the estimator without considered errors of that path."""
    return methods.built("recursive", replace(setting, path=None))


def certain_ends(setting: Setting) -> Method:
    """Return the method with samples near the ends of the wearer's joints as certain as all others."""
    springs = replace(cast(Springs, setting.springs), end_stops=None)
    return methods.built("recursive", replace(setting, springs=springs))


def _with_path(setting: Setting, factor: float) -> Method:
    covariance = setting.covariance.copy()
    for shoulder in cast(Springs, setting.springs).shoulders:
        # The offset of the shoulder is the beginning of an arm's fit.
        begin = shoulder.offset.start
        further = slice(begin + PATH_ENTRIES.start, begin + PATH_ENTRIES.stop)
        covariance[further, :] *= factor
        covariance[:, further] *= factor
    return methods.built("recursive", replace(setting, covariance=covariance))


def _tissue(setting: Setting) -> TissueModel:
    return TissueModel(setting.model, cast(Springs, setting.springs))


FORMULATIONS: Mapping[str, Callable[[Setting], Method]] = {
    "present": present,
    "linear cuffs": linear_cuffs,
    "usual path": usual_path,
    "wide path": wide_path,
    "known path": known_path,
    "certain ends": certain_ends,
    "straight springs": straight_springs,
    "nothing considered": nothing_considered,
    "estimated fields": estimated_fields,
}


def run(recorded: RecordedStream, name: str) -> MethodRun:
    """Run one formulation on one stream, and judge it."""
    stream = recorded.stream
    judge = WearerJudge(recorded.case, stream.assembly, stream.machine, recorded.laboratory)
    setting = setting_of(judge.model.again(), prior(stream.assembly, stream.machine))
    return judge.judge_run("open_loop", name, replay(FORMULATIONS[name](setting), stream.samples))


def streams(world: WorldName, seeds: range) -> list[RecordedStream]:
    """Record the streams of a world."""

    def silent(_text: str, _share: float) -> None:
        """Ignore progress: one row per formulation is enough."""

    recorded = []
    for group in by_machine(population("harmonic", 2, len(seeds), seeds[0], world=world)):
        calibrated = calibrate(group[0], silent)
        recorded += [record_stream(case, calibrated, silent) for case in group]
    return recorded


def main() -> None:
    """Compare the formulations in each world."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", default="home,tissue,shoulder,cuffs,drives,all")
    parser.add_argument("--seeds", default="2000-2005")
    parser.add_argument("--formulations", default=",".join(FORMULATIONS))
    options = parser.parse_args()
    for world in options.worlds.split(","):
        recorded = streams(cast(WorldName, world), seed_range(options.seeds))
        for name in options.formulations.split(","):
            runs = [run(one, name) for one in recorded]
            print(f"{world:9} {name:19}", "; ".join(figures(runs, seconds) for seconds in (60, 120)), flush=True)


def figures(runs: Sequence[MethodRun], seconds: int) -> str:
    """Figures of one formulation after some seconds of motion."""
    row = measures.row(runs)
    left, held = row.left_over_Nm[str(seconds)], row.coverage95_torque_by_duration[str(seconds)]
    largest = [max(measures.left_over(one, float(seconds), place) for one in runs) for place in ("shoulder", "elbow")]
    reached = sum(measures.time_to(one) <= seconds for one in runs)
    return (
        f"{seconds} s {left.shoulder} / {left.elbow} N·m, largest {largest[0]:.2f} / {largest[1]:.2f}, "
        f"{100 * held.covered / max(held.of, 1):.0f} % hold, {reached} of {len(runs)} reach"
    )


if __name__ == "__main__":
    main()
