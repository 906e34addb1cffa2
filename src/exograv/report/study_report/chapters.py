"""Chapters of the report in their order. A chapter without content is left out."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from exograv.report.study_figures import deviation, effects, gravity, learning, power, quality, target, windows
from exograv.report.style.page import Block, Bullets, Chapter, Table, Text, drawn
from exograv.study.folder.study_folder import UNFINISHED
from exograv.study.measures.emg_effort import MuscleEffort
from exograv.study.measures.study_data import StudyData
from exograv.study.power.curve import PowerResult
from exograv.study.statistics.findings import StudyFindings

from .effort import effort_blocks
from .exclusions import exclusions
from .methods import methods, provenance
from .quality import Issue
from .results import effect_rows, family_of, family_rows, measures_table, people_table, test_rows

FIGURES = (
    ("deviation", "Deviation by group", deviation),
    ("target", "Where the fingers landed", target),
    ("windows", "The course of a session", windows),
    ("learning", "From session to session", learning),
    ("gravity", "Around the opening of a window", gravity),
    ("sessions", "Sessions", quality),
)
"""Name, title, and the module that draws and explains the figure."""

NO_FLAW = (
    "All expected sessions exist and are complete, on calibrated screens, without stops, lost ticks or clock jumps."
)
LIMITS = (
    "The hand's position in a recording is stored 20 times a second: times of the hand are accurate to 50 ms, and "
    "nothing above 10 Hz is visible. Smoothness of the joints is computed from 1000 ticks a second, below 10 Hz.",
    "Touches are timed by the screen; the screen's delay after the contact is not known here.",
    "Heart beats and EEG are not analysed; their streams are stored on the same clock.",
)
SEALED_LIMIT = (
    "Groups are sealed. If the groups have different protocols, the sheet of sessions reveals the groups: a seal "
    "protects only groups with the same protocol."
)


@dataclass(frozen=True)
class Content:
    """Content of the study report, from which each chapter takes its part."""

    data: StudyData
    found: StudyFindings | None
    """Findings; None if there is nothing to compare."""

    why_not: str
    """Reason for no comparison; empty if there is a comparison."""

    issues: Sequence[Issue]
    unpublished: Mapping[str, Sequence[str]]
    planned: PowerResult | None = None
    """Power of a next study; None if the variation between people cannot be estimated."""

    effort: MuscleEffort | None = None
    """Effort of the muscles; None if no session has EMG."""

    is_unfinished: bool = False
    """True if the command that makes this study has not come to its end."""


def figures(content: Content) -> Iterator[Chapter]:
    """Yield the chapters with a figure: effects after the first, power last. Call this function in house style."""
    data, found, planned = content.data, content.found, content.planned
    yield from drawn(FIGURES[:1], data)
    if found is not None and (figure := effects.draw(data, found)) is not None:
        yield Chapter("Difference between the groups", (), "effects", figure, effects.explain(found))
    yield from drawn(FIGURES[1:], data)
    if planned is not None:
        title = "Number of people for a next study"
        yield Chapter(title, (), "power", power.draw(planned, data.is_simulated), power.explain(planned))


def findings(content: Content) -> Iterator[Chapter]:
    """Yield the result of the study as sentences, before any figure."""
    if found := content.found:
        said = [Text(found.primary.sentence, "strong"), found.effect.meaning, Bullets(found.limits)]
        yield Chapter("Conclusions and their limits", said)


def notices(content: Content) -> Iterator[Block]:
    """Yield the warnings before the first chapter."""
    if content.is_unfinished:
        yield Text(UNFINISHED, "notice")
    if content.why_not:
        yield Text(content.why_not, "notice")
    if n := len(content.issues):
        flaws = Markup('The data have flaws of {} {}: see <a href="#quality">data quality</a>.')
        yield Text(flaws.format(n, "kind" if n == 1 else "kinds"), "notice")


def texts(content: Content) -> Iterator[Chapter]:
    """Yield the chapters after the figures: tables, quality of the data, methods and limits."""
    data, found = content.data, content.found
    if not data.touches.empty:
        note = Text(f"Accepted touches, {data.compared_words}.")
        yield Chapter("Results of each person", [note, people_table(data)], "people")
    if found is not None:
        yield Chapter("Comparison of the groups, primary test first", list(_comparison(found)), "comparison")
    if not data.touches.empty:
        yield Chapter("All measures", list(_measures(data, found)), "measures")
    if content.effort is not None:
        yield Chapter("Effort of the muscles, from EMG", list(effort_blocks(content.effort, data)), "effort")
    rows = [(one.what, str(one.count), one.which, one.consequence) for one in content.issues]
    quality_of = Table(("flaw", "number", "places", "consequence"), rows) if rows else NO_FLAW
    yield Chapter("Data quality", [quality_of], "quality")
    yield Chapter("Touches that are left out", list(_exclusions(data, found)), "exclusions")
    yield Chapter("Methods", methods(data, content.unpublished, () if found is None else found.methods), "methods")
    sealed = (SEALED_LIMIT,) if data.is_sealed else ()
    yield Chapter("Limits", [Bullets((*LIMITS, *sealed, "Research software, not a medical device."))], "limits")
    if made_by := provenance(data):
        table = Table(("item", "version or SHA-256", "sessions"), made_by)
        yield Chapter("Software and files of the sessions", [table], "provenance")


def _comparison(found: StudyFindings) -> Iterator[Block]:
    yield Table(("test", "p", "conclusion"), test_rows(found))
    yield Table(("effect", "value", "interval", "interpretation"), effect_rows(found))
    if found.mixed and found.mixed.remarks:
        yield Text(f"Mixed model: {' '.join(found.mixed.remarks)}")
    if found.bayes:
        yield Text(f"Hierarchical model: {found.bayes.sentence} {found.bayes.convention}")


def _measures(data: StudyData, found: StudyFindings | None) -> Iterator[Block]:
    yield Text(
        f"{data.compared_words.capitalize()}. Median over people, in brackets the smallest and largest value of a "
        "person. The table describes only: among so many measures some differ by chance."
    )
    yield measures_table(data)
    if found is not None and (family := family_of(data, found)) is not None:
        left_out = f" Left out: {' '.join(family.left_out)}" if family.left_out else ""
        yield Text("The measures of a session, tested as one family", "heading")
        yield Text(family.sentence + left_out)
        yield Table(("measure", "difference of means", "p", "Holm", "max-T"), family_rows(family))


def _exclusions(data: StudyData, found: StudyFindings | None) -> Iterator[Block]:
    yield f"{len(data.tables.touches)} touches were recorded, {len(data.touches)} of them are used."
    if rows := [(one.reason, str(one.touches), str(one.people)) for one in exclusions(data)]:
        yield Table(("reason", "touches", "people"), rows)
    if found is not None and found.left_out:
        yield f"Left out of the comparison: {' '.join(found.left_out)}"
