"""Correlation time of a residual; intervals that ignore the correlation are too small."""

import numpy as np
from jaxtyping import Float


def integrated_correlation(residual: Float[np.ndarray, " sample"], period_s: float, floor: float = 0.05) -> float:
    """Integrated autocorrelation time [s]: period · (1 + 2 Σ ρ_k), up to the first ρ_k below `floor`.

    White noise gives one period. Source: docs/explanation/identification.md, "coloured residuals".
    """
    centred = residual - residual.mean()
    power = float(centred @ centred)
    total = 1.0
    for k in range(1, len(centred) // 2):
        rho = float(centred[:-k] @ centred[k:]) / power if power > 0.0 else 0.0
        if rho < floor:
            break
        total += 2.0 * rho
    return period_s * total
