"""Cost of the guard's limits of power and energy for healthy pointing: the same people with and without them.

    python benchmarks/power_limit.py --seeds 0-5 --rig quasi-direct     # ten minutes

Each virtual participant is identified, and trains some windows in the twin, weightless, twice with the same seeds:
behind all limits of the wearer, and behind limits without the power and the energy tank. The table has the muscle
torque in the windows (RMS over time, norm over freedoms [N·m]) and the touches per window; below is the mean change
over people [%] with its 95 % interval (Student). The goal is a change of at most 2 %. The last columns show how near
the limits are: largest power of all joints beyond carrying and friction [W], and least energy in the tank [J], every
20 ms. `--power 0.01` shows what a limit that acts costs.
"""

import argparse
import dataclasses
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from exograv.campaigns.virtual_study.conditions import condition_of
from exograv.campaigns.virtual_study.session_setup import (
    SessionSetup,
    TrainingKnowledge,
    cached_training,
    training_setup,
)
from exograv.campaigns.virtual_study.session_simulation import ACT_TICKS, SimulatedSession
from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.virtual_participant import PointingPerson
from exograv.loop.person_limits import person_limits
from exograv.safety.limits import PersonLimits
from exograv.safety.native import core
from exograv.task.plan import TaskPlan
from exograv.task.protocol import first_windows, load_protocol
from seeds import seed_range

NO_TANK_J = 1e9
"""Energy of a tank that never limits [J]."""


class Flown(NamedTuple):
    """Figures of some windows of one participant."""

    muscle_Nm: float
    touches: float
    stops: int
    power_W: float
    energy_J: float


class MeasuredSession(SimulatedSession):
    """Session that sums up the wearer's muscle torque in the windows."""

    squares, ticks, power_W, energy_J = 0.0, 0, 0.0, np.inf

    def advance(self, session) -> None:
        """Run one step of the task, and note the muscle torque after it."""
        super().advance(session)
        if self.run.state.window is not None:
            tau = self.stage.twin.truth.tau_muscle
            self.squares, self.ticks = self.squares + float(tau @ tau), self.ticks + 1
            r = self._guard.envelope.record.numbers
            power_W = sum(max(0.0, r[core.OVER + j] * r[core.KNOWN + j]) for j in range(int(r[core.N])))
            self.power_W, self.energy_J = max(self.power_W, power_W), min(self.energy_J, r[core.ENERGY])


def limits_of(known: TrainingKnowledge, is_limited: bool, power_W: float | None) -> PersonLimits:
    """Return the guard's limits of an identified wearer (with another power), or those without power and tank."""
    assert known.known is not None
    limits = person_limits(known.known.assembly, known.known.machine, known.known.x)
    if is_limited:
        return limits if power_W is None else dataclasses.replace(limits, power_max_W=power_W)
    return dataclasses.replace(limits, power_max_W=np.inf, tank_start_J=NO_TANK_J, tank_max_J=NO_TANK_J)


def seated(stage: SessionSetup, windows: int, seed: int, limits: PersonLimits) -> MeasuredSession:
    """Put a participant at the screen."""
    loaded, room = first_windows(load_protocol("training"), windows), SimulatedRoom()
    target = room.on_panel(*room.target_px(loaded.settings.target))
    person = PointingPerson(
        stage.own, stage.worn_inertia, stage.surroundings, target, loaded.settings.pace.too_short.shape, seed,
        ACT_TICKS * stage.twin.period_s, Habits(),
    )  # fmt: skip
    person.begin_day(0)
    return MeasuredSession(stage, TaskPlan(loaded, stage.exo, room.calibration), room, person, seed, limits)


def flown(known: TrainingKnowledge, windows: int, limits: PersonLimits) -> Flown:
    """Fly some windows."""
    session = seated(training_setup(known, 0), windows, known.seed, limits)
    session.fly(None, lambda _share: None)
    muscle_Nm, touches = float(np.sqrt(session.squares / session.ticks)), len(session.touches) / windows
    return Flown(muscle_Nm, touches, session.stops, session.power_W, session.energy_J)


def change_text(changes: list[float]) -> str:
    """Mean change over people with its 95 % interval [%]."""
    values = 100.0 * np.array(changes)
    half = (
        student.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    )
    return f"{values.mean():+.2f} % ({values.mean() - half:+.2f} to {values.mean() + half:+.2f})"


def main() -> None:
    """Fly all people, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0-5")
    parser.add_argument("--windows", type=int, default=2)
    parser.add_argument("--level", type=int, default=2, help="disturbance level")
    parser.add_argument("--rig", default="harmonic", choices=["harmonic", "quasi-direct"])
    parser.add_argument("--power", type=float, help="power limit [W]; that of the guard if absent")
    options = parser.parse_args()
    condition = condition_of("dam" if options.rig == "harmonic" else f"dam@{options.rig}")
    efforts, touches = list[float](), list[float]()
    print(
        "| seed | muscle torque without, with | touches without, with | stops | W | J |\n|---|---|---|---|---|---|",
        flush=True,
    )
    for seed in seed_range(options.seeds):
        known = cached_training(condition, seed, options.level, lambda _text, _share: None)
        free, limited = (
            flown(known, options.windows, limits_of(known, is_limited, options.power)) for is_limited in (False, True)
        )
        efforts.append(limited.muscle_Nm / free.muscle_Nm - 1.0)
        touches.append(limited.touches / free.touches - 1.0)
        said = f"{free.muscle_Nm:.3f}, {limited.muscle_Nm:.3f} | {free.touches:.1f}, {limited.touches:.1f}"
        said += f" | {free.stops}, {limited.stops} | {limited.power_W:.3f} | {limited.energy_J:.3f}"
        print(f"| {seed} | {said} |", flush=True)
    print(f"muscle torque {change_text(efforts)}; touches {change_text(touches)}")


if __name__ == "__main__":
    main()
