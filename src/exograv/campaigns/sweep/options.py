"""Options of a sweep."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.errors import ConfigError
from exograv.options import Acts, Options, Within

if TYPE_CHECKING:
    from .runner import Runner


RUN = Acts(lambda all_: not all_.plan, "without --plan, which runs nothing")


@dataclass(frozen=True)
class SweepOptions(Options):
    """Options of the workers of `exograv dev sweep`."""

    workers: Annotated[int, Within(1, 1024), RUN] = 1
    """Number of processes of this computer."""

    scheduler: Annotated[str | None, RUN] = None
    """Address of a Dask scheduler whose workers run the tasks, such as tcp://10.0.0.5:8786."""

    part: Annotated[str | None, tyro.conf.arg(metavar="K/N"), RUN] = None
    """K-th of N shares, for independent jobs; run the command once without it afterwards, for the table."""

    def __post_init__(self):
        super().__post_init__()
        if self.scheduler is not None and self.workers != 1:
            raise ConfigError("--scheduler and --workers exclude each other: the cluster's workers run the tasks.")
        _ = self.share

    @property
    def share(self) -> tuple[int, int]:
        """Index and number of shares.

        Raises:
            ConfigError: `part` is not of the form K/N.
        """
        k, _, n = (self.part or "1/1").partition("/")
        if not (k.isdecimal() and n.isdecimal() and 1 <= int(k) <= int(n)):
            raise ConfigError(f"--part is '{self.part}'; allowed: K/N with K from 1 to N, such as 3/100.")
        return int(k) - 1, int(n)

    def runner(self) -> "Runner":
        """Return the runner of the tasks.

        Raises:
            ConfigError: The cluster does not exist or cannot be used.
        """
        if self.scheduler is not None:
            from .dask_runner import OnDask  # The module needs the extra `cluster`.

            return OnDask(self.scheduler)
        from .process_runner import OnProcesses
        from .runner import InThisProcess

        return InThisProcess() if self.workers == 1 else OnProcesses(self.workers)
