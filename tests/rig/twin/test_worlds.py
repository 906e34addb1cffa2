"""A world changes laws and no draw of the home world; each flies stably, the same in native code and in Python."""

from typing import get_args

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.options import Side, WorldName
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer, parameter_truth
from exograv.rig.twin.disturbances.levels import WORLDS
from exograv.signals import Command

SEED = 5
FOREIGN = [world for world in WORLDS if world != "home"]
PARTS = {
    **{part: {part} for part in ("tissue", "shoulder", "cuffs", "drives")},
    "all": {"tissue", "shoulder", "cuffs", "drives"},
    "unseen": {"tissue", "shoulder", "cuffs"},
    "bodies": set[str](),
}
"""Parts with foreign laws, by world."""


def test_every_world_that_can_be_chosen_is_described():
    assert get_args(WorldName) == tuple(WORLDS)


def run(twin: Twin, seconds: float) -> np.ndarray:
    """Measured positions while smooth currents and the drives' damping act."""
    rows, joints = [], len(twin.joints)
    for k in range(round(seconds / twin.period_s)):
        state = twin.read()
        rows.append(state.q)
        current = np.sin(0.005 * k + np.arange(joints))
        twin.write(Command(state.t, state.sequence, state.t + 0.1, np.zeros(joints), current, np.full(joints, 2.0)))
    return np.array(rows)


def twin_of(rig, world: WorldName, level: int = 2) -> Twin:
    disturbances = Disturbances.at_level(level, world)
    return Twin(rig, draw_machine(rig, disturbances, SEED), draw_wearer(disturbances, SEED), SEED)


@pytest.mark.parametrize("world", [world for world in FOREIGN if world != "bodies"])
def test_a_world_changes_no_draw_of_the_home_world(rig, world: WorldName):
    home, foreign = (Disturbances.at_level(3, name) for name in ("home", world))
    truths = [parameter_truth(draw_wearer(one, SEED)) for one in (home, foreign)]
    assert truths[1].items() <= truths[0].items()
    machines = [draw_machine(rig, one, SEED) for one in (home, foreign)]
    np.testing.assert_array_equal(machines[0].friction.coulomb, machines[1].friction.coulomb)
    np.testing.assert_array_equal(machines[0].drives.gain, machines[1].drives.gain)


@pytest.mark.parametrize("world", FOREIGN)
def test_only_the_parts_of_a_world_have_foreign_laws(rig, world: WorldName):
    disturbances = Disturbances.at_level(2, world)
    machine, wearer = draw_machine(rig, disturbances, SEED), draw_wearer(disturbances, SEED)
    found = {
        "tissue": wearer.passive.tissue is not None,
        "shoulder": wearer.shoulder_path is not None,
        "cuffs": wearer.cuffs.strained is not None,
        "drives": machine.foreign is not None,
    }
    assert {part for part, is_foreign in found.items() if is_foreign} == PARTS[world]
    assert bool(wearer.arms[0].soft_tissue) == (world in ("cuffs", "all"))


def test_the_unseen_world_has_no_law_of_another_world():
    other, unseen = (draw_wearer(Disturbances.at_level(2, world), SEED) for world in ("all", "unseen"))
    for name in ("tissue", "strained", "path"):
        laws = [
            {"tissue": one.passive.tissue, "strained": one.cuffs.strained, "path": one.shoulder_path}[name]
            for one in (other, unseen)
        ]
        assert type(laws[0]) is not type(laws[1])


@pytest.mark.parametrize(
    ("name", "side"), [("recupera_like", "left"), ("recupera_like_dual", "both"), ("recupera_like_7", None)]
)
@pytest.mark.parametrize("world", ["unseen", "bodies"])
def test_every_kind_of_arm_flies_calmly_in_the_new_worlds(world: WorldName, name: str, side: Side | None):
    laboratory = draw_laboratory(name, side, 2, SEED, world=world)
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, SEED)
    assert np.abs(np.diff(run(twin, 0.5), axis=0)).max() < 0.01


@pytest.mark.parametrize("world", FOREIGN)
@pytest.mark.parametrize("level", [0, 2, 4])
def test_a_foreign_world_flies_calmly_and_not_as_the_home_world(rig, world: WorldName, level: int):
    foreign = run(twin_of(rig, world, level), 0.5)
    assert np.abs(np.diff(foreign, axis=0)).max() < 0.01  # rad per tick: 10 rad/s
    if (world, level) != ("tissue", 0):  # joints without stiffness have no law of elasticity
        assert not np.array_equal(foreign, run(twin_of(rig, "home", level), 0.5))


@pytest.mark.parametrize("world", FOREIGN)
def test_the_same_seed_gives_the_same_run_in_a_world(rig, world: WorldName):
    np.testing.assert_array_equal(run(twin_of(rig, world), 0.2), run(twin_of(rig, world), 0.2))


def test_a_level_and_a_switch_keep_the_world():
    assert Disturbances.at_level(2, "all").without("coulomb").with_row("bursts", 4).world == "all"


def test_a_world_that_does_not_exist_is_refused_with_the_names_of_all():
    with pytest.raises(
        ConfigError, match=r"No world 'mars'\. Worlds: home, tissue, shoulder, cuffs, drives, all, unseen, bodies\."
    ):
        Disturbances.at_level(2, "mars")
