"""Effect of fused multiply-add: CasADi's generated C with and without it, beside our native code.

    python benchmarks/fused.py

Medians of interleaved calls from Python, µs. Our code rounds after every operation, as the virtual machine does.
"""

import tempfile
from pathlib import Path

import numpy as np

from exograv.kernel.program import straight_line
from peers.opponents.generated_c import shared_library, single_call
from peers.opponents.native import Native
from peers.plan import task
from peers.rounds import Effort, timed

ROWS = ("rnea_7", "rnea_chain_12", "rnea_chain_20", "rnea_derivatives_7", "tick_general_4")
EFFORT = Effort(40, 0.005)


def main() -> None:
    """Time each row and print one line."""
    for name in ROWS:
        asked = task(name)
        function = straight_line(asked.function).function
        calls = {"exograv native": Native().build(asked, None)}
        for label, flags in (("C, fused", ()), ("C, not fused", ("-ffp-contract=off",))):
            with tempfile.TemporaryDirectory() as folder:
                calls[label] = single_call(function, shared_library(function, Path(folder), "double", "", *flags))
        times = timed(calls, lambda turn: asked.states[turn % len(asked.states)], EFFORT)  # noqa: B023 - used at once
        print(name, ", ".join(f"{label} {np.median(values) / 1e3:.3f}" for label, values in times.items()))


if __name__ == "__main__":
    main()
