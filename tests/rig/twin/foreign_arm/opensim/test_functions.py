"""Functions of an OpenSim file have the values that OpenSim gives them."""

from xml.etree import ElementTree

import numpy as np
import pytest
from tests.rig.twin.foreign_arm.osim_text import spline

from exograv.errors import ModelError
from exograv.rig.twin.foreign_arm.opensim.functions import Function, after, powers_about, read_function

SAME = 1e-12
SIX = ([-2.0, -1.0, 0.0, 0.5, 1.2, 2.0], [0.3, 0.1, 0.0, 0.2, 0.15, -0.1])
THREE = ([0.0, 1.0, 3.0], [0.0, 1.0, 0.0])
AT = (-2.5, -1.7, -0.3, 0.25, 0.9, 1.9, 2.4)
# Values of SimmSpline of OpenSim 4.6 (package `opensim` 4.6 of PyPI), inside and outside of the nodes.
OF_SIX = (0.2895122863050622, 0.2792648397518739, -0.04329161540449722, 0.10215942176980641, 0.2180907343035431,
          -0.07228661045059015, -0.20511835222587352)  # fmt: skip
OF_THREE = (-3.75, -2.55, -0.45, 0.34375, 0.945, 1.045, 0.72)


def read(text: str) -> Function:
    return read_function(ElementTree.fromstring(text), "joint 'x'")


@pytest.mark.parametrize(("nodes", "values"), [(SIX, OF_SIX), (THREE, OF_THREE)])
@pytest.mark.parametrize("kind", ["SimmSpline", "NaturalCubicSpline"])
def test_a_spline_has_the_values_of_opensim(nodes: tuple[list, list], values: tuple, kind: str):
    function = read(spline(*nodes, kind=kind))
    assert [function(q) for q in AT] == pytest.approx(values, abs=SAME)


def test_a_cubic_through_its_own_nodes_is_that_cubic():
    x = np.linspace(-1.0, 1.0, 7)
    cubic = np.polynomial.Polynomial([0.1, -0.3, 0.2, 0.5])
    function = read(spline(list(x), list(cubic(x))))
    assert [function(q) for q in (-0.9, 0.05, 0.77)] == pytest.approx([cubic(q) for q in (-0.9, 0.05, 0.77)], abs=SAME)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("<Constant><value>0.3</value></Constant>", 0.3),
        ("<Constant/>", 0.0),
        ("<LinearFunction><coefficients>-2 0.5</coefficients></LinearFunction>", -3.5),
        ("<PolynomialFunction><coefficients>3 -1 0.5</coefficients></PolynomialFunction>", 3 * 4.0 - 2.0 + 0.5),
        ("<PiecewiseLinearFunction><x>0 1 3</x><y>0 1 5</y></PiecewiseLinearFunction>", 3.0),
        (
            "<MultiplierFunction><scale>-2</scale><function><LinearFunction><coefficients>1 1</coefficients>"
            "</LinearFunction></function></MultiplierFunction>",
            -6.0,
        ),
    ],
)
def test_a_function_has_its_value_at_two(text: str, value: float):
    assert read(text)(2.0) == pytest.approx(value, abs=SAME)


def test_a_function_of_a_function_of_polynomials_is_a_polynomial_without_error():
    quadratic = read("<PolynomialFunction><coefficients>1 0 0</coefficients></PolynomialFunction>")
    line = read("<LinearFunction><coefficients>2 1</coefficients></LinearFunction>")
    powers, error = powers_about(after(quadratic, line), 0.5, -1.0, 1.0)
    np.testing.assert_allclose(powers, [4.0, 8.0, 4.0, 0.0, 0.0], atol=SAME)
    assert error < SAME


def test_a_fitted_polynomial_is_exact_at_the_default_and_its_error_is_told():
    function = read(spline(*SIX))
    powers, error = powers_about(function, 0.2, -2.0, 2.0)
    assert powers[0] == pytest.approx(function(0.2), abs=SAME)
    q = np.linspace(-2.0, 2.0, 201)
    found = np.polynomial.Polynomial(powers)(q - 0.2)
    assert error == pytest.approx(max(abs(found - [function(one) for one in q])))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<Sine><amplitude>1</amplitude></Sine>", "function class Sine is not known"),
        ("<Constant><value>a</value></Constant>", "value is 'a'; it must be one finite number"),
        ("<Constant><value>inf</value></Constant>", "value is 'inf'"),
        ("<LinearFunction><coefficients>1 2 3</coefficients></LinearFunction>", "must be 2 finite numbers"),
        ("<PolynomialFunction/>", "must be finite numbers"),
        (spline([0.0, 0.0], [1.0, 2.0]), "with x increasing"),
        (spline([0.0, 1.0], [1.0]), "2 x and 1 y"),
        ("<MultiplierFunction><scale>2</scale></MultiplierFunction>", "has no function"),
    ],
)
def test_an_unusable_function_is_refused_with_its_place(text: str, words: str):
    with pytest.raises(ModelError, match=words) as caught:
        read(text)
    assert str(caught.value).startswith("joint 'x'")
