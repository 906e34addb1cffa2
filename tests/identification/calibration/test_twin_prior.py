"""A machine that is not as drawn is calibrated with its twin as prior; what may have changed since is not trusted."""

from collections.abc import Callable

import numpy as np
import pytest
from tests.identification.conftest import HIDDEN, Exo

from exograv.errors import IdentificationError
from exograv.identification.calibration.empty_machine import Sweeps, calibrate
from exograv.identification.calibration.empty_prior import EmptyLayout, EmptyPrior, data_sheet_prior
from exograv.identification.calibration.twin_prior import AFRESH, twin_prior
from exograv.identification.machine_twin.friction_laws import TWIN_PER_JOINT

SURE = 0.01
"""Standard deviation of the twin's values, over those of the data sheets [-]."""


def of_twin(exo: Exo, links: np.ndarray) -> EmptyPrior:
    """Prior by a twin that is sure of these links (joint, 10) and of the hidden gains."""
    sheets = data_sheet_prior(exo.description, exo.tree, TWIN_PER_JOINT)
    mean = sheets.mean.copy()
    mean[sheets.layout.links] = links.ravel()
    mean[sheets.layout.of("inverse_gain")] = HIDDEN["inverse_gain"]
    return twin_prior(exo.description, exo.tree, sheets.layout, mean, SURE**2 * sheets.covariance)


@pytest.fixture
def heavier(exo: Exo) -> np.ndarray:
    links = exo.tree.phi.copy()
    links[1, :4] += 4.0 * np.array([1.0, 0.0, -0.05, 0.0])
    return links


def test_a_link_heavier_than_drawn_is_calibrated_with_the_twin_and_refused_without(
    exo: Exo, make_sweeps: Callable[..., Sweeps], heavier: np.ndarray
):
    sweeps = make_sweeps(links=heavier.ravel())
    with pytest.raises(IdentificationError, match="differs from the URDF"):
        calibrate(exo.description, exo.tree, sweeps)
    found = calibrate(exo.description, exo.tree, sweeps, of_twin(exo, heavier)).machine
    gain = exo.description.nominal_gain / HIDDEN["inverse_gain"]
    assert (np.abs(found.actuators.gain - gain) < 3.0 * found.actuators.gain_sd).all()
    np.testing.assert_allclose(found.phi[1, 0], heavier[1, 0], rtol=0.05)


def test_a_link_that_lost_a_part_since_the_twin_is_refused(
    exo: Exo, make_sweeps: Callable[..., Sweeps], heavier: np.ndarray
):
    with pytest.raises(IdentificationError, match="The weight of the link"):
        calibrate(exo.description, exo.tree, make_sweeps(), of_twin(exo, heavier))


def test_only_unknowns_that_last_are_taken_from_the_twin(exo: Exo):
    sheets, known = data_sheet_prior(exo.description, exo.tree), of_twin(exo, 1.2 * exo.tree.phi)
    layout: EmptyLayout = known.layout
    assert layout == sheets.layout
    before, after = np.sqrt(np.diag(sheets.covariance)), np.sqrt(np.diag(known.covariance))
    for name in AFRESH:
        np.testing.assert_array_equal(after[layout.of(name)], before[layout.of(name)])
    for name in ("inverse_gain", "coulomb", "viscous", "rotor"):
        assert (after[layout.of(name)] < before[layout.of(name)]).all()
    for block in (layout.of("offset"), layout.tilt, layout.weight):
        assert (after[block] >= before[block]).all()
    np.testing.assert_allclose(known.mean[layout.links], 1.2 * sheets.mean[layout.links])
    assert np.linalg.eigvalsh(known.covariance).min() > 0.0
