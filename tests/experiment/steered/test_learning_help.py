"""The advice names the joint that is farthest above its target, and another act while the machine moves the arm."""

from exograv.experiment.steered.learning_help import learning_help
from exograv.model.rig_settings import Place

JOINTS = ("shoulder_flexion", "elbow_flexion")
PLACES: tuple[Place, ...] = ("shoulder", "elbow")


def test_a_small_torque_at_the_elbow_is_farther_from_its_target_than_a_larger_one_at_the_shoulder():
    farthest, text = learning_help(JOINTS, PLACES, (0.25, 0.15), is_over=True)
    assert farthest == "elbow_flexion"
    assert "0.15 N·m, the target is 0.1 N·m" in text
    assert text.code == "learning.again"


def test_during_the_motion_the_person_is_asked_to_relax_and_within_all_targets_nothing_is_asked():
    assert learning_help(JOINTS, PLACES, (0.25, 0.15), is_over=False)[1].code == "learning.relax"
    assert learning_help(JOINTS, PLACES, (0.2, 0.1), is_over=False)[0] is None
