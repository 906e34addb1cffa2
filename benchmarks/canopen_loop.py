"""Control loop on a CAN bus in real time, against simulated drives in another process (docs/howto/canopen.md).

    python benchmarks/canopen_loop.py --seconds 60 --period-ms 2 --trials 20

CAN frames travel as UDP multicast on this computer. Each SYNC without all answers is compared with the delays of the
two processes. Both processes ask for real-time scheduling, on one processor each.
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
from exograv.runtime.clock.host import loop_cpus
from exograv.runtime.clock.real_time_loop import run_loop
from exograv.runtime.clock.realtime import realtime
from exograv.runtime.clock.timing import EDGES_US, Timing
from exograv.runtime.processes.spawn import spawned
from exograv.signals import Command

EXAMPLE = Path(__file__).parents[1] / "examples" / "drives" / "canopen.toml"
RIG, LEVEL, SEED = "recupera_like", 1, 1000
LIFE_S = 0.005
"""Life of a command [s], the same as in the live loop."""
CYCLES_BEFORE = 60
"""Periods with commands before each trial."""
GIVE_UP_S = 1.0
FAR_S = 0.5
"""Time after which a SYNC counts as not heard [s]."""

Spans = Float[np.ndarray, "sync stage"]


def serve(path: str, line: Connection) -> None:
    """Run the simulated drives until the parent process sends "stop"."""
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

    with devices, realtime(0) as rights:
        line.send(rights.granted)
        devices.run(until_stopped)


@dataclass
class Flown:
    """Log of a run of the loop."""

    asked_at: list[float] = field(default_factory=list)
    """Send time of each SYNC [s]."""
    answered_s: list[float] = field(default_factory=list)
    """Time from each SYNC to its last answer, or until the loop stopped waiting [s]."""
    told_s: list[float] = field(default_factory=list)
    """Time to send all commands of a period [s]."""
    incomplete: dict[int, None] = field(default_factory=dict)
    """Numbers of the SYNCs that were not answered in full (keys; the dict keeps the order)."""
    enabled_again: list[float] = field(default_factory=list)
    """Times at which the drives were enabled again, after they had braked by themselves or were lost [s]."""


def fly(rig: CanopenRig, seconds: float) -> tuple[Timing, Flown]:
    """Run the loop with zero torque."""
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
    """Enable the drives; retry for `GIVE_UP_S`, because a stall of this computer can interrupt the attempt."""
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
    """Delays of each SYNC (sync, 3) [s]: drives' process heard it, drives answered, this process had all answers."""
    heard, found, at = served[:, 0], np.full((len(flown.asked_at), 3), np.nan), -1
    for k, (asked, took) in enumerate(zip(flown.asked_at, flown.answered_s, strict=True)):
        first = int(np.searchsorted(heard, asked))
        at = max(at + 1, first)
        # The SYNC of a complete answer was heard before that answer. A later time means that an earlier SYNC was lost.
        at = first if k not in flown.incomplete and at < len(heard) and heard[at] > asked + took else at
        if at < len(heard) and heard[at] < asked + FAR_S:
            answered = served[at, 1]
            found[k] = heard[at] - asked, answered - heard[at], asked + took - answered
    return found


def explained(flown: Flown, spans: Spans, answer_s: float) -> dict[str, int]:
    """Count incomplete SYNCs by cause: the stage whose delay beyond its median explains the missing answer."""
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
            # An answer that may belong to the SYNC before does not count for this SYNC.
            causes["after one without"] += 1
        else:
            causes["not explained"] += 1
    return causes


def cycles(rig: CanopenRig, number: int, writes: bool = True) -> float | None:
    """Run `number` periods; return the time of the first joint fault [s], or None."""
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
    """Reaction times of each trial [ms]; a trial that a stall of the computer spoilt before its start is repeated."""
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
    """Write the example drives file with this period and a free port; return its path."""
    text = EXAMPLE.read_text(encoding="utf-8").replace('"239.74.163.2"', f'"239.74.163.2:{free_port()}"')
    path = folder / "drives.toml"
    path.write_text(text.replace("period_ms = 2", f"period_ms = {period_ms}"), encoding="utf-8")
    return path


def percentiles(values: list[float] | np.ndarray, unit: float) -> dict[str, float]:
    """Return median, 99 %, 99.9 % and maximum in the unit of the table."""
    p50, p99, p999 = np.percentile(values, [50, 99, 99.9]) * unit
    figures = {"median": p50, "p99": p99, "p99.9": p999, "max": np.max(values) * unit}
    return {name: round(float(value), 1) for name, value in figures.items()}


def measure(seconds: float, period_ms: int, trials: int) -> dict:
    """Run the loop and the reaction trials; return all figures."""
    with tempfile.TemporaryDirectory() as folder:
        path = drives_file(Path(folder), period_ms)
        drives = load_drives(path, load_rig(RIG))
        process, line = spawned("drives", serve, str(path))
        theirs = line.recv()
        with CanopenRig(drives) as rig:
            with realtime(loop_cpus().guard) as rights:
                timing, flown = fly(rig, seconds)
            line.send("served")
            said = line.recv()
            pauses, served = said["pauses"], np.frombuffer(said["served"]).reshape(-1, 2)
            answer_s = rig.answer_share * rig.period_s
            with realtime(loop_cpus().guard):
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
    """Measure, and print one line per figure."""
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
