"""One self-contained page from one recording: nothing is computed again that the run has not recorded."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup
from matplotlib.figure import Figure

from exograv.errors import RecordingError
from exograv.recording import Recording, read_recording
from exograv.report.figures import (
    floating,
    left_over,
    parameters,
    postures,
    progress,
    sync,
    timing,
    torque,
    touches,
    weight,
)
from exograv.report.style.figure_style import house_style, inline_svg, joint_label
from exograv.report.style.tables import calibration_table, event_table, parameter_table, settings_table
from exograv.report.style.templates import template

from .headline import headline, run_facts, tiles


@dataclass(frozen=True)
class Chapter:
    """One figure of the report."""

    name: str
    title: str
    draw: Callable[[Recording], Figure | None]
    """None where the recording has no such data: the chapter is left out."""

    explain: Callable[[Recording], str]
    """What one sees, in plain words."""


CHAPTERS = (
    Chapter("touches", "Where the finger landed", touches.draw, touches.explain),
    Chapter("postures", "The arm in the machine", postures.draw, postures.explain),
    Chapter("left_over", "How much weight is left", left_over.draw, left_over.explain),
    Chapter("progress", "How quickly it was learned", progress.draw, progress.explain),
    Chapter("floating", "The arm let go", floating.draw, floating.explain),
    Chapter("weight", "A weight in the hand", weight.draw, weight.explain),
    Chapter("parameters", "What the machine knows about the arm", parameters.draw, parameters.explain),
    Chapter("torque", "Does the model explain the motors?", torque.draw, torque.explain),
    Chapter("devices", "Are other devices on the same clock?", sync.draw, sync.explain),
    Chapter("timing", "Did the controller keep up?", timing.draw, timing.explain),
)


def write_report(recording_path: Path, html_path: Path) -> Path:
    """Make the page of a recording.

    Args:
        recording_path: A recording, complete or cut.
        html_path: The page to write, or to replace; its folder is created too.

    Returns:
        `html_path`.

    Raises:
        RecordingError: The recording cannot be read, or the page cannot be written.
    """
    page = render(read_recording(recording_path))
    try:
        html_path.parent.mkdir(parents=True, exist_ok=True)
        html_path.write_text(page, encoding="utf-8")
    except OSError as error:
        raise RecordingError(
            f"The report {html_path} cannot be written: {error.strerror}. Give another folder with --out."
        ) from error
    return html_path


def render(recording: Recording) -> str:
    """The page as text; the same recording gives the same text."""
    tables = [
        parameter_table(recording), calibration_table(recording), event_table(recording), settings_table(recording)
    ]  # fmt: skip
    return template("report.html.j2", "exograv.report.of_recording").render(
        headline=headline(recording),
        facts=run_facts(recording),
        tiles=tiles(recording),
        remark=recording.remark,
        outcome=(recording.last("/result").get("identification") or {}).get("outcome"),
        chapters=_drawn(recording),
        tables=[table for table in tables if table.rows],
        joints=[joint_label(joint) for joint in recording.joints],
    )


def _drawn(recording: Recording) -> list[dict[str, str]]:
    drawn = []
    with house_style():
        for chapter in CHAPTERS:
            figure = chapter.draw(recording)
            if figure is not None:
                svg = Markup(inline_svg(figure, chapter.name))  # matplotlib escapes what stands in it
                text = chapter.explain(recording)
                drawn.append({"name": chapter.name, "title": chapter.title, "svg": svg, "text": text})
    return drawn
