"""Position and torque have the same delay; velocity and acceleration are derivatives of the filtered position."""

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import prior
from exograv.identification.core.sample_filter import SampleFilter
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.identify import identification_motion

DT, DELAY_S = 1e-3, 0.04
SLOW_HZ = 0.5  # the fastest harmonic of a usual excitation is half of it
FLAT = 1e-3  # of the delay: Bessel, third order, at a twentieth of its corner


def copied(sample: Sample) -> Sample:
    return Sample(sample.t, sample.q.copy(), sample.v.copy(), sample.a.copy(), sample.tau.copy())


def passed(q: np.ndarray, tau: np.ndarray, dt: float = DT) -> list[Sample]:
    """Filtered samples of one joint, after the transient of the start."""
    kept, one = [], SampleFilter(1, dt, DELAY_S)
    for position, torque in zip(q, tau, strict=True):
        sample = one.update(np.array([position]), np.array([torque]))
        if one.settled:
            kept.append(copied(sample))
    return kept


@pytest.mark.parametrize("value", [0.0, 1.3, -2.0])
def test_a_constant_passes_unchanged_from_the_first_sample_on(value: float):
    for sample in passed(np.full(500, value), np.full(500, -value)):
        np.testing.assert_allclose(sample.q, value, atol=1e-12)
        np.testing.assert_allclose(sample.tau, -value, atol=1e-12)
        np.testing.assert_allclose(sample.v, 0.0, atol=1e-9)
        np.testing.assert_allclose(sample.a, 0.0, atol=1e-7)


def test_speed_and_acceleration_are_derivatives_of_the_filtered_position():
    noisy = np.random.default_rng(0).standard_normal(2000).cumsum() * 1e-3
    samples = passed(noisy, noisy)
    q, v, a = (np.array([getattr(s, name)[0] for s in samples]) for name in ("q", "v", "a"))
    # Between two ticks the input is linear and the states are smooth. The trapezoidal error is dt²/12 of the second
    # derivative: for `a` that of 15/DELAY_S³ of the input, whose rate of change is a step from tick to tick.
    most = 15.0 / DELAY_S**3 * DT / 12.0 * np.abs(np.diff(noisy)).max()
    np.testing.assert_allclose(np.diff(q) / DT, 0.5 * (v[1:] + v[:-1]), atol=1e-3)
    np.testing.assert_allclose(np.diff(v) / DT, 0.5 * (a[1:] + a[:-1]), atol=most)


@pytest.mark.parametrize("hz", [0.05, 0.2, SLOW_HZ])
def test_a_slow_motion_comes_out_as_it_went_in_but_later_by_the_delay(hz: float):
    t, w = np.arange(8000) * DT, 2 * np.pi * hz
    samples = passed(np.sin(w * t), np.cos(w * t))
    late = t[-len(samples) :] - DELAY_S
    settled = slice(500, None)
    for found, expected in (
        (np.array([s.q[0] for s in samples]), np.sin(w * late)),
        (np.array([s.tau[0] for s in samples]), np.cos(w * late)),
        (np.array([s.v[0] for s in samples]) / w, np.cos(w * late)),
    ):
        np.testing.assert_allclose(found[settled], expected[settled], atol=FLAT + (w * DELAY_S) ** 2 / 5)


@pytest.mark.parametrize("period_ms", [1, 2, 4, 10])
def test_a_joint_at_constant_speed_has_no_acceleration_at_any_period(period_ms: int):
    dt, speed = 1e-3 * period_ms, 0.9
    q = speed * dt * np.arange(round(2.0 / dt))
    for sample in passed(q, q, dt)[-round(1.0 / dt) :]:
        np.testing.assert_allclose(sample.v, speed, rtol=1e-6)
        # 0.3/s · speed would look like 0.2 N·m·s/rad of viscous friction on a rotor of 0.6 kg·m².
        np.testing.assert_allclose(sample.a, 0.0, atol=1e-3)


def test_position_and_torque_are_delayed_alike():
    signal = np.random.default_rng(1).standard_normal(1000).cumsum()
    for sample in passed(signal, signal):
        np.testing.assert_array_equal(sample.q, sample.tau)


def test_the_filter_is_settled_only_once_its_start_has_died_out():
    # A motion that starts at full speed, and the same motion filtered since 4 s before.
    t = np.arange(-4000, 1000) * DT
    q = 1.0 + np.sin(2 * np.pi * SLOW_HZ * t)
    samples, watched = passed(q[4000:], q[4000:]), passed(q, q)
    first, in_step = samples[0], watched[-len(samples)]
    np.testing.assert_allclose(first.q, in_step.q, atol=1e-3)
    np.testing.assert_allclose(first.v, in_step.v, atol=0.02)
    np.testing.assert_allclose(first.a, in_step.a, atol=0.5)


def test_time_counts_the_motion_since_the_filter_was_settled():
    samples = passed(np.zeros(1000), np.zeros(1000))
    np.testing.assert_allclose(np.diff([s.t for s in samples]), DT)
    assert samples[0].t == pytest.approx(DT)
    assert len(samples) == 1000 - round(6 * DELAY_S / DT)


FILTERED_NM = 0.03  # a fifth of what an identification may leave at a shoulder


def test_the_model_at_the_filtered_motion_gives_the_filtered_torque_of_the_whole_machine():
    """Otherwise a regressor filtered by parts (Slotine & Li 1991) would be needed to avoid accelerations."""
    assembly = assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))
    machine = nominal_machine(assembly.description, assembly.exo.phi)
    x, _ = prior(assembly, machine)
    # At a reversal the direction of dry friction is uncertain, which the estimator models by its noise.
    x[ParameterLayout.of(assembly).coulomb] = 0.0
    true, one = ArmModel(assembly, machine), SampleFilter(assembly.n, DT)
    filtered = true.again()
    path = identification_motion(assembly, 12.0, DT)
    off = []
    for k in range(len(path)):
        still = Sample(DT * k, path.q[k], path.v[k], path.a[k], np.zeros(assembly.n))
        sample = one.update(path.q[k], true.linearise(still, x)[0])
        if one.settled and k % 10 == 0:
            off.append(sample.tau - filtered.linearise(sample, x)[0])
    assert np.abs(off).max() < FILTERED_NM
