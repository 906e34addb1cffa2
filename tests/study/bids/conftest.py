"""Fixtures: a small study and its export, made once."""

from pathlib import Path

import pytest

from exograv.study.folder.study_folder import StudyFolder

from .small_study import export, write_study


@pytest.fixture(scope="session")
def small_study(tmp_path_factory: pytest.TempPathFactory) -> StudyFolder:
    """Return the study. No test may write into it."""
    return write_study(tmp_path_factory.mktemp("bids") / "study")


@pytest.fixture(scope="session")
def exported(small_study: StudyFolder) -> Path:
    """Return the data set of the study. No test may write into it."""
    out = small_study.path.parent / "bids"
    export(small_study, out)
    return out
