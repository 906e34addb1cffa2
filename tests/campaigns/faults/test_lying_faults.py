"""Machines that lie keep everything plausible except what their fault changes."""

import numpy as np
import pytest

from exograv.campaigns.faults import lying_faults as of_lies
from exograv.campaigns.faults.fault_table import EARLIER, FAULTS, LATER
from exograv.campaigns.faults.scenario import LATER_EVERY, Scenario
from exograv.loop.arm_controller import ArmController
from exograv.signals import JointState, TorqueSource

JOINTS, ONSET = 4, 10


def state(tick: int) -> JointState:
    """Measurement in which every signal changes from tick to tick."""
    values = np.arange(JOINTS) + 0.01 * tick
    return JointState(
        1e-3 * tick, tick, values, 2.0 * values, np.full(JOINTS, np.nan), TorqueSource.CURRENT, values + 1
    )


class NotedWorld:
    """World that only notes what a fault does to it."""

    def __init__(self):
        self.factor, self.gravity, self.hung = 1.0, np.array([0.0, 0.0, 1.0]), [0.0]

    q = np.zeros(JOINTS)

    def turn_motor(self, joint: int, factor: float) -> None:
        self.factor *= factor

    def feel_gravity(self, g: np.ndarray) -> None:
        self.gravity = g

    def hang(self, mount: str, mass_kg: float) -> None:
        self.hung.append(mass_kg)

    def push(self, joint: int, torque: float) -> None: ...
    def slide_cuff(self, name: str, along_m: float) -> None: ...
    def at_bench(self, word: str, joint: int | None = None, number: float | None = None) -> None: ...
    def is_silent(self) -> None: ...


CONTROLLER = object.__new__(ArmController)


def test_a_frozen_machine_keeps_the_bits_of_every_signal_while_sequence_and_time_go_on():
    fault = of_lies.FrozenMachine(np.random.default_rng(0), JOINTS, ONSET)
    first, later = fault.measured(state(ONSET), ONSET), fault.measured(state(ONSET + 40), ONSET + 40)
    for name in ("q", "current", "q_motor"):
        np.testing.assert_array_equal(getattr(later, name), getattr(first, name))
    assert (later.sequence, later.t) == (ONSET + 40, 1e-3 * (ONSET + 40))


def test_a_frozen_board_keeps_the_signals_of_its_joint_only():
    fault = of_lies.FrozenBoard(np.random.default_rng(0), JOINTS, ONSET)
    first, later = fault.measured(state(ONSET), ONSET), fault.measured(state(ONSET + 40), ONSET + 40)
    others = np.arange(JOINTS) != fault.joint
    for name in ("q", "current", "q_motor"):
        assert getattr(later, name)[fault.joint] == getattr(first, name)[fault.joint]
        assert (getattr(later, name)[others] != getattr(first, name)[others]).all()


def test_a_frozen_board_has_to_show_under_torque_or_in_motion():
    fault = of_lies.FrozenBoard(np.random.default_rng(0), JOINTS, 0)
    told, moves = np.zeros((3, JOINTS)), np.zeros((3, JOINTS), bool)
    told[1, fault.joint], moves[2, fault.joint] = -2.0, True
    assert fault.shows(told, moves, np.zeros(JOINTS)).tolist() == [False, True, True]


def test_both_encoders_slip_by_the_same_angle_up_to_fifteen_degrees():
    fault = of_lies.CommonEncoderSlip(np.random.default_rng(0), JOINTS, ONSET)
    end = ONSET + fault.lasts + 100
    true, seen = state(end), fault.measured(state(end), end)
    assert true.q_motor is not None
    assert seen.q_motor is not None
    off, motor = seen.q - true.q, seen.q_motor - true.q_motor
    assert abs(off[fault.joint]) == pytest.approx(np.deg2rad(15.0))
    np.testing.assert_allclose(off, motor, atol=1e-12)
    assert np.count_nonzero(off) == 1


@pytest.mark.parametrize("period_ms", [1, 2, 5])
def test_a_drifting_torque_constant_ends_at_its_factor_and_a_tilting_base_at_ten_degrees(period_ms: int):
    world = NotedWorld()
    drift = of_lies.TorqueConstantDrift(np.random.default_rng(1), JOINTS, ONSET, period_ms)
    tilt = of_lies.TiltingBase(np.random.default_rng(1), JOINTS, ONSET, period_ms)
    for tick in range(ONSET, ONSET + 11_000 // period_ms):
        drift.act(world, CONTROLLER, tick)
        tilt.act(world, CONTROLLER, tick)
    assert world.factor == pytest.approx(drift.factor)
    assert drift.factor in (0.6, 1.6)
    assert np.rad2deg(np.arccos(world.gravity[2])) == pytest.approx(10.0)
    assert np.linalg.norm(world.gravity) == pytest.approx(1.0)


def test_a_dropped_weight_hangs_from_the_first_tick_to_the_onset():
    world, fault = NotedWorld(), of_lies.WeightDropped(np.random.default_rng(0), JOINTS, ONSET)
    fault.begin(world)
    for tick in range(ONSET, ONSET + 5):
        fault.act(world, CONTROLLER, tick)
    assert world.hung == [0.0, fault.mass_kg, 0.0]
    assert 1.0 <= fault.mass_kg <= 2.0


def test_a_row_that_is_added_later_leaves_the_scenarios_of_the_others(monkeypatch: pytest.MonkeyPatch):
    numbers = [number for number in range(200) if number % LATER_EVERY != LATER_EVERY - 1]
    before = [Scenario.drawn(0, number) for number in numbers]
    assert all(set(scenario.faults) <= set(EARLIER) for scenario in before)
    fewer = dict(list(LATER.items())[:3])
    monkeypatch.setattr("exograv.campaigns.faults.scenario.LATER", fewer)
    monkeypatch.setattr("exograv.campaigns.faults.scenario.FAULTS", {**EARLIER, **fewer})
    assert [Scenario.drawn(0, number) for number in numbers] == before


def test_each_later_row_meets_both_kinds_of_drive():
    drawn = [Scenario.drawn(0, number) for number in range(LATER_EVERY - 1, 900, LATER_EVERY)]
    for name in LATER:
        flown = {scenario.number % 2 for scenario in drawn if scenario.faults[0] == name}
        assert flown == {0, 1}
    assert list(FAULTS) == [*EARLIER, *LATER]
