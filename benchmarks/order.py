"""Rate of multiplications and additions by the length of chains and of the program.

    python benchmarks/order.py

Independent chains, one after the other in a straight program; ns per operation in one state, one core.
"""

import casadi as ca

from peers import peaks

DEPTHS, WIDTHS = (2, 4, 8, 16), (64, 256, 512, 1024)
"""Steps of a chain, each a multiplication and an addition; number of chains."""


def main() -> None:
    """Print one line per length of chain; the program grows along the line."""
    x = ca.SX.sym("x")
    call = peaks.single_ns(ca.Function("empty", [x], [-x]))
    for depth in DEPTHS:
        found = []
        for width in WIDTHS:
            function = peaks.wide(peaks.SIDE_BY_SIDE["muladd"], width, depth)
            operations = peaks.operations(function)
            found.append(f"{operations} operations {(peaks.single_ns(function) - call) / operations:.3f}")
        print(f"chains of {2 * depth}:", ", ".join(found))


if __name__ == "__main__":
    main()
