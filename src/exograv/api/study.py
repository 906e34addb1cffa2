"""Folder of a study: its tables and its report."""

from pathlib import Path
from typing import TYPE_CHECKING

from exograv.errors import ConfigError
from exograv.study.folder.columns import TABLES
from exograv.study.folder.settings import read_settings
from exograv.study.folder.study_folder import StudyFolder

if TYPE_CHECKING:
    import pandas as pd


class Study:
    """Study of several participants, as `exograv study` keeps it in a folder."""

    def __init__(self, folder: str | Path):
        """Open a study.

        Raises:
            ConfigError: The folder is not a study.
        """
        self._folder = StudyFolder(Path(folder))
        self._settings = read_settings(self._folder)

    @property
    def name(self) -> str:
        """Name of the study."""
        return self._settings.name

    @property
    def is_simulated(self) -> bool:
        """True if the participants of the study are simulated."""
        return self._settings.is_simulated

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables."""
        return tuple(TABLES)

    def table(self, name: str) -> "pd.DataFrame":
        """Read one table: touches, windows, sessions or participants, one row each.

        Raises:
            ConfigError: The study has no such table, or no session was added yet.
        """
        if name not in TABLES:
            raise ConfigError(f"The study has no table '{name}'. Tables: {', '.join(TABLES)}.")
        path = self._folder.table(name)
        if not path.is_file():
            raise ConfigError(f"{path} does not exist yet. Add sessions first: `exograv study add`.")
        import pandas as pd

        return pd.read_parquet(path)

    def columns(self, name: str) -> dict[str, str]:
        """Return the description of each column of a table.

        Raises:
            ConfigError: The study has no such table.
        """
        if name not in TABLES:
            raise ConfigError(f"The study has no table '{name}'. Tables: {', '.join(TABLES)}.")
        return {column.name: column.meaning for column in TABLES[name]}

    def report(self) -> Path:
        """Write the report of the study and return its page.

        Raises:
            ConfigError: The study holds no session that can be reported.
        """
        from exograv.report.study_report.report import write_study_report

        return write_study_report(self._folder.path).report
