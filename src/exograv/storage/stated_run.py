"""Statement about a run at the present moment, by its checkpoint."""

from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.task.run_statement import RunStatement
from exograv.task.state import RunState

from .session_checkpoint import SESSION_FILE

RUN = "run"
"""Name of the run's random name in the conditions of a checkpoint (`KeptSession.before`)."""


@dataclass(frozen=True)
class StatedRun:
    """Run of a command, and the place of its checkpoint."""

    checkpoint: Path
    begun: RunStatement
    """Statement of a run that begins with this command."""

    def now(self) -> RunStatement:
        """Return the statement with the name of the run and its complete windows, by the checkpoint.

        The statement is that of a new run if there is no checkpoint, or none that can be read.
        """
        try:
            kept = SESSION_FILE.read(self.checkpoint)
            complete = tuple(sorted(RunState.model_validate_json(kept.run).complete))
        except (ConfigError, ValueError):
            return self.begun
        run = str(kept.before.get(RUN) or self.begun.run)
        return self.begun.model_copy(update={"run": run, "complete": complete})
