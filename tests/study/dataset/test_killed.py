"""A command that is killed at any moment leaves a readable study, and the same command then completes the work."""

import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.study.made_up_sessions import BEGUN_S, settings, study_with, write_session

from exograv.files import PARTIAL
from exograv.study.dataset.adding import add_files
from exograv.study.dataset.making import current_tables
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.sources import placed_sources, sha256_of
from exograv.study.dataset.tables import read_tables
from exograv.study.folder.study_folder import StudyFolder

SESSIONS = 6
SEED = 1013


QUIET: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}


def command(study: Path, files: Path) -> list[str]:
    return [sys.executable, "-m", "exograv.cli", "study", "add", str(study), str(files), "--replace"]


@pytest.mark.slow
def test_whenever_it_is_killed_the_study_is_whole(tmp_path: Path):
    chance = random.Random(SEED)
    folder, (code,) = study_with(tmp_path / "study", "trained")
    files = [
        write_session(
            tmp_path / "in" / f"{k}.mcap", settings(code, session=k), times=BEGUN_S + 0.001 * np.arange(30_000)
        )
        for k in range(1, SESSIONS + 1)
    ]
    hashes = {sha256_of(path) for path in files}
    begun = time.monotonic()
    subprocess.run(command(shutil.copytree(folder.path, tmp_path / "unkilled"), tmp_path / "in"), check=True, **QUIET)
    takes_s, killed = time.monotonic() - begun, 0
    for k in range(12):
        # Most runs start from the beginning; some continue where the run before was killed.
        if chance.random() < 0.7:
            folder = StudyFolder(shutil.copytree(tmp_path / "study", tmp_path / f"study-{k}"))
        process = subprocess.Popen(command(folder.path, tmp_path / "in"), **QUIET)
        time.sleep(takes_s * chance.uniform(0.4, 0.95))
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
        there = {source.note.sha256: source for source in placed_sources(folder)}
        assert there.keys() <= hashes
        assert all(sha256_of(source.path) == sha256 for sha256, source in there.items())
        read_tables(folder)
        if chance.random() < 0.5:
            assert set(current_tables(folder).sessions["sha256"]) == there.keys()
    assert killed >= 6
    add_files(folder, files, AddOptions())
    assert set(read_tables(folder).sessions["sha256"]) == hashes
    assert len(read_tables(folder).touches) == 5 * SESSIONS
    assert not list(folder.path.rglob(f"{PARTIAL}*"))
