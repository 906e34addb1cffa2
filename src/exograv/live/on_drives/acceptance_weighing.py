"""Known weight on the dummy's hook: weighed on slow passes, carried, and taken off again."""

import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate
from exograv.live.options import AcceptOptions
from exograv.loop.arm_controller import ArmController
from exograv.loop.keyboard import is_line_typed
from exograv.loop.machine_limits import limits
from exograv.loop.mode_ramp import fade
from exograv.loop.moved_machine import PilotedArm
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.phases import FLOATING, TRAVEL_RAD_S, WEIGHING
from exograv.loop.pilot import Pilot, Progress
from exograv.loop.tick_sample import TickSample
from exograv.model.support import assemble
from exograv.motion import go_to, hold
from exograv.procedures.acceptance.dummy import Dummy
from exograv.procedures.calibration.operator import Operator
from exograv.procedures.identification.warm_start import belief_today
from exograv.procedures.self_test.motion_steps import DRIFT_MAX_DEG, HOLD_S
from exograv.procedures.weighing.known_weight import weigh
from exograv.safety.modes import REST_BEFORE_RAMP_S
from exograv.storage.machine_readiness import MachineReadiness
from exograv.storage.participant_file import read_participant
from exograv.storage.self_test_step import Step, within

from .connection import CONNECTING, Connected, Say, connected, not_ready

MOUNT = "hand"
ERROR_SHARE, ERROR_KG = 0.05, 0.030
"""Largest error of a known weight: share of it, or mass [kg], whichever is larger (the project's promise)."""

WAIT_S, LOWER_S, STEPS = 0.5, 2.0, 20
"""Wait between two looks for the operator, shortest time for a weight to be lowered [s], and its number of steps."""

ASKED = (
    "The motors' torque gives another weight than your scale. Check --weight and the place of the hook, then the "
    "torque constants in rig.toml."
)
SINKS = "The dummy with the weight drifts while the machine carries both. Calibrate again."


@dataclass(frozen=True)
class IdentifiedDummy:
    """Dummy whose identification is kept in a file."""

    dummy: Dummy
    file: Path
    simulation: tuple[str, ...]
    """Options of simulated drives with this dummy."""
    ready: str
    """Instruction to the operator before the motors switch on."""


def weigh_on_drives(
    options: AcceptOptions, readiness: MachineReadiness, identified: IdentifiedDummy, progress: Progress, say: Say
) -> list[Step]:
    """Take the identified dummy, weigh a known weight on its hook, carry it, and put all down.

    Raises:
        ConfigError: A file cannot be used.
        RigError: The machine is locked, cannot carry the weight, or the envelope stopped it.
        KeyboardInterrupt: The operator has stopped the machine.
    """
    description = readiness.description
    refuse = not_ready(options, readiness.folder, description, "rig accept", say)
    with connected(options, description, say, "An acceptance", refuse, identified.simulation) as machine:
        if not options.simulate:
            say(identified.ready)
            while not is_line_typed(sys.stdin, WAIT_S):
                pass
        return _DummyOnDrives(options, readiness, identified, machine, progress).weighed()


class _DummyOnDrives:
    """Identified dummy on a machine whose drives answer."""

    def __init__(
        self,
        options: AcceptOptions,
        readiness: MachineReadiness,
        identified: IdentifiedDummy,
        machine: Connected,
        progress: Progress,
    ):
        progress(CONNECTING, 1.0)
        description = readiness.description
        calibration = readiness.calibration().whole.calibration()
        assembly = assemble(description, identified.dummy.body)
        x, covariance = belief_today(
            read_participant(identified.file), assembly, calibration.machine, datetime.now(UTC)
        )[0]
        self._arm = Estimate(0.0, x, covariance, 0.0, 1.0)
        self._model = ArmModel(assembly, calibration.machine)
        self._operator: Operator = machine.hands.weights
        self._weight_kg = options.weight_kg
        self._hung_kg = 0.0
        self._pilot: Pilot = machine.pilot(calibration.machine.actuators, limits(description), progress)
        self._pilot.key = readiness.key
        self._pilot.worn = PersonLimitsManager(self._pilot.envelope, assembly, calibration.machine, x)
        self._controller = ArmController(assembly, calibration.machine, x, self._pilot.rig.period_s)
        self._donning = np.array(description.donning_posture)

    def weighed(self) -> list[Step]:
        """Return the steps of weighing and carrying."""
        pilot, controller = self._pilot, self._controller
        self._take_dummy()
        found = weigh(PilotedArm(pilot, controller), self._model, self._arm, self._hang)
        error = found.mass - self._weight_kg
        allowed = max(ERROR_SHARE * self._weight_kg, ERROR_KG)
        low, high = found.ci95
        steps = [
            within(f"{self._weight_kg:g} kg on the hook: error", error, round(allowed, 4), "kg", ASKED),
            Step("95 % interval of the weight", True, f"{low:.3f} to {high:.3f} kg"),
        ]
        steps.append(self._drift())
        self._hang(False)
        controller.carry(MOUNT, 0.0, pilot.q)
        pilot.run(controller, go_to(pilot.q, self._donning, TRAVEL_RAD_S, pilot.rig.period_s), "Putting the dummy down")
        fade(pilot, controller, "gravity_level", 1.0, pilot.q.copy())
        return steps

    def _take_dummy(self) -> None:
        pilot, controller = self._pilot, self._controller
        worn = pilot.worn
        assert worn is not None
        controller.mode.gravity_level = 1.0
        worn.know(self._arm.x)
        person = pilot.envelope.person
        assert person is not None
        person.gravity_level = 1.0
        # The feedback holds the posture from the first tick on; its ramp lasts as long as the rest before the weight's.
        fade(pilot, controller, "drive", WEIGHING.drive.goal(is_known=True), pilot.q.copy())
        rest = max(REST_BEFORE_RAMP_S - 1.0, 0.0)
        if rest:
            pilot.run(controller, hold(pilot.q.copy(), rest, pilot.rig.period_s), "Resting")
        fade(pilot, controller, "gravity_level", 0.0, pilot.q.copy())
        # The operator lets go of the dummy a second after the machine has taken it.
        pilot.run(controller, hold(pilot.q.copy(), 2.0, pilot.rig.period_s), "Carrying the dummy")

    def _hang(self, is_there: bool) -> None:
        """Have the operator hang the weight, or take it off, while the machine holds the dummy."""
        goal, before = self._weight_kg if is_there else 0.0, self._hung_kg
        if goal == before:
            return
        pilot, dt = self._pilot, self._pilot.rig.period_s
        q, text = pilot.q.copy(), f"Waiting for {goal:g} kg on the hook"
        while not self._operator.is_ready(MOUNT, goal):
            pilot.run(self._controller, hold(q, WAIT_S, dt), text)
        seconds = max(self._operator.lowers_s, LOWER_S)
        for step in range(1, STEPS + 1):
            self._operator.lower(MOUNT, before + (goal - before) * step / STEPS)
            pilot.run(self._controller, hold(q, seconds / STEPS, dt), text)
        self._hung_kg = goal

    def _drift(self) -> Step:
        """Return the largest motion of a joint within `HOLD_S` without feedback, while both are carried."""
        pilot, dt = self._pilot, self._pilot.rig.period_s
        fade(pilot, self._controller, "drive", FLOATING.drive.goal(is_known=True), pilot.q.copy())
        start, way = pilot.q.copy(), np.zeros_like(pilot.q)

        def listen(moment: TickSample) -> None:
            np.maximum(way, np.abs(moment.q - start), out=way)

        pilot.run(self._controller, hold(start, HOLD_S, dt), "Floating with the weight", listen)
        fade(pilot, self._controller, "drive", WEIGHING.drive.goal(is_known=True), pilot.q.copy())
        what = "drift while dummy and weight float"
        return within(what, float(np.rad2deg(way.max())), DRIFT_MAX_DEG, f"° in {HOLD_S:g} s", SINKS)
