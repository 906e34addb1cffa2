"""Statement of the recordings and diaries of one run, by which they are recognised and joined."""

from exograv.model.rig_settings import Settings

STATEMENT_TOPIC = "/console/run_part"
"""Topic of the statement in a diary."""


class RunStatement(Settings):
    """Run of a protocol that a recording or a diary belongs to. A resumed run keeps its statement, except two fields.

    These are `launch` and `complete`.
    """

    run: str
    """Random name of the run, drawn when it began."""

    launch: str
    """Random name of the command that wrote this file. A resumed run has several."""

    participant: str | None
    protocol: str
    protocol_sha256: str
    session: int

    complete: tuple[int, ...] = ()
    """Windows that were complete by the checkpoint when this part began. A part that is missing shows by them."""
