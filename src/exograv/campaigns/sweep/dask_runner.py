"""A cluster by Dask: its scheduler hands our batches to workers on any computers, and again when one is lost."""

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
"""So long a cluster may take to have its first worker [s]."""

AHEAD = 2
"""Batches a worker that wait at the scheduler: few enough that a million need no memory there."""


class OnDask:
    """Workers of a running cluster, one task each at a time."""

    name = "Dask"

    def __init__(self, address: str):
        """Connect.

        Raises:
            ConfigError: No such package or scheduler, no workers, or workers of another exograv.
        """
        try:
            import distributed
            from distributed.comm.addressing import get_address_host_port
        except ImportError as error:
            raise ConfigError(
                "--scheduler needs dask.distributed, which is not installed: pip install 'exograv[cluster]'."
            ) from error
        self._address, self._distributed = address, distributed
        # What it says of itself is for who operates the cluster; what concerns the sweep is said here, in a sentence.
        for name in ("distributed", "distributed.client", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            get_address_host_port(address)
            # A client that is told nothing else answers at once; its types leave that open.
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
        """Workers that are there, all of them fit."""
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
                "for each other. Start workers with --nthreads 1, and --nworkers for as many as it has cores."
            )
        told_by = self._client.run(same_versions, versions(), on_error="return")
        for worker, told in told_by.items():
            # A worker that goes this moment is the scheduler's affair; each says it again before it begins.
            if told is not None and not isinstance(told, OSError):
                raise ConfigError(f"{worker}: {told}. Put the same exograv and packages on all computers.")
        return len(threads)

    def run(self, take: Take) -> Generator[Event, None, None]:
        """Results a batch at a time.

        Raises:
            RigError: The scheduler went away, or a worker of another exograv came.
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
            with contextlib.suppress(OSError):  # where nobody is any more, nothing runs
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
            raise RigError(f"A worker cannot do the tasks: {error}. {GO_ON}")

    def _again(self, batch: TaskBatch) -> int:
        """How often a batch was begun anew since it was handed over."""
        again = max(0, self._starts[batch.key] - 1)
        del self._starts[batch.key]
        return again

    def _started(self, event: tuple[float, Any]) -> None:
        self._starts[event[1]] += 1


GO_ON = "What is done is kept; when the cluster is put right, the same command goes on."


def work_remotely(batch: TaskBatch, expected: dict[str, str], topic: str) -> list[Result]:
    """On a worker; it says when it begins, so that beginnings can be counted.

    Raises:
        ConfigError: This worker has another exograv.
    """
    from distributed import get_worker

    if (told := same_versions(expected)) is not None:
        raise ConfigError(f"{told}; put the same exograv and packages on all computers")
    get_worker().log_event(topic, batch.key)
    return list(work_off(batch.tasks, place()))
