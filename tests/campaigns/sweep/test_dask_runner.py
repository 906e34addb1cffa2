"""A killed worker of a real cluster loses no task, and unusable workers or schedulers are refused."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests.waiting import wait_until

from exograv.campaigns.sweep.options import SweepOptions
from exograv.campaigns.sweep.study_file import Study
from exograv.campaigns.sweep.sweep_command import run_sweep
from exograv.errors import ConfigError, RigError

pytest.importorskip("distributed")
pytestmark = pytest.mark.slow

StudyOf = Callable[..., Study]
START_S = 60.0


def silent(_text: str, _share: float) -> None:
    """Ignore progress."""


class Cluster:
    """Scheduler and workers, each in its own process."""

    def __init__(self, folder: Path):
        file = folder / "scheduler.json"
        self.scheduler = self._begin("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
        self.address: str = wait_until(lambda: _address(file), "the scheduler's address", START_S)
        self.workers: list[subprocess.Popen[bytes]] = []

    def hire(self, count: int, threads: int = 1) -> None:
        more = ("--nthreads", str(threads), "--no-nanny")
        self.workers += [self._begin("worker", self.address, *more) for _ in range(count)]

    def end(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()

    def _begin(self, what: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", "--no-dashboard", *options]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _address(file: Path) -> str:
    """Read the scheduler's address; empty while its file is not complete."""
    try:
        return json.loads(file.read_text())["address"]
    except (OSError, ValueError):
        return ""


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    one = Cluster(tmp_path)
    try:
        yield one
    finally:
        one.end()


def test_a_worker_that_is_killed_loses_nothing_and_the_table_is_the_same(
    study_of: StudyOf, tmp_path: Path, cluster: Cluster
):
    study, struck = study_of(count=150, seconds=0.2, batch=4, fail=[3]), []
    cluster.hire(3)

    def strike(_text: str, share: float) -> None:
        if share > 0.3 and not struck:
            struck.append(1)
            # A batch takes 0.8 s. After this time, however late the worker was, it has logged the start of a batch
            # and is still at work.
            time.sleep(0.3)
            cluster.workers[0].kill()

    result = run_sweep(study, SweepOptions(scheduler=cluster.address), tmp_path / "cluster", strike)
    assert struck
    assert (result.done, result.failed) == (149, 1)
    assert result.retried >= 1
    alone = run_sweep(study, SweepOptions(), tmp_path / "alone", silent)
    assert Path(str(result.table)).read_bytes() == Path(str(alone.table)).read_bytes()


def test_a_scheduler_that_goes_away_leaves_what_is_done(study_of: StudyOf, tmp_path: Path, cluster: Cluster):
    study = study_of(count=60, seconds=0.2)
    cluster.hire(1)

    def strike(_text: str, share: float) -> None:
        if share > 0.1:
            cluster.scheduler.kill()

    with pytest.raises(RigError, match="went away"):
        run_sweep(study, SweepOptions(scheduler=cluster.address), tmp_path, strike)
    assert 6 <= run_sweep(study, SweepOptions(), tmp_path, silent).before < 60


def test_workers_with_several_threads_are_refused(study_of: StudyOf, tmp_path: Path, cluster: Cluster):
    cluster.hire(1, threads=2)
    with pytest.raises(ConfigError, match="--nthreads 1"):
        run_sweep(study_of(count=1), SweepOptions(scheduler=cluster.address), tmp_path, silent)


def test_workers_of_another_exograv_are_refused(
    study_of: StudyOf, tmp_path: Path, cluster: Cluster, monkeypatch: pytest.MonkeyPatch
):
    from exograv.loop.replay_log import versions

    cluster.hire(1)
    monkeypatch.setattr("exograv.campaigns.sweep.dask_runner.versions", lambda: {**versions(), "code": "another"})
    with pytest.raises(ConfigError, match="in place of another"):
        run_sweep(study_of(count=1), SweepOptions(scheduler=cluster.address), tmp_path, silent)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense"])
def test_an_address_where_nobody_answers_is_refused(study_of: StudyOf, tmp_path: Path, address: str):
    with pytest.raises(ConfigError, match="No scheduler answers"):
        run_sweep(study_of(count=1), SweepOptions(scheduler=address), tmp_path, silent)
