"""Command `exograv data view`: a machine or a recording as a moving picture."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from exograv.cli.shell.base_options import Common, refuse_unwritable, write_whole
from exograv.errors import ConfigError
from exograv.options import Sex, SideOption

if TYPE_CHECKING:
    from exograv.console.view_page import ViewData


@dataclass(frozen=True)
class View:
    """Options of `exograv data view`."""

    target: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="MACHINE|FILE")] = field(default=tyro.MISSING)
    """Name of a machine (see `exograv rigs`), path of its folder, or a recording (.mcap)."""

    side: SideOption = None
    rig: str | None = None
    """Machine of a recording that holds no machine files."""

    height_m: float = 1.75
    """Height of the person in a machine [m]; a recording holds its own."""

    mass_kg: float = 75.0
    """Mass of the person in a machine [kg]."""

    sex: Sex = "male"
    """Table for the person in a machine."""

    page: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write the page to one HTML file that opens without exograv, and serve nothing."""

    port: int = 0
    """TCP port of the page on this computer; 0 for a free port."""

    browser: bool = True
    """Open the page in this computer's browser."""

    mujoco: bool = False
    """Open MuJoCo's own viewer with the machine's twin instead of the page."""


def run_view_command(command: View, common: Common) -> dict[str, Any]:
    """Show a person in a machine, with a slider for each joint, or a recording, with a time slider."""
    is_recording = command.target.endswith(".mcap") or Path(command.target).is_file()
    if command.mujoco:
        from .mujoco_view import show_in_mujoco

        if is_recording:
            raise ConfigError("--mujoco shows machines only. Give a machine, or leave the option out for a recording.")
        show_in_mujoco(command.target, command.side)
        return {"target": command.target}
    if command.page is not None:
        refuse_unwritable(command.page, "--page")
    data = _recording(command) if is_recording else _machine(command)
    return _show(command, data)


def _show(command: View, data: "ViewData") -> dict[str, Any]:
    from exograv.console.view_page import served_page, single_page
    from exograv.console.view_server import serve_page

    if command.page is None:
        serve_page(served_page(data), command.port, command.browser, lambda line: print(line, flush=True))
    else:
        write_whole(command.page, single_page(data), "--page")
        print(f"Page: {command.page}")
    return {"target": command.target, "page": None if command.page is None else str(command.page)}


def _machine(command: View) -> "ViewData":
    from exograv.console.view_page import ViewData
    from exograv.model.anthropometry import Body
    from exograv.model.description import load_rig
    from exograv.model.scene import describe_scene

    if command.rig is not None:
        raise ConfigError(f"--rig goes with a recording; '{command.target}' is a machine. Leave --rig out.")
    description = load_rig(command.target, command.side)
    scene = describe_scene(description, Body(command.height_m, command.mass_kg, command.sex))
    person = f"person of {command.height_m:g} m and {command.mass_kg:g} kg"
    return ViewData(description.settings.title, f"{_sides(scene.side)}; {person}", scene)


def _recording(command: View) -> "ViewData":
    from exograv.console.view_recording import recorded_view

    return recorded_view(Path(command.target), command.rig, command.side)


def _sides(side: str) -> str:
    return "both arms" if side == "both" else f"{side} arm"
