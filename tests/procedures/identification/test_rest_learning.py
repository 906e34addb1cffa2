"""A rest renews the carried arm only where its bound is smaller, and a contradiction keeps the arm and starts anew."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Parameters, RequestedMotion, Sample
from exograv.identification.core.prior import prior
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.model.description import load_rig
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import excitation_motion
from exograv.procedures.identification.rest_learning import RestLearner, Verdict, check_postures, shifted
from exograv.procedures.identification.rest_text import rest_text

RIG, SEED = "recupera_like", 1014
PERIOD_S, NOISE_NM = 0.08, 0.02


@pytest.fixture(scope="module")
def model() -> ArmModel:
    """Model of a wearer's arm in a machine that is known exactly."""
    laboratory = draw_laboratory(RIG, None, 2, SEED)
    return ArmModel(laboratory.assembly(), ideal_knowledge(laboratory, 0.0).machine)


def of_motion(model: ArmModel, learner: RestLearner, x: Parameters, seed: int) -> list[Sample]:
    """Samples that the model itself gives for parameters `x` on the learner's next motion."""
    path, noise = learner.path(PERIOD_S, 13.0), np.random.default_rng(seed)
    samples = []
    for k in range(len(path)):
        q, v, a = path.q[k].copy(), path.v[k].copy(), path.a[k].copy()
        sample = Sample(k * PERIOD_S, q, v, a, np.zeros(len(q)), RequestedMotion(q, v, a))
        tau = model.linearise(sample, x)[0] + noise.normal(0.0, NOISE_NM, len(q))
        samples.append(replace(sample, tau=tau))
    return samples


@pytest.mark.long
def test_a_shifted_excitation_is_the_same_motion_later(model: ArmModel):
    excitation, assembly = load_rig(RIG).excitation, model.assembly
    later = excitation_motion(assembly, 20.0, PERIOD_S, shifted(excitation, 0.2)).q
    whole = excitation_motion(assembly, 28.0, PERIOD_S, excitation).q
    shift, middle = round(0.2 * excitation.period_s / PERIOD_S), slice(50, 150)
    assert np.allclose(later[middle], whole[shift:][middle], atol=1e-9)


@pytest.mark.long
def test_rests_lower_the_bound_and_a_contradiction_keeps_the_carried_arm(model: ArmModel):
    rng = np.random.default_rng(SEED)
    mean, covariance = prior(model.assembly, model.machine)
    learner = RestLearner(model, table_guess(model.assembly, model.machine))
    truth = mean + 0.5 * np.sqrt(np.diag(covariance)) * rng.uniform(-1.0, 1.0, len(mean))
    bounds = [learner.stated_Nm]
    for seed in range(2):
        learned = learner.learn(of_motion(model.again(), learner, truth, seed))
        assert (learned.verdict is Verdict.TAKEN) == bool((learned.stated_Nm != bounds[-1]).any())
        bounds.append(learned.stated_Nm)
    assert (bounds[-1] < bounds[0]).all()
    before = learner.x.copy()
    heavier = truth.copy()
    heavier[: len(truth) // 2] *= 1.5
    contradicted = [learner.learn(of_motion(model.again(), learner, heavier, seed)) for seed in (8, 9)]
    assert [one.verdict for one in contradicted] == [Verdict.DISAGREES, Verdict.BEGINS_AGAIN]
    assert (learner.x == before).all()
    assert (learner.stated_Nm > bounds[-1]).all()
    assert "learns again" in rest_text(contradicted[-1], model.assembly.description)


def test_postures_of_the_check_are_of_the_motion():
    samples = [Sample(t, np.array([t]), np.zeros(1), np.zeros(1), np.zeros(1)) for t in np.arange(0.0, 4.0, 0.1)]
    postures = check_postures(samples)
    assert len(postures) == 4
    assert set(postures[:, 0]) <= {sample.q[0] for sample in samples}


@pytest.mark.long
def test_an_arm_that_the_machine_refuses_leaves_no_trace_in_what_the_learner_states(model: ArmModel):
    learner = RestLearner(model, table_guess(model.assembly, model.machine))
    x, covariance, stated = learner.x, learner.covariance, learner.stated_Nm
    truth = prior(model.assembly, model.machine)[0]
    learned = learner.learn(of_motion(model.again(), learner, truth, 0))
    assert learned.verdict is Verdict.TAKEN
    assert (learner.stated_Nm != stated).any()
    learner.keep(x, covariance)
    assert learner.x is x
    assert learner.stated_Nm == pytest.approx(stated)
