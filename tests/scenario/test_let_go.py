"""A released arm comes to rest and stays there: returned friction causes no oscillation."""

from dataclasses import replace

import numpy as np
import pytest

from exograv import motion
from exograv.dynamics.parameters import ParameterLayout
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.tick_sample import TickSample
from exograv.rig.twin import Twin

POSTURE = np.deg2rad([40.0, 20.0, 15.0, 80.0])
PUSH_Nm, PUSH_S = 6.0, 0.3
WATCH_S, STILL_S = 30.0, 5.0
STILL_DEG = 0.02  # A few encoder steps of 17 bits, two of 15 bits.
QUIET_Nm = 0.6  # One or two such steps of the spring.
TOO_HEAVY = 1.03  # Residual error of the arm's weight after an identification.


@pytest.mark.slow
@pytest.mark.parametrize("level", [2, 3])
@pytest.mark.parametrize("seed", [0])  # More machines: docs/explanation/friction.md.
def test_a_relaxed_arm_that_was_pushed_comes_to_rest_and_stays(level: int, seed: int):
    laboratory = draw_laboratory("recupera_like", "right", level, seed)
    arms = tuple(
        replace(arm, unrest=replace(arm.unrest, bias_rms=0 * arm.unrest.bias_rms, bursts_per_minute=0.0))
        for arm in laboratory.wearer.arms
    )
    laboratory = replace(laboratory, wearer=replace(laboratory.wearer, arms=arms))
    known = ideal_knowledge(laboratory, 0.0)
    x = known.x.copy()
    x[ParameterLayout.of(known.assembly).phi] *= TOO_HEAVY
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, seed, start_posture=POSTURE, t0=1800.0)
    pilot = Preparation(laboratory, seed).pilot_of(twin, known.machine.actuators)
    controller = ArmController(known.assembly, known.machine, x, twin.period_s)
    controller.mode.drive = 1.0
    pilot.run(controller, motion.hold(POSTURE, 1.0, twin.period_s), "Held")
    fade(pilot, controller, "drive", 0.0, POSTURE)
    for freedom in range(4):
        push(pilot, controller, twin, freedom)
    rows: list[np.ndarray] = []

    def watch(moment: TickSample) -> None:
        rows.append(np.concatenate([twin.truth.q, moment.tau_commanded]))

    pilot.run(controller, motion.hold(POSTURE, WATCH_S, twin.period_s), "Nobody holds it", watch)
    last = np.array(rows[-round(STILL_S / twin.period_s) :])
    spread = np.ptp(last, axis=0)
    assert np.rad2deg(spread[:4]).max() < STILL_DEG
    assert spread[4:].max() < QUIET_Nm


def push(pilot, controller, twin: Twin, freedom: int) -> None:
    """Push the arm by the wearer's own muscle, there and back."""
    ticks = 0

    def act(_moment: TickSample) -> None:
        nonlocal ticks
        ticks += 1
        twin.tau_voluntary[freedom] = PUSH_Nm * np.sin(2 * np.pi * ticks * twin.period_s / PUSH_S)

    pilot.run(controller, motion.hold(POSTURE, PUSH_S, twin.period_s), "Pushed", act)
    twin.tau_voluntary[:] = 0.0
