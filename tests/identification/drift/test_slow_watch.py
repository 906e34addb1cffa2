"""A change of cuff, drive or arm is named with its size; what the motion cannot tell apart is not guessed."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import DISTURBANCE_SD, prior
from exograv.identification.drift.slow_causes import effects, place_of, possible_causes
from exograv.identification.drift.slow_change import Kind, SlowJudgement
from exograv.identification.drift.slow_watch import SlowWatch
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.motion import Trajectory, go_to
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.identify import excitation_motion

DT, SECONDS = 0.08, 20.0
CORRELATION_S = 3.0
"""Correlation time of the simulated wearer's slow torque; the watch assumes a longer one."""

SHARE_ERROR = 0.04
"""Permitted error of a share of friction [-]: twice the half width that the watch states."""

SESSIONS = range(1, 31)
"""Repetitions without a change in which nothing may be told: five hours with a check every ten minutes."""

FURTHER_SLIPS = ((0, 0.015), (0, 0.03), (1, -0.02), (1, 0.03))
"""Cuffs, and their ways along the limb [m]."""

Torque = Callable[[Sample], np.ndarray]


@dataclass(frozen=True)
class Expected:
    """Motion without torque, and what the model expects on it."""

    still: list[Sample]
    tau: np.ndarray
    """Torque at the parameters of the bench (sample, joint)."""

    tone: np.ndarray
    """Torque for each unit of the wearer's slow torque (sample, joint, freedom)."""


class Bench:
    """Arm of the table in a nominal machine, and motions of it with a wearer who is not perfectly calm."""

    def __init__(self):
        description = load_rig("recupera_like")
        self.assembly = assemble(description, Body(1.75, 72.0, "male"))
        self.machine = nominal_machine(description, self.assembly.exo.phi)
        self.model = ArmModel(self.assembly, self.machine)
        self.x, self.covariance = prior(self.assembly, self.machine)
        self.expected = self.on(excitation_motion(self.assembly, SECONDS, DT))

    def on(self, path: Trajectory) -> Expected:
        still = [Sample(k * DT, *row, np.zeros(4)) for k, row in enumerate(zip(path.q, path.v, path.a, strict=True))]
        found = effects(self.model.again(), self.x, still)
        tone = [cause.columns[0] for cause in possible_causes(self.model) if cause.kind is Kind.TONE]
        return Expected(still, -found.residual, found.by_size[:, :, tone])

    def motion(
        self,
        seed: int,
        model: ArmModel | None = None,
        x: np.ndarray | None = None,
        expected: Expected | None = None,
        extra: Torque | None = None,
        unrest: float = 1.0,
    ) -> list[Sample]:
        """Samples of a motion: torque of `model` at `x`, `extra` torque, and `unrest` times the usual slow torque."""
        expected = expected or self.expected
        rng, keeps = np.random.default_rng(seed), np.exp(-DT / CORRELATION_S)
        sd = unrest * np.array([DISTURBANCE_SD[place_of(freedom)] for freedom in self.assembly.arm.freedoms])
        slow = sd * rng.standard_normal(4)
        own = None if model is None and x is None else (model or self.model).again()
        samples = []
        for sample, usual, column in zip(expected.still, expected.tau, expected.tone, strict=True):
            slow = keeps * slow + sd * np.sqrt(1.0 - keeps**2) * rng.standard_normal(4)
            tau = usual if own is None else own.linearise(sample, self.x if x is None else x)[0]
            tau = tau + column @ slow + self.machine.residual_sd * rng.standard_normal(4)
            samples.append(replace(sample, tau=tau + (0.0 if extra is None else extra(sample))))
        return samples

    def watch(self, expected: Expected | None = None) -> SlowWatch:
        """Watch that has seen the motion once."""
        return SlowWatch(self.model.again(), self.x, self.covariance, self.motion(0, expected=expected))


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench()


def named(judgement: SlowJudgement) -> list[tuple[Kind, str]]:
    return [(one.cause.kind, one.cause.place) for one in judgement.changes]


@pytest.mark.parametrize(
    ("cuff", "way"),
    [(0, -0.02), (1, 0.015), *(pytest.param(*one, marks=pytest.mark.long) for one in FURTHER_SLIPS)],
)
def test_a_cuff_that_has_slipped_is_named_with_its_way(bench: Bench, cuff: int, way: float):
    slid = tuple(way if number == cuff else 0.0 for number in range(len(bench.assembly.cuffs)))
    model = ArmModel(replace(bench.assembly, slid_m=slid), bench.machine)
    judgement = bench.watch().judge(bench.motion(1, model))
    assert named(judgement) == [(Kind.CUFF, bench.assembly.cuffs[cuff].name)]
    assert abs(judgement.changes[0].size - way) <= judgement.changes[0].half_width


@pytest.mark.parametrize("joint", range(4))
def test_a_drive_whose_friction_falls_is_named_with_its_share(bench: Bench, joint: int):
    layout, x = ParameterLayout.of(bench.assembly), bench.x.copy()
    x[layout.coulomb][joint] *= 0.82
    x[layout.viscous][joint] *= 0.82
    judgement = bench.watch().judge(bench.motion(1, x=x))
    assert named(judgement) == [(Kind.FRICTION, bench.assembly.description.joints[joint])]
    assert judgement.changes[0].size == pytest.approx(-0.18, abs=SHARE_ERROR)


def test_drives_that_warm_up_together_are_one_change(bench: Bench):
    layout, x = ParameterLayout.of(bench.assembly), bench.x.copy()
    x[layout.coulomb] *= 0.9
    x[layout.viscous] *= 0.9
    assert named(bench.watch().judge(bench.motion(1, x=x))) == [(Kind.WARM_UP, "drives")]


def test_an_elbow_that_pulls_is_no_drive_and_no_cuff(bench: Bench):
    layout, x = ParameterLayout.of(bench.assembly), bench.x.copy()
    x[layout.spring_offset][3] += 1.0
    assert named(bench.watch().judge(bench.motion(1, x=x))) == [(Kind.TONE, "elbow")]


@pytest.mark.parametrize("sessions", [SESSIONS[:4], pytest.param(SESSIONS[4:], marks=pytest.mark.long)])
def test_nothing_is_told_while_nothing_changes(bench: Bench, sessions: range):
    watch = bench.watch()
    assert all(watch.judge(bench.motion(seed)).is_silent for seed in sessions)


def test_a_motion_in_one_direction_cannot_tell_friction_from_a_wearer_who_pulls(bench: Bench):
    q = bench.assembly.description.donning_posture
    path = go_to(q, q + np.array([0.0, 0.0, 0.0, 1.0]), 0.25, DT)
    layout, x = ParameterLayout.of(bench.assembly), bench.x.copy()
    x[layout.coulomb][3] *= 0.5
    expected = bench.on(path)
    judgement = bench.watch(expected).judge(bench.motion(1, x=x, expected=expected))
    assert not judgement.changes
    assert {one.cause.kind for one in judgement.one_of} >= {Kind.FRICTION, Kind.TONE}


def test_a_wearer_who_pushes_is_asked_to_relax_and_no_change_is_told(bench: Bench):
    judgement = bench.watch().judge(bench.motion(1, unrest=8.0))
    assert judgement.is_restless
    assert judgement.is_silent


def test_one_burst_is_no_change(bench: Bench):
    def burst(sample: Sample) -> np.ndarray:
        return np.full(4, 5.0 if abs(sample.t - 9.0) < 0.3 else 0.0)

    assert bench.watch().judge(bench.motion(1, extra=burst)).is_silent
