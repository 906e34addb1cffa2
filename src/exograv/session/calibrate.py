"""Stage 0: the empty machine sweeps with nothing and with known weights, before anybody is put in."""

from dataclasses import dataclass

import numpy as np

from exograv.control.exo_tick import ExoTick
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.empty_machine import SAMPLE_PERIOD_S, Sweeps, calibrate
from exograv.identification.sample_filter import SampleFilter
from exograv.model.anthropometry import Body, segment_lengths
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.model.description import Sweep as SweepSettings
from exograv.motion import Trajectory, go_to, hold, joined, sweep
from exograv.rig.twin import Twin

from .pilot import Moment, Pilot

SLOW, FAST = 0.3, 0.9  # rad/s: two speeds tell Coulomb from viscous
CREEP, CREEP_WAY = 0.08, 0.35  # rad/s and rad: a short, very slow one shows what breaks away
TRAVEL = 0.8  # rad/s between sweeps
HANG_S, HANG_TICKS = 1.0, 20  # s to lower a weight, in steps of so many ticks


@dataclass
class _Notes:
    """Collects filtered samples while the machine sweeps."""

    pilot: Pilot
    weight: float = 0.0

    def __post_init__(self):
        self.rows: list[tuple[np.ndarray | float, ...]] = []
        self._filter = SampleFilter(len(self.pilot.rig.joints), self.pilot.rig.period_s)
        self._every = round(SAMPLE_PERIOD_S / self.pilot.rig.period_s)
        self._ticks = 0

    def __call__(self, moment: Moment) -> None:
        sample = self._filter.update(moment.state.q, moment.state.current)
        self._ticks += 1
        if self._filter.settled and self._ticks % self._every == 0:
            self.rows.append((sample.q.copy(), sample.v.copy(), sample.a.copy(), sample.tau.copy(), self.weight))

    def sweeps(self) -> Sweeps:
        columns = [np.array(column, dtype=float) for column in zip(*self.rows, strict=True)]
        return Sweeps(*columns)


def calibrate_machine(description: RigDescription, body: Body, pilot: Pilot) -> CalibratedMachine:
    """Sweep, weigh and fit; the pilot's rig must be empty, and set to the lengths of this person.

    Raises:
        IdentificationError: A joint did not move.
    """
    tree = adjusted(read_exoskeleton(description), description, segment_lengths(body))
    controller = ExoTick(description, tree)
    notes = _Notes(pilot)
    weights = [0.0, *description.calibration.weights_kg]
    for i, plan in enumerate(description.calibration.sweeps):
        text = f"Calibrating the empty machine: {plan.joint}"
        for weight in weights:
            _hang(pilot, controller, weight)
            notes.weight = weight
            motion = _motion(description, pilot, plan, fast=weight == 0.0)
            pilot.run(controller, motion, f"{text}, {weight:g} kg ({i + 1}/{len(description.joints)})", notes)
        _hang(pilot, controller, 0.0)
    return calibrate(description, tree, notes.sweeps())


def _motion(description: RigDescription, pilot: Pilot, plan: SweepSettings, *, fast: bool) -> Trajectory:
    joint = description.joints.index(plan.joint)
    start = np.deg2rad(plan.posture_deg)
    start[joint] = np.deg2rad(plan.from_deg)
    goal, dt = float(np.deg2rad(plan.to_deg)), pilot.rig.period_s
    parts = [go_to(pilot.q, start, TRAVEL, dt), hold(start, 0.3, dt), sweep(start, joint, goal, SLOW, dt)]
    if fast:
        creep = start[joint] + np.sign(goal - start[joint]) * CREEP_WAY
        parts += [hold(start, 0.3, dt), sweep(start, joint, goal, FAST, dt)]
        parts += [hold(start, 0.3, dt), sweep(start, joint, float(creep), CREEP, dt)]
    return joined([*parts, hold(start, 0.2, dt)])


def _hang(pilot: Pilot, controller: ExoTick, weight: float) -> None:
    """Lower a weight onto the mount within `HANG_S`: the twin by itself; on hardware an operator does it.

    All at once it would drop the arm, and the way back is as steep as the envelope allows: the machine would swing.
    """
    before, ticks = controller.weight_kg, round(HANG_S / pilot.rig.period_s)
    if weight == before:
        return
    passed = 0

    def lower(_moment: Moment) -> None:
        nonlocal passed
        passed += 1
        if passed % HANG_TICKS == 0:
            controller.weight_kg = before + (weight - before) * passed / ticks
            if isinstance(pilot.rig, Twin):
                pilot.rig.hang("calibration", controller.weight_kg)

    pilot.run(controller, hold(pilot.q.copy(), HANG_S, pilot.rig.period_s), f"Hanging {weight:g} kg", lower)
    controller.weight_kg = weight
