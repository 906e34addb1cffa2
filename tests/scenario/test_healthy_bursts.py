"""A healthy wearer whose muscles jerk is not stopped while the machine moves the unknown arm, nor while it floats."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.preloaded import script

from exograv import motion
from exograv.identification.core.interface import Outcome
from exograv.identification.core.prior import prior
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.tick_sample import TickSample
from exograv.procedures.identification.identify import V_MOTION, identification_motion
from exograv.rig.twin import Twin

ELBOW = 3
BURST_Nm, BURST_S, PAUSE_S = 6.0, 0.3, 3.0
"""Largest and shortest burst of a wearer at level 2 (docs/explanation/disturbances.md); it acts in both directions."""

FLOATING_Nm = 4.0
"""Burst at a floating elbow, which nothing brakes."""

UNKNOWN_MAX_RAD_S = 2.3
"""Speed at which the guard stops a joint while the arm is unknown."""


def bursts(twin: Twin, size_Nm: float) -> tuple[Callable[[TickSample], None], list[float]]:
    """Return a listener that lets the wearer's elbow jerk every `PAUSE_S`, and a list with its top speed [rad/s]."""
    ticks, fastest = 0, [0.0]

    def act(moment: TickSample) -> None:
        nonlocal ticks
        number, at_s = divmod(ticks * twin.period_s, PAUSE_S)
        wave = size_Nm * np.sin(np.pi * at_s / BURST_S) if at_s < BURST_S else 0.0
        twin.tau_voluntary[ELBOW] = wave if number % 2 else -wave
        ticks += 1
        fastest[0] = max(fastest[0], abs(float(moment.v[ELBOW])))

    return act, fastest


@pytest.mark.long
def test_an_unknown_arm_on_quasi_direct_drives_may_jerk_in_the_motion(put_on):
    worn = put_on(2, rig="recupera_like_qdd")
    pilot, controller, dt = worn.pilot, worn.controller, worn.twin.period_s
    limits = PersonLimitsManager(pilot.envelope, controller.assembly, worn.machine, worn.table)
    limits.expect(*prior(controller.assembly, worn.machine), V_MOTION)
    controller.mode.drive = 1.0
    path = identification_motion(controller.assembly, 30.0, dt)
    pilot.run(controller, motion.go_to(pilot.q, path.q[0], 0.6, dt), "To the start")
    act, fastest = bursts(worn.twin, BURST_Nm)
    pilot.run(controller, path, "Moving", act)
    assert pilot.envelope.stop is None
    assert V_MOTION < fastest[0] < UNKNOWN_MAX_RAD_S


def test_a_floating_elbow_may_be_faster_than_the_limit_of_an_unknown_arm():
    laboratory, posture = draw_laboratory("recupera_like_qdd", "right", 2, 1012), np.deg2rad([45.0, 20.0, 0.0, 70.0])
    known = ideal_knowledge(laboratory, 0.0)
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, 1012, start_posture=posture)
    pilot = Preparation(laboratory, 1012).pilot_of(twin, known.machine.actuators)
    controller = ArmController(known.assembly, known.machine, known.x, twin.period_s)
    PersonLimitsManager(pilot.envelope, known.assembly, known.machine, known.x).know(known.x)
    pilot.envelope.begin(controller.torque_at_rest(posture, known.x))
    act, fastest = bursts(twin, FLOATING_Nm)
    pilot.run(controller, motion.hold(posture, 2.0 * PAUSE_S, twin.period_s), "Floating", act)
    assert pilot.envelope.stop is None
    assert fastest[0] > UNKNOWN_MAX_RAD_S


@pytest.mark.slow
def test_wearer_8_of_the_benchmark_on_quasi_direct_drives_is_not_stopped():
    said = script(Path(__file__).with_name("benchmark_wearer.py"), "qdd", "8", "60").stdout
    assert json.loads(said.splitlines()[-1]) == Outcome.CONVERGED.name
