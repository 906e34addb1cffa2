"""Simulated room: a touch screen before the participant and a support for the hand; its values are recorded."""

from typing import Annotated

import casadi as ca
import numpy as np
from jaxtyping import Float
from pydantic import Field

from exograv.dynamics import parameters
from exograv.laboratory.movements import REST_DEG, TARGET_DEG
from exograv.model.assembly import Assembly
from exograv.model.kinematics import frame_pose
from exograv.model.loops import arm_poses
from exograv.model.rig_settings import Settings
from exograv.rig.twin.world.surroundings import FINGER_RADIUS, HAND_RADIUS, Surroundings
from exograv.task.screen import ScreenCalibration
from exograv.task.task_settings import TargetSettings

Vector = Float[np.ndarray, " 3"]


class SimulatedRoom(Settings):
    """Room with a 24-inch panel. The participant's finger reaches the target with the elbow still bent."""

    width_px: Annotated[int, Field(gt=0)] = 1920
    height_px: Annotated[int, Field(gt=0)] = 1080
    pitch_mm: Annotated[float, Field(gt=0.0)] = 0.277
    """Size of a square pixel."""

    tilt_deg: Annotated[float, Field(ge=-60.0, le=60.0)] = 10.0
    """Angle by which the upper edge leans away."""

    touch_lag_s: Annotated[float, Field(ge=0.0)] = 0.06
    touch_lag_sd_s: Annotated[float, Field(ge=0.0)] = 0.008
    """Delay from contact to the time in the page's report, and its standard deviation. Touch screens have 0.05 to 0.2

        (docs/explanation/task.md); the standard deviation is assumed.
    """

    delivery_s: Annotated[float, Field(ge=0.0)] = 0.003
    """Delay from the page to the server. Source: measured in a browser on the same computer, 2 to 5 ms."""

    contact_mm: Annotated[float, Field(gt=0.0)] = 9.0
    """Longer side of a fingertip's contact, assumed."""

    @property
    def calibration(self) -> ScreenCalibration:
        """Calibration of the panel, as a measurement with a ruler would give it."""
        return ScreenCalibration(
            pitch_x_mm=self.pitch_mm, pitch_y_mm=self.pitch_mm, method="ruler", anisotropy=0.0, relative_error=0.0
        )

    def target_px(self, target: TargetSettings) -> tuple[float, float]:
        """Centre of the drawn target, right and down of the panel's corner [px]."""
        return target.x_fraction * self.width_px, target.y_fraction * self.height_px

    def pixel_of(self, finger: Float[np.ndarray, " 2"]) -> tuple[float, float] | None:
        """Pixel under a finger right and up of the panel's centre [m]; None beside the panel."""
        per_m = 1e3 / self.pitch_mm
        x, y = 0.5 * self.width_px + per_m * finger[0], 0.5 * self.height_px - per_m * finger[1]
        return (float(x), float(y)) if 0.0 <= x <= self.width_px and 0.0 <= y <= self.height_px else None

    def on_panel(self, x_px: float, y_px: float) -> Float[np.ndarray, " 2"]:
        """Place of a pixel, right and up of the panel's centre [m]."""
        return 1e-3 * self.pitch_mm * np.array([x_px - 0.5 * self.width_px, 0.5 * self.height_px - y_px])

    def around(self, assembly: Assembly, target: TargetSettings) -> Surroundings:
        """Place screen and support by the lengths that were entered for the participant, as an operator would."""
        tip = _place(assembly, "finger_tip", TARGET_DEG)
        tilt = float(np.deg2rad(self.tilt_deg))
        axes = Surroundings(np.zeros(3), tilt, 0.0).screen_axes
        off = np.append(self.on_panel(*self.target_px(target)), FINGER_RADIUS)
        return Surroundings(tip - axes @ off, tilt, float(_place(assembly, "hand", REST_DEG)[2]) - HAND_RADIUS)


def _place(assembly: Assembly, frame: str, angles_deg: tuple[float, ...]) -> Vector:
    """Place of a frame of the first arm at these angles of its first freedoms, in the base frame [m]."""
    layout, limb = parameters.ParameterLayout.of(assembly), assembly.arm.limbs[0]
    z = np.zeros(assembly.n_freedoms)
    z[: len(angles_deg)] = np.deg2rad(angles_deg)
    fit = ca.DM.zeros(layout.fit.stop - layout.fit.start)
    tree = assembly.arm.tree
    poses = arm_poses(assembly, ca.SX(ca.DM(z)), ca.SX(fit))
    return np.asarray(ca.evalf(frame_pose(tree, poses, limb.prefix + frame).p)).ravel()
