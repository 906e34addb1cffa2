"""Translations of the server's sentences. The pages' tables have each one under `said.` and its code."""

import json
from collections.abc import Mapping
from pathlib import Path

WORDS = Path(__file__).parent / "pages" / "words"
OF_SERVER = "said."


def said_in(language: str) -> Mapping[str, str]:
    """Return sentences with placeholders by code, in a language other than English."""
    words = json.loads((WORDS / f"{language}.json").read_text(encoding="utf-8"))
    return {name.removeprefix(OF_SERVER): text for name, text in words.items() if name.startswith(OF_SERVER)}
