"""Printout of a person's file that a command on drives has written."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exograv.live.live_figures import LiveFigures


def say_kept(live: "LiveFigures") -> None:
    """Print the file of the arm, or why it was not written; nothing if no file was requested."""
    from exograv.cli.shell.terminal import say, say_unbroken

    kept = live.person
    if kept is None:
        return
    if kept.file is None:
        say(kept.why)
        return
    say_unbroken(f"Kept as {kept.code}, donning {kept.donnings}: {kept.file}")
    if kept.warning:
        say(kept.warning)
