"""Prove that a change of structure changed no result: run commands on fixed seeds, keep their files, compare them.

    python benchmarks/unchanged.py keep BEFORE [--tree PATH] [--only NAME ...] [--processes 2]
    python benchmarks/unchanged.py compare BEFORE AFTER
    python benchmarks/unchanged.py replay BEFORE [--tree PATH]

`keep` runs every command below on the source tree at PATH and writes results, recordings and files into a folder.
`compare` compares two such folders: JSON value by value, recordings message by message and tick by tick, tables and
settings files byte by byte. Times, dates, paths and hashes of the source are left out. `replay` runs `exograv data
replay` on each recording of a folder: its decisions must agree to the last bit.
Exit status 1 where anything differs.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent.parent
UR10E = HERE.parent / "shared" / "data" / "ur10e"
GAINS = "13.56,12.09,10.15,9.69,10.06,10.46"

RUNS: dict[str, str] = {
    "demo_harmonic": "demo --seed 3",
    "demo_qdd": "demo --seed 4 --rig recupera_like_qdd --seconds 20",
    "demo_seven_joints": "demo --seed 5 --rig recupera_like_7 --seconds 15",
    "demo_both_arms": "demo --seed 6 --rig recupera_like_dual --seconds 15",
    "identify_gradient": "identify --seed 3 --method gradient --seconds 10",
    "identify_kept": "identify --seed 7 --seconds 20 --keep person.toml --code P-07",
    "calibrate": "calibrate --seed 3 --calibration calibration.toml",
    "calibrate_qdd": "calibrate --seed 4 --rig recupera_like_qdd",
    "weigh": "weigh --seed 3",
    "verify": "verify --seed 3",
    "self_test": "self-test --seed 3 --level 1",
    "transparency": "transparency --seed 3 --machines 1",
    "train": "train --participant P-13 --seed 1313 --windows 2",
    "faults": "faults --scenarios 200 --strikes 0 --processes 1",
    "study_example": "study example --seed 1 --participants 2,2 --sessions 2,1 --out study",
    "benchmark": "benchmark-identification --wearers 1 --streams 1 --levels 2 --profiles harmonic,qdd --seed-from 1000 "
    "--methods recursive,rls,gradient,ekf,anthropometric",
    "assist": "assist --simulate --participant P-07 --seed 1001",
    "support_level": "support-level --seed 1001",
    "teach": "teach --simulate --seed 1001 --path path.toml",
    "mirror": "mirror --simulate --seed 1001 --seconds 10",
    "simulate_study": "simulate-study --participants 1,1 --sessions 1,1 --windows 1 --flight-windows 1 "
    "--conditions dam,gcm --seed 11 --processes 1",
    "sweep": "sweep {tree}/examples/sweeps/table.toml",
    "check_rig": "check-rig recupera_like",
    "check_rig_7": "check-rig recupera_like_7",
    "rigs": "rigs",
    "power": "study power --sd 0.35 --studies 500",
    "identify_log": f"identify-log {UR10E}/ur-20_02_19_14harm50secLoad.csv "
    f"--unloaded {UR10E}/ur-20_02_19_14harm50sec.csv --urdf {UR10E}/ur10e.urdf --payload-frame wrist_3_link "
    f"--gains {GAINS} --rows 308:5071 --rows-unloaded 195:4966 --true-kg 2.805",
}
"""Command by name; each runs in a folder of its own."""

LATER: dict[str, str] = {
    "repeat": "repeat --simulate --seed 1001 --path {teach}/path.toml",
    "identify_returning": "identify --seed 7 --seconds 10 --donning 1 --participant {identify_kept}/person.toml",
    "export_urdf": "export-urdf --participant {identify_kept}/person.toml",
    "study_report": "study report {study_example}/study",
    "report": "report {demo_harmonic}/out/demo.mcap",
}
"""Commands that read the files of other commands."""

FREE_KEYS = re.compile(
    r"(_us|_ms|wall_s|computing_s|cpu_s|elapsed_s|took_s|_took|seconds_of_work|speed|real_time_factor|times_real_time|"
    r"created|at|date|started|when|written|saved|code|commit|path|file|folder|report|recording|page|picture|out|"
    r"versions|hash|hashes|host|computer|memory_MB|rss_MB|pid|command|sha256|content_sha256|monotonic|_utc|spent_s|"
    r"work_share|method_s|tasks_per_s|busy_s|proved_by|software)$"
)
"""Keys of JSON whose values depend on time, place or the source's own hash."""

FREE_TICK_FIELDS = ("tick_us", "lateness_us", "monotonic")
FREE_TOPICS = ("/timing",)
EXACT_FILES = (".csv", ".tsv", ".urdf", ".xml", ".toml")
FREE_LINES = re.compile(r"sha256|created|date|written|version|path|_at = |_utc = ", re.IGNORECASE)
OF_COMPUTER = re.compile(r"tick|recorder|clock|disk|timing|started|gap|period|loop")
"""Names of self-test steps that measure the computer."""


def keep(folder: Path, tree: Path, only: list[str], processes: int) -> int:
    """Run the commands on the source at `tree`; return the number of failures."""
    folder.mkdir(parents=True, exist_ok=True)
    failures = 0
    for runs in (RUNS, LATER):
        chosen = [name for name in runs if not only or name in only]
        with ThreadPoolExecutor(processes) as pool:
            failures += sum(pool.map(lambda name: not run(name, (RUNS | LATER)[name], folder, tree), chosen))
    return failures


def run(name: str, words: str, folder: Path, tree: Path) -> bool:
    """Run one command in its own folder; True if it ended well or with its own verdict."""
    own = folder / name
    own.mkdir(exist_ok=True)
    places = {"tree": tree, **{other: f"../{other}" for other in RUNS}}
    argv = [sys.executable, "-m", "exograv.cli", *words.format_map(places).split(), "--json", "result.json"]
    environment = os.environ | {"PYTHONPATH": str(tree / "src"), "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("COLUMNS", None)
    start = time.monotonic()
    done = subprocess.run(argv, check=False, cwd=own, env=environment, capture_output=True, text=True)
    (own / "screen.txt").write_text(done.stdout + done.stderr)
    is_good = (own / "result.json").exists()
    print(
        f"{'kept  ' if is_good else 'FAILED'} {name:22} {time.monotonic() - start:6.1f} s  exit {done.returncode}",
        flush=True,
    )
    return is_good


def compare(before: Path, after: Path) -> int:
    """Print the differences between two kept folders; return the number of files that differ."""
    names = sorted(path.name for path in after.iterdir() if path.is_dir())
    bad = 0
    for name in names:
        # Names of a sweep's parts contain a hash of the source; its tables hold the same rows.
        files = sorted(path.relative_to(before / name) for path in (before / name).rglob("*") if path.is_file())
        files = [file for file in files if "sweep_parts" not in file.parts]
        checked = 0
        for file in files:
            told = different(before / name / file, after / name / file)
            if told is None:
                continue
            checked += 1
            if told:
                bad += 1
                print(f"DIFFERS {name}/{file}: {told}")
        print(f"{name:22} {checked} files compared")
    return bad


def different(before: Path, after: Path) -> str | None:
    """Return the difference of two files, empty if there is none; None for a kind that is not compared."""
    kinds = {".json": _json, ".jsonl": _json_lines, ".mcap": _recording, ".parquet": _table}
    kinds |= dict.fromkeys(EXACT_FILES, _lines)
    kind = kinds.get(before.suffix)
    if kind is None:
        return None
    if not after.exists():
        return "is missing"
    return kind(before, after)


def _json(before: Path, after: Path) -> str:
    return "; ".join(differences(json.loads(before.read_text()), json.loads(after.read_text()))[:5])


def _json_lines(before: Path, after: Path) -> str:
    rows = [[json.loads(line) for line in path.read_text().splitlines() if line] for path in (before, after)]
    return "; ".join(differences(*rows)[:5])


def _lines(before: Path, after: Path) -> str:
    rows = [[x for x in path.read_text().splitlines() if not FREE_LINES.search(x)] for path in (before, after)]
    return (
        "" if rows[0] == rows[1] else next((f"'{a}' is '{b}'" for a, b in zip(*rows, strict=False) if a != b), "length")
    )


def _table(before: Path, after: Path) -> str:
    import pandas as pd

    old, new = pd.read_parquet(before), pd.read_parquet(after)
    if list(old) != list(new):
        return "columns"
    return ", ".join(name for name in old if not FREE_KEYS.search(name) and not old[name].equals(new[name]))


def _recording(before: Path, after: Path) -> str:
    import numpy as np

    from exograv.recording.reader import read_recording
    from exograv.recording.schema import CHANNELS, TICK

    old, new = read_recording(before), read_recording(after)
    told = []
    if len(old.ticks) != len(new.ticks):
        told.append(f"{len(old.ticks)} ticks are {len(new.ticks)}")
    else:
        told += [
            f"/tick {name}"
            for name in old.ticks.dtype.names or ()
            if name not in FREE_TICK_FIELDS and not np.array_equal(old.ticks[name], new.ticks[name], equal_nan=True)
        ]
    for topic, channel in CHANNELS.items():
        if channel is not TICK and topic not in FREE_TOPICS:
            told += [f"{topic} {x}" for x in differences(old.messages(topic), new.messages(topic))[:2]]
    return "; ".join(told + [f"/settings {x}" for x in differences(old.settings, new.settings)[:3]])


def differences(old: Any, new: Any, where: str = "") -> list[str]:
    """List the places where two JSON values differ, except those that depend on time and place."""
    if isinstance(old, dict) and isinstance(new, dict):
        if "measured" in old and OF_COMPUTER.search(str(old.get("name"))):
            return []
        found = [f"{where}.{key} is only in one" for key in sorted(old.keys() ^ new.keys())]
        for key in old.keys() & new.keys():
            if not FREE_KEYS.search(str(key)):
                found += differences(old[key], new[key], f"{where}.{key}")
        return found
    if isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            return [f"{where} has {len(old)} entries and {len(new)}"]
        return [x for k, (a, b) in enumerate(zip(old, new, strict=True)) for x in differences(a, b, f"{where}[{k}]")]
    same = old == new or (old != old and new != new)
    return [] if same else [f"{where}: {old!r} is {new!r}"]


def replay(folder: Path, tree: Path) -> int:
    """Replay every recording of a kept folder with the source at `tree`; return the number that decided otherwise."""
    bad = 0
    for path in sorted(folder.glob("*/out/*.mcap")):
        argv = [sys.executable, "-m", "exograv.cli", "replay", str(path), "--json", str(folder / "replay.json")]
        environment = os.environ | {"PYTHONPATH": str(tree / "src"), "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(argv, check=False, cwd=folder, env=environment, capture_output=True, text=True)
        bad += done.returncode != 0
        print(f"{path.relative_to(folder)}: exit {done.returncode} {done.stderr.strip()[-200:]}", flush=True)
    return bad


def main() -> None:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("act", choices=["keep", "compare", "replay"])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--tree", type=Path, default=HERE)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    folders = [folder.resolve() for folder in given.folders]
    if given.act == "keep":
        bad = keep(folders[0], given.tree.resolve(), given.only, given.processes)
    elif given.act == "replay":
        bad = replay(folders[0], given.tree.resolve())
    else:
        bad = compare(folders[0], folders[1])
        print(f"{bad} files differ")
    sys.exit(min(bad, 1))


if __name__ == "__main__":
    main()
