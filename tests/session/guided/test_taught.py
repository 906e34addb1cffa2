"""A taught path comes back as it was written, for the machine and the person it is of, and for nobody else."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.model.description import load_rig
from exograv.session.guided.shaping import Shaped
from exograv.session.guided.taught import read_taught, taught, write_taught

RIG = load_rig("recupera_like_qdd")
CODE = "K7MR4XX"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    q = np.linspace(RIG.donning_posture, RIG.donning_posture + 0.2, 50)
    path = tmp_path / "path.toml"
    write_taught(path, taught(Shaped(q, 1.0), RIG, CODE, datetime(2026, 1, 1, tzinfo=UTC), True))
    return path


def test_a_path_comes_back(file: Path):
    path = read_taught(file, RIG, CODE).trajectory(0.001)
    assert path.q[0] == pytest.approx(RIG.donning_posture, abs=1e-5)
    assert path.seconds == pytest.approx(49 * 0.04, abs=0.01)


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
    with pytest.raises(ConfigError, match="not of the person with this code") as refused:
        read_taught(file, RIG, "C3AA3CA")
    assert CODE not in str(refused.value)
