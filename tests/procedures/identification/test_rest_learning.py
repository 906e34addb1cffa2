"""A rest renews the carried arm only where its bound is smaller, and a contradiction keeps the arm and starts anew."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.experiment.train.preparation import person_run
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Outcome, Parameters, RequestedMotion, Sample
from exograv.identification.core.left_over import POSTURES, LeftOverPrediction, is_restless
from exograv.identification.core.muscle_signals import MuscleSignals
from exograv.identification.core.prior import prior
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.loops import FIT
from exograv.model.support import sample_postures
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import excitation_motion
from exograv.procedures.identification.participant_session import (
    KEPT_BEFORE,
    KeptParticipant,
    NotKept,
    ParticipantRun,
)
from exograv.procedures.identification.rest_learning import RestLearner, Verdict, check_postures, shifted
from exograv.procedures.identification.rest_text import rest_text
from exograv.storage.rests_so_far import RestsSoFar
from exograv.storage.session_checkpoint import CheckedArm, KeptArm, KeptRests, KnownPerson

RIG, SEED = "recupera_like", 1014
PERIOD_S, NOISE_NM = 0.08, 0.02

STRAIN_ERROR_NM = 0.05
"""Error of the change of torque by the derivative halfway [N·m]: half of the elbow's target."""

RESUMED_SHARE = 0.2
"""Difference of the stated torque after an interruption [-]. The linearisation of the samples from before is kept, and
the state of the tissue is forgotten."""

RENEWED = {Verdict.TAKEN, Verdict.CONFIRMED}
"""Verdicts by which the carried arm states less than before."""

RESTLESS_NM = 1.5
"""Slow torque of a wearer who does not relax [N·m]."""


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
        assert learned.verdict in RENEWED
        bounds.append(learned.stated_Nm)
    assert (bounds[-1] < bounds[0]).all()
    before = learner.x.copy()
    heavier = truth.copy()
    heavier[: len(truth) // 2] *= 1.5
    contradicted, of_file = [], []
    for seed in (8, 9):
        contradicted.append(learner.learn(of_motion(model.again(), learner, heavier, seed)))
        of_file.append(learner.kept.checked)
    assert of_file[0] is not None, "as after an identification, the next session does not start from it"
    assert (of_file[0].outcome, of_file[1]) == (Outcome.DISAGREES.value, None)
    assert [one.verdict for one in contradicted] == [Verdict.DISAGREES, Verdict.BEGINS_AGAIN]
    assert (learner.x == before).all()
    assert (learner.stated_Nm > bounds[-1]).all()
    assert "learns again" in rest_text(contradicted[-1], model.assembly.description)


@pytest.mark.long
def test_an_arm_in_force_that_is_better_than_the_new_one_stays_and_states_less(model: ArmModel):
    mean, covariance = prior(model.assembly, model.machine)
    truth = mean + 0.5 * np.sqrt(np.diag(covariance)) * np.random.default_rng(SEED).uniform(-1.0, 1.0, len(mean))
    learner = RestLearner(model, table_guess(model.assembly, model.machine))
    learner.learn(of_motion(model.again(), learner, truth, 0))
    learner.keep(truth, learner.covariance)
    before = learner.stated_Nm
    learned = learner.learn(of_motion(model.again(), learner, truth, 1))
    assert learned.verdict is Verdict.CONFIRMED
    assert (learner.x == truth).all()
    assert (learner.stated_Nm < before).all()
    assert "more certain" in rest_text(learned, model.assembly.description)


def test_postures_of_the_check_are_of_the_motion():
    samples = [Sample(t, np.array([t]), np.zeros(1), np.zeros(1), np.zeros(1)) for t in np.arange(0.0, 4.0, 0.1)]
    postures = check_postures(samples)
    assert len(postures) == 4
    assert set(postures[:, 0]) <= {sample.q[0] for sample in samples}


@pytest.mark.long
def test_an_arm_that_the_machine_refuses_leaves_no_trace_in_what_the_learner_states(model: ArmModel):
    learner = RestLearner(model, table_guess(model.assembly, model.machine))
    x, covariance = learner.x, learner.covariance
    truth = prior(model.assembly, model.machine)[0]
    learned = learner.learn(of_motion(model.again(), learner, truth, 0))
    assert learned.verdict is Verdict.TAKEN
    assert (learner.covariance != covariance).any()
    assert learner.kept.checked is not None
    learner.keep(x, covariance)
    assert learner.kept.checked is None
    assert learner.x is x
    assert learner.covariance is covariance


@pytest.mark.long
def test_the_decision_knows_the_strain_that_the_estimate_has_and_the_start_has_not(model: ArmModel):
    start = table_guess(model.assembly, model.machine)
    layout = ParameterLayout.of(model.assembly)
    strained = start.copy()
    strained[layout.fit] += np.where([name.startswith("elbow_axis") for name in FIT], 0.15, 0.0)
    strained[layout.fit][:3] += (-0.007, 0.0, 0.015)
    learner = RestLearner(model, start)
    learned = learner.learn(of_motion(model.again(), learner, strained, 0))
    found = learned.estimate.x
    postures = sample_postures(model.assembly.description, POSTURES)
    change = np.array([model.at_rest(q, found)[0] - model.at_rest(q, start)[0] for q in postures])
    exact = np.sqrt(np.mean(change**2, axis=0))
    assert learned.carried.change_Nm == pytest.approx(exact, abs=STRAIN_ERROR_NM)


def pushed_and_measured(model: ArmModel, samples: list[Sample], x: Parameters, seed: int) -> list[Sample]:
    """Samples of a restless wearer with exact signals: a channel per freedom of the arm and direction."""
    own = slow_torque(seed, len(samples), RESTLESS_NM)
    shown = np.hstack([np.maximum(own, 0.0), np.maximum(-own, 0.0)]) / 60.0
    # A spring offset is a torque at its freedom that helps the motors.
    helps, pushed = ParameterLayout.of(model.assembly).spring_offset, []
    for one, torque, signals in zip(samples, own, shown, strict=True):
        derivative = model.linearise(one, x)[1]
        pushed.append(replace(one, tau=one.tau + derivative[:, helps] @ torque, muscles=signals))
    return pushed


@pytest.mark.slow
def test_a_restless_rest_is_left_out_and_restlessness_that_repeats_is_not(model: ArmModel):
    learner = RestLearner(model, table_guess(model.assembly, model.machine))
    truth = prior(model.assembly, model.machine)[0]
    found = []
    for seed, push_Nm in enumerate((0.0, RESTLESS_NM, RESTLESS_NM, RESTLESS_NM)):
        samples = of_motion(model.again(), learner, truth, seed)
        slow = slow_torque(seed, len(samples), push_Nm)
        pushed = [replace(one, tau=one.tau + more) for one, more in zip(samples, slow, strict=True)]
        found.append(learner.learn(pushed))
    verdicts = [one.verdict for one in found]
    assert verdicts[0] is Verdict.TAKEN
    assert verdicts[1] is Verdict.RESTLESS
    assert verdicts[3] is not Verdict.RESTLESS
    assert is_restless(found[-1].estimate)


@pytest.mark.long
def test_rests_of_a_restless_wearer_teach_more_if_the_muscles_are_measured(model: ArmModel):
    mean, covariance = prior(model.assembly, model.machine)
    truth = mean + 0.7 * np.sqrt(np.diag(covariance)) * np.random.default_rng(SEED).uniform(-1.0, 1.0, len(mean))
    left = []
    for signals in (None, MuscleSignals(8)):
        learner = RestLearner(model, table_guess(model.assembly, model.machine), muscles=signals)
        verdicts = []
        for seed in range(2):
            samples = of_motion(model.again(), learner, truth, seed)
            verdicts.append(learner.learn(pushed_and_measured(model.again(), samples, truth, seed)).verdict)
        assert (Verdict.RESTLESS in verdicts) == (signals is None)
        away = LeftOverPrediction(model.again(), truth).torque_of(learner.x - truth)
        left.append(np.sqrt(np.mean(away**2)))
    assert left[1] < 0.5 * left[0]


def test_a_learner_that_counts_on_moves_another_part_of_the_excitation_and_adds_its_motion(model: ArmModel):
    start = table_guess(model.assembly, model.machine)
    first, later = RestLearner(model, start), RestLearner(model, start)
    before = RestsSoFar(rests=1, left_out=1, motion_s=10.0)
    later.count_on(before)
    assert later.so_far == before
    truth = prior(model.assembly, model.machine)[0]
    samples = of_motion(model.again(), later, truth, 1)
    assert not np.allclose(samples[50].q, of_motion(model.again(), first, truth, 1)[50].q)
    later.learn(samples)
    assert later.so_far == RestsSoFar(2, 1, 10.0 + samples[-1].t)


@pytest.mark.long
def test_a_resumed_learner_states_and_carries_what_an_uninterrupted_one_does(model: ArmModel):
    learner = RestLearner(model, table_guess(model.assembly, model.machine))
    mean, covariance = prior(model.assembly, model.machine)
    truth = mean + 0.5 * np.sqrt(np.diag(covariance)) * np.random.default_rng(SEED).uniform(-1.0, 1.0, len(mean))
    learner.learn(of_motion(model.again(), learner, truth, 0))
    person = KnownPerson.of(model.machine, learner.x, learner.covariance)
    kept = KeptRests.model_validate_json(learner.kept.model_dump_json())
    resumed = RestLearner.continued(model, KnownPerson.model_validate_json(person.model_dump_json()), kept)
    assert (resumed.x == learner.x).all()
    assert resumed.kept == learner.kept
    both = [one.learn(of_motion(model.again(), one, truth, 1)) for one in (learner, resumed)]
    assert {one.verdict for one in both} <= RENEWED
    assert both[1].motion_s == pytest.approx(both[0].motion_s)
    assert both[1].stated_Nm == pytest.approx(both[0].stated_Nm, rel=RESUMED_SHARE)
    away = LeftOverPrediction(model.again(), truth).torque_of(resumed.x - learner.x)
    assert (np.sqrt(np.mean(away**2, axis=0)) < both[0].stated_Nm).all()


def test_an_arm_from_rests_is_written_once_and_none_without_a_relaxed_rest(model: ArmModel, tmp_path: Path):
    table, body = prior(model.assembly, model.machine), Body(1.7, 70.0, "female", {})
    checked = CheckedArm(
        **KeptArm.of(*table).model_dump(), motion_s=30.0, outcome=Outcome.CONVERGED.value,
        predicted_left_over_Nm=[0.1] * 4, held_out_error_Nm=[0.2] * 4, held_out_s=12.0,
    )  # fmt: skip

    def run() -> ParticipantRun:
        return person_run(tmp_path / "a.toml", "P-07", model.assembly, "serial", body)

    assert isinstance(run().keep_learned(None, model.machine), NotKept)
    assert not (tmp_path / "a.toml").exists()
    for _ in range(2):
        written = run().keep_learned(checked, model.machine)
        assert isinstance(written, KeptParticipant)
        assert (written.donnings, written.held_out_error_Nm) == (1, [0.2] * 4)
    other = checked.model_copy(update={"x": [*checked.x[:-1], checked.x[0] + 1.0], "motion_s": 40.0})
    other.x[0] *= 1.1
    written = run().keep_learned(other, model.machine)
    assert isinstance(written, KeptParticipant)
    assert written.donnings == 2

    def later(**better: object) -> KeptParticipant | NotKept | None:
        arm = other.model_copy(update={"x": [other.x[0] * 1.1, *other.x[1:]], **better})
        return replace(run(), is_of_donning=True).keep_learned(arm, model.machine)

    whole = (tmp_path / "a.toml").read_bytes()
    worse = [1.1 * value for value in other.predicted_left_over_Nm]
    assert later(predicted_left_over_Nm=worse) == NotKept(None, KEPT_BEFORE)
    assert (tmp_path / "a.toml").read_bytes() == whole
    for one in (
        later(predicted_left_over_Nm=[0.9 * value for value in other.predicted_left_over_Nm]),
        later(predicted_left_over_Nm=worse, outcome=Outcome.DISAGREES.value, x=other.x),
        later(predicted_left_over_Nm=worse),
    ):
        assert isinstance(one, KeptParticipant)
        assert one.donnings == 2


def slow_torque(seed: int, count: int, sd_Nm: float) -> np.ndarray:
    """Torque of a wearer who does not relax (sample, joint) [N·m]: slow, with a correlation time of 3 s."""
    rng, keep = np.random.default_rng(100 + seed), np.exp(-PERIOD_S / 3.0)
    torque = np.zeros((count, 4))
    for k in range(1, count):
        torque[k] = keep * torque[k - 1] + np.sqrt(1.0 - keep**2) * rng.normal(0.0, sd_Nm, 4)
    return torque
