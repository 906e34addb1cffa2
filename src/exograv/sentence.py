"""Sentences in several languages: English text with a code and fields that render the sentence in another language."""

import math
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Annotated, Any

SUPPORT_TEXT = "support {support} % (felt weight {felt} %)"
"""Weight support, the one quantity of all pages and messages in per cent: 100 % carries the whole arm.

The pages have the text of each language under `support.value`.
"""


class Sentence(str):
    """English text with the code and the fields that render it in another language."""

    __slots__ = ("code", "fields")

    code: str
    """Key in the table of each language; empty for text without a translation, as from the operating system."""

    fields: Mapping[str, str]
    """Values by placeholder. A value may be a sentence."""

    def __new__(cls, text: str, code: str = "", fields: Mapping[str, str] | None = None) -> "Sentence":
        """Make a sentence from its English text."""
        made = super().__new__(cls, text)
        made.code, made.fields = code, dict(fields or {})
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        """Keep code and fields when the sentence is sent to another process."""
        return Sentence, (str(self), self.code, self.fields)

    def rendered(self, texts: Mapping[str, str]) -> str:
        """Text in the language of the table `texts`."""
        return render(texts, self.code, self.fields) if self.code else str(self)


class _KeepsSentence:
    """Marker that lets pydantic keep a sentence. By default pydantic makes a plain string of it."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Callable[[Any], Any]) -> Any:
        """Return the schema of a string that may be a sentence."""
        from pydantic_core import core_schema

        return core_schema.union_schema([core_schema.is_instance_schema(Sentence), handler(source)])


SentenceText = Annotated[str, _KeepsSentence()]
"""Type of a setting's field that holds a sentence, or text without a code."""


def say(texts: Mapping[str, str], code: str, **fields: object) -> Sentence:
    """Sentence of an English table, with its placeholders filled."""
    filled = {name: field if isinstance(field, Sentence) else str(field) for name, field in fields.items()}
    return Sentence(texts[code].format(**filled), code, filled)


def support_text(gravity_level: float) -> str:
    """Weight support at a gravity level, as the pages show it: support first, then the felt weight.

    Above Earth gravity the support is negative.
    """
    support = math.floor(100.0 * (1.0 - gravity_level) + 0.5)
    return SUPPORT_TEXT.format(support=support, felt=100 - support)


def render(texts: Mapping[str, str], code: str, fields: Mapping[str, object]) -> str:
    """Text of a code in the language of a table; fields that are sentences are rendered in the same language."""
    filled = {name: field.rendered(texts) if isinstance(field, Sentence) else field for name, field in fields.items()}
    return texts[code].format(**filled)


def member_sentence(family: str, member: Enum) -> Sentence:
    """Sentence of an enumeration whose values are English texts, such as `mode.floating`."""
    return Sentence(member.value, f"{family}.{member.name.lower()}")
