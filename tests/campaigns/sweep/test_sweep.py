"""A sweep gives the same table on any workers, keeps finished tasks, and reports failures."""

from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from exograv.campaigns.sweep.kinds import KINDS
from exograv.campaigns.sweep.options import SweepOptions
from exograv.campaigns.sweep.plan import plan
from exograv.campaigns.sweep.process_runner import OnProcesses
from exograv.campaigns.sweep.store import Store
from exograv.campaigns.sweep.study_file import Study, load_study
from exograv.campaigns.sweep.sweep_command import SweepResult, run_sweep
from exograv.errors import ConfigError, RecordingError
from exograv.loop.replay_log import versions

ROOT = Path(__file__).parents[3]

StudyOf = Callable[..., Study]


def silent(_text: str, _share: float) -> None:
    """Ignore progress."""


def table_of(result: SweepResult) -> bytes:
    assert result.table is not None
    return result.table.read_bytes()


def test_a_task_that_fails_by_itself_is_a_row_with_its_error_and_is_not_tried_again(study_of: StudyOf, tmp_path: Path):
    study = study_of(count=5, seconds=0.0, batch=3, fail=[1])
    first = run_sweep(study, SweepOptions(), tmp_path, silent)
    again = run_sweep(study, SweepOptions(), tmp_path, silent)
    assert (first.tasks, first.done, first.failed, first.retried, first.ran) == (5, 4, 1, 0, 5)
    assert (again.done, again.failed, again.ran) == (4, 1, 0)
    rows = pq.read_table(first.table).to_pylist()
    assert [row["outcome"] for row in rows] == ["done", "failed", "done", "done", "done"]
    assert rows[1]["error"] == "ValueError: task 1 was told to fail"


def test_a_sweep_that_was_stopped_goes_on_and_ends_with_the_same_bytes(study_of: StudyOf, tmp_path: Path):
    study, seen = study_of(count=6, seconds=0.0), []

    def stop(text: str, _share: float) -> None:
        seen.append(text)
        if len(seen) == 3:
            raise KeyboardInterrupt

    whole = run_sweep(study, SweepOptions(), tmp_path / "whole", silent)
    stopped = run_sweep(study, SweepOptions(), tmp_path / "stopped", stop)
    assert (stopped.interrupted, stopped.done) == (True, 3)
    rest = run_sweep(study, SweepOptions(), tmp_path / "stopped", silent)
    assert (rest.ran, rest.done) == (3, 6)
    assert table_of(rest) == table_of(whole)


def test_a_task_in_two_parts_counts_once(study_of: StudyOf, tmp_path: Path):
    study = study_of(count=3, seconds=0.0)
    whole = run_sweep(study, SweepOptions(), tmp_path, silent)
    part = next((tmp_path / "sweep_parts" / "probe").glob("*.parquet"))
    part.with_name("twice.parquet").write_bytes(part.read_bytes())
    before = table_of(whole)
    again = run_sweep(study, SweepOptions(), tmp_path, silent)
    assert (again.ran, table_of(again)) == (0, before)


def test_shares_of_a_sweep_make_one_table(study_of: StudyOf, tmp_path: Path):
    study = study_of(count=8, seconds=0.0)
    shares = [run_sweep(study, SweepOptions(part=f"{k}/3"), tmp_path / "shares", silent) for k in (1, 2, 3)]
    assert sum(share.ran for share in shares) == 8
    joined = run_sweep(study, SweepOptions(), tmp_path / "shares", silent)
    assert joined.ran == 0
    assert table_of(joined) == table_of(run_sweep(study, SweepOptions(), tmp_path / "whole", silent))


def test_the_order_of_other_tasks_changes_neither_key_nor_seed(study_of: StudyOf):
    few, many = ([task for b in study_of(count=n, seconds=0.0).batches() for task in b.tasks] for n in (3, 9))
    assert [(task.key, task.seed) for task in few] == [(task.key, task.seed) for task in many[:3]]
    assert len({task.seed for task in many}) == 9


def test_rows_of_another_exograv_are_refused(study_of: StudyOf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    study = study_of(count=1, seconds=0.0)
    run_sweep(study, SweepOptions(), tmp_path, silent)
    other = {**versions(), "code": "another"}
    monkeypatch.setattr("exograv.campaigns.sweep.store.versions", lambda: other)
    with pytest.raises(RecordingError, match="another state of exograv"):
        Store(tmp_path, study.kind)


@pytest.mark.parametrize(
    ("kind", "grid", "told"),
    [
        ("magic", {}, "kind is 'magic'; allowed"),
        ("probe", {"count": 0}, "count"),
        ("probe", {"count": 1, "colour": 3}, "colour"),
        ("identify", {"first_seed": 1000, "wearers": 1, "without": ["magic"]}, "no disturbance 'magic'"),
        ("identify", {"first_seed": 1000, "wearers": 1, "methods": ["magic"]}, "methods"),
        ("identify", {"first_seed": 1000, "wearers": 90_000_000}, "Divide it"),
        ("identify", {"first_seed": 1000, "wearers": 1, "levels": [2, 2]}, "levels has a value twice"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_by_its_mistake(study_of: StudyOf, kind: str, grid: dict, told: str):
    with pytest.raises(ConfigError, match=told):
        study_of(kind, **grid)


@pytest.mark.parametrize("path", sorted((ROOT / "examples" / "sweeps").glob("*.toml")), ids=lambda path: path.stem)
def test_an_example_can_be_used(path: Path):
    study = load_study(path)
    assert len(next(study.batches()).tasks) <= len(study.grid)


def test_the_file_on_the_page_can_be_used(tmp_path: Path):
    page = (ROOT / "docs" / "howto" / "sweep.md").read_text(encoding="utf-8")
    (tmp_path / "STUDY.toml").write_text(page.split("```toml\n")[1].split("```")[0])
    assert len(load_study(tmp_path / "STUDY.toml").grid) == 6 * 2 * 2 * 2


def test_every_kind_of_task_stands_on_the_page_with_its_keys():
    page = (ROOT / "docs" / "howto" / "sweep.md").read_text(encoding="utf-8")
    for kind in KINDS.values():
        assert f"| `{kind.name}` |" in page
        assert all(f"`{name}`" in page for name in kind.grid.model_fields)


def test_a_grid_has_as_many_tasks_as_it_says_and_each_once(study_of: StudyOf):
    study = study_of(
        "identify",
        first_seed=1000,
        wearers=14,
        rigs=["recupera_like", "recupera_like_qdd"],
        machine_seeds=[7, 8],
        without=["slow_bias"],
        methods=["recursive", "gradient"],
    )
    tasks = [task for batch in study.batches() for task in batch.tasks]
    assert len(study.grid) == len(tasks) == len({task.key for task in tasks}) == 14 * 2 * 2 * 2 * 2
    assert {task.settings.profile for task in tasks} == {"harmonic", "qdd"}


def test_tasks_of_a_batch_share_one_machine(study_of: StudyOf):
    study = study_of("identify", first_seed=1000, wearers=7, levels=[1, 2], methods=["recursive", "rls"])
    for batch in study.batches():
        assert len({task.settings.case.machine_key for task in batch.tasks}) == 1


def test_a_plan_is_proportional_to_what_was_measured(study_of: StudyOf, tmp_path: Path):
    study = study_of(count=4, seconds=0.01)
    run_sweep(study, SweepOptions(), tmp_path, silent)
    rows = plan(study, tmp_path, [2, 100], 0.5).rows
    assert [row.wearers for row in rows] == [10**4, 10**6, 10**8]
    assert rows[1].price == pytest.approx(0.5 * rows[1].core_h)
    assert rows[2].hours["100"] == pytest.approx(100 * rows[1].hours["100"])


def test_a_plan_without_a_sweep_says_what_to_do(study_of: StudyOf, tmp_path: Path):
    with pytest.raises(RecordingError, match="Run `exograv dev sweep`"):
        plan(study_of(count=4), tmp_path, [1], None)


@pytest.mark.parametrize(
    "options", [{"workers": 0}, {"part": "4/3"}, {"part": "one"}, {"workers": 2, "scheduler": "a"}]
)
def test_options_that_cannot_be_used_are_refused(options: dict):
    with pytest.raises(ConfigError):
        SweepOptions(**options)


@pytest.mark.slow
def test_one_two_and_four_workers_make_the_same_bytes_of_real_wearers(study_of: StudyOf, tmp_path: Path):
    study = study_of("table", first_seed=1000, wearers=12, levels=[1, 2])
    tables = [table_of(run_sweep(study, SweepOptions(workers=n), tmp_path / str(n), silent)) for n in (1, 2, 4)]
    assert tables[0] == tables[1] == tables[2]


@pytest.mark.slow
def test_a_task_that_takes_its_workers_down_is_given_up_and_the_others_are_done(study_of: StudyOf, tmp_path: Path):
    study = study_of(count=6, seconds=0.0, batch=3, die=[1])
    result = run_sweep(study, SweepOptions(workers=2), tmp_path, silent)
    assert (result.done, result.failed, result.lost) == (5, 1, 1)
    assert 1 <= result.retried <= 4


@pytest.mark.slow
def test_a_process_that_is_killed_loses_nothing(study_of: StudyOf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    study, runner = study_of(count=30, seconds=0.1, batch=5), OnProcesses(3)
    monkeypatch.setattr(SweepOptions, "runner", lambda _self: runner)
    struck = []

    def strike(_text: str, share: float) -> None:
        busy = runner.pool.busy
        if share > 0.2 and busy and not struck:
            struck.append(busy[0].pid)
            busy[0].kill()

    result = run_sweep(study, SweepOptions(), tmp_path / "struck", strike)
    assert struck
    assert (result.done, result.failed) == (30, 0)
    assert result.retried >= 1
    monkeypatch.undo()
    assert table_of(result) == table_of(run_sweep(study, SweepOptions(), tmp_path / "whole", silent))
