"""Plain least squares on a recording, and the nominal machine: what a fit has to beat.

Links with ten parameters each, rotors, Coulomb and viscous friction, one gain per joint from the known weight, and a
drive of first order with a dead time. Uncertainties, load, temperature and Stribeck's effect are left out.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import optimize, signal

from exograv.model.description import load_rig
from exograv.recording import read_recording

from .draw import PERIOD_S, G
from .engine import JOINTS, SHAPES, Engine, Joints, Rows
from .geometry import Geometry
from .session import RIG

CUT_HZ, EVERY = 12.0, 8
"""Cut-off frequency of the filters [Hz], and ticks from one used tick to the next."""
V_CLEAR = 0.04
"""Least speed of a joint whose friction has a direction [rad/s]."""
WEIGHT_LOWERS_S = 1.2
LEFT_OUT = ("breakaway", "releases")
LINK_PARAMETERS = 10
DRIVE_START = (2e-3, 250.0)
"""Dead time [s] and bandwidth [rad/s] from which the fit of a drive starts."""


@dataclass(frozen=True)
class Motion:
    """Filtered states and torques of one recording, one row per tick."""

    t: Float[np.ndarray, " tick"]
    q: Rows
    v: Rows
    a: Rows
    tau: Rows

    def chosen(self, which: np.ndarray) -> "Motion":
        """Return some of the ticks."""
        return Motion(*(getattr(self, name)[which] for name in ("t", "q", "v", "a", "tau")))


def read_motion(path: Path) -> tuple[np.ndarray, Motion]:
    """Read the ticks of a recording, and filter them in both directions."""
    ticks = read_recording(path).ticks
    sections = signal.butter(2, CUT_HZ, fs=1.0 / PERIOD_S, output="sos")
    q, tau = (
        signal.sosfiltfilt(sections, np.asarray(ticks[name], dtype=float), axis=0)
        for name in ("q_measured", "tau_measured")
    )
    v = np.gradient(q, PERIOD_S, axis=0)
    return ticks, Motion(ticks["t"].astype(float), q, v, np.gradient(v, PERIOD_S, axis=0), tau)


def empty_machine(geometry: Geometry) -> dict[str, np.ndarray]:
    """Values of a machine of this geometry without mass, friction and motors."""
    values = {name: np.zeros(shape) for name, shape in SHAPES.items()}
    known = {name: getattr(geometry, name) for name in ("axis", "origin", "rotation")}
    return values | known | {"gravity": np.array([0.0, 0.0, -G])}


def link_columns(geometry: Geometry, motion: Motion) -> Float[np.ndarray, "tick joint parameter"]:
    """Torque per mass, first moment and moment of inertia (about the joint's origin) of each link."""
    empty, columns = empty_machine(geometry), []

    def torque(link: int, mass: float, com: np.ndarray, inertia: np.ndarray) -> Rows:
        engine = Engine(empty, np.zeros(JOINTS))
        for name, value in (("mass", np.array(mass)), ("com", com), ("inertia", inertia)):
            whole = np.zeros(SHAPES[name])
            whole[link] = value
            engine.change(name, whole)
        return engine.torques(motion.q, motion.v, motion.a)

    for link in range(JOINTS):
        columns.append(of_mass := torque(link, 1.0, np.zeros(3), np.zeros((3, 3))))
        for com in np.eye(3):
            about_origin = com @ com * np.eye(3) - np.outer(com, com)
            columns.append(torque(link, 1.0, com, -about_origin) - of_mass)
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            inertia = np.zeros((3, 3))
            inertia[i, j] = inertia[j, i] = 1.0
            columns.append(torque(link, 0.0, np.zeros(3), inertia))
    return np.stack(columns, axis=-1)


def weight_torque(geometry: Geometry, motion: Motion, hung: Mapping[str, np.ndarray]) -> Rows:
    """Torque of known weights [kg] at mounts, one weight per tick and mount."""
    total = np.zeros(motion.q.shape)
    for mount, mass in hung.items():
        link, place = geometry.mounts[mount]
        engine = Engine(empty_machine(geometry), np.zeros(JOINTS))
        engine.change("mass", np.eye(JOINTS)[link])
        engine.change("com", np.tile(place, (JOINTS, 1)))
        total += mass[:, None] * engine.torques(motion.q, motion.v, motion.a)
    return total


def public_notes(path: Path) -> list[dict[str, Any]]:
    """Read the notes beside a recording."""
    return json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))["notes"]


def used_ticks(path: Path, t: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return which ticks are used, and the weight at each mount [kg]."""
    used, hung = np.zeros(len(t), dtype=bool), dict[str, np.ndarray]()
    used[::EVERY] = True
    phase_from = [(note["t"], note["phase"]) for note in public_notes(path) if "phase" in note]
    for (start, name), (end, _) in zip(phase_from, [*phase_from[1:], (np.inf, "")], strict=True):
        if name in LEFT_OUT:
            used &= ~((t >= start) & (t < end))
    for note in public_notes(path):
        if "lowering" in note:
            used &= ~((t > note["t"] - 0.1) & (t < note["t"] + WEIGHT_LOWERS_S))
        if "weight_kg" in note:
            hung.setdefault(note["mount"], np.zeros(len(t)))[t >= note["t"]] = note["weight_kg"]
    return used, hung


def friction_columns(v: Rows) -> Float[np.ndarray, "tick joint 3"]:
    """Coulomb friction, its part without direction, and viscous friction per unit."""
    return np.stack([np.tanh(v / V_CLEAR * 2.0), np.ones(v.shape), v], axis=-1)


@dataclass(frozen=True)
class PlainFit:
    """Result of the fit."""

    scale: Joints
    """True torque over the torque by the data sheet's gain [-]."""
    links: Float[np.ndarray, " parameter"]
    rotor: Joints
    friction: Float[np.ndarray, "joint 3"]

    def tau_measured(self, geometry: Geometry, motion: Motion) -> Rows:
        """Predict the torque by the data sheet's gain [N·m]."""
        links = link_columns(geometry, motion) @ self.links
        friction = np.einsum("tjk,jk->tj", friction_columns(motion.v), self.friction)
        return (links + self.rotor * motion.a + friction) / self.scale


def plain_fit(geometry: Geometry, path: Path, motion: Motion) -> PlainFit:
    """Fit links, rotors, friction and gains by least squares. The known weight sets the scale."""
    used, hung = used_ticks(path, motion.t)
    motion, hung = motion.chosen(used), {mount: mass[used] for mount, mass in hung.items()}
    links, weight = link_columns(geometry, motion), weight_torque(geometry, motion, hung)
    n_links, rubs = JOINTS * LINK_PARAMETERS, friction_columns(motion.v)
    blocks, rights, weights, owners = [], [], [], []
    for joint in range(JOINTS):
        moves = np.abs(motion.v[:, joint]) > V_CLEAR
        block = np.zeros((int(moves.sum()), n_links + 4 * JOINTS))
        block[:, :n_links] = links[moves, joint]
        block[:, n_links + joint] = motion.a[moves, joint]
        block[:, n_links + JOINTS + 3 * joint : n_links + JOINTS + 3 * joint + 3] = rubs[moves, joint]
        blocks.append(block)
        rights.append(motion.tau[moves, joint])
        weights.append(weight[moves, joint])
        owners.append(np.full(int(moves.sum()), joint))
    A, tau, w, owner = (np.concatenate(each) for each in (blocks, rights, weights, owners))

    def solved(scale: Joints) -> tuple[np.ndarray, np.ndarray]:
        per_row = scale[owner]
        x = np.linalg.lstsq(A / per_row[:, None], tau - w / per_row, rcond=1e-9)[0]
        return x, (A @ x + w) / per_row - tau

    found = optimize.least_squares(lambda scale: solved(scale)[1], np.ones(JOINTS), diff_step=1e-4, max_nfev=8)
    x = solved(found.x)[0]
    friction = x[n_links + JOINTS :].reshape(JOINTS, 3)
    return PlainFit(found.x, x[:n_links], x[n_links : n_links + JOINTS], friction)


def drive_response(tau: Float[np.ndarray, " tick"], delay: float, bandwidth: float) -> Float[np.ndarray, " tick"]:
    """Torque of a drive of first order after a dead time [s], for commands that each hold for a period."""
    whole = int(delay // PERIOD_S)
    late = delay / PERIOD_S - whole
    decay, rest = np.exp(-bandwidth * PERIOD_S), np.exp(-bandwidth * PERIOD_S * (1.0 - late))
    numerator = [*np.zeros(whole + 1), 1.0 - rest, rest - decay]
    return np.asarray(signal.lfilter(numerator, [1.0, -decay], tau))


def drive_fit(ticks: np.ndarray) -> tuple[Joints, Joints]:
    """Dead time [s] and bandwidth [rad/s] of each drive, from commanded and measured torque."""
    found = []
    for joint in range(JOINTS):
        asked, got = (np.asarray(ticks[name][:, joint], dtype=float) for name in ("tau_commanded", "tau_measured"))

        def error(x: np.ndarray, asked: np.ndarray = asked, got: np.ndarray = got) -> float:
            delay, bandwidth = np.abs(x) * DRIVE_START
            return float(np.sum((drive_response(asked, delay, bandwidth) - got)[100:] ** 2))

        best = optimize.minimize(error, np.ones(2), method="Nelder-Mead", options={"xatol": 1e-4, "fatol": 1e-9})
        found.append(np.abs(best.x) * DRIVE_START)
    delay, bandwidth = np.array(found).T
    return delay, bandwidth


def write_plain(geometry: Geometry, path: Path, held_out: Path, fit_path: Path) -> None:
    """Fit a recording, and write the fit in the form of `judge.FORM`."""
    ticks, motion = read_motion(path)
    fit = plain_fit(geometry, path, motion)
    steps = [note["t"] for note in public_notes(path) if note.get("phase") in ("steps", "releases")]
    delay, bandwidth = drive_fit(ticks[(ticks["t"] >= steps[0]) & (ticks["t"] < steps[1])])
    _, unseen = read_motion(held_out)
    none, ones = np.zeros((JOINTS, JOINTS)), np.eye(JOINTS)
    moved, still = (link_columns(geometry, Motion(none[0], none, none, a, none)) for a in (ones, none))
    axis = fit.rotor + np.einsum("jjk,k->j", moved - still, fit.links)
    speeds = np.concatenate([-np.linspace(0.0, 2.0, 200)[:0:-1], np.linspace(0.0, 2.0, 200)])
    table = np.einsum("tjk,jk->tj", friction_columns(np.tile(speeds[:, None], (1, JOINTS))), fit.friction)
    write_fit(
        fit_path,
        {
            "friction": {"speed_rad_s": speeds.tolist(), "torque_Nm": table.tolist(), "t_s": float(motion.t[-1]) / 2},
            "delay_ms": 1e3 * float(np.median(delay)),
            "lag_ms": (1e3 * (delay - np.median(delay) + 1.0 / bandwidth)).tolist(),
            "rotor_inertia_kgm2": fit.rotor.tolist(),
            "axis_inertia_kgm2": axis.tolist(),
            "gain_Nm_per_A": (fit.scale * load_rig(RIG, "right").nominal_gain).tolist(),
        },
        fit.tau_measured(geometry, unseen),
    )


def write_nominal(geometry: Geometry, held_out: Path, fit_path: Path) -> None:
    """Write the machine of URDF and data sheet, without friction, in the form of `judge.FORM`."""
    _, unseen = read_motion(held_out)
    description = load_rig(RIG, "right")
    rotor = description.per_actuator("rotor_inertia_kgm2")
    engine = Engine(empty_machine(geometry), np.zeros(JOINTS))
    for name in ("mass", "com", "inertia"):
        engine.change(name, getattr(geometry, name))
    M, _ = engine.links(np.zeros(JOINTS), np.zeros(JOINTS))
    speeds = [-3.0, 3.0]
    write_fit(
        fit_path,
        {
            "friction": {"speed_rad_s": speeds, "torque_Nm": np.zeros((2, JOINTS)).tolist()},
            "rotor_inertia_kgm2": rotor.tolist(),
            "axis_inertia_kgm2": (rotor + np.diag(M)).tolist(),
            "gain_Nm_per_A": description.nominal_gain.tolist(),
        },
        engine.torques(unseen.q, unseen.v, unseen.a) + rotor * unseen.a,
    )


def write_fit(path: Path, fit: dict[str, Any], held_out: Rows) -> None:
    """Write a fit with its held-out torque beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    torque = path.with_suffix(".npy")
    np.save(torque, held_out)
    path.write_text(json.dumps({**fit, "held_out_tau_Nm": torque.name}, indent=1), encoding="utf-8")
