"""Cuffs that leave a freedom of the arm unsupported are refused with its name; cuffs that hold all are accepted."""

from collections.abc import Mapping
from dataclasses import replace

import pytest

from exograv.errors import ModelError
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import Cuff, load_rig
from exograv.model.support import POSTURES, assemble, refuse_unsupported, sample_postures, unsupported_freedoms

POINT = {"about_limb_Nm_per_deg": 0.0, "about_others_Nm_per_deg": 0.0}
NOTHING = {**POINT, "along_N_per_mm": 0.0, "across_N_per_mm": 0.0}


def cuffs_of(assembly: Assembly, *kinds: Mapping[str, object] | None) -> Assembly:
    """Assembly with other kinds of cuffs; `None` removes a cuff."""
    chosen: list[Cuff] = [
        cuff.model_copy(update=kind) for cuff, kind in zip(assembly.cuffs, kinds, strict=True) if kind is not None
    ]
    return replace(assembly, cuffs=tuple(chosen))


# A point contact on the forearm has rank 3 of 4: the swivel about the line from the shoulder to the cuff is free
# (measured in the reference). It turns mainly the upper arm about its long axis.
def test_one_point_on_the_forearm_is_refused_with_the_freedom_it_leaves(assembly):
    single = cuffs_of(assembly, None, POINT)
    found = unsupported_freedoms(single)
    assert sum(found.values()) == POSTURES + 1
    with pytest.raises(ModelError, match=r"\(forearm\) leave the arm free in: .*rotation") as caught:
        refuse_unsupported(single)
    assert "Add a cuff" in str(caught.value)


def test_a_cuff_on_the_upper_arm_alone_leaves_the_elbow(assembly):
    assert unsupported_freedoms(cuffs_of(assembly, {}, None)) == {"elbow": POSTURES + 1}


def test_a_point_on_the_upper_arm_alone_leaves_its_rotation_and_the_elbow(assembly):
    assert set(unsupported_freedoms(cuffs_of(assembly, POINT, None))) == {"rotation", "elbow"}


@pytest.mark.parametrize(
    "kinds",
    [(POINT, POINT), (None, {}), ({}, {}), (NOTHING, {})],
    ids=["two points", "one weld", "two welds", "a loose cuff and a weld"],
)
def test_cuffs_of_full_rank_are_accepted(assembly, kinds: tuple[dict[str, float] | None, ...]):
    refuse_unsupported(cuffs_of(assembly, *kinds))


HINGE_ACROSS, SLIDE = {"free": ["about_y"]}, {"free": ["z"]}


# With a welded upper arm, the forearm's cuff may leave rotation about the elbow's axis, or the long axis, free.
@pytest.mark.parametrize("kind", [HINGE_ACROSS, SLIDE, {"free": ["z", "about_y"]}], ids=["hinge", "slide", "both"])
def test_a_hinge_or_a_slide_beside_a_weld_holds_the_arm(assembly, kind: dict[str, list[str]]):
    freed = cuffs_of(assembly, {}, kind)
    refuse_unsupported(freed)
    axes = ("x", "y", "z", "about_x", "about_y", "about_z")
    held = [axis for axis, k in zip(axes, freed.cuffs[1].stiffness, strict=True) if k > 0.0]
    assert held == [axis for axis in axes if axis not in kind["free"]]


def test_hinges_alone_leave_the_axis_that_they_share(assembly):
    along_the_limb = {"free": ["about_z", "x", "y", "z"]}
    assert "rotation" in unsupported_freedoms(cuffs_of(assembly, along_the_limb, None))


def test_the_donning_posture_is_among_the_sampled_ones(assembly):
    postures = sample_postures(assembly.description, POSTURES)
    assert postures.shape == (POSTURES + 1, 4)
    assert (postures[0] == assembly.description.donning_posture).all()


@pytest.mark.parametrize(("length", "fits"), [(0.20, True), (0.37, True), (0.19, False), (0.38, False)])
def test_a_wearer_whom_the_machine_cannot_be_set_to_is_refused(length: float, fits: bool):
    body = Body(1.75, 75.0, "male", {"upper_arm": length})
    if fits:
        assert assemble(load_rig("recupera_like"), body).exo.joints[3].p_parent_joint[2] == -length
    else:
        with pytest.raises(
            ModelError, match=rf"takes upper_arm lengths of 0\.2 to 0\.37 m; this wearer's is {length:.3f} m"
        ):
            assemble(load_rig("recupera_like"), body)


def test_the_heaviest_promised_wearer_fits():
    assemble(load_rig("recupera_like"), Body(1.90, 95.0, "male"))
