"""Kinematic loops between exoskeleton and arm: strain of each cuff, and the posture of least strain."""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.spatial import Transform, cosine_of, rotation_about, rotation_residual

from .arm import Arm, Limb
from .assembly import Assembly
from .descent import descend
from .kinematics import Hinges, ObliqueHinge, body_poses, frame_pose

PATH_SHAPES = ("bend", "near_hanging", "ahead", "aside")
"""Shapes of the path of a shoulder's centre beside the usual one, in the order of `path_shapes`."""

FIT = (
    "shoulder_offset_x",
    "shoulder_offset_y",
    "shoulder_offset_z",
    "glenohumeral_slope",
    "upper_arm_lengthening",
    "cuff_log_stiffness",
    "cuff_log_rotational_stiffness",
    "elbow_axis_x",
    "elbow_axis_z",
    "glenohumeral_forward",
    "glenohumeral_outward",
    *(f"glenohumeral_{shape}_{direction}" for shape in PATH_SHAPES for direction in ("up", "forward", "outward")),
)
"""Fit of one arm in the machine; zero agrees with the machine's description and the tape measure. Offset of the
wearer's shoulder centre from the machine's, in base axes [m]; its migration up and medially per elevation, mean over
the first 90° [m/rad]; upper arm length minus measured length [m]; logarithm of the cuffs' stiffness over that in
`rig.toml`, in translation and rotation [-]; forward and upward components of the elbow's unit
axis, in the axes of the upper arm that a usual elbow (0, -1, 0) would have in the fastened cuffs [-]; migration of the
shoulder centre forward, and up and laterally, per elevation as above [m/rad]; its further displacement up and medially,
forward, and up and laterally, per shape of `PATH_SHAPES` [m]."""

SHIFT_ENTRIES = tuple(FIT.index(f"glenohumeral_{name}") for name in ("slope", "forward", "outward"))
"""Entries of one arm's fit that give the usual path of its shoulder centre, per direction."""

PATH_ENTRIES = slice(FIT.index(f"glenohumeral_{PATH_SHAPES[0]}_up"), len(FIT))
"""Entries of one arm's fit that give the path beside the usual one: three directions per shape."""

TWIST_COSINE_MIN = 0.3
"""Smallest cosine of a cuff's rotation in a true minimum of energy [-]. True minima have 0.86 or more with 30 mm of
offset. False minima, with the arm twisted in its cuffs, have -0.7 or less (1500 random starts)."""

SLOPE_SETTLED_Nm = 1e-5
"""Largest gradient of a posture that a batch has settled [N·m]. A single search repeats the others: 0.9 % of postures
anywhere within the joints' limits, where strained cuffs let Gauss–Newton steps converge slowly."""

NEAR_SINGULAR, SINGULAR = 0.17, 0.05
"""Clearance at 66° and 77° of abduction [-], outside a workspace of 50° plus the margin of excitation motions."""

DIFFERENCE = 1e-3  # rad: finite difference for the first guess

Posture = Float[np.ndarray, " joint"]
Freedoms = Float[np.ndarray, " freedom"]

STAGE = 0.1  # rad: step on the way from the donning posture; each start must be in the basin of the next minimum

AXIS_SQUARE_MIN = 0.25
"""Smallest square of the third component of the elbow's axis: a tilt of 60°, which no elbow has."""

ELEVATION_ROUNDING = 0.05  # rad: elevation has no gradient at a hanging arm; rounding gives it one

NEAR_HANGING = 0.15  # rad: the radius of the path's corner at a hanging arm is not known


def fit_names(assembly: Assembly) -> tuple[str, ...]:
    """Names of all entries of `fit`, arm after arm."""
    return tuple(limb.prefix + name for limb in assembly.arm.limbs for name in FIT)


def fit_of(limb: Limb, fit: ca.SX) -> ca.SX:
    """Part (23,) of `fit` that belongs to one arm."""
    return fit[limb.number * len(FIT) : (limb.number + 1) * len(FIT)]


def elevation(z: ca.SX) -> ca.SX:
    """Angle of the upper arm from hanging [rad] at one arm's freedoms z, rounded near zero."""
    cosine = ca.cos(z[0]) * ca.cos(z[1])
    return ca.atan2(ca.sqrt(1 - cosine**2 + ELEVATION_ROUNDING**2), cosine)


def shift_shape(z: ca.SX) -> ca.SX:
    """Shift of the shoulder centre at one arm's z over its mean slope in the first 90° [rad].

    Source: 12, 25, 39 and 54 mm at 30°, 60°, 90° and 120° are 22.0 θ + 1.83 θ² mm within 0.2 mm
    (docs/explanation/arm.md).
    """
    curvature = 1.83 / 22.0
    theta = elevation(z)
    return theta * (1 + curvature * theta) / (1 + curvature * np.pi / 2)


def path_shapes(z: ca.SX) -> ca.SX:
    """Further shapes (4,) of the path of a shoulder's centre, at one arm's freedoms z [-].

    - bend: 0 at a hanging arm and at an elevation of 90°, 1 between them;
    - near hanging: 1 at a hanging arm, 0 from an elevation of 25° on;
    - ahead, aside: forward and lateral part of the upper arm's direction.

    Where the centre moves depends on the plane in which the arm is raised, and its ratio to the arm changes on the way:
    Braman et al. (2009), J Shoulder Elbow Surg 18:960, abstract. The shapes are assumed.
    """
    share = elevation(z) / (np.pi / 2)
    near_hanging = ca.exp((ca.cos(z[0]) * ca.cos(z[1]) - 1) / NEAR_HANGING**2)
    return ca.vertcat(4 * share * (1 - share), near_hanging, ca.sin(z[0]) * ca.cos(z[1]), ca.sin(z[1]))


def shift_positions(z: ca.SX, fit: ca.SX) -> ca.SX:
    """Displacement (3,) of one arm's shoulder centre at its freedoms z, along the joints `Limb.shifts` [m]."""
    further = ca.reshape(fit[PATH_ENTRIES], 3, len(PATH_SHAPES))
    return fit[SHIFT_ENTRIES] * shift_shape(z) + further @ path_shapes(z)


def arm_positions(arm: Arm, z: ca.SX, fit: ca.SX) -> ca.SX:
    """Joint positions (arm joint,) of the arm's tree from its freedoms z, including shift and lengthening."""
    positions = []
    for limb in arm.limbs:
        z_limb, fit_limb = z[limb.freedoms], fit_of(limb, fit)
        positions += [shift_positions(z_limb, fit_limb), z_limb[:3], fit_limb[4], z_limb[3:]]
    return ca.vertcat(*positions)


def arm_roots(assembly: Assembly, fit: ca.SX) -> list[Transform]:
    """Pose of each arm's base: the machine's shoulder centre plus the wearer's offset."""
    roots = []
    for limb in assembly.arm.limbs:
        frame = assembly.exo.frame(assembly.description.shoulder_centre(limb.side))
        roots.append(Transform(ca.SX.eye(3), ca.DM(frame.p_body_frame) + fit_of(limb, fit)[:3]))
    return roots


def arm_hinges(assembly: Assembly, fit: ca.SX) -> Hinges:
    """Elbows whose axes are oblique to both segments.

    People's elbows are oblique (Paraskevas et al. 2004, Surg Radiol Anat 26:19). The segments lie along the machine's
    links when the cuffs are fastened; from there the forearm turns about the wearer's own axis.
    """
    hinges: dict[int, ObliqueHinge] = {}
    for limb in assembly.arm.limbs:
        x, z = fit_of(limb, fit)[7], fit_of(limb, fit)[8]
        axis = ca.vertcat(x, -ca.sqrt(ca.fmax(1 - x**2 - z**2, AXIS_SQUARE_MIN)), z)
        zero = float(assembly.description.arm_donning_posture[limb.joints.index(limb.elbow) + limb.freedoms.start])
        usual = assembly.arm.tree.joints[limb.elbow].axis
        R = np.array(ca.evalf(rotation_about(ca.DM(usual), ca.SX(zero))))
        hinges[limb.elbow] = ObliqueHinge(R, ca.DM(R.T) @ axis, zero)
    return hinges


def arm_poses(assembly: Assembly, z: ca.SX, fit: ca.SX) -> list[Transform]:
    """Pose of each body of the arms at their freedoms z (freedom,), in the base frame."""
    positions = arm_positions(assembly.arm, z, fit)
    return body_poses(assembly.arm.tree, positions, arm_roots(assembly, fit), arm_hinges(assembly, fit))


def clearance(arm: Arm, z: ca.SX) -> ca.SX:
    """Distance of z from the postures in which an arm's angles are singular: squared cosine of abduction [-].

    In a singular posture flexion and rotation turn the arm about the same axis, and its angles change fast while the
    arm hardly moves. With two arms, the smaller distance counts.
    """
    nearest = ca.SX(1)
    for limb in arm.limbs:
        nearest = ca.fmin(nearest, ca.cos(z[limb.freedoms][1]) ** 2)
    return nearest


def away_from_singular(clear: ca.SX) -> ca.SX:
    """Smooth step from 0 at a clearance of `SINGULAR` to 1 at `NEAR_SINGULAR`.

    It scales springs and damping of the angles, which have no meaning in a singular posture.
    """
    s = ca.fmin(ca.fmax((clear - SINGULAR) / (NEAR_SINGULAR - SINGULAR), 0), 1)
    return 3 * s**2 - 2 * s**3


@dataclass(frozen=True)
class CuffPair:
    """Frames that one cuff holds together. They coincided when the cuff was fastened."""

    T_world_exo: Transform
    T_world_arm: Transform
    exo_body: int
    """Index of the body in the machine's tree that carries the exoskeleton's frame."""

    arm_body: int
    """Index of the body in the arm's tree that carries the arm's frame."""

    @property
    def T_exo_arm(self) -> Transform:
        """Pose of the arm's frame in the machine's frame; identity where the cuff was fastened."""
        return self.T_world_exo.inverse() @ self.T_world_arm


def cuff_pairs(assembly: Assembly, exo: list[Transform], arm: list[Transform], fit: ca.SX) -> list[CuffPair]:
    """Frames of all cuffs for body poses `exo` of the machine and `arm` of the arm.

    The cuffs are fastened with machine and arm in their donning postures.
    """
    description, tree = assembly.description, assembly.arm.tree
    exo_donning = body_poses(assembly.exo, ca.SX(ca.DM(description.donning_posture)))
    z_donning = ca.SX(ca.DM(description.arm_donning_posture))
    arm_donning = arm_poses(assembly, z_donning, fit)
    pairs = []
    for cuff, slid in zip(assembly.cuffs, assembly.slid_m or (0.0,) * len(assembly.cuffs), strict=True):
        segment = assembly.arm.limb(cuff.side).prefix + cuff.segment
        T_world_fastened = frame_pose(assembly.exo, exo_donning, cuff.exo_frame)
        T_segment_cuff = frame_pose(tree, arm_donning, segment).inverse() @ T_world_fastened
        T_world_exo = frame_pose(assembly.exo, exo, cuff.exo_frame)
        if slid:
            T_world_exo = Transform(T_world_exo.R, T_world_exo.apply(ca.SX(ca.DM([0.0, 0.0, slid]))))
        pairs.append(
            CuffPair(
                T_world_exo,
                frame_pose(tree, arm, segment) @ T_segment_cuff,
                assembly.exo.frame(cuff.exo_frame).body,
                tree.frame(segment).body,
            )
        )
    return pairs


def cuff_residuals(assembly: Assembly, y: ca.SX, z: ca.SX, fit: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Strain of the cuffs at one posture.

    Returns:
        Displacement and rotation residual of all cuffs (6 · cuff,) in the exoskeleton's cuff frames, [m] (3,), then
        [-] (3,) each; and the cosine of each cuff's rotation (cuff,).
    """
    exo = body_poses(assembly.exo, y)
    arm = arm_poses(assembly, z, fit)
    rows, cosines = [], []
    for pair in cuff_pairs(assembly, exo, arm, fit):
        rows += [pair.T_exo_arm.p, rotation_residual(pair.T_exo_arm.R)]
        cosines.append(cosine_of(pair.T_exo_arm.R))
    return ca.vertcat(*rows), ca.vertcat(*cosines)


def cuff_stiffness(assembly: Assembly) -> Float[np.ndarray, " row"]:
    """Stiffness of each entry of `cuff_residuals` [N/m] or [N·m/rad]."""
    return np.concatenate([cuff.stiffness for cuff in assembly.cuffs])


def scaled_stiffness(assembly: Assembly, fit: ca.SX) -> ca.SX:
    """Learned stiffness (row,): translation and rotation are scaled by their arm's factors in `fit`."""
    factors = []
    for cuff in assembly.cuffs:
        fit_limb = fit_of(assembly.arm.limb(cuff.side), fit)
        factors += [*[ca.exp(fit_limb[5])] * 3, *[ca.exp(fit_limb[6])] * 3]
    return ca.DM(cuff_stiffness(assembly)) * ca.vertcat(*factors)


class LoopSolver:
    """Cold-start solver of the arm's freedoms for a posture of the machine; too slow for the tick."""

    def __init__(self, assembly: Assembly):
        self._donning = assembly.description.donning_posture
        self._arm, self._arm_donning = assembly.arm, assembly.description.arm_donning_posture
        names = fit_names(assembly)
        self._recipe = kernel.Recipe(_loops_function, (assembly,))
        self._kernel = kernel.compile(self._recipe)
        self._nominal_fit = np.zeros(len(names))

    def solve(
        self, y: Posture, z_start: Freedoms | None = None, fit: Float[np.ndarray, " fit"] | None = None
    ) -> tuple[Freedoms, float]:
        """Return the arm angles z [rad] of least cuff energy at posture y [rad], and the remaining gradient [N·m].

        The energy also has false minima, in which the arm is twisted in its cuffs, and several sets of angles describe
        the same posture. The result is the solution that the arm reaches when the machine moves from the donning
        posture to y. A search starts at `z_start`, or at a guess (0.5 ms). If it ends with a twisted arm or beyond its
        reach, it is repeated in steps from the donning posture (5 ms).
        """
        fit = self._nominal_fit if fit is None else fit
        z, slope = self._descend(y, self._guess(y) if z_start is None else z_start, fit)
        if self._kernel.of(y, z, fit)[2].min() > TWIST_COSINE_MIN and self._arm.is_reachable(z):
            return z, slope
        way = y - self._donning
        z = self._arm_donning
        for share in np.linspace(0.0, 1.0, 1 + int(np.ceil(np.abs(way).max() / STAGE))):
            z, slope = self._descend(self._donning + share * way, z, fit)
        return z, slope

    def solve_many(
        self, y: Float[np.ndarray, "posture joint"], fit: Float[np.ndarray, " fit"] | None = None
    ) -> Float[np.ndarray, "posture freedom"]:
        """Return the arm angles z [rad] of least cuff energy at many postures y [rad]; as `solve`, in one batch."""
        fit = self._nominal_fit if fit is None else fit
        bound = self._batch.bind(len(y))
        bound.inputs["y"][...], bound.inputs["fit"][:] = y.T, fit
        z = descend(bound, self._arm_donning + (y - self._donning) @ self._beginning.T)
        bound.inputs["z"][...] = z.T
        ends = bound()
        untwisted = ends["cosines"].min(axis=0) > TWIST_COSINE_MIN
        slope = np.abs(np.einsum("rfs,rs->fs", ends["jacobian"], ends["residual"])).max(axis=0)
        for k in np.flatnonzero(~(untwisted & (slope < SLOPE_SETTLED_Nm) & self._arm.is_reachable(z))):
            z[k] = self.solve(y[k], fit=fit)[0]
        return z

    @cached_property
    def _batch(self) -> kernel.Batch:
        return kernel.compile(self._recipe, lanes=0, shared=("fit",))

    def _guess(self, y: Posture) -> Freedoms:
        """First guess: linear extrapolation from the donning posture."""
        return self._arm_donning + self._beginning @ (y - self._donning)

    @cached_property
    def _beginning(self) -> Float[np.ndarray, "freedom joint"]:
        """Derivative of the arm's freedoms by the machine's joints at the donning posture."""
        turned = [
            self._descend(self._donning + DIFFERENCE * way, self._arm_donning, self._nominal_fit)[0]
            for way in np.eye(len(self._donning))
        ]
        return (np.array(turned) - self._arm_donning).T / DIFFERENCE

    def _descend(self, y: Posture, z_start: Freedoms, fit: Float[np.ndarray, " fit"]) -> tuple[Freedoms, float]:
        """Find the local minimum from `z_start`; Levenberg–Marquardt converges where a full Newton step diverges."""
        from scipy.optimize import least_squares  # imported here: takes 0.1 s, and an empty machine does not need it

        result = least_squares(
            lambda z: self._kernel.of(y, z, fit)[0],
            z_start,
            jac=lambda z: self._kernel.of(y, z, fit)[1],  # pyright: ignore[reportArgumentType] - SciPy takes callables
            method="lm",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        return result.x, float(np.abs(result.grad).max())

    def gauss_newton_hessian(
        self, y: Posture, z: Freedoms, fit: Float[np.ndarray, " fit"] | None = None
    ) -> Float[np.ndarray, "freedom freedom"]:
        """Stiffness matrix with which the cuffs hold the arm's freedoms [N·m/rad]."""
        jacobian = self._kernel.of(y, z, self._nominal_fit if fit is None else fit)[1]
        return jacobian.T @ jacobian

    def strain(self, y: Posture, z: Freedoms) -> tuple[float, float]:
        """Largest displacement [m] and largest rotation [rad] of any cuff."""
        _, _, cosines, residuals = self._kernel.of(y, z, self._nominal_fit)
        stretch = np.linalg.norm(residuals.reshape(-1, 6)[:, :3], axis=1)
        return float(stretch.max()), float(np.arccos(np.clip(cosines.min(), -1.0, 1.0)))


def _loops_function(assembly: Assembly) -> ca.Function:
    """Weighted residual of the cuffs, its Jacobian (row, freedom), the cosines of rotation, and the plain residual."""
    y, z = ca.SX.sym("y", assembly.n), ca.SX.sym("z", assembly.n_freedoms)
    fit = ca.SX.sym("fit", len(fit_names(assembly)))
    residuals, cosines = cuff_residuals(assembly, y, z, fit)
    weighted = ca.sqrt(scaled_stiffness(assembly, fit)) * residuals
    results = {"residual": weighted, "jacobian": ca.jacobian(weighted, z), "cosines": cosines, "strain": residuals}
    return ca.Function("loops", [y, z, fit], list(results.values()), ["y", "z", "fit"], list(results))
