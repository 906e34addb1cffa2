"""Slow changes in three hours of training on the twin: what the checks find, and the left over with and without them.

    python benchmarks/long_session.py --case changes --seeds 0 1 2
    python benchmarks/long_session.py --case quiet --seeds 0 1 2 3 4 5 6 7 8 9 --level 2

The arm is identified for 60 s, then its motion is repeated for 20 s every ten minutes, and the arm is identified again
where a check finds a change. Between two checks the twin's clock passes, with the warm-up of its drives, and nothing
moves. Cases: `quiet`, nothing changes and the drives stay as they are; `warm`, all drives warm up by the level's law;
`changes`, beside that three cuffs slip by 8 to 20 mm at drawn times, the relaxed arm pulls by 0.8 to 1.5 N·m about a
drawn freedom for an hour, and the friction of one drive falls by a further 10 to 20 % at once.

A finding is right if the same change has happened at the same place since the motion that the check refers to, with
the same sign; friction of a drive also counts as right for a warm-up. It is missed if the first check after the change
does not tell it, and ambiguous if that check names it among several that it cannot tell apart.

Left over: RMS at the held-out postures by the twin's truth, largest joint over its target. Figures: seeds from 0.
Thresholds were chosen on seeds from 1000.
"""

import argparse
import dataclasses
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.left_over import TARGET_NM
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.drift.slow_causes import Kind
from exograv.identification.drift.slow_watch import FoundChange, SlowJudgement
from exograv.laboratory.preparation import Preparation, WornTwin
from exograv.laboratory.truth_score import Examination
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, laboratory_at
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.model.description import load_rig
from exograv.procedures.identification.identify import V_MOTION
from exograv.procedures.identification.session_watch import SessionWatch, repeat_motion
from exograv.procedures.identification.watch_text import watch_text
from exograv.rig.twin import Disturbances
from exograv.rig.twin.twin import WARM_UP_TIME

RIG, CHECK_EVERY_S, HALF_HOUR_S = "recupera_like", 600.0, 1800.0
WARM_MIN = 0.015
"""Fall of friction from which a warm-up has happened [-]."""


@dataclass
class Change:
    """Change that is made during a session."""

    kind: Kind
    place: str
    size: float
    at_s: float
    """Time of the check before which it happens [s]."""
    told: str = "open"


def drawn(seed: int, case: str, laboratory: VirtualLaboratory, hours: float) -> list[Change]:
    """Draw the changes of a session."""
    if case != "changes":
        return []
    rng = np.random.default_rng([seed, 77])
    assembly = laboratory.assembly()
    cuffs = [cuff.name for cuff in assembly.cuffs if cuff.along_N_per_mm > 0.0]
    checks = np.arange(1, round(3600.0 * hours / CHECK_EVERY_S) + 1) * CHECK_EVERY_S
    times = rng.choice(checks[:-1], 5, replace=False)
    slips = [
        Change(Kind.CUFF, str(rng.choice(cuffs)), float(rng.choice([-1, 1]) * rng.uniform(0.008, 0.02)), float(t))
        for t in times[:3]
    ]
    freedom = str(rng.choice(assembly.arm.freedoms))
    tone = Change(Kind.TONE, freedom, float(rng.choice([-1, 1]) * rng.uniform(0.8, 1.5)), float(times[3]))
    joint = str(rng.choice(assembly.description.joints))
    return [*slips, tone, Change(Kind.FRICTION, joint, -float(rng.uniform(0.1, 0.2)), float(times[4]))]


class Session:
    """Session of one wearer."""

    def __init__(self, seed: int, case: str, level: int, hours: float):
        """Calibrate the machine and identify the arm."""
        disturbances = Disturbances.at_level(level)
        if case == "quiet":
            disturbances = disturbances.with_row("warm_up", 0)
        self.laboratory = laboratory_at(load_rig(RIG), disturbances, seed, seed)
        self.changes, self.hours = drawn(seed, case, self.laboratory, hours), hours
        preparation = Preparation(self.laboratory, seed)
        self.worn: WornTwin = preparation.worn(preparation.calibrated())
        identifier, kept = self.worn.identifier(), Kept()
        identifier.followers.append(kept)
        found = self.worn.identify(identifier)
        floated = found.floated
        assert floated.covariance is not None
        self.x, self.covariance, self.assembly = floated.x, floated.covariance, self.worn.known.assembly
        self.x0, self.controller = floated.x, self.worn.controller
        self.machine = self.worn.known.machine
        self.watch = SessionWatch(ArmModel(self.assembly, self.machine), self.x, self.covariance, kept.samples)
        self.examination0 = self.examination = Examination(self.laboratory, self.assembly, self.machine)
        self.slid: dict[str, float] = {}
        self.since, self.warmth = list[Change](), self.warm()
        self.counts = dict.fromkeys(("right", "covered", "wrong", "ambiguous", "missed", "restless", "checks"), 0)
        self.log, self.curve = list[str](), list[tuple[float, float, float]]()

    def warm(self) -> float:
        """Present warm-up of the drives [-]."""
        return 1.0 - float(np.exp(-self.worn.twin.t / WARM_UP_TIME))

    def run(self) -> None:
        """Run the session to its end."""
        start = self.worn.twin.t
        targets = np.array([TARGET_NM[place] for place in self.assembly.description.places])
        for n in range(1, round(3600.0 * self.hours / CHECK_EVERY_S) + 1):
            t = n * CHECK_EVERY_S
            self.worn.twin.pass_time(max(start + t - self.worn.twin.t, 0.0))
            for change in self.changes:
                self._happens(change, t)
            self._check(t)
            if t % HALF_HOUR_S == 0.0:
                with_, without = (
                    float((examination.score(x).total / targets).max())
                    for examination, x in ((self.examination, self.x), (self.examination0, self.x0))
                )
                self.curve.append((t, without, with_))

    def _happens(self, change: Change, t: float) -> None:
        twin = self.worn.twin
        if change.kind is Kind.TONE:
            freedom = list(self.assembly.arm.freedoms).index(change.place)
            begins, ends = change.at_s, change.at_s + 3600.0
            twin.tau_voluntary[freedom] = change.size if begins <= t < ends else 0.0
            if t == ends:
                self.since.append(dataclasses.replace(change, size=-change.size, told="end"))
        if change.at_s != t:
            return
        self.since.append(change)
        if change.kind is Kind.CUFF:
            self.slid[change.place] = self.slid.get(change.place, 0.0) + change.size
            for each in {id(one): one for one in (twin, self.examination, self.examination0)}.values():
                each.slide_cuff(change.place, self.slid[change.place])
        elif change.kind is Kind.FRICTION:
            self._loosen(change)

    def _loosen(self, change: Change) -> None:
        """Change the friction of one drive: continue in a twin whose drive has less of it."""
        joint = list(self.assembly.description.joints).index(change.place)
        machine, before = self.laboratory.machine, self.worn
        factor = np.ones(len(machine.friction.coulomb))
        factor[joint] = 1.0 + change.size
        friction = dataclasses.replace(
            machine.friction, coulomb=machine.friction.coulomb * factor, viscous=machine.friction.viscous * factor
        )
        laboratory = dataclasses.replace(self.laboratory, machine=dataclasses.replace(machine, friction=friction))
        preparation = Preparation(laboratory, round(change.at_s) + 1)
        known = dataclasses.replace(before.known, t=before.twin.t, assembly=self.assembly, x=self.x)
        self.worn, self.laboratory = preparation.worn(known), laboratory
        self.worn.limit_to_person()
        self.controller = self.worn.controller
        for name, way in self.slid.items():
            self.worn.twin.slide_cuff(name, way)
        self.worn.twin.tau_voluntary[:] = before.twin.tau_voluntary

    def _check(self, t: float) -> None:
        pilot = self.worn.pilot
        assert pilot.worn is not None
        pilot.worn.expect(self.x, self.covariance, V_MOTION)
        samples = repeat_motion(pilot, self.controller)
        judgement = self.watch.judge(samples)
        self._score(judgement, t)
        if judgement.is_silent:
            return
        learned = self.watch.learn_again(samples, judgement)
        self.x, self.assembly = learned.carried.x, learned.assembly
        if learned.carried.covariance is not None:
            self.covariance = learned.carried.covariance
        self.controller = learned.controller(self.controller, pilot.rig.period_s)
        pilot.worn = PersonLimitsManager(pilot.envelope, self.assembly, self.machine, self.x)
        self.examination = Examination(self.laboratory, self.assembly, self.machine)
        for name, way in self.slid.items():
            self.examination.slide_cuff(name, way)
        self.since, self.warmth = [], self.warm()

    def _score(self, judgement: SlowJudgement, t: float) -> None:
        self.counts["checks"] += 1
        self.counts["restless"] += judgement.is_restless
        told = () if judgement.is_restless else judgement.changes
        named = () if judgement.is_restless else judgement.one_of
        for found in told:
            truth = self._truth(found)
            is_right = truth is not None and truth * found.size > 0.0
            self.counts["right" if is_right else "wrong"] += 1
            self.counts["covered"] += is_right and truth is not None and abs(truth - found.size) <= found.half_width
        if named and not any(self._truth(one) is not None for one in named):
            self.counts["wrong"] += 1
        for change in self.since:
            if change.told in ("open", "end") and change.at_s in (t, t - 3600.0):
                places = [(one.cause.kind, one.cause.place) for one in told]
                among = [(one.cause.kind, one.cause.place) for one in named]
                here = change.kind, change.place
                change.told = "told" if here in places else "ambiguous" if here in among else "missed"
                self.counts[change.told] = self.counts.get(change.told, 0) + (change.told != "told")
        happened = ", ".join(f"{one.kind.value} {one.place} {one.size:+.3f} {one.told}" for one in self.since)
        self.log.append(f"{t / 60:4.0f} min: {watch_text(judgement)} [since: {happened or 'nothing'}]")

    def _truth(self, found: FoundChange) -> float | None:
        """Return the true size of a finding since the motion that it refers to; None if there is none."""
        kind, place = found.cause.kind, found.cause.place
        sizes = [one.size for one in self.since if one.kind is kind and one.place == place]
        if kind in (Kind.FRICTION, Kind.WARM_UP):
            rows = np.asarray(self.laboratory.machine.friction.warm_up)
            now = 1.0 - rows * self.warm()
            fallen = now / (1.0 - rows * self.warmth) - 1.0
            if kind is Kind.WARM_UP:
                return float(fallen.mean()) if fallen.mean() < -WARM_MIN else None
            joint = list(self.assembly.description.joints).index(place)
            total = float((1.0 + fallen[joint]) * np.prod([1.0 + size for size in sizes]) - 1.0)
            return total if total < -WARM_MIN else None
        return float(sum(sizes)) if sizes else None


class Kept:
    """Follower of an identification that keeps averaged samples."""

    def __init__(self):
        self._averages = Averages(BATCH_PERIOD_S)
        self.samples: list[Sample] = []

    def __call__(self, sample: Sample) -> None:
        """Take one sample."""
        mean = self._averages.take(sample)
        if mean is not None:
            self.samples.append(mean)


def main() -> None:
    """Run the sessions and print their figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", choices=("quiet", "warm", "changes"), default="changes")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--hours", type=float, default=3.0)
    parser.add_argument("--save", type=Path)
    options = parser.parse_args()
    total, curves, rows = dict[str, int](), list[np.ndarray](), list[dict[str, Any]]()
    for seed in options.seeds:
        begun = time.process_time()
        session = Session(seed, options.case, options.level, options.hours)
        session.run()
        for line in session.log:
            print(f"seed {seed} {line}", flush=True)
        print(f"seed {seed}: {session.counts}, {time.process_time() - begun:.0f} s of CPU", flush=True)
        for name, count in session.counts.items():
            total[name] = total.get(name, 0) + int(count)
        curves.append(np.array(session.curve))
        rows.append({"seed": seed, "counts": session.counts, "curve": session.curve, "log": session.log})
    hours = options.hours * len(options.seeds)
    print(f"\n{options.case}, level {options.level}, {len(options.seeds)} sessions, {hours:g} h")
    print("left over, worst joint over its target, median (largest) over sessions; 1 is the target")
    print(f"{'min':>5} {'without':>16} {'identified again':>18}")
    for at in np.swapaxes(np.array(curves), 0, 1):
        without, with_ = (f"{np.median(at[:, k]):.2f} ({at[:, k].max():.2f})" for k in (1, 2))
        print(f"{at[0, 0] / 60:5.0f} {without:>16} {with_:>18}")
    print(f"findings: {total}; wrong per hour: {total['wrong'] / hours:.3f}")
    if options.save is not None:
        options.save.write_text(json.dumps(rows, indent=1, default=float), encoding="utf-8")


if __name__ == "__main__":
    main()
