"""`exograv assist`."""

import sys
from dataclasses import dataclass
from typing import Any, Literal

from exograv.cli.shell.base_options import Common
from exograv.errors import ConfigError


@dataclass(frozen=True)
class Assist(Common):
    """A session in which support follows what the person reaches, down after success and up after failure, and why."""

    participant: str = ""
    """Code that stands for the person, such as P-07, never a name."""

    protocol: str = "assist-as-needed"
    """`assist-as-needed`, or the path of a protocol of your own."""

    simulate: bool = False
    """With the twin and a virtual person who is stronger from session to session."""

    language: Literal["en", "de"] = "en"
    """Of the sentences and of the therapist's page."""

    needed_percent: float | None = None
    """Support that a test has found (`exograv support-level`); without it the first session begins fully supported."""

    new_session: bool = False
    """Leave a session that was broken off as it is, and begin another one."""

    rig: str = "recupera_like_qdd"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    strength: float | None = None
    """Of the virtual person in the first session, over a healthy adult's; 0.1 if not given."""

    synergy: float | None = None
    """Torque that bends the elbow over the one with which the shoulder lifts; none if not given."""

    gain: float = 0.15
    """By which share the virtual person is stronger from session to session."""


def run_assist_command(command: Assist) -> dict[str, Any]:
    """Run one session, or what is left of it."""
    from exograv.cli.shell.terminal import bars
    from exograv.console.words import said_in
    from exograv.laboratory.assist.assist_command import how_to_go_on, run_assist
    from exograv.laboratory.assist.options import AssistOptions
    from exograv.procedures.rehabilitation.assist.participant_record import AssistBlock, AssistSession
    from exograv.procedures.rehabilitation.assist.words import Words
    from exograv.task.assist_as_needed import SENTENCES

    if not command.simulate:
        raise ConfigError(
            "Sessions with a person in a real machine are not wired yet; give --simulate for one with the twin and "
            "nobody there (docs/assist.md)."
        )
    options = AssistOptions(
        participant=command.participant,
        protocol=command.protocol,
        rig=command.rig,
        side=command.side,
        level=command.level,
        seed=command.seed,
        strength=command.strength,
        synergy=command.synergy,
        gain=command.gain,
        needed_percent=command.needed_percent,
        new_session=command.new_session,
    )
    words = Words(command.language, {"en": SENTENCES, "de": said_in("de")})

    def told(session: AssistSession, block: AssistBlock) -> None:
        print(words.said(len(session.blocks), block), flush=True)

    try:
        with bars() as progress:
            result = run_assist(options, command.out, words, told, progress)
    except KeyboardInterrupt:
        print(f"\n{how_to_go_on(options, command.out)}", file=sys.stderr)
        raise
    print(words.following(result["next_percent"]))
    print(f"Page: {result['page']}")
    return result
