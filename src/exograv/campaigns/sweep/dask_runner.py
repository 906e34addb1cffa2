"""Runner on a Dask cluster. The scheduler sends batches to workers, and again when it loses a worker."""

import contextlib
import logging
from collections import Counter
from collections.abc import Generator
from dataclasses import replace
from secrets import token_hex
from typing import Any

from exograv.errors import ConfigError, RigError
from exograv.loop.replay_log import versions

from .runner import Event, FinishedBatch, LostBatch, RescheduledTasks, Take
from .task import Result, TaskBatch
from .work import place, same_versions, work_off

CONNECT_S = 10.0
WORKERS_S = 60.0
"""Time-out for the first worker of a cluster [s]."""

AHEAD = 2
"""Batches per worker that wait at the scheduler. The number is small, so that a million tasks need no memory there."""


class OnDask:
    """Workers of a running cluster, each with one task at a time."""

    name = "Dask"

    def __init__(self, address: str):
        """Connect to the scheduler.

        Raises:
            ConfigError: The package, the scheduler or the workers are missing, or the workers have another exograv.
        """
        try:
            import distributed
            from distributed.comm.addressing import get_address_host_port
        except ImportError as error:
            raise ConfigError(
                "--scheduler needs dask.distributed, which is not installed: pip install 'exograv[cluster]'."
            ) from error
        self._address, self._distributed = address, distributed
        # Dask's own messages are for the operator of the cluster; this class reports problems of the sweep itself.
        for name in ("distributed", "distributed.client", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            get_address_host_port(address)
            # With these arguments the client connects at once; Dask's types leave the return value open.
            self._client: Any = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise ConfigError(
                f"No scheduler answers at '{address}' ({error}). Start one with `dask scheduler`, and give the address "
                "that it prints, such as tcp://10.0.0.5:8786."
            ) from error
        try:
            self.workers = self._examined()
        except ConfigError:
            self._client.close()
            raise
        self._topic = f"exograv-sweep-{token_hex(8)}"
        self._starts: Counter[str] = Counter()

    def _examined(self) -> int:
        """Check the workers and return their number."""
        try:
            self._client.wait_for_workers(1, timeout=WORKERS_S)
        except TimeoutError as error:
            raise ConfigError(
                f"The scheduler at {self._address} has no worker. Start some: dask worker {self._address} --nthreads 1."
            ) from error
        threads = self._client.nthreads()
        if wide := [worker for worker, count in threads.items() if count != 1]:
            raise ConfigError(
                f"The worker {wide[0]} runs {threads[wide[0]]} tasks at a time in one process, where they would wait "
                "for each other. Start workers with --nthreads 1, and with --nworkers equal to the number of cores."
            )
        told_by = self._client.run(same_versions, versions(), on_error="return")
        for worker, told in told_by.items():
            # A worker that leaves now is handled by the scheduler; every worker checks its versions again at the start.
            if told is not None and not isinstance(told, OSError):
                raise ConfigError(f"{worker}: {told}. Put the same exograv and packages on all computers.")
        return len(threads)

    def run(self, take: Take) -> Generator[Event, None, None]:
        """Yield results, one batch at a time.

        Raises:
            RigError: The scheduler went away, or a worker with another exograv joined.
        """
        waiting: dict[Any, TaskBatch] = {}
        self._client.subscribe_topic(self._topic, self._started)
        try:
            arriving = self._distributed.as_completed(loop=self._client.loop)
            while True:
                while len(waiting) < self._room() and (batch := take()) is not None:
                    future = self._client.submit(
                        work_remotely, batch, versions(), self._topic, key=f"exograv-{batch.key}-{token_hex(4)}"
                    )
                    waiting[future] = batch
                    arriving.add(future)
                if not waiting:
                    return
                future = next(arriving)
                yield from self._came(future, waiting.pop(future))
        finally:
            with contextlib.suppress(OSError):  # Without a scheduler, nothing runs any more.
                self._client.cancel(list(waiting))
                self._client.close()

    def _room(self) -> int:
        try:
            return (AHEAD + 1) * max(1, len(self._client.nthreads()))
        except OSError as error:
            raise self._away() from error

    def _away(self) -> RigError:
        return RigError(f"The scheduler at {self._address} went away. {GO_ON}")

    def _came(self, future: Any, batch: TaskBatch) -> Generator[Event, None, None]:
        again = self._again(batch)
        if again:
            yield RescheduledTasks(again * len(batch.tasks))
        if future.status == "finished":
            yield FinishedBatch([replace(result, retries=again) for result in future.result()])
            return
        error = future.exception() if future.status == "error" else None
        if isinstance(error, self._distributed.KilledWorker):
            yield LostBatch(batch)
        elif error is None:
            raise self._away()
        else:
            raise RigError(f"A worker cannot run the tasks: {error}. {GO_ON}")

    def _again(self, batch: TaskBatch) -> int:
        """Count the restarts of a batch since it was submitted."""
        again = max(0, self._starts[batch.key] - 1)
        del self._starts[batch.key]
        return again

    def _started(self, event: tuple[float, Any]) -> None:
        self._starts[event[1]] += 1


GO_ON = "Finished tasks are kept. Repair the cluster and run the same command again to continue."


def work_remotely(batch: TaskBatch, expected: dict[str, str], topic: str) -> list[Result]:
    """Run a batch on a worker. The worker logs the start, so that starts can be counted.

    Raises:
        ConfigError: This worker has another exograv.
    """
    from distributed import get_worker

    if (told := same_versions(expected)) is not None:
        raise ConfigError(f"{told}; put the same exograv and packages on all computers")
    get_worker().log_event(topic, batch.key)
    return list(work_off(batch.tasks, place()))
