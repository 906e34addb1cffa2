"""Machine of the twin by a file `twin.toml`: a draw from its posterior, or its mean."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.empty_machine import tilted_gravity
from exograv.identification.core.physical import PhysicalProjection
from exograv.model.description import RigDescription
from exograv.rig.twin import Disturbances, Machine, draw_machine
from exograv.rig.twin.machine.machine import TrueDrives, TrueFriction, TrueSensors
from exograv.rig.twin.wearer.wearer import Cuffs, usual_cuff_stiffness
from exograv.storage.calibration_file import FITTED_TWIN
from exograv.storage.twin_file import StoredTwin

ROTOR_LEAST = 1e-4
"""Least rotor inertia of a draw [kg·m²]: the simulation cannot integrate a motor without inertia."""

COMPLIANCE_LEAST = 1e-5
"""Least compliance of a gear in a draw [rad/(N·m)]: the simulation cannot integrate a stiffer one."""

GAIN_LEAST = 0.1
"""Least inverse gain of a draw, over the nominal one [-]."""


def fitted_identity(whole: StoredTwin, seed: int) -> str:
    """Identity of a draw from a fitted twin, in place of a serial number."""
    return f"{FITTED_TWIN}{whole.content_sha256[:12]}, seed {seed}"


def fitted_machine(
    description: RigDescription, whole: StoredTwin, disturbances: Disturbances, seed: int, *, is_mean: bool = False
) -> Machine:
    """Draw the machine of a fitted twin.

    What recordings do not tell (elasticity of the gears, cuff sensors, response of drives without commands) is drawn
    as for any machine of this kind, with these disturbances.

    Args:
        description: Machine as its folder describes it.
        whole: Content of its `twin.toml`.
        disturbances: Sizes of what the twin does not tell.
        seed: Seed of the draw.
        is_mean: True for the mean of the posterior in place of a draw.
    """
    usual, layout = draw_machine(description, disturbances, seed), whole.layout()
    theta = np.array(whole.posterior.mean) if is_mean else whole.draw(seed)
    links = layout.links
    bodies = tuple(slice(start, start + 10) for start in range(links.start, links.stop, 10))
    theta = PhysicalProjection(bodies, np.array(whole.posterior.mean))(theta, whole.posterior.matrix())
    value = {name: theta[layout.of(name)] for name in layout.per_joint}
    phi = theta[links].reshape(-1, 10)
    return replace(
        usual,
        friction=_friction(value, disturbances),
        drives=_drives(description, whole, usual.drives, value, None if is_mean else seed),
        sensors=_sensors(whole, usual.sensors, value, None if is_mean else seed),
        gravity=tilted_gravity(theta[layout.tilt]),
        links=dict(zip(description.joints, phi, strict=True)),
        foreign=None,
    )


def fitted_cuffs(
    description: RigDescription, whole: StoredTwin, disturbances: Disturbances, cuffs: Cuffs, seed: int
) -> Cuffs:
    """Return a wearer's cuffs with the stiffness of a draw from the fitted twin; as they are if it has none.

    The simulation has one stiffness for all cuffs: the geometric mean of those in `rig.toml` takes the drawn factors. A
    person's own factors, of another day or of a foreign world, stay on top. Damping stays.

    Args:
        description: Machine as its folder describes it.
        whole: Content of its `twin.toml`.
        disturbances: Disturbances by which `cuffs` were drawn.
        cuffs: Cuffs of the drawn wearer.
        seed: Seed of the draw.
    """
    if not whole.cuffs:
        return cuffs
    pull, twist = whole.cuffs[0].draw(seed)
    rows = [
        [1e3 * one.across_N_per_mm] * 2 + [1e3 * one.along_N_per_mm]
        + np.rad2deg([one.about_others_Nm_per_deg] * 2 + [one.about_limb_Nm_per_deg]).tolist()
        for one in description.settings.cuffs
    ]  # fmt: skip
    own = cuffs.stiffness / usual_cuff_stiffness(disturbances)
    return replace(cuffs, stiffness=own * _held_stiffness(np.array(rows)) * np.repeat([pull, twist], 3))


def _held_stiffness(rows: Float[np.ndarray, "cuff 6"]) -> Float[np.ndarray, " 6"]:
    """Geometric mean over the cuffs that hold a direction; 0 if none does."""
    held = rows > 0.0
    logarithms = np.log(np.where(held, rows, 1.0)).sum(axis=0) / np.maximum(held.sum(axis=0), 1)
    return np.where(held.any(axis=0), np.exp(logarithms), 0.0)


def _friction(value: dict[str, Float[np.ndarray, " joint"]], disturbances: Disturbances) -> TrueFriction:
    def present(row: str, values: Float[np.ndarray, " joint"]) -> Float[np.ndarray, " joint"]:
        """Return the values, or zeros where the disturbance is switched off."""
        return np.zeros(len(values)) if disturbances.levels[row] is None else values

    coulomb = np.maximum(value["coulomb"], 0.0)
    asymmetry = np.divide(value["asymmetry"], coulomb, out=np.zeros_like(coulomb), where=coulomb > 0.0)
    return TrueFriction(
        coulomb=present("coulomb", coulomb),
        breakaway=np.maximum(value["breakaway"], 1.0),
        stribeck_velocity=np.exp(value["log_v_stribeck"]),
        viscous=present("viscous", np.maximum(value["viscous"], 0.0)),
        load_share=present("load_friction", np.maximum(value["load_share"], 0.0)),
        asymmetry=np.clip(asymmetry, -0.9, 0.9),
        ripple=present("friction_ripple", np.hypot(value["ripple_sine"], value["ripple_cosine"])),
        ripple_phase=np.arctan2(value["ripple_cosine"], value["ripple_sine"]),
        # The values are those at the end of the recordings: the twin starts as warm as the machine was then.
        warm_up=np.zeros(len(coulomb)),
        viscous_power=np.maximum(value["viscous_power"], 0.0),
    )


def _drives(
    description: RigDescription,
    whole: StoredTwin,
    usual: TrueDrives,
    value: dict[str, Float[np.ndarray, " joint"]],
    seed: int | None,
) -> TrueDrives:
    bandwidth = usual.bandwidth.copy()
    for number, drive in enumerate(whole.drives):
        spread = 0.0 if seed is None else drive.bandwidth_sd_log * _normal(seed, number)
        bandwidth[description.joints.index(drive.joint)] = drive.first_order_Hz * np.exp(spread)
    stiffness = usual.gear_stiffness.copy()
    for gear in whole.gears:
        joint = description.joints.index(gear.joint)
        spread = 0.0 if seed is None else gear.compliance_sd_rad_per_Nm * _normal(seed, GEAR_DRAW + joint)
        stiffness[joint] = 1.0 / max(gear.compliance_rad_per_Nm + spread, COMPLIANCE_LEAST)
    slope, slope_at = np.zeros(len(stiffness)), np.zeros(len(stiffness))
    for warm in whole.gain_by_temperature:
        joint = description.joints.index(warm.joint)
        spread = 0.0 if seed is None else warm.slope_sd_per_C * _normal(seed, WARM_DRAW + joint)
        slope[joint], slope_at[joint] = warm.slope_per_C + spread, warm.at_C
    return replace(
        usual,
        gain_slope=slope,
        gain_at=slope_at,
        gear_stiffness=stiffness,
        gain=description.nominal_gain / np.maximum(value["inverse_gain"], GAIN_LEAST),
        rotor_inertia=np.maximum(value["rotor"], ROTOR_LEAST),
        bandwidth=bandwidth,
    )


def _sensors(
    whole: StoredTwin, usual: TrueSensors, value: dict[str, Float[np.ndarray, " joint"]], seed: int | None
) -> TrueSensors:
    delay = usual.delay
    if whole.delay_ms:
        (mean,), (_, sd) = whole.first_order_delay_ms, whole.delay_ms
        delay = 1e-3 * max(mean + (0.0 if seed is None else sd * _normal(seed, DELAY_DRAW)), 0.0)
    return TrueSensors(
        current_noise=np.array([row.noise_Nm for row in whole.joints]),
        encoder_step=np.array([row.encoder_step_rad for row in whole.joints]),
        encoder_offset=value["offset"],
        delay=delay,
        has_motor_encoders=whole.has_motor_encoders,
    )


DELAY_DRAW, GEAR_DRAW, WARM_DRAW = 1000, 2000, 3000
"""Number of the draw of the delay, of the first gear and of the first gain by temperature; those below are of the
drives."""


def _normal(seed: int, number: int) -> float:
    return float(np.random.default_rng([seed, number]).standard_normal())
