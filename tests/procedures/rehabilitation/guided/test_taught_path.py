"""File of a taught path: it is read as it was written, only for its machine and its person."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from exograv import motion
from exograv.errors import ConfigError
from exograv.model.description import load_rig
from exograv.procedures.rehabilitation.guided.path_shaping import PERIOD_S, ShapedPath
from exograv.procedures.rehabilitation.guided.taught_path import make_taught_path, read_taught, write_taught

RIG = load_rig("recupera_like_qdd")
CODE = "K7MR4XX"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    start, goal = RIG.donning_posture, RIG.donning_posture + 0.2
    q = np.vstack([start, motion.go_to(start, goal, 0.3, PERIOD_S).q, goal])
    path = tmp_path / "path.toml"
    write_taught(path, make_taught_path(ShapedPath(q, 1.0), RIG, CODE, datetime(2026, 1, 1, tzinfo=UTC), True))
    return path


def test_a_path_comes_back(file: Path):
    path = read_taught(file, RIG, CODE).trajectory(0.001)
    assert path.q[0] == pytest.approx(RIG.donning_posture, abs=1e-5)
    assert path.q[-1] == pytest.approx(RIG.donning_posture + 0.2, abs=1e-5)


def test_an_edited_path_is_refused(file: Path):
    file.write_text(file.read_text().replace("stretched = 1.0", "stretched = 2.0"))
    with pytest.raises(ConfigError, match="damaged or edited"):
        read_taught(file, RIG, CODE)


def test_another_side_is_refused(file: Path):
    with pytest.raises(ConfigError, match="was taught on recupera_like_qdd"):
        read_taught(file, load_rig("recupera_like_qdd", "left"), CODE)


def test_a_machine_that_was_changed_is_refused(file: Path):
    changed = replace(RIG)
    changed.__dict__["sha256"] = "0" * 64
    with pytest.raises(ConfigError, match="was changed since"):
        read_taught(file, changed, CODE)


def test_somebody_elses_path_is_refused_without_saying_whose(file: Path):
    with pytest.raises(ConfigError, match="belongs to another person") as refused:
        read_taught(file, RIG, "C3AA3CA")
    assert CODE not in str(refused.value)


def test_a_path_of_somebody_is_not_repeated_with_nobody_in_particular(file: Path):
    with pytest.raises(ConfigError, match="--code") as refused:
        read_taught(file, RIG, None)
    assert CODE not in str(refused.value)


def sealed_with(file: Path, q: np.ndarray) -> None:
    """Write a correctly sealed file with these postures."""
    write_taught(file, make_taught_path(ShapedPath(q, 1.0), RIG, CODE, datetime(2026, 1, 1, tzinfo=UTC), True))


def test_a_path_outside_is_refused_however_well_it_is_sealed(file: Path):
    q = np.tile(RIG.donning_posture, (100, 1))
    q[:, 1] += np.linspace(0.0, 2.0, 100)
    sealed_with(file, q)
    with pytest.raises(ConfigError, match="shoulder_abduction reaches"):
        read_taught(file, RIG, CODE)


def test_a_path_that_jumps_is_refused_however_well_it_is_sealed(file: Path):
    q = np.tile(RIG.donning_posture, (100, 1))
    q[50:, 0] += 0.3
    sealed_with(file, q)
    with pytest.raises(ConfigError, match=r"shoulder_flexion would move with .* allowed: 1\.00"):
        read_taught(file, RIG, CODE)


def test_a_path_of_no_numbers_is_refused(file: Path):
    file.write_text(file.read_text().replace("q_rad = [[", "q_rad = [[nan, nan, nan, nan], [", 1))
    with pytest.raises(ConfigError, match=r"is damaged: q_rad.*finite"):
        read_taught(file, RIG, CODE)


@pytest.mark.parametrize("content", ["", "q_rad = [[", "schema_version = 1", "schema_version = 2"])
def test_what_is_no_path_is_refused_with_what_to_do(file: Path, content: str):
    file.write_text(content)
    with pytest.raises(ConfigError, match="Teach the path again"):
        read_taught(file, RIG, CODE)


def test_a_path_that_is_not_there_is_refused_with_what_to_do(file: Path):
    with pytest.raises(ConfigError, match="Give the file that `exograv run teach` wrote"):
        read_taught(file.with_name("other.toml"), RIG, CODE)
