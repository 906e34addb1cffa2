"""Passive torque of the relaxed arm's joints: a spring about a neutral angle, and damping."""

import casadi as ca


def passive_torque(stiffness: ca.SX, spring_offset: ca.SX, damping: ca.SX, z: ca.SX, v_z: ca.SX) -> ca.SX:
    """Torque (freedom,) [N·m] against the passive joints of the arm at `z` [rad] and `v_z` [rad/s].

        tau = stiffness · z − spring_offset + damping · v_z,   spring_offset = stiffness · neutral angle

    The product `spring_offset` makes the torque linear in the identified parameters. The passive torque is identified,
    because it would otherwise bias the masses. It is never compensated: weightlessness removes weight, not elasticity.
    """
    return stiffness * z - spring_offset + damping * v_z
