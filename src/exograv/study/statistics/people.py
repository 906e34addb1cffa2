"""Summary of touches by one number per person, and the people and touches that are left out."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from jaxtyping import Float

from exograv.errors import ConfigError

from .findings import ParticipantValue, Spread, Unit

FLOOR = {"px": 0.5, "mm": 0.1}
"""Smallest deviations: a touch exactly on the centre has no logarithm."""

QUARTILES = (0.25, 0.5, 0.75)


def counted_touches(
    touches: pd.DataFrame, participants: pd.DataFrame, groups: tuple[str, str], protocol: str, unit: Unit
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return the accepted touches of people in these groups, and a sentence for each reason of leaving touches out.

    Returns:
        Columns participant, group, session, window (float), deviation [unit] and log_deviation; sentences.

    Raises:
        ConfigError: Two participants have the same code.
    """
    if (twice := participants["participant"].duplicated().to_numpy(bool)).any():
        codes = ", ".join(sorted(set(participants["participant"].to_numpy(str)[twice])))
        raise ConfigError(
            f"{codes} occurs twice among the participants: their touches cannot be assigned. Correct participants.toml."
        )
    left_out: list[str] = []
    flight: pd.DataFrame = touches.loc[touches["protocol"] == protocol].merge(
        participants[["participant", "group"]], on="participant", how="left", validate="many_to_one"
    )
    for remark, column in (
        (f"touches in '{protocol}' were rejected, each for its own reason", "is_accepted"),
        (f"touches in '{protocol}' are outside of all windows", "window"),
        (f"touches have no deviation in {unit}: the screen was not calibrated", f"deviation_{unit}"),
    ):
        is_in = (flight[column] if column == "is_accepted" else flight[column].notna()).to_numpy(bool)
        if not is_in.all():
            left_out.append(f"{np.count_nonzero(~is_in)} {remark}.")
        flight = flight.loc[is_in]
    left_out += _people_left_out(flight, participants, groups, protocol)
    flight = flight.loc[flight["group"].isin(groups)]
    deviation = flight[f"deviation_{unit}"].to_numpy(float)
    table = pd.DataFrame(
        {
            "participant": flight["participant"].to_numpy(),
            "group": flight["group"].to_numpy(),
            "session": flight["session"].to_numpy(),
            "window": flight["window"].to_numpy(float),
            "deviation": deviation,
            "log_deviation": np.log(np.maximum(deviation, FLOOR[unit])),
        }
    )
    return table, tuple(left_out)


def _people_left_out(
    touches: pd.DataFrame, participants: pd.DataFrame, groups: tuple[str, str], protocol: str
) -> Iterator[str]:
    known = participants.set_index("participant")["group"]
    seen = set(touches["participant"])
    for code in sorted(seen - set(known.index)):
        yield f"{code} has touches but is not among the participants."
    for code, group in known.items():
        if bool(pd.isna(group)):
            yield f"{code} has no group, or it is still sealed."
        elif group not in groups:
            yield f"{code} is in group '{group}', which is not compared."
        elif code not in seen:
            yield f"{code} has no accepted touch in '{protocol}'."


def people_of(counted: pd.DataFrame, groups: tuple[str, str]) -> tuple[ParticipantValue, ...]:
    """Summarise each person's touches by one number, the first group's people first, then by code."""
    people = []
    for group in groups:
        for code, own in counted.loc[counted["group"] == group].groupby("participant"):
            median, log_median = (
                float(np.median(own[name].to_numpy(float))) for name in ("deviation", "log_deviation")
            )
            people.append(ParticipantValue(str(code), group, len(own), median, log_median))
    return tuple(people)


def logs_of(people: tuple[ParticipantValue, ...], group: str) -> Float[np.ndarray, " person"]:
    """Return the median log deviation of each person of a group."""
    return np.array([person.log_median for person in people if person.group == group])


def spread_of(counted: pd.DataFrame, group: str) -> Spread:
    """Return the quartiles of a group's touches. Each person has the same weight."""
    own: pd.DataFrame = counted.loc[counted["group"] == group]
    if own.empty:
        return Spread(0, 0, None, None)
    _, where, sizes = np.unique(own["participant"].to_numpy(str), return_inverse=True, return_counts=True)
    values, weights = own["deviation"].to_numpy(float), 1.0 / sizes[where]
    low, middle, high = np.quantile(values, QUARTILES, weights=weights, method="inverted_cdf").tolist()
    return Spread(len(sizes), len(own), middle, (low, high))
