"""Figures of a calibration: true values stand beside the estimates on the twin, and are absent on hardware."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.calibration.empty_prior import data_sheet_prior
from exograv.laboratory.calibration_command import calibration_truth
from exograv.laboratory.result_rows import still_to_rub
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.procedures.calibration.figures import calibration_figures, twin_warnings, warnings
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.results import json_value
from exograv.rig.twin import Disturbances, Machine, draw_machine

HALF_AN_HOUR_S = 1800.0


@pytest.fixture(scope="module")
def rig() -> RigDescription:
    return load_rig("recupera_like")


@pytest.fixture(scope="module")
def truth(rig: RigDescription) -> Machine:
    return draw_machine(rig, Disturbances.at_level(2), 1012)


@pytest.fixture(scope="module")
def perfect(rig: RigDescription, truth: Machine) -> Calibration:
    """Return a calibration that knows gain and friction of the warm machine."""
    machine = nominal_machine(rig, read_exoskeleton(rig).phi)
    still = still_to_rub(truth, HALF_AN_HOUR_S)
    friction = replace(
        machine.friction,
        coulomb=still * truth.friction.coulomb,
        viscous=still * truth.friction.viscous,
        asymmetry=still * truth.friction.coulomb * truth.friction.asymmetry,
    )
    gains = replace(machine.actuators, gain=truth.drives.gain)
    machine = replace(machine, actuators=gains, friction=friction)
    two, four = np.zeros(2), np.zeros(4)
    return Calibration(machine, two, two + 0.01, four, four + 0.01, np.zeros((4, 10)))


def test_a_perfect_calibration_is_its_truth(rig: RigDescription, truth: Machine, perfect: Calibration):
    found = calibration_figures(perfect, rig.joints, calibration_truth(truth, HALF_AN_HOUR_S))
    assert [row.estimate for row in found.gain] == [row.true for row in found.gain]
    for name in ("coulomb_Nm", "viscous", "asymmetry_Nm"):
        assert [getattr(row, name) for row in found.friction] == [
            getattr(row, f"{name}_true") for row in found.friction
        ]


def test_after_half_an_hour_a_tenth_of_the_friction_is_gone_at_level_2(truth: Machine):
    np.testing.assert_allclose(still_to_rub(truth, HALF_AN_HOUR_S), 0.905, atol=0.001)
    np.testing.assert_array_equal(still_to_rub(truth, 0.0), 1.0)


def test_without_a_truth_none_is_written(rig: RigDescription, perfect: Calibration):
    found = json_value(calibration_figures(perfect, rig.joints))
    assert set(found["gain"][0]) == {"joint", "estimate", "ci95"}
    assert not [key for key in found["friction"][0] if key.endswith("_true")]


def test_intervals_are_two_sided_and_about_the_estimate(rig: RigDescription, perfect: Calibration):
    for row in calibration_figures(perfect, rig.joints).encoder_offset_deg:
        low, high = row.ci95
        assert low == pytest.approx(-high)
        assert high == pytest.approx(np.rad2deg(1.96 * 0.01), rel=1e-3)


def test_a_perfect_calibration_needs_no_warning(rig: RigDescription, perfect: Calibration):
    assert warnings(perfect, rig) == []


def test_what_an_operator_should_look_at_is_named(rig: RigDescription, perfect: Calibration):
    gains, nominal = perfect.machine.actuators, rig.nominal_gain
    unsure = replace(gains, gain=nominal * [1.0, 1.2, 1.0, 1.0], gain_sd=nominal * [0.06, 0.001, 0.001, 0.001])
    offset = np.deg2rad([0.0, 0.0, 0.0, 1.5])
    found = warnings(replace(perfect, machine=replace(perfect.machine, actuators=unsure), offset=offset), rig)
    assert [text.split("'")[1] for text in found] == ["shoulder_flexion", "shoulder_abduction", "elbow_flexion"]
    assert "only known to ±12%: no weight loads this joint" in found[0]
    assert "by +20%" in found[1]
    assert "+1.5°" in found[2]


@pytest.mark.parametrize(("share", "is_in_doubt"), [(1.02, False), (1.08, True)])
def test_a_gain_far_from_that_of_the_twin_puts_the_twin_in_doubt(
    rig: RigDescription, perfect: Calibration, share: float, is_in_doubt: bool
):
    known = data_sheet_prior(rig, read_exoskeleton(rig))
    place = known.layout.of("inverse_gain")
    known.mean[place] = rig.nominal_gain / perfect.machine.actuators.gain * [1.0, share, 1.0, 1.0]
    known.covariance[place, place] = np.diag((0.01 * known.mean[place]) ** 2)
    found = twin_warnings(perfect, rig, known)
    assert len(found) == is_in_doubt
    assert all(f"The gain of {rig.joints[1]} contradicts the twin" in text for text in found)
