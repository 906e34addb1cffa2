"""The machine of a fitted twin has the values of its posterior, in the simulation too."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.made_twin import CUFFS, WARM_GAIN, made_twin, with_twin_in

from exograv.laboratory.fitted_machine import fitted_cuffs, fitted_machine
from exograv.laboratory.virtual_laboratory import draw_laboratory, machine_of, with_twin
from exograv.model.description import load_rig
from exograv.model.tree import is_physical
from exograv.rig.twin import Disturbances, Machine, Twin
from exograv.rig.twin.world.link_truth import link_truth
from exograv.signals import Command
from exograv.storage.twin_file import StoredTwin

RIG, GOOD = load_rig("recupera_like"), Disturbances.at_level(2)


@pytest.fixture(scope="module")
def whole() -> StoredTwin:
    return made_twin(RIG)


@pytest.fixture(scope="module")
def mean(whole: StoredTwin) -> Machine:
    return fitted_machine(RIG, whole, GOOD, 0, is_mean=True)


def test_the_simulated_links_are_those_of_the_posterior(whole: StoredTwin, mean: Machine):
    simulated = link_truth(RIG, mean, whole.provenance.lengths_m)
    expected = np.array(whole.posterior.mean)[whole.layout().links].reshape(-1, 10)
    np.testing.assert_allclose(simulated, expected, atol=1e-9)


def test_the_mean_has_the_values_of_the_file(whole: StoredTwin, mean: Machine):
    theta, layout = np.array(whole.posterior.mean), whole.layout()
    np.testing.assert_allclose(mean.drives.gain, RIG.nominal_gain / theta[layout.of("inverse_gain")])
    np.testing.assert_allclose(mean.friction.viscous, theta[layout.of("viscous")])
    np.testing.assert_allclose(mean.drives.bandwidth[1:], 25.0)
    assert mean.sensors.delay == pytest.approx(1.5e-3)
    assert mean.drives.gear_stiffness[0] == pytest.approx(1e4)


def test_two_seeds_draw_two_possible_machines_around_the_mean(whole: StoredTwin, mean: Machine):
    one, other = (fitted_machine(RIG, whole, GOOD, seed) for seed in (1, 2))
    assert (one.friction.coulomb != other.friction.coulomb).all()
    assert one.sensors.delay != other.sensors.delay
    for machine in (one, other):
        assert machine.links is not None
        assert all(is_physical(phi) for phi in machine.links.values())
        assert (np.abs(machine.drives.gain / mean.drives.gain - 1.0) < 0.1).all()


def test_a_drive_whose_response_is_not_known_has_a_usual_one(whole: StoredTwin):
    drawn = fitted_machine(RIG, whole, GOOD, 1)
    assert drawn.drives.bandwidth[0] == machine_of(RIG, GOOD, 1, "drawn").drives.bandwidth[0]


@pytest.mark.parametrize("has_motor_encoders", [True, False])
def test_a_twin_has_encoders_on_its_motors_only_if_its_recordings_have_them(has_motor_encoders: bool):
    machine = fitted_machine(RIG, made_twin(RIG, has_motor_encoders=has_motor_encoders), GOOD, 1)
    with Twin(RIG, machine, None, 0) as twin:
        assert (twin.read().q_motor is not None) == has_motor_encoders


def test_a_gain_by_temperature_changes_the_drawn_motor_away_from_the_temperature_of_the_fit():
    whole = made_twin(RIG, gain_by_temperature=[WARM_GAIN])
    assert Twin(RIG, fitted_machine(RIG, made_twin(RIG), GOOD, 1), None, 0).warm_gain([60.0] * 4) is None
    warm = Twin(RIG, fitted_machine(RIG, whole, GOOD, 1, is_mean=True), None, 0)
    for warmer, factors in ((0.0, [1.0, 1.0, 1.0, 1.0]), (20.0, [1.0, 1.0, 1.0, 0.94])):
        found = warm.warm_gain([WARM_GAIN.at_C + warmer] * 4)
        assert found is not None
        np.testing.assert_allclose(found, factors)
    slopes = []
    for seed in (1, 2):
        drawn = fitted_machine(RIG, whole, GOOD, seed).drives.gain_slope
        assert drawn is not None
        slopes.append(float(drawn[3]))
    assert slopes[0] != slopes[1]
    # Six standard deviations.
    assert all(abs(slope - WARM_GAIN.slope_per_C) < 6.0 * WARM_GAIN.slope_sd_per_C for slope in slopes)


def test_friction_that_is_switched_off_is_absent(whole: StoredTwin):
    smooth = fitted_machine(RIG, whole, GOOD.without("coulomb", "viscous", "load_friction", "friction_ripple"), 1)
    for values in (
        smooth.friction.coulomb,
        smooth.friction.viscous,
        smooth.friction.load_share,
        smooth.friction.ripple,
    ):
        assert not values.any()


def test_the_wearer_stays_and_the_machine_is_named_after_its_twin(tmp_path: Path, whole: StoredTwin):
    folder = with_twin_in(tmp_path / "mine", RIG, whole)
    drawn = draw_laboratory(str(folder), None, 2, 5)
    fitted = with_twin(drawn, "fitted", GOOD, 5)
    assert fitted.wearer is drawn.wearer
    assert fitted.serial == f"fitted twin {whole.content_sha256[:12]}, seed 5"
    assert with_twin(drawn, "drawn", GOOD, 5) is drawn


def test_viscous_friction_follows_the_power_of_the_speed(mean: Machine):
    """A joint that a constant torque turns has the larger final speed, the smaller the power of a speed below one."""
    free = replace(
        mean,
        friction=replace(
            mean.friction, coulomb=np.zeros(4), load_share=np.zeros(4), ripple=np.zeros(4), viscous=np.full(4, 20.0)
        ),
        gravity=np.zeros(3),
    )
    speeds = {}
    for power in (0.8, 1.0, 1.2):
        machine = replace(free, friction=replace(free.friction, viscous_power=np.full(4, power)))
        twin = Twin(RIG, machine, None, 0, np.deg2rad([0.0, 0.0, 0.0, 60.0]))
        current = np.array([0.0, 0.0, 0.0, 4.0]) / machine.drives.gain
        for k in range(400):
            twin.read()
            twin.write(Command(twin.t, k, twin.t + 0.005, 4.0 * current, current))
        speeds[power] = twin.truth.v[3]
    for power, speed in speeds.items():
        assert speed == pytest.approx(0.2 ** (1.0 / power), rel=0.1)


def test_the_cuffs_of_the_simulated_wearer_are_those_of_rig_toml_times_the_drawn_factors(tmp_path: Path):
    folder = str(with_twin_in(tmp_path / "mine", RIG, made_twin(RIG, cuffs=[CUFFS])))
    usual = draw_laboratory(folder, None, 2, 5)
    drawn = with_twin(usual, "fitted", GOOD, 5).wearer.cuffs
    pull, twist = CUFFS.draw(5)
    rows = [(1e3 * one.across_N_per_mm, 1e3 * one.along_N_per_mm) for one in RIG.settings.cuffs]
    across, along = np.exp(np.log(rows).mean(axis=0))
    np.testing.assert_allclose(drawn.stiffness[:3], np.array([across, across, along]) * pull)
    turned = np.rad2deg([(one.about_others_Nm_per_deg, one.about_limb_Nm_per_deg) for one in RIG.settings.cuffs])
    others, limb = np.exp(np.log(turned).mean(axis=0))
    np.testing.assert_allclose(drawn.stiffness[3:], np.array([others, others, limb]) * twist)
    assert drawn.damping == usual.wearer.cuffs.damping


def test_softer_cuffs_of_a_day_stay_softer_and_a_twin_without_cuffs_changes_none():
    usual = draw_laboratory("recupera_like", None, 2, 5).wearer.cuffs
    softer = replace(usual, stiffness=0.8 * usual.stiffness)
    whole = made_twin(RIG, cuffs=[CUFFS])
    found = fitted_cuffs(RIG, whole, GOOD, softer, 5).stiffness
    np.testing.assert_allclose(found, 0.8 * fitted_cuffs(RIG, whole, GOOD, usual, 5).stiffness)
    assert fitted_cuffs(RIG, made_twin(RIG), GOOD, softer, 5) is softer
