"""How files of a data set are called: `sub-…_ses-…_task-…`, labels of letters and digits only."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePosixPath

from exograv.errors import ConfigError

TASK = "pointing"
EXO = "exo"
"""Tracking system: the exoskeleton's encoders and motors."""

HAND = "hand"
"""Tracking system: where the model of the worn arm has the hand."""

AIRCRAFT = "aircraft"
"""Tracking system: the aircraft's own accelerometer."""


def label(text: str) -> str:
    """Letters and digits of a text, which is all that BIDS allows."""
    return re.sub(r"[^0-9A-Za-z]", "", text)


def labels(texts: Iterable[str], what: str) -> dict[str, str]:
    """A label for each text.

    Raises:
        ConfigError: Two texts would have one label, or one would have none.
    """
    found = dict[str, str]()
    for text in texts:
        short = label(text)
        if not short:
            raise ConfigError(f"{what} '{text}' has neither letter nor digit; BIDS needs one. Rename it in the study.")
        if short in found.values():
            other = next(name for name, known in found.items() if known == short)
            raise ConfigError(
                f"{what}s '{other}' and '{text}' are both '{short}' in BIDS, which allows letters and digits only. "
                "Rename one of them in the study."
            )
        found[text] = short
    return found


@dataclass(frozen=True)
class SessionPlace:
    """Where the files of one session are, from the data set's root."""

    subject: str
    session: str
    """Labels."""

    @property
    def folder(self) -> PurePosixPath:
        """Of all its files."""
        return PurePosixPath(f"sub-{self.subject}", f"ses-{self.session}")

    @property
    def scans(self) -> PurePosixPath:
        """The list of its files."""
        return self.folder / f"sub-{self.subject}_ses-{self.session}_scans.tsv"

    def motion(self, system: str, ending: str) -> PurePosixPath:
        """A file of a tracking system, such as `motion.tsv`."""
        return self._file("motion", f"tracksys-{system}_{ending}")

    def behaviour(self, ending: str) -> PurePosixPath:
        """A file of what the participant did, such as `beh.tsv`."""
        return self._file("beh", ending)

    def device(self, kind: str, recording: str, ending: str) -> PurePosixPath:
        """A file of another device, in the folder of this kind of data."""
        return self._file(kind, f"recording-{recording}_{ending}" if recording else ending)

    def _file(self, kind: str, ending: str) -> PurePosixPath:
        return self.folder / kind / f"sub-{self.subject}_ses-{self.session}_task-{TASK}_{ending}"
