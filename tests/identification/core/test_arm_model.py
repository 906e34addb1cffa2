"""The model follows a motion, and marks samples whose loops it cannot close."""

from unittest.mock import Mock

import casadi as ca
import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import SINGULAR_SD, ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.loops import PATH_ENTRIES, scaled_stiffness
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine

Q = np.array([0.8, 0.3, -0.2, 1.3])
STILL = np.zeros(4)
SAMPLE = Sample(0.0, Q, STILL, STILL, STILL)


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))


@pytest.fixture(scope="module")
def model(assembly) -> ArmModel:
    return ArmModel(assembly, nominal_machine(assembly.description, assembly.exo.phi))


@pytest.fixture(scope="module")
def expected(model) -> np.ndarray:
    """Parameters before any motion."""
    return prior(model.assembly, model.machine)[0]


@pytest.fixture(scope="module")
def of_lead(assembly, expected) -> np.ndarray:
    """Parameters of an arm of half a tonne."""
    x = expected.copy()
    x[ParameterLayout.of(assembly).phi] *= 150.0
    return x


def test_an_arm_that_would_fall_out_of_its_cuffs_tells_nothing(model, of_lead):
    tau, derivative = model.linearise(SAMPLE, of_lead)
    assert not tau.any()
    assert not derivative.any()
    assert (model.direction_uncertainty(STILL) >= SINGULAR_SD).all()


@pytest.mark.parametrize("moved_m", [-0.01, 0.01])
def test_a_new_estimate_of_the_cuffs_needs_no_cold_start(model, assembly, expected, moved_m: float, monkeypatch):
    """A cold start takes longer than control has left in a tick. The other model starts cold."""
    x = expected.copy()
    x[ParameterLayout.of(assembly).fit][: PATH_ENTRIES.start] += moved_m
    x[ParameterLayout.of(assembly).fit][PATH_ENTRIES] += 0.2 * moved_m
    follower = model.again()
    follower.linearise(SAMPLE, expected)
    closed = Mock(spec=follower._close)
    monkeypatch.setattr(follower, "_close", closed)
    tau, derivative = follower.linearise(SAMPLE, x)
    closed.assert_not_called()
    cold = model.again().linearise(SAMPLE, x)
    np.testing.assert_allclose(tau, cold[0], atol=1e-3)
    np.testing.assert_allclose(derivative, cold[1], atol=1e-2, rtol=1e-3)


def test_after_such_an_arm_the_next_one_is_seen_as_by_a_fresh_model(model, expected, of_lead):
    fresh = model.again().linearise(SAMPLE, expected)
    model.linearise(SAMPLE, of_lead)
    again = model.linearise(SAMPLE, expected)
    np.testing.assert_allclose(again[0], fresh[0], atol=1e-9)
    np.testing.assert_allclose(again[1], fresh[1], atol=1e-9)
    assert (model.direction_uncertainty(STILL) < SINGULAR_SD).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_displaced_cuff_adds_as_much_torque_as_the_motion_changes_its_force(model, expected, seed: int):
    """Reciprocity of an elastic system: ∂τ_j/∂d = ∂²Π/∂q_j∂d = −k ∂e/∂q_j at rest."""
    assembly, layout = model.assembly, ParameterLayout.of(model.assembly)
    q = Q + 0.2 * np.random.default_rng(seed).standard_normal(4)
    fit = ca.SX.sym("fit", layout.fit.stop - layout.fit.start)
    every = ca.Function("stiffness", [fit], [scaled_stiffness(assembly, fit)])(expected[layout.fit])
    stiffness = np.array(every).reshape(-1, 6)[:, :3]
    model.at_rest(q, expected)
    by_displacement = model.cuff_loads().by_displacement
    step, by_motion = 1e-4, np.zeros_like(by_displacement)
    for j in range(4):
        strains = []
        for sign in (1.0, -1.0):
            model.at_rest(q + sign * step * np.eye(4)[j], expected)
            strains.append(model.cuff_loads().strain)
        by_motion[j] = -stiffness * (strains[0] - strains[1]) / (2 * step)
    # Elasticity of the joints is none at rest, so that weight and cuffs alone have the energy Π.
    np.testing.assert_allclose(by_displacement, by_motion, atol=1e-3 * np.abs(by_displacement).max())
    assert np.abs(by_displacement).max() > 1.0


def test_a_joint_near_its_end_tells_less_the_nearer_it_is(model, expected):
    """The elbow's end stop acts on the elbow of the machine, and hardly on its shoulder."""
    rows = []
    for elbow in (1.3, 0.5, 0.3, 0.1):
        model.restart()
        model.linearise(Sample(0.0, np.append(Q[:3], elbow), STILL, STILL, STILL), expected)
        rows.append(model.end_stop_uncertainty())
    shoulder, elbow = np.array(rows)[:, :3], np.array(rows)[:, 3]
    assert (np.diff(elbow) > 0.0).all()
    assert elbow[0] < 0.05
    assert elbow[-1] > 0.5
    assert shoulder[-1].max() < 0.2 * elbow[-1]
