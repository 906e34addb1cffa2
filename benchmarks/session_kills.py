"""Killed sessions of `exograv run train`: one command resumes each, and its recording is compared with its checkpoint.

    python benchmarks/session_kills.py --kills 50 --out out/session_kills --markdown kills.md

Each session has three short windows. It is struck at a random moment of a drawn stage: the preparation, a window, a
rest, the last rest, the summary (result and report, after the last rest), or the end of the command. The blow is
SIGKILL, Ctrl-C, or a file size limit, which acts as a full disk. A third of the sessions is struck a second time while
it is resumed. Then `--resume` runs to its end, and the recording is judged:

- A touch is acknowledged when it is in the checkpoint. Each acknowledged touch has to be in the recording, once.
- Each window has to be complete, once, with all of its ticks.
- The commanded torque must not change faster than the guard's limit, from zero at the first tick after a gap on.

Finished rows are kept in `--out`; the same command continues after them. Exit code 1 if a session is not as it must be.
"""

import argparse
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from exograv.files import append_rows
from exograv.recording import Recording, read_recording
from exograv.safety.limits import Limits
from exograv.task.protocol import FOLDER
from exograv.task.state import RunState

WINDOWS, WINDOW_S, TOUCHES = 3, 8.0, 3
RESTS_S = {"familiarisation": 12.0, "training": 14.0}
"""Rest between two windows by protocol [s]. The ramps of a training take 12 s of it."""

LAST_REST_S = 20.0
TRAINING_EVERY = 7
"""Every seventh session carries the arm. Its preparation takes five times as long as a session without motors."""

MACHINES = {"familiarisation": "recupera_like_passive", "training": "recupera_like"}
STAGES = (
    "preparation", "window 1", "rest 1", "window 2", "rest 2", "window 3", "last rest", "summary", "after the end",
)  # fmt: skip
BLOWS = {"SIGKILL": 0.7, "Ctrl-C": 0.15, "full disk": 0.15}
"""Share of each blow."""

TWICE = 1.0 / 3.0
"""Share of the sessions that are struck again while they are resumed."""

POLL_S = 0.005
STUCK_S = 600.0
"""Time after which a command counts as endless [s]."""

STEP_NM = Limits.torque_rate_max_Nm_per_s * 1e-3 + 1e-6
"""Largest change of a commanded torque within a tick of 1 ms [N·m]."""

WITHIN_S = 0.25
"""Time that the ticks of a complete window may lack at its end [s]; none is lacking where the recording is sound."""


@dataclass(frozen=True)
class Row:
    """Figures of a session with its blows."""

    number: int
    protocol: str
    blows: str
    """Each blow with the stage that the files show after it."""

    said: str
    """Last sentence of the struck command; empty after SIGKILL."""

    ended_by: str
    """Command that ended the session."""

    commands: int
    """Number of commands after the last blow."""

    acknowledged: int
    recorded: int
    """Touches in the recording."""

    missing: int
    """Acknowledged touches that the recording lacks, or has twice."""

    windows: int
    """Windows that are complete in the recording and in the result."""

    attempts: int
    step_Nm: float
    """Largest change of the commanded torque within a tick."""

    ended_after_s: float
    """Wall time of the commands after the last blow."""

    wrong: str
    """Faults; empty without one."""


class Session:
    """Session of one folder, in which one command runs after another."""

    def __init__(self, folder: Path, base: str, seed: int):
        """Write the protocol of the session."""
        folder.mkdir(parents=True)
        self.folder, self.base = folder, base
        protocol = folder / "short.toml"
        protocol.write_text(three_windows(base), encoding="utf-8")
        self.words = [
            "run", "train", MACHINES[base], "--protocol", str(protocol), "--participant", "P-07", "--seed", str(seed),
            "--out", str(folder), "--json", str(folder / "result.json"),
        ]  # fmt: skip
        self.checkpoint = folder / "P-07_short_01.simulated.run.json"
        self.recording = folder / "P-07_short_01.mcap"
        self.report = folder / "P-07_short_01.html"

    def start(self, *words: str) -> subprocess.Popen[str]:
        """Start the command of the session."""
        command = [sys.executable, "-m", "exograv.cli", *self.words, *words]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def state(self) -> RunState | None:
        """Return the run of the checkpoint; None without one."""
        return state_in(self.checkpoint)

    def stage(self) -> str:
        """Return the stage that the files show."""
        return stage_of(self.state(), self.report)

    def touches(self) -> set[tuple[str, int]]:
        """Return the touches of the checkpoint, by page and number."""
        return touches_of(self.state())


def state_in(checkpoint: Path) -> RunState | None:
    """Return the run of a checkpoint; None without one."""
    try:
        kept = json.loads(checkpoint.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    return RunState.model_validate_json(kept["run"])


def stage_of(state: RunState | None, report: Path) -> str:
    """Return the stage of a session by its run and its report."""
    if state is None:
        return STAGES[0]
    if state.status in ("finished", "stopped"):
        return "after the end" if report.exists() else "summary"
    if state.window is not None:
        return f"window {state.window.number}"
    complete = len(state.complete)
    if complete == WINDOWS:
        return "last rest"
    return f"rest {complete}" if complete else STAGES[0]


def touches_of(state: RunState | None) -> set[tuple[str, int]]:
    """Return the touches of a run, by page and number."""
    seen = {} if state is None else state.seen
    return {(page, k) for page, runs in seen.items() for low, high in runs for k in range(low, high + 1)}


def three_windows(base: str) -> str:
    """Return a protocol of three short windows, without published values."""
    text = (FOLDER / f"{base}.toml").read_text(encoding="utf-8")
    begin, end = text.index("# Window and rest are one cycle"), text.index("[ramps]" if "[ramps]" in text else "[pace]")
    text = f"{text[:begin]}[rest_tables.short]\nrest_s = {RESTS_S[base]}\n\n{text[end:]}"
    text = text.replace('"windows.first_number"', '"windows.first_number", "windows.duration_s", "windows.touches"', 1)
    if '"windows.count"' not in text:
        text = text.replace('"windows.first_number"', '"windows.first_number", "windows.count"', 1)
    for old, new in {
        f'name = "{base}"': 'name = "short"', "before_first_s = 35.0": f"before_first_s = {RESTS_S[base]}",
        "after_last_s = 123.0": f"after_last_s = {LAST_REST_S}", 'rests = "sets_of_five"': 'rests = "short"',
        "count = 31": f"count = {WINDOWS}", "duration_s = 22.0": f"duration_s = {WINDOW_S}",
        "touches = 8": f"touches = {TOUCHES}",
    }.items():  # fmt: skip
        if old not in text:
            raise ValueError(f"The protocol {base} has no line '{old}'.")
        text = text.replace(old, new, 1)
    return text


def strike(session: Session, process: subprocess.Popen[str], stage: str, delay_s: float, blow: str) -> tuple[bool, str]:
    """Strike a command some time after it has reached a stage. Return if it was struck, and its last sentence.

    A command that ends before is left alone. One that begins at a later stage is struck from there.
    """
    while process.poll() is None and STAGES.index(session.stage()) < STAGES.index(stage):
        time.sleep(POLL_S)
    until = time.monotonic() + delay_s
    while process.poll() is None and time.monotonic() < until:
        time.sleep(POLL_S)
    is_struck = process.poll() is None
    if is_struck:
        if blow == "full disk":
            size = session.recording.stat().st_size if session.recording.exists() else 0
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (size, size))
        else:
            process.send_signal(signal.SIGKILL if blow == "SIGKILL" else signal.SIGINT)
    return is_struck, last_sentence(process)


def last_sentence(process: subprocess.Popen[str]) -> str:
    """Wait for the end of a command; return its last line, or how it failed to end."""
    try:
        _, said = process.communicate(timeout=STUCK_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return "ENDLESS"
    if "Traceback" in said:
        return "TRACEBACK " + said.strip().splitlines()[-1]
    lines = [line for line in said.strip().splitlines() if "exograv: " in line]
    return lines[-1] if lines and process.returncode else ""


def resume(session: Session) -> tuple[list[str], float, list[str]]:
    """Run `--resume`, and the command without it where that is refused. Return commands, wall time [s] and faults."""
    begun, commands, wrong = time.monotonic(), list[str](), list[str]()
    for words in (("--resume",), ()) if session.recording.exists() else ((),):  # before the recording nothing has begun
        process = session.start(*words)
        said = last_sentence(process)
        commands.append(" ".join(("train", *words)))
        if process.returncode == 0 or "is over" in said:
            break
        wrong.append(f"`{commands[-1]}`: {said}")
        if said == "ENDLESS":
            break
    return commands, time.monotonic() - begun, wrong


def faults_of(
    recording: Recording, acknowledged: set[tuple[str, int]], result: dict[str, Any]
) -> tuple[dict[str, Any], list[str]]:
    """Return the figures of a recording, and what is wrong with it."""
    records = [message["record"] | {"kind": message["kind"]} for message in recording.messages("/task")]
    touches = [(one["page"], one["sequence"]) for one in records if one["kind"] == "touch"]
    attempts = [(one["window"], one["attempt"]) for one in records if one["kind"] == "window_opened"]
    closed = [one for one in records if one["kind"] == "window_closed"]
    complete = [one["window"] for one in closed if one["is_complete"]]
    ends = [one["is_complete"] for one in records if one["kind"] == "run_ended"]
    missing = sum(touches.count(touch) != 1 for touch in acknowledged)
    step, t = largest_step(recording.ticks), recording.ticks["t"]
    lacking = [one["window"] for one in closed if one["is_complete"] and lacks_ticks(t, one["t"])]
    faults = {
        f"{missing} acknowledged touches are not in the recording once": missing,
        "a touch is recorded twice": len(set(touches)) != len(touches),
        f"{len(touches)} touches in the recording, {result['touches']} in the result": len(touches)
        != result["touches"],
        f"complete windows in the recording: {complete}": sorted(complete) != list(range(1, WINDOWS + 1)),
        f"{result['windows']} windows in the result": result["windows"] != WINDOWS,
        f"attempts in the recording: {attempts}, in the result: {result['attempts']}": (
            len(set(attempts)) != len(attempts) or len(attempts) != result["attempts"]
        ),
        "a window is not closed": [(one["window"], one["attempt"]) for one in closed] != attempts,
        f"ticks are lacking in complete windows: {lacking}": lacking,
        "the time of the ticks goes back": (np.diff(t) <= 0.0).any(),
        f"a torque step of {step:.3f} N·m": step > STEP_NM,
        f"ends of the run: {ends}": ends != [True],
        f"{len(recording.messages('/result'))} results": len(recording.messages("/result")) != 1,
        f"{recording.remark}": recording.remark is not None,
    }
    figures = {"recorded": len(touches), "missing": missing, "windows": len(complete), "attempts": len(attempts),
               "step_Nm": round(step, 4)}  # fmt: skip
    return figures, [fault for fault, is_so in faults.items() if is_so]


def lacks_ticks(t: np.ndarray, closed: float) -> bool:
    """Return True if a part of the window that closed at this time [s] has no ticks."""
    inside = t[(t >= closed - WINDOW_S) & (t <= closed + 1e-6)]
    return len(inside) < 1000 * (WINDOW_S - WITHIN_S)


def largest_step(ticks: np.ndarray) -> float:
    """Return the largest change of a commanded torque within a tick [N·m], from zero after each gap."""
    if not len(ticks):
        return 0.0
    tau = ticks["tau_commanded"].astype(float)
    before = np.vstack([np.zeros_like(tau[:1]), tau[:-1]])
    before[np.flatnonzero(np.diff(ticks["sequence"].astype(np.int64)) != 1) + 1] = 0.0
    return float(np.abs(tau - before).max())


def stage_times(folder: Path, base: str, seed: int) -> dict[str, float]:
    """Return the wall time of each stage of a session that is left alone [s]."""
    session, times = Session(folder, base, seed), dict.fromkeys(STAGES, 0.0)
    process = session.start()
    last = time.monotonic()
    while process.poll() is None:
        stage, now = session.stage(), time.monotonic()
        times[stage] += now - last
        last = now
        time.sleep(POLL_S)
    if said := last_sentence(process):
        raise RuntimeError(said)
    return times


def fly(folder: Path, number: int, seed: int, times: dict[str, dict[str, float]]) -> Row:
    """Fly one session with its blows, and judge it."""
    rng = np.random.default_rng([seed, number])
    base = "training" if number % TRAINING_EVERY == TRAINING_EVERY - 1 else "familiarisation"
    stage = STAGES[number % len(STAGES)]
    session = Session(folder, base, seed + number)
    blows, sentences, acknowledged, wrong = list[str](), list[str](), set[tuple[str, int]](), list[str]()
    is_twice = rng.uniform() < TWICE
    process = session.start()
    for _ in range(1 + is_twice):
        blow = str(rng.choice(list(BLOWS), p=list(BLOWS.values())))
        is_struck, said = strike(session, process, stage, rng.uniform(0.0, times[base][stage]), blow)
        acknowledged |= session.touches()
        blows.append(f"{blow if is_struck else 'nothing'} in {session.stage()}")
        if said:
            sentences.append(said)
        is_whole = process.returncode == 0 and stage == STAGES[-1]  # it had written its files before the blow
        if "TRACEBACK" in said or (is_struck and blow != "SIGKILL" and not said and not is_whole):
            wrong.append(f"{blow}: {said or 'no sentence'}")
        if len(blows) <= is_twice and session.stage() != "after the end":
            stage = STAGES[int(rng.integers(STAGES.index(session.stage()), len(STAGES) - 1))]
            process = session.start(*(("--resume",) if session.recording.exists() else ()))
        else:
            break
    commands, seconds, more = resume(session)
    wrong += more
    try:
        recording = read_recording(session.recording)
        result = result_of(session, recording)
        figures, found = faults_of(recording, acknowledged, result)
        wrong += found
    except Exception as error:  # noqa: BLE001 - any error is a finding about this session
        figures = {"recorded": 0, "missing": len(acknowledged), "windows": 0, "attempts": 0, "step_Nm": 0.0}
        wrong.append(f"{type(error).__name__}: {error}")
    return Row(number, base, ", ".join(blows), " | ".join(sentences), commands[-1], len(commands), len(acknowledged),
               ended_after_s=round(seconds, 1), wrong="; ".join(wrong), **figures)  # fmt: skip


def result_of(session: Session, recording: Recording) -> dict[str, Any]:
    """Return the figures of the run: those of the command, or those of the recording."""
    state = session.state()
    attempts = {"attempts": 0 if state is None else len(state.windows)}
    return {**recording.last("/result")["task"], **attempts}


def markdown(rows: Sequence[Row]) -> str:
    """Return the rows as a table."""
    names = [each.name for each in fields(Row) if each.name != "said"]
    lines = ["| " + " | ".join(names) + " |", "|" + " --- |" * len(names)]
    lines += ["| " + " | ".join(str(getattr(row, name)) for name in names) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Fly the sessions, and print one row each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50, help="number of sessions")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--out", type=Path, default=Path("out/session_kills"))
    parser.add_argument("--markdown", type=Path, help="file for the table")
    options = parser.parse_args()
    # A benchmark in the background ignores Ctrl-C, and its commands would, too.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    options.out.mkdir(parents=True, exist_ok=True)
    kept, times_file = options.out / "rows.jsonl", options.out / "times.json"
    rows = [Row(**json.loads(line)) for line in kept.read_text("utf-8").splitlines()] if kept.exists() else []
    if times_file.exists():
        times = json.loads(times_file.read_text("utf-8"))
    else:
        times = {}
        for base in MACHINES:
            shutil.rmtree(options.out / base, ignore_errors=True)
            times[base] = stage_times(options.out / base, base, options.seed)
        times_file.write_text(json.dumps(times), encoding="utf-8")
    done = {row.number for row in rows}
    for number in sorted(set(range(options.kills)) - done):
        folder = options.out / f"session-{number}"
        shutil.rmtree(folder, ignore_errors=True)
        row = fly(folder, number, options.seed, times)
        rows.append(row)
        append_rows(kept, [asdict(row)])
        print(json.dumps(asdict(row), ensure_ascii=False), flush=True)
        if not row.wrong:
            shutil.rmtree(folder)
    rows.sort(key=lambda row: row.number)
    if options.markdown is not None:
        options.markdown.write_text(markdown(rows), encoding="utf-8")
    bad = [row.number for row in rows if row.wrong]
    step, longest = max(row.step_Nm for row in rows), max(row.ended_after_s for row in rows)
    acknowledged, missing = (sum(getattr(row, name) for row in rows) for name in ("acknowledged", "missing"))
    print(
        f"{len(rows)} sessions, {acknowledged} acknowledged touches, {missing} missing; largest torque step {step:.3f}"
    )
    print(f"N·m; longest end {longest:.0f} s; sessions with a fault: {bad or 'none'}")
    return 1 if bad else 0


if __name__ == "__main__":
    os.nice(5)
    sys.exit(main())
