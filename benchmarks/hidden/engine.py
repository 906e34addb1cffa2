"""Compiled equations of a hidden machine: structures as in `engine.c`, and calls with NumPy arrays."""

import ctypes
import hashlib
import subprocess
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

JOINTS, SLIPS, COMMANDS, PAST = 4, 6, 16, 64
STATES = (6 + SLIPS) * JOINTS
SOURCE = Path(__file__).with_name("engine.c")
Q, V, THETA, OMEGA, CURRENT, CURRENT_RATE = (slice(part * JOINTS, (part + 1) * JOINTS) for part in range(6))
"""Places in the state: joints, motors behind their gears, and currents with their derivatives."""

Joints = Float[np.ndarray, " joint"]
Rows = Float[np.ndarray, "state joint"]
Values = Mapping[str, np.ndarray]
"""True values of a machine by the names of `SHAPES`."""

_EACH = (JOINTS,)
SHAPES: dict[str, tuple[int, ...]] = {
    "axis": (JOINTS, 3),
    "origin": (JOINTS, 3),
    "rotation": (JOINTS, 3, 3),
    "mass": _EACH,
    "com": (JOINTS, 3),
    "inertia": (JOINTS, 3, 3),
    "gravity": (3,),
    **dict.fromkeys(("rotor", "stiffness", "gear_damping", "gain", "gain_fall", "current_warm"), _EACH),
    "winding_s": (),
    **dict.fromkeys(("current_rad_s", "current_ratio"), _EACH),
    "law": (),
    **dict.fromkeys(("coulomb", "asymmetry", "breakaway", "v_stribeck", "exponent", "load_share", "load_from"), _EACH),
    **dict.fromkeys(("bristle", "bristle_damping"), _EACH),
    **dict.fromkeys(("slip_share", "slip_stiffness"), (SLIPS,)),
    **dict.fromkeys(("viscous", "eyring", "eyring_speed", "power", "power_exponent"), _EACH),
    **dict.fromkeys(("ripple", "ripple_waves", "ripple_phase", "warm_fall"), _EACH),
    "warm_s": (),
    **dict.fromkeys(("lower", "upper"), _EACH),
    **dict.fromkeys(("stop_stiffness", "stop_damping"), ()),
    "drive_gain": _EACH,
    **dict.fromkeys(("command_delay", "sensor_delay", "period", "substeps"), ()),
}
"""Shape of each true value, in the order of `struct machine`."""


class _Machine(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_double * int(np.prod(shape)) if shape else ctypes.c_double) for name, shape in SHAPES.items()
    ]


class _Run(ctypes.Structure):
    _fields_ = [
        ("t", ctypes.c_double),
        ("x", ctypes.c_double * STATES),
        ("outside", ctypes.c_double * JOINTS),
        ("winding", ctypes.c_double * JOINTS),
        ("gripped", ctypes.c_double),
        ("grip", ctypes.c_double * 3),
        ("wrench", ctypes.c_double * 6),
        ("given", ctypes.c_double * (COMMANDS * JOINTS)),
        ("damping", ctypes.c_double * (COMMANDS * JOINTS)),
        ("valid_until", ctypes.c_double * COMMANDS),
        ("count", ctypes.c_double),
        ("past", ctypes.c_double * (PAST * 3 * JOINTS)),
        ("pasts", ctypes.c_double),
    ]


@cache
def library() -> ctypes.CDLL:
    """Compile `engine.c` with the C compiler of this computer, once for each text of the file."""
    text = SOURCE.read_bytes()
    folder = Path(tempfile.gettempdir()) / f"exograv_hidden_{hashlib.sha256(text).hexdigest()[:16]}"
    path = folder / "engine.so"
    if not path.exists():
        folder.mkdir(exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, suffix=".so", delete=False) as made:
            pass
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", str(SOURCE), "-o", made.name, "-lm"], check=True)
        Path(made.name).replace(path)
    compiled = ctypes.CDLL(str(path))
    for name in ("strength", "viscous"):
        getattr(compiled, name).restype = ctypes.c_double
    return compiled


class Engine:
    """Machine with these true values, at rest without torque in its motors."""

    def __init__(self, values: Values, q: Joints):
        """Start with the joints at `q` [rad] and all springs relaxed."""
        self._library, self._machine, self._run = library(), _Machine(), _Run()
        for name, shape in SHAPES.items():
            value = np.asarray(values[name], dtype=float)
            if value.shape != shape:
                raise ValueError(f"{name} has the shape {value.shape}; {shape} is expected.")
            self.change(name, value)
        self.x = np.ctypeslib.as_array(self._run.x)
        """State, in the order of `engine.c`."""
        self.outside = np.ctypeslib.as_array(self._run.outside)
        """Torque on the links from outside the machine (joint,) [N·m]."""
        self.wrench = np.ctypeslib.as_array(self._run.wrench)
        """Force [N] and moment [N·m] at the gripped place, in the axes of its link (6,)."""
        self.winding = np.ctypeslib.as_array(self._run.winding)
        """Mean square of each motor's current over that of `current_warm` (joint,) [-]."""
        self.x[Q] = self.x[THETA] = q
        self._machine_at, self._run_at = ctypes.byref(self._machine), ctypes.byref(self._run)
        self._fill_past()

    def hold(self, q: Joints, tau: Joints) -> None:
        """Stand still at `q` [rad], for long, with motors that give `tau` [N·m]; friction carries nothing."""
        machine, run = self._machine, self._run
        stiffness, gain = (np.ctypeslib.as_array(getattr(machine, name)) for name in ("stiffness", "gain"))
        self.x[:] = 0.0
        self.x[Q], self.x[THETA], self.x[CURRENT] = q, q + tau / stiffness, tau / gain
        np.ctypeslib.as_array(run.given).reshape(COMMANDS, JOINTS)[:] = tau / gain
        np.ctypeslib.as_array(run.valid_until)[:] = np.inf
        run.count = float(COMMANDS)
        self._fill_past()

    @property
    def gain_now(self) -> Joints:
        """Torque per current of each motor with its winding as warm as it is [N·m/A]."""
        gain, fall = (np.ctypeslib.as_array(getattr(self._machine, name)) for name in ("gain", "gain_fall"))
        return gain * (1.0 - fall * np.minimum(self.winding, 1.0))

    def grip(self, link: int, place: Float[np.ndarray, " 3"]) -> None:
        """Let `wrench` act at a place [m] of this link from now on."""
        self._run.gripped = float(link)
        np.ctypeslib.as_array(self._run.grip)[:] = place

    def scale_current(self, joint: int, factor: float) -> None:
        """Multiply the current of a motor by `factor`, also in the commands and measurements under way."""
        run = self._run
        for part in (CURRENT, CURRENT_RATE):
            self.x[part][joint] *= factor
        np.ctypeslib.as_array(run.given).reshape(COMMANDS, JOINTS)[:, joint] *= factor
        np.ctypeslib.as_array(run.past).reshape(PAST, 3, JOINTS)[:, 2, joint] *= factor

    def _fill_past(self) -> None:
        """Measure as if the machine had stood still for long."""
        past = np.ctypeslib.as_array(self._run.past).reshape(PAST, 3, JOINTS)
        past[:] = [self.x[part] for part in (Q, THETA, CURRENT)]
        self._run.pasts = float(PAST)

    def change(self, name: str, value: Float[np.ndarray, "..."] | float) -> None:
        """Replace a true value from now on."""
        if SHAPES[name]:
            np.ctypeslib.as_array(getattr(self._machine, name))[:] = np.ravel(value)
        else:
            setattr(self._machine, name, float(value))

    @property
    def t(self) -> float:
        """Time since the machine was switched on cold [s]."""
        return self._run.t

    @t.setter
    def t(self, t: float) -> None:
        self._run.t = t

    def advance(self, current: Joints, damping: Joints, valid_until: float) -> None:
        """Take a current command [A], a damping of the drives [N·m·s/rad] and their expiry [s]; run one period."""
        taken = [np.ascontiguousarray(each, dtype=float) for each in (current, damping)]
        self._library.advance(
            self._machine_at, self._run_at, *(_address(each) for each in taken), ctypes.c_double(valid_until)
        )

    def sense(self) -> Float[np.ndarray, "3 joint"]:
        """Return joint positions [rad], motor positions [rad] and currents [A] as they were one sensor delay ago."""
        measured = np.empty((3, JOINTS))
        self._library.sense(self._machine_at, self._run_at, _address(measured))
        return measured

    def links(self, q: Joints, v: Joints) -> tuple[Float[np.ndarray, "joint joint"], Joints]:
        """Return the mass matrix of the links [kg·m²] and the torque that holds them at zero acceleration [N·m]."""
        M, bias = np.empty((JOINTS, JOINTS)), np.empty(JOINTS)
        state = [np.ascontiguousarray(each, dtype=float) for each in (q, v)]
        self._library.links(self._machine_at, *(_address(each) for each in (*state, M, bias)))
        return M, bias

    def torques(self, q: Rows, v: Rows, a: Rows) -> Rows:
        """Return the torque of the links in many states, without rotors and friction [N·m]."""
        tau, states = np.empty(q.shape), [np.ascontiguousarray(each, dtype=float) for each in (q, v, a)]
        self._library.torques(self._machine_at, len(q), *(_address(each) for each in (*states, tau)))
        return tau

    def pull_torque(
        self, link: int, place: Float[np.ndarray, " 3"], wrench: Float[np.ndarray, " 6"], q: Joints
    ) -> Joints:
        """Return the torque of a force [N] and a moment [N·m] at a place of a link, in the axes of the link [N·m]."""
        tau, given = np.empty(JOINTS), [np.ascontiguousarray(each, dtype=float) for each in (place, wrench, q)]
        addresses = [_address(each) for each in (*given, tau)]
        self._library.pull(self._machine_at, ctypes.c_int(link), *addresses)
        return tau

    def steady_friction(self, joint: int, v: float, load: float, t: float) -> float:
        """Friction torque at a constant speed [rad/s], at a transmitted torque [N·m] and time since the start [s]."""
        at = [ctypes.c_double(each) for each in (0.0, v, load, t)]
        slides = self._library.strength(self._machine_at, joint, *at)
        return float(np.sign(v)) * slides + self._library.viscous(self._machine_at, joint, at[1], at[3])


def _address(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
