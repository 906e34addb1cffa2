"""Fixtures of a short recorded run with all kinds of inputs to control, and of its wearer."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv import motion
from exograv.control.exo_tick import ExoTick
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import RigError
from exograv.laboratory.options import DemoOptions
from exograv.laboratory.provenance import provenance
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.assembly import Assembly, adjusted, read_exoskeleton
from exograv.procedures.calibration.breakaway_test import BreakawayPush, starting_posture
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.recording import RecordingWriter
from exograv.results import json_value
from exograv.rig.twin import Twin
from exograv.safety.envelope import Envelope
from exograv.safety.stops import StopReason

SEED, LEVEL = 1012, 2

GUARD_EVERY_S = 0.2
"""Time between two states of the guard in this short run [s]."""


@dataclass(frozen=True)
class Flown:
    """Recording of a run, and the knowledge of the run."""

    path: Path
    laboratory: VirtualLaboratory
    machine: CalibratedMachine
    x: np.ndarray


def nothing(_text: str, _share: float) -> None:
    """Ignore progress."""


@pytest.fixture(scope="session")
def laboratory() -> VirtualLaboratory:
    return draw_laboratory("recupera_like", "right", LEVEL, SEED)


@pytest.fixture(scope="session")
def assembly(laboratory: VirtualLaboratory) -> Assembly:
    return laboratory.assembly()


@pytest.fixture(scope="session")
def machine(laboratory: VirtualLaboratory, assembly: Assembly) -> CalibratedMachine:
    """Return the machine as a perfect stage 0 would calibrate it."""
    nominal, truth = nominal_machine(laboratory.description, assembly.exo.phi), laboratory.machine
    friction = replace(nominal.friction, coulomb=truth.friction.coulomb, viscous=truth.friction.viscous)
    gains = ActuatorGain(truth.drives.gain, 0.005 * truth.drives.gain)
    return replace(nominal, friction=friction, actuators=gains, rotor_inertia=truth.drives.rotor_inertia)


@pytest.fixture(scope="session")
def flown(
    tmp_path_factory: pytest.TempPathFactory,
    laboratory: VirtualLaboratory,
    assembly: Assembly,
    machine: CalibratedMachine,
) -> Flown:
    """Record a run: the empty machine with a weight, then an arm driven, published to, loaded, floated, and stopped."""
    path = tmp_path_factory.mktemp("flown") / "run.mcap"
    settings = json_value(provenance(DemoOptions(level=LEVEL, seed=SEED), laboratory, [0.2] * 4, {}))
    x = table_guess(assembly, machine)
    with (
        pytest.MonkeyPatch.context() as patch,
        RecordingWriter(path, laboratory.description.joints, settings) as recording,
    ):
        patch.setattr("exograv.loop.replay_log.EVERY_S", GUARD_EVERY_S)
        t = fly_empty(laboratory, machine, recording)
        with pytest.raises(RigError, match="enough"):
            fly_worn(laboratory, ArmController(assembly, machine, x, 0.001), recording, t)
    return Flown(path, laboratory, machine, x)


def fly_empty(laboratory: VirtualLaboratory, machine: CalibratedMachine, recording: RecordingWriter) -> float:
    description, lengths = laboratory.description, laboratory.wearer.lengths_given
    tree = adjusted(read_exoskeleton(description), description, lengths)
    start = starting_posture(tree)
    twin = Twin(description, laboratory.machine, None, SEED, start, lengths=lengths)
    pilot = Pilot(twin, machine.actuators, Envelope(limits(description), twin.period_s), recording)
    pilot.begin("calibrate")
    pilot.run(BreakawayPush(np.zeros(4)), motion.hold(start, 0.1, twin.period_s), "")
    tick, ticks = ExoTick(description, tree), 0

    def load(_: TickSample) -> None:
        nonlocal ticks
        ticks += 1
        if ticks % 50 == 0:
            tick.hang(description.calibration.mount, 0.002 * ticks)
            twin.hang(description.calibration.mount, 0.002 * ticks)

    pilot.run(tick, motion.hold(start, 0.25, twin.period_s), "", load)
    return twin.t


def fly_worn(laboratory: VirtualLaboratory, arm: ArmController, recording: RecordingWriter, t: float) -> None:
    description, x = laboratory.description, arm.x.copy()
    twin = _Ending(description, laboratory.machine, laboratory.wearer, SEED, t0=t)
    dt = twin.period_s
    pilot = Pilot(twin, arm.machine.actuators, Envelope(limits(description), dt), recording)
    arm.mode.drive, rng = 1.0, np.random.default_rng(SEED)
    start, ticks = pilot.q.copy(), 0

    def learn(moment: TickSample) -> None:
        nonlocal ticks
        ticks += 1
        if ticks % 100 == 0:
            arm.publish(x * (1.0 + 0.03 * rng.uniform(-1.0, 1.0)), moment.q)
        arm.mode.drive = max(0.0, 1.0 - max(ticks - 400, 0) / 200)
        arm.mode.gravity_level = 0.3 * min(max(ticks - 600, 0) / 200, 1.0)
        if ticks == 1250:
            pilot.envelope.trip(StopReason.ASTRAY)
            twin.left = 200

    pilot.begin("identify")
    pilot.run(arm, motion.go_to(start, start + 0.05, 0.3, dt), "", learn)
    arm.publish(np.full(len(x), np.nan), pilot.q)
    arm.publish(-x, pilot.q)
    arm.carry("hand", 0.8, pilot.q)
    pilot.run(arm, motion.hold(pilot.q, 0.5, dt), "", learn)
    pilot.begin("float")
    pilot.run(arm, motion.hold(pilot.q, 1.0, dt), "", learn)


class _Ending(Twin):
    """Twin that ends the run with an error after `left` commands."""

    left = 1_000_000

    def write(self, command: Any) -> None:
        self.left -= 1
        if self.left < 0:
            raise RigError("enough")
        super().write(command)
