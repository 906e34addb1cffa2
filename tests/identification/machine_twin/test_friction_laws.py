"""The simplest law of friction is chosen that held-out motion does not contradict."""

import numpy as np
from tests.identification.conftest import Exo

from exograv.identification.calibration.empty_prior import data_sheet_prior
from exograv.identification.machine_twin.friction_laws import ABSENT, LAWS, TWIN_PER_JOINT, chosen_laws, of_laws

BLOCKS = np.repeat(np.arange(30), 20)


def losses(*better: str) -> dict[str, np.ndarray]:
    """Losses of one joint, lower for these laws."""
    draw = np.random.default_rng(3)
    noise = draw.chisquare(1, (len(BLOCKS), 1))
    return {law: noise + (0.0 if law in better else 0.5) + 0.001 * draw.random((len(BLOCKS), 1)) for law in LAWS}


def test_the_simplest_law_is_chosen_if_all_are_as_good():
    assert chosen_laws(losses(*LAWS), BLOCKS) == ("coulomb-viscous",)


def test_a_law_is_chosen_whose_parameters_the_data_need():
    rich = tuple(law for law in LAWS if law.startswith("stribeck"))
    assert chosen_laws(losses(*rich), BLOCKS) == ("stribeck",)
    assert chosen_laws(losses("stribeck-asymmetric-load-power"), BLOCKS) == ("stribeck-asymmetric-load-power",)


def test_each_joint_has_its_own_law():
    both = {
        law: np.hstack([a, b]) for (law, a), b in zip(losses(*LAWS).items(), losses("stribeck").values(), strict=True)
    }
    assert chosen_laws(both, BLOCKS) == ("coulomb-viscous", "stribeck")


def test_samples_that_do_not_count_are_left_out():
    some = losses("stribeck")
    for loss in some.values():
        loss[::2] = np.nan
    assert chosen_laws(some, BLOCKS) == ("stribeck",)


def test_each_law_has_the_parameters_of_the_simpler_ones_of_its_name():
    for law, names in LAWS.items():
        for other, fewer in LAWS.items():
            if law.startswith(other):
                assert set(fewer) <= set(names)


def test_a_parameter_that_a_law_does_not_have_keeps_its_absent_value(exo: Exo):
    prior = data_sheet_prior(exo.description, exo.tree, TWIN_PER_JOINT)
    fixed = of_laws(prior, ("asymmetric",) * 4)
    sd = np.sqrt(np.diag(fixed.covariance))
    for name, value in ABSENT.items():
        block = prior.layout.of(name)
        if name == "asymmetry":
            np.testing.assert_array_equal(sd[block], np.sqrt(np.diag(prior.covariance))[block])
        else:
            np.testing.assert_array_equal(fixed.mean[block], value)
            assert (sd[block] < 1e-4).all()
