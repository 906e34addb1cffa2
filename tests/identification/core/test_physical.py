"""The projection returns the nearest possible body, and leaves a possible body unchanged."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.identification.core.physical import PhysicalProjection
from exograv.model.tree import inertial_parameters, is_physical

PRIOR = inertial_parameters(2.0, np.array([0.0, 0.0, -0.15]), np.diag([0.012, 0.012, 0.002]))
SCALE = np.array([0.3, *[0.03] * 3, *[0.01] * 6])


def covariance(seed: int, size: int = 10) -> np.ndarray:
    """Ill-conditioned covariance, as after a motion that shows some directions a thousand times better than others."""
    generator = np.random.default_rng(seed)
    directions, _ = np.linalg.qr(generator.standard_normal((size, size)))
    scale = np.tile(SCALE, size // 10)
    return scale[:, None] * (directions * 10.0 ** generator.uniform(-6, 0, size)) @ directions.T * scale


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.floats(0.1, 30.0))
def test_every_published_body_is_possible(seed: int, size: float):
    x = PRIOR + size * SCALE * np.random.default_rng(seed).standard_normal(10)
    assert is_physical(PhysicalProjection((slice(0, 10),), PRIOR)(x, covariance(seed)))


def test_a_possible_body_is_returned_as_it_is():
    x = PRIOR * 1.3
    assert PhysicalProjection((slice(0, 10),), PRIOR)(x, covariance(0)) is x


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_no_possible_body_on_the_way_to_the_prior_or_around_is_nearer(seed: int):
    generator = np.random.default_rng(seed)
    x = PRIOR + 3 * SCALE * generator.standard_normal(10)
    P = covariance(seed)
    information = np.linalg.inv(P)
    near = PhysicalProjection((slice(0, 10),), PRIOR)(x, P)
    distance = (near - x) @ information @ (near - x)
    others = [PRIOR + share * (x - PRIOR) for share in np.linspace(0, 1, 50)]
    others += [near + 0.01 * np.linalg.cholesky(P) @ generator.standard_normal(10) for _ in range(50)]
    for other in others:
        if is_physical(other):
            assert (other - x) @ information @ (other - x) > distance - 0.02


def test_what_is_correlated_with_the_body_moves_along():
    x = np.append(PRIOR, 5.0)
    x[0] = -1.0
    P = np.diag([*SCALE**2, 1.0])
    P[0, 10] = P[10, 0] = 0.9 * SCALE[0]
    moved = PhysicalProjection((slice(0, 10),), np.append(PRIOR, 5.0))(x, P)
    np.testing.assert_allclose(moved[10] - 5.0, 0.9 / SCALE[0] * (moved[0] - x[0]), rtol=1e-6)
    assert is_physical(moved[:10])
