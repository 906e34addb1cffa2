"""Killed sessions of `exograv run train` over simulated UDP drives; the joined recordings are compared with touches.

    python benchmarks/drive_session_kills.py --kills 50 --out out/drive_session_kills --markdown kills.md

The machine is calibrated and tested once, and identifies the participant's arm once. Each session is a copy of it, with
three short windows and a participant without a browser (`scripted_participant.py`). One process of the session is
killed at a random moment of a drawn stage: the command itself, guard, control, recorder, worker, pages or drives; or
the command gets Ctrl-C. If the session ends by that, one command resumes it. A machine that a fault has locked needs
its self-test first. Then the session is judged, from all of its recordings and diaries:

- Each touch that the page had acknowledged, or that is in the checkpoint after the kill, is there once.
- Each window is complete once, with all of its ticks, and attempts have different numbers.
- The commanded torque does not change faster than the guard's limit.

Finished rows are kept in `--out`; the same command continues after them. Exit code 1 if a session is not as it must be.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exograv.files import append_rows
from exograv.model.description import load_rig
from exograv.procedures.bring_up.simulated_drives_file import drives_of
from exograv.recording import Recording, read_recording
from exograv.rig.drives.simulated.address import free_port
from exograv.safety.limits import Limits
from exograv.study.importers.joined_recording import whole_recording
from exograv.study.importers.recording import import_recording
from exograv.study.importers.session_parts import session_of
from exograv.task.state import RunState
from scripted_participant import ScriptedParticipant
from session_kills import (
    LAST_REST_S,
    POLL_S,
    RESTS_S,
    STAGES,
    STUCK_S,
    WINDOW_S,
    WINDOWS,
    WITHIN_S,
    Row,
    largest_step,
    markdown,
    stage_of,
    state_in,
    three_windows,
    touches_of,
)

RIG, PERIOD_MS = "recupera_like", 4
NAME = "P-07_short_01"
VICTIMS = ("session", "guard", "control", "recorder", "worker", "pages", "drives", "Ctrl-C")
STAGE_S = {
    "preparation": 40.0, **{f"window {k}": WINDOW_S for k in (1, 2, 3)},
    **{f"rest {k}": RESTS_S["training"] for k in (1, 2)}, "last rest": LAST_REST_S, "summary": 5.0,
    "after the end": 1.0,
}  # fmt: skip
"""Largest delay of the blow after the beginning of a stage [s]."""

COMMANDS_MAX = 4
"""Commands after the blow: two self-tests and two resumptions. More count as endless."""

LINK = "Open on the participant's screen: "


@dataclass(frozen=True)
class DriveRow(Row):
    """Figures of a session on drives."""

    recordings: int = 0
    diary_only: int = 0
    """Records that a diary holds and no recording."""


class DriveSession:
    """Session in one folder, in which one command runs after another."""

    def __init__(self, folder: Path, seed: int):
        """Take the folder; it holds the machine."""
        self.folder, self._seed, self._count = folder, seed, 0
        self.out = folder / "out"
        self.checkpoint = self.out / f"{NAME}.run.json"
        self.report = self.out / f"{NAME}.html"
        self.participants, self.lines = list[ScriptedParticipant](), list[str]()
        self.pids = dict[str, int]()
        """Newest process by name."""

    def words(self, *words: str) -> list[str]:
        """Return a command for this machine."""
        return [*words, "--simulate", "--drives", "drives.toml", "--seed", str(self._seed)]

    def start(self, *words: str) -> subprocess.Popen[str]:
        """Start the session, or its continuation, and let a participant touch its page."""
        self._count, self.lines, self.pids = self._count + 1, [], {}
        names = ["--participant", "P-07", "--protocol", "short.toml", "--port", "0", "--json", "result.json", *words]
        here = Path(__file__).resolve().parent
        code = "import drive_session_kills; drive_session_kills.run_named()"
        path = os.pathsep.join(filter(None, (str(here), os.environ.get("PYTHONPATH"))))
        process = subprocess.Popen(
            [sys.executable, "-c", code, *self.words("run", "train", *names)], cwd=self.folder, text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            env={**os.environ, "PYTHONPATH": path, "PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
        self.pids["session"] = process.pid
        threading.Thread(target=self._hear, args=(process, f"page-of-command-{self._count}"), daemon=True).start()
        return process

    def _hear(self, process: subprocess.Popen[str], name: str) -> None:
        assert process.stdout is not None
        log = (self.folder / f"{name}.log").open("w", encoding="utf-8")
        for line in process.stdout:
            print(f"{time.monotonic():.1f} {line}", end="", file=log, flush=True)
            if line.startswith("PROCESS "):
                _, role, pid = line.split()
                self.pids[role] = int(pid)
                continue
            self.lines.append(line.rstrip())
            if line.startswith(LINK):
                self.participants.append(ScriptedParticipant(line.removeprefix(LINK).strip(), name))

    def end(self, process: subprocess.Popen[str]) -> str:
        """Wait for the end of a command; return its last sentence, empty if it was complete."""
        try:
            process.wait(STUCK_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return "ENDLESS"
        time.sleep(0.3)  # the last lines
        for one in self.participants:
            one.close()
        if process.returncode == 0:
            return ""
        if said := next((line for line in reversed(self.lines) if "exograv: " in line), ""):
            return said
        # A guard whose drives have ended shows a traceback, also where the command itself was killed afterwards.
        return f"TRACEBACK {self.lines[-1]}" if process.returncode > 0 else "no sentence"

    def state(self) -> RunState | None:
        """Return the run of the checkpoint; None without one."""
        return state_in(self.checkpoint)

    def stage(self) -> str:
        """Return the stage that the files show."""
        return stage_of(self.state(), self.report)

    def acknowledged(self) -> set[tuple[str, int]]:
        """Return the touches that a page has seen acknowledged, or that are in the checkpoint."""
        return touches_of(self.state()).union(*(one.acknowledged for one in self.participants))

    def drives(self) -> int | None:
        """Return the process of the simulated drives."""
        parent = self.pids["session"]
        for path in Path(f"/proc/{parent}/task").glob("*/children"):
            for pid in path.read_text(encoding="ascii").split():
                if b"drive-sim" in Path(f"/proc/{pid}/cmdline").read_bytes():
                    return int(pid)
        return None


def run_named() -> None:
    """Run a command of exograv, which prints the name and number of each process that it starts."""
    from exograv.cli import main as command
    from exograv.runtime.processes import supervisor

    start: Any = supervisor.Supervisor._start

    def named(self: Any, job: object) -> None:
        start(self, job)
        print("PROCESS", self._name, self.pid, flush=True)

    supervisor.Supervisor._start = named
    command()


def strike(session: DriveSession, process: subprocess.Popen[str], victim: str, stage: str, delay_s: float) -> bool:
    """Strike one process some time after the session has reached a stage. Return False if it ended before."""
    while process.poll() is None and STAGES.index(session.stage()) < STAGES.index(stage):
        time.sleep(POLL_S)
    until = time.monotonic() + delay_s
    while process.poll() is None and time.monotonic() < until:
        time.sleep(POLL_S)
    while process.poll() is None:
        pid = session.drives() if victim == "drives" else session.pids.get("session" if victim == "Ctrl-C" else victim)
        if pid is not None:
            try:
                os.kill(pid, signal.SIGINT if victim == "Ctrl-C" else signal.SIGKILL)
            except ProcessLookupError:
                return False  # this process has ended with the motors
            return True
        time.sleep(POLL_S)
    return False


def resumed(session: DriveSession) -> tuple[list[str], list[str]]:
    """Run the command that resumes the session, after a self-test where the machine is locked."""
    commands, wrong = list[str](), list[str]()
    while len(commands) < COMMANDS_MAX:
        words = ("--resume",) if session.checkpoint.exists() else ()
        said = session.end(session.start(*words))
        commands.append(" ".join(("train", *words)))
        if not said or "is over and has its report" in said:
            return commands, wrong
        if not any("self-test" in line for line in session.lines):
            wrong.append(f"`{commands[-1]}`: {said}")
            continue
        test = subprocess.run([sys.executable, "-m", "exograv", *session.words("rig", "self-test")],
                              cwd=session.folder, capture_output=True, text=True, check=False)  # fmt: skip
        commands.append("self-test")
        if test.returncode:
            wrong.append(f"self-test: {test.stderr.strip().splitlines()[-1:]}")
    return commands, [*wrong, "endless"]


def faults_of(
    whole: Recording, acknowledged: set[tuple[str, int]], parts: Sequence[Path]
) -> tuple[dict[str, Any], list[str]]:
    """Return the figures of a whole session, and what is wrong with it."""
    records = [message["record"] for message in whole.messages("/task")]
    touches = [(one["page"], one["sequence"]) for one in records if one["kind"] == "touch"]
    attempts = [(one["window"], one["attempt"]) for one in records if one["kind"] == "window_opened"]
    closed = [(message["t"], message["record"]) for message in whole.messages("/task")
              if message["kind"] == "window_closed"]  # fmt: skip
    complete = [one["window"] for _, one in closed if one["is_complete"]]
    missing = sum(touches.count(touch) != 1 for touch in acknowledged)
    t = whole.ticks["t"]
    enough = (WINDOW_S - WITHIN_S) * 1e3 / PERIOD_MS
    lacking = [one["window"] for at, one in closed
               if one["is_complete"] and ((t >= at - WINDOW_S) & (t <= at)).sum() < enough]  # fmt: skip
    row = import_recording(whole.path).session
    jumps = sum(import_recording(path).session["clock_jumps"] for path in parts)
    step = max(largest_step(read_recording(path).ticks) for path in parts)
    ends = [one["is_complete"] for one in records if one["kind"] == "run_ended"]
    faults = {
        f"{missing} acknowledged touches are not there once": missing,
        "a touch is there twice": len(set(touches)) != len(touches),
        "a recording holds a record twice": any(holds_twice(read_recording(path)) for path in parts),
        f"complete windows: {complete}": sorted(complete) != list(range(1, WINDOWS + 1)),
        f"attempts: {attempts}": len(set(attempts)) != len(attempts),
        "a window is not closed": len(closed) != len(attempts),
        f"ticks are lacking in complete windows: {lacking}": lacking,
        "the time of the ticks goes back": (np.diff(t) <= 0.0).any(),
        f"a torque step of {step:.3f} N·m": step > Limits.torque_rate_max_Nm_per_s * 1e-3 * PERIOD_MS + 1e-6,
        f"ends of the run: {ends}": ends != [True],
        f"the study counts {row['windows_complete']} windows": row["windows_complete"] != WINDOWS,
        f"the study counts {row['clock_jumps']} jumps of a clock": row["clock_jumps"] > jumps,
        f"the study misses a window: {row['remark']}": "is missing" in str(row["remark"]),
    }
    figures = {"recorded": len(touches), "missing": missing, "windows": len(complete), "attempts": len(attempts),
               "step_Nm": round(step, 4)}  # fmt: skip
    return figures, [fault for fault, is_so in faults.items() if is_so]


def holds_twice(recording: Recording) -> bool:
    """Return True if a recording holds a record of the task twice."""
    records = [json.dumps(message["record"], sort_keys=True) for message in recording.messages("/task")]
    return len(set(records)) != len(records)


def judged(session: DriveSession, acknowledged: set[tuple[str, int]]) -> tuple[dict[str, Any], list[str]]:
    """Join all parts of the session, and judge the whole."""
    figures: dict[str, Any] = {"recorded": 0, "missing": len(acknowledged), "windows": 0, "attempts": 0,
                               "step_Nm": 0.0}  # fmt: skip
    try:
        first = next(path for path in sorted(session.out.glob("steered-*.mcap"), reverse=True)
                     if len(session_of(path).diaries) and read_recording(path).messages("/task"))  # fmt: skip
        parts = session_of(first)
        alone = [read_recording(path) for path in parts.recordings]
        with whole_recording(parts, session.out, NAME) as path:
            found, wrong = faults_of(whole := read_recording(path), acknowledged, parts.recordings)
        count = len(whole.messages("/task")) - sum(len(one.messages("/task")) for one in alone)
        return figures | found | {"recordings": len(alone), "diary_only": count}, wrong
    except Exception as error:  # noqa: BLE001 - any error is a finding about this session
        return figures, [f"{type(error).__name__}: {error}"]


def fly(machine: Path, folder: Path, number: int, seed: int) -> DriveRow:
    """Fly one session with its blow, and judge it."""
    rng = np.random.default_rng([seed, number])
    victim = VICTIMS[number % len(VICTIMS)]
    stage = STAGES[int(rng.integers(len(STAGES) - 1))]
    copied(machine, folder)
    session = DriveSession(folder, seed)
    process = session.start()
    is_struck = strike(session, process, victim, stage, rng.uniform(0.0, STAGE_S[stage]))
    at, said = session.stage(), session.end(process)
    acknowledged, wrong, begun = session.acknowledged(), list[str](), time.monotonic()
    if "TRACEBACK" in said or said == "ENDLESS":
        wrong.append(said)
    commands = ["train"]
    if process.returncode or session.stage() != "after the end":
        commands, more = resumed(session)
        wrong += more
    acknowledged |= session.acknowledged()
    figures, faults = judged(session, acknowledged)
    seconds = round(time.monotonic() - begun, 1)
    blow = f"{victim if is_struck else 'nothing'} in {at}"
    return DriveRow(number, "training", blow, said, ", ".join(commands), len(commands), len(acknowledged),
                    ended_after_s=seconds, wrong="; ".join(wrong + faults), **figures)  # fmt: skip


def copied(machine: Path, folder: Path) -> None:
    """Copy the machine, with a bus of its own."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(machine, folder, ignore=shutil.ignore_patterns("*.mcap", "*.run.json", "*.html", "*.jsonl"))
    write_drives(folder)


def write_drives(folder: Path) -> None:
    """Write the file of the drives, with a free port."""
    head = 'serial = "simulated"'
    text = drives_of(load_rig(RIG), free_port(), "udp").replace(head, f"{head}\nperiod_ms = {PERIOD_MS}", 1)
    (folder / "drives.toml").write_text(text, encoding="utf-8")


def prepared(machine: Path, seed: int) -> None:
    """Calibrate and test the machine, and identify the arm in a session that is left alone, as far as not done.

    Raises:
        RuntimeError: A command was refused.
    """
    if not machine.exists():
        machine.mkdir(parents=True)
        (machine / "short.toml").write_text(three_windows("training"), encoding="utf-8")
        write_drives(machine)
    session = DriveSession(machine, seed)
    for file, words in (("calibration.toml", ("rig", "calibrate")), ("self_test.toml", ("rig", "self-test"))):
        if not (session.out / file).exists():
            done = subprocess.run([sys.executable, "-m", "exograv", *session.words(*words)], cwd=machine,
                                  capture_output=True, text=True, check=False)  # fmt: skip
            if done.returncode:
                raise RuntimeError(done.stderr.strip())
    if not (session.out / "participants" / "P-07.toml").exists() and (said := session.end(session.start())):
        raise RuntimeError(said)


def summary(rows: list[DriveRow]) -> Mapping[str, Any]:
    """Return the figures of all sessions."""
    return {
        "sessions": len(rows), "acknowledged": sum(row.acknowledged for row in rows),
        "missing": sum(row.missing for row in rows), "largest step [N·m]": max(row.step_Nm for row in rows),
        "with a fault": [row.number for row in rows if row.wrong],
    }  # fmt: skip


def main() -> int:
    """Fly the sessions, and print one row each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50, help="number of sessions")
    parser.add_argument("--first", type=int, default=0, help="number of the first session")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out/drive_session_kills"))
    parser.add_argument("--markdown", type=Path, help="file for the table")
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    out: Path = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    prepared(out / "machine", options.seed)
    kept = out / "rows.jsonl"
    rows = [DriveRow(**json.loads(line)) for line in kept.read_text("utf-8").splitlines()] if kept.exists() else []
    for number in sorted(set(range(options.first, options.first + options.kills)) - {row.number for row in rows}):
        row = fly(out / "machine", out / f"session-{number}", number, options.seed)
        rows.append(row)
        append_rows(kept, [asdict(row)])
        print(json.dumps(asdict(row), ensure_ascii=False), flush=True)
        if not row.wrong:
            shutil.rmtree(out / f"session-{number}")
    rows.sort(key=lambda row: row.number)
    if options.markdown is not None:
        options.markdown.write_text(markdown(rows), encoding="utf-8")
    print(json.dumps(summary(rows), ensure_ascii=False))
    return 1 if any(row.wrong for row in rows) else 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
