"""Codes of participants: drawn at random, without look-alike symbols, with a check character against typing errors."""

import re
import secrets
from collections.abc import Callable, Collection

from exograv.errors import ConfigError

LETTERS = "ACDEFHJKLMNPRTVWXY"
DIGITS = "34679"
SYMBOLS = LETTERS + DIGITS
"""23 symbols. The number is prime, so every wrong symbol and every swap of two symbols changes the check character."""

SHAPE = (LETTERS, DIGITS, LETTERS, LETTERS, DIGITS, LETTERS)
"""Symbols before the check character. Digits in between prevent words and names. There are 2.6 million codes."""

CODE = re.compile(rf"[{LETTERS}][{DIGITS}][{LETTERS}]{{2}}[{DIGITS}][{LETTERS}][{SYMBOLS}]")


def draw_code(taken: Collection[str] = (), choice: Callable[[str], str] = secrets.choice) -> str:
    """Draw a code that no participant has. The code holds no information about the person.

    Args:
        taken: Existing codes.
        choice: Draws one of the given symbols. A simulated study gives its own, so that its codes follow from its seed.
    """
    while True:
        drawn = "".join(choice(symbols) for symbols in SHAPE)
        code = drawn + _check(drawn)
        if code not in taken:
            return code


def is_code(text: str) -> bool:
    """Return True if the text has the shape of a code and its check character is right."""
    return CODE.fullmatch(text) is not None and _check(text[:-1]) == text[-1]


def typed_code(text: str) -> str:
    """Return a typed code in its standard form.

    Raises:
        ConfigError: The text is not a code. The message does not repeat the text, because it may be a name.
    """
    code = text.strip().upper()
    if not is_code(code):
        raise ConfigError(
            f"The text given as a participant's code ({len(text)} characters) is not a code. A code has "
            f"{len(SHAPE) + 1} characters such as K7MR4XX, and its last character detects typing errors. See `exograv "
            "study participant STUDY list`."
        )
    return code


def _check(drawn: str) -> str:
    """Return the check character.

    The weights 1 to 6 are all different and none is a multiple of 23, so any single wrong symbol and any swap of two
    symbols is detected.
    """
    total = sum(weight * SYMBOLS.index(symbol) for weight, symbol in enumerate(drawn, start=1))
    return SYMBOLS[total % len(SYMBOLS)]
