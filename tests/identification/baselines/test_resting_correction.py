"""The methods of Just et al. are exact if their assumptions hold: aligned, relaxed, with perfect sensors."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import ConfigError
from exograv.identification.baselines.average import average
from exograv.identification.baselines.equilibrium import equilibrium
from exograv.identification.baselines.full import full
from exograv.identification.baselines.rest_statics import RestStatics
from exograv.identification.baselines.resting_correction import MASS_MIN, RestingCorrection, table_arm
from exograv.identification.core.interface import Method, Rest, RestingMethod, Sample
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.model.tree import is_physical
from exograv.procedures.calibration.nominal_machine import nominal_machine

Worn = tuple[Assembly, CalibratedMachine]

EXACT_NM = 1e-6  # of torques of 10 N·m: least squares of 14 equations in double precision
RIGS = ("recupera_like", "agree_like", "recupera_like_7", "recupera_like_dual")


@pytest.fixture(scope="module")
def make_arm() -> Callable[..., Worn]:
    known: dict[str, Worn] = {}

    def make(rig: str = "recupera_like") -> Worn:
        if rig not in known:
            assembly = assemble(load_rig(rig), Body(1.75, 75.0, "male"))
            known[rig] = assembly, nominal_machine(assembly.description, assembly.exo.phi)
        return known[rig]

    return make


def hidden_arm(worn: Worn, seed: int = 0) -> np.ndarray:
    """Inertial parameters of a person two standard deviations from the table in a random direction."""
    arm = worn[0].arm
    direction = np.random.default_rng(seed).standard_normal(len(arm.phi))
    root = np.linalg.cholesky(arm.phi_covariance + 1e-15 * np.eye(len(arm.phi)))
    return arm.phi + 2.0 * root @ direction / np.linalg.norm(direction)


def perfect_rest(statics: RestStatics, q: np.ndarray, phi: np.ndarray, pull: np.ndarray | float = 0.0) -> Rest:
    """Rest with the smallest wrenches that carry an arm in aligned cuffs, with torque `pull` of its own joints."""
    cuffs, n = len(statics.assembly.cuffs), len(q)
    units = np.eye(6 * cuffs).reshape(-1, cuffs, 6)
    by_wrench = np.column_stack([statics.balance(Rest(q, np.zeros(n), unit, 0.0)).tau for unit in units])
    asked = statics.weight_at(q).Y @ phi + pull
    wrenches = np.linalg.lstsq(by_wrench, asked, rcond=None)[0]
    return Rest(q, np.zeros(n), wrenches.reshape(cuffs, 6), 10.0)


def learned(method: RestingCorrection, worn: Worn, phi: np.ndarray, pull: np.ndarray | float = 0.0) -> np.ndarray:
    """Inertial parameters after perfect rests."""
    statics = RestStatics(*worn)
    method.take_rests([perfect_rest(statics, q, phi, pull) for q in method.postures])
    return method.estimate().x[: len(phi)]


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("seed", range(2))
def test_two_perfect_rests_tell_the_weight_of_any_relaxed_arm_everywhere(make_arm, rig: str, seed: int):
    worn = make_arm(rig)
    phi, statics = hidden_arm(worn, seed), RestStatics(*worn)
    found = learned(full(*worn), worn, phi)
    for q in statics.candidates()[::8]:
        Y = statics.weight_at(q).Y
        np.testing.assert_allclose(Y @ found, Y @ phi, atol=EXACT_NM)


@pytest.mark.parametrize("rig", RIGS)
def test_one_perfect_rest_tells_the_masses_of_an_arm_shaped_like_the_tables(make_arm, rig: str):
    worn = make_arm(rig)
    factors = np.linspace(0.8, 1.3, len(worn[0].arm.segments))
    phi = worn[0].arm.phi * np.repeat(factors, 10)
    np.testing.assert_allclose(learned(equilibrium(*worn), worn, phi), phi, rtol=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_equilibrium_errs_less_than_the_table_in_its_own_posture_elasticity_included(make_arm, seed: int):
    worn = make_arm()
    phi, pull = hidden_arm(worn, seed), np.random.default_rng(seed).normal(0.0, 1.0, 4)
    method = equilibrium(*worn)
    found = learned(method, worn, phi, pull)
    Y = RestStatics(*worn).weight_at(method.postures[0]).Y
    left, by_table = (Y @ arm - (Y @ phi + pull) for arm in (found, worn[0].arm.phi))
    assert np.linalg.norm(left) <= np.linalg.norm(by_table)


def test_full_takes_elastic_torque_for_weight(make_arm):
    worn = make_arm()
    phi, pull = worn[0].arm.phi, np.array([0.5, 0.0, 0.0, 0.3])
    found, statics = learned(full(*worn), worn, phi, pull), RestStatics(*worn)
    errors = [np.abs(statics.weight_at(q).Y @ (found - phi)).max() for q in statics.candidates()[::8]]
    assert max(errors) > 0.3


def test_average_is_the_table(make_arm):
    worn = make_arm()
    method = average(*worn)
    assert isinstance(method, Method)
    assert not isinstance(method, RestingMethod)
    method.update(Sample(3.0, np.ones(4), np.ones(4), np.ones(4), np.ones(4)))
    np.testing.assert_array_equal(method.estimate().x, table_arm(*worn))
    assert method.estimate().covariance is None
    assert method.estimate().t == 3.0


@pytest.mark.parametrize("build", [full, equilibrium])
def test_motion_only_moves_the_clock_and_the_time_of_rests_is_told(make_arm, build):
    worn = make_arm()
    method = build(*worn)
    assert isinstance(method, RestingMethod)
    method = build(*worn)
    np.testing.assert_array_equal(method.estimate().x, table_arm(*worn))
    found = learned(method, worn, hidden_arm(worn)).copy()
    method.update(Sample(7.0, np.ones(4), np.ones(4), np.ones(4), np.ones(4)))
    np.testing.assert_array_equal(method.estimate().x[: len(found)], found)
    assert (method.estimate().t, method.rest_s) == (7.0, 10.0 * method.rests_needed)


@pytest.mark.parametrize("build", [full, equilibrium])
def test_rests_lie_in_the_task_workspace_and_are_the_same_for_the_same_measures(make_arm, build):
    worn = make_arm()
    lower, upper = worn[0].description.workspace
    postures = build(*worn).postures
    assert len(postures) == build(*worn).rests_needed
    assert ((postures >= lower) & (postures <= upper)).all()
    np.testing.assert_array_equal(postures, build(*worn).postures)


@pytest.mark.parametrize("build", [full, equilibrium])
@pytest.mark.parametrize("pull", [-100.0, 100.0])
def test_whatever_the_sensors_say_the_arm_is_possible(make_arm, build, pull: float):
    worn = make_arm()
    found = learned(build(*worn), worn, worn[0].arm.phi, pull)
    for body, table in zip(found.reshape(-1, 10), worn[0].arm.phi.reshape(-1, 10), strict=True):
        assert is_physical(body)
        assert body[0] >= MASS_MIN * table[0] * (1.0 - 1e-12)


def test_too_few_rests_are_refused(make_arm):
    with pytest.raises(ConfigError, match="needs 2"):
        full(*make_arm()).take_rests([])
