"""Fixtures of all tests of the rig: a machine, and the worlds around it."""

from collections.abc import Callable

import pytest

from exograv.model.description import RigDescription, load_rig
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer
from exograv.rig.twin.world.scene import Scene, build_scene


@pytest.fixture(scope="session")
def rig() -> RigDescription:
    return load_rig("recupera_like")


@pytest.fixture(scope="session")
def make_scene(rig: RigDescription) -> Callable[..., Scene]:
    def make(disturbances: Disturbances, seed: int = 0) -> Scene:
        return build_scene(rig, draw_machine(rig, disturbances, seed), draw_wearer(disturbances, seed))

    return make


@pytest.fixture(scope="session")
def make_twin(rig: RigDescription) -> Callable[..., Twin]:
    def make(disturbances: Disturbances, seed: int = 0, is_worn: bool = True, **options) -> Twin:
        wearer = draw_wearer(disturbances, seed) if is_worn else None
        return Twin(rig, draw_machine(rig, disturbances, seed), wearer, seed, **options)

    return make
