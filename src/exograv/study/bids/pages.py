"""What a reader opens first: the data set's description, its README, its changes, and who took part."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exograv import __version__
from exograv.study.dataset.tables import Tables
from exograv.study.folder.columns import PARTICIPANTS
from exograv.study.folder.settings import StudySettings

from .behaviour import described, rows_of
from .files import write_json, write_table, write_text

BIDS_VERSION = "1.11.1"
SIMULATED = "SIMULATED"
"""What stands in the name of a data set that nobody took part in."""

NOBODY = "Simulated: nobody took part. Models of a person and of a machine moved. No evidence about people."
SOME = "Some sessions are simulated: nobody took part in them. They are marked in `_scans.tsv` and in each sidecar."

TIDY = Path("derivatives", "exograv")
"""Where the study's own tables are."""

README = """\
# {name}

{simulated}Pointing at a target on a touch screen, with an exoskeleton on the arm. Exported by exograv {version}:
{people} participants, {sessions} sessions, {touches} touches that count.

## What is where

| place | what |
|---|---|
| `participants.tsv` | who took part, by a code that was drawn at random; body data in bands |
| `…/motion/*_tracksys-exo_motion.tsv` | angle, velocity, torque of the joints; gravity level and safe state |
| `…/motion/*_tracksys-hand_motion.tsv` | the hand, by the model of the worn arm |
| `…/motion/*_tracksys-aircraft_motion.tsv` | acceleration, as the aircraft's feed told it |
| `…/motion/*_events.tsv` | windows, touches, rests, stops; `onset` counts from the first row of `tracksys-exo` |
| `…/motion/*_recording-*_physio.tsv.gz` | other devices: EMG, ECG, EEG …; values as received, on the robot's clock |
| `…/beh/*_beh.tsv` | one row a touch, also those that do not count, with the reason |
| `sourcedata/` | {raw} |
| `derivatives/exograv/` | the study's tidy tables as Parquet; SHA-256 of every file in `manifest.sha256` |

A session is called after its protocol and its number among this person's sessions of that protocol.

## What to know

- Right and down are positive on the screen. `deviation_*` is contact minus target. Millimetres are missing where the
  screen was not calibrated.
- Torque is what the motor adds, positive along the joint's axis. BIDS has no type for it: it is `MISC` in `N m`.
- Motion was filtered without delay before ticks were left out; the sidecars tell how. A row whose tick is missing has
  no values but its latency: nothing is carried across a gap.
- `tracksys-hand`, `tracksys-aircraft` and other devices begin `StartTime` seconds after the first row of
  `tracksys-exo`; their latency counts from their own first row.
- Recordings hold no date. `acq_time` in `_scans.tsv` is there only where somebody told it to the study.
- EMG and EEG are physiological recordings here, not in `emg/` or `eeg/`: those need electrodes, reference and line
  frequency, which streams do not tell. Nothing is lost: values are those received.
- A session without motion came from a table of touches, from XDF, or from a recording without a machine: windows and
  touches are here, all else is in its source.
- Sentences of the recordings (why a run was paused, notes) are not exported: somebody may have typed a name.
{left}"""


@dataclass(frozen=True)
class PageContent:
    """What the pages are made of."""

    settings: StudySettings
    tables: Tables
    subjects: dict[str, str]
    """Label of each code."""

    has_raw: bool
    left: Sequence[str]
    """Sentences on what was not exported."""

    @property
    def is_simulated(self) -> bool:
        """Nobody took part in any of it."""
        simulated = self.tables.sessions["is_simulated"]
        return self.settings.is_simulated or (len(simulated) > 0 and bool(simulated.all()))

    @property
    def name(self) -> str:
        """Of the data set."""
        return f"{self.settings.name} ({SIMULATED})" if self.is_simulated else self.settings.name

    def write(self, root: Path) -> None:
        """All pages."""
        write_json(root / "dataset_description.json", self._description("raw"))
        write_json(root / TIDY / "dataset_description.json", self._description("derivative"))
        write_text(root / "CHANGES", self._changes())
        write_text(root / "README.md", self._readme())
        self._write_participants(root)

    def _description(self, kind: str) -> dict[str, Any]:
        made_by = {"Name": "exograv", "Version": __version__, "Description": "exograv study export --bids"}
        return {
            "Name": self.name,
            "BIDSVersion": BIDS_VERSION,
            "DatasetType": kind,
            "License": self.settings.licence or None,
            "Authors": self.settings.authors or None,
            "Acknowledgements": NOBODY if self.is_simulated else None,
            "GeneratedBy": [made_by],
            "SourceDatasets": self._sources(kind),
        }

    def _sources(self, kind: str) -> list[dict[str, str]] | None:
        if kind == "derivative":
            return [{"URL": "../.."}]
        return [{"URL": "sourcedata"}] if self.has_raw else None

    def _readme(self) -> str:
        has_some = bool(self.tables.sessions["is_simulated"].any())
        warning = NOBODY if self.is_simulated else SOME if has_some else ""
        return README.format(
            name=self.name,
            simulated=f"**{warning}**\n\n" if warning else "",
            version=__version__,
            people=len(self.tables.participants),
            sessions=len(self.tables.sessions),
            touches=np.count_nonzero(self.tables.touches["is_accepted"]),
            raw="the recordings, byte for byte" if self.has_raw else "not in this copy: it was exported without",
            left="".join(f"- {sentence}\n" for sentence in self.left),
        )

    def _changes(self) -> str:
        """By the convention of CPAN; the date is that of the newest session, because no clock is read."""
        dates = sorted(str(told)[:10] for told in self.tables.sessions["acquired"].dropna())
        head = " ".join(["1.0.0", *dates[-1:]])
        return f"{head}\n  - {len(self.tables.sessions)} sessions, exported by exograv {__version__}.\n"

    def _write_participants(self, root: Path) -> None:
        columns = PARTICIPANTS[1:]
        rows = [
            {**row, "participant_id": f"sub-{self.subjects[row['participant']]}"}
            for row in rows_of(self.tables.participants, PARTICIPANTS)
        ]
        names = ["participant_id", *(column.name for column in columns)]
        write_table(root / "participants.tsv", names, rows)
        sidecar = described(columns)
        sidecar["group"]["Levels"] = dict(self.settings.groups)
        write_json(root / "participants.json", {"participant_id": {"Description": PARTICIPANTS[0].meaning}, **sidecar})
