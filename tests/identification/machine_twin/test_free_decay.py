"""Free decay: a machine that is released without torque tells more beside driven motion, and nothing alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.errors import IdentificationError
from exograv.identification.calibration.empty_prior import COULOMB, VISCOUS, usual_friction
from exograv.identification.machine_twin.machine_fit import MachineFit, fit_machine
from exograv.identification.machine_twin.measured_motion import MeasuredMotion
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import load_rig
from exograv.model.tree import Tree

RIG = load_rig("recupera_like_qdd")
PERIOD_S, SUBSTEPS = 0.001, 4
RELEASES, RELEASE_S, DRIVEN_S = 20, 2.5, 50.0
NOISE_A = 0.02
FRICTION = {"coulomb": 0.4, "viscous": 1.6}
"""True friction over the usual one [-]."""

SHARPENED = 2e-3
"""Speed over which the true Coulomb friction changes its sign [rad/s]: it is smooth for the integrator."""

SIGMAS, BETTER = 4.0, 0.8
"""Largest normalised error, and largest standard deviation of a rotor over that without releases [-]."""


@dataclass(frozen=True)
class Machine:
    """Machine with drawn links, true friction and the rotors of its data sheet, solved apart from the fit."""

    tree: Tree
    friction: dict[str, np.ndarray]
    tau: ca.Function
    """Torque of the motors (joint,) [N·m] of q, v and a."""

    def driven(self) -> MeasuredMotion:
        """Record a motion along sums of sines with the torque that it needs."""
        t = PERIOD_S * np.arange(round(DRIVEN_S / PERIOD_S))
        rates, sizes = np.array([0.5, 0.7, 0.9, 1.1]), np.array([0.6, 0.3, 0.5, 0.7])
        q = np.array([0.7, 0.4, 0.0, 1.0]) + sizes * np.sin(np.outer(t, rates))
        v, a = sizes * rates * np.cos(np.outer(t, rates)), -sizes * rates**2 * np.sin(np.outer(t, rates))
        return recorded(0, q, np.array(self.tau.map(len(t))(q.T, v.T, a.T)).T)

    def releases(self) -> list[MeasuredMotion]:
        """Record releases from random postures without torque."""
        n = len(self.tree.joints)
        q, v, a = (ca.SX.sym(name, n) for name in ("q", "v", "a"))
        tau = self.tau(q, v, a)
        solved = ca.solve(ca.jacobian(tau, a), -ca.substitute(tau, a, ca.SX.zeros(n)))
        acceleration, dt = ca.Function("a", [q, v], [solved]), PERIOD_S / SUBSTEPS
        middle = q + 0.5 * dt * v, v + 0.5 * dt * acceleration(q, v)
        step = ca.Function("step", [q, v], [q + dt * middle[1], v + dt * acceleration(*middle)])
        rng, motions = np.random.default_rng(5), list[MeasuredMotion]()
        for number in range(RELEASES):
            at, speed, path = ca.DM(rng.uniform(-1.3, 1.3, n)), ca.DM.zeros(n), list[np.ndarray]()
            for _ in range(round(RELEASE_S / PERIOD_S)):
                path.append(np.array(at).ravel())
                for _ in range(SUBSTEPS):
                    at, speed = step(at, speed)
            motions.append(recorded(1 + number, np.array(path), np.zeros((len(path), n))))
        return motions


def recorded(number: int, q: np.ndarray, tau: np.ndarray) -> MeasuredMotion:
    """Recording with noise of the currents, and no commands or weights."""
    noise = NOISE_A * np.random.default_rng(number).standard_normal(q.shape)
    hung = np.zeros((len(q), len(RIG.mounts) * len(RIG.calibration.weights_kg)))
    t = PERIOD_S * np.arange(len(q))
    return MeasuredMotion(f"motion {number}", t, q, tau / RIG.nominal_gain + noise, np.full_like(q, np.nan), hung)


@pytest.fixture(scope="module")
def machine() -> Machine:
    nominal = {each.segment: each.nominal_m for each in RIG.settings.adjustments}
    tree = adjusted(read_exoskeleton(RIG), RIG, nominal)
    usual = {"coulomb": usual_friction(RIG, COULOMB)[0], "viscous": usual_friction(RIG, VISCOUS)[0]}
    friction = {name: FRICTION[name] * usual[name] for name in usual}
    q, v, a = (ca.SX.sym(name, len(tree.joints)) for name in ("q", "v", "a"))
    tau = rnea(tree, q, v, a, ca.SX(ca.DM(tree.phi.T)), ca.SX(ca.DM(GRAVITY)))
    tau += RIG.per_actuator("rotor_inertia_kgm2") * a
    tau += friction["coulomb"] * ca.tanh(v / SHARPENED) + friction["viscous"] * v
    return Machine(tree, friction, ca.Function("tau", [q, v, a], [tau]))


def errors(machine: Machine, found: MachineFit) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Errors of the parameters and their standard deviations."""
    layout, fit = found.fit.prior.layout, found.fit
    true = machine.friction | {"rotor": RIG.per_actuator("rotor_inertia_kgm2"), "inverse_gain": np.ones(4)}
    return {name: (fit.theta[layout.of(name)] - values, fit.sd[layout.of(name)]) for name, values in true.items()}


def fitted(machine: Machine, motions: Sequence[MeasuredMotion]) -> MachineFit:
    return fit_machine(RIG, machine.tree, tuple(motions))


def test_a_free_decay_beside_driven_motion_tells_the_rotors_better(machine: Machine):
    driven = machine.driven()
    alone, both = (errors(machine, fitted(machine, one)) for one in ([driven], [driven, *machine.releases()]))
    for error, sd in both.values():
        assert (np.abs(error) < SIGMAS * sd).all()
    assert (both["rotor"][1] < BETTER * alone["rotor"][1]).all()


def test_a_free_decay_alone_is_refused_because_links_and_friction_of_any_size_explain_it(machine: Machine):
    with pytest.raises(IdentificationError, match="no torque above its noise"):
        fitted(machine, machine.releases())
