"""Options that do not go together are refused before the machine is calibrated."""

from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.laboratory.demo import run_demo
from exograv.laboratory.options import DemoOptions, IdentifyOptions
from exograv.laboratory.preparation import no_progress
from exograv.procedures.identification.options import ParticipantOptions

FILE = Path("P-07.toml")


@pytest.mark.parametrize(
    ("option", "files"),
    [("--keep", ParticipantOptions(keep=FILE)), ("--participant", ParticipantOptions(participant=FILE))],
)
def test_a_participants_file_is_refused_for_a_method_without_uncertainty_before_anything_is_written(
    option: str, files: ParticipantOptions, tmp_path: Path
):
    with pytest.raises(ConfigError, match=rf"{option} needs a method that states its uncertainty; 'gradient'"):
        run_demo(DemoOptions(method="gradient"), tmp_path / "out", no_progress, files)
    assert not list(tmp_path.iterdir())


def test_an_adaptive_motion_is_refused_with_the_options_for_a_method_without_uncertainty():
    with pytest.raises(ConfigError, match=r"--motion adaptive needs .*; 'nlms' does not"):
        IdentifyOptions(motion="adaptive", method="nlms")
