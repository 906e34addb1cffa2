"""The aligned tick in jax.numpy, written by hand: two recursions, friction, feedback."""

from collections.abc import Callable
from typing import Any

import numpy as np

from exograv.control.returned_friction import CERTAINTY, SHARE, TRAVEL, WARMED
from exograv.dynamics.friction import Friction
from exograv.dynamics.loop_torque import GRAVITY
from peers.tasks.programs import AlignedTick

from .jax_recursion import Recursion


def aligned_tick(jnp: Any, tick: AlignedTick) -> Callable[..., list[Any]]:
    """Return the tick with arguments and results of `programs.aligned_tick_function`."""
    arm, exo, heavy = Recursion(jnp, tick.arm), Recursion(jnp, tick.assembly.exo), tick.heavy
    n, machine = len(tick.arm.joints), tick.machine
    kp, kd = tick.feedback

    def evaluate(*inputs: Any) -> list[Any]:
        q, v, q_reference, v_reference, a_reference, x, mode, q_before, spring_before = inputs
        drive, gravity_level, arm_share = mode
        bodies = arm_share * x[: 10 * len(heavy)].reshape(-1, 10)
        phi = jnp.zeros((n, 10), q.dtype).at[np.array(heavy)].set(bodies)
        stiffness, offset, damping, rotor, coulomb, viscous = x[10 * len(heavy) :].reshape(6, n)
        v_driven, a_driven = drive * v_reference, drive * a_reference
        tau_arm = arm(q, v_driven, a_driven, phi, (1 - gravity_level) * jnp.asarray(GRAVITY, q.dtype))
        tau_arm += drive * (stiffness * q - offset + damping * v_driven)
        load = exo(q, v_driven, a_driven, machine.phi) + rotor * a_driven + tau_arm
        friction = _friction(jnp, machine.friction, coulomb, viscous, v_reference, load)
        known = machine.friction, machine.friction_sd
        stretched = (1 - drive) * spring_before + coulomb / TRAVEL * (q - q_before)
        returned, spring = _returned_friction(jnp, *known, coulomb, viscous, v, load, stretched)
        feedforward = load + drive * friction + (1 - drive) * returned
        feedback = kp.astype(q.dtype) * (q_reference - q) + kd.astype(q.dtype) * (v_reference - v)
        return [feedforward + drive * feedback, feedforward, tau_arm, spring]

    return evaluate


def _friction(jnp: Any, friction: Friction, coulomb: Any, viscous: Any, v: Any, load: Any) -> Any:
    breakaway, load_share, asymmetry, v_stribeck = (
        jnp.asarray(values, v.dtype)
        for values in (friction.breakaway, friction.load_share, friction.asymmetry, friction.v_stribeck)
    )
    sign = jnp.tanh(v / friction.v_rest)
    stribeck = 1 + (breakaway - 1) * jnp.exp(-(jnp.abs(v / v_stribeck) ** 1.3))
    return (coulomb * stribeck + load_share * jnp.abs(load)) * sign + asymmetry * sign**2 + viscous * v


def _returned_friction(
    jnp: Any, friction: Friction, sd: Friction, coulomb: Any, viscous: Any, v: Any, load: Any, stretched: Any
) -> tuple[Any, Any]:
    def as_array(values: Any) -> Any:
        return jnp.asarray(values, v.dtype)

    load_share = jnp.maximum(as_array(friction.load_share) - CERTAINTY * as_array(sd.load_share), 0)
    least = WARMED * coulomb - CERTAINTY * (as_array(sd.coulomb) + as_array(sd.asymmetry)) + load_share * jnp.abs(load)
    asymmetry = as_array(friction.asymmetry)
    forward, backward = SHARE * jnp.maximum(least + asymmetry, 0), SHARE * jnp.maximum(least - asymmetry, 0)
    spring = jnp.clip(stretched, -backward, forward)
    return spring + SHARE * (WARMED * viscous - CERTAINTY * as_array(sd.viscous)) * v, spring
