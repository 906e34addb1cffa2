"""A laboratory rehearses through simulated drives on its own fitted machine."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from tests.made_twin import made_twin, with_twin_in

from exograv import cli
from exograv.errors import ConfigError
from exograv.live.on_drives import connection
from exograv.live.on_drives.connection import drives_of
from exograv.model.description import RigDescription, load_rig
from exograv.next_command import same_machine
from exograv.options import MachineOptions
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.rig.drives.settings import load_drives
from exograv.storage.machine_readiness import serial_of

RIG = load_rig("recupera_like")


@pytest.fixture
def mine(tmp_path: Path) -> RigDescription:
    """Return a machine with a fitted twin."""
    return load_rig(str(with_twin_in(tmp_path / "mine", RIG, made_twin(RIG))))


def test_simulated_drives_are_started_with_the_fitted_twin_and_its_draw(
    mine: RigDescription, monkeypatch: pytest.MonkeyPatch
):
    started: list[Sequence[str]] = []

    @contextlib.contextmanager
    def start(_bus: str, options: Sequence[str]) -> Iterator[Callable[[str], None]]:
        started.append(options)
        yield lambda _line: None

    monkeypatch.setattr(connection, "simulated_drives", start)
    options = MachineOptions(str(mine.folder), simulate=True, seed=7, twin="fitted")
    with drives_of(options, mine):
        pass
    simulation = cli.parsed(*cli.resolved(["dev", "drive-sim", *started[0]]))
    assert (simulation.twin, simulation.seed, Path(simulation.rig)) == ("fitted", 7, mine.folder)


def test_a_draw_of_the_fitted_twin_has_a_calibration_and_a_self_test_of_its_own(mine: RigDescription, tmp_path: Path):
    drives = load_drives(written(tmp_path, mine), mine)
    rig = str(mine.folder)
    fitted = [serial_of(MachineOptions(rig, simulate=True, seed=seed, twin="fitted"), drives) for seed in (7, 8)]
    drawn = serial_of(MachineOptions(rig, simulate=True, seed=7), drives)
    with_twin_in(tmp_path / "other", RIG, made_twin(RIG, 0.1))
    refitted = serial_of(MachineOptions(str(tmp_path / "other"), simulate=True, seed=7, twin="fitted"), drives)
    assert len({*fitted, drawn, refitted}) == 4


def test_a_machine_without_a_fitted_twin_says_how_to_make_one(tmp_path: Path):
    drives = load_drives(written(tmp_path, RIG), RIG)
    with pytest.raises(ConfigError, match="exograv twin fit"):
        serial_of(MachineOptions(simulate=True, twin="fitted"), drives)


def test_the_next_command_has_the_same_twin():
    options = MachineOptions("mine", simulate=True, twin="fitted")
    assert same_machine("rig self-test", options) == "exograv rig self-test mine --simulate --twin fitted"
    assert "--twin" not in same_machine("rig self-test", MachineOptions("mine", simulate=True))
