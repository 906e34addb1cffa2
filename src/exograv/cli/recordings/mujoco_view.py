"""Twin of a machine, with a person in it, in MuJoCo's own viewer."""

import os

from exograv.errors import ConfigError
from exograv.options import Side

INSTEAD = "Leave --mujoco out: the page shows the machine in any browser."


def show_in_mujoco(rig: str, side: Side | None) -> None:
    """Open the viewer until its window is closed.

    Raises:
        ConfigError: The machine is unknown, or this computer has no display or not the packages of the viewer.
    """
    from exograv.model.description import load_rig

    description = load_rig(rig, side)
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ConfigError(f"--mujoco opens a window, and this computer has no display. {INSTEAD}")
    try:
        import mujoco.viewer as viewer
    except ImportError as error:
        raise ConfigError(
            f"--mujoco needs MuJoCo's viewer: {error} Install exograv[twin] and glfw. {INSTEAD}"
        ) from error
    from exograv.laboratory.virtual_laboratory import draw_laboratory
    from exograv.rig.twin.world.scene import build_scene

    drawn = draw_laboratory(description.name if rig == description.name else rig, side, 0, 0)
    scene = build_scene(description, drawn.machine, drawn.wearer)
    viewer.launch(scene.model, scene.data)
