"""Recordings become findings; runs on any laptop, without the model or the twin."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exograv.report.of_recording.recording_report import write_report as write_report
    from exograv.report.of_recording.summary import write_summary_picture as write_summary_picture

_ROOMS = {"write_report": ".report", "write_summary_picture": ".summary"}


def __getattr__(name: str) -> Any:
    """Drawing is imported by the first who draws: a session that asks for targets must not wait for Matplotlib."""
    if name not in _ROOMS:
        raise AttributeError(f"exograv.study has no {name}; it has {', '.join(_ROOMS)}.")
    return getattr(import_module(_ROOMS[name], __name__), name)
