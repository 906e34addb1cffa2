"""The published page lists lost rows first, and states a ratio against JAX beside the same ratio against C."""

from pathlib import Path

import pytest

from peers.compare import read_run
from peers.opponents import GeneratedC, JaxByHand, Native
from peers.ratios import BATCH_TICK
from publish import generated

RESULTS = Path(__file__).parents[3] / "benchmarks" / "results.json"


@pytest.fixture(scope="module")
def page() -> str:
    return "\n".join(generated(read_run(RESULTS)))


def test_rows_that_we_lose_come_before_rows_that_we_win(page: str):
    assert page.index("### Where an opponent is faster") < page.index("### Ratios") < page.index("### Single calls")


def test_one_call_and_a_batch_against_jax_stand_beside_generated_c(page: str):
    kinds = ("one call from Python", "1024 states a call, one core")
    rows = [f"| aligned tick of 7 joints, {kind}, against {who}" for who in ("CasADi", "JAX") for kind in kinds]
    lines = page.splitlines()
    found = [next(k for k, line in enumerate(lines) if line.startswith(row)) for row in rows]
    assert found == list(range(found[0], found[0] + len(rows)))


def test_a_ratio_is_that_of_the_rows_in_the_table(page: str):
    rows = {(row["name"], row["implementation"]): row["p50"] for row in read_run(RESULTS)["rows"]}
    tick, batch = "tick_aligned_7", BATCH_TICK
    for value, row in (
        (rows[tick, GeneratedC.name] / rows[tick, Native.name], "one call from Python, against CasADi"),
        (rows[batch, Native.name] / rows[batch, JaxByHand.name], "1024 states a call, one core, against JAX"),
    ):
        assert f"| **{value:.3g}** |" in next(line for line in page.splitlines() if f"7 joints, {row}" in line)
