"""How a p-value may be printed and what may be said of it: never less than was possible, never more than was shown."""

from math import ceil, floor, log10

from exograv.errors import ConfigError

ROUNDING = 1e-12


def p_text(p: float, p_min: float | None = None) -> str:
    """`p = 0.100` and, where it is the smallest there can be, that it is.

    Raises:
        ConfigError: It is no probability, or smaller than the smallest possible: whoever made it made a mistake.
    """
    if not 0.0 <= p <= 1.0:
        raise ConfigError(f"A p-value of {p} is none; it lies between 0 and 1. Compute it with `statistics.compare`.")
    if p_min is None:
        return f"p < {_number(0.0001)}" if p < 0.0001 else f"p = {_number(p)}"
    if p < p_min - ROUNDING:
        raise ConfigError(
            f"p = {p:.3g} is not printed: the smallest that these people allow is {p_min:.3g}. Test participants, "
            "not touches."
        )
    return f"p = {_number(p)}" + (", the smallest possible" if p <= p_min + ROUNDING else "")


def _number(p: float) -> str:
    """Three digits, rounded up: nothing printed is smaller than what was computed."""
    decimals = 3 if p >= 0.1 - ROUNDING or p == 0.0 else 2 - floor(log10(p))
    return f"{ceil(p * 10**decimals - 1e-6) / 10**decimals:.{decimals}f}"


def verdict(p: float, p_min: float, alpha: float, n_first: int, n_second: int) -> str:
    """One sentence; the word for a success is kept for tests that could have failed to reach it."""
    people = f"{n_first} against {n_second} people"
    if p_min > alpha + ROUNDING:
        return (
            f"With {people} this test cannot reach {alpha:g}, however large the effect: its smallest p is "
            f"{p_min:.3g}. So it neither shows a difference nor speaks against one."
        )
    if p <= alpha + ROUNDING:
        return (
            f"A difference as large as this arises by dealing out the {people} by chance in {100 * p:.2g} % of cases."
        )
    return (
        f"Chance alone separates {people} as much in {100 * p:.2g} % of cases: no difference is shown, and none is "
        "excluded; the interval says which are left."
    )
