"""A kept calibration is taken by the same machine and source only, and a missing one is no error."""

from pathlib import Path

import numpy as np
import pytest

from exograv import kernel
from exograv.identification.calibration.empty_machine import Calibration
from exograv.laboratory.kept_calibration import keep, kept_file, take_kept
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.procedures.calibration.nominal_machine import nominal_machine


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(kernel, "source_digest", lambda: "source")


def laboratory(seed: int = 0, level: int = 2) -> VirtualLaboratory:
    return draw_laboratory("recupera_like", None, level, seed)


def file_of(seed: int = 0, level: int = 2) -> Path:
    file = kept_file(laboratory(seed, level), seed)
    assert file is not None
    return file


def calibration(of: VirtualLaboratory) -> Calibration:
    n = len(of.description.joints)
    machine = nominal_machine(of.description, np.full((n, 10), 0.1))
    return Calibration(machine, np.zeros(2), np.full(2, 0.001), np.zeros(n), np.full(n, 0.001), np.full((n, 10), 0.01))


def test_a_kept_calibration_is_taken_again_with_its_time():
    whole, file = laboratory(), file_of()
    assert take_kept(file, whole) is None
    keep(file, whole, calibration(whole), 307.0)
    taken = take_kept(file_of(), laboratory())
    assert taken is not None
    assert taken.whole.measured.running_s == 307.0
    np.testing.assert_allclose(taken.whole.calibration().machine.phi, 0.1)


def test_another_machine_or_source_has_another_file(monkeypatch: pytest.MonkeyPatch):
    files = {file_of(), file_of(seed=1), file_of(level=3)}
    monkeypatch.setattr(kernel, "source_digest", lambda: "changed")
    assert len(files | {file_of()}) == 4


def test_nothing_is_kept_while_the_source_is_edited(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(kernel, "source_digest", lambda: None)
    assert kept_file(laboratory(), 0) is None


def test_a_damaged_file_is_calibrated_anew():
    whole, file = laboratory(), file_of()
    keep(file, whole, calibration(whole), 307.0)
    file.write_text(file.read_text().replace("307.0", "308.0"))
    assert take_kept(file, whole) is None
