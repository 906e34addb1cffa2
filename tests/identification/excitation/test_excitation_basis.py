"""The bases state the motion between samples too: derivatives, direction, rest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.identification.excitation.basis import Basis, forth_and_back, harmonic, piece

BASES = {"loop": harmonic(20.0, 5), "both ways": forth_and_back(20.0, 5), "piece": piece(10.0, 6)}


def drawn(basis: Basis, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((basis.mixing.shape[1], 4))


@pytest.mark.parametrize("basis", BASES.values(), ids=BASES)
def test_speed_and_acceleration_are_the_derivatives_of_position(basis: Basis):
    path = basis.trajectory(drawn(basis), 10.0, 1e-3)
    np.testing.assert_allclose(np.gradient(path.q, path.dt, axis=0)[1:-1], path.v[1:-1], atol=1e-3)
    np.testing.assert_allclose(np.gradient(path.v, path.dt, axis=0)[1:-1], path.a[1:-1], atol=5e-3)


@given(seed=st.integers(0, 1000))
def test_forth_and_back_passes_every_posture_in_both_directions(seed: int):
    basis = BASES["both ways"]
    t = np.linspace(0.0, 10.0, 50)
    there, back = (basis.tables(when) for when in (t, basis.period_s - t))
    coefficients = drawn(basis, seed)
    np.testing.assert_allclose(there[0] @ coefficients, back[0] @ coefficients, atol=1e-9)
    np.testing.assert_allclose(there[1] @ coefficients, -back[1] @ coefficients, atol=1e-9)


@given(seed=st.integers(0, 1000))
def test_a_piece_starts_and_ends_at_its_posture_at_rest_without_a_jump_of_acceleration(seed: int):
    basis = BASES["piece"]
    coefficients = drawn(basis, seed)
    q, v, a = (table @ coefficients for table in basis.tables(np.array([0.0, basis.period_s])))
    np.testing.assert_allclose(q, np.tile(coefficients[0], (2, 1)), atol=1e-9)
    np.testing.assert_allclose(np.stack([v, a]), 0.0, atol=1e-8)


@given(seed=st.integers(0, 1000), samples_per_harmonic=st.integers(4, 40))
def test_between_samples_no_motion_exceeds_them_by_more_than_it_says(seed: int, samples_per_harmonic: int):
    basis = BASES["loop"]
    count = samples_per_harmonic * basis.harmonics
    coefficients = drawn(basis, seed)
    coarse, fine = (
        np.abs(basis.tables(np.arange(n) * basis.period_s / n)[1] @ coefficients).max() for n in (count, 5000)
    )
    assert fine <= coarse * basis.overshoot(count) * (1 + 1e-9)


@pytest.mark.parametrize("basis", BASES.values(), ids=BASES)
def test_the_series_is_the_same_motion(basis: Basis):
    coefficients = drawn(basis)
    centre, sine, cosine = basis.series(coefficients)
    whole = harmonic(basis.period_s, basis.harmonics).trajectory(np.vstack([centre, sine, cosine]), 7.0, 0.01)
    np.testing.assert_allclose(whole.q, basis.trajectory(coefficients, 7.0, 0.01).q, atol=1e-9)
