"""A transparency test compares equal conditions, reports the contract's figures, and rejects unsuitable machines."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.syntax import nodes_of

import exograv
from exograv.errors import ConfigError
from exograv.laboratory.conditions import ScaledController
from exograv.laboratory.effort import Effort
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.movements import pointing
from exograv.laboratory.options import TransparencyOptions
from exograv.laboratory.transparency import movement_for
from exograv.laboratory.transparency_summary import profile, rig_result
from exograv.laboratory.transparency_trial import CONDITIONS, TransparencyTrial, _effort
from exograv.loop.output_feedback import NoTorque
from exograv.model.description import load_rig
from exograv.report.figures.transparency_data import MachineTransparency
from exograv.results import json_value
from exograv.rig.twin.twin import PERIOD
from exograv.signals import Reference

SEEDS = [3, 4, 5]
STILL = np.zeros(4)


def effort(size: float, tracking_deg: float = 0.5) -> Effort:
    """Effort with the same value at every joint."""
    return Effort(np.full(4, size), np.full(4, size**2), np.full(4, tracking_deg), 12)


def result() -> MachineTransparency:
    sizes = {
        "uncompensated": 8.0,
        "gcm": 4.0,
        "dam": 2.0,
        "dam_ideal": 1.5,
        "dam_ideal_no_friction": 1.0,
        "zero_g": 0.5,
    }
    efforts = {name: [effort(size), effort(1.1 * size), effort(5.0 * size, 1.2)] for name, size in sizes.items()}
    return rig_result(load_rig("recupera_like"), TransparencyOptions(), SEEDS, pointing(4, 1e-3), efforts)


def test_the_figures_follow_the_contract():
    figures = result()
    assert figures.profile == "harmonic"
    assert figures.movement == "pointing"
    assert list(figures.conditions) == list(CONDITIONS)
    for row in figures.conditions.values():
        assert {"effort_Nms", "by_joint_Nms", "tracking_error_deg"} <= json_value(row).keys()
        assert len(row.by_joint_Nms) == 4
        assert [machine.seed for machine in row.machines] == SEEDS


def test_ratios_are_of_the_same_machine_and_medians_over_machines():
    figures = result()
    assert figures.dam_over_gcm.effort == pytest.approx(0.5)
    assert figures.dam_over_gcm.elbow == pytest.approx(0.5)
    assert figures.dam_over_gcm.squared == pytest.approx(0.25)
    assert figures.dam_over_gcm.beyond_zero_g == pytest.approx(1.5 / 3.5, abs=1e-3)
    assert figures.dam_minus_ideal_Nms == pytest.approx(4.0 * 1.1 * 0.5)
    assert figures.conditions["gcm"].effort_Nms == pytest.approx(4.0 * 1.1 * 4.0)


def test_who_left_the_path_is_named():
    assert {(stray.condition, stray.seed) for stray in result().off_path} == {(name, 5) for name in CONDITIONS}


@pytest.mark.parametrize(
    ("name", "expected"), [("recupera_like", "harmonic"), ("recupera_like_qdd", "qdd"), ("nesm_like", "harmonic")]
)
def test_the_profile_is_that_of_the_drives(name: str, expected: str):
    assert profile(load_rig(name)) == expected


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"level": 5}, "--level is 5; allowed: 0"),
        ({"machines": 0}, "--machines is 0; allowed: 1 to 100"),
        ({"seed": -1}, "--seed is -1"),
    ],
)
def test_options_that_mean_nothing_are_refused(change: dict, message: str):
    with pytest.raises(ConfigError, match=message):
        TransparencyOptions(**change)


@pytest.mark.parametrize(
    ("name", "movement", "message"),
    [
        ("recupera_like_passive", "pointing", "no motor at shoulder_flexion"),
        ("recupera_like_dual", "pointing", "moves both arms"),
        ("recupera_like_7", "recorded", "four joints like the arm's"),
    ],
)
def test_machines_that_cannot_do_it_are_refused_before_anything_moves(name: str, movement, message: str):
    with pytest.raises(ConfigError, match=message):
        movement_for(movement, load_rig(name))


def test_motors_that_are_off_give_nothing():
    off = NoTorque(4)
    assert not off.step(STILL, STILL, Reference(STILL, STILL, STILL)).any()


def test_a_fading_controller_gives_its_share():
    class Two(NoTorque):
        def step(self, q, v, reference):
            return np.full(4, 2.0)

    fading = ScaledController(Two(4))
    fading.share = 0.25
    np.testing.assert_allclose(fading.step(STILL, STILL, Reference(STILL, STILL, STILL)), 0.5)


def test_only_the_two_that_need_a_yardstick_build_controllers_from_the_truth():
    source = Path(exograv.__file__).parent
    users = {
        path.relative_to(source).as_posix()
        for path in source.rglob("*.py")
        if "ideal_knowledge" in path.read_text(encoding="utf-8")
        for node in nodes_of(path)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.endswith("ideal_knowledge")
    }
    assert users == {"laboratory/transparency_trial.py", "campaigns/virtual_study/session_setup.py"}


def test_the_ideal_controller_leaves_nothing_over_but_what_its_model_has_not():
    from exograv.laboratory.truth_score import Examination

    laboratory = TransparencyTrial(load_rig("recupera_like"), 0, 1).laboratory()
    known = ideal_knowledge(laboratory, 0.0)
    score = Examination(laboratory, known.assembly, known.machine).score(known.x)
    assert score.total.max() < 0.02


@pytest.mark.slow
def test_the_weight_of_the_arm_costs_more_than_the_machine_that_carries_it():
    rig = load_rig("recupera_like_qdd")
    trial, movement = TransparencyTrial(rig, 1, 1000), replace(pointing(4, PERIOD), repeats=1, practice=(6, 6))
    known = ideal_knowledge(trial.laboratory(), 0.0)
    zero_g, dam_ideal, gcm = (
        float(_effort(trial, name, known, movement, lambda _share: None).absolute.sum())
        for name in ("zero_g", "dam_ideal", "gcm")
    )
    assert zero_g < dam_ideal < 0.7 * gcm
