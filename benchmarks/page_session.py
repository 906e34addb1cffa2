"""Session at the participant's page, in real time: session, drives, stimulus with Chromium, and amplifier.

Module of `study_over_drives.py --page`. Each process reaches the others as a real one would: the machine by its bus,
the participant's page by Chromium, EEG and EMG by Lab Streaming Layer. The amplifier's clock is shifted and runs fast.
"""

import contextlib
import json
import os
import secrets
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exograv.laboratory.amplifier.amplifier_command import EEG, EMG
from exograv.laboratory.amplifier.electrodes import ANALOG, edge_times
from exograv.recording import Recording
from exograv.rig.drives.simulated.address import free_port
from lsl_offsets import NETWORK, other_clock

ENDS_S = 60.0
"""Time in which stimulus and amplifier end after the session [s]."""

NEAR_S = 0.1
"""Longest plausible time between a touch and its pulse [s]."""


@dataclass(frozen=True)
class PageRun:
    """Result of one command of a session at the page."""

    is_complete: bool
    why: str
    """Last lines of session and stimulus if the session did not come to its end."""
    made: int
    """Touches that the stimulus has made at the page."""
    recordings: list[str]
    report: str | None


def run_at_page(folder: Path, words: Sequence[str], name: str, memory: Path) -> PageRun:
    """Run `exograv run train --stimulus` with these words, and all processes around it, until it ends.

    Args:
        folder: Folder of the machine.
        words: Options of the session.
        name: Name of the files of the figures, without suffix.
        memory: File with the participant's skill.
    """
    line, amplifier_port = free_port(), free_port()
    figures, made = folder / f"{name}.json", folder / f"{name}.made.json"
    for path in (figures, made):
        path.unlink(missing_ok=True)
    config = folder / "lsl_api.cfg"
    config.write_text(NETWORK.format(f"study-{secrets.token_hex(4)}"), encoding="utf-8")
    around = {**os.environ, "LSLAPICFG": str(config)}
    streams = [word for stream in (EEG, EMG) for word in ("--record-stream", stream)]
    session = [
        "run",
        "train",
        *words,
        "--port",
        "0",
        "--stimulus",
        str(line),
        "--lsl",
        *streams,
        "--json",
        figures.name,
    ]
    said = list[str]()
    with contextlib.ExitStack() as stack:
        clock = other_clock(folder)
        amplifier = ["dev", "amplifier", "--port", str(amplifier_port), "--json", f"{name}.amplifier.json"]
        stack.enter_context(_program(folder, amplifier, around | (clock or {})))
        with subprocess.Popen(
            [sys.executable, "-m", "exograv", *session], cwd=folder, env=around, text=True, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        ) as process:  # fmt: skip
            assert process.stdout is not None
            for text in process.stdout:
                said.append(text.rstrip())
                if "participant's screen: http" in text:
                    stimulus = [
                        "dev", "stimulus", text.split()[-1], "--line", str(line), "--amplifier", str(amplifier_port),
                        "--memory", str(memory), "--json", made.name,
                    ]  # fmt: skip
                    stack.enter_context(_program(folder, stimulus, around))
    (folder / f"{name}.log").write_text("\n".join(said), encoding="utf-8")
    found = _read(figures)
    return PageRun(
        bool(found.get("is_complete")) and process.returncode == 0,
        "" if process.returncode == 0 else f"{_last(said)} Stimulus: {_last(_lines(made.with_suffix('.log')))}",
        len(_read(made).get("made", ())),
        list(found.get("recordings", ())),
        found.get("report"),
    )


def _last(lines: Sequence[str]) -> str:
    return next((line for line in reversed(lines) if line), "no sentence")


def _lines(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else []


def _read(path: Path) -> dict:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


@contextlib.contextmanager
def _program(folder: Path, words: Sequence[str], environment: dict[str, str]) -> Iterator[None]:
    """Run a command beside the session, with its output in a log beside its figures; the amplifier gets Ctrl-C."""
    command = [sys.executable, "-m", "exograv", *words]
    log = (folder / words[words.index("--json") + 1]).with_suffix(".log")
    with (
        log.open("w", encoding="utf-8") as said,
        subprocess.Popen(command, cwd=folder, env=environment, stdout=said, stderr=said) as process,
    ):
        try:
            yield
        finally:
            if words[1] == "amplifier":
                process.send_signal(signal.SIGINT)
            try:
                process.wait(ENDS_S)
            except subprocess.TimeoutExpired:
                process.kill()


def pulse_errors_ms(recording: Recording) -> dict[str, list[float]]:
    """Return touch minus pulse [ms] of each touch, by stream; a touch without a pulse is left out."""
    touches = np.sort([one["t"] for one in recording.messages("/task") if one["kind"] == "touch"])
    found = dict[str, list[float]]()
    for stream in recording.streams:
        if ANALOG not in stream.labels or not len(touches):
            continue
        pulses = edge_times(stream.t, stream.values[:, stream.labels.index(ANALOG)])
        nearest = np.abs(touches[:, None] - pulses[None, :]).argmin(axis=1) if len(pulses) else []
        errors = touches - pulses[nearest] if len(pulses) else np.empty(0)
        found[stream.kind] = (1e3 * errors[np.abs(errors) < NEAR_S]).tolist()
    return found
