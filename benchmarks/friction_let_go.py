"""Full twin: an arm that was pushed and let go, what is returned of friction at its most, and nobody holding.

    python benchmarks/friction_let_go.py --levels 2,3 --seeds 0-4

The controller knows friction exactly (so that it returns the whole share), as it is cold, of a machine that is warm;
the arm is 3 % lighter than it thinks. What moves in the last 5 of 30 s, at the machine's joints, and what its torque
does then. Nothing may, apart from steps of the encoder. tests/scenario/test_let_go.py is the same for two machines.
"""

import argparse
from dataclasses import replace

import numpy as np

from exograv import motion
from exograv.dynamics.parameters import ParameterLayout
from exograv.laboratory.ideal_from_truth import prepared_by_truth
from exograv.laboratory.preparation import pilot_of
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.pilot import Pilot, TickSample
from exograv.rig.twin import Twin

POSTURE = np.deg2rad([40.0, 20.0, 15.0, 80.0])
PUSH_Nm, PUSH_S = 6.0, 0.3
WATCH_S, STILL_S = 30.0, 5.0
TOO_HEAVY = 1.03
WARM_S = 1800.0  # on the rig's clock


def let_go(level: int, seed: int) -> tuple[float, float, float]:
    """Way while nobody holds [°], its part in the last seconds [°], and the torque's swing in these [N·m]."""
    laboratory = draw_laboratory("recupera_like", "right", level, seed)
    arms = tuple(
        replace(arm, unrest=replace(arm.unrest, bias_rms=0 * arm.unrest.bias_rms, bursts_per_minute=0.0))
        for arm in laboratory.wearer.arms
    )
    laboratory = replace(laboratory, wearer=replace(laboratory.wearer, arms=arms))
    known = prepared_by_truth(laboratory, 0.0)
    x = known.x.copy()
    x[ParameterLayout.of(known.assembly).phi] *= TOO_HEAVY
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, seed, start_posture=POSTURE, t0=WARM_S)
    pilot = pilot_of(twin, known.machine.actuators, laboratory, lambda _text, _share: None)
    controller = ArmController(known.assembly, known.machine, x, twin.period_s)
    controller.mode.drive = 1.0
    pilot.run(controller, motion.hold(POSTURE, 1.0, twin.period_s), "Held")
    fade(pilot, controller, "drive", 0.0, POSTURE)
    for freedom in range(len(twin.truth.q_arm)):
        _push(pilot, controller, twin, freedom)
    rows: list[np.ndarray] = []

    def watch(moment: TickSample) -> None:
        rows.append(np.concatenate([twin.truth.q, moment.tau_commanded]))

    pilot.run(controller, motion.hold(POSTURE, WATCH_S, twin.period_s), "Nobody holds it", watch)
    q, tau = np.hsplit(np.array(rows), 2)
    last = slice(-round(STILL_S / twin.period_s), None)
    drift = np.abs(q[-1] - q[round(1.0 / twin.period_s)]).max()
    return (
        float(np.rad2deg(drift)),
        float(np.rad2deg(np.ptp(q[last], axis=0).max())),
        float(np.ptp(tau[last], axis=0).max()),
    )


def _push(pilot: Pilot, controller: ArmController, twin: Twin, freedom: int) -> None:
    """By the wearer's own muscle, there and back."""
    ticks = 0

    def act(_moment: TickSample) -> None:
        nonlocal ticks
        ticks += 1
        twin.tau_voluntary[freedom] = PUSH_Nm * np.sin(2 * np.pi * ticks * twin.period_s / PUSH_S)

    pilot.run(controller, motion.hold(POSTURE, PUSH_S, twin.period_s), "Pushed", act)
    twin.tau_voluntary[:] = 0.0


def main() -> None:
    """One line a machine."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--levels", default="2,3")
    parser.add_argument("--seeds", default="0-4")
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    for level in map(int, options.levels.split(",")):
        for seed in range(int(first), int(last or first) + 1):
            drift, still, torque = let_go(level, seed)
            print(f"level {level}, seed {seed}: from 1 s to 30 s {drift:.4f}°, last 5 s {still:.5f}° {torque:.4f} N·m")


if __name__ == "__main__":
    main()
