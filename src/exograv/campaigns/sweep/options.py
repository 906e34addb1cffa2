"""Options of a sweep."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import Options, Within

if TYPE_CHECKING:
    from .runner import Runner


@dataclass(frozen=True)
class SweepOptions(Options):
    """Options of the workers of `exograv sweep`."""

    workers: Annotated[int, Within(1, 1024)] = 1
    """Processes of this computer."""

    scheduler: str | None = None
    """Address of a Dask scheduler whose workers do the tasks, such as tcp://10.0.0.5:8786."""

    part: Annotated[str | None, tyro.conf.arg(metavar="K/N")] = None
    """The K-th of N shares, for jobs that know nothing of each other; without it afterwards, once, for the table."""

    def __post_init__(self):
        super().__post_init__()
        if self.scheduler is not None and self.workers != 1:
            raise ConfigError("--scheduler and --workers exclude each other: the cluster's workers do the tasks.")
        _ = self.share

    @property
    def share(self) -> tuple[int, int]:
        """Which one of how many.

        Raises:
            ConfigError: It is none.
        """
        k, _, n = (self.part or "1/1").partition("/")
        if not (k.isdecimal() and n.isdecimal() and 1 <= int(k) <= int(n)):
            raise ConfigError(f"--part is '{self.part}'; allowed: K/N with K from 1 to N, such as 3/100.")
        return int(k) - 1, int(n)

    def runner(self) -> "Runner":
        """Who does it.

        Raises:
            ConfigError: There is no such cluster, or it cannot be used.
        """
        if self.scheduler is not None:
            from .dask_runner import OnDask  # of the extra `cluster`

            return OnDask(self.scheduler)
        from .process_runner import OnProcesses
        from .runner import InThisProcess

        return InThisProcess() if self.workers == 1 else OnProcesses(self.workers)
