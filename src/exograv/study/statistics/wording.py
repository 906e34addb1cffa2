"""Wording of p-values and conclusions: never below the possible minimum, never more than the test shows."""

from math import ceil, floor, log10

from exograv.errors import ConfigError

ROUNDING = 1e-12


def p_text(p: float, p_min: float | None = None) -> str:
    """Format a p-value as `p = 0.100`, with a note if it is the smallest possible one.

    Raises:
        ConfigError: The value is not a probability, or is smaller than the smallest possible one: a mistake of the
        caller.
    """
    if not 0.0 <= p <= 1.0:
        raise ConfigError(
            f"A p-value of {p} is invalid; it must lie between 0 and 1. Compute it with `statistics.compare`."
        )
    if p_min is None:
        return f"p < {_number(0.0001)}" if p < 0.0001 else f"p = {_number(p)}"
    if p < p_min - ROUNDING:
        raise ConfigError(
            f"p = {p:.3g} is not printed: the smallest value that these people allow is {p_min:.3g}. Test "
            "participants, not touches."
        )
    return f"p = {_number(p)}" + (", the smallest possible" if p <= p_min + ROUNDING else "")


def _number(p: float) -> str:
    """Format with three digits, rounded up: no printed value is smaller than the computed one."""
    decimals = 3 if p >= 0.1 - ROUNDING or p == 0.0 else 2 - floor(log10(p))
    return f"{ceil(p * 10**decimals - 1e-6) / 10**decimals:.{decimals}f}"


def verdict(p: float, p_min: float, alpha: float, n_first: int, n_second: int) -> str:
    """Return the conclusion in one sentence.

    It claims a difference only for tests that could have failed to show it.
    """
    people = f"{n_first} against {n_second} people"
    if p_min > alpha + ROUNDING:
        return (
            f"With {people} this test cannot reach {alpha:g}, however large the effect: its smallest p is "
            f"{p_min:.3g}. So the test neither shows a difference nor excludes one."
        )
    if p <= alpha + ROUNDING:
        return f"Random assignment of the {people} gives a difference as large as this in {100 * p:.2g} % of cases."
    return (
        f"Random assignment of {people} gives a difference as large as this in {100 * p:.2g} % of cases. No difference "
        "is shown, and none is excluded; the interval says which are possible."
    )
