"""Cuffs of the unseen world are preloaded contacts with lagging flesh, and their slip is a flow that takes energy."""

import itertools
from collections.abc import Callable

import casadi as ca
import mujoco
import numpy as np
import pytest

from exograv import kernel
from exograv.rig.twin import Disturbances, draw_wearer
from exograv.rig.twin.machine.machine_bodies import TIMESTEP
from exograv.rig.twin.wearer.contact_cuffs import SAME, SLIP_SPEED, Contact, ContactCuffs, draw_contact_cuffs
from exograv.rig.twin.wearer.strained_cuffs import SLIP_MAX, STRAIN_MAX
from exograv.rig.twin.world.cuffs import CuffStates, Kinematics, cuff_wrenches, lag

LEVEL = Disturbances.at_level(2, "unseen")
STIFFNESS = 3000.0  # N/m
CONTACTS = [Contact(1.5, 0.004), Contact(2.0, 0.002), Contact(1.2, 0.01), Contact(1.1, 0.005)]
LAW = ContactCuffs(CONTACTS[0], CONTACTS[2], np.ones(6), 0.4, 0.5, 30.0, 5.0)
WAY, ALONG = ca.SX.sym("way"), ca.SX.sym("along")
DIFFERENCE = 1e-7  # m


def stretched(contact: Contact, strain: float) -> float:
    return float(ca.evalf(contact.stretched(ca.SX(strain))))


def slip_of(law: ContactCuffs, stiffness: float) -> Callable[[float, float], float]:
    slipped = kernel.compile(ca.Function("slipped", [WAY, ALONG], [law.slipped(WAY, ALONG, stiffness)])).of
    return lambda way, along: slipped(way, along)[0].item()


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("strain", [-0.02, -0.003, 0.001, 0.006, 0.025])
def test_the_force_is_that_of_two_sides_that_press_by_a_power_of_their_depth(contact: Contact, strain: float):
    def force(x: float) -> float:
        d, n = contact.preload, contact.exponent
        return max(d + x, 0.0) ** n - max(d - x, 0.0) ** n

    assert stretched(contact, strain) == pytest.approx(SAME * force(strain) / force(SAME))


@pytest.mark.parametrize("contact", CONTACTS)
def test_the_force_at_ten_millimetres_is_that_of_the_level(contact: Contact):
    assert stretched(contact, SAME) == pytest.approx(SAME)
    assert stretched(contact, -SAME) == pytest.approx(-SAME)
    assert stretched(contact, 0.0) == 0.0


def test_hertz_s_exponent_without_preload_is_hertz_s_contact():
    light = Contact(1.5, 1e-9)
    assert stretched(light, 0.004) / stretched(light, 0.001) == pytest.approx(4.0**1.5, rel=1e-4)


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("strain", [0.0011, 0.013, 0.029, 0.04, -0.013])
def test_the_tangent_is_the_slope_of_the_force(contact: Contact, strain: float):
    slope = (stretched(contact, strain + DIFFERENCE) - stretched(contact, strain - DIFFERENCE)) / (2.0 * DIFFERENCE)
    assert float(ca.evalf(contact.tangent(ca.SX(strain)))) == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("contact", CONTACTS)
def test_the_force_always_grows_and_is_linear_beyond_the_largest_strain(contact: Contact):
    at = np.array([stretched(contact, x) for x in np.linspace(-0.05, 0.05, 401)])
    assert np.diff(at).min() > 0.0
    first, second, third = (stretched(contact, STRAIN_MAX + x) for x in (0.0, 0.01, 0.02))
    assert third - second == pytest.approx(second - first)


@pytest.mark.parametrize("load", [10.0, 30.0, 50.0])
def test_the_slip_flows_with_the_power_of_the_force(load: float):
    strains = np.linspace(0.0, 0.03, 2001)
    strain = np.interp(load, [STIFFNESS * stretched(LAW.along, x) for x in strains], strains)
    speed = slip_of(LAW, STIFFNESS)(0.0, strain) / TIMESTEP
    # The implicit step is slower by the relief within one step.
    assert speed == pytest.approx(SLIP_SPEED * (load / 30.0) ** 5.0, rel=0.02)


@pytest.mark.parametrize("stiffness", [800.0, 3000.0, 1e5])
@pytest.mark.parametrize("along", [-0.04, 0.002, 0.03, 0.2])
def test_the_slip_stays_behind_the_limb_and_within_its_end(stiffness: float, along: float):
    slip, way = slip_of(LAW, stiffness), 0.0
    for _ in range(2000):
        after = slip(way, along)
        assert abs(way) <= abs(after) <= SLIP_MAX
        assert abs(after) <= abs(along)
        way = after


def test_a_direction_that_is_free_does_not_slip():
    assert slip_of(LAW, 0.0)(0.001, 0.03) == 0.001


def test_a_slipping_cuff_only_takes_energy_from_a_cycle():
    after = LAW.slipped(WAY, ALONG, STIFFNESS)
    force = STIFFNESS * LAW.along.stretched(ALONG - after)
    step = kernel.compile(ca.Function("step", [WAY, ALONG], [after, force])).of
    t = np.linspace(0.0, 6.0 * np.pi, 30001)
    path, way, work = 0.02 * np.sin(t), 0.0, 0.0
    for before, now in itertools.pairwise(path):
        way, force = step(way, 0.5 * (before + now))
        work -= force.item() * (now - before)
    assert work < -0.1  # J, in three cycles


def test_the_flesh_relaxes_as_a_maxwell_element():
    strain, speed = ca.SX.sym("strain", 3), ca.SX.sym("speed", 3)
    step = kernel.compile(ca.Function("step", [strain, speed], [LAW.lagged(strain, speed)])).of
    state = np.array([0.01, 0.0, -0.004])
    for _ in range(round(LAW.lag / TIMESTEP)):
        (state,) = step(state, np.zeros(3))
    np.testing.assert_allclose(state, np.exp(-1.0) * np.array([0.01, 0.0, -0.004]))
    for _ in range(round(20.0 * LAW.lag / TIMESTEP)):
        (state,) = step(state, np.full(3, 0.02))
    np.testing.assert_allclose(state, 0.02 * LAW.lag)


def test_the_lagging_flesh_only_takes_energy_from_a_cycle():
    t = np.arange(0.0, 6.0, TIMESTEP)
    speeds = 0.01 * np.pi * np.cos(np.pi * t)
    step = kernel.compile(ca.Function("step", [WAY, ALONG], [LAW.lagged(WAY, ALONG)])).of
    strain, work = 0.0, 0.0
    for speed in speeds:
        strain = step(strain, speed)[0].item()
        work -= LAW.lag_share * STIFFNESS * strain * speed * TIMESTEP
    # Maxwell element under a sine of amplitude x: π k x² ω τ / (1 + ω² τ²) in each cycle, here three of them.
    turn = np.pi * LAW.lag
    lost = 3.0 * np.pi * LAW.lag_share * STIFFNESS * 0.01**2 * turn / (1.0 + turn**2)
    assert work == pytest.approx(-lost, rel=0.1)  # the first cycle is not yet a steady one


def test_the_lagging_flesh_follows_the_offset_of_the_cuff_in_a_moving_machine(make_scene):
    scene, law = make_scene(LEVEL), ContactCuffs(CONTACTS[0], CONTACTS[2], np.ones(6), 1.0, 1e6, 30.0, 5.0)
    kinematics = Kinematics.of(scene.model.nbody)
    lagged = ca.SX.sym("lagged", 3, len(scene.cuffs))
    step = ca.Function("lag", [*vars(kinematics).values(), lagged], [lag(scene, law, kinematics, lagged)])
    generator = np.random.default_rng(0)
    scene.data.qpos[:] = generator.uniform(-0.2, 0.8, scene.model.nq)
    scene.data.qvel[:] = generator.uniform(-1.0, 1.0, scene.model.nv)
    mujoco.mj_forward(scene.model, scene.data)
    arrays = [np.asarray(getattr(scene.data, name)).T for name in vars(kinematics)]
    moved = np.asarray(step(*arrays, np.zeros((3, len(scene.cuffs)))))

    def offsets() -> np.ndarray:
        mujoco.mj_kinematics(scene.model, scene.data)
        columns = []
        for place in scene.cuffs:
            R_exo, R_arm = (scene.data.xmat[body].reshape(3, 3) for body in (place.exo_body, place.arm_body))
            point = scene.data.xpos[place.arm_body] + R_arm @ place.p_arm
            columns.append(R_exo.T @ (point - scene.data.xpos[place.exo_body]))
        return np.array(columns).T

    before = offsets()
    scene.data.qpos[:] += 1e-6 * scene.data.qvel
    np.testing.assert_allclose(moved / TIMESTEP, (offsets() - before) / 1e-6, atol=1e-4)


def test_the_wrenches_with_states_act_equally_on_both_sides(make_scene):
    scene, wearer = make_scene(LEVEL), draw_wearer(LEVEL, 0)
    kinematics, count = Kinematics.of(scene.model.nbody), len(scene.cuffs)
    states = CuffStates(ca.SX(np.full(count, 0.003)), ca.SX(np.full((3, count), 0.002)))
    wrenches = ca.Function(
        "wrenches", list(vars(kinematics).values()), [cuff_wrenches(scene, wearer.cuffs, kinematics, states)]
    )
    scene.data.qpos[:] = np.random.default_rng(1).uniform(-0.2, 0.8, scene.model.nq)
    mujoco.mj_forward(scene.model, scene.data)
    found = np.asarray(wrenches(*(np.asarray(getattr(scene.data, name)).T for name in vars(kinematics))))
    np.testing.assert_allclose(found[:3].sum(axis=1), 0.0, atol=1e-9 * np.abs(found).max())


def test_the_draws_fill_their_ranges_and_differ_along_and_across():
    drawn = [draw_contact_cuffs(seed) for seed in range(300)]
    for values, (low, high) in (
        ([one.across.exponent for one in drawn], (1.2, 2.0)),
        ([one.along.exponent for one in drawn], (1.1, 1.7)),
        ([one.slip_force for one in drawn], (20.0, 60.0)),
        ([one.slip_exponent for one in drawn], (3.0, 8.0)),
        ([one.lag_share for one in drawn], (0.1, 0.6)),
    ):
        assert low <= min(values) < low + 0.02 * (high - low)
        assert high - 0.02 * (high - low) < max(values) <= high
    ratios = [one.stiffness_factor[2] / one.stiffness_factor[0] for one in drawn]
    assert np.std(np.log(ratios)) == pytest.approx(0.25 * np.sqrt(2.0), rel=0.1)
