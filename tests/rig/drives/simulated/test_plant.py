"""Motors of a plant turn by the gains at the temperatures of their windings, and drives measure their own currents."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from exograv.model.description import load_rig
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated.plant import Plant
from exograv.rig.twin import Disturbances, Machine, Twin, draw_machine

EXAMPLE = Path(__file__).parents[4] / "examples" / "drives" / "udp.toml"
RIG = load_rig("recupera_like")
SLOPE_PER_C, AT_C, HOT_C = -0.004, 25.0, 75.0
ELBOW, CURRENT_A, STEPS = 3, 0.5, 60


@pytest.fixture(scope="module")
def machine() -> Machine:
    drawn = draw_machine(RIG, Disturbances.at_level(0), 0)
    warm = replace(drawn.drives, gain_slope=np.full(4, SLOPE_PER_C), gain_at=np.full(4, AT_C))
    return replace(drawn, drives=warm)


def torque_and_current(machine: Machine, celsius: float) -> tuple[float, float]:
    """Torque of the elbow's motor [N·m] and measured current [A] under a constant command."""
    twin = Twin(RIG, machine, None, 0)
    plant = Plant(twin, load_drives(EXAMPLE, RIG))
    for _ in range(STEPS):
        for joint, drive in enumerate(plant.each):
            drive.temperature_C = celsius
            drive.enable(plant.now)
            drive.tell(CURRENT_A if joint == ELBOW else 0.0, 0.0, plant.now)
        plant.step()
    return float(twin.truth.tau_motor[ELBOW]), plant.current(ELBOW)


def test_a_hot_motor_gives_less_torque_for_the_same_measured_current(machine: Machine):
    (cold, cold_A), (hot, hot_A) = (torque_and_current(machine, celsius) for celsius in (AT_C, HOT_C))
    assert hot / cold == pytest.approx(1.0 + SLOPE_PER_C * (HOT_C - AT_C), abs=1e-3)
    assert abs(cold_A) == pytest.approx(CURRENT_A, rel=1e-3)
    assert hot_A == pytest.approx(cold_A, rel=1e-3)


def test_a_machine_without_a_slope_gives_the_same_torque_at_any_temperature():
    drawn = draw_machine(RIG, Disturbances.at_level(0), 0)
    (cold, _), (hot, _) = (torque_and_current(drawn, celsius) for celsius in (AT_C, HOT_C))
    assert hot == pytest.approx(cold, rel=1e-9)
