"""Several processes give the same results as one; a task that kills its process is reported, and no other is lost."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests.waiting import wait_until

from exograv.errors import ConfigError, RigError
from exograv.runtime.processes.process_pool import Arrived, LostTask, ProcessPool, in_order, results_of

TASKS = (3, 1, 2)
SOON_S = 30.0
LOST = "A process was lost."
PARENT = f"""
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background lets its children ignore it
sys.path.insert(0, {str(Path(__file__).parents[3])!r})
from tests.runtime.processes.test_process_pool import sleeps
from exograv.runtime.processes.process_pool import results_of
if __name__ == "__main__":
    for _, pid in results_of(sleeps, (1, 2), 2, print, "lost"):
        print(pid, flush=True)
"""


def counts(task: int, tell: Callable[[str], object]) -> Iterator[int]:
    for k in range(task):
        tell(f"{task}: {k}")
        yield 10 * task + k


def says_who(_task: int, _tell: object) -> Iterator[int]:
    yield os.getpid()


def sleeps(_task: int, _tell: object) -> Iterator[int]:
    yield os.getpid()
    time.sleep(600.0)


def strikes(task: int, _tell: object) -> Iterator[int]:
    yield task
    if task == 1:
        os.kill(os.getpid(), signal.SIGKILL)


def fails(task: int, _tell: object) -> Iterator[int]:
    yield task
    raise ConfigError("refused")


class UnpackableError(Exception):
    """Error that cannot be pickled: it takes two arguments, and stores one."""

    def __init__(self, one: int, two: int):
        super().__init__(f"{one} and {two}")


def fails_oddly(task: int, _tell: object) -> Iterator[int]:
    yield task
    raise UnpackableError(1, 2)


@pytest.mark.parametrize("processes", [1, 2, 4])
def test_results_do_not_depend_on_the_number_of_processes(processes: int):
    told = []
    results = list(results_of(counts, TASKS, processes, told.append, LOST))
    assert sorted(results) == [(0, 30), (0, 31), (0, 32), (1, 10), (2, 20), (2, 21)]
    assert [one for number, one in results if number == 0] == [30, 31, 32]  # results of one task in order
    assert sorted(told) == ["1: 0", "2: 0", "2: 1", "3: 0", "3: 1", "3: 2"]


def test_results_are_put_into_the_order_of_their_tasks():
    assert list(in_order([(2, "c"), (0, "a"), (1, "b")])) == ["a", "b", "c"]


def test_a_process_goes_on_with_the_next_run():
    with ProcessPool(1) as pool:
        first, second = (list(pool.results(says_who, (0,), LOST)) for _ in range(2))
    assert first == second != [(0, os.getpid())]


def test_a_task_that_kills_its_process_is_reported_and_may_be_tried_again():
    left = [2, 1, 1, 3]
    with ProcessPool(2) as pool:
        events = list(pool.run(strikes, lambda: left.pop(0) if left else None))
    assert [event.task for event in events if isinstance(event, LostTask)] == [1, 1]
    assert sorted(event.result for event in events if isinstance(event, Arrived)) == [1, 1, 2, 3]


def test_a_lost_task_raises_the_given_error():
    with pytest.raises(RigError, match=LOST):
        list(results_of(strikes, (1, 2), 2, print, LOST))


def test_an_error_of_a_task_is_raised_after_the_results():
    with ProcessPool(1) as pool:
        arriving = pool.results(fails, (1,), LOST)
        assert next(arriving) == (0, 1)
        with pytest.raises(ConfigError, match="refused") as raised:
            next(arriving)
    assert "test_process_pool.py" in raised.value.__notes__[0]


def test_an_error_that_cannot_be_pickled_arrives_as_text():
    with ProcessPool(1) as pool, pytest.raises(RuntimeError, match="UnpackableError: 1 and 2"):
        list(pool.results(fails_oddly, (1,), LOST))


def test_closing_ends_processes_in_the_middle_of_a_task():
    arriving = results_of(sleeps, (1, 2), 2, print, LOST)
    pids = [next(arriving)[1] for _ in range(2)]
    arriving.close()
    assert not any(_runs(pid) for pid in pids)


def test_a_closed_pool_leaves_no_descriptor_open():
    open_at_first = None
    for _ in range(3):  # the first one starts the resource tracker, which stays
        with ProcessPool(2) as pool:
            assert len(list(pool.results(says_who, (1, 2), LOST))) == 2
        count = len(os.listdir("/proc/self/fd"))
        assert open_at_first in (None, count)
        open_at_first = count


@pytest.mark.parametrize("strike", [signal.SIGINT, signal.SIGKILL])
def test_processes_end_with_their_parent(strike: signal.Signals, tmp_path: Path):
    script = tmp_path / "parent.py"
    script.write_text(PARENT, encoding="utf-8")
    command = [sys.executable, str(script)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as parent:
        assert parent.stdout is not None
        assert parent.stderr is not None
        pids = [int(parent.stdout.readline()) for _ in range(2)]
        if strike == signal.SIGINT:
            os.killpg(parent.pid, strike)  # as a terminal does
        else:
            parent.kill()
        words = parent.stderr.read()
    assert words.count("Traceback") == (1 if strike == signal.SIGINT else 0)  # the parent's own
    wait_until(lambda: not any(_runs(pid) for pid in pids), "the end of both", SOON_S)


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
