"""Short protocols, and a participant whose touches are numbers."""

from collections.abc import Iterable
from dataclasses import replace

from exograv.task.events import Event, Touch
from exograv.task.plan import TaskPlan
from exograv.task.protocol import load_protocol
from exograv.task.records import Record, TouchRecord
from exograv.task.run import TaskRun
from exograv.task.screen import ScreenCalibration

SCREEN = ScreenCalibration(pitch_x_mm=0.3, pitch_y_mm=0.3, method="card", anisotropy=0.0, relative_error=0.004)


def short_plan(
    name: str = "training", screen: ScreenCalibration | None = SCREEN, windows: int = 3, **pointing
) -> TaskPlan:
    """Protocol with few windows and rests of 20 s; the first window opens at 35 s (familiarisation and training)."""
    loaded = load_protocol(name)
    settings = loaded.settings
    settings = settings.model_copy(
        update={
            "windows": settings.windows.model_copy(update={"count": windows}),
            "rests": "short",
            "rest_tables": {"short": settings.rest_tables["cycle_180"].model_copy(update={"rest_s": 20.0})},
            "after_last_s": 10.0,
            "pointing": settings.pointing.model_copy(update=pointing),
        }
    )
    return TaskPlan(replace(loaded, settings=settings), settings.exo, screen)


def touch(t: float, sequence: int, late_s: float = 0.01, **changes) -> Touch:
    """Touch 3 px right of and 4 px below the target."""
    usual = {"x_px": 963.0, "y_px": 544.0, "target_x_px": 960.0, "target_y_px": 540.0, "page": "p"}
    return Touch.model_validate({"t": t, "received": t + late_s, "sequence": sequence, **usual, **changes})


def fed(run: TaskRun, events: Iterable[Event]) -> list[Record]:
    """Feed all events, and return all records."""
    return [record for event in events for record in run.feed(event)]


def judged(records: Iterable[Record]) -> list[TouchRecord]:
    """Touch records among the records."""
    return [record for record in records if isinstance(record, TouchRecord)]
