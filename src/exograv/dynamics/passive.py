"""What the relaxed arm's own joints resist with: a spring about a neutral angle, and damping."""

import casadi as ca


def passive_torque(stiffness: ca.SX, spring_offset: ca.SX, damping: ca.SX, z: ca.SX, v_z: ca.SX) -> ca.SX:
    """Torque (freedom,) [N·m] that moving the arm's freedoms `z` [rad] at `v_z` [rad/s] costs beside its weight.

        tau = stiffness · z − spring_offset + damping · v_z,   spring_offset = stiffness · neutral angle

    Written with the product, so that it is linear in what is identified. It is identified, or it would bias the
    masses, and never compensated: weightlessness takes away weight, not elasticity.
    """
    return stiffness * z - spring_offset + damping * v_z
