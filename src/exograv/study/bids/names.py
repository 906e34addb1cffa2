"""Names of files of a data set: `sub-…_ses-…_task-…`, with labels of letters and digits only."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePosixPath

from exograv.errors import ConfigError
from exograv.study.folder.stream_settings import BiosignalType

TASK = "pointing"
EXO = "exo"
"""Tracking system of the exoskeleton's encoders and motors."""

HAND = "hand"
"""Tracking system of the hand, from the model of the worn arm."""

AIRCRAFT = "aircraft"
"""Tracking system of the aircraft's own accelerometer."""


def label(text: str) -> str:
    """Return the letters and digits of a text; BIDS allows no other characters in a label."""
    return re.sub(r"[^0-9A-Za-z]", "", text)


def labels(texts: Iterable[str], what: str) -> dict[str, str]:
    """Return a label for each text.

    Raises:
        ConfigError: Two texts have the same label, or a text has none.
    """
    found = dict[str, str]()
    for text in texts:
        short = label(text)
        if not short:
            raise ConfigError(
                f"{what} '{text}' has no letter and no digit; BIDS needs at least one. Rename it in the study."
            )
        if short in found.values():
            other = next(name for name, known in found.items() if known == short)
            raise ConfigError(
                f"{what}s '{other}' and '{text}' both become '{short}' in BIDS, which allows letters and digits only. "
                "Rename one of them in the study."
            )
        found[text] = short
    return found


@dataclass(frozen=True)
class SessionPlace:
    """Paths of the files of one session, from the data set's root."""

    subject: str
    session: str
    """Label of the session; `subject` is the label of the participant."""

    @property
    def folder(self) -> PurePosixPath:
        """Folder of all files of the session."""
        return PurePosixPath(f"sub-{self.subject}", f"ses-{self.session}")

    @property
    def scans(self) -> PurePosixPath:
        """Path of the list of the session's files."""
        return self.folder / f"sub-{self.subject}_ses-{self.session}_scans.tsv"

    def motion(self, system: str, ending: str) -> PurePosixPath:
        """Path of a file of a tracking system, such as `motion.tsv`."""
        return self._file("motion", f"tracksys-{system}_{ending}")

    def behaviour(self, ending: str) -> PurePosixPath:
        """Path of a file of the participant's behaviour, such as `beh.tsv`."""
        return self._file("beh", ending)

    def biosignal(self, kind: BiosignalType, label: str, ending: str) -> PurePosixPath:
        """Path of a file of an EEG or EMG stream; the label distinguishes several streams of a session."""
        # BIDS 1.11 has no entity `recording` for EEG, and prefers it for several devices of EMG.
        entity = "acq" if kind == "EEG" else "recording"
        return self._file(kind.lower(), f"{entity}-{label}_{ending}" if label else ending)

    def _file(self, kind: str, ending: str) -> PurePosixPath:
        return self.folder / kind / f"sub-{self.subject}_ses-{self.session}_task-{TASK}_{ending}"
