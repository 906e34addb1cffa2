"""A known weight in the hand: the same two-way motion without and with it; the difference is the weight."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.dynamics import parameters
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.arm_model import ArmModel
from exograv.identification.interface import Sample
from exograv.identification.prior import LENGTH_SD, disturbance_sd
from exograv.identification.recursive import DISTURBANCE_SCALES
from exograv.identification.sample_filter import SampleFilter
from exograv.identification.square_root import FilterBank
from exograv.model.arm import held_weight
from exograv.model.support import sample_postures
from exograv.motion import Trajectory

from .arm_controller import ArmController
from .fade import fade
from .pilot import Moment, Pilot

WEIGHT_SD_KG = 2.0  # of the prior, about nothing in the hand
SAMPLE_S = 0.08
SPEED = 0.35  # rad/s
CYCLES = 3  # some 27 s: a restless wearer averages out over his 3 s
CANDIDATES = 64  # postures in which the weight might ask most
GRIP_SD_M = 0.010  # where in the hand the weight is
CORRELATION_S = 3.0


@dataclass(frozen=True)
class Weighing:
    """A weight, found."""

    mass: float
    """[kg]"""

    ci95: tuple[float, float]
    """[kg]"""


@dataclass(frozen=True)
class _Pass:
    """One run of the motion: what was measured beyond what the arm explains, and what a kilogram would add."""

    excess: Float[np.ndarray, "sample joint"]
    per_kg: Float[np.ndarray, "sample joint"]
    noise: Float[np.ndarray, "sample joint"]


class _Scale:
    """Listens to one pass."""

    def __init__(self, model: ArmModel, x: parameters.Parameters, dt: float):
        assembly = model.assembly
        self._model, self._x, self._machine = model.again(), x.copy(), model.machine
        self._held, self._phi = held_weight(assembly.arm, 1.0), parameters.Layout.of(assembly).phi
        self._filter = SampleFilter(assembly.n, dt)
        self._every = round(SAMPLE_S / dt)
        self._ticks = 0
        self._rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def __call__(self, moment: Moment) -> None:
        sample = self._filter.update(moment.state.q, moment.tau_measured)
        self._ticks += 1
        if not self._filter.settled or self._ticks % self._every:
            return
        tau, derivative = self._model.linearise(
            Sample(sample.t, sample.q.copy(), sample.v.copy(), sample.a.copy(), sample.tau.copy()), self._x
        )
        repeats = np.maximum(self._machine.correlation_s / SAMPLE_S, 1.0)
        noise = np.hypot(self._machine.residual_sd * np.sqrt(repeats), self._model.direction_uncertainty(sample.v))
        self._rows.append((sample.tau - tau, derivative[:, self._phi] @ self._held, noise))

    def result(self) -> _Pass:
        return _Pass(*(np.array(column) for column in zip(*self._rows, strict=True)))


def weigh(
    pilot: Pilot,
    controller: ArmController,
    model: ArmModel,
    x: parameters.Parameters,
    hang: Callable[[bool], None],
) -> Weighing:
    """Move the arm to and fro without and with the weight, and compare.

    Args:
        pilot: On the worn machine.
        controller: The arm's; it drives afterwards, and carries the whole arm.
        model: Of this arm in the machine as calibrated.
        x: The arm as identified.
        hang: Puts the weight into the hand, or takes it out: the wearer's part.

    Raises:
        RigError: The envelope stopped the run.
    """
    path = weighing_motion(controller, model, x, pilot.rig.period_s)
    fade(pilot, controller, "drive", 1.0, pilot.q.copy())
    fade(pilot, controller, "gravity_level", 0.0, pilot.q.copy())
    passes = []
    for loaded in (False, True):
        hang(loaded)
        approach = motion.go_to(pilot.q, path.q[0], 0.6, pilot.rig.period_s)
        settle = motion.hold(path.q[0], 0.5, pilot.rig.period_s)
        text = f"Weighing {'with' if loaded else 'without'} the weight"
        pilot.run(controller, motion.joined([approach, settle]), text)
        scale = _Scale(model, x, pilot.rig.period_s)
        pilot.run(controller, path, text, scale)
        passes.append(scale.result())
    return _difference(passes[0], passes[1], controller, model.machine)


def weighing_motion(controller: ArmController, model: ArmModel, x: parameters.Parameters, dt: float) -> Trajectory:
    """A nearly straight arm up and down, to and fro: friction cancels, and the weight has its longest lever."""
    description = controller.assembly.description
    lower, upper = description.workspace
    if description.settings.donning.arm_posture_deg is None:
        # The machine's joints are the arm's: shoulder and elbow of the first arm, all others in the middle.
        others = [0.5] * (len(lower) - 4)
        low = lower + np.array([0.45, 0.2, 0.5, 0.05, *others]) * (upper - lower)
        high = lower + np.array([0.95, 0.2, 0.5, 0.40, *others]) * (upper - lower)
    else:
        low, high = _heaviest_way(model.again(), x)
    up, down = motion.go_to(low, high, SPEED, dt), motion.go_to(high, low, SPEED, dt)
    return motion.joined([up, down] * CYCLES)


def _heaviest_way(
    model: ArmModel, x: parameters.Parameters
) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]]:
    """Where in the task workspace a held weight asks most, and a posture half a range of a joint away [rad]."""
    assembly = model.assembly
    held, phi = held_weight(assembly.arm, 1.0), parameters.Layout.of(assembly).phi
    postures = sample_postures(assembly.description, CANDIDATES)[1:]
    per_kg = np.array([model.at_rest(q, x)[1][:, phi] @ held for q in postures])
    high = postures[int(np.abs(per_kg).sum(axis=1).argmax())]
    joint = int(np.abs(per_kg[np.abs(per_kg).sum(axis=1).argmax()]).argmax())
    lower, upper = assembly.description.workspace
    low, middle = high.copy(), 0.5 * (lower + upper)[joint]
    low[joint] += np.sign(middle - high[joint]) * 0.5 * (upper - lower)[joint]
    return low, high


def _difference(empty: _Pass, loaded: _Pass, controller: ArmController, machine: CalibratedMachine) -> Weighing:
    """One unknown, the weight; the wearer's restlessness of both passes as slow disturbance."""
    n = len(machine.residual_sd)
    usual = disturbance_sd(controller.assembly.description.places)
    disturbance = np.sqrt(2.0) * DISTURBANCE_SCALES[:, None] * usual
    bank = FilterBank(1, disturbance, CORRELATION_S, considered=n)
    # What stage 0 could not explain may differ between the passes, because the weight bends the posture.
    errors = np.diag(machine.residual_sd)
    count = min(len(empty.excess), len(loaded.excess))
    for k in range(count):
        H, excess = WEIGHT_SD_KG * loaded.per_kg[k][:, None], loaded.excess[k] - empty.excess[k]
        noise, _ = bank.held_back(SAMPLE_S, H, excess, np.hypot(empty.noise[k], loaded.noise[k]))
        bank.update(SAMPLE_S, H, excess, noise, errors)
    mass = WEIGHT_SD_KG * float(bank.mean()[0])
    sd = WEIGHT_SD_KG * float(np.sqrt(bank.covariance()[0, 0]))
    half = 1.96 * float(np.hypot(sd, mass * _lever_sd(controller, machine)))
    return Weighing(mass, (mass - half, mass + half))


def _lever_sd(controller: ArmController, machine: CalibratedMachine) -> float:
    """Relative error of what a kilogram does: lengths of the arm and the motors' gain."""
    lengths = controller.assembly.arm.lengths
    upper_arm, forearm = lengths["upper_arm"], lengths["forearm"]
    lever = np.sqrt((LENGTH_SD * upper_arm) ** 2 + (LENGTH_SD * forearm) ** 2 + GRIP_SD_M**2) / (upper_arm + forearm)
    gain = float((machine.actuators.gain_sd / machine.actuators.gain).max())
    return float(np.hypot(lever, gain))
