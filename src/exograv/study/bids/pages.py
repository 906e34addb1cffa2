"""Pages of a data set: description, README, changes and participants."""

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
"""Mark in the name of a data set in which nobody took part."""

NOBODY = "Simulated: nobody took part. Models of a person and of a machine moved. No evidence about people."
SOME = "Some sessions are simulated: nobody took part in them. They are marked in `_scans.tsv` and in each sidecar."

TIDY = Path("derivatives", "exograv")
"""Folder of the study's own tables."""

README = """\
# {name}

{simulated}Pointing at a target on a touch screen, with an exoskeleton on the arm. Exported by exograv {version}:
{people} participants, {sessions} sessions, {touches} accepted touches.

## Content

| place | what |
|---|---|
| `participants.tsv` | participants, by randomly drawn codes; body data in bands |
| `…/motion/*_tracksys-exo_motion.tsv` | angle, velocity, torque of the joints; gravity level and safe state |
| `…/motion/*_tracksys-hand_motion.tsv` | position of the hand, from the model of the worn arm |
| `…/motion/*_tracksys-aircraft_motion.tsv` | acceleration, as the aircraft's feed reported it |
| `…/motion/*_events.tsv` | windows, touches, rests, stops; `onset` counts from the first row of `tracksys-exo` |
| `…/eeg/*_eeg.bdf`, `…/emg/*_emg.bdf` | EEG and EMG at even times of the robot's clock, each with its own events |
| `…/motion/*_recording-*_physio.tsv.gz` | other devices, such as ECG; values as received, on the robot's clock |
| `…/beh/*_beh.tsv` | one row per touch; rejected touches with the reason |
| `sourcedata/` | {raw} |
| `derivatives/exograv/` | the study's tidy tables as Parquet; SHA-256 of every file in `manifest.sha256` |

The name of a session is its protocol and its number among the person's sessions of that protocol.

## Notes

- Right and down are positive on the screen. `deviation_*` is contact minus target. Values in millimetres are missing
  if the screen was not calibrated.
- Torque is that of the motor, positive along the joint's axis. BIDS has no type for it: it is `MISC` in `N m`.
- Motion was filtered without delay before the rate was reduced; the sidecars describe the filter. A row whose tick is
  missing has a latency but no other values: no value is carried across a gap.
- `tracksys-hand`, `tracksys-aircraft` and other devices begin `StartTime` seconds after the first row of
  `tracksys-exo`; their latency counts from their own first row.
- Recordings hold no date. `acq_time` in `_scans.tsv` is given only if the date was stated for the study.
- EEG and EMG have 24 bits per value: voltages are rounded by at most 0.1 µV. They are interpolated to even times, which
  removes the drift of the device's clock. An event `BAD_ACQ_SKIP` marks a part in which the device sent nothing.
- A session without motion comes from a table of touches, from XDF, or from a recording without a machine. Its windows
  and touches are here; all other data are in its source.
- Sentences of the recordings (reasons of pauses, notes) are not exported, because they may contain a name.
{left}"""


@dataclass(frozen=True)
class PageContent:
    """Content of the pages of a data set."""

    settings: StudySettings
    tables: Tables
    subjects: dict[str, str]
    """Label of each code."""

    has_raw: bool
    left: Sequence[str]
    """Sentences on streams that were not exported."""

    @property
    def is_simulated(self) -> bool:
        """Return True if nobody took part in any session."""
        simulated = self.tables.sessions["is_simulated"]
        return self.settings.is_simulated or (len(simulated) > 0 and bool(simulated.all()))

    @property
    def name(self) -> str:
        """Name of the data set."""
        return f"{self.settings.name} ({SIMULATED})" if self.is_simulated else self.settings.name

    def write(self, root: Path) -> None:
        """Write all pages into the folder of the data set."""
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
            raw="the recordings, byte for byte"
            if self.has_raw
            else "not in this copy, which was exported without them",
            left="".join(f"- {sentence}\n" for sentence in self.left),
        )

    def _changes(self) -> str:
        """Return the changes in CPAN's format. The date is that of the newest session, so that no clock is read."""
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
