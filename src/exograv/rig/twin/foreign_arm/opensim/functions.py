"""Functions of an OpenSim file: transforms of joints by their coordinates, and couplings of coordinates."""

from collections.abc import Callable
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float
from numpy.polynomial import Polynomial

from exograv.errors import ModelError

from .values import numbers

Function = Callable[[float], float]
"""Function of a model's coordinate [rad, m]: returns a displacement of a joint, or the value of a coupled coordinate
[rad, m]."""

FUNCTIONS = (
    "Constant", "LinearFunction", "PolynomialFunction", "SimmSpline", "NaturalCubicSpline", "PiecewiseLinearFunction",
    "MultiplierFunction",
)  # fmt: skip
"""Classes that are read. `NaturalCubicSpline` is the name of `SimmSpline` in older files."""


def read_function(element: Element, where: str) -> Function:
    """Read a function.

    Args:
        element: Element with the name of the class.
        where: Joint or coupling of the function, for the message.

    Raises:
        ModelError: The class is unknown, or its numbers are not usable.
    """
    match element.tag:
        case "Constant":
            return Polynomial(numbers(element, "value", where, 1, (0.0,)))
        case "LinearFunction":
            return Polynomial(numbers(element, "coefficients", where, 2, (1.0, 0.0))[::-1])
        case "PolynomialFunction":
            return Polynomial(numbers(element, "coefficients", where, None)[::-1])
        case "SimmSpline" | "NaturalCubicSpline" | "PiecewiseLinearFunction":
            x, y = numbers(element, "x", where, None), numbers(element, "y", where, None)
            if len(x) != len(y) or len(x) < 2 or np.any(np.diff(x) <= 0.0):
                raise ModelError(
                    f"{where}: a {element.tag} has {len(x)} x and {len(y)} y; it needs two or more of each, with x "
                    "increasing. Correct it there."
                )
            return _piecewise(x, y) if element.tag == "PiecewiseLinearFunction" else _simm_spline(x, y)
        case "MultiplierFunction":
            scale = float(numbers(element, "scale", where, 1, (1.0,))[0])
            inner = read_function(single_function(element.find("function"), where), where)
            return _scaled(inner, scale)
    raise ModelError(
        f"{where}: the function class {element.tag} is not known. Known: {', '.join(FUNCTIONS)}. Replace it there."
    )


def single_function(holder: Element | None, where: str) -> Element:
    """Return the function in an element.

    Raises:
        ModelError: There is none, or more than one.
    """
    if holder is None or len(holder) != 1:
        raise ModelError(f"{where}: it has no function, or more than one. Give one of {', '.join(FUNCTIONS)}.")
    return holder[0]


def line_of(function: Function) -> tuple[float, float] | None:
    """Return slope and value at zero of a function, or None if it is not a straight line."""
    if not isinstance(function, Polynomial):
        return None
    coefficients = np.concatenate([function.coef, [0.0, 0.0]])
    return None if np.any(coefficients[2:]) else (float(coefficients[1]), float(coefficients[0]))


def after(outer: Function, inner: Function) -> Function:
    """Return the function that applies `inner`, then `outer`."""
    if isinstance(outer, Polynomial) and isinstance(inner, Polynomial):
        return outer(inner)
    return lambda q: outer(inner(q))


def powers_about(function: Function, at: float, low: float, high: float) -> tuple[Float[np.ndarray, " 5"], float]:
    """Return the coefficients of a polynomial in `q - at`, lowest power first, and its largest error in the range.

    The polynomial is the function itself up to the fourth power, else fitted. It has no error at `at`.
    """
    q = np.linspace(min(low, at), max(high, at), 201)
    values, start = np.array([function(one) for one in q]), function(at)
    moved = function(Polynomial([at, 1.0])) if isinstance(function, Polynomial) else None
    if isinstance(moved, Polynomial) and len(moved.trim().coef) <= 5:
        coefficients = np.concatenate([moved.trim().coef, np.zeros(5)])[:5]
    else:
        rows = np.stack([(q - at) ** power for power in range(1, 5)], axis=1)
        coefficients = np.array([start, *np.linalg.lstsq(rows, values - start, rcond=None)[0]])
    return coefficients, float(np.abs(Polynomial(coefficients)(q - at) - values).max())


def _scaled(function: Function, scale: float) -> Function:
    if isinstance(function, Polynomial):
        return function * scale
    return lambda q: scale * function(q)


def _piecewise(x: Float[np.ndarray, " node"], y: Float[np.ndarray, " node"]) -> Function:
    return _with_straight_ends(x, y, 1, None)


def _simm_spline(x: Float[np.ndarray, " node"], y: Float[np.ndarray, " node"]) -> Function:
    """Cubic spline whose third derivative at an end is that of the cubic through the four nodes there.

    Two nodes make a straight line, three a parabola.

    Source: Forsythe, Malcolm, Moler (1977), Computer Methods for Mathematical Computations, SPLINE.
    """
    if len(x) < 4:
        return _with_straight_ends(x, y, len(x) - 1, None)
    ends = ([(3, _third_derivative(x[:4], y[:4]))], [(3, _third_derivative(x[-4:], y[-4:]))])
    return _with_straight_ends(x, y, 3, ends)


def _third_derivative(x: Float[np.ndarray, " 4"], y: Float[np.ndarray, " 4"]) -> float:
    return 6.0 * sum(y[i] / np.prod([x[i] - x[j] for j in range(4) if j != i]) for i in range(4))


def _with_straight_ends(
    x: Float[np.ndarray, " node"], y: Float[np.ndarray, " node"], degree: int, ends: tuple[list, list] | None
) -> Function:
    from scipy.interpolate import make_interp_spline  # imported here: takes 0.1 s, and a drawn arm does not need it

    spline = make_interp_spline(x, y, k=degree, bc_type=ends)
    slope = spline.derivative()

    def value(q: float) -> float:
        inside = float(np.clip(q, x[0], x[-1]))
        return float(spline(inside) + (q - inside) * slope(inside))

    return value
