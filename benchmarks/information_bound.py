"""Bound of what the relaxed motion tells about an arm, beside what the estimator reaches on the same motion.

    python benchmarks/information_bound.py --seeds 200-219 --level 2

The bound is the covariance of a linear estimator that knows all laws of the home world: prior of the arm, noise of the
calibrated machine, slow torque of a wearer who does not relax completely (a first-order process per joint, of the
expected size), and the uncertain direction of friction. It counts no error of the model. Per duration, medians over the
wearers: standard deviation of the residual gravity torque, worst shoulder axis / elbow [N·m], and probability that both
targets are met. Further rows: with silent muscles; with hidden parameters of tissue and cuffs of the smaller and of the
larger size that the estimator weighs; and what the estimator reaches.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

from active_information import information_of
from exograv.campaigns.benchmark_identification.cases import by_machine, population
from exograv.campaigns.benchmark_identification.stream_replay import replay
from exograv.campaigns.benchmark_identification.streams import RecordedStream, calibrate, record_stream
from exograv.campaigns.benchmark_identification.wearer_judge import WearerJudge
from exograv.errors import ExogravError
from exograv.identification import methods
from exograv.identification.core.interface import Covariance
from exograv.identification.core.left_over import TARGET_NM, LeftOverPrediction
from exograv.identification.core.prior import prior
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.core.tissue import CUFFS, TISSUE
from exograv.procedures.identification.estimator_session import setting_of
from seeds import seed_range

DRAWS = 2000
SECONDS = (8.0, 10.0, 14.0, 20.0, 60.0, 120.0)

SIZES = {"small tissue, slip": (0.2, 0.03), "large tissue, slip": (1.0, 1.0)}
"""Factors of the hidden parameters' prior, tissue and cuffs, as the estimator's filters have them."""

Row = list[tuple[float, float, float]]
"""Worst shoulder axis and elbow [N·m], and probability that the targets are met, by duration."""


def drawn(prediction: LeftOverPrediction, covariance: Covariance, places: Sequence[str]) -> tuple[float, float, float]:
    """Return standard deviations of the residual torque, and the share of drawn errors within the targets."""
    targets = np.array([TARGET_NM[place] for place in places])
    values, vectors = np.linalg.eigh(covariance)
    errors = np.random.default_rng(0).standard_normal((DRAWS, len(values))) * np.sqrt(np.maximum(values, 0.0))
    left = np.array([np.sqrt(np.mean(prediction.torque_of(error) ** 2, axis=0)) for error in errors @ vectors.T])
    sd = prediction.rms(covariance)
    return *_worst(sd, places), float((left <= targets).all(axis=1).mean())


def bounds(recorded: RecordedStream, slow_share: float = 1.0, sizes: tuple[float, float] | None = None) -> Row:
    """Return the bound of one wearer.

    Args:
        recorded: The motion.
        slow_share: Slow torque of the muscles, in shares of the expected size [-].
        sizes: Factors of the prior of hidden tissue and cuffs [-]; None without hidden parameters.
    """
    stream, averages = recorded.stream, Averages(BATCH_PERIOD_S)
    arm = WearerJudge(recorded.case, stream.assembly, stream.machine, recorded.laboratory).model
    mean, covariance = prior(stream.assembly, stream.machine)
    setting = setting_of(arm.again(), (mean, covariance))
    noise = replace(setting.noise, disturbance_sd=slow_share * setting.noise.disturbance_sd)
    prediction, before = LeftOverPrediction(arm.again(), mean), np.linalg.inv(covariance)
    kept = [sample for one in stream.samples if (sample := averages.take(one)) is not None]
    told, found = len(mean), Row()
    model, hidden = methods.with_hidden(arm.again(), setting)
    if sizes is None or hidden is None:
        model = arm.again()
    else:
        factor = np.select([hidden.group == TISSUE, hidden.group == CUFFS], sizes, 1.0)
        mean = np.append(mean, np.zeros(len(factor)))
        before = block_diag(before, np.diag((factor * hidden.sd) ** -2.0))
    for seconds in SECONDS:
        model.restart()
        information = information_of(model, [one for one in kept if one.t <= seconds], mean, noise)
        after = np.linalg.inv(before + information)[:told, :told]
        found.append(drawn(prediction, after, stream.assembly.description.places))
    return found


def reached(recorded: RecordedStream) -> Row:
    """Return what the estimator leaves over on the same samples, and whether it meets the targets."""
    stream = recorded.stream
    judge = WearerJudge(recorded.case, stream.assembly, stream.machine, recorded.laboratory)
    setting = setting_of(judge.model.again(), prior(stream.assembly, stream.machine))
    run = judge.judge_run("open_loop", "recursive", replay(methods.built("recursive", setting), stream.samples))
    found = Row()
    for seconds in SECONDS:
        left = [values for t, values in zip(run.t, run.left_over_Nm, strict=True) if t <= seconds + 0.01][-1]
        shoulder, elbow = _worst(np.array(left, float), run.places)
        found.append((shoulder, elbow, float(shoulder <= TARGET_NM["shoulder"] and elbow <= TARGET_NM["elbow"])))
    return found


def _worst(values: Float[np.ndarray, " joint"], places: Sequence[str]) -> tuple[float, float]:
    at_shoulder = np.array(places) == "shoulder"
    return float(values[at_shoulder].max()), float(values[~at_shoulder].max())


def _line(name: str, rows: list[Row]) -> str:
    """Return medians of the residual torques, and the mean share, by duration."""
    table = np.array(rows)
    middle, share = np.median(table[:, :, :2], axis=0), table[:, :, 2].mean(axis=0)
    cells = [f"{a:.2f} / {b:.2f} {p:4.0%}" for (a, b), p in zip(middle, share, strict=True)]
    return f"{name:22} " + "   ".join(cells)


def main() -> None:
    """Print bound and result over the wearers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="200-219")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--profile", choices=("harmonic", "qdd"), default="harmonic")
    options = parser.parse_args()
    seeds, rows = seed_range(options.seeds), dict[str, list[Row]]()

    def silent(_text: str, _share: float) -> None:
        """Ignore progress: one line per wearer is enough."""

    for group in by_machine(population(options.profile, options.level, len(seeds), seeds[0])):
        try:
            calibrated = calibrate(group[0], silent)
            recorded = [record_stream(case, calibrated, silent, SECONDS[-1]) for case in group]
        except ExogravError as error:
            print(f"seed {group[0].wearer_seed}: {error}", flush=True)
            continue
        for one in recorded:
            for name, row in (
                ("bound", bounds(one)),
                ("silent muscles", bounds(one, 0.0)),
                *((name, bounds(one, sizes=sizes)) for name, sizes in SIZES.items()),
                ("recursive", reached(one)),
            ):
                rows.setdefault(name, []).append(row)
            print(f"seed {one.case.wearer_seed}", _line("recursive", rows["recursive"][-1:]), flush=True)
    print(f"{'motion [s]':22} " + "   ".join(f"{seconds:<16g}" for seconds in SECONDS))
    for name, found in rows.items():
        print(_line(f"{name} ({len(found)})", found))


if __name__ == "__main__":
    main()
