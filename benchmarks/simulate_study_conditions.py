"""Torque left over in each condition of a virtual study, and gravity level that a wearer feels who holds still.

Run: python benchmarks/simulate_study_conditions.py [--level 2] [--seeds 1000 1001 1002] [CONDITION …]

The felt level is the share of the own weight that the muscles carry, as the mean of a slow movement to and fro about
the donning posture. Friction would hold up to several N·m of an arm at rest; the mean removes its effect. These are
results of simulation and no evidence about people.
"""

import argparse

import numpy as np

from exograv.campaigns.virtual_study.conditions import condition_of
from exograv.campaigns.virtual_study.session_setup import (
    SessionSetup,
    familiarisation_setup,
    flight_setup,
    free_setup,
    prepared_setup,
)
from exograv.loop.arm_controller import ArmController
from exograv.signals import Command, Reference

CONDITIONS = (
    "table", "gcm", "gradient", "dam", "ideal", "dam@quasi-direct", "ideal@quasi-direct", "ideal+left=0.2",
    "ideal+friction=2", "water",
)  # fmt: skip
STIFFNESS, DAMPING = 200.0, 10.0
"""Stiffness and damping of a wearer who does not give way [N·m/rad, N·m·s/rad]."""

SWAY, SWAY_S = np.deg2rad(6.0), 4.0
"""Amplitude of every freedom [rad] and period of the movement [s]; the first period is not counted."""


def felt_level(stage: SessionSetup) -> float:
    """Share of the own weight that the muscles need to hold the arm [-]."""
    twin, controller = stage.twin, stage.controller
    twin.put_surroundings(False)
    if isinstance(controller, ArmController):
        controller.mode.gravity_level = 0.0
    posture, still = twin.truth.q_arm, np.zeros(len(twin.joints))
    rest = np.zeros_like(posture)
    efforts = []
    ticks = round(SWAY_S / twin.period_s)
    for tick in range(2 * ticks):
        truth, state = twin.truth, twin.read()
        wanted = posture + SWAY * np.sin(2.0 * np.pi * tick / ticks)
        effort = STIFFNESS * (wanted - truth.q_arm) - DAMPING * truth.v_arm
        twin.tau_voluntary[:] = effort
        tau = controller.step(state.q, still, Reference(state.q, still, still))
        twin.write(Command(state.t, state.sequence, state.t + 0.005, tau, stage.actuators.current(tau)))
        efforts.append(effort)
    weight = stage.own.torque(posture, rest, rest, 1.0) - stage.own.torque(posture, rest, rest, 0.0)
    mean = np.mean(efforts[ticks:], axis=0)
    elastic = stage.own.torque(posture, rest, rest, 0.0)
    return float((mean - elastic) @ weight / (weight @ weight))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conditions", nargs="*", default=CONDITIONS)
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1000, 1001, 1002])
    asked = parser.parse_args()
    print("| condition | left over, worst shoulder axis [N·m] | Coulomb friction [N·m] | felt at rest |")
    print("|---|---|---|---|")
    for name in asked.conditions:
        condition = condition_of(name)
        row(condition.name, [
            prepared_setup(condition, seed, asked.level, 0, lambda _text, _share: None) for seed in asked.seeds
        ])  # fmt: skip
    row("familiarised, on the ground", [familiarisation_setup(seed, asked.level, 0) for seed in asked.seeds])
    flights = [flight_setup(seed, asked.level, 0) for seed in asked.seeds]
    for stage in flights:
        stage.twin.fly(np.zeros(3))
    row("in flight, 0 g", flights)
    for g in (0.0, 1.0, 1.8):
        row(f"no machine, {g:g} g", [free_setup(seed, asked.level, 0, g) for seed in asked.seeds])


def row(name: str, stages: list[SessionSetup]) -> None:
    """Print one line of the table, with one value per seed."""
    columns = (
        [_told(stage.left_over_Nm) for stage in stages],
        [_told(stage.friction_Nm) for stage in stages],
        [_told(felt_level(stage)) for stage in stages],
    )
    print(f"| {name} | " + " | ".join(", ".join(column) for column in columns) + " |", flush=True)


def _told(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


if __name__ == "__main__":
    main()
