"""A report reads the file chunk by chunk: the same page as from memory, in memory that the length does not change."""

import tracemalloc
from collections.abc import Callable
from dataclasses import astuple
from pathlib import Path

import pytest

from exograv.recording import Recording, open_recording, read_recording
from exograv.report.of_recording.recording_report import page_of
from exograv.report.style.figure_data import figure_csv
from memory import write_long

SHORT, LONG = 20_000, 80_000
GROWTH_MAX = 1.2
"""Largest ratio of the peaks of a report, of a recording and of one of four times its length.

What still grows are the arm's points at 10 Hz, which the choice of postures compares: 1 byte of a tick's 410.
"""


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording."""
    return written(tmp_path_factory.mktemp("short") / "a.mcap", SHORT)


def written(path: Path, ticks: int, packed: bool = False) -> Path:
    write_long(path, ticks, packed)
    return path


def peak_bytes(path: Path, read: Callable[[Path], Recording]) -> int:
    """Return the largest memory that the content of a page takes while it is made."""
    tracemalloc.start()
    try:
        page_of(read(path))
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def content(recording: Recording) -> list[object]:
    """Return all texts and numbers of a page."""
    page = page_of(recording)
    chapters = [
        (chapter.title, chapter.blocks, chapter.text, chapter.figure and figure_csv(chapter.figure))
        for chapter in page.chapters
    ]
    return [page.headline, page.facts, [astuple(tile) for tile in page.tiles], page.lead, *chapters]


@pytest.mark.slow  # tracing of every allocation makes four pages take a dozen seconds of CPU
def test_memory_of_a_report_does_not_grow_with_the_recording(short: Path, tmp_path: Path):
    page_of(open_recording(short))  # imports and fonts of the first page are not counted
    long = written(tmp_path / "long.mcap", LONG)
    assert peak_bytes(long, open_recording) < GROWTH_MAX * peak_bytes(short, open_recording)
    # The measurement sees growth: of a recording in memory all is kept.
    assert peak_bytes(long, read_recording) > 2.0 * peak_bytes(short, read_recording)


@pytest.mark.long
def test_the_page_from_the_file_is_the_page_from_memory(demo_recording: Path, tmp_path: Path):
    packed = written(tmp_path / "packed.mcap", SHORT, packed=True)
    for path in (packed, demo_recording):
        assert content(open_recording(path)) == content(read_recording(path))


def test_the_page_of_a_cut_recording_is_the_same_too(short: Path, tmp_path: Path):
    whole, path = short.read_bytes(), tmp_path / "cut.mcap"
    path.write_bytes(whole[: int(0.6 * len(whole))])
    assert content(open_recording(path)) == content(read_recording(path))
