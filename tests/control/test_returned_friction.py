"""The compensation never exceeds friction: not at rest, not in motion, and not over any path back and forth."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv import kernel
from exograv.control.returned_friction import CERTAINTY, SHARE, TRAVEL, WARMED, least_friction, returned_friction
from exograv.dynamics.friction import Friction
from exograv.model.description import load_rig
from exograv.rig.twin import Disturbances, Machine, draw_machine
from exograv.rig.twin.machine.drive import FrictionState, friction_step, sliding_friction

ONE = np.ones(1)
KNOWN = Friction(2.5 * ONE, 1.4 * ONE, 1.3 * ONE, 0.06 * ONE, 0.15 * ONE, 0.05 * ONE, 0.02)
SD = Friction(0.05 * ONE, 0.1 * ONE, 0.05 * ONE, 0.004 * ONE, 0.03 * ONE, 0.01 * ONE, 0.02)
LOAD = 5.0  # N·m
ROUNDING_J = 1e-9
STORED_J = 0.5 * SHARE**2 * (2.5 + 0.15 + 0.06 * LOAD) ** 2 / (2.5 / TRAVEL)
"""Largest energy of the spring: s² / (2 · stiffness) at the torque s where it slips [J]."""

ELBOW = 3
DT = 0.0005
WAYS = st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=60)
"""Travel of a joint between two ticks, in units of `TRAVEL`."""


Law = Callable[..., list[float]]


def compiled(function: ca.Function) -> Law:
    """Return a compiled function of scalars, with scalar results."""
    step = kernel.compile(function).of
    return lambda *values: [value.item() for value in step(*values)]


def law(known: Friction = KNOWN, sd: Friction = SD) -> Law:
    way, v, load, spring = (ca.SX.sym(name) for name in ("way", "v", "load", "spring"))
    symbolic = replace(known, coulomb=ca.SX(ca.DM(known.coulomb)), viscous=ca.SX(ca.DM(known.viscous)))
    now = returned_friction(symbolic, sd, load, way, v, spring)
    return compiled(ca.Function("returned", [way, v, load, spring], [now.tau, now.spring]))


LAW = law()


def least(known: Friction = KNOWN, sd: Friction = SD, load: float = LOAD) -> np.ndarray:
    symbolic = replace(known, coulomb=ca.SX(ca.DM(known.coulomb)))
    return np.array([float(ca.evalf(side)) for side in least_friction(symbolic, sd, ca.SX(load))])


@dataclass
class Slider:
    """Ideal friction: a spring that slips, at another torque in each direction."""

    forward: float
    """Torque at which it slips in forward direction [N·m]."""
    backward: float
    stiffness: float
    """Stiffness of the spring [N·m/rad]."""
    tau: float = 0.0

    def taken(self, way: float) -> float:
        """Energy that friction takes over a travel [J]."""
        before, stretched = self.tau, self.tau + self.stiffness * way
        self.tau = min(max(stretched, -self.backward), self.forward)
        elastic = (self.tau - before) / self.stiffness
        return 0.5 * (before + self.tau) * elastic + self.tau * (way - elastic)


def returned_energy(function: Law, ways: list[float], load: float = LOAD) -> float:
    """Energy from the spring's part [J]; the motor holds its torque during the next travel of the joint."""
    spring, tau, energy = 0.0, 0.0, 0.0
    for way in ways:
        energy += tau * way
        tau, spring = function(way, 0.0, load, spring)
    return energy


def test_nothing_is_returned_before_the_joint_has_moved():
    assert LAW(0.0, 0.0, LOAD, 0.0) == [0.0, 0.0]


@given(ways=WAYS, load=st.floats(-30.0, 30.0))
def test_what_is_returned_stays_within_the_share_of_the_least_friction(ways: list[float], load: float):
    forward, backward = least(load=load)
    spring = 0.0
    for way in ways:
        tau, spring = LAW(way * TRAVEL, 0.0, load, spring)
        assert -SHARE * backward - 1e-12 <= tau <= SHARE * forward + 1e-12
    assert SHARE <= 0.8


def test_after_its_travel_the_share_is_returned_whole_either_way():
    forward, backward = least()
    assert LAW(TRAVEL, 0.0, LOAD, 0.0)[0] == pytest.approx(SHARE * forward)
    assert LAW(-2 * TRAVEL, 0.0, LOAD, SHARE * forward)[0] == pytest.approx(-SHARE * backward)


@given(
    ways=WAYS,
    coulomb=st.floats(-CERTAINTY, CERTAINTY),
    load_share=st.floats(-CERTAINTY, CERTAINTY),
    asymmetry=st.floats(-CERTAINTY, CERTAINTY),
    warmth=st.floats(WARMED, 1.0),
    travel=st.floats(0.05, SHARE * WARMED),
)
def test_over_any_way_less_is_returned_than_any_friction_of_the_interval_takes(
    ways: list[float], coulomb: float, load_share: float, asymmetry: float, warmth: float, travel: float
):
    """The energy stored in the spring is excepted once. `travel`: breakaway travel of true friction, in `TRAVEL`."""
    size = warmth * 2.5 + coulomb * 0.05 + (0.06 + load_share * 0.004) * LOAD
    more = 0.15 + asymmetry * 0.03
    true = Slider(size + more, size - more, (size - more) / (travel * TRAVEL))
    taken = sum(true.taken(way * TRAVEL) for way in ways)
    assert returned_energy(LAW, [way * TRAVEL for way in ways]) <= taken + STORED_J + ROUNDING_J


@given(ways=WAYS, v=st.floats(-3.0, 3.0))
def test_to_and_fro_without_end_gains_nothing(ways: list[float], v: float):
    """A repeated path returns less energy than sliding friction takes on it, so that energy does not accumulate."""
    there_and_back = [way * TRAVEL for way in (*ways, *(-way for way in reversed(ways)))]
    forward, backward = least()
    sliding = min(forward, backward) * np.abs(there_and_back).sum()
    ten_times = returned_energy(LAW, 10 * there_and_back)
    assert ten_times <= 10 * SHARE * max(forward, backward) / min(forward, backward) * sliding + ROUNDING_J


@given(
    speeds=st.lists(st.floats(-3.0, 3.0), min_size=40, max_size=80),
    viscous=st.floats(-CERTAINTY, CERTAINTY),
    late=st.integers(0, 20),
)
def test_the_viscous_part_returns_less_than_viscous_friction_takes_however_late_it_comes(
    speeds: list[float], viscous: float, late: int
):
    true = WARMED * 1.4 + viscous * 0.1
    v = np.concatenate([np.zeros(late), speeds, np.zeros(late)])
    returned = [float(LAW(0.0, speed, LOAD, 0.0)[0]) for speed in v]
    assert np.dot(np.roll(returned, late), v) <= true * np.dot(v, v) + 1e-12


def test_a_poor_calibration_returns_less_and_at_last_nothing():
    poor = [replace(SD, coulomb=sd * ONE) for sd in (0.05, 0.4, 3.0)]
    returned = [float(law(sd=sd)(TRAVEL, 0.0, 0.0, 0.0)[0]) for sd in poor]
    assert returned[0] > returned[1] > returned[2] == 0.0


def test_a_rubbing_that_is_stronger_one_way_is_returned_more_that_way():
    forward, backward = least()
    assert forward - backward == pytest.approx(2 * 0.15)


@pytest.mark.parametrize("which", range(4))
def test_what_is_no_number_is_not_hidden(which: int):
    inputs = [1e-4, 0.3, LOAD, 0.1]
    inputs[which] = np.nan
    assert np.isnan(float(LAW(*inputs)[0])) or which == 2


@pytest.mark.parametrize("field", ["coulomb", "viscous"])
def test_a_parameter_that_is_no_number_is_not_hidden(field: str):
    broken = law(replace(KNOWN, **{field: np.nan * ONE}))
    assert np.isnan(broken(1e-4, 0.3, LOAD, 0.1)[0])


def friction_of(machine: Machine) -> Law:
    """Friction of the twin when warm: torque and next state of the bristle."""
    bristle, theta, omega, load = (ca.SX.sym(name) for name in ("bristle", "theta", "omega", "load"))
    now = FrictionState(theta, omega, load, ca.SX(1.0))
    step = list(friction_step(machine, ELBOW, bristle, now, DT))
    return compiled(ca.Function("friction", [bristle, theta, omega, load], step))


def as_calibrated(machine: Machine) -> Friction:
    """Friction of the cold machine's elbow, as from a calibration without errors."""
    true, only = machine.friction, slice(ELBOW, ELBOW + 1)
    coulomb = true.coulomb[only]
    asymmetry = true.asymmetry[only] * coulomb
    return Friction(
        coulomb, true.viscous[only], ONE, true.load_share[only], asymmetry, true.stribeck_velocity[only], 0.02
    )


@pytest.mark.parametrize("seed", [1000, 1001])
@pytest.mark.parametrize("level", [1, 2])
@pytest.mark.parametrize(
    ("amplitude", "rate"), [(1e-4, 60.0), (4e-4, 30.0), (8e-4, 20.0), (2e-3, 10.0), (0.02, 5.0), (0.3, 3.0)]
)
def test_of_every_swing_the_twins_warm_friction_takes_more_than_is_returned(
    level: int, amplitude: float, rate: float, seed: int
):
    machine = draw_machine(load_rig("recupera_like"), Disturbances.at_level(level), seed)
    friction, returned = friction_of(machine), law(as_calibrated(machine), replace(SD, coulomb=0 * ONE))
    period = round(2 * np.pi / rate / DT)
    theta = amplitude * np.sin(2 * np.pi * np.arange(2 * period + 1) / period)
    bristle, spring, tau, energy = 0.0, 0.0, 0.0, 0.0
    for k, way in enumerate(np.diff(theta)):
        rubbed, bristle = friction(bristle, theta[k], way / DT, LOAD)
        if k >= period:  # only the second swing, when both have settled
            energy += (tau - rubbed) * way
        tau, spring = returned(way, way / DT, LOAD, spring)
    assert energy < 0.0


@pytest.mark.parametrize("level", [1, 2, 3])
def test_the_twins_warm_friction_is_never_less_than_what_is_returned_of_the_cold_ones(level: int):
    rig = load_rig("recupera_like")
    for seed in range(1000, 1010):
        machine = draw_machine(rig, Disturbances.at_level(level), seed)
        known = as_calibrated(machine)
        forward, backward = least(known, replace(SD, coulomb=0 * ONE), LOAD)
        for theta in np.linspace(0.0, 2 * np.pi / machine.drives.gear_ratio[ELBOW], 12):
            for omega, returned in ((0.5, SHARE * forward), (-0.5, SHARE * backward)):
                now = FrictionState(*(ca.SX(value) for value in (theta, omega, LOAD, 1.0)))
                assert returned < float(ca.evalf(sliding_friction(machine, ELBOW, now)))
