"""Sessions of virtual participants behind simulated drives in another process, to the report of a study.

    python benchmarks/study_over_drives.py --people 3 --sessions 3 --windows 31 --out out/study_over_drives

Each participant has a machine of the same seed, which is calibrated and tested first. Then `exograv run train
--simulate --virtual-clock` runs each session: exograv reaches the machine by its bus only, and the participant by a
line with page and touches. With `--page` each session runs in real time instead: the participant is played at the
session's own page in Chromium, and an amplifier with a clock of its own streams EEG and EMG (`page_session.py`). The
recordings are added to a study, its report and its BIDS data set are written. Finished steps are kept in `--out`; the
same command continues after an interruption. Exit code 1 if a session did not end by itself or a touch is missing.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from exograv.files import append_rows
from exograv.model.description import load_rig
from exograv.procedures.bring_up.simulated_drives_file import drives_of
from exograv.recording import Recording, read_recording
from exograv.rig.drives.simulated.address import free_port
from exograv.task.protocol import FOLDER
from page_session import pulse_errors_ms, run_at_page

REST_S, LAST_REST_S = 14.0, 6.0
"""Rests between the windows and after the last one [s]. The ramps of the gravity level take 12 s of a rest."""

FIRST_SEED = 3000
RUNS_MAX = 5
"""Largest number of commands for one session: the first one, then `--resume`."""

RIG = "recupera_like"


@dataclass(frozen=True)
class Row:
    """Figures of one session."""

    seed: int
    session: int
    bus: str
    commands: int
    """Number of commands until the session was complete; 1 without a stop."""
    why: str
    """Last sentence of the first command that did not complete the session; empty without one."""
    windows: int
    made: int
    """Touches that the panel has reported: it counts them from 0 in each opening of the page."""
    recorded: int
    median_mm: float | None
    simulated_s: float
    wall_s: float
    recording_MB: float
    pulse_ms: str = ""
    """Touch minus pulse in EEG and in EMG: median and 99th percentile of the magnitude [ms]; with `--page` only."""
    recordings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Place:
    """Folder of one participant with a machine."""

    folder: Path
    seed: int
    bus: str
    period_ms: int

    def exograv(self, *words: str, machine: bool = True) -> "subprocess.CompletedProcess[str]":
        """Run a command in the folder."""
        of_machine = ["--simulate", "--drives", "drives.toml", "--seed", str(self.seed)] if machine else []
        command = [sys.executable, "-m", "exograv", *words, *of_machine]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)

    def prepare(self, windows: int) -> None:
        """Write the files of the session, then calibrate and test the machine if it has not passed.

        Raises:
            RuntimeError: The machine was refused.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        text = drives_of(load_rig(RIG), free_port(), self.bus).replace("period_ms = 1", f"period_ms = {self.period_ms}")
        if "period_ms" not in text:
            text = text.replace('serial = "simulated"', f'serial = "simulated"\nperiod_ms = {self.period_ms}', 1)
        text = text.replace("watchdog_ms = 20.0", f"watchdog_ms = {max(20.0, 7.5 * self.period_ms)}")
        (self.folder / "drives.toml").write_text(text, encoding="utf-8")
        (self.folder / "training.toml").write_text(with_short_rests(windows), encoding="utf-8")
        for file, command in (("calibration.toml", "calibrate"), ("self_test.toml", "self-test")):
            if not (self.folder / "out" / file).exists():
                self._make(command)

    def test(self) -> None:
        """Test the machine again after a fault that took its pass away.

        Raises:
            RuntimeError: The machine was refused.
        """
        self._make("self-test")

    def _make(self, command: str) -> None:
        done = self.exograv("rig", command)
        if done.returncode:
            raise RuntimeError(f"Machine of seed {self.seed}: {done.stderr.strip()}")


def with_short_rests(windows: int) -> str:
    """Return the training protocol with short rests, and with this number of windows."""
    text = (FOLDER / "training.toml").read_text(encoding="utf-8")
    begin, end = text.index("# Window and rest are one cycle"), text.index("[ramps]")
    text = f"{text[:begin]}[rest_tables.short]\nrest_s = {REST_S}\n\n{text[end:]}"
    for old, new in {
        "before_first_s = 35.0": f"before_first_s = {REST_S}", "after_last_s = 123.0": f"after_last_s = {LAST_REST_S}",
        'rests = "sets_of_five"': 'rests = "short"', "count = 31": f"count = {windows}",
        '"windows.first_number"': '"windows.first_number", "windows.count"',
    }.items():  # fmt: skip
        if old not in text:
            raise ValueError(f"The protocol has no line '{old}'.")
        text = text.replace(old, new, 1)
    return text


def fly(place: Place, session: int) -> Row:
    """Run one session until it is complete."""
    code, why, commands, begun = f"P-{place.seed}", "", 0, time.monotonic()
    name = place.folder / "out" / f"{code}_training_{session:02d}"
    figures = place.folder / f"session_{session}.json"
    while commands < RUNS_MAX:
        is_begun = name.with_suffix(".simulated.run.json").exists()
        words = ["--participant", code, "--protocol", "training.toml", "--session", str(session)]
        more = ["--virtual-clock", "--json", figures.name, *(["--resume"] if is_begun else [])]
        done = place.exograv("run", "train", *words, *more)
        commands += 1
        if done.returncode == 0:
            break
        why = why or (done.stderr.strip().splitlines() or ["no sentence"])[-1]
    if not figures.exists():
        return Row(place.seed, session, place.bus, commands, why, 0, 0, 0, None, 0.0, time.monotonic() - begun, 0.0)
    found = json.loads(figures.read_text(encoding="utf-8"))
    made, recorded = touches_of(read_recording(name.with_suffix(".mcap")))
    return Row(
        place.seed, session, place.bus, commands, why, found["windows"], made, recorded,
        found["deviation_mm"]["median"], found["simulated_s"], round(time.monotonic() - begun, 1),
        found["recording_MB"],
    )  # fmt: skip


def fly_at_page(place: Place, session: int) -> Row:
    """Run one session at the participant's page, with `--resume` after a stop, until it is complete."""
    code, why, commands, begun = f"P-{place.seed}", "", 0, time.monotonic()
    made, recordings, is_complete = 0, list[str](), False
    while commands < RUNS_MAX and not is_complete:
        machine = ("--simulate", "--drives", "drives.toml", "--seed", str(place.seed), "--donning", str(session - 1))
        words = ("--participant", code, "--protocol", "training.toml", "--session", str(session), *machine)
        if not (place.folder / "out" / "self_test.toml").exists():
            place.test()
        run = run_at_page(
            place.folder, (*words, *(["--resume"] if recordings else [])), f"session_{session}_{commands}",
            place.folder / "skill.json",
        )  # fmt: skip
        commands += 1
        made, recordings, is_complete = made + run.made, run.recordings or recordings, run.is_complete
        why = why or run.why
    files = [place.folder / path for path in recordings]
    read = [recording for path in files if (recording := read_recording(path)).messages("/task")]
    errors = {kind: [] for kind in ("EEG", "EMG")}
    for recording in read:
        for kind, found in pulse_errors_ms(recording).items():
            errors[kind] += found
    pulse_ms = ", ".join(
        f"{kind} {np.median(np.abs(found)):.2f} / {np.percentile(np.abs(found), 99):.2f} ({len(found)})"
        for kind, found in errors.items() if found
    )  # fmt: skip
    windows = {one["record"]["window"] for recording in read for one in recording.messages("/task")
               if one["kind"] == "window_closed" and one["record"].get("is_complete", True)}  # fmt: skip
    deviations = [one["record"]["deviation_mm"] for recording in read for one in recording.messages("/task")
                  if one["kind"] == "touch" and one["record"].get("deviation_mm") is not None]  # fmt: skip
    return Row(
        place.seed, session, place.bus, commands, why, len(windows), made, sum(touches_of(one)[1] for one in read),
        round(float(np.median(deviations)), 2) if deviations else None,
        round(sum(float(one.ticks["t"][-1] - one.ticks["t"][0]) for one in read), 1),
        round(time.monotonic() - begun, 1),
        round(1e-6 * sum(path.stat().st_size for path in files), 1), pulse_ms, tuple(recordings),
    )  # fmt: skip


def touches_of(recording: Recording) -> tuple[int, int]:
    """Return the number of touches that the panel has reported, and of those in the recording."""
    highest: dict[str, int] = {}
    seen: set[tuple[str, int]] = set()
    for message in recording.messages("/task"):
        if message["kind"] == "touch":
            touch = message["record"]
            seen.add((touch["page"], touch["sequence"]))
            highest[touch["page"]] = max(highest.get(touch["page"], -1), touch["sequence"])
    return sum(last + 1 for last in highest.values()), len(seen)


def collected(out: Path, places: Sequence[Place]) -> Path:
    """Add all recordings to a study, and return its report.

    Raises:
        RuntimeError: A command of the study was refused.
    """
    study = out / "study"

    def exograv(*words: str) -> str:
        done = subprocess.run(
            [sys.executable, "-m", "exograv", "study", *words], cwd=out, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise RuntimeError(done.stderr.strip() or done.stdout.strip())
        return done.stdout

    if not study.exists():
        exograv("init", "study", "--name", "Training behind simulated drives")
        settings = study / "study.toml"
        text = settings.read_text(encoding="utf-8")
        settings.write_text(text.replace("is_simulated = false", "is_simulated = true"), encoding="utf-8")
        for place in places:
            exograv("participant", "study", "new", "--group", "trained", "--consent", "v1", "--json", "new.json")
            code = json.loads((out / "new.json").read_text(encoding="utf-8"))["participant"]
            exograv("add", "study", str(place.folder.relative_to(out) / "out"), "--new-code", f"P-{place.seed}={code}")
    exograv("report", "study")
    if not (out / "bids").exists():
        exograv("export", "study", "--bids", "bids")
    return study


def flown(place: Place, options: argparse.Namespace, rows: list[Row], kept: Path) -> None:
    """Run the sessions of one participant that are not in `rows`, and add them."""
    place.prepare(options.windows)
    for session in range(1, options.sessions + 1):
        if any((row.seed, row.session) == (place.seed, session) for row in rows):
            continue
        print(f"Seed {place.seed}, session {session}", file=sys.stderr, flush=True)
        row = (fly_at_page if options.page else fly)(place, session)
        rows.append(row)
        append_rows(kept, [asdict(row)])


def table(rows: Sequence[Row]) -> list[str]:
    """Return the lines of the table, and the sentences of the commands that did not complete a session."""
    heads = ("seed", "session", "bus", "commands", "windows", "made", "recorded", "median [mm]", "simulated [s]",
             "wall [s]", "MB", "touch minus pulse, median / p99 [ms] (touches)")  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for row in rows:
        values = [value for name, value in asdict(row).items() if name not in ("why", "recordings")]
        lines.append(f"| {' | '.join(str(value) for value in values)} |")
    return [*lines, *(f"Seed {row.seed}, session {row.session}: {row.why}" for row in rows if row.why)]


def main() -> int:
    """Run all sessions that are not finished, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=3)
    parser.add_argument("--sessions", type=int, default=3)
    parser.add_argument("--windows", type=int, default=31)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--page", action="store_true", help="in real time, at the participant's page in Chromium")
    parser.add_argument("--at-once", type=int, default=1, help="number of participants at the same time")
    parser.add_argument("--bus", choices=("udp", "canopen"), default="udp")
    parser.add_argument("--out", type=Path, default=Path("out/study_over_drives"))
    options = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    out: Path = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    kept = out / "rows.jsonl"
    rows = [Row(**json.loads(line)) for line in kept.read_text(encoding="utf-8").splitlines()] if kept.exists() else []
    places = [Place(out / f"person_{seed}", seed, options.bus, 4 if options.page else 2) for seed in
              range(options.first_seed, options.first_seed + options.people)]  # fmt: skip
    with ThreadPoolExecutor(options.at_once) as pool:
        for done in [pool.submit(flown, place, options, rows, kept) for place in places]:
            done.result()
    rows.sort(key=lambda row: (row.seed, row.session))
    print("\n".join(table(rows)))
    print(f"Study: {collected(out, places)}")
    is_whole = all(row.windows == options.windows and row.made == row.recorded for row in rows)
    return 0 if is_whole and all(row.commands == 1 for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
