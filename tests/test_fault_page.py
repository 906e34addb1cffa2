"""The page of all faults has every fault with its budget, the causes of its misses, and its tests."""

import pytest
from tests.docs_scripts import docs_script

from exograv.campaigns.faults.fault_table import FAULTS
from exograv.campaigns.faults.fault_tests import TESTED_FAULTS
from exograv.campaigns.faults.known_misses import KNOWN_MISSES


@pytest.fixture(scope="module")
def page() -> str:
    """Page that `make docs` writes."""
    return docs_script("fault_tables").fault_page()


def test_every_flown_fault_has_a_row_with_its_budget(page: str):
    table = [cells for line in page.splitlines() if len(cells := line.split(" | ")) == 5]
    rows = {cells[0].removeprefix("| "): cells for cells in table}
    for fault in FAULTS.values():
        _, what, _, budget, _ = rows[fault.id]
        assert what == fault.what
        assert fault.budget_ms is None or float(budget) == fault.budget_ms


def test_the_cause_of_every_known_miss_is_stated(page: str):
    assert all(miss.cause in page for miss in KNOWN_MISSES.values())


def test_every_test_of_a_fault_without_a_flight_is_named(page: str):
    assert all(f"`{test}`" in page for fault in TESTED_FAULTS for test in fault.proved_by)
