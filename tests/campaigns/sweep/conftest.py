"""Fixture of a study file in its own folder."""

from collections.abc import Callable
from pathlib import Path

import pytest

from exograv.campaigns.sweep.study_file import Study, load_study

StudyOf = Callable[..., Study]


@pytest.fixture
def study_of(tmp_path: Path) -> StudyOf:
    """Maker of studies from a kind and the values of its grid."""

    def make(kind: str = "probe", **grid: object) -> Study:
        path = tmp_path / "STUDY.toml"
        lines = (
            f"{name} = {value if isinstance(value, (int, float, list)) else repr(value)}"
            for name, value in grid.items()
        )
        path.write_text(f'title = "try"\nkind = "{kind}"\n[grid]\n' + "\n".join(lines) + "\n")
        return load_study(path)

    return make
