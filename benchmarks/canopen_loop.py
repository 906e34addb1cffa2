"""The loop on a CAN bus in real time, against simulated drives in another process (docs/canopen.md).

    python benchmarks/canopen_loop.py --seconds 60 --period-ms 2 --trials 20

CAN frames go as UDP multicast on this computer. Every SYNC that was not answered in full is set against the times at
which one of the two processes stood still. Both ask for real-time rights, on a processor each.
"""

import argparse
import json
import platform
import tempfile
import time
from array import array
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import RigError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.rig.drives.canopen import CanopenRig
from exograv.rig.drives.canopen.cycle import load
from exograv.rig.drives.canopen.simulated.network import CanopenDevices
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated import Plant
from exograv.rig.drives.simulated.address import free_port
from exograv.rig.twin import Disturbances, Twin, draw_machine
from exograv.runtime.clock.real_time_loop import run_loop
from exograv.runtime.clock.realtime import realtime
from exograv.runtime.clock.timing import EDGES_US, Timing
from exograv.runtime.processes.spawn import spawned
from exograv.signals import Command

EXAMPLE = Path(__file__).parents[1] / "examples" / "drives" / "canopen.toml"
RIG, LEVEL, SEED = "recupera_like", 1, 1000
LIFE_S = 0.005
"""Of a command, as the live loop's."""
CYCLES_BEFORE = 60
"""Periods with commands before each trial."""
GIVE_UP_S = 1.0
FAR_S = 0.5
"""After which a SYNC was not heard."""

Spans = Float[np.ndarray, "sync stage"]


def serve(path: str, line: Connection) -> None:
    """The drives, until the line says nothing more."""
    description = load_rig(RIG)
    drives = load_drives(Path(path), description)
    machine = draw_machine(description, Disturbances.at_level(LEVEL), SEED)
    twin = Twin(description, machine, None, SEED, starting_posture(read_exoskeleton(description)))
    devices = CanopenDevices(Plant(twin, drives), drives, say=lambda text: None)
    served = array("d")
    devices.watch = lambda heard_at, answered_at: served.extend((heard_at, answered_at))

    def until_stopped() -> bool:
        if not line.poll():
            return False
        words = line.recv().split()
        if len(words) == 2:
            getattr(devices, words[0])(description.joints.index(words[1]))
        silence = [drive.silence_s for drive in devices.plant.each]
        said = {"at": time.monotonic(), "pauses": devices.pauses, "silence_s": silence}
        line.send({**said, "served": served.tobytes()} if words == ["served"] else said)
        return words == ["stop"]

    with devices, realtime((0,)) as rights:
        line.send(rights.granted)
        devices.run(until_stopped)


@dataclass
class Flown:
    """What the loop remembers."""

    asked_at: list[float] = field(default_factory=list)
    """Of each SYNC [s]."""
    answered_s: list[float] = field(default_factory=list)
    """Until its last answer, or until nobody waited any more [s]."""
    told_s: list[float] = field(default_factory=list)
    """To send all commands [s]."""
    incomplete: dict[int, None] = field(default_factory=dict)
    """SYNCs by number that were not answered in full."""
    enabled_again: list[float] = field(default_factory=list)
    """When, after drives had braked by themselves or had been lost [s]."""


def fly(rig: CanopenRig, seconds: float) -> tuple[Timing, Flown]:
    """Hold the machine without torque."""
    flown, none = Flown(), np.zeros(len(rig.joints))

    def tick(period: int) -> None:
        before, begun = rig.counts["incomplete"], time.monotonic()
        state = rig.read()
        heard = time.monotonic()
        if rig.counts["incomplete"] > before:
            flown.incomplete[len(flown.asked_at)] = None
        rig.write(Command(rig.t, state.sequence, rig.t + LIFE_S, none, none))
        flown.asked_at.append(begun)
        flown.answered_s.append(heard - begun)
        flown.told_s.append(time.monotonic() - heard)
        if state.faulty:
            enable(rig)
            flown.enabled_again.append(time.monotonic())

    enable(rig)
    timing = run_loop(tick, round(seconds / rig.period_s), round(1e9 * rig.period_s))
    return timing, flown


def enable(rig: CanopenRig) -> None:
    """Again, where this computer stood still in the middle of it."""
    until = time.monotonic() + GIVE_UP_S
    while True:
        try:
            rig.enable()
        except RigError:
            if time.monotonic() > until:
                raise
        else:
            return


STAGES = ("drives' process heard the SYNC late", "drives' process answered slowly", "this process took them late")


def stages(flown: Flown, served: Spans) -> Spans:
    """Of each SYNC: until the drives' process heard it, until it had answered, until we had all (sync, 3) [s]."""
    heard, found, at = served[:, 0], np.full((len(flown.asked_at), 3), np.nan), -1
    for k, (asked, took) in enumerate(zip(flown.asked_at, flown.answered_s, strict=True)):
        first = int(np.searchsorted(heard, asked))
        at = max(at + 1, first)
        # What was answered has been heard by then; else a SYNC before was lost, and this is not its.
        at = first if k not in flown.incomplete and at < len(heard) and heard[at] > asked + took else at
        if at < len(heard) and heard[at] < asked + FAR_S:
            answered = served[at, 1]
            found[k] = heard[at] - asked, answered - heard[at], asked + took - answered
    return found


def explained(flown: Flown, spans: Spans, answer_s: float) -> dict[str, int]:
    """SYNCs without all answers, by the stage without whose delay beyond its median all would have been in time."""
    causes: dict[str, int] = dict.fromkeys((*STAGES, "several of these", "after one without", "not explained"), 0)
    usual, lost = np.nanmedian(spans, axis=0), set(flown.incomplete)
    for k in flown.incomplete:
        beyond = np.maximum(spans[k] - usual, 0.0)
        over = float(spans[k, :2].sum()) + usual[2] - answer_s
        worst = int(np.argmax(beyond[:2])) if np.isfinite(over) else -1
        if worst >= 0 and over > 0.0 and beyond[worst] >= over:
            causes[STAGES[worst]] += 1
        elif worst >= 0 and over > 0.0 and beyond[:2].sum() >= over:
            causes["several of these"] += 1
        elif worst >= 0 and beyond[2] > answer_s:
            causes[STAGES[2]] += 1
        elif k - 1 in lost:
            # An answer that may be of the SYNC before does not count for this one.
            causes["after one without"] += 1
        else:
            causes["not explained"] += 1
    return causes


def cycles(rig: CanopenRig, number: int, writes: bool = True) -> float | None:
    """So many periods; when a joint was first reported, None if never [s]."""
    none, due = np.zeros(len(rig.joints)), time.monotonic()
    for _ in range(number):
        state = rig.read()
        if state.faulty:
            return time.monotonic()
        if writes:
            rig.write(Command(rig.t, state.sequence, rig.t + LIFE_S, none, none))
        due += rig.period_s
        time.sleep(max(due - time.monotonic(), 0.0))
    return None


def reactions(rig: CanopenRig, line: Connection, trials: int) -> dict[str, list[float]]:
    """Times of each trial [ms]; one that the computer spoilt before it began is repeated."""
    found: dict[str, list[float]] = {
        "drive brakes after last command": [],
        "we hear of it": [],
        "lost node is reported": [],
    }
    lost, patient = rig.joints[-1], round(GIVE_UP_S / rig.period_s)
    while len(found["we hear of it"]) < trials:
        enable(rig)
        if cycles(rig, CYCLES_BEFORE) is not None:
            continue
        told_at = time.monotonic()
        heard_at = cycles(rig, patient, writes=False)
        line.send("look")
        found["drive brakes after last command"].append(1e3 * max(line.recv()["silence_s"]))
        found["we hear of it"].append(1e3 * ((heard_at or np.nan) - told_at))
    while len(found["lost node is reported"]) < trials:
        enable(rig)
        if cycles(rig, CYCLES_BEFORE) is None:
            line.send(f"unplug {lost}")
            reported_at = cycles(rig, patient)
            unplugged_at = line.recv()["at"]
            line.send(f"plug {lost}")
            line.recv()
            found["lost node is reported"].append(1e3 * ((reported_at or np.nan) - unplugged_at))
    return found


def drives_file(folder: Path, period_ms: int) -> Path:
    """The example at this period, at a port where nobody else speaks."""
    text = EXAMPLE.read_text(encoding="utf-8").replace('"239.74.163.2"', f'"239.74.163.2:{free_port()}"')
    path = folder / "drives.toml"
    path.write_text(text.replace("period_ms = 2", f"period_ms = {period_ms}"), encoding="utf-8")
    return path


def percentiles(values: list[float] | np.ndarray, unit: float) -> dict[str, float]:
    """For a table."""
    p50, p99, p999 = np.percentile(values, [50, 99, 99.9]) * unit
    figures = {"median": p50, "p99": p99, "p99.9": p999, "max": np.max(values) * unit}
    return {name: round(float(value), 1) for name, value in figures.items()}


def measure(seconds: float, period_ms: int, trials: int) -> dict:
    """All figures."""
    with tempfile.TemporaryDirectory() as folder:
        path = drives_file(Path(folder), period_ms)
        drives = load_drives(path, load_rig(RIG))
        process, line = spawned("drives", serve, str(path))
        theirs = line.recv()
        with CanopenRig(drives) as rig:
            with realtime() as rights:
                timing, flown = fly(rig, seconds)
            line.send("served")
            said = line.recv()
            pauses, served = said["pauses"], np.frombuffer(said["served"]).reshape(-1, 2)
            answer_s = rig.answer_share * rig.period_s
            with realtime():
                reacted = reactions(rig, line, trials)
        line.send("stop")
        process.join(5.0)
    spans = stages(flown, served)
    return {
        "seconds": seconds,
        "period_ms": period_ms,
        "rate_Hz": round(timing.effective_rate_Hz, 2),
        "syncs": len(flown.asked_at),
        "skipped_periods": int(timing.periods - len(timing.period)),
        "bus_load_at_1_Mbit_s": round(load(drives), 3),
        "lateness_us": percentiles(timing.lateness_ns, 1e-3),
        "histogram": {"edges_us": EDGES_US, "counts": timing.histogram()},
        "round_trip_us": percentiles(flown.answered_s, 1e6),
        "commands_us": percentiles(flown.told_s, 1e6),
        "stages_us": {name: percentiles(spans[np.isfinite(spans[:, i]), i], 1e6) for i, name in enumerate(STAGES)},
        "not_answered": explained(flown, spans, answer_s),
        "enabled_again": len(flown.enabled_again),
        "drives_process": {
            "pauses": len(pauses),
            "longest_ms": round(1e3 * max((one[1] for one in pauses), default=0.0), 1),
        },
        "reactions_ms": {
            name: {"median": round(float(np.median(each)), 1), "max": round(max(each), 1), "trials": len(each)}
            for name, each in reacted.items()
        },
        "computer": platform.platform(),
        "granted": [rights.granted, theirs],
    }


def main() -> None:
    """Print one line a figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--period-ms", type=int, default=2, choices=(1, 2, 4))
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    figures = measure(options.seconds, options.period_ms, options.trials)
    for name, value in figures.items():
        print(f"{name:22s} {value}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2), encoding="utf-8")


if __name__ == "__main__":
    main()
