"""Pages with headline, tiles, and chapters with figures and tables, written as HTML and as PDF."""

import io
import logging
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Literal

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure

from exograv.files import write_whole

from .figure_data import data_link, figure_csv
from .figure_style import inline_svg

SIMULATED = "SIMULATED: machine and wearer exist in a simulation only."
NO_EVIDENCE = "SIMULATED: nobody took part. This shows that the software works; it is no evidence about people."
CONTENTS = {"en": "Contents", "de": "Inhalt"}
CONTENTS_FROM = 5
"""Number of chapters from which a page has a table of contents."""
NO_PANGO = (
    "No PDF was written: WeasyPrint needs Pango, which is not installed ({error}). Install it (Debian: `apt install "
    "libpango-1.0-0 libpangoft2-1.0-0`), or print {page} from a browser."
)


@dataclass(frozen=True)
class Tile:
    """Important number of a page."""

    label: str
    value: str
    note: str = ""
    is_good: bool | None = None
    """True if the target is reached; None without a target."""


@dataclass(frozen=True)
class Text:
    """Paragraph with its own look."""

    text: str
    look: Literal["note", "strong", "notice", "heading"] = "note"


@dataclass(frozen=True)
class Bullets:
    """Sentences as a list."""

    sentences: Sequence[str]


@dataclass(frozen=True)
class Table:
    """Rows of text under column headings."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Folded:
    """Long text, such as a file, that a reader opens by a click; a print shows it."""

    summary: str
    content: str


Block = str | Text | Bullets | Table | Folded
"""Part of a chapter; a string is a paragraph. A string of type `Markup` is inserted as HTML."""


@dataclass(frozen=True)
class Chapter:
    """Chapter of a page: title, figure with its explanation, and blocks."""

    title: str
    blocks: Sequence[Block] = ()
    name: str = ""
    """Name of the figure's files, and anchor of the chapter on the page."""

    figure: Figure | None = None
    text: str = ""
    """Explanation of the figure."""


@dataclass(frozen=True)
class Page:
    """Content of a page: headline, facts, tiles and chapters."""

    headline: str
    chapters: Sequence[Chapter]
    simulated: str
    """Sentence on top of the page if the data are simulated, else empty. It has no default, so no page forgets it."""

    title: str = "exograv report"
    line: str = ""
    """Line above the headline: study, authors, licence."""

    facts: Sequence[tuple[str, str]] = ()
    """Names and values under the headline."""

    tiles: Sequence[Tile] = ()
    lead: Sequence[Block] = ()
    """Blocks between the tiles and the first chapter."""

    language: str = "en"
    mark: str = ""
    """Word after the title of each chapter."""

    letters: Literal["none", "path"] = "path"
    """Letters in figures: `path` for shapes, which need no font; `none` for text, which a reader can search."""

    @property
    def contents(self) -> str:
        """Title of the table of contents in the page's language; empty for a page that needs none."""
        titled = sum(bool(chapter.title) for chapter in self.chapters)
        return CONTENTS.get(self.language, CONTENTS["en"]) if titled >= CONTENTS_FROM else ""


def drawn(kinds: Iterable[tuple[str, str, ModuleType]], source: object) -> Iterator[Chapter]:
    """Yield the chapters, given by name, title and module, for whose figure `source` has the data.

    A module has `draw(source)`, which returns a figure or None, and `explain(source)`.
    """
    for name, title, kind in kinds:
        if (figure := kind.draw(source)) is not None:
            yield Chapter(title, (), name, figure, kind.explain(source))


def page_text(page: Page) -> str:
    """Render a page as HTML; the same page gives the same text."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("exograv.report.style", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

    def svg(chapter: Chapter) -> Markup:
        assert chapter.figure is not None
        return Markup(inline_svg(chapter.figure, chapter.name, page.letters))  # Matplotlib escapes texts.

    return environment.get_template("page.html.j2").render(
        page=page, svg=svg, csv=_csv, anchors=_anchors(page), contents=page.contents
    )


def _csv(chapter: Chapter) -> str:
    """Return a link that holds the data of a chapter's figure; empty if the figure has none."""
    text = figure_csv(chapter.figure) if chapter.figure is not None else ""
    return data_link(text) if text else ""


def _anchors(page: Page) -> list[str]:
    """Return one unique anchor for each chapter: its name, or one that is made from its title."""
    found = list[str]()
    for number, chapter in enumerate(page.chapters, start=1):
        slug = re.sub(r"[^a-z0-9]+", "-", chapter.title.lower()).strip("-")
        anchor = chapter.name or slug
        found.append(anchor if anchor and anchor not in found else f"chapter-{number}")
    return found


def write_page(path: Path, page: Page) -> Path:
    """Write a page, or replace it; its folder is created too.

    Raises:
        RecordingError: The page cannot be written.
    """
    write_whole(path, page_text(page))
    return path


def markdown_text(page: Page, pictures: Mapping[str, Path]) -> str:
    """Render a page as Markdown, with the given pictures, by their description, instead of figures."""
    blocks = [
        f"# {page.headline}",
        *([f"**{page.simulated}**"] if page.simulated else []),
        *map(_markdown, page.lead),
        *(f"![{shown}]({path.name})" for shown, path in pictures.items()),
    ]
    for chapter in page.chapters:
        blocks += [*([f"**{chapter.title}**"] if chapter.title else []), *map(_markdown, chapter.blocks)]
    return "\n\n".join(blocks) + "\n"


def _markdown(block: Block) -> str:
    if isinstance(block, Table):
        lines = (block.columns, ["---"] * len(block.columns), *block.rows)
        return "\n".join(f"| {' | '.join(line)} |" for line in lines)
    if isinstance(block, Bullets):
        return "\n".join(f"- {sentence}" for sentence in block.sentences)
    if isinstance(block, Folded):
        return f"{block.summary}:\n\n````\n{block.content}\n````"
    return block.text if isinstance(block, Text) else block


def write_pdf(html: Path) -> tuple[Path | None, str | None]:
    """Print a page to a PDF file beside the page.

    Returns:
        The PDF, or a sentence that says what is missing for a PDF.

    Raises:
        RecordingError: The folder cannot be written.
    """
    try:
        import weasyprint
    except OSError as error:  # raised if a library cannot be loaded
        return None, NO_PANGO.format(error=str(error).split("\n")[0], page=html.name)
    for name in ("weasyprint", "fontTools"):
        logging.getLogger(name).setLevel(logging.ERROR)
    printed = io.BytesIO()
    weasyprint.HTML(string=html.read_text(encoding="utf-8")).write_pdf(printed)
    write_whole(html.with_suffix(".pdf"), printed.getvalue())
    return html.with_suffix(".pdf"), None
