"""Pointing task without a machine or a screen: it takes times and touches, and returns judged touches."""

from typing import TYPE_CHECKING

from exograv.errors import ConfigError
from exograv.task.events import Event, Start, Tick, Touch
from exograv.task.picture import ParticipantPicture, participant_picture
from exograv.task.plan import TaskPlan
from exograv.task.protocol import first_windows, load_protocol
from exograv.task.records import Record, TouchRecord
from exograv.task.run import TaskRun

if TYPE_CHECKING:
    import pandas as pd

PAGE = "api"
"""Name of the page in the records of `PointingSession.touch`."""


class PointingSession:
    """Session of the pointing task; the caller owns screen and clock.

    Times are seconds on any clock that never goes back.
    """

    def __init__(self, protocol: str = "training", windows: int | None = None):
        """Load a protocol.

        Args:
            protocol: Name of a protocol (training, familiarisation, flight) or path of its TOML file.
            windows: Number of windows to run; all windows of the protocol if None.

        Raises:
            ConfigError: The protocol cannot be read, or has fewer windows.
        """
        loaded = load_protocol(protocol)
        if windows is not None:
            loaded = first_windows(loaded, windows)
        self._plan = TaskPlan(loaded, loaded.settings.exo)
        self._run = TaskRun(self._plan)
        self._t: float | None = None
        self._touches: list[TouchRecord] = []

    @property
    def duration_s(self) -> float:
        """Planned length of the session, rests included [s]."""
        return self._plan.timeline.duration_s

    def start(self, t: float = 0.0) -> None:
        """Begin the first rest at `t` [s]."""
        self._feed(t, Start(t=t))

    def advance(self, t: float) -> tuple[Record, ...]:
        """Advance the clock to `t` [s] and return the records until then: windows that opened or closed, the pace."""
        return self._feed(t, Tick(t=t))

    def touch(self, t: float, dx_px: float, dy_px: float) -> TouchRecord:
        """Judge a touch at `t` [s] that lies this far from the centre of the target: right and down [px].

        Raises:
            ConfigError: The session was not started, or `t` lies before an earlier time.
        """
        event = Touch(
            t=t, received=t, page=PAGE, sequence=len(self._touches), x_px=dx_px, y_px=dy_px,
            target_x_px=0.0, target_y_px=0.0,
        )  # fmt: skip
        return next(record for record in self._feed(t, event) if isinstance(record, TouchRecord))

    @property
    def picture(self) -> ParticipantPicture:
        """Content of the participant's page at the present time: screen, target, feedback on the speed, countdown."""
        return participant_picture(self._plan, self._run.state, 0.0 if self._t is None else self._t)

    @property
    def is_over(self) -> bool:
        """True if all windows are complete and the time after the last one has passed."""
        return self._t is not None and self._run.is_over(self._t)

    def to_pandas(self) -> "pd.DataFrame":
        """Return all touches, one row each: window, deviation [px], pace, and the reason of a rejected one."""
        import pandas as pd

        columns = [name for name in TouchRecord.model_fields if name not in ("kind", "page", "received")]
        return pd.DataFrame([touch.model_dump(mode="json") for touch in self._touches], columns=columns)

    def _feed(self, t: float, event: Event) -> tuple[Record, ...]:
        if self._t is None and not isinstance(event, Start):
            raise ConfigError("The session was not started. Call start() first.")
        if self._t is not None and t < self._t:
            raise ConfigError(f"t is {t} s and lies before {self._t} s; times must not go back.")
        self._t = t
        records = self._run.feed(event)
        self._touches += [record for record in records if isinstance(record, TouchRecord)]
        return records
