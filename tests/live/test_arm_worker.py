"""A worker learns the arm from its samples, despite gaps, and reports a file that belongs to another person."""

from collections.abc import Container

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import prior
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live.arm_worker import ArmWorker, LearnedArm
from exograv.loop.bridged_listener import BRIDGED_TICKS
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.motion import Trajectory
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import IMPLAUSIBLE, identification_motion
from exograv.runtime.control_loop.exchange import sample_dtype

PERIOD_S, SECONDS, NOW = 0.001, 12.0, 100.0
SEED = 1002
TRANSIENT_S = 0.24  # Six times the delay of the filter.
KEPT = 0.03
"""Variance of a file as a share of the table's variance."""


@pytest.fixture(scope="module")
def prepared() -> ControllerKnowledge:
    return ideal_knowledge(draw_laboratory("recupera_like", None, 0, SEED), 0.0)


def path_of(prepared: ControllerKnowledge) -> Trajectory:
    return identification_motion(prepared.assembly, SECONDS, PERIOD_S)


def moved(worker: ArmWorker, prepared: ControllerKnowledge, path: Trajectory, missing: Container[int] = ()) -> ArmModel:
    """Send the motion to the worker; return the model of the moved arm."""
    assembly = prepared.assembly
    model, row = ArmModel(assembly, prepared.machine), np.zeros(1, sample_dtype(assembly.n))[0]
    for k in range(len(path)):
        if k in missing:
            continue
        sample = Sample(0.0, path.q[k], path.v[k], path.a[k], np.zeros(assembly.n))
        row["now"], row["q"], row["q_asked"] = NOW + k * PERIOD_S, path.q[k], path.q[k]
        row["tau"] = model.linearise(sample, prepared.x)[0]
        worker.take(row)
    return model


@pytest.mark.slow
@pytest.mark.parametrize("gap", [0, BRIDGED_TICKS - 1, 10 * BRIDGED_TICKS])
def test_a_worker_learns_on_over_samples_that_are_missing(prepared: ControllerKnowledge, gap: int):
    """The moved arm is the controller's own model, without elasticity; the estimate must hold its weight."""
    worker, path = ArmWorker(prepared.assembly, prepared.machine, PERIOD_S), path_of(prepared)
    model = moved(worker, prepared, path, range(6000, 6000 + gap))
    carried, learned = worker.finish()
    assert isinstance(learned, LearnedArm)
    x, covariance = learned.estimate.x, learned.estimate.covariance
    assert covariance is not None
    np.testing.assert_array_equal(carried, learned.carried.x)
    widest = 0.0
    for q in path.q[::500]:
        tau, derivative = model.at_rest(q, x)
        sd = np.sqrt(np.einsum("ji,ik,jk->j", derivative, covariance, derivative))
        assert (np.abs(tau - model.at_rest(q, prepared.x)[0]) < 2.5 * sd).all()
        widest = max(widest, float(sd.max()))
    assert widest < 0.6  # Newton metres: an interval that holds everything would prove nothing
    # A gap that is not bridged does not count as motion, and neither does the filter's transient after it.
    breaks = gap > BRIDGED_TICKS
    left_out = TRANSIENT_S * (1 + breaks) + breaks * gap * PERIOD_S
    assert learned.estimate.t == pytest.approx(SECONDS - left_out, abs=0.01)


def test_samples_that_are_missing_from_a_moving_arm_change_nothing_that_the_estimate_knows(
    prepared: ControllerKnowledge,
):
    """Each tenth sample and 15 in a row are missing; the change is compared with the estimate's own uncertainty."""
    path, found = path_of(prepared), list[np.ndarray]()
    for missing in (set[int](), {*range(500, 4000, 10), *range(2000, 2015)}):
        worker = ArmWorker(prepared.assembly, prepared.machine, PERIOD_S)
        moved(worker, prepared, path, missing | {*range(4000, len(path))})
        estimate = worker._learner.estimate()
        found.append(estimate.x)
    assert estimate.covariance is not None
    sd = np.sqrt(np.diag(estimate.covariance))
    assert (np.abs(found[1] - found[0]) / sd).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(("times", "is_other"), [(1.0, False), (1.6, True)])
def test_a_worker_begins_with_the_file_and_says_when_it_is_of_a_heavier_arm(
    prepared: ControllerKnowledge, times: float, is_other: bool
):
    mean = prepared.x.copy()
    mean[ParameterLayout.of(prepared.assembly).phi] *= times
    belief = mean, KEPT * prior(prepared.assembly, prepared.machine)[1]
    worker = ArmWorker(prepared.assembly, prepared.machine, PERIOD_S, belief=belief)
    moved(worker, prepared, path_of(prepared))
    news = worker.news()
    assert np.array_equal(news[0].prior, mean)
    assert news[-1].is_contradicted is is_other
    assert not news[0].is_contradicted


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_the_guard_expects_the_tables_arm_where_control_refuses_the_learned_one(
    prepared: ControllerKnowledge, times: float, monkeypatch: pytest.MonkeyPatch
):
    table = table_guess(prepared.assembly, prepared.machine)
    phi, worker = ParameterLayout.of(prepared.assembly).phi, ArmWorker(prepared.assembly, prepared.machine, PERIOD_S)
    path = path_of(prepared)
    moved(worker, prepared, path, range(1000, len(path)))
    last = worker._learner.last()
    last.x[:] = table
    last.x[phi] *= times
    monkeypatch.setattr(worker._learner, "last", lambda: last)
    x, learned = worker.finish()
    assert isinstance(learned, LearnedArm)
    expected = LimitsMaker(prepared.assembly, prepared.machine, table).known(table if times > 1.6 else x)
    q = prepared.assembly.description.donning_posture
    assert learned.why.startswith(IMPLAUSIBLE) == (times > 1.6)
    np.testing.assert_array_equal(learned.person.table.torque(q, 0.0), expected.table.torque(q, 0.0))
