"""Memory growth is reported per hour, for the present process, and only after a run that was long enough."""

from pathlib import Path

import pytest

from exograv.live.footprint import EVERY_S, LEAST_S, MB, SETTLED_S, Footprint


class Computer:
    """Clock, and processes that grow by a hundredth of a megabyte per second."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch):
        self.folder, self.now, self.pid = folder, 1000.0, 7
        monkeypatch.setattr("time.monotonic", lambda: self.now)
        self.footprint = Footprint({"guard": lambda: self.pid}, folder)

    def run(self, seconds: float, first_mb: float, per_s_mb: float, files: int = 3) -> None:
        begun, folder = self.now, self.folder / str(self.pid)
        (folder / "fd").mkdir(parents=True)
        for k in range(files):
            (folder / "fd" / str(k)).touch()
        while self.now < begun + seconds:
            pages = round((first_mb + per_s_mb * (self.now - begun)) * MB / self.footprint._page)
            (folder / "statm").write_text(f"999 {pages} 1 1 0 1 0")
            self.footprint.check()
            self.now += EVERY_S


@pytest.fixture
def computer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Computer:
    return Computer(tmp_path, monkeypatch)


def test_growth_is_that_of_the_memory_by_the_hour(computer: Computer):
    computer.run(SETTLED_S + 2 * LEAST_S, 100.0, 0.01)
    found = computer.footprint.figures()["guard"]
    assert found.growth_MB_per_h == pytest.approx(36.0, rel=0.01)
    assert found.memory_MB[0] == pytest.approx(100.0, abs=0.1)
    assert found.descriptors == [3, 3, 3]


def test_nothing_is_said_of_growth_after_a_short_run(computer: Computer):
    computer.run(SETTLED_S + 0.5 * LEAST_S, 100.0, 0.01)
    assert computer.footprint.figures()["guard"].growth_MB_per_h is None


def test_a_process_that_was_replaced_is_not_taken_for_one_that_shrank(computer: Computer):
    computer.run(SETTLED_S + LEAST_S, 500.0, 1.0)
    computer.pid = 8
    computer.run(SETTLED_S + 2 * LEAST_S, 100.0, 0.01)
    assert computer.footprint.figures()["guard"].growth_MB_per_h == pytest.approx(36.0, rel=0.01)


def test_a_process_that_is_gone_is_left_out(computer: Computer):
    computer.footprint.check()
    assert computer.footprint.figures() == {}
