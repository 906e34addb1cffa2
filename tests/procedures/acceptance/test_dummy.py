"""The dummy's file gives masses, places and their errors, and the torque that they have in a machine."""

from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.identification.core.arm_model import ArmModel
from exograv.laboratory.dummy_arm import with_dummy
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.acceptance.dummy import LIMB, SHIPPED, load_dummy
from exograv.procedures.acceptance.known_torque import dummy_parameters, known_left_over
from exograv.rig.twin import Examiner, parameter_truth

RIG = "recupera_like"
POSTURES = 12


def changed(folder: Path, before: str, after: str) -> Path:
    text = SHIPPED.read_text(encoding="utf-8")
    assert before in text
    path = folder / "dummy.toml"
    path.write_text(text.replace(before, after, 1), encoding="utf-8")
    return path


def test_each_part_of_the_shipped_dummy_has_the_mass_of_its_material():
    steel, aluminium, plastic = 7850.0, 2700.0, 1300.0
    densities = {"tube": aluminium, "shell for the cuff": plastic}
    for part in load_dummy().settings.parts:
        volume = np.pi / 4e6 * (part.outer_mm**2 - part.inner_mm**2) * part.length_m
        if part.name == "tube" or part.name.endswith("disc"):
            assert part.mass_kg == pytest.approx(densities.get(part.name, steel) * volume, rel=0.01), part.name


def test_the_dummy_weighs_what_its_parts_weigh_and_its_hook_is_where_a_hand_holds_a_weight():
    dummy = load_dummy()
    for segment in LIMB:
        assert dummy.phi(segment)[0] == pytest.approx(sum(part.mass_kg for part in dummy.parts_of(segment)))
    arm = assemble(load_rig(RIG), dummy.body).arm
    hook = next(part for part in dummy.settings.parts if part.name == "hook")
    assert -arm.tree.frame("hand").p_body_frame[2] == pytest.approx(hook.at_m, abs=5e-4)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_torque_by_the_file_agrees_with_the_physics_engine_within_the_stated_errors(seed: int):
    laboratory = with_dummy(draw_laboratory(RIG, None, 2, seed), load_dummy(), seed)
    known = ideal_knowledge(laboratory, 1e4)
    assembly = assemble(laboratory.description, load_dummy().body)
    model = ArmModel(assembly, known.machine)
    x, covariance = dummy_parameters(load_dummy(), assembly)
    examiner = Examiner(laboratory.description, laboratory.machine, laboratory.wearer)
    seen = examiner.postures[:POSTURES] + laboratory.machine.sensors.encoder_offset
    torque, slopes = zip(*(model.at_rest(q, x) for q in seen), strict=True)
    sd = np.sqrt(np.mean([np.einsum("ji,ik,jk->j", J, covariance, J) for J in slopes], axis=0))
    true = np.array([examiner.lock_torque(q) for q in examiner.postures[:POSTURES]])
    assert (np.sqrt(np.mean((true - np.array(torque)) ** 2, axis=0)) < 3.0 * sd).all()


def test_a_file_with_a_mass_that_is_ten_percent_too_high_is_beyond_the_tolerance(tmp_path: Path):
    dummy = load_dummy()
    laboratory = with_dummy(draw_laboratory(RIG, None, 0, 0), dummy, 0)
    assembly = assemble(laboratory.description, dummy.body)
    model = ArmModel(assembly, ideal_knowledge(laboratory, 1e4).machine)
    carried, _ = dummy_parameters(dummy, assembly)
    postures = Examiner(laboratory.description, laboratory.machine, laboratory.wearer).postures[:POSTURES]
    right = known_left_over(model, carried, dummy, postures)
    assert (right.rms == 0.0).all()
    heavier = SHIPPED.read_text(encoding="utf-8")
    for part in dummy.parts_of("forearm"):
        old = f'segment = "forearm"\nmass_kg = {part.mass_kg:.3f}'
        assert old in heavier
        heavier = heavier.replace(old, f'segment = "forearm"\nmass_kg = {1.1 * part.mass_kg:.4f}', 1)
    (tmp_path / "heavier.toml").write_text(heavier, encoding="utf-8")
    wrong = known_left_over(model, carried, load_dummy(tmp_path / "heavier.toml"), postures)
    assert (wrong.rms > wrong.limits).any()


def test_the_simulated_dummy_has_no_muscles_and_no_elasticity_and_masses_within_the_errors():
    dummy = load_dummy()
    truth = parameter_truth(with_dummy(draw_laboratory(RIG, None, 4, 3), dummy, 3).wearer)
    assert all(value == 0.0 for name, value in truth.items() if name.endswith((".stiffness", ".spring_offset")))
    for segment in LIMB:
        allowed = 5.0 * np.sqrt(dummy.phi_covariance(segment)[0, 0])
        assert abs(truth[f"{segment}.mass"] - dummy.phi(segment)[0]) < allowed


@pytest.mark.parametrize(
    ("before", "after", "why"),
    [
        ("mass_kg = 0.601", "mass_kg = 601.0", "less than or equal to 20"),
        ("inner_mm = 34.0", "inner_mm = 44.0", "must be smaller than outer_mm"),
        ("upper_arm = 0.290", "upper_arm = 29.0", "less than or equal to 0.5"),
        ("height_m = 1.75", "height_m = 175", "cm or feet"),
        ("[bearings]", "[bearing]", "Copy"),
        ("schema_version = 1", "schema_version = ", "not valid TOML"),
    ],
)
def test_a_wrong_file_is_refused_with_its_place_and_an_advice(tmp_path: Path, before: str, after: str, why: str):
    with pytest.raises(ConfigError, match=why):
        load_dummy(changed(tmp_path, before, after))


def test_a_machine_that_moves_a_wrist_cannot_be_accepted_with_the_dummy():
    with pytest.raises(ConfigError, match="a shoulder and an elbow only"):
        load_dummy().form_for(load_rig("recupera_like_7"))


def test_a_dummy_too_long_for_the_machine_is_refused(tmp_path: Path):
    dummy = load_dummy(changed(tmp_path, "upper_arm = 0.290", "upper_arm = 0.390"))
    with pytest.raises(ConfigError, match=r"can be set from 0.2 to 0.37 m"):
        dummy.form_for(load_rig(RIG))
