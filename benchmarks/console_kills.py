"""Killed consoles: the session of `exograv run console --rehearse` goes on, and its diaries hold each touch once.

    PYTHONPATH=. python benchmarks/console_kills.py --kills 14 --markdown kills.md

Each session has three windows of three seconds, in real time, without a machine. The process of the console or that of
its pages is killed at a random moment of a window, a rest or the last rest. Pages come back by themselves; a console is
started again with `--resume`. The operator presses *Resume* until the run has ended. A touch is acknowledged when the
server has told the participant's page so. `exograv dev process-faults` kills the processes of the machine.
"""

import argparse
import contextlib
import json
import os
import signal
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from tests.console.of_process import Page, console, short_file
from tests.scenario.test_console_struck import pages_of
from websockets.exceptions import ConnectionClosed

WINDOWS, WINDOW_S, REST_S = 3, 3.0, 1.0
STAGES = ("window 1", "rest 1", "window 2", "rest 2", "window 3", "last rest", "end")
TOUCH_EVERY_S = 0.15
ENDS_WITHIN_S = 120.0


@dataclass(frozen=True)
class Row:
    """Figures of a session with one kill."""

    number: int
    process: str
    stage: str
    ended_by: str
    acknowledged: int
    recorded: int
    """Touches in the diaries."""

    missing: int
    """Acknowledged touches that the diaries lack, or have twice."""

    windows: int
    """Windows that are complete in the diaries."""

    ended_after_s: float
    """Time from the kill to the end of the run, with the windows that were left [s]."""

    wrong: str


class Visit:
    """Pages of operator and participant, and the touches that the server has acknowledged."""

    def __init__(self) -> None:
        self.sequence, self.acknowledged = 0, set[tuple[str, int]]()

    def until(self, operator: Page, participant: Page, stage: str, delay_s: float = 0.0) -> None:
        """Touch in each window until some time after the run has reached a stage."""
        end, reached = time.monotonic() + ENDS_WITHIN_S, None
        while reached is None or time.monotonic() < reached + delay_s:
            if time.monotonic() > end:
                raise TimeoutError(f"The run did not reach '{stage}': {operator.run_shown}")
            if operator.window is not None:
                self.sequence += 1
                participant.touch(self.sequence)
            time.sleep(TOUCH_EVERY_S)
            self.note(participant)
            if reached is None and STAGES.index(stage_of(operator.run_shown)) >= STAGES.index(stage):
                reached = time.monotonic()

    def note(self, participant: Page) -> None:
        """Take the acknowledgements that have arrived."""
        self.acknowledged |= {(one["page"], one["sequence"]) for one in list(participant.touched)}


def stage_of(run: dict[str, Any]) -> str:
    """Return the stage of a run on the operator's page."""
    if run["status"] in ("finished", "stopped"):
        return "end"
    windows = run["windows"]
    if windows and windows[-1]["is_open"]:
        return f"window {windows[-1]['number']}"
    complete = sum(window["is_complete"] for window in windows)
    return STAGES[0] if not complete else "last rest" if complete == WINDOWS else f"rest {complete}"


def go_on(visit: Visit, operator: Page, participant: Page) -> None:
    """Resume the run, and touch until it has ended."""
    operator.until(lambda: operator.run_shown["status"] != "running")
    if operator.run_shown["status"] == "paused":
        operator.run("resume")
    visit.until(operator, participant, "end")


def fly(number: int, seed: int, folder: Path) -> Row:
    """Run one session with its kill, and judge its diaries."""
    rng, victim = np.random.default_rng([seed, number]), ("console", "pages")[number % 2]
    stage, visit, killed = STAGES[(number // 2) % len(STAGES)], Visit(), 0.0
    lasts_s = WINDOW_S if stage.startswith("window") else REST_S
    options: tuple[str | Path, ...] = ("--rehearse", "--protocol", short_file(folder, WINDOW_S), "--out", folder)
    ended_by, wrong = "pages of their own", list[str]()
    with console(*options) as (process, link):
        with Page(link) as operator, Page(operator.ask_link("participant")) as participant:
            logins = operator.login, participant.login
            operator.run("start")
            with contextlib.suppress(ConnectionClosed):
                visit.until(operator, participant, stage, float(rng.uniform(0.0, lasts_s)))
                was = stage_of(operator.run_shown)
                os.kill(process.pid if victim == "console" else pages_of(process.pid), signal.SIGKILL)
            killed = time.monotonic()
            time.sleep(TOUCH_EVERY_S)
            visit.note(participant)
        if victim == "pages":
            with Page(link, login=logins[0]) as operator, Page(link, login=logins[1]) as participant:
                go_on(visit, operator, participant)
            wrong += end(process)
    if victim == "console" and was != "end":
        ended_by = "console --resume"
        with console(*options, "--resume") as (process, link):
            with Page(link) as operator, Page(operator.ask_link("participant")) as participant:
                go_on(visit, operator, participant)
            wrong += end(process)
    elif victim == "console":
        ended_by = "nothing: it was over"
    seconds = time.monotonic() - killed
    return judge(Row(number, victim, was, ended_by, len(visit.acknowledged), 0, 0, 0, round(seconds, 1), ""),
                 folder / "rehearsal", visit.acknowledged, wrong)  # fmt: skip


def end(process: Any) -> list[str]:
    """End a console by Ctrl-C; return a sentence if it does not end well."""
    process.send_signal(signal.SIGINT)
    process.stdout.read()
    return [] if process.wait(ENDS_WITHIN_S) == 0 else [f"the console ended with status {process.returncode}"]


def judge(row: Row, folder: Path, acknowledged: set[tuple[str, int]], wrong: list[str]) -> Row:
    """Compare the diaries and the checkpoint with what was acknowledged."""
    lines = [json.loads(line) for path in sorted(folder.glob("*.jsonl")) for line in path.read_bytes().splitlines()]
    records = [line["message"] for line in lines if line["topic"] == "/task"]
    touches = [(one["page"], one["sequence"]) for one in records if one["kind"] == "touch"]
    complete = [one["window"] for one in records if one["kind"] == "window_closed" and one["is_complete"]]
    (checkpoint,) = folder.glob("*.run.json")
    state = json.loads(json.loads(checkpoint.read_text(encoding="utf-8"))["run"])
    missing = sum(touches.count(touch) != 1 for touch in acknowledged)
    kept = sorted(window["number"] for window in state["windows"] if window["is_complete"])
    faults = {
        f"{missing} acknowledged touches are not in the diaries once": missing,
        f"complete windows in the diaries: {complete}": sorted(complete) != list(range(1, WINDOWS + 1)),
        f"complete windows in the checkpoint: {kept}": kept != list(range(1, WINDOWS + 1)),
        f"{len(touches)} touches in the diaries, {state['touches']} in the checkpoint": len(touches)
        != state["touches"],
        f"the run is {state['status']}": state["status"] != "finished",
    }
    wrong = [*wrong, *(fault for fault, is_so in faults.items() if is_so)]
    figures = {"recorded": len(touches), "missing": missing, "windows": len(complete), "wrong": "; ".join(wrong)}
    return Row(**asdict(row) | figures)


def main() -> int:
    """Run the sessions, and print one row each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=14, help="number of sessions")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--markdown", type=Path, help="file for the table")
    options = parser.parse_args()
    rows = list[Row]()
    for number in range(options.kills):
        with tempfile.TemporaryDirectory() as folder:
            rows.append(fly(number, options.seed, Path(folder)))
        print(json.dumps(asdict(rows[-1]), ensure_ascii=False), flush=True)
    if options.markdown is not None:
        names = [each.name for each in fields(Row)]
        lines = [names, ["---"] * len(names), *([str(getattr(row, name)) for name in names] for row in rows)]
        options.markdown.write_text("".join(f"| {' | '.join(line)} |\n" for line in lines), encoding="utf-8")
    return 1 if any(row.wrong for row in rows) else 0


if __name__ == "__main__":
    os.nice(5)
    sys.exit(main())
