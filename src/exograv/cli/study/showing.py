"""Terminal output of the status of a study."""

from rich.console import Console
from rich.table import Table

from exograv.study.dataset.status import StudyStatus, in_words
from exograv.study.folder.study_folder import UNFINISHED


def show_status(status: StudyStatus) -> None:
    """Print the sessions of each participant, missing sessions, and problems."""
    protocols = sorted({name for person in status.participants for name in (*person.sessions, *person.missing)})
    table = Table(title=status.name + (" (simulated: nobody took part)" if status.is_simulated else ""))
    for title in ("participant", "group", *protocols, "missing", "touches"):
        table.add_column(title, justify="right" if title == "touches" else "left")
    for person in status.participants:
        cells = [in_words(person.sessions.get(name, ())) for name in protocols]
        missing = [f"{name} {in_words(numbers)}" for name, numbers in person.missing.items()]
        table.add_row(person.participant, person.group, *cells, "; ".join(missing), str(person.touches))
    console = Console()
    console.print(table)
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
