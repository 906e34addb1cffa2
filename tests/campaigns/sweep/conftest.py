"""A study's file in a folder of its own."""

from collections.abc import Callable
from pathlib import Path

import pytest

from exograv.campaigns.sweep.study_file import Study, load_study

StudyOf = Callable[..., Study]


@pytest.fixture
def study_of(tmp_path: Path) -> StudyOf:
    """Of a kind, and of the values in its grid as TOML has them."""

    def make(kind: str = "probe", **grid: object) -> Study:
        path = tmp_path / "STUDY.toml"
        lines = (
            f"{name} = {value if isinstance(value, (int, float, list)) else repr(value)}"
            for name, value in grid.items()
        )
        path.write_text(f'title = "try"\nkind = "{kind}"\n[grid]\n' + "\n".join(lines) + "\n")
        return load_study(path)

    return make
