"""Table of identification in each world of the twin: left over, targets, intervals, and false verdicts.

    python benchmarks/worlds.py --seed-from 200 --streams 20
    python benchmarks/worlds.py --seed-from 200 --streams 20 --worlds home,all --methods recursive,rls --profiles qdd

Runs `exograv dev benchmark-identification` for each world (3 min for each world and method on one core), and keeps its
files in `--out`; the same command continues after an interruption. Left over is the median over wearers [N·m] of the
worst shoulder axis / the elbow. "False" counts the wearers who are called converged and keep more than twice the target
after 120 s, of all who are called converged. "Worse than table" counts the wearers whose carried arm keeps over 0.05
N·m more than the arm of the body table on any axis after 120 s; then those whose estimate is carried in full.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, get_args

from exograv.campaigns.benchmark_identification.benchmark import FILE
from exograv.campaigns.benchmark_identification.options import MOTION_S
from exograv.campaigns.benchmark_identification.runs import MethodRun, RunFile
from exograv.identification.core.carried_arm import WHOLE_SHARE
from exograv.options import WorldName
from exograv.study.targets import TARGET_NM
from verdicts import worse

DURATIONS_S = ("20", "60", "120")
HEADS = (
    "world", "method", "20 s", "60 s", "120 s", "reached 60, 120 s, %", "parameters' intervals hold 20, 60, 120 s, %",
    "torque's, %", "false", "worse than table", "carried in full",
)  # fmt: skip


def flown(world: str, options: argparse.Namespace) -> dict[str, Any]:
    """Run all wearers of a world that are not in `--out`, and return the figures."""
    figures = options.out / f"{world}.json"
    command = [
        sys.executable, "-m", "exograv", "dev", "benchmark-identification", "--world", world, "--wearers", "0",
        "--streams", str(options.streams), "--seed-from", str(options.seed_from), "--methods", options.methods,
        "--levels", options.levels, "--profiles", options.profiles, "--resume",
        "--out", str(options.out / world), "--json", str(figures),
    ]  # fmt: skip
    subprocess.run(command, check=True, stdout=sys.stderr)
    return json.loads(figures.read_text(encoding="utf-8"))


def carried_runs(world: str, options: argparse.Namespace) -> list[MethodRun]:
    """Return the finished runs of a world whose method states which arm a machine carries."""
    seeds = range(options.seed_from, options.seed_from + options.streams)
    kept = RunFile(options.out / world / FILE, MOTION_S, resume=True).rows
    return [run for run in kept if run.carried_Nm is not None and run.case.wearer_seed in seeds]


def rows(world: str, found: dict[str, Any], carried: list[MethodRun]) -> Iterator[list[str]]:
    """Return one row per method, level and profile."""
    targets = TARGET_NM["shoulder"], TARGET_NM["elbow"]
    for one in found["results"]:
        key = ("method", "level", "profile")
        wearers = [each for each in found["wearers"] if all(each[name] == one[name] for name in key)]
        converged = [each for each in wearers if each["outcome"] == "CONVERGED"]
        runs = [run for run in carried if (run.method, run.case.level, run.case.profile) == tuple(map(one.get, key))]
        whole = sum(min(run.carried_share or [0.0]) >= WHOLE_SHARE for run in runs)
        false = [each for each in converged if _exceeds(each["left_over_Nm"]["120"], targets, 2.0)]
        name = one["method"] if one["profile"] == "harmonic" else f"{one['method']}, {one['profile']}"
        yield [
            f"{world}, level {one['level']}",
            name,
            *(_left_over(one["left_over_Nm"][duration]) for duration in DURATIONS_S),
            ", ".join(f"{100 * one['reached_within_share'][duration]:.0f}" for duration in DURATIONS_S[1:]),
            _shares(one["coverage95_by_duration"]),
            _shares(one["coverage95_torque_by_duration"]),
            f"{len(false)} of {len(converged)}",
            f"{worse(runs, True)} of {len(runs)}",
            f"{whole} of {len(runs)}",
        ]


def _exceeds(left_over: Sequence[float], targets: Sequence[float], times: float) -> bool:
    return any(value > times * target for value, target in zip(left_over, targets, strict=True))


def _left_over(found: dict[str, float]) -> str:
    return f"{found['shoulder']:.2f} / {found['elbow']:.2f}"


def _shares(found: dict[str, Any]) -> str:
    counts = [found.get(duration) for duration in DURATIONS_S]
    return ", ".join("–" if not one or not one["of"] else f"{100 * one['covered'] / one['of']:.0f}" for one in counts)


def main() -> None:
    """Run the worlds and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", default=",".join(get_args(WorldName)))
    parser.add_argument("--streams", type=int, default=20, help="wearers of each world")
    parser.add_argument("--seed-from", type=int, default=200)
    parser.add_argument("--methods", default="recursive")
    parser.add_argument("--levels", default="2")
    parser.add_argument("--profiles", default="harmonic")
    parser.add_argument("--out", type=Path, default=Path("out/worlds"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    print(f"| {' | '.join(HEADS)} |\n{'|---' * len(HEADS)}|", flush=True)
    for world in options.worlds.split(","):
        for row in rows(world, flown(world, options), carried_runs(world, options)):
            print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
