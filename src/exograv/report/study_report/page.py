"""The page itself: text and figures in one file that needs nothing beside it, and the same on paper."""

import io
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.figure import Figure

from exograv.files import write_whole
from exograv.report.study_figures import deviation
from exograv.report.study_figures.groups import DPI, JOURNAL, WIDTH_1
from exograv.report.style.figure_style import house_style, inline_svg
from exograv.report.style.templates import template
from exograv.study.measures.study_data import StudyData
from exograv.study.statistics.findings import StudyFindings

from .chapters import drawn
from .exclusions import exclusions
from .headline import headline, tiles
from .methods import methods, provenance
from .quality import Issue
from .results import effect_rows, family_of, family_rows, measures_table, people_table, test_rows

NO_PANGO = (
    "There is no PDF: WeasyPrint needs Pango, which is not installed ({error}). Install it (Debian: `apt install "
    "libpango-1.0-0 libpangoft2-1.0-0`), or print report.html from a browser."
)


@dataclass(frozen=True)
class Content:
    """All that the page says."""

    data: StudyData
    found: StudyFindings | None
    """None where there is nothing to compare."""

    why_not: str
    """Why not; empty where there is."""

    issues: Sequence[Issue]
    unpublished: dict[str, list[str]]
    planned: dict[str, Any] | None = None
    """Power of a next study; None where nobody's spread can be told."""


@dataclass(frozen=True)
class Written:
    """What was written."""

    html: Path
    pdf: Path | None
    figures: tuple[Path, ...]
    remark: str | None
    """Why there is no PDF."""


def write_page(folder: Path, content: Content) -> Written:
    """Figures as SVG and PNG, the page and its print.

    Raises:
        RecordingError: The folder cannot be written.
    """
    figures, chapters = list[Path](), []
    with house_style(), mpl.rc_context(JOURNAL):
        for chapter in drawn(content.data, content.found, content.planned):
            # On the page letters are shapes: fonts differ from reader to reader, and labels would be cut.
            svg = inline_svg(chapter.figure, chapter.name, letters="path")
            figures += write_figure(folder / "figures", chapter.name, chapter.figure)
            chapters.append({"name": chapter.name, "title": chapter.title, "text": chapter.text, "svg": Markup(svg)})
        narrow = deviation.draw(content.data, WIDTH_1)
        if narrow is not None:
            figures += write_figure(folder / "figures", "deviation_one_column", narrow)
    html = render(content, chapters)
    write_whole(folder / "report.html", html)
    pdf, remark = write_pdf(folder / "report.pdf", html)
    return Written(folder / "report.html", pdf, tuple(figures), remark)


def write_figure(folder: Path, name: str, figure: Figure) -> list[Path]:
    """As SVG and PNG.

    Raises:
        RecordingError: The folder cannot be written.
    """

    def png(path: Path) -> None:
        with path.open("wb") as file:
            figure.savefig(file, format="png", dpi=DPI, metadata={"Software": None})

    width, height = figure.get_size_inches()
    sized = inline_svg(figure, name).replace(
        "<svg ", f'<svg width="{25.4 * width:.1f}mm" height="{25.4 * height:.1f}mm" ', 1
    )
    write_whole(folder / f"{name}.svg", sized)
    write_whole(folder / f"{name}.png", png)
    return [folder / f"{name}.{kind}" for kind in ("svg", "png")]


def render(content: Content, chapters: Sequence[dict[str, Any]]) -> str:
    """The page as text; the same study gives the same text."""
    data, found = content.data, content.found
    family = None if found is None else family_of(data, found)
    return template("page.html.j2", "exograv.report.study_report").render(
        study=data.settings.name,
        authors=", ".join(data.settings.authors),
        licence=data.settings.licence,
        is_simulated=data.is_simulated,
        headline=headline(data, found),
        tiles=tiles(data, found),
        is_sealed=data.is_sealed,
        found=found,
        why_not=content.why_not,
        chapters=chapters,
        people=people_table(data) if not data.touches.empty else None,
        measures=measures_table(data) if not data.touches.empty else None,
        family=family,
        family_rows=[] if family is None else family_rows(family),
        compared=data.compared_words if not data.touches.empty else "",
        tests=test_rows(found) if found is not None else [],
        effects=effect_rows(found) if found is not None else [],
        exclusion_rows=[(one.reason, str(one.touches), str(one.people)) for one in exclusions(data)],
        recorded=len(data.tables.touches),
        counted=len(data.touches),
        issue_rows=[(one.what, str(one.count), one.which, one.consequence) for one in content.issues],
        methods=methods(data, content.unpublished, found.methods if found is not None else ()),
        provenance=provenance(data),
    )


def write_pdf(path: Path, html: str) -> tuple[Path | None, str | None]:
    """The page on paper, or a sentence that says what is missing for it.

    Raises:
        RecordingError: The folder cannot be written.
    """
    try:
        import weasyprint
    except OSError as error:  # a library that cannot be loaded
        return None, NO_PANGO.format(error=str(error).split("\n")[0])
    for name in ("weasyprint", "fontTools"):
        logging.getLogger(name).setLevel(logging.ERROR)
    printed = io.BytesIO()
    weasyprint.HTML(string=html).write_pdf(printed)
    write_whole(path, printed.getvalue())
    return path, None
