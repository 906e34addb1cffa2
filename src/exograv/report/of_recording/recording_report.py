"""Report of one recording as one self-contained page. The page shows only recorded results and recomputes none."""

from collections.abc import Iterator
from pathlib import Path

from markupsafe import Markup

from exograv.recording import Recording, open_recording
from exograv.report.figures import (
    floating,
    left_over,
    others,
    parameters,
    postures,
    progress,
    sync,
    timing,
    torque,
    touches,
    weight,
)
from exograv.report.style.figure_style import house_style
from exograv.report.style.page import SIMULATED, Block, Chapter, Page, Text, drawn, write_page

from .headline import headline, run_facts, tiles
from .tables import calibration_table, event_table, parameter_table, settings_table

FIGURES = (
    ("touches", "Where the finger landed", touches),
    ("postures", "The arm in the machine", postures),
    ("left_over", "How much weight is left over", left_over),
    ("others", "This run among other wearers", others),
    ("progress", "How quickly the arm was identified", progress),
    ("floating", "The released arm", floating),
    ("weight", "A weight in the hand", weight),
    ("parameters", "What the machine knows about the arm", parameters),
    ("torque", "Does the model explain the motors?", torque),
    ("devices", "Are other devices on the same clock?", sync),
    ("timing", "Did the controller keep up?", timing),
)
"""Name, title, and the module that draws and explains the figure."""

LEFT_OVER = Text(
    "Left over: the torque that the person would still have to add for the arm to be weightless. For comparison: the "
    "horizontal arm of a person of 75 kg loads the shoulder with about 11 N·m."
)
SAFETY = Chapter(
    "Safety",
    [
        Text(
            Markup(
                "<strong>Research software, not a medical device.</strong> It is informed by ISO 13482 and IEC "
                "80601-2-78, and complies with neither. A machine that is worn needs an independent hardware emergency "
                "stop and the watchdogs of its drives; nothing in this software replaces them. Results from the twin "
                "are valid for the twin only."
            ),
            "notice",
        )
    ],
)


def write_report(recording_path: Path, html_path: Path) -> Path:
    """Write the page of a recording.

    Args:
        recording_path: A recording, complete or truncated.
        html_path: The page to write, or to replace; its folder is created too.

    Returns:
        `html_path`.

    Raises:
        RecordingError: The recording cannot be read, or the page cannot be written.
    """
    return write_page(html_path, page_of(open_recording(recording_path)))


def page_of(recording: Recording) -> Page:
    """Return the content of the page; the same recording gives the same page."""
    tables = parameter_table, calibration_table, event_table, settings_table
    with house_style():
        figures = list(drawn(FIGURES, recording))
    return Page(
        headline=headline(recording),
        facts=run_facts(recording),
        tiles=tiles(recording),
        lead=list(_lead(recording)),
        chapters=[*figures, SAFETY, *(chapter for table in tables if (chapter := table(recording)) is not None)],
        letters="none",
        simulated=SIMULATED if recording.is_simulated else "",
    )


def _lead(recording: Recording) -> Iterator[Block]:
    if recording.remark:
        yield Text(recording.remark, "notice")
    told = recording.last("/result").get("identification") or {}
    if outcome := told.get("outcome"):
        verdict = " ".join(text for text in (outcome, told.get("why")) if text)
        yield Markup("<strong>The estimator says:</strong> {}").format(verdict)
    yield LEFT_OVER
    if text := (recording.last("/result").get("comparison") or {}).get("text"):
        yield text
