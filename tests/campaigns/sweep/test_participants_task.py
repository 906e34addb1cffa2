"""A sweep over virtual participants flies each one in every condition, and refuses impossible conditions."""

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from exograv.campaigns.sweep.options import SweepOptions
from exograv.campaigns.sweep.participants_task import ParticipantsGrid
from exograv.campaigns.sweep.study_file import load_study
from exograv.campaigns.sweep.sweep_command import run_sweep
from exograv.errors import ConfigError

ROOT = Path(__file__).parents[3]


def test_every_person_is_in_every_condition_with_every_constant():
    grid = ParticipantsGrid(
        first_seed=1000, people=2, conditions=["familiarised", "dam"], sessions=[1, 4],
        constants={"width": [0.1, 1.0], "keeps_aim": [0.0, 0.5]},
    )  # fmt: skip
    tasks = [task for group in grid.groups() for task in group]
    assert len(tasks) == len(set(tasks)) == len(grid) == 2 * 2 * 2 * 4
    assert dict(tasks[-1].options.constants) == {"width": 1.0, "keeps_aim": 0.5}
    assert {task.seed for task in tasks} == {1000, 1001}


@pytest.mark.parametrize(
    ("grid", "named"),
    [
        ("conditions = ['swimming']", "swimming"),
        ("constants = {width = [0.0]}", "width"),
        ("constants = {shoe = [1.0]}", "shoe"),
        ("constants = {width = [0.1, 0.1]}", "twice"),
    ],
)
def test_what_nobody_can_be_is_refused_when_the_file_is_read(grid: str, named: str, tmp_path: Path):
    path = tmp_path / "study.toml"
    path.write_text(f'title = "x"\nkind = "participants"\n[grid]\nfirst_seed = 1000\npeople = 1\n{grid}\n')
    with pytest.raises(ConfigError, match=named):
        load_study(path)


def test_the_example_can_be_read():
    assert len(load_study(ROOT / "examples/sweeps/participants.toml").grid) == 3 * 2 * 3


@pytest.mark.slow
def test_a_trained_person_is_flown_as_in_a_study_and_twice_the_same(tmp_path: Path):
    path = tmp_path / "study.toml"
    path.write_text(
        'title = "x"\nkind = "participants"\n[grid]\nfirst_seed = 1001\npeople = 1\n'
        "conditions = ['familiarised', 'ideal']\nsessions = [1]\nwindows = 1\n"
    )
    tables = []
    for name in ("once", "again"):
        result = run_sweep(load_study(path), SweepOptions(), tmp_path / name, lambda _text, _share: None)
        assert (result.done, result.failed) == (2, 0)
        tables.append(Path(str(result.table)).read_bytes())
    assert tables[0] == tables[1]
    rows = pq.read_table(Path(str(result.table))).to_pylist()
    assert {row["left_over_Nm"] is None for row in rows} == {True, False}
    assert all(row["touches"] >= 4 for row in rows)
