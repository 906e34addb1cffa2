"""A run's result has the fields of the contract, and states each missing implementation with its reason."""

import json
from pathlib import Path

import pytest

from exograv.errors import RecordingError
from peers.compare import changes, read_run, show_changes
from peers.opponents import JaxByHand, JaxTranslated, Native, Pinocchio
from peers.ratios import BATCH, RATIOS
from peers.section_supervisor import Findings
from peers.table import show_bench
from peers.whole_run import gathered, result_of

COMPUTER = {
    "cpu": "a processor",
    "cores": 2,
    "frequency_MHz": None,
    "os": "an os",
    "python": "3.11",
    "load_before": 9.0,
    "busy": True,
}


@pytest.fixture
def findings(make_row) -> Findings:
    rows = [
        make_row("rnea_7", Native.name, 0.2),
        make_row("rnea_7", Pinocchio.name, 1.5),
        make_row("tick_aligned_7", Native.name, 0.4),
        make_row("tick_aligned_7", JaxByHand.name, 40.0),
        make_row("tick_aligned_7", JaxTranslated.name, 80.0),
        make_row(BATCH, Native.name, 3e7, "evaluations/s"),
        make_row(BATCH, JaxByHand.name, 1.5e6, "evaluations/s"),
    ]
    return Findings(rows=rows)


def test_a_ratio_is_of_medians_against_the_fastest_of_its_kind(findings: Findings):
    ratios = result_of(findings, COMPUTER, quick=True)["ratios"]
    assert ratios == {
        "rnea_vs_pinocchio": 7.5,
        "tick_vs_c": None,
        "batch_tick_vs_c": None,
        "tick_vs_jax": 100.0,
        "batch_tick_vs_jax": None,
        "batch_rnea_vs_c": None,
        "batch_rnea_vs_jax_vmap": 20.0,
        "batch_rnea_vs_pinocchio": None,
    }


def test_a_ratio_is_null_without_us(findings: Findings):
    others = [row for row in findings.rows if row["implementation"] != Native.name]
    assert result_of(Findings(rows=others), COMPUTER, quick=True)["ratios"] == dict.fromkeys(RATIOS)


def test_rows_have_the_contracts_fields_and_no_more(findings: Findings):
    result = result_of(findings, COMPUTER, quick=True)
    wanted = {"name", "implementation", "unit", "p50", "p99", "p999", "max", "n", "error_vs_reference"}
    assert all(set(row) == wanted for row in result["rows"])
    json.dumps(result, allow_nan=False)


def test_missing_rows_are_gathered_by_who_and_why():
    entries = [
        {"implementation": "A", "row": "1", "reason": "x"},
        {"implementation": "A", "row": "2", "reason": "x"},
        {"implementation": "A", "row": "1", "reason": "x"},
        {"implementation": "A", "row": "3", "reason": "y"},
    ]
    assert gathered(entries) == [
        {"implementation": "A", "reason": "x", "rows": ["1", "2"]},
        {"implementation": "A", "reason": "y", "rows": ["3"]},
    ]


def test_a_comparison_says_how_many_times_faster_in_either_unit(make_row):
    before = {"rows": [make_row("a", "x", 2.0), make_row("b", "x", 100.0, "evaluations/s"), make_row("c", "x", 1.0)]}
    after = {"rows": [make_row("a", "x", 1.0), make_row("b", "x", 400.0, "evaluations/s"), make_row("d", "x", 1.0)]}
    assert [times for _, _, times in changes(before, after)] == [2.0, 4.0]


@pytest.mark.parametrize("text", ["no json", "[]", '{"rows": 3}', '{"rows": [{"name": "a"}]}'])
def test_a_file_that_holds_no_run_is_refused_with_what_to_give(text: str, tmp_path: Path):
    path = tmp_path / "before.json"
    path.write_text(text)
    with pytest.raises(RecordingError, match=r"kernels\.py --save"):
        read_run(path)


def test_a_missing_file_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match="cannot be read"):
        read_run(tmp_path / "none.json")


def test_a_small_terminal_shows_all_of_it(findings: Findings, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    result = result_of(findings, COMPUTER, quick=True)
    show_bench(result)
    show_changes(result, result, "before.json")
    shown = capsys.readouterr().out
    assert "was busy before the run" in shown
    assert "7.5 times faster" in " ".join(shown.split())
    assert "one of the two is missing" in " ".join(shown.split())
    assert "0 of them changed" in shown
