"""What commands take that carry somebody in a machine on drives."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from exograv.cli.shell.base_options import Common

if TYPE_CHECKING:
    from exograv.live.on_drives.connection import DrivesAsked
    from exograv.live.on_drives.float_command import PersonForm


@dataclass(frozen=True)
class WornOnDrives(Common):
    """Which drives, and who is in the machine."""

    drives: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """drives.toml of a real machine that has passed its self-test here today, with who is in it."""

    simulate: bool = False
    """Practise on simulated drives in another process, with a virtual person in the machine."""

    body_height: Annotated[float | None, tyro.conf.arg(metavar="M")] = None
    """On drives: of the person in the machine [m]."""

    body_mass: Annotated[float | None, tyro.conf.arg(metavar="KG")] = None
    """On drives: of the person in the machine [kg]."""

    sex: Literal["female", "male"] | None = None
    """On drives: which table of body segments is nearer."""

    length: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="SEGMENT=M")] = ()
    """On drives: a measured segment of the arm, to which the machine is set, such as forearm=0.26. May be repeated."""

    @property
    def is_on_drives(self) -> bool:
        """Whether the machine is reached over its bus."""
        return self.drives is not None or self.simulate

    def asked(self, level: int) -> "DrivesAsked":
        """Which drives; the level is of simulated ones."""
        from exograv.live.on_drives.connection import DrivesAsked

        return DrivesAsked(self.drives, self.simulate, level, self.seed)

    def person(self) -> "PersonForm":
        """Who is in the machine."""
        from exograv.live.on_drives.float_command import PersonForm

        return PersonForm(self.body_height, self.body_mass, self.sex, self.length)


def say(text: str) -> None:
    """A line for whoever stands at the machine."""
    from rich.console import Console

    Console().print(text, highlight=False)
