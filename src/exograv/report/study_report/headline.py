"""Headline and tiles of the report: one sentence, and a few figures including the primary comparison."""

from exograv.report.study_figures.groups import label
from exograv.report.style.page import Tile
from exograv.study.measures.selecting import people as people_in
from exograv.study.measures.study_data import StudyData
from exograv.study.statistics.findings import StudyFindings

from .results import interval_words, number


def headline(data: StudyData, found: StudyFindings | None) -> str:
    """Return the result in a sentence, without any claim that the test does not support."""
    if data.touches.empty:
        return "There are no accepted touches yet, so there are no results."
    if data.is_sealed:
        return f"{_people(len(data.group_of))}, {len(data.touches)} accepted touches. Groups are sealed."
    if not data.has_primary:
        people = _people(people_in(data.touches))
        return f"No participant has flown yet: {len(data.touches)} touches of {people} on the ground."
    if found is None or any(spread.median is None for spread in found.spread.values()):
        people = _people(people_in(data.compared))
        return f"{len(data.compared)} touches of {people} in flight; there is no second group for a comparison."
    said = [
        f"{number(spread.median or 0.0)} {found.unit} {label(group)} (n\u00a0=\u00a0{spread.people})"
        for group, spread in found.spread.items()
    ]
    return f"Median deviation in flight: {', '.join(said)}."


def _people(n: int) -> str:
    return "one person" if n == 1 else f"{n} people"


def tiles(data: StudyData, found: StudyFindings | None) -> list[Tile]:
    """Return the tiles under the headline."""
    if found is None:
        return []
    shown = []
    for group, spread in found.spread.items():
        if spread.median is not None and spread.quartiles is not None:
            low, high = (number(q) for q in spread.quartiles)
            note = f"half of {spread.touches} touches within {low} to {high} {found.unit}"
            shown.append(
                Tile(f"{label(group)}, {_people(spread.people)}", f"{number(spread.median)} {found.unit}", note)
            )
    if found.effect.value is not None:
        note = "no interval can be computed" if found.effect.interval is None else interval_words(found.effect.interval)
        shown.append(Tile(f"{found.groups[0]} over {found.groups[1]}", number(found.effect.value), note))
    if found.primary.p is not None:
        smallest = f"smallest possible: {number(found.primary.p_min)}" if found.primary.p_min is not None else ""
        shown.append(Tile(found.primary.name, found.primary.text.split(",")[0], smallest))
    return shown
