"""Command `exograv run assist`."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from exograv.cli.shell.base_options import OutFolder
from exograv.cli.shell.kept_arm import say_kept
from exograv.errors import RigError
from exograv.live.options import PersonForm
from exograv.procedures.rehabilitation.assist.options import AssistOptions

if TYPE_CHECKING:
    from exograv.laboratory.assist.assist_command import AssistResult
    from exograv.live.on_drives.assist import AssistOnDrives
    from exograv.loop.pilot import Progress
    from exograv.procedures.rehabilitation.assist.session_files import Told
    from exograv.procedures.rehabilitation.assist.words import AssistTexts


@dataclass(frozen=True)
class AssistLanguage:
    """Language of a session."""

    language: Literal["en", "de"] = "en"
    """Language of the sentences and of the therapist's page."""


def run_assist_command(
    spoken: AssistLanguage, options: AssistOptions, person: PersonForm, common: OutFolder
) -> "AssistResult | AssistOnDrives":
    """Run a session that lowers support after success and raises it after failure, and explain each step.

    Without --drives the person is virtual, and becomes stronger from session to session.
    """
    from exograv.cli.shell.terminal import bars
    from exograv.console.words import said_in
    from exograv.procedures.rehabilitation.assist.participant_record import AssistBlock, AssistSession
    from exograv.procedures.rehabilitation.assist.session_files import how_to_go_on
    from exograv.procedures.rehabilitation.assist.words import AssistTexts
    from exograv.task.assist_as_needed import SENTENCES

    words = AssistTexts(spoken.language, {"en": SENTENCES, "de": said_in("de")})

    def told(session: AssistSession, block: AssistBlock) -> None:
        print(words.said(len(session.blocks), block), flush=True)

    try:
        with bars() as progress:
            result = _run(options, person, common.out, words, told, progress)
    except (KeyboardInterrupt, RigError):
        print(f"\n{how_to_go_on(options, common.out)}", file=sys.stderr)
        raise
    print(words.following(result.found.next_percent))
    print(f"Page: {result.page}")
    return result


def _run(
    options: AssistOptions,
    person: PersonForm,
    folder: Path,
    words: "AssistTexts",
    told: "Told",
    progress: "Progress",
) -> "AssistResult | AssistOnDrives":
    if not options.is_on_drives:
        from exograv.laboratory.assist.assist_command import run_assist

        return run_assist(options, folder, words, told, progress)
    from exograv.api.rig_factory import simulated_wearer
    from exograv.cli.shell.terminal import say
    from exograv.live.on_drives.assist import run_assist_on_drives

    result = run_assist_on_drives(options, person, folder, words, told, progress, say, simulated_wearer(options))
    say_kept(result.live)
    return result
