"""The chapters of the report in their order, each where there is something to say."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from exograv.report.study_figures import deviation, effects, gravity, learning, power, quality, target, windows
from exograv.report.style.page import Block, Bullets, Chapter, Table, Text, drawn
from exograv.study.measures.study_data import StudyData
from exograv.study.power.curve import PowerResult
from exograv.study.statistics.findings import StudyFindings

from .exclusions import exclusions
from .methods import methods, provenance
from .quality import Issue
from .results import effect_rows, family_of, family_rows, measures_table, people_table, test_rows

FIGURES = (
    ("deviation", "Deviation by group", deviation),
    ("target", "Where the fingers landed", target),
    ("windows", "The course of a session", windows),
    ("learning", "From session to session", learning),
    ("gravity", "About the opening of a window", gravity),
    ("sessions", "Which sessions there are", quality),
)
"""Name, title, and the module that draws and explains."""

NO_FLAW = (
    "Every expected session is there and complete, on calibrated screens, without stops, losses or jumps of a clock."
)
LIMITS = (
    "The end of the arm's line in a recording is drawn 20 times a second: times of the hand are good to 50 ms, and "
    "nothing above 10 Hz is seen. Smoothness of the joints is told from 1000 ticks a second, of what is below 10 Hz.",
    "Touches are timed by the screen; what it adds to the time of the contact is not known here.",
    "Heart beats, EMG and EEG are not analysed: their streams are kept, on the same clock.",
)
SEALED_LIMIT = (
    "Groups are sealed. Where the groups have different protocols, the sheet of sessions tells them apart: a seal "
    "protects only groups that do the same."
)


@dataclass(frozen=True)
class Content:
    """Everything that the report tells."""

    data: StudyData
    found: StudyFindings | None
    """None where there is nothing to compare."""

    why_not: str
    """Why not; empty where there is."""

    issues: Sequence[Issue]
    unpublished: Mapping[str, Sequence[str]]
    planned: PowerResult | None = None
    """Power of a next study; None where nobody's spread can be told."""


def figures(content: Content) -> Iterator[Chapter]:
    """Chapters with a figure, effects behind the first and power last; call it in house style."""
    data, found, planned = content.data, content.found, content.planned
    yield from drawn(FIGURES[:1], data)
    if found is not None and (figure := effects.draw(data, found)) is not None:
        yield Chapter("How much the groups differ", (), "effects", figure, effects.explain(found))
    yield from drawn(FIGURES[1:], data)
    if planned is not None:
        title = "How many people the next study needs"
        yield Chapter(title, (), "power", power.draw(planned, data.is_simulated), power.explain(planned))


def findings(content: Content) -> Iterator[Chapter]:
    """Result of the study in words, before any figure."""
    if found := content.found:
        said = [Text(found.primary.sentence, "strong"), found.effect.meaning, Bullets(found.limits)]
        yield Chapter("What this study can say, and what not", said)


def notices(content: Content) -> Iterator[Block]:
    """Warnings before the first chapter."""
    if content.why_not:
        yield Text(content.why_not, "notice")
    if n := len(content.issues):
        flaws = Markup('The data have flaws, of {} {}: <a href="#quality">data quality</a>.')
        yield Text(flaws.format(n, "kind" if n == 1 else "kinds"), "notice")


def texts(content: Content) -> Iterator[Chapter]:
    """Chapters behind the figures: tables, quality of the data, methods and limits."""
    data, found = content.data, content.found
    if not data.touches.empty:
        note = Text(f"Touches that count, {data.compared_words}.")
        yield Chapter("Each person", [note, people_table(data)], "people")
    if found is not None:
        yield Chapter("The comparison, primary first", list(_comparison(found)), "comparison")
    if not data.touches.empty:
        yield Chapter("All measures", list(_measures(data, found)), "measures")
    rows = [(one.what, str(one.count), one.which, one.consequence) for one in content.issues]
    quality_of = Table(("what", "how many", "which", "what is done"), rows) if rows else NO_FLAW
    yield Chapter("Data quality", [quality_of], "quality")
    yield Chapter("Touches that are left out", list(_exclusions(data, found)), "exclusions")
    yield Chapter("Methods", methods(data, content.unpublished, () if found is None else found.methods), "methods")
    sealed = (SEALED_LIMIT,) if data.is_sealed else ()
    yield Chapter("Limits", [Bullets((*LIMITS, *sealed, "Research software, not a medical device."))], "limits")
    if made_by := provenance(data):
        table = Table(("what", "version or SHA-256", "sessions"), made_by)
        yield Chapter("What made the sessions", [table], "provenance")


def _comparison(found: StudyFindings) -> Iterator[Block]:
    yield Table(("test", "p", "what follows"), test_rows(found))
    yield Table(("effect", "value", "interval", "how to read it"), effect_rows(found))
    if found.mixed and found.mixed.remarks:
        yield Text(f"Mixed model: {' '.join(found.mixed.remarks)}")
    if found.bayes:
        yield Text(f"Hierarchical model: {found.bayes.sentence} {found.bayes.convention}")


def _measures(data: StudyData, found: StudyFindings | None) -> Iterator[Block]:
    yield Text(
        f"{data.compared_words.capitalize()}. Median over people, in brackets the smallest and largest of a person. "
        "Described: with as many measures as here some differ by chance."
    )
    yield measures_table(data)
    if found is not None and (family := family_of(data, found)) is not None:
        left_out = f" Left out: {' '.join(family.left_out)}" if family.left_out else ""
        yield Text("The measures of a session, tested as one family", "heading")
        yield Text(family.sentence + left_out)
        yield Table(("measure", "difference of means", "p", "Holm", "max-T"), family_rows(family))


def _exclusions(data: StudyData, found: StudyFindings | None) -> Iterator[Block]:
    yield f"{len(data.tables.touches)} touches were recorded, {len(data.touches)} count."
    if rows := [(one.reason, str(one.touches), str(one.people)) for one in exclusions(data)]:
        yield Table(("reason", "touches", "people"), rows)
    if found is not None and found.left_out:
        yield f"Left out of the comparison: {' '.join(found.left_out)}"
