"""Twin of a machine, with a person in it, in MuJoCo's own viewer."""

import os
import time
from typing import TYPE_CHECKING

from exograv.errors import ConfigError
from exograv.options import Side

if TYPE_CHECKING:
    import mujoco

INSTEAD = "Leave --mujoco out: the page shows the machine in any browser."
LOOK_S = 0.05
"""Period in which the viewer is asked whether its window is still open [s]."""


def show_in_mujoco(rig: str, side: Side | None) -> None:
    """Open the viewer until its window is closed.

    Raises:
        ConfigError: The machine is unknown, or this computer has no display or not the packages of the viewer.
    """
    model, data = shown_twin(rig, side)
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ConfigError(f"--mujoco opens a window, and this computer has no display. {INSTEAD}")
    try:
        import mujoco.viewer
    except ImportError as error:
        raise ConfigError(
            f"--mujoco needs MuJoCo's viewer ({error}). Install the package glfw, or leave --mujoco out: the page "
            "shows the machine in any browser."
        ) from error
    with mujoco.viewer.launch_passive(model, data) as window:
        # The twin has no surfaces. Its bodies are drawn as ellipsoids of their inertia.
        for flag in (mujoco.mjtVisFlag.mjVIS_INERTIA, mujoco.mjtVisFlag.mjVIS_JOINT, mujoco.mjtVisFlag.mjVIS_COM):
            window.opt.flags[flag] = True
        window.sync()
        while window.is_running():
            time.sleep(LOOK_S)


def shown_twin(rig: str, side: Side | None) -> "tuple[mujoco.MjModel, mujoco.MjData]":
    """Model and state of the twin without disturbances, at the posture in which the cuffs are fastened.

    Raises:
        ConfigError: The machine is unknown.
    """
    import mujoco

    from exograv.laboratory.virtual_laboratory import draw_laboratory
    from exograv.rig.twin.world.scene import build_scene

    drawn = draw_laboratory(rig, side, 0, 0)
    scene = build_scene(drawn.description, drawn.machine, drawn.wearer)
    scene.data.qpos[scene.exo], scene.data.qpos[scene.arm] = scene.fastened
    mujoco.mj_forward(scene.model, scene.data)
    return scene.model, scene.data
