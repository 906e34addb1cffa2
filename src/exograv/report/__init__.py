"""Pages, figures and tables made from recordings and studies."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .of_recording.recording_report import write_report as write_report
    from .of_recording.summary import write_summary_picture as write_summary_picture

_MODULES = {
    "write_report": "exograv.report.of_recording.recording_report",
    "write_summary_picture": "exograv.report.of_recording.summary",
}


def __getattr__(name: str) -> Any:
    """Import the drawing library only when something is drawn."""
    if name not in _MODULES:
        raise AttributeError(f"exograv.report has no {name}; it has {', '.join(_MODULES)}.")
    return getattr(import_module(_MODULES[name]), name)
