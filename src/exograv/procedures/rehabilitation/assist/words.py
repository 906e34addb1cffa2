"""What the command and its page say, in English and German; the decisions' own sentences are the task's."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from exograv.report.style.page import NO_EVIDENCE
from exograv.sentence import render

from .participant_record import AssistBlock

Language = Literal["en", "de"]

PAGE: Mapping[Language, Mapping[str, str]] = MappingProxyType(
    {
        "en": MappingProxyType(
            {
                "title": "Assist as needed, {participant}",
                "headline": "Session {session}: {began} % of the arm's weight was carried at first, {now} % at last.",
                "going": "Session {session} was broken off after {blocks} blocks, with {now} % carried.",
                "course": "Support, block by block",
                "caption": (
                    "Each step is one block: above, how much of the arm's weight the machine carried, below, the share "
                    "of its targets that was reached. Dotted lines begin a session. The pale band is where this "
                    "session's support could go: not below what the protocol allows, nor farther down than a session "
                    "may take it. A red cross is a block in which the arm sank and was carried again."
                ),
                "carried": "weight carried [%]",
                "reached": "reached [%]",
                "block": "block",
                "session": "session",
                "decisions": "Every decision, and why",
                "decision": "decision",
                "of": "{reached} of {tried}",
                "rule": "The rule",
                "rule_text": (
                    "After a block with at least {lower} % of its targets reached, support goes down by {down} points; "
                    "with fewer than {raise_} %, or when the arm sank, it goes up by {up} points and not down again in "
                    "that session. In one session it goes down by {most} points at most, and never below {least} %."
                ),
                "assumed": "All of these numbers are assumed, for a therapist to change in the protocol file.",
                "simulated": NO_EVIDENCE,
                "said": "Block {block}, {support} % carried. {text}",
            }
        ),
        "de": MappingProxyType(
            {
                "title": "Unterstützung nach Bedarf, {participant}",
                "headline": "Sitzung {session}: anfangs wurden {began} % des Armgewichts getragen, am Ende {now} %.",
                "going": "Sitzung {session} wurde nach {blocks} Blöcken abgebrochen, mit {now} % Unterstützung.",
                "course": "Unterstützung, Block für Block",
                "caption": (
                    "Jede Stufe ist ein Block: oben, wie viel vom Gewicht des Arms die Maschine trug, unten der Anteil "
                    "der erreichten Ziele. Gepunktete Linien beginnen eine Sitzung. Im hellen Band durfte die "
                    "Unterstützung in der jeweiligen Sitzung liegen: nicht unter dem Erlaubten und nicht weiter unten, "
                    "als eine Sitzung gehen darf. Ein rotes Kreuz ist ein Block, in dem der Arm absank und wieder "
                    "getragen wurde."
                ),
                "carried": "getragenes Gewicht [%]",
                "reached": "erreicht [%]",
                "block": "Block",
                "session": "Sitzung",
                "decisions": "Jede Entscheidung und ihr Grund",
                "decision": "Entscheidung",
                "of": "{reached} von {tried}",
                "rule": "Die Regel",
                "rule_text": (
                    "Nach einem Block mit mindestens {lower} % erreichten Zielen geht die Unterstützung um {down} "
                    "Punkte zurück; bei weniger als {raise_} %, oder wenn der Arm absank, steigt sie um {up} Punkte "
                    "und geht in dieser Sitzung nicht mehr zurück. In einer Sitzung geht sie um höchstens {most} "
                    "Punkte zurück und nie unter {least} %."
                ),
                "assumed": "Alle diese Zahlen sind angenommen; in der Protokolldatei kann man sie ändern.",
                "simulated": "SIMULIERT: Niemand hat teilgenommen. Es zeigt, dass die Software arbeitet, und sagt "
                "nichts über Menschen.",
                "said": "Block {block}, {support} % getragen. {text}",
            }
        ),
    }
)


@dataclass(frozen=True)
class Words:
    """What is said, and in which language."""

    language: Language
    sentences: Mapping[Language, Mapping[str, str]]
    """Of the decisions, by code, with gaps."""

    def page(self, name: str, **gaps: object) -> str:
        """One of the page's own, filled."""
        return PAGE[self.language][name].format(**gaps)

    def decided(self, block: AssistBlock) -> str:
        """Why support is what it is after this block."""
        return self.in_all(block)[self.language]

    def in_all(self, block: AssistBlock) -> dict[Language, str]:
        """The same in every language there is."""
        return {language: render(said, block.code, block.gaps) for language, said in self.sentences.items()}

    def following(self, percent: float) -> str:
        """Support with which the next session begins."""
        return render(self.sentences[self.language], "assist.next", {"after": f"{percent:g}"})

    def said(self, number: int, block: AssistBlock) -> str:
        """For the terminal."""
        return self.page("said", block=number, support=f"{block.support_percent:g}", text=self.decided(block))
