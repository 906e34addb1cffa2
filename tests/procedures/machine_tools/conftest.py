"""Fixtures of the tools for machines."""

import pytest

from exograv.report.style import figure_style


@pytest.fixture
def without_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skip drawing, which takes as long as everything else."""
    monkeypatch.setattr(figure_style, "write_picture", lambda path, _draw: path)
