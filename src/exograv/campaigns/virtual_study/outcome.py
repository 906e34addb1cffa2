"""All flights of a virtual study in figures: the groups, the conditions, and whether the paper's direction appears."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.study.dataset.tables import frame
from exograv.study.folder.columns import PARTICIPANTS
from exograv.study.statistics.compare import CompareSettings, compare
from exograv.study.statistics.findings import Spread
from exograv.study.statistics.normal import welch_interval
from exograv.study.statistics.people import spread_of
from exograv.study.statistics.permutation import permutation_test
from exograv.study.statistics.relabelling import relabellings

from .curve import by_friction, by_left_over
from .flight import FIRST_WINDOW, VirtualFlight, compared, familiarised
from .transfer import DEFINITION, constant_error_mm, ends_of, transfers

GROUPS = ("trained", "untrained")
ALPHA = 0.05
NO_INTERVAL = "fewer than two people in a group: no interval"
NO_EVIDENCE = "Simulated: nobody took part. It shows that the software works; it is no evidence about people."

PerPerson = Float[np.ndarray, " person"]


def outcome_of(flights: Sequence[VirtualFlight], main: str) -> dict[str, Any]:
    """What `exograv simulate-study --json` says of the flights.

    Args:
        flights: Of everybody in every condition.
        main: Condition that the trained group of the main study had.

    Returns:
        `simulated`, `main`, `groups`, `direction`, `conditions` and `transfer`: nothing but JSON, no NaN.

    Raises:
        ConfigError: One person flew twice after the same, or there is no flight.
    """
    _refuse(flights)
    conditions, before = transfers(flights), familiarised(flights)
    for name, own in compared(flights).items():
        conditions[name] = _medians(touches_of(own), name) | _machine(own) | conditions[name]
        usual = {before[flight.person].sessions for flight in own if flight.person in before}
        conditions[name]["sessions_familiarised"] = sorted(usual)
    return {
        "simulated": True,
        "note": NO_EVIDENCE,
        "main": main,
        "groups": {group: _group(flights, group) for group in GROUPS},
        "direction": direction(flights),
        "conditions": conditions,
        "transfer": {
            "definition": DEFINITION,
            "by_left_over": by_left_over(flights),
            "by_friction": by_friction(flights),
        },
    }


def _refuse(flights: Sequence[VirtualFlight]) -> None:
    if not flights:
        raise ConfigError("Nobody flew: there is nothing to tell. Give --participants of 1 or more.")
    keys = [(flight.person, flight.condition, flight.group, flight.sessions) for flight in flights]
    if twice := sorted({key for key in keys if keys.count(key) > 1}):
        person, condition, group, sessions = twice[0]
        raise ConfigError(
            f"Person {person} flew twice after '{condition}' ({group}, {sessions} sessions); nobody counts twice. "
            "Leave one of the flights out."
        )


def code_of(person: int) -> str:
    """As tables and pictures name a virtual person."""
    return f"V{person:02d}"


def touches_of(flights: Sequence[VirtualFlight]) -> pd.DataFrame:
    """Touches as `study.statistics` takes them; `group` is the condition's name, or the group's of the main study."""
    return pd.DataFrame(
        [
            {
                "participant": code_of(flight.person),
                "protocol": "flight",
                "session": 1,
                "window": float(touch.window),
                "is_accepted": True,
                "deviation_px": touch.deviation_px,
                "deviation_mm": touch.deviation_mm,
                "deviation": touch.deviation_px,
                "group": flight.group if flight.group in GROUPS else flight.condition,
            }
            for flight in flights
            for touch in flight.touches
        ]
    )


def _medians(touches: pd.DataFrame, label: str) -> dict[str, Any]:
    """As the study's report counts: each person weighs the same, however many touches there are."""
    spread = Spread(0, 0, None, None)
    if not touches.empty:
        spread = spread_of(touches.assign(group=label), label)
    by_person = {} if touches.empty else touches.groupby("participant")["deviation_px"].median().to_dict()
    return {
        "median_px": spread.median,
        "iqr_px": spread.iqr,
        "quartiles_px": spread.quartiles and list(spread.quartiles),
        "touches": spread.touches,
        "median_px_by_person": {str(code): float(value) for code, value in by_person.items()},
    }


def _machine(own: Sequence[VirtualFlight]) -> dict[str, Any]:
    found: dict[str, Any] = {"condition": own[0].condition, "sessions": own[0].sessions}
    for name in ("left_over_Nm", "friction_Nm"):
        values = [value for flight in own if (value := getattr(flight, name)) is not None]
        found[name] = float(np.median(values)) if values else None
    return found


def _group(flights: Sequence[VirtualFlight], group: str) -> dict[str, Any]:
    own = [flight for flight in flights if flight.group == group]
    errors = {code_of(flight.person): constant_error_mm(flight) for flight in own}
    return {
        **_medians(touches_of(own), group),
        "people": len({flight.person for flight in own}),
        "first_window_up_mm_by_person": {code: float(mm) for code, mm in errors.items() if np.isfinite(mm)},
    }


def direction(flights: Sequence[VirtualFlight]) -> dict[str, Any]:
    """Whether the trained of the main study deviate less than the untrained, as the paper's people did.

    Returns:
        `whole_flight` and `first_window` by the deviation, ratio trained over untrained; `first_window_up_mm` by the
        size of each person's signed error, difference trained less untrained. Each with interval, exact p and the
        smallest possible p, `pairs_nearer` of `pairs` of a trained and an untrained person, and what is shown by test
        and interval both: `is_shown`, and `is_opposite_shown`; or only `reason`.
    """
    own = [flight for flight in flights if flight.group in GROUPS]
    if missing := [group for group in GROUPS if not any(flight.group == group for flight in own)]:
        nothing = {"appears": None, "reason": f"Nobody of the group {' or '.join(missing)} flew."}
        return {"whole_flight": nothing, "first_window": nothing, "first_window_up_mm": nothing}
    people = frame(PARTICIPANTS, [{"participant": code_of(one.person), "group": one.group} for one in own])
    touches = touches_of(own)
    first = pd.DataFrame(touches[touches["window"] == FIRST_WINDOW])
    return {
        "whole_flight": _compared(touches, people),
        "first_window": _compared(first, people),
        "first_window_up_mm": _signed(own),
    }


def _compared(touches: pd.DataFrame, people: pd.DataFrame) -> dict[str, Any]:
    settings = CompareSettings(groups=GROUPS, mixed=False, bayes=False)
    found = compare(touches.drop(columns=["group", "deviation"]), people, settings)
    if found.effect.value is None:
        return {"appears": None, "reason": found.primary.sentence}
    medians = [
        touches[touches["group"] == group].groupby("participant")["deviation_px"].median().to_numpy(float)
        for group in GROUPS
    ]
    interval, test = ends_of(found.effect.interval), found.primary
    return {
        **_verdict(found.effect.value, 1.0, interval, test.p),
        **_nearer(*medians),
        "ratio": found.effect.value,
        "ci95": interval,
        "p": test.p,
        "p_min": test.p_min,
        "p_text": test.text,
        "sentence": test.sentence,
        "limits": list(found.limits),
        "reason": None if interval else NO_INTERVAL,
    }


def _signed(own: Sequence[VirtualFlight]) -> dict[str, Any]:
    groups = [np.array([constant_error_mm(flight) for flight in own if flight.group == group]) for group in GROUPS]
    trained, untrained = (values[np.isfinite(values)] for values in groups)
    if min(len(trained), len(untrained)) == 0:
        return {"appears": None, "reason": "Nobody of a group has a touch in the first window."}
    sizes = np.abs(trained), np.abs(untrained)  # who is as far above as others are below is no nearer
    difference, welch = welch_interval(*sizes)
    interval = ends_of(welch)
    ways = relabellings(len(trained), len(untrained), np.random.default_rng(0))
    test = permutation_test(np.concatenate(sizes), ways, ALPHA)
    return {
        **_verdict(difference, 0.0, interval, test.p),
        **_nearer(*sizes),
        "trained_mm": float(trained.mean()),
        "untrained_mm": float(untrained.mean()),
        "trained_size_mm": float(sizes[0].mean()),
        "untrained_size_mm": float(sizes[1].mean()),
        "difference_mm": difference,
        "ci95": interval,
        "p": test.p,
        "p_min": test.p_min,
        "p_text": test.text,
        "sentence": test.sentence,
        "reason": None if interval else NO_INTERVAL,
    }


def _verdict(value: float, none: float, ci95: Sequence[float] | None, p: float | None) -> dict[str, bool]:
    """What `value` says against one that means no effect; shown is what the test and the interval both show."""
    is_told = p is not None and p <= ALPHA and ci95 is not None and not ci95[0] <= none <= ci95[1]
    return {
        "appears": value < none,
        "is_shown": is_told and value < none,
        "is_opposite_shown": is_told and value > none,
    }


def _nearer(trained: PerPerson, untrained: PerPerson) -> dict[str, int]:
    """In how many pairs of a trained and an untrained person the trained one is nearer."""
    return {
        "pairs_nearer": int((trained[:, None] < untrained[None, :]).sum()),
        "pairs": len(trained) * len(untrained),
    }
