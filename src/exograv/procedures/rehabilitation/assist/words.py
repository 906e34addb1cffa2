"""Texts of the command and its page, in English and German.

The sentences of decisions are in `task.assist_as_needed`.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

from exograv.sentence import render

from .participant_record import AssistBlock

Language = Literal["en", "de"]


@cache
def page_words(language: Language) -> Mapping[str, str]:
    """Load the texts of the page, by name. A text may have placeholders for values."""
    words = json.loads(Path(__file__).with_name("words.json").read_text(encoding="utf-8"))
    return words[language]


@dataclass(frozen=True)
class AssistTexts:
    """Texts of assist-as-needed in one language: sentences of the decisions, and texts of the page."""

    language: Language
    sentences: Mapping[Language, Mapping[str, str]]
    """Sentences that explain the decisions, by code of the decision, with placeholders for values."""

    def page(self, name: str, **gaps: object) -> str:
        """Return a text of the page with the values filled in."""
        return page_words(self.language)[name].format(**gaps)

    def decided(self, block: AssistBlock) -> str:
        """Return the reason for the support after this block."""
        return self.in_all(block)[self.language]

    def in_all(self, block: AssistBlock) -> dict[Language, str]:
        """Return the reason for the support after this block in every language."""
        return {language: render(said, block.code, block.gaps) for language, said in self.sentences.items()}

    def following(self, percent: float) -> str:
        """Return the sentence on the support with which the next session starts."""
        return render(self.sentences[self.language], "assist.next", {"after": f"{percent:g}"})

    def said(self, number: int, block: AssistBlock) -> str:
        """Return the line on this block for the terminal."""
        return self.page("said", block=number, support=f"{block.support_percent:g}", text=self.decided(block))
