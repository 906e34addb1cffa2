"""Information about an arm in the pointing of its wearer, and the estimate from it, on the twin.

    python benchmarks/active_information.py --seeds 1000-1002
    python benchmarks/active_information.py --seeds 1000-1002 --rests 6

Each wearer points in windows of 22 s. The machine carries the arm of the table, at level 0 and 0.02 in turns. The table
prints the smallest standard deviation of the residual gravity torque under assumptions about the muscles, then the
residual torque of estimates under these assumptions, with the share of held-out torques inside the 95 % interval.
Effort is the standard deviation of the muscle torque that repeats at every touch.

With --rests K the wearer rests K times instead, and the machine moves the relaxed arm for --motion-s seconds in each.
The table then prints the smallest standard deviation after each rest, beside the residual torque of the learner. The
bound counts the noise, the slow torque of a relaxed arm, and the uncertain direction of friction, but no error of the
model.
"""

from dataclasses import dataclass, replace

import numpy as np
import tyro

from exograv.dynamics.parameters import ParameterLayout
from exograv.experiment.train.lockstep_screen import LockstepScreen
from exograv.experiment.train.preparation import lay_down
from exograv.identification.active.active_wearer import ActiveWearer, TouchWindow
from exograv.identification.active.muscle_torque import FREE_NM, MuscleTorque
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Sample, TorqueModel
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.noise import Noise
from exograv.identification.core.prior import prior
from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.twin_seat import TwinSeat
from exograv.laboratory.participant.virtual_participant import PointingPerson
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.truth_score import Examination
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.phases import LAYING_DOWN
from exograv.loop.tick_sample import TickSample
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import setting_of, table_guess
from exograv.procedures.identification.identify import V_MOTION
from exograv.procedures.identification.rest_learning import REST_MOTION_S, RestLearner, move_in_rest
from exograv.procedures.weighing.motion_samples import MotionListener
from exograv.task.events import Start
from exograv.task.plan import TaskPlan
from exograv.task.protocol import LoadedProtocol, load_protocol
from exograv.task.records import Record, TouchRecord
from exograv.task.run import TaskRun

EFFORTS_NM = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, FREE_NM)
LEVELS = (0.0, 0.02)
REST_S = 20.0
WINDOWS = {"2 min": 6, "5 min": 14}


@dataclass(frozen=True)
class Options:
    """Options of the comparison."""

    seeds: str = "1000-1002"
    rig: str = "recupera_like"
    level: int = 2
    rests: int = 0
    """Number of rests with driven motion; 0 for pointing."""
    motion_s: float = REST_MOTION_S
    """Duration of the driven motion in each rest [s], without the way to its start."""


@dataclass
class AlternatingLevel:
    """Lowest level of each window; it changes while the arm rests at a higher level."""

    number: int = 0
    is_changed: bool = False

    def __call__(self, level: float) -> float:
        """Return the level to make."""
        if level > 0.5 and not self.is_changed:
            self.number += 1
        self.is_changed = level > 0.5
        return max(level, LEVELS[self.number % len(LEVELS)])


def short_protocol(windows: int) -> LoadedProtocol:
    """Return the training protocol with this many windows and short rests."""
    loaded = load_protocol("training")
    settings = loaded.settings
    table = next(iter(settings.rest_tables.values())).model_copy(update={"rest_s": REST_S, "longer": ()})
    changed = {
        "windows": settings.windows.model_copy(update={"count": windows}), "rest_tables": {"short": table},
        "rests": "short", "before_first_s": REST_S, "after_last_s": REST_S,
    }  # fmt: skip
    return replace(loaded, settings=settings.model_copy(update=changed))


def pointing(laboratory: VirtualLaboratory, seed: int, windows: int) -> tuple[ControllerKnowledge, list[TouchWindow]]:
    """Calibrate the machine, let the wearer point, and return the windows as the estimator needs them."""
    preparation, room, loaded = Preparation(laboratory, seed), SimulatedRoom(), short_protocol(windows)
    known, settings = preparation.calibrated(), loaded.settings
    around = room.around(known.assembly, settings.target)
    worn = preparation.worn(known, around)
    pilot, controller, twin = worn.pilot, worn.controller, worn.twin
    worn.limit_to_person()
    twin.put_surroundings(False)
    controller.mode.drive = LAYING_DOWN.drive.goal(is_known=True)
    lay_down(pilot, controller, twin.put_surroundings)
    person = PointingPerson(
        laboratory.own_arm(), laboratory.worn_inertia(), around, room.on_panel(*room.target_px(settings.target)),
        settings.pace.too_short.shape, seed, twin.period_s, Habits(interval_s=settings.windows.interval_s),
    )  # fmt: skip
    touches, states = list[float](), list[tuple[float, bool]]()
    listener = MotionListener(len(twin.joints), twin.period_s)

    def note(_t: float, records: tuple[Record, ...]) -> None:
        touches.extend(one.t for one in records if isinstance(one, TouchRecord) and one.is_accepted)

    def follow(moment: TickSample) -> None:
        before = len(listener.samples)
        listener(moment)
        if len(listener.samples) > before:
            states.append((moment.state.t, run.state.window is not None))

    run = TaskRun(TaskPlan(loaded, "active", room.calibration), sinks=(note,))
    seat = TwinSeat(twin, person, room, settings.target, seed, "simulated")
    screen = LockstepScreen(run, pilot, controller, seat, modulate=AlternatingLevel(), follower=follow)
    run.feed(Start(t=twin.t))
    screen.fly()
    return known, _windows(listener, states, touches)


def _windows(listener: MotionListener, states: list[tuple[float, bool]], touches: list[float]) -> list[TouchWindow]:
    t, is_open = (np.array(column) for column in zip(*states, strict=True))
    samples = listener.samples
    later = float(np.median(t - [sample.t for sample in samples]))
    edges = np.flatnonzero(np.diff(is_open.astype(int), prepend=0, append=0))
    return [
        TouchWindow(samples[a:b], [one - later for one in touches if t[a] <= one <= t[b - 1]], f"{k % len(LEVELS)}")
        for k, (a, b) in enumerate(zip(edges[::2], edges[1::2], strict=True))
    ]


def inside(examination: Examination, model: ArmModel, estimate: Estimate) -> float:
    """Share of the torques at the held-out postures, all joints, that lie in the 95 % interval [-]."""
    if estimate.covariance is None:
        return np.nan
    layout = ParameterLayout.of(model.assembly)
    rows = np.array([model.at_rest(q, estimate.x)[1] for q in examination.postures])
    rows[:, :, layout.fit.stop :] = 0.0
    variance = np.einsum("pji,ik,pjk->pj", rows, estimate.covariance, rows, optimize=True)
    return float((np.abs(examination.arm_error(estimate.x)) <= 1.96 * np.sqrt(np.maximum(variance, 0.0))).mean())


def text(values: np.ndarray) -> str:
    """Joint values with two decimals."""
    return " ".join(f"{value:5.2f}" for value in values)


def named(muscle: MuscleTorque) -> str:
    """Assumption in words."""
    effort = "free" if muscle.repeated_Nm == FREE_NM else f"{muscle.repeated_Nm:.1f} N·m"
    return f"effort {effort}, {'free answer' if muscle.answer_Nm else 'no answer'} to the support"


def rested(options: Options, seed: int) -> None:
    """Print bound and residual torque of one wearer after each rest."""
    laboratory = draw_laboratory(options.rig, None, options.level, seed)
    preparation = Preparation(laboratory, seed)
    known = preparation.calibrated()
    worn, model = preparation.worn(known), ArmModel(known.assembly, known.machine)
    belief, noise = (
        prior(known.assembly, known.machine),
        setting_of(model.again(), prior(known.assembly, known.machine)).noise,
    )
    prediction, learner = LeftOverPrediction(model.again(), belief[0]), RestLearner(model, known.x)
    worn.pilot.worn = PersonLimitsManager(worn.pilot.envelope, known.assembly, known.machine, known.x)
    examination = worn.examination()
    print(f"wearer {seed}: N·m per joint ({', '.join(laboratory.description.joints)})")
    print(
        f"  before any motion, SD {text(prediction.rms(belief[1]))}, left over {text(examination.score(known.x).total)}"
    )
    information = np.linalg.inv(belief[1])
    for k in range(1, options.rests + 1):
        worn.pilot.worn.expect(learner.x, learner.covariance, V_MOTION)
        path = learner.path(worn.twin.period_s, options.motion_s)
        samples = move_in_rest(worn.pilot, worn.controller, path)
        information += information_of(model.again(), samples, belief[0], noise)
        learned = learner.learn(samples)
        left = examination.score(learner.x).total
        bound = prediction.rms(np.linalg.inv(information))
        print(f"  {k} rests, {learned.motion_s:.0f} s of motion: bound, SD {text(bound)}")
        print(f"    stated {text(learned.stated_Nm)}, left over {text(left)}, {learned.verdict.name}", flush=True)
        worn.twin.pass_time(REST_S)


def information_of(model: TorqueModel, samples: list[Sample], x: np.ndarray, noise: Noise) -> np.ndarray:
    """Fisher information about the parameters in the motion of a rest, per squared parameter.

    The noise of a sample is white beside the slow torque of the wearer, a first-order process per joint.
    """
    rows = [model.linearise(sample, x)[1] for sample in samples]
    uncertain = np.array([model.direction_uncertainty(sample.v) for sample in samples])
    t, derivative = np.array([sample.t for sample in samples]), np.array(rows)
    gap = np.diff(t, prepend=t[0] - 1.0)[:, None]
    white = np.square(noise.sd) * np.maximum(noise.correlation_s / gap, 1.0) + uncertain**2
    together = np.exp(-np.abs(t[:, None] - t) / noise.disturbance_correlation_s)
    total = np.zeros((derivative.shape[2],) * 2)
    for j, slow_sd in enumerate(noise.disturbance_sd):
        C = slow_sd**2 * together + np.diag(white[:, j])
        total += derivative[:, j].T @ np.linalg.solve(C, derivative[:, j])
    return total


def compared(options: Options, seed: int) -> None:
    """Print bounds and estimates of one wearer."""
    laboratory = draw_laboratory(options.rig, None, options.level, seed)
    known, windows = pointing(laboratory, seed, max(WINDOWS.values()))
    model, belief = ArmModel(known.assembly, known.machine), prior(known.assembly, known.machine)
    prediction, examination = (
        LeftOverPrediction(model.again(), belief[0]),
        Examination(laboratory, known.assembly, known.machine),
    )
    print(f"wearer {seed}: N·m per joint ({', '.join(laboratory.description.joints)})")
    table = examination.score(table_guess(known.assembly, known.machine)).total
    print(f"  prior, SD                         {text(prediction.rms(belief[1]))}")
    print(f"  table, left over                  {text(table)}")
    for duration, count in WINDOWS.items():
        muscles = [*(MuscleTorque(repeated, 0.0) for repeated in EFFORTS_NM), MuscleTorque()]
        method = ActiveWearer(setting_of(model.again(), belief))
        for window in windows[:count]:
            method.add(window)
        for muscle, covariance in zip(muscles, method.bounds(muscles), strict=True):
            print(f"  {duration}, {named(muscle)}, SD {text(prediction.rms(covariance))}")
    for muscle in (MuscleTorque(), *(MuscleTorque(repeated, 0.0) for repeated in (FREE_NM, 1.0, 0.3))):
        method = ActiveWearer(setting_of(model.again(), belief), muscle)
        for window in windows:
            method.add(window)
        found = method.estimate()
        left, share = examination.score(found.x).total, inside(examination, model.again(), found)
        print(f"  5 min, {named(muscle)}, left over {text(left)}, inside 95 %: {share:.0%}", flush=True)


if __name__ == "__main__":
    asked = tyro.cli(Options, description=__doc__)
    first, _, last = asked.seeds.partition("-")
    for one in range(int(first), int(last or first) + 1):
        (rested if asked.rests else compared)(asked, one)
