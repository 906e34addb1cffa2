"""Command `exograv run assist`."""

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from exograv.cli.shell.base_options import OutFolder
from exograv.laboratory.assist.options import AssistOptions

if TYPE_CHECKING:
    from exograv.laboratory.assist.assist_command import AssistResult


@dataclass(frozen=True)
class AssistLanguage:
    """Language of a session."""

    language: Literal["en", "de"] = "en"
    """Language of the sentences and of the therapist's page."""


def run_assist_command(spoken: AssistLanguage, options: AssistOptions, common: OutFolder) -> "AssistResult":
    """Simulate a session that lowers support after success and raises it after failure, and explain each step.

    The virtual person becomes stronger from session to session. Sessions with a real person are not implemented yet.
    """
    from exograv.cli.shell.terminal import bars
    from exograv.console.words import said_in
    from exograv.laboratory.assist.assist_command import how_to_go_on, run_assist
    from exograv.procedures.rehabilitation.assist.participant_record import AssistBlock, AssistSession
    from exograv.procedures.rehabilitation.assist.words import AssistTexts
    from exograv.task.assist_as_needed import SENTENCES

    words = AssistTexts(spoken.language, {"en": SENTENCES, "de": said_in("de")})

    def told(session: AssistSession, block: AssistBlock) -> None:
        print(words.said(len(session.blocks), block), flush=True)

    try:
        with bars() as progress:
            result = run_assist(options, common.out, words, told, progress)
    except KeyboardInterrupt:
        print(f"\n{how_to_go_on(options, common.out)}", file=sys.stderr)
        raise
    print(words.following(result.found.next_percent))
    print(f"Page: {result.page}")
    return result
