"""Terminal output of the status of a study."""

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from exograv.study.dataset.status import StudyStatus, in_words
from exograv.study.folder.study_folder import UNFINISHED


def show_status(status: StudyStatus) -> None:
    """Print the sessions of each participant, missing sessions, and problems."""
    console = Console()
    if status.participants:
        console.print(_table(status, console.width))
    else:
        console.print(f"{status.name} has no participant yet. {NEW_PARTICIPANT}", highlight=False, markup=False)
    if status.is_unfinished:
        console.print(UNFINISHED, highlight=False)
    for what, remark in status.remarks.items():
        console.print(f"{what}: {remark}", highlight=False, markup=False)
    for sha256, reason in status.quarantined.items():
        console.print(f"In quarantine, {sha256[:16]}: {reason}", highlight=False, markup=False)
    if status.refused:
        console.print(
            f"Refused and not added later: {status.refused} files; log.jsonl has names and reasons.", highlight=False
        )


NEW_PARTICIPANT = "Add one: exograv study participant STUDY new --group GROUP --consent VERSION"
MISSING = "missing"
MISSING_COLUMNS = 8
"""Smallest width of the column of missing sessions [columns]; its text is wrapped."""


def _table(status: StudyStatus, width: int) -> Table:
    """Table of the participants. On a narrow terminal words are broken, and nothing is cut off."""
    protocols = sorted({name for person in status.participants for name in (*person.sessions, *person.missing)})
    titles = ("participant", "group", *protocols, MISSING, "touches")
    rows = list[tuple[str, ...]]()
    for person in status.participants:
        cells = [in_words(person.sessions.get(name, ())) for name in protocols]
        missing = [f"{name} {in_words(numbers)}" for name, numbers in person.missing.items()]
        rows.append((person.participant, person.group, *cells, "; ".join(missing), str(person.touches)))
    widest = {title: max(map(len, column)) for title, *column in zip(titles, titles, *rows, strict=True)}
    whole = sum(widest.values()) - widest[MISSING] + min(widest[MISSING], MISSING_COLUMNS) + 2 * len(titles) + 1
    table = Table(
        title=status.name + (" (simulated: nobody took part)" if status.is_simulated else ""),
        box=SIMPLE,
        padding=(0, 1, 0, 0),
    )
    for title in titles:
        justify = "right" if title == "touches" else "left"
        table.add_column(title, justify=justify, overflow="fold", no_wrap=title != MISSING and whole <= width)
    for row in rows:
        table.add_row(*row)
    return table
