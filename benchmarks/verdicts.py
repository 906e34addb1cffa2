"""Verdicts of the stop rule and the decision to float against the truth, by world.

    python benchmarks/verdicts.py --worlds home,cuffs --seeds 2000-2011 --seconds 20,60

One row per wearer: outcome, left over, stated left over, probability of the residuals at unused postures, share of the
estimate that is carried, left over of the carried arm and of the body table, each by joint. Then two rows per world.
The first counts the wearers called converged, those of them with more than the target and more than twice the target
left over, and the wearers whom the check refuses. The second counts the wearers whose estimate is carried in full, and
those whom estimate and carried arm leave worse than the table by more than the margin on any axis.
"""

import argparse
import contextlib
from typing import cast

import numpy as np

from exograv.campaigns.benchmark_identification.cases import by_machine, population
from exograv.campaigns.benchmark_identification.runs import MethodRun
from exograv.campaigns.benchmark_identification.streams import Calibrated, calibrate
from exograv.campaigns.benchmark_identification.work import WearerTask, run_machine
from exograv.errors import ExogravError
from exograv.identification.core.carried_arm import MARGIN_NM, WHOLE_SHARE
from exograv.identification.core.interface import Outcome
from exograv.options import WorldName
from exograv.study.targets import TARGET_NM
from seeds import seed_range


def ratio(run: MethodRun) -> float:
    """Left over at the end over its target, at the joint where it is largest [-]."""
    target = np.array([TARGET_NM[place] for place in run.places])
    return float((np.array(run.left_over_Nm[-1], dtype=float) / target).max())


def row(world: str, runs: list[MethodRun]) -> str:
    """Return the row of a world."""
    done = [run for run in runs if run.failed is None]
    converged = [ratio(run) for run in done if run.outcome == Outcome.CONVERGED.name]
    beyond = [sum(one > times for one in converged) for times in (1.0, 2.0)]
    refused = sum(run.outcome == Outcome.DISAGREES.name for run in done)
    return (
        f"{world}: {len(done)} of {len(runs)} ran; converged {len(converged)}, of them above the target {beyond[0]}, "
        f"above twice the target {beyond[1]}; refused by the check {refused}"
    )


def worse(runs: list[MethodRun], is_carried: bool) -> int:
    """Count the wearers whom the estimate, or the carried arm, leaves worse than the table on any axis."""
    count = 0
    for run in runs:
        left = run.carried_Nm if is_carried else run.left_over_Nm[-1]
        count += bool((np.array(left, dtype=float) - np.array(run.table_Nm) > MARGIN_NM).any())
    return count


def float_row(world: str, runs: list[MethodRun]) -> str:
    """Return the row of a world on the decision to float."""
    done = [run for run in runs if run.carried_share is not None and run.carried_Nm is not None]
    whole = [run for run in done if min(run.carried_share or [0.0]) >= WHOLE_SHARE]
    part = [run for run in done if run not in whole]
    return (
        f"{world}: carried in full {len(whole)} of {len(done)}; worse than the table by more than {MARGIN_NM:g} N·m: "
        f"carried in full {worse(whole, True)} of {len(whole)}, in part {worse(part, True)} of {len(part)} "
        f"(with the whole estimate {worse(part, False)})"
    )


def main() -> None:
    """Run the wearers and print the rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", default="home,tissue,cuffs,drives,unseen")
    parser.add_argument("--seeds", default="2000-2011")
    parser.add_argument("--seconds", default="60", help="durations of the motion [s]")
    options = parser.parse_args()
    seeds, durations = seed_range(options.seeds), [float(word) for word in options.seconds.split(",")]
    for world in options.worlds.split(","):
        runs: dict[float, list[MethodRun]] = {seconds: [] for seconds in durations}
        for group in by_machine(population("harmonic", 2, len(seeds), seeds[0], world=cast(WorldName, world))):
            calibrated: Calibrated | None = None
            with contextlib.suppress(ExogravError):  # A machine that is refused fails again below, as a result.
                calibrated = calibrate(group[0], lambda *_: None)
            tasks = [WearerTask(case, ("recursive",), ()) for case in group]
            for seconds in durations:
                for run in run_machine(tasks, lambda _: None, seconds, calibrated):
                    runs[seconds].append(run)
                    print(world, f"{seconds:g} s", *figures(run), flush=True)
        for seconds in durations:
            where = f"{world}, {seconds:g} s"
            print(row(where, runs[seconds]), float_row(where, runs[seconds]), sep="\n", flush=True)


def figures(run: MethodRun) -> tuple[object, ...]:
    """Return the figures of a wearer's row."""
    left = None if run.failed else run.left_over_Nm[-1]
    verdict = run.case.wearer_seed, run.failed or run.outcome, left, run.stated_Nm, run.check_p
    return *verdict, run.carried_share, run.carried_Nm, run.table_Nm


if __name__ == "__main__":
    main()
