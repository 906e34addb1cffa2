"""Groups are drawn evenly before the study, are concealed in the list, and affect only the machine's mode."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.task.allocation import AllocatedPlace, AllocationList, Group, draw_list, exo_for, group_of, sizes
from exograv.task.protocol import load_protocol

GROUPS = [Group(name="carried", exo="active"), Group(name="sham", exo="sham")]
CODES = [f"P{k:02d}" for k in range(12)]


@given(seed=st.integers(1000, 10**9))
def test_groups_never_differ_by_more_than_one(seed: int):
    drawn = draw_list("study", CODES, GROUPS, seed)
    assert sizes(drawn) == {"carried": 6, "sham": 6}
    for k in range(len(CODES)):
        counts = Counter(group_of(drawn, code).name for code in CODES[: k + 1])
        assert abs(counts["carried"] - counts["sham"]) <= 1


def test_another_seed_draws_another_order_and_the_same_seed_the_same():
    orders = [
        tuple(group_of(draw_list("study", CODES, GROUPS, seed), code).name for code in CODES)
        for seed in (1000, 1000, 1001)
    ]
    assert orders[0] == orders[1] != orders[2]


def test_a_place_of_the_list_shows_no_group():
    text = draw_list("study", CODES, GROUPS, 1000).model_dump_json()
    places = text.split('"places"')[1]
    assert "carried" not in places
    assert "sham" not in places
    assert len({place.seal for place in AllocationList.model_validate_json(text).places}) == len(CODES)


def test_a_group_changes_what_an_active_machine_does_and_nothing_else():
    training, flight = (load_protocol(name).settings for name in ("training", "flight"))
    assert [exo_for(training, group) for group in (None, *GROUPS)] == ["active", "active", "sham"]
    assert {exo_for(flight, group) for group in (None, *GROUPS)} == {"passive"}


def test_who_is_not_on_the_list_and_whose_seal_was_changed_is_refused():
    drawn = draw_list("study", CODES, GROUPS, 1000)
    with pytest.raises(ConfigError, match="'Q99' has no place"):
        group_of(drawn, "Q99")
    forged = drawn.model_copy(update={"places": [AllocatedPlace(code="P00", seal=drawn.places[1].seal)]})
    with pytest.raises(ConfigError, match="was edited"):
        group_of(forged, "P00")


def test_places_that_do_not_fill_whole_blocks_are_refused():
    with pytest.raises(ConfigError, match="11 participants cannot be divided equally among 2 groups"):
        draw_list("study", CODES[:-1], GROUPS, 1000)


def test_a_code_twice_is_refused():
    with pytest.raises(ValueError, match="P00 twice"):
        draw_list("study", ["P00", "P00"], GROUPS, 1000)
