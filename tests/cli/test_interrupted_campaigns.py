"""A campaign that Ctrl-C stops does not end like a complete one, and leaves earlier pages as they are."""

from pathlib import Path
from typing import Any

import pytest

from exograv.campaigns.benchmark_identification.benchmark import BenchmarkResult, summary
from exograv.campaigns.benchmark_identification.options import BenchmarkOptions
from exograv.campaigns.faults.campaign import Campaign
from exograv.campaigns.faults.evaluation import figures_of
from exograv.campaigns.faults.options import FaultOptions
from exograv.cli.shell.base_options import OutFolder
from exograv.cli.simulation.benchmark_identification import FirstSeed, run_benchmark_identification
from exograv.cli.simulation.faults import run_faults_command


def test_an_interrupted_fault_campaign_says_how_to_continue_and_does_not_succeed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def flown(campaign: Campaign, _progress: Any) -> Any:
        return figures_of([], campaign.faults, campaign.seed, campaign.level, campaign.through)

    monkeypatch.setattr("exograv.campaigns.faults.campaign.run_campaign", flown)
    options = OutFolder(out=tmp_path, json=tmp_path / "figures.json")
    with pytest.raises(KeyboardInterrupt):
        run_faults_command(FaultOptions(scenarios=20), options)
    assert "0 of 20 scenarios were flown. Continue with --resume." in capsys.readouterr().out
    assert (tmp_path / "figures.json").is_file()


def test_a_benchmark_that_is_interrupted_before_its_first_run_leaves_the_earlier_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    page = tmp_path / "benchmark_identification.md"
    page.write_text("earlier")

    def interrupted(*_: object) -> BenchmarkResult:
        return BenchmarkResult(summary([]), BenchmarkOptions(), 0, 1, 0, True, tmp_path / "runs.jsonl", 0.0)

    monkeypatch.setattr("exograv.campaigns.benchmark_identification.benchmark.run_benchmark", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_benchmark_identification(BenchmarkOptions(), FirstSeed(), OutFolder(out=tmp_path))
    assert page.read_text() == "earlier"
