"""Sine and cosine as LLVM IR: the same bits on every C library, CPU and number of lanes.

An angle is x = r + k π/2 with |r| ≤ π/4 and r in two parts. One polynomial each gives sin r and cos r.

Source: the three-part split of π/2 and the coefficients of the polynomials are those of Sun's fdlibm (k_sin.c, k_cos.c,
e_rem_pio2.c). Angles beyond the reach of the split follow Payne and Hanek, Radian reduction for trigonometric functions
(1983).
"""

import math
from functools import cache

from .text import Block, float_type, integer_type, number, splat

# π/2 in three parts. The product of k with each of the first two is exact for |k| < 2²⁰.
PIO2_1, PIO2_2, PIO2_3 = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21
REACH = 2.0**20
"""Largest angle for which the split is exact [rad]; a larger angle is reduced by the slow way, lane by lane."""

ROUNDING = 1.5 * 2.0**52
"""Constant that rounds to the nearest integer when added and subtracted; the low bits of the sum hold the integer."""

SIN = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
       2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
COS = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
       -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip

WINDOW = 192
"""Bits of 2/π that one angle needs: 53 of its own, 2 of the quadrant, 62 lost to cancellation, and 75 of margin."""

PADDING = 64
"""Zero bits before those of 2/π, so that the window of the smallest angle still begins inside the table."""


def sincos_name(lanes: int) -> str:
    """Name of the function that `sincos` defines."""
    return f"@exograv.sincos.{lanes}"


@cache
def sincos(lanes: int) -> str:
    """Definition of `{T, T} (T)`: sine and cosine of every lane, T double or a vector of doubles."""
    T, I = float_type(lanes), integer_type(lanes)  # noqa: E741 - the two types of the block
    block = Block()
    k_shifted = block.add(T, block.mul(T, "%x", splat(lanes, 2 / math.pi)), splat(lanes, ROUNDING))
    k = block.sub(T, k_shifted, splat(lanes, ROUNDING))
    quadrant = block.let(f"bitcast {T} {k_shifted} to {I}")
    high = block.sub(T, "%x", block.mul(T, k, splat(lanes, PIO2_1)))
    middle = block.mul(T, k, splat(lanes, PIO2_2))
    r_1, error = block.two_difference(T, high, middle)
    rest = block.sub(T, error, block.mul(T, k, splat(lanes, PIO2_3)))
    r = block.add(T, r_1, rest)
    c = block.add(T, block.sub(T, r_1, r), rest)
    size = block.let(f"call {T} @llvm.fabs.{_suffix(lanes)}({T} %x)")
    is_far = block.let(f"fcmp ogt {T} {size}, {splat(lanes, REACH)}")
    any_far = is_far if lanes == 1 else block.let(f"call i1 @llvm.vector.reduce.or.v{lanes}i1(<{lanes} x i1> {is_far})")
    slow, far = _slow_way(lanes, (r, c, quadrant), is_far)
    result = _polynomials(lanes)
    return f"""
define internal {{ {T}, {T} }} {sincos_name(lanes)}({T} %x) nounwind noinline {{
near:
{block.text}
  br i1 {any_far}, label %far, label %both
far:
{slow}
  br label %both
both:
  %r = phi {T} [ {r}, %near ], [ {far[0]}, %far ]
  %c = phi {T} [ {c}, %near ], [ {far[1]}, %far ]
  %quadrant = phi {I} [ {quadrant}, %near ], [ {far[2]}, %far ]
{result}
}}
"""


def _slow_way(lanes: int, near: tuple[str, str, str], is_far: str) -> tuple[str, tuple[str, str, str]]:
    """Reduce far lanes by `@exograv.reduce`, right for all angles but ten times slower; keep near lanes."""
    block = Block("%s")
    if lanes == 1:
        reduced = block.let("call { double, double, i64 } @exograv.reduce(double %x)")
        first, second, third = (block.let(f"extractvalue {{ double, double, i64 }} {reduced}, {i}") for i in range(3))
        return block.text, (first, second, third)
    T, I = float_type(lanes), integer_type(lanes)  # noqa: E741 - the types' letters
    types, elements = (T, T, I), ("double", "double", "i64")
    vectors = ["poison"] * 3
    for lane in range(lanes):
        x = block.let(f"extractelement {T} %x, i32 {lane}")
        reduced = block.let(f"call {{ double, double, i64 }} @exograv.reduce(double {x})")
        for i, (vector, element) in enumerate(zip(types, elements, strict=True)):
            part = block.let(f"extractvalue {{ double, double, i64 }} {reduced}, {i}")
            vectors[i] = block.let(f"insertelement {vector} {vectors[i]}, {element} {part}, i32 {lane}")
    # A lane must not depend on its neighbours, so near angles keep the bits of the near way.
    chosen = [block.select(lanes, is_far, T, far, close) for T, far, close in zip(types, vectors, near, strict=True)]
    return block.text, (chosen[0], chosen[1], chosen[2])


def _polynomials(lanes: int) -> str:
    """Return IR from %r, %c and %quadrant to the returned pair."""
    T, block = float_type(lanes), Block("%p")
    z = block.mul(T, "%r", "%r")
    half = block.mul(T, z, splat(lanes, 0.5))
    one = splat(lanes, 1.0)
    # sin(r + c) = r + r³ S(z) + c (1 − z/2)
    cubic = block.mul(T, block.mul(T, "%r", z), block.polynomial(T, z, [splat(lanes, s) for s in SIN]))
    tail = block.mul(T, "%c", block.sub(T, one, half))
    sine = block.add(T, "%r", block.add(T, cubic, tail))
    # cos(r + c) = 1 − z/2 + z² C(z) − r c, plus the rounding error of 1 − z/2.
    w = block.sub(T, one, half)
    lost = block.sub(T, block.sub(T, one, w), half)
    quartic = block.mul(T, block.mul(T, z, z), block.polynomial(T, z, [splat(lanes, s) for s in COS]))
    small = block.sub(T, quartic, block.mul(T, "%r", "%c"))
    cosine = block.add(T, w, block.add(T, lost, small))
    odd = block.bit(lanes, "%quadrant", 0)
    sine_turned = block.select(lanes, odd, T, cosine, sine)
    cosine_turned = block.select(lanes, odd, T, sine, cosine)
    sine_signed = block.flip_sign(lanes, sine_turned, "%quadrant")
    next_quadrant = block.let(f"add {integer_type(lanes)} %quadrant, {splat(lanes, 1, 'i64')}")
    cosine_signed = block.flip_sign(lanes, cosine_turned, next_quadrant)
    # The reduction turns −0 into +0, so a zero angle keeps its own sign.
    is_zero = block.let(f"fcmp oeq {T} %x, {splat(lanes, 0.0)}")
    sine_final = block.select(lanes, is_zero, T, "%x", sine_signed)
    pair = block.let(f"insertvalue {{ {T}, {T} }} poison, {T} {sine_final}, 0")
    both = block.let(f"insertvalue {{ {T}, {T} }} {pair}, {T} {cosine_signed}, 1")
    return f"{block.text}\n  ret {{ {T}, {T} }} {both}"


def _suffix(lanes: int) -> str:
    return "f64" if lanes == 1 else f"v{lanes}f64"


@cache
def reduction() -> str:
    """Definition of `@exograv.reduce`: an angle of any size to its remainder r and its quadrant.

    Let |x| = M 2^e with an integer M of 53 bits. Only the part of M 2^e · 2/π below 4 counts. So the bits of 2/π before
    weight 2 are left out, and the next 192 are enough. They are multiplied as integers, without rounding.
    """
    bits = PADDING + 1024 + WINDOW + 64
    table = _two_over_pi(bits)
    words = ", ".join(f"i8 {byte}" for byte in table.to_bytes(bits // 8, "little"))
    # The table is read from its low end: a window from bit k of 2/π ends bits − PADDING − k − 192 above that end.
    return f"""
@exograv.two_over_pi = internal unnamed_addr constant [{bits // 8} x i8] [{words}], align 16

define internal {{ double, double, i64 }} @exograv.reduce(double %x) nounwind noinline {{
  %bits = bitcast double %x to i64
  %size = and i64 %bits, 9223372036854775807
  %finite = icmp ult i64 %size, 9218868437227405312
  br i1 %finite, label %number, label %none
none:
  %nan = fsub double %x, %x
  %n0 = insertvalue {{ double, double, i64 }} poison, double %nan, 0
  %n1 = insertvalue {{ double, double, i64 }} %n0, double %nan, 1
  %n2 = insertvalue {{ double, double, i64 }} %n1, i64 0, 2
  ret {{ double, double, i64 }} %n2
number:
  %exponent = lshr i64 %size, 52
  %fraction = and i64 %size, 4503599627370495
  %mantissa = or i64 %fraction, 4503599627370496
  ; a near angle's result is thrown away, but it must not read beside the table
  %clipped = call i64 @llvm.umax.i64(i64 %exponent, i64 {1023 + 20})
  %low = sub i64 {bits - PADDING - WINDOW + 1075 + 2}, %clipped
  %byte = lshr i64 %low, 3
  %bit = and i64 %low, 7
  %address = getelementptr i8, ptr @exograv.two_over_pi, i64 %byte
  %read = load i200, ptr %address, align 1
  %bit_wide = zext i64 %bit to i200
  %shifted = lshr i200 %read, %bit_wide
  %window = trunc i200 %shifted to i192
  %mantissa_wide = zext i64 %mantissa to i192
  %product = mul i192 %window, %mantissa_wide
  %turns = lshr i192 %product, 190
  %quarter = trunc i192 %turns to i64
  %half = lshr i192 %product, 189
  %half_64 = trunc i192 %half to i64
  %up = and i64 %half_64, 1
  %quadrant = add i64 %quarter, %up
  %signed = shl i192 %product, 2
  %negative = icmp slt i192 %signed, 0
  %opposite = sub i192 0, %signed
  %magnitude = select i1 %negative, i192 %opposite, i192 %signed
  %zeros = call i192 @llvm.ctlz.i192(i192 %magnitude, i1 false)
  %zeros_64 = trunc i192 %zeros to i64
  %normal = shl i192 %magnitude, %zeros
  %top_wide = lshr i192 %normal, 139
  %top = trunc i192 %top_wide to i64
  %next_wide = lshr i192 %normal, 86
  %next_64 = trunc i192 %next_wide to i64
  %next = and i64 %next_64, 9007199254740991
  %scale_exponent = sub i64 970, %zeros_64
  %scale_bits = shl i64 %scale_exponent, 52
  %scale = bitcast i64 %scale_bits to double
  %top_double = uitofp i64 %top to double
  %next_double = uitofp i64 %next to double
  %next_scaled = fmul double %next_double, {number(2.0**-53)}
  %f_high = fmul double %top_double, %scale
  %f_low = fmul double %next_scaled, %scale
  %r = fmul double %f_high, {number(1.5707963267948966)}
  %minus_r = fneg double %r
  %lost = call double @llvm.fma.f64(double %f_high, double {number(1.5707963267948966)}, double %minus_r)
  %c_1 = fmul double %f_high, {number(6.123233995736766e-17)}
  %c_2 = fmul double %f_low, {number(1.5707963267948966)}
  %c_3 = fadd double %c_1, %c_2
  %c = fadd double %lost, %c_3
  %x_negative = icmp slt i64 %bits, 0
  %flip = xor i1 %negative, %x_negative
  %r_minus = fneg double %r
  %c_minus = fneg double %c
  %r_signed = select i1 %flip, double %r_minus, double %r
  %c_signed = select i1 %flip, double %c_minus, double %c
  %quadrant_minus = sub i64 0, %quadrant
  %quadrant_signed = select i1 %x_negative, i64 %quadrant_minus, i64 %quadrant
  %o0 = insertvalue {{ double, double, i64 }} poison, double %r_signed, 0
  %o1 = insertvalue {{ double, double, i64 }} %o0, double %c_signed, 1
  %o2 = insertvalue {{ double, double, i64 }} %o1, i64 %quadrant_signed, 2
  ret {{ double, double, i64 }} %o2
}}
declare i192 @llvm.ctlz.i192(i192, i1)
declare i64 @llvm.umax.i64(i64, i64)
declare double @llvm.fma.f64(double, double, double)
"""


def _two_over_pi(bits: int) -> int:
    """2/π as an integer in units of 2^−(bits − PADDING), by Machin's formula for π."""
    guard = bits + 64

    def arctangent_of_inverse(n: int) -> int:
        term = total = (1 << guard) // n
        k, sign = 3, -1
        while term:
            term //= n * n
            total += sign * (term // k)
            k, sign = k + 2, -sign
        return total

    pi = 4 * (4 * arctangent_of_inverse(5) - arctangent_of_inverse(239))
    return (2 << (guard + bits - PADDING)) // pi
