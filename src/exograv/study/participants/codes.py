"""Codes of participants: drawn at random, without look-alikes, with a check character that catches slips."""

import re
import secrets
from collections.abc import Callable, Collection

from exograv.errors import ConfigError

LETTERS = "ACDEFHJKLMNPRTVWXY"
DIGITS = "34679"
SYMBOLS = LETTERS + DIGITS
"""23, a prime, so that every wrong symbol and every two that are swapped change the check character."""

SHAPE = (LETTERS, DIGITS, LETTERS, LETTERS, DIGITS, LETTERS)
"""Before the check character. Digits between keep words and names from coming about; 2.6 million codes."""

CODE = re.compile(rf"[{LETTERS}][{DIGITS}][{LETTERS}]{{2}}[{DIGITS}][{LETTERS}][{SYMBOLS}]")


def draw_code(taken: Collection[str] = (), choice: Callable[[str], str] = secrets.choice) -> str:
    """A code that nobody has; nothing of the person is in it.

    Args:
        taken: Those that there are.
        choice: Takes one of these symbols; of a simulated study, whose codes follow from its seed.
    """
    while True:
        drawn = "".join(choice(symbols) for symbols in SHAPE)
        code = drawn + _check(drawn)
        if code not in taken:
            return code


def is_code(text: str) -> bool:
    """Whether it has the shape of a code and the check character is right."""
    return CODE.fullmatch(text) is not None and _check(text[:-1]) == text[-1]


def typed_code(text: str) -> str:
    """A code as somebody typed it, in its own form.

    Raises:
        ConfigError: It is none; what was typed is not repeated, because it may be a name.
    """
    code = text.strip().upper()
    if not is_code(code):
        raise ConfigError(
            f"What was given as a participant's code ({len(text)} characters) is none. A code has {len(SHAPE) + 1} "
            "characters such as K7MR4XX, and its last one tells slips. See `exograv study participant STUDY list`."
        )
    return code


def _check(drawn: str) -> str:
    """Weights 1 to 6, all different and none a multiple of 23: any one wrong symbol, any two swapped are seen."""
    total = sum(weight * SYMBOLS.index(symbol) for weight, symbol in enumerate(drawn, start=1))
    return SYMBOLS[total % len(SYMBOLS)]
