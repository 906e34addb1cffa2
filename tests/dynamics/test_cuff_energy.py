"""The derivatives of the cuff energy by geometry are correct everywhere: far from closed postures, and in motion."""

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.dynamics.cuff_energy import CuffEnergy, cuff_energy
from exograv.model.assembly import Assembly
from exograv.model.loops import FIT, cuff_residuals, scaled_stiffness

PARITY = 1e-12
"""Tolerance relative to the largest entry: some hundred rounding errors."""


@pytest.fixture(scope="module")
def compared(assembly: Assembly) -> kernel.Kernel:
    """Every derivative by geometry, then by differentiation of ½ Σ k r²."""
    cuffs: CuffEnergy = cuff_energy(assembly)
    y, z, fit, along = cuffs.y, cuffs.z, cuffs.fit, cuffs.along
    residual, _ = cuff_residuals(assembly, y, z, fit)
    energy = 0.5 * ca.dot(scaled_stiffness(assembly, fit) * residual, residual)
    slope, both = ca.gradient(energy, z), ca.vertcat(y, z)
    bent = ca.jtimes(ca.jtimes(slope, both, along), both, along)
    mine = [cuffs.energy, cuffs.slope, cuffs.strain, cuffs.H, cuffs.H_zy, cuffs.slope_bent]
    plain = [energy, slope, ca.gradient(energy, y), ca.jacobian(slope, z), ca.jacobian(slope, y), bent]
    return kernel.compile(ca.Function("compared", [y, z, fit, along], [*mine, *plain]))


@pytest.mark.parametrize("seed", range(1000, 1010))
def test_geometry_and_differentiation_agree(compared, seed: int):
    rng = np.random.default_rng(seed)
    values = compared.of(rng.normal(size=4), rng.normal(size=4), 0.3 * rng.normal(size=len(FIT)), rng.normal(size=8))
    for mine, plain in zip(values[:6], values[6:], strict=True):
        np.testing.assert_allclose(mine, plain, atol=PARITY * np.abs(plain).max(), rtol=0.0)


def test_curvature_is_the_same_from_both_sides(compared):
    rng = np.random.default_rng(1010)
    H = compared.of(rng.normal(size=4), rng.normal(size=4), 0.3 * rng.normal(size=len(FIT)), np.zeros(8))[3]
    np.testing.assert_allclose(H, H.T, atol=PARITY * np.abs(H).max())


def test_nothing_is_strained_where_the_cuffs_were_fastened(compared, assembly):
    donning = assembly.description.donning_posture
    energy, slope, strain, H, *_ = compared.of(donning, donning, np.zeros(len(FIT)), np.zeros(8))
    assert energy[0] == pytest.approx(0.0, abs=1e-20)
    for forces in (slope, strain):
        np.testing.assert_allclose(forces, 0.0, atol=1e-10)
    assert np.linalg.eigvalsh(H).min() > 0.0
