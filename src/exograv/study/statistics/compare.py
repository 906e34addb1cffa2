"""The one door: two groups of people, compared by what their touches say about each of them."""

from dataclasses import dataclass

import pandas as pd

from .findings import Findings, Unit


@dataclass(frozen=True)
class CompareSettings:
    """What is compared with what."""

    groups: tuple[str, str] = ("trained", "untrained")
    """The ratio is that of the first to the second."""

    protocol: str = "flight"
    unit: Unit = "px"
    alpha: float = 0.05
    """Share of false alarms that is accepted."""

    seed: int = 0
    """Draws relabellings where there are too many to count."""

    mixed: bool = True
    bayes: bool = True


def compare(touches: pd.DataFrame, participants: pd.DataFrame, settings: CompareSettings | None = None) -> Findings:
    """Compare two groups.

    Args:
        touches: Table `columns.TOUCHES`, such as those that count of complete windows; others are left out and named.
        participants: Table `columns.PARTICIPANTS`.
        settings: What with what.
    """
    raise NotImplementedError
