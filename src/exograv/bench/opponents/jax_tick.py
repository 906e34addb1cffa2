"""The aligned tick in jax.numpy, written by hand: two recursions, friction, feedback."""

from collections.abc import Callable
from typing import Any

import numpy as np

from exograv.bench.programs import AlignedTick
from exograv.control.friction_share import V_FULL, V_OFF
from exograv.control.tick import FRICTION_SHARE
from exograv.dynamics.friction import Friction
from exograv.dynamics.loop_torque import GRAVITY

from .jax_recursion import Recursion


def aligned_tick(jnp: Any, tick: AlignedTick) -> Callable[..., list[Any]]:
    """Arguments and results as of `programs.aligned_tick_function`."""
    arm, exo, heavy = Recursion(jnp, tick.arm), Recursion(jnp, tick.assembly.exo), tick.heavy
    n, machine = len(tick.arm.joints), tick.machine
    kp, kd = tick.feedback

    def evaluate(q: Any, v: Any, q_reference: Any, v_reference: Any, a_reference: Any, x: Any, mode: Any) -> list[Any]:
        drive, gravity_level, arm_share = mode
        bodies = arm_share * x[: 10 * len(heavy)].reshape(-1, 10)
        phi = jnp.zeros((n, 10), q.dtype).at[np.array(heavy)].set(bodies)
        stiffness, offset, damping, rotor, coulomb, viscous = x[10 * len(heavy) :].reshape(6, n)
        v_driven, a_driven = drive * v_reference, drive * a_reference
        tau_arm = arm(q, v_driven, a_driven, phi, (1 - gravity_level) * jnp.asarray(GRAVITY, q.dtype))
        tau_arm += drive * (stiffness * q - offset + damping * v_driven)
        load = exo(q, v_driven, a_driven, machine.phi) + rotor * a_driven + tau_arm
        friction = _friction(jnp, machine.friction, coulomb, viscous, v_reference, load)
        returned = FRICTION_SHARE * _friction_share(jnp, coulomb, viscous, v)
        feedforward = load + drive * friction + (1 - drive) * returned
        feedback = kp.astype(q.dtype) * (q_reference - q) + kd.astype(q.dtype) * (v_reference - v)
        return [feedforward + drive * feedback, feedforward, tau_arm]

    return evaluate


def _friction(jnp: Any, friction: Friction, coulomb: Any, viscous: Any, v: Any, load: Any) -> Any:
    breakaway, load_share, asymmetry, v_stribeck = (
        jnp.asarray(values, v.dtype)
        for values in (friction.breakaway, friction.load_share, friction.asymmetry, friction.v_stribeck)
    )
    sign = jnp.tanh(v / friction.v_rest)
    stribeck = 1 + (breakaway - 1) * jnp.exp(-(jnp.abs(v / v_stribeck) ** 1.3))
    return (coulomb * stribeck + load_share * jnp.abs(load)) * sign + asymmetry * sign**2 + viscous * v


def _friction_share(jnp: Any, coulomb: Any, viscous: Any, v: Any) -> Any:
    s = jnp.clip((jnp.abs(v) - V_OFF) / (V_FULL - V_OFF), 0, 1)
    return (3 * s**2 - 2 * s**3) * (coulomb * jnp.sign(v) + viscous * v)
