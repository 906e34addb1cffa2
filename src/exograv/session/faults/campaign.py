"""Many scenarios from one seed, on all cores: what was found how soon, what went out, and what must never have."""

import os
import signal
from collections.abc import Generator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import lru_cache
from multiprocessing import get_context
from typing import Any

import numpy as np

from exograv.errors import ConfigError
from exograv.safety.guard import SafeState
from exograv.session.arm_controller import ArmController
from exograv.session.person_limits import person_limits
from exograv.session.pilot import Progress
from exograv.session.prepare import prepare
from exograv.session.virtual import draw_laboratory, limits

from .flight import Subject
from .scenario import HAND_MAX_M_S, Scenario, Verdict, fly, is_bad, names_of, shrunk
from .table import FAULTS

RIGS = ("recupera_like", "recupera_like_qdd")
"""Each person is in one of these machines, in turn."""

CHUNK = 20
REPLAYS_MAX = 20


@dataclass(frozen=True)
class Campaign:
    """What `exograv faults` is asked for."""

    scenarios: int = 200
    seed: int = 0
    level: int = 2
    persons: int = 2
    processes: int | None = None
    replay: str | None = None
    """One scenario in place of all: "NUMBER:FAULT+FAULT"."""

    def __post_init__(self):
        if self.scenarios < 1:
            raise ConfigError(f"--scenarios is {self.scenarios}; allowed: 1 and above.")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.persons < 1:
            raise ConfigError(f"--persons is {self.persons}; allowed: 1 and above.")

    def replayed(self) -> Scenario:
        """The one that is asked for.

        Raises:
            ConfigError: There is no such fault, or no number.
        """
        number, _, faults = (self.replay or "").partition(":")
        names = tuple(names_of(faults))
        unknown = [name for name in names if name not in FAULTS]
        if not number.isdecimal() or unknown:
            raise ConfigError(
                f"--replay is '{self.replay}'; allowed: NUMBER:FAULT or NUMBER:FAULT+FAULT as a campaign prints it. "
                f"Faults: {', '.join(FAULTS)}."
            )
        return Scenario(self.seed, int(number), names)


def run_campaign(campaign: Campaign, progress: Progress) -> dict[str, Any]:
    """Fly all scenarios; the result follows the contract of `exograv faults --json`.

    Raises:
        ConfigError: An option cannot be used.
        ExogravError: A machine or a person could not be prepared.
    """
    if campaign.replay is not None:
        scenario = campaign.replayed()
        verdict = fly(_subject_of(campaign, scenario), scenario)
        return _figures(campaign, [verdict]) | {"course": _told(verdict)}
    verdicts: list[Verdict] = []
    progress("Preparing persons", 0.0)
    flown = _flown(campaign)
    try:
        for done, chunk in enumerate(flown, start=1):
            verdicts.extend(chunk)
            progress("Flying scenarios", min(done * CHUNK / campaign.scenarios, 1.0))
    except KeyboardInterrupt:
        progress("Stopped by the keyboard; what was flown is summed up", 1.0)
    finally:
        flown.close()
    verdicts.sort(key=lambda verdict: verdict.scenario.number)
    bad = [verdict for verdict in verdicts if is_bad(verdict)][:REPLAYS_MAX]
    small = []
    for k, verdict in enumerate(bad):
        progress("Shrinking what went wrong", k / len(bad))
        small.append(shrunk(_subject_of(campaign, verdict.scenario), verdict))
    return _figures(campaign, verdicts) | {"replay": [scenario.command for scenario in small]}


def _flown(campaign: Campaign) -> Generator[list[Verdict], None, None]:
    """Chunk by chunk, in the order in which they are done; all scenarios of a chunk have the same person."""
    by_person = [range(k, campaign.scenarios, campaign.persons) for k in range(campaign.persons)]
    chunks = [numbers[i : i + CHUNK] for numbers in by_person for i in range(0, len(numbers), CHUNK)]
    processes = campaign.processes or os.cpu_count() or 1
    if processes == 1:
        yield from (_fly_chunk(campaign, chunk) for chunk in chunks)
        return
    pool = ProcessPoolExecutor(processes, get_context("spawn"), initializer=_begin)
    try:
        for future in as_completed([pool.submit(_fly_chunk, campaign, chunk) for chunk in chunks]):
            yield future.result()
    finally:
        for process in list(pool._processes.values()):
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    # Ctrl-C reaches every process of the terminal; this one is ended by the one that started it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _fly_chunk(campaign: Campaign, numbers: Sequence[int]) -> list[Verdict]:
    scenarios = [Scenario.drawn(campaign.seed, number) for number in numbers]
    return [fly(_subject_of(campaign, scenario), scenario) for scenario in scenarios]


def _subject_of(campaign: Campaign, scenario: Scenario) -> Subject:
    return subject(campaign.seed, scenario.number % campaign.persons, campaign.level)


@lru_cache(maxsize=4)
def subject(seed: int, person: int, level: int) -> Subject:
    """A person whom this software has calibrated and identified like any other; kept for the next scenario."""
    drawn = 1000 * (seed + 1) + person
    laboratory = draw_laboratory(RIGS[person % len(RIGS)], None, level, drawn)
    prepared = prepare(laboratory, drawn, lambda _text, _share: None)
    controller = ArmController(prepared.assembly, prepared.machine, prepared.x, 0.001)
    of_person = person_limits(prepared.assembly, prepared.machine, prepared.x)
    return Subject(laboratory, prepared, controller, limits(laboratory.description), of_person)


def _figures(campaign: Campaign, verdicts: Sequence[Verdict]) -> dict[str, Any]:
    quiet_h = sum(v.quiet_s for v in verdicts) / 3600.0
    false = [v for v in verdicts if v.false_trip]
    return {
        "ok": not any(map(is_bad, verdicts)),
        "scenarios": len(verdicts),
        "seed": campaign.seed,
        "disturbance_level": campaign.level,
        "ticks": sum(v.course.ticks for v in verdicts),
        "envelope_violations": sum(v.course.violated_ticks for v in verdicts),
        "violations": [f"{v.scenario.command}: {v.course.violations[0]}" for v in verdicts if v.course.violations][:10],
        "crashed": [f"{v.scenario.command}: {v.course.crashed}" for v in verdicts if v.course.crashed][:10],
        "missed_budgets": sum(len(v.missed) for v in verdicts),
        "missed": [f"{v.scenario.command}: {v.found}" for v in verdicts if v.missed][:10],
        "by_fault": {name: _of_fault(name, verdicts) for name in FAULTS},
        "false_trips": [f"{v.scenario.command}: {v.course.reason}" for v in false],
        "false_trips_per_hour": round(len(false) / quiet_h, 2) if quiet_h else 0.0,
        "quiet_hours": round(quiet_h, 4),
        "relaxed_hand_m_s": _hand(verdicts),
        "replay": [],
    }


def _of_fault(name: str, verdicts: Sequence[Verdict]) -> dict[str, Any]:
    alone = [v for v in verdicts if v.scenario.faults == (name,) and not v.false_trip]
    times = [t for v in alone if (t := v.found.get(name)) is not None]
    p50, p99, most = np.percentile(times, [50, 99, 100]).round(2).tolist() if times else (None, None, None)
    fault, hands = FAULTS[name], [v.course.hand_m_s for v in alone if v.relaxed]
    return {
        "what": fault.what,
        "runs": sum(name in v.scenario.faults for v in verdicts),
        "alone": len(alone),
        "detected": len(times),
        "reaction_ms": {"p50": p50, "p99": p99, "max": most},
        "budget_ms": fault.budget_ms,
        "missed": sum(name in v.missed for v in verdicts),
        "safe_state": SafeState(fault.safe_state).name,
        "worst_safe_state": max((v.course.worst for v in alone), default=SafeState.NONE).name,
        "hand_m_s": round(max(hands), 3) if hands else None,
        "extra_speed_rad_s": round(max((v.course.extra_speed for v in alone), default=0.0), 3),
        "extra_way_deg": round(max((v.course.extra_way_deg for v in alone), default=0.0), 2),
    }


def _hand(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """Of relaxed arms after one fault that stopped the run."""
    found = [v for v in verdicts if v.relaxed and len(v.scenario.faults) == 1 and v.course.stopped_tick is not None]
    speeds = [v.course.hand_m_s for v in found]
    return {
        "runs": len(speeds),
        "max": round(max(speeds), 3) if speeds else None,
        "above": sum(speed > HAND_MAX_M_S for speed in speeds),
        "allowed": HAND_MAX_M_S,
    }


def _told(verdict: Verdict) -> dict[str, Any]:
    course = verdict.course
    return {
        "ticks": course.ticks,
        "stopped_tick": course.stopped_tick,
        "reason": None if course.reason is None else course.reason.value,
        "worst_safe_state": course.worst.name,
        "violations": course.violations,
        "crashed": course.crashed,
        "found_ms": verdict.found,
        "missed": list(verdict.missed),
        "false_trip": verdict.false_trip,
        "hand_m_s": round(course.hand_m_s, 3),
        "extra_speed_rad_s": round(course.extra_speed, 3),
        "extra_way_deg": round(course.extra_way_deg, 2),
        "torque_step_Nm": round(course.torque_step_Nm, 4),
        "relaxed": verdict.relaxed,
    }
