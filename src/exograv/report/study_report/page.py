"""Report as one self-contained file with text and figures, and the same content as a PDF."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from exograv.report.study_figures import deviation
from exograv.report.study_figures.groups import WIDTH_1
from exograv.report.style.figure_style import JOURNAL, house_style, write_figure
from exograv.report.style.page import NO_EVIDENCE, Chapter, Page, write_page, write_pdf

from .chapters import Content, figures, findings, notices, texts
from .headline import headline, tiles


@dataclass(frozen=True)
class WrittenReport:
    """Files of a report."""

    html: Path
    pdf: Path | None
    figures: tuple[Path, ...]
    remark: str | None
    """Reason why there is no PDF."""


def write_study_page(folder: Path, content: Content) -> WrittenReport:
    """Write figures as SVG and PNG, the page and its PDF.

    Raises:
        RecordingError: The folder cannot be written.
    """
    with house_style(JOURNAL):
        chapters = list(figures(content))
        page = page_of(content, chapters)
        shown = [(chapter.name, chapter.figure) for chapter in chapters]
        shown.append(("deviation_one_column", deviation.draw(content.data, WIDTH_1)))
        files = [path for name, figure in shown if figure for path in write_figure(folder / "figures", name, figure)]
    html = write_page(folder / "report.html", page)
    pdf, remark = write_pdf(html)
    return WrittenReport(html, pdf, tuple(files), remark)


def page_of(content: Content, chapters: Sequence[Chapter]) -> Page:
    """Return the content of the page, with these chapters in its middle."""
    settings = content.data.settings
    return Page(
        headline=headline(content.data, content.found),
        title=settings.name,
        line=" · ".join(part for part in (settings.name, ", ".join(settings.authors), settings.licence) if part),
        simulated=NO_EVIDENCE if content.data.is_simulated else "",
        tiles=tiles(content.data, content.found),
        lead=list(notices(content)),
        chapters=[*findings(content), *chapters, *texts(content)],
    )
