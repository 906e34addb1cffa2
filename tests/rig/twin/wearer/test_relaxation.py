"""The modes of relaxation follow the published continuous spectra, with times over decades."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import exp1

from exograv.rig.twin.wearer.relaxation import RelaxationSpectrum, draw_relaxation

# A mode for each part of the spectrum, in place of all its times: a seventh of one part.
MODES_TOLERANCE = 0.02


def relaxed(spectrum: RelaxationSpectrum, t: float) -> float:
    return sum(share * np.exp(-t / time) for share, time in spectrum.modes)


@pytest.mark.parametrize("t", [0.0, 0.03, 0.3, 3.0, 30.0, 300.0])
def test_without_an_exponent_it_is_fung_s_reduced_relaxation(t: float):
    first, last = 0.1, 100.0
    wanted = 1.0 if t == 0.0 else (exp1(t / last) - exp1(t / first)) / np.log(last / first)
    assert relaxed(RelaxationSpectrum(first, last, 0.0), t) == pytest.approx(wanted, abs=MODES_TOLERANCE)


@pytest.mark.parametrize("exponent", [0.1, 0.35])
@pytest.mark.parametrize("t", [0.03, 0.3, 3.0, 30.0])
def test_with_an_exponent_it_is_the_integral_over_a_power_of_the_times(exponent: float, t: float):
    first, last = 0.2, 200.0
    over, all_ = (
        quad(lambda x, t=now: np.exp(-exponent * x - t * np.exp(-x)), np.log(first), np.log(last))[0]
        for now in (t, 0.0)
    )
    assert relaxed(RelaxationSpectrum(first, last, exponent), t) == pytest.approx(over / all_, abs=MODES_TOLERANCE)


def test_between_its_ends_it_falls_as_the_power_of_a_spring_pot():
    spectrum = RelaxationSpectrum(1e-3, 1e5, 0.3)
    # A spectrum as wide as this one needs more modes than a person's; the slope is that of the integral.
    times = np.geomspace(0.1, 10.0, 9)
    ends = np.log(spectrum.shortest), np.log(spectrum.longest)
    exact = [quad(lambda x, t=t: np.exp(-0.3 * x - t * np.exp(-x)), *ends)[0] for t in times]
    slope = np.polyfit(np.log(times), np.log(exact), 1)[0]
    assert slope == pytest.approx(-0.3, abs=0.02)


def test_the_times_span_at_least_two_decades_and_the_shares_are_one():
    for seed in range(200):
        spectrum = draw_relaxation(seed)
        shares, times = zip(*spectrum.modes, strict=True)
        assert sum(shares) == pytest.approx(1.0)
        assert min(shares) > 0.0
        assert max(times) / min(times) > 40.0
        assert 0.05 <= spectrum.shortest <= 0.5
        assert 50.0 <= spectrum.longest <= 500.0
