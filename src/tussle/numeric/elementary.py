"""Portable scalar elementary functions: only + - * / sqrt, comparisons, selects and bit operations, so all machines agree.

Reductions and polynomials are those of fdlibm (Sun Microsystems 1993, "Freely Distributable LIBM", files s_sin.c,
k_sin.c, k_cos.c, s_atan.c, e_asin.c, e_acos.c, e_exp.c, e_log.c), rearranged so that every argument takes the same
path: both polynomials of a pair are computed and one is selected, so a loop over rows can use SIMD. There are no
branches, tables or fused multiply-adds.

Rounding to an integer adds and subtracts 1.5 * 2**52. In round-to-nearest mode the low bits of the sum are that integer, so
no rounding instruction or conversion between float and int is needed; older CPUs have none for 64-bit lanes.
"""

import math

import numpy as np

from tussle.numeric.kernel import device

ROUNDER = 6755399441055744.0  # 1.5 * 2**52
ROUNDER_BITS = 0x4338000000000000

TWO_OVER_PI = 6.36619772367581382433e-01
# pi / 2 in three parts; the first two have 33 bits, so their products with a quotient below 2**20 are exact.
PIO2_1 = 1.57079632673412561417e00
PIO2_2 = 6.07710050630396597660e-11
PIO2_3 = 2.02226624879595063154e-21
REDUCED_LIMIT = 0.8  # a little above pi / 4: keeps sin and cos within [-1, 1] where the reduction has no precision left (|x| > 1e15)

PI = 3.141592653589793
ONE_OVER_TAU = 0.15915494309189535
PIO2_HIGH = 1.57079632679489655800e00
PIO2_LOW = 6.12323399573676603587e-17
# pi / 4 in two parts; the first has 50 bits, so its multiples 1 to 4 are exact.
PIO4_HIGH = 0.7853981633974483
PIO4_LOW = 3.061616997868383e-17
STEEPEST = 0.4375  # 7 / 16, the largest argument of the arc tangent polynomial

LOG2_E = 1.44269504088896338700e00
LN2_HIGH = 6.93147180369123816490e-01
LN2_LOW = 1.90821492927058770002e-10
SQRT_HALF_BITS = 0x3FE6A09E00000000  # about sqrt(1/2): mantissas are taken from [sqrt(1/2), sqrt(2))


@device
def reduce_quarter(x):
    """Reduce x modulo pi / 2. Returns (quadrant as int, remainder, rounding error of the remainder)."""
    shifted = x * TWO_OVER_PI + ROUNDER
    quadrant = np.float64(shifted).view(np.int64)
    k = shifted - ROUNDER
    first = x - k * PIO2_1
    product = k * PIO2_2
    second = first - product
    tail = ((first - second) - product) - k * PIO2_3
    r = second + tail
    tail = (second - r) + tail
    tail = 0.0 if (r > REDUCED_LIMIT) | (r < -REDUCED_LIMIT) else tail
    r = REDUCED_LIMIT if r > REDUCED_LIMIT else r
    r = -REDUCED_LIMIT if r < -REDUCED_LIMIT else r
    return quadrant, r, tail


@device
def sine_near_zero(x, tail):
    """Sine of x + tail for |x| <= pi / 4 (k_sin.c)."""
    z = x * x
    v = z * x
    r = 8.33333333332248946124e-03 + z * (
        -1.98412698298579493134e-04
        + z
        * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))
    )
    return x - ((z * (0.5 * tail - v * r) - tail) - v * -1.66666666666666324348e-01)


@device
def cosine_near_zero(x, tail):
    """Cosine of x + tail for |x| <= pi / 4 (k_cos.c)."""
    z = x * x
    r = z * (
        4.16666666666666019037e-02
        + z
        * (
            -1.38888888888741095749e-03
            + z
            * (
                2.48015872894767294178e-05
                + z
                * (
                    -2.75573143513906633035e-07
                    + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)
                )
            )
        )
    )
    half = 0.5 * z
    w = 1.0 - half
    return w + (((1.0 - w) - half) + (z * r - x * tail))


@device
def sincos(x):
    """Sine and cosine of x [rad] as a pair. Error below 1 ulp for |x| < 1.6e6, values in [-1, 1] beyond; NaN for infinities and NaN."""
    x = float(x)
    quadrant, r, tail = reduce_quarter(x)
    s = sine_near_zero(r, tail)
    c = cosine_near_zero(r, tail)
    odd = (quadrant & 1) != 0
    sine = c if odd else s
    cosine = s if odd else c
    sine = -sine if (quadrant & 2) != 0 else sine
    cosine = -cosine if ((quadrant + 1) & 2) != 0 else cosine
    sine = x if x == 0.0 else sine  # keeps the sign of zero
    return sine, cosine


@device
def sin(x):
    """Sine of x [rad]; same accuracy as `sincos`."""
    return sincos(x)[0]


@device
def cos(x):
    """Cosine of x [rad]; same accuracy as `sincos`."""
    return sincos(x)[1]


@device
def tan(x):
    """Tangent of x [rad]; error within 2 ulp for |x| < 1.6e6."""
    sine, cosine = sincos(x)
    return sine / cosine


@device
def wrap(angle):
    """Wrap an angle [rad] to (-pi, pi]; angles already in this range are returned unchanged."""
    angle = float(angle)
    k = (angle * ONE_OVER_TAU + ROUNDER) - ROUNDER
    r = ((angle - k * (4.0 * PIO2_1)) - k * (4.0 * PIO2_2)) - k * (4.0 * PIO2_3)
    r = PI if r > PI else r
    r = PI if r <= -PI else r
    return angle if (angle > -PI) & (angle <= PI) else r


@device
def arctangent_near_zero(x):
    """Arc tangent of |x| <= 7 / 16 (s_atan.c)."""
    z = x * x
    w = z * z
    even = z * (
        3.33333333333329318027e-01
        + w
        * (
            1.42857142725034663711e-01
            + w
            * (
                9.09088713343650656196e-02
                + w
                * (
                    6.66107313738753120669e-02
                    + w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)
                )
            )
        )
    )
    odd = w * (
        -1.99999999998764832476e-01
        + w
        * (
            -1.11111104054623557880e-01
            + w
            * (
                -7.69187620504482999495e-02
                + w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02)
            )
        )
    )
    return x - x * (even + odd)


@device
def atan2(y, x):
    """Angle [rad] of the vector (x, y) in [-pi, pi]; error within 2 ulp. Signed zeros and infinities are treated as in C."""
    y = float(y)
    x = float(x)
    y_negative = np.float64(y).view(np.int64) < 0
    x_negative = np.float64(x).view(np.int64) < 0
    ay = -y if y_negative else y
    ax = -x if x_negative else x
    steep = ay > ax
    low = ax if steep else ay
    high = ay if steep else ax
    endless = high == math.inf
    low = (1.0 if low == math.inf else 0.0) if endless else low
    high = 1.0 if endless else high
    # Scaling by powers of two prevents overflow of low + high and keeps quotients of subnormals exact.
    scale = 2.0**-600 if high > 2.0**900 else 1.0
    scale = 2.0**600 if high < 2.0**-900 else scale
    low = low * scale
    high = high * scale
    diagonal = low > STEEPEST * high
    numerator = low - high if diagonal else low
    denominator = low + high if diagonal else high
    denominator = 1.0 if denominator == 0.0 else denominator
    a = arctangent_near_zero(numerator / denominator)
    eighths = 1.0 if diagonal else 0.0
    eighths = 2.0 - eighths if steep else eighths
    a = -a if steep else a
    eighths = 4.0 - eighths if x_negative else eighths
    a = -a if x_negative else a
    angle = eighths * PIO4_HIGH + (a + eighths * PIO4_LOW)
    angle = -angle if y_negative else angle
    return math.nan if (x != x) | (y != y) else angle


@device
def arcsine_ratio(z):
    """(asin(x) - x) / x at z = x * x for |x| <= 1 / 2 (e_asin.c)."""
    p = z * (
        1.66666666666666657415e-01
        + z
        * (
            -3.25565818622400915405e-01
            + z
            * (
                2.01212532134862925881e-01
                + z
                * (
                    -4.00555345006794114027e-02
                    + z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)
                )
            )
        )
    )
    q = 1.0 + z * (
        -2.40339491173441421878e00
        + z * (2.02094576023350569471e00 + z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02))
    )
    return p / q


@device
def arcsine_parts(x):
    """Common part of asin and acos: (|x| < 1/2, ratio, root = sqrt((1 - |x|) / 2), root with its low 32 bits cleared, remainder)."""
    ax = -x if x < 0.0 else x
    small = ax < 0.5
    z = x * x if small else (1.0 - ax) * 0.5
    ratio = arcsine_ratio(z)
    root = math.sqrt(z)
    cut = np.int64(np.float64(root).view(np.int64) & -4294967296).view(np.float64)
    total = root + cut
    rest = (z - cut * cut) / (1.0 if total == 0.0 else total)
    return small, ratio, root, cut, rest


@device
def asin(x):
    """Arc sine [rad] of x in [-1, 1], NaN outside; error within 2 ulp."""
    x = float(x)
    small, ratio, root, cut, rest = arcsine_parts(x)
    p = 2.0 * root * ratio - (PIO2_LOW - 2.0 * rest)
    q = 0.5 * PIO2_HIGH - 2.0 * cut
    large = 0.5 * PIO2_HIGH - (p - q)
    large = -large if x < 0.0 else large
    return x + x * ratio if small else large


@device
def acos(x):
    """Arc cosine [rad] of x in [-1, 1], NaN outside; error within 2 ulp."""
    x = float(x)
    small, ratio, root, cut, rest = arcsine_parts(x)
    middle = PIO2_HIGH - (x - (PIO2_LOW - x * ratio))
    left = PI - 2.0 * (root + (ratio * root - PIO2_LOW))
    right = 2.0 * (cut + (ratio * root + rest))
    outer = left if x < 0.0 else right
    return middle if small else outer


@device
def power_of_two(k):
    """2.0 ** k for an integer -1022 <= k <= 1023."""
    return np.int64((k + 1023) << 52).view(np.float64)


@device
def exp(x):
    """Exponential of x; error within 1 ulp. Infinite above 709.78, subnormal below -708.4, 0 below -745.13 (e_exp.c)."""
    x = float(x)
    bounded = 710.0 if x > 710.0 else x
    bounded = -746.0 if bounded < -746.0 else bounded
    shifted = bounded * LOG2_E + ROUNDER
    k = np.float64(shifted).view(np.int64) - ROUNDER_BITS
    quotient = shifted - ROUNDER
    high = bounded - quotient * LN2_HIGH
    low = quotient * LN2_LOW
    r = high - low
    t = r * r
    c = r - t * (
        1.66666666666666019037e-01
        + t
        * (
            -2.77777777770155933842e-03
            + t
            * (
                6.61375632143793436117e-05
                + t * (-1.65339022054652515390e-06 + t * 4.13813679705723846039e-08)
            )
        )
    )
    y = 1.0 - ((low - (r * c) / (2.0 - c)) - high)
    half = (
        k >> 1
    )  # two factors, because 2 ** k alone leaves the range of normal numbers before the result does
    return (y * power_of_two(half)) * power_of_two(k - half)


@device
def log(x):
    """Natural logarithm of x; error within 1 ulp, subnormals included. -inf at 0, NaN below 0 (e_log.c)."""
    x = float(x)
    subnormal = x < 2.2250738585072014e-308
    scaled = x * 18014398509481984.0 if subnormal else x  # 2 ** 54
    bits = np.float64(scaled).view(np.int64) + (0x3FF0000000000000 - SQRT_HALF_BITS)
    exponent = (bits >> 52) - 1023
    k = np.int64(exponent + ROUNDER_BITS).view(np.float64) - ROUNDER
    k = k - 54.0 if subnormal else k
    f = np.int64((bits & 0x000FFFFFFFFFFFFF) + SQRT_HALF_BITS).view(np.float64) - 1.0
    half_square = 0.5 * f * f
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01))
    odd = z * (
        6.666666666666735130e-01
        + w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01))
    )
    result = k * LN2_HIGH - ((half_square - (s * (half_square + (odd + even)) + k * LN2_LOW)) - f)
    result = x if x == math.inf else result
    result = -math.inf if x == 0.0 else result
    return result if x >= 0.0 else math.nan
