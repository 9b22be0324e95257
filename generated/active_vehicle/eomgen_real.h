/* The number type `eomgen_real` and the arithmetic that generated code is written in.
 *
 * SPDX-License-Identifier: MIT
 *
 * One text serves four types, chosen when compiling:
 *   (nothing)             double
 *   -DEOMGEN_REAL_FLOAT   float, and no double in functions, for processors that compute in float alone
 *   -DEOMGEN_REAL_COMPLEX double complex, analytic in every function: for complex steps
 *   -DEOMGEN_REAL_LANES   EG_LANES doubles side by side (GCC or Clang vector extensions), one sample per lane, with the
 *                         same bits as double; -DEG_LANES=4, 8 or 16 sets their number
 *
 * All names have the prefix eomgen_ or eg_, so that the headers go with any others. The files of a model define
 * EOMGEN_SHORT_NAMES first and write `real` and K(constant).
 *
 * Values are combined with + - * / and with the macros EG_..., never with ?:, if or <math.h>. Functions of double and
 * lanes are texts of their own, with the same bits for all compilers, and of <math.h> take sqrt, floor and fabs alone.
 * Nothing here depends on the sign of zero but arc tangents, and nothing here may be compiled with -ffast-math.
 */
#ifndef EOMGEN_REAL_H
#define EOMGEN_REAL_H

#if defined(EOMGEN_REAL_FLOAT)
typedef float eomgen_real;
#define EG_LANES 1
#define EG_REAL_NAME "float"
#elif defined(EOMGEN_REAL_COMPLEX)
#include <complex.h>
#undef I
typedef double _Complex eomgen_real;
#define EG_LANES 1
#define EG_REAL_NAME "complex"
#elif defined(EOMGEN_REAL_LANES)
#if !defined(EG_LANES) /* one vector register: with more lanes, values are spilled to memory */
#if defined(__AVX512F__)
#define EG_LANES 8
#else
#define EG_LANES 4
#endif
#endif
#define EG_REAL_NAME "lanes"
typedef double eomgen_real __attribute__((vector_size(8 * EG_LANES)));
#else
typedef double eomgen_real;
#define EG_LANES 1
#define EG_REAL_NAME "double"
#define EG_REAL_IS_DOUBLE 1
#endif

#if !defined(__cplusplus) || defined(EOMGEN_CUDA) /* other C++ needs the type only */

#include <math.h>
#include <stdint.h>
#include <string.h>

/* -- bits of numbers ------------------------------------------------------------------------------------------- */

#if defined(EOMGEN_REAL_LANES)
typedef eomgen_real eg_wide;
typedef uint64_t eg_bits __attribute__((vector_size(8 * EG_LANES)));
#define EG_FOUR(c) (c), (c), (c), (c)
#if EG_LANES == 4
#define EG_WIDE(c) ((eg_wide){EG_FOUR(c)})
#elif EG_LANES == 8
#define EG_WIDE(c) ((eg_wide){EG_FOUR(c), EG_FOUR(c)})
#elif EG_LANES == 16
#define EG_WIDE(c) ((eg_wide){EG_FOUR(c), EG_FOUR(c), EG_FOUR(c), EG_FOUR(c)})
#else
#error "EG_LANES is 4, 8 or 16"
#endif
#define EG_MASK(condition) ((eg_bits)(condition))
static inline eg_bits eg_to_bits(eg_wide x) { return (eg_bits)x; }
static inline eg_wide eg_from_bits(eg_bits bits) { return (eg_wide)bits; }
#else
#if defined(EOMGEN_REAL_FLOAT)
typedef float eg_wide;
typedef uint32_t eg_bits;
#else
typedef double eg_wide;
typedef uint64_t eg_bits;
#endif
#define EG_WIDE(c) ((eg_wide)(c))
#define EG_MASK(condition) (0 - (eg_bits)(condition))
static inline eg_bits eg_to_bits(eg_wide x)
{
    eg_bits bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
static inline eg_wide eg_from_bits(eg_bits bits)
{
    eg_wide x;
    memcpy(&x, &bits, sizeof x);
    return x;
}
#endif

static inline eg_wide eg_mix(eg_bits mask, eg_wide then, eg_wide otherwise)
{
    return eg_from_bits((mask & eg_to_bits(then)) | (~mask & eg_to_bits(otherwise)));
}
/* The same by the processor's choice, or by jumps that are foreseen. */
#if defined(EOMGEN_REAL_LANES)
#define eg_blend(mask, then, otherwise) eg_mix(mask, then, otherwise)
#else
#define eg_blend(mask, then, otherwise) ((mask) ? (then) : (otherwise))
#endif

/* Result of a comparison: 1 or 0, or NaN if an operand is NaN, so that NaN does not vanish in a choice. */
static inline eg_wide eg_truth(eg_bits holds, eg_bits unordered)
{
    return eg_from_bits((holds & eg_to_bits(EG_WIDE(1.0))) | unordered);
}
static inline eg_wide eg_choose(eg_wide c, eg_wide x, eg_wide y)
{
    return eg_from_bits(eg_to_bits(eg_mix(EG_MASK(c != EG_WIDE(0.0)), x, y)) | EG_MASK(c != c));
}

#if defined(EOMGEN_REAL_FLOAT)
/* The rest of a large number after multiples of pi/2, and their number: 24 bits of x times the 64 bits of 2/pi that are
 * neither whole turns nor beyond 1e-9 of a turn (Payne and Hanek). */
static inline float eg_far_rest(float x, eg_bits *quadrant)
{
    static const uint32_t two_by_pi[] = {
        0, 0xa2f9836e, 0x4e441529, 0xfc2757d1, 0xf534ddc0, 0xdb629599, 0x3c439041};
    const eg_bits bits = eg_to_bits(x), start = ((bits >> 23) & 255) - 120; /* of these bits, after 32 zeros */
    const uint32_t *const words = two_by_pi + start / 32;
    const uint64_t number = (bits & 0x7fffff) | 0x800000;
    const uint64_t upper = (((uint64_t)words[0] << 32) | words[1]) << (start % 32);
    const uint64_t lower = (((uint64_t)words[1] << 32) | words[2]) << (start % 32);
    const eg_bits turn = (eg_bits)(number * (upper >> 32) + ((number * (lower >> 32)) >> 32));
    const eg_bits quarters = (turn + 0x20000000) >> 30;
    const float rest = (float)(int)(turn - (quarters << 30)) * 1.4629181e-9f; /* pi/2 / 2^30 */
    *quadrant = x < 0.0f ? 0 - quarters : quarters;
    return x < 0.0f ? -rest : rest;
}

/* Sine and cosine together. Multiples of pi/2 are taken off in three pieces (8 + 8 + 24 bits) up to 1e5, and as whole
 * numbers beyond. Absolute error below 1.3e-7; NaN for infinities. */
static inline void eg_sincos(eomgen_real x, eomgen_real *sine, eomgen_real *cosine)
{
    const float rounded = x * 0.63661977f + 12582912.0f; /* 1.5 * 2^23 */
    const float n = rounded - 12582912.0f;
    eg_bits quadrant = eg_to_bits(rounded);
    float r = ((x - n * 1.5703125f) - n * 4.8446655e-4f) + n * 6.3975784e-7f;
    if (fabsf(x) > 1e5f)
        r = eg_from_bits(eg_to_bits(eg_far_rest(x, &quadrant)) | EG_MASK(x - x != 0.0f)); /* all bits set: NaN */
    const float z = r * r;
    const float s = r + r * z * (-0.16666664f + z * (0.0083327482f + z * -1.958789e-4f));
    const float c = (1.0f - 0.5f * z) + z * z * (0.041666664f + z * (-0.0013888303f + z * 2.4547942e-5f));
    const eg_bits swapped = (eg_to_bits(s) ^ eg_to_bits(c)) & (0 - (quadrant & 1)); /* in odd quadrants */
    const eg_bits change = swapped ^ ((quadrant & 2) << 30);
    *sine = eg_from_bits(eg_to_bits(s) ^ change);
    *cosine = eg_from_bits(eg_to_bits(c) ^ change ^ (quadrant << 31));
}
#else
/* Sine and cosine without branches, as sums of two numbers, up to quadrants; multiples of pi/2 that were taken off.
 *
 * The argument is reduced by multiples of pi/2 in three pieces (20 + 20 + 53 bits, so that the first two products are
 * exact for multiples below 2^33), the rest of the reduction is carried to first order, and the quadrant is in the bits
 * of the rounded multiple. Absolute error of both below 1e-16 for |x| <= EG_LARGEST_ANGLE, with fused multiply-add or
 * without. Beyond (neighbouring numbers differ by 2e-6 and more), for NaN and for infinities both are NaN.
 */
#define EG_LARGEST_ANGLE 10000000000.0
static inline eg_bits eg_sincos_sums(eg_wide x, eg_wide *s, eg_wide *s_low, eg_wide *c, eg_wide *c_low)
{
    const eg_wide round = EG_WIDE(6755399441055744.0); /* 1.5 * 2^52 */
    const eg_bits magnitude = eg_to_bits(x) & UINT64_C(0x7fffffffffffffff);
    /* all bits set are a NaN; an argument that is NaN, and infinity less infinity, become NaN on the way */
    const eg_bits beyond = EG_MASK(eg_from_bits(magnitude) > EG_WIDE(EG_LARGEST_ANGLE));
    const eg_wide rounded = x * EG_WIDE(0.6366197723675814) + round;
    const eg_wide n = rounded - round;
    const eg_wide first = (x - n * EG_WIDE(1.5707969665527344)) - n * EG_WIDE(-6.39757672615815e-07);
    const eg_wide low = n * EG_WIDE(1.6513995372426592e-13);
    const eg_wide r = eg_from_bits(eg_to_bits(first + low) | beyond);
    const eg_wide rest = (first - r) + low;
    const eg_wide z = r * r;
    const eg_wide half = EG_WIDE(0.5) * z;
    const eg_wide near_one = EG_WIDE(1.0) - half;
    const eg_wide sine_tail = EG_WIDE(-0.16666666666666666) + z * (EG_WIDE(0.008333333333330948)
        + z * (EG_WIDE(-0.00019841269836758574) + z * (EG_WIDE(2.7557316102551507e-06)
        + z * (EG_WIDE(-2.5051131844808866e-08) + z * EG_WIDE(1.5918129280835e-10)))));
    const eg_wide cosine_tail = EG_WIDE(0.041666666666666664) + z * (EG_WIDE(-0.0013888888888887398)
        + z * (EG_WIDE(2.4801587298765686e-05) + z * (EG_WIDE(-2.755731727172921e-07)
        + z * (EG_WIDE(2.087614626828136e-09) + z * EG_WIDE(-1.1382632416743667e-11)))));
    *s = r;
    *s_low = z * r * sine_tail + rest * near_one;
    *c = near_one;
    *c_low = ((EG_WIDE(1.0) - near_one) - half) + (z * z * cosine_tail - r * rest);
    return eg_to_bits(rounded);
}
static inline void eg_sincos_wide(eg_wide x, eg_wide *sine, eg_wide *cosine)
{
    eg_wide s1, s2, c1, c2;
    const eg_bits quadrant = eg_sincos_sums(x, &s1, &s2, &c1, &c2);
    const eg_wide s = s1 + s2, c = c1 + c2;
    const eg_bits swapped = (eg_to_bits(s) ^ eg_to_bits(c)) & (0 - (quadrant & 1)); /* in odd quadrants */
    const eg_bits change = swapped ^ ((quadrant & 2) << 62);
    *sine = eg_from_bits(eg_to_bits(s) ^ change);
    *cosine = eg_from_bits(eg_to_bits(c) ^ change ^ (quadrant << 63));
}
#endif

#if defined(EG_REAL_IS_DOUBLE) || defined(EOMGEN_REAL_LANES)
/* -- exponential, logarithm and powers: one text for double and lanes -------------------------------------------- */

#if defined(EOMGEN_REAL_LANES)
/* Square roots, which compilers take side by side in an array of this length. */
static inline eg_wide eg_sqrt(eg_wide x)
{
    double y[EG_LANES];
    int lane;
    memcpy(y, &x, sizeof y);
    for (lane = 0; lane < EG_LANES; ++lane)
        y[lane] = sqrt(y[lane]);
    memcpy(&x, y, sizeof y);
    return x;
}
static inline eg_wide eg_magnitude(eg_wide x) { return eg_from_bits(eg_to_bits(x) & UINT64_C(0x7fffffffffffffff)); }
#else
static inline eg_wide eg_sqrt(eg_wide x) { return sqrt(x); }
static inline eg_wide eg_magnitude(eg_wide x) { return fabs(x); }
#endif

/* 2^n of n + 1.5 * 2^52 */
static inline eg_wide eg_power_of_two(eg_wide rounded)
{
    return eg_from_bits((eg_to_bits(rounded) - UINT64_C(0x4337fffffffffc01)) << 52);
}

/* x + addition = n ln(2) + r + *rest with |r| <= ln(2)/2; r is returned, and *rest is far below it. The multiple of
 * ln(2) is taken off in two pieces, of which the products with the first (32 bits) are exact. */
static inline eg_wide eg_reduce(eg_wide x, eg_wide addition, eg_wide *n, eg_wide *rest)
{
    const eg_wide round = EG_WIDE(6755399441055744.0); /* 1.5 * 2^52 */
    const eg_wide times = (x * EG_WIDE(1.4426950408889634) + round) - round;
    const eg_wide first = x - times * EG_WIDE(0.6931471803691238);
    const eg_wide low = times * EG_WIDE(1.9082149292705877e-10) - addition, r = first - low;
    *n = times;
    *rest = (first - r) - low;
    return r;
}

/* exp(x + low), low far below x; |x| may be infinite, low not.
 *
 * exp(x) = 2^n exp(r), and exp(r) is its Taylor series, whose rest is below 5e-18. 2^n is two factors, since it may
 * overflow although the result does not.
 */
static inline eg_wide eg_exp_of_sum(eg_wide x, eg_wide addition)
{
    const eg_wide round = EG_WIDE(6755399441055744.0); /* 1.5 * 2^52 */
    const eg_wide below = eg_blend(EG_MASK(x > EG_WIDE(710.0)), EG_WIDE(710.0), x);
    const eg_wide within = eg_blend(EG_MASK(below < EG_WIDE(-746.0)), EG_WIDE(-746.0), below);
    eg_wide n, rest;
    const eg_wide r = eg_reduce(within, addition, &n, &rest);
    const eg_wide half = n * EG_WIDE(0.5) + round, other = (n - (half - round)) + round;
    const eg_wide z = r * r, z2 = z * z;
    const eg_wide above = (EG_WIDE(1.0 / 40320.0) + r * EG_WIDE(1.0 / 362880.0))
        + z * (EG_WIDE(1.0 / 3628800.0) + r * EG_WIDE(1.0 / 39916800.0))
        + z2 * (EG_WIDE(1.0 / 479001600.0) + r * EG_WIDE(1.0 / 6227020800.0));
    const eg_wide tail = ((EG_WIDE(0.5) + r * EG_WIDE(1.0 / 6.0))
            + z * (EG_WIDE(1.0 / 24.0) + r * EG_WIDE(1.0 / 120.0)))
        + z2 * ((EG_WIDE(1.0 / 720.0) + r * EG_WIDE(1.0 / 5040.0)) + z * above);
    const eg_wide sum = EG_WIDE(1.0) + r;
    const eg_wide lost = ((EG_WIDE(1.0) - sum) + r) + rest; /* by the sum */
    const eg_wide result = sum + (z * tail + lost);
    return result * eg_power_of_two(half) * eg_power_of_two(other);
}

/* The exponential, within 0.6 units in the last place; infinity above ln(DBL_MAX), numbers below DBL_MIN as they
 * come. */
static inline eg_wide eg_exp(eg_wide x) { return eg_exp_of_sum(x, EG_WIDE(0.0)); }

/* x = 2^k (1 + f), sqrt(1/2) <= 1 + f < sqrt(2), f exact, of positive finite x. */
static inline eg_wide eg_split(eg_wide x, eg_wide *k)
{
    const eg_bits tiny = EG_MASK(x < EG_WIDE(2.2250738585072014e-308));
    const eg_wide normal = eg_blend(tiny, x * EG_WIDE(18014398509481984.0), x); /* 2^54 */
    const eg_bits shifted = eg_to_bits(normal) + UINT64_C(0x00095f619980c433); /* 1 in the place of sqrt(1/2) */
    const eg_wide exponent = eg_from_bits((shifted >> 52) | UINT64_C(0x4330000000000000)); /* + 2^52 + 1023 */
    const eg_bits mantissa = (shifted & UINT64_C(0x000fffffffffffff)) + UINT64_C(0x3fe6a09e667f3bcd);
    *k = exponent - eg_blend(tiny, EG_WIDE(4503599627371573.0), EG_WIDE(4503599627371519.0));
    return eg_from_bits(mantissa) - EG_WIDE(1.0);
}

/* The natural logarithm, within 1 unit in the last place; NaN below zero, minus infinity at zero.
 *
 * log(x) = k ln(2) + log(1 + f), and log(1 + f) = 2 artanh(s), s = f / (2 + f), whose series is summed as
 *     f - s (f - R),
 * since 2 s = f - s f and f is exact; the rest of the series is below 1e-19.
 */
static inline eg_wide eg_log(eg_wide x)
{
    eg_wide k;
    const eg_wide f = eg_split(x, &k);
    const eg_wide s = f / (EG_WIDE(2.0) + f);
    const eg_wide z = s * s, z2 = z * z, z4 = z2 * z2;
    const eg_wide R = z * (((EG_WIDE(2.0 / 3.0) + z * EG_WIDE(2.0 / 5.0))
        + z2 * (EG_WIDE(2.0 / 7.0) + z * EG_WIDE(2.0 / 9.0)))
        + z4 * (((EG_WIDE(2.0 / 11.0) + z * EG_WIDE(2.0 / 13.0)) + z2 * (EG_WIDE(2.0 / 15.0) + z * EG_WIDE(2.0 / 17.0)))
        + z4 * ((EG_WIDE(2.0 / 19.0) + z * EG_WIDE(2.0 / 21.0)) + z2 * EG_WIDE(2.0 / 23.0))));
    const eg_wide found = k * EG_WIDE(0.6931471803691238) + (f - (s * (f - R) - k * EG_WIDE(1.9082149292705877e-10)));
    const eg_wide infinity = EG_WIDE(HUGE_VAL);
    const eg_wide above = eg_mix(EG_MASK(x == infinity), infinity, found);
    const eg_wide known = eg_mix(EG_MASK(x == EG_WIDE(0.0)), -infinity, above);
    return eg_from_bits(eg_to_bits(known) | ~EG_MASK(x >= EG_WIDE(0.0))); /* all bits set are a NaN */
}

/* The upper 26 bits of a number: products of two such are exact, fused or not. */
static inline eg_wide eg_upper(eg_wide x) { return eg_from_bits(eg_to_bits(x) & UINT64_C(0xfffffffff8000000)); }

/* Whether a number is whole. */
static inline eg_bits eg_is_whole(eg_wide x)
{
    const eg_wide large = EG_WIDE(4503599627370496.0); /* 2^52: from here on all are */
    const eg_wide magnitude = eg_magnitude(x);
    return EG_MASK(magnitude >= large) | EG_MASK(((magnitude + large) - large) == magnitude);
}

/* Powers, within 1 unit in the last place, and at zeros, ones, infinities and NaN as in C99 (F.9.4.4).
 *
 * exp(y log(|x|)) with the logarithm as a sum of two numbers to 65 bits: pieces whose products are exact stand for
 * quotient, square and series (terms beyond the second in one number), as in fdlibm's e_pow.c.
 */
static inline eg_wide eg_pow(eg_wide x, eg_wide y)
{
    const eg_wide one = EG_WIDE(1.0), zero = EG_WIDE(0.0), infinity = EG_WIDE(HUGE_VAL);
    const eg_wide base = eg_magnitude(x);
    eg_wide k;
    const eg_wide f = eg_split(base, &k);
    /* s = f / (2 + f) */
    const eg_wide d = EG_WIDE(2.0) + f;
    const eg_wide d1 = eg_upper(d), d2 = (d - d1) + ((EG_WIDE(2.0) - d) + f);
    const eg_wide inverse = one / d;
    const eg_wide s1 = eg_upper(f * inverse), s2 = ((f - s1 * d1) - s1 * d2) * inverse;
    /* its square */
    const eg_wide square = s1 * s1, square2 = s2 * (s1 + s1 + s2);
    const eg_wide z = square + square2;
    const eg_wide z1 = eg_upper(z), z2 = (square - z1) + square2;
    /* log(1 + f) = 2 s w, w = 1 + z u, u = 1/3 + z/5 + ... */
    const eg_wide p2 = z * z, p4 = p2 * p2;
    const eg_wide t = z * (((EG_WIDE(1.0 / 5.0) + z * EG_WIDE(1.0 / 7.0))
        + p2 * (EG_WIDE(1.0 / 9.0) + z * EG_WIDE(1.0 / 11.0)))
        + p4 * (((EG_WIDE(1.0 / 13.0) + z * EG_WIDE(1.0 / 15.0)) + p2 * (EG_WIDE(1.0 / 17.0) + z * EG_WIDE(1.0 / 19.0)))
        + p4 * ((EG_WIDE(1.0 / 21.0) + z * EG_WIDE(1.0 / 23.0)) + p2 * EG_WIDE(1.0 / 25.0))));
    const eg_wide third = EG_WIDE(1.0 / 3.0);
    const eg_wide u = third + t;
    const eg_wide u1 = eg_upper(u), u2 = (u - u1) + (((third - u) + t) + EG_WIDE(1.850371707708594e-17));
    const eg_wide v1 = z1 * u1, v2 = z1 * u2 + z2 * u;
    const eg_wide w = one + v1;
    const eg_wide w1 = eg_upper(w), w2 = (w - w1) + (((one - w) + v1) + v2);
    const eg_wide near1 = EG_WIDE(2.0) * s1 * w1, near2 = EG_WIDE(2.0) * (s1 * w2 + s2 * (w1 + w2));
    const eg_wide far = k * EG_WIDE(0.6931471803691238); /* exact */
    const eg_wide sum = far + near1;
    const eg_wide l1 = eg_upper(sum);
    const eg_wide l2 = (sum - l1) + (((far - sum) + near1) + (near2 + k * EG_WIDE(1.9082149292705877e-10)));
    /* times y, if neither overflows; beyond 2^64 powers of all but 1 do, or vanish */
    const eg_wide most = EG_WIDE(18446744073709551616.0);
    const eg_wide low = eg_blend(EG_MASK(y < -most), -most, y), within = eg_blend(EG_MASK(low > most), most, low);
    const eg_wide y1 = eg_upper(within), y2 = within - y1;
    const eg_wide e1 = y1 * l1, e2 = y1 * l2 + y2 * (l1 + l2);
    const eg_wide exponent = e1 + e2, rest = (e1 - exponent) + e2;
    const eg_bits moderate = EG_MASK(eg_magnitude(exponent) < EG_WIDE(1000.0));
    const eg_wide found = eg_exp_of_sum(exponent, eg_blend(moderate, rest, zero));
    /* zero and infinite bases */
    const eg_bits at_zero = EG_MASK(base == zero), unbounded = EG_MASK(base == infinity);
    const eg_bits grows = (EG_MASK(y > zero) & unbounded) | (EG_MASK(y < zero) & at_zero);
    const eg_wide size = eg_blend(at_zero | unbounded, eg_blend(grows, infinity, zero), found);
    /* negative bases: the sign of odd powers, and no others than whole ones */
    const eg_bits whole = eg_is_whole(y), odd = whole & ~eg_is_whole(y * EG_WIDE(0.5));
    const eg_bits sign = eg_to_bits(x) & UINT64_C(0x8000000000000000);
    const eg_bits none = (EG_MASK(x < zero) & ~unbounded & ~whole) | EG_MASK(x != x) | EG_MASK(y != y);
    const eg_wide power = eg_from_bits((eg_to_bits(size) ^ (sign & odd)) | none);
    return eg_blend(EG_MASK(x == one) | EG_MASK(y == zero), one, power);
}

/* -- tangent, arcs and hyperbolic functions: one text for double and lanes --------------------------------------- */

#define EG_SIGN_BIT UINT64_C(0x8000000000000000)
static inline eg_wide eg_with_sign(eg_wide magnitude, eg_wide x)
{
    return eg_from_bits(eg_to_bits(magnitude) | (eg_to_bits(x) & EG_SIGN_BIT));
}

/* The tangent, within 1.6 units in the last place and an error of the angle of 2e-29 |x|, which counts near zeros and
 * poles; NaN beyond EG_LARGEST_ANGLE. */
static inline eg_wide eg_tan(eg_wide x)
{
    eg_wide s1, s2, c1, c2;
    const eg_bits quadrant = eg_sincos_sums(x, &s1, &s2, &c1, &c2), odd = 0 - (quadrant & 1);
    const eg_wide s = s1 + s2, s_low = (s1 - s) + s2, c = c1 + c2, c_low = (c1 - c) + c2;
    const eg_wide n = eg_blend(odd, c, s), n_low = eg_blend(odd, c_low, s_low);
    const eg_wide d = eg_blend(odd, s, c), d_low = eg_blend(odd, s_low, c_low);
    const eg_wide q = n / d;
    return eg_from_bits(eg_to_bits(q + (n_low - q * d_low) * (EG_WIDE(1.0) / d)) ^ (quadrant << 63));
}

/* k pi/4 + x + low: low is far below x, and x below k pi/4, if k is not 0. */
static inline eg_wide eg_add_octants(eg_wide k, eg_wide x, eg_wide low)
{
    const eg_wide start = k * EG_WIDE(0.7853981633974483), sum = start + x; /* 50 bits of pi/4 */
    return sum + ((((start - sum) + x) + k * EG_WIDE(3.061616997868383e-17)) + low);
}

/* The arc tangent of s less s, |s| <= 1/2: a minimax polynomial. Tails of arcs of tiny numbers do not count and are
 * left out, since powers that underflow are slow. */
static inline eg_wide eg_arctangent_tail(eg_wide s)
{
    const eg_wide z = s * s, z2 = z * z, z4 = z2 * z2;
    const eg_wide arctangent = ((EG_WIDE(-0.3333333333333333) + z * EG_WIDE(0.19999999999999488))
        + z2 * (EG_WIDE(-0.14285714285599188) + z * EG_WIDE(0.11111111100917366)))
        + z4 * (((EG_WIDE(-0.09090908620322158) + z * EG_WIDE(0.0769229471253153))
        + z2 * (EG_WIDE(-0.06666435677102797) + z * EG_WIDE(0.05879578428252931)))
        + z4 * (((EG_WIDE(-0.0524009949916087) + z * EG_WIDE(0.04628024829886792))
        + z2 * (EG_WIDE(-0.038066535648503555) + z * EG_WIDE(0.02500650186282815)))
        + z4 * EG_WIDE(-0.009215790864615657)));
    return s * z * arctangent;
}

/* The angle of the point (x, y), 0 <= y <= x, or of its mirror image at y = x, if steep, and then at x = 0, if left.
 *
 * arctan(y/x) = pi/4 - arctan((x - y) / (x + y)) from y/x = 1/2 on; products of pieces give the rest of the quotient.
 */
static inline eg_wide eg_octant_angle(eg_wide y, eg_wide x, eg_bits steep, eg_bits left)
{
    const eg_wide zero = EG_WIDE(0.0), one = EG_WIDE(1.0);
    const eg_bits middle = EG_MASK(y + y > x);
    const eg_wide added = eg_blend(middle, y, zero), d = x + added, n = y - eg_blend(middle, x, zero); /* n exact */
    const eg_wide s = n / d, s1 = eg_upper(s), d1 = eg_upper(d), d2 = (d - d1) + ((x - d) + added);
    const eg_wide rest = (((n - s1 * d1) - s1 * d2) - (s - s1) * d) * (one / d);
    const eg_wide tail = eg_blend(EG_MASK(eg_magnitude(s) > EG_WIDE(1e-8)), eg_arctangent_tail(s), zero);
    const eg_wide first = eg_blend(middle, one, zero), second = eg_blend(steep, EG_WIDE(2.0) - first, first);
    const eg_wide times = eg_from_bits(eg_to_bits(one) ^ ((steep ^ left) & EG_SIGN_BIT));
    const eg_wide k = eg_blend(left, EG_WIDE(4.0) - second, second);
    return eg_add_octants(k, times * s, times * (rest + tail));
}

/* The arc tangent, within 1 unit in the last place. */
static inline eg_wide eg_atan(eg_wide x)
{
    const eg_wide size = eg_magnitude(x), one = EG_WIDE(1.0);
    const eg_bits large = EG_MASK(size > one);
    const eg_wide within = eg_blend(EG_MASK(size > EG_WIDE(1e300)), EG_WIDE(1e300), size);
    return eg_with_sign(eg_octant_angle(eg_blend(large, one, size), eg_blend(large, within, one), large, large & 0), x);
}

/* The angle of the point (x, y), within 1 unit in the last place, and at zeros and infinities as in C99 (F.9.1.4). */
static inline eg_wide eg_atan2(eg_wide y, eg_wide x)
{
    const eg_wide zero = EG_WIDE(0.0), one = EG_WIDE(1.0), across = eg_magnitude(y), along = eg_magnitude(x);
    const eg_bits steep = EG_MASK(across > along);
    const eg_wide small = eg_blend(steep, along, across), large = eg_blend(steep, across, along);
    /* times 2^480 or 2^-480: sums and products in the quotient neither overflow nor lose bits */
    const eg_bits huge = EG_MASK(large > EG_WIDE(3.273390607896142e+150));
    const eg_wide scale = eg_blend(huge, EG_WIDE(3.2033329522929615e-145), EG_WIDE(3.1217485503159922e+144));
    const eg_bits equal = EG_MASK(small == large), edge = equal | EG_MASK(large == EG_WIDE(HUGE_VAL));
    const eg_wide v = eg_blend(edge, one, large * scale);
    const eg_wide u = eg_blend(edge, eg_blend(equal & EG_MASK(small > zero), one, small * zero), small * scale);
    return eg_with_sign(eg_octant_angle(u, v, steep, 0 - (eg_to_bits(x) >> 63)), y);
}

/* The arc sine of s less s, s^2 = z <= 1/4: a minimax polynomial. */
static inline eg_wide eg_arcsine_tail(eg_wide s, eg_wide z)
{
    const eg_wide z2 = z * z, z4 = z2 * z2;
    const eg_wide arcsine = ((EG_WIDE(0.16666666666666669) + z * EG_WIDE(0.07499999999998433))
        + z2 * (EG_WIDE(0.044642857146355436) + z * EG_WIDE(0.030381944138530886)))
        + z4 * (((EG_WIDE(0.02237217294216482) + z * EG_WIDE(0.017352392720506888))
        + z2 * (EG_WIDE(0.013971212979125906) + z * EG_WIDE(0.011479177359082295)))
        + z4 * (((EG_WIDE(0.010322814725719012) + z * EG_WIDE(0.005457505063167516))
        + z2 * (EG_WIDE(0.017400884058616724) + z * EG_WIDE(-0.014851894447373372)))
        + z4 * EG_WIDE(0.02875785651315159)));
    return s * z * arcsine;
}

/* The arc sine of |x| up to 1/2, and beyond (*far) of s = sqrt((1 - |x|)/2), as s + *tail. */
static inline eg_wide eg_arc_sine(eg_wide x, eg_bits *far, eg_wide *tail)
{
    const eg_wide size = eg_magnitude(x), half = EG_WIDE(0.5);
    const eg_bits beyond = EG_MASK(size > half);
    const eg_wide z = eg_blend(beyond, half - half * size, size * size);
    const eg_wide s = eg_blend(beyond, eg_sqrt(z), size);
    *tail = eg_blend(EG_MASK(s > EG_WIDE(1e-8)), eg_arcsine_tail(s, z), EG_WIDE(0.0));
    *far = beyond;
    return s;
}

/* The arc sine, within 1.2 units in the last place; NaN beyond -1 and 1. */
static inline eg_wide eg_asin(eg_wide x)
{
    eg_bits far;
    eg_wide tail;
    const eg_wide s = eg_arc_sine(x, &far, &tail), two = EG_WIDE(2.0), times = eg_blend(far, -two, EG_WIDE(1.0));
    return eg_with_sign(eg_add_octants(eg_blend(far, two, EG_WIDE(0.0)), times * s, times * tail), x);
}

/* The arc cosine, within 1.2 units in the last place; NaN beyond -1 and 1. */
static inline eg_wide eg_acos(eg_wide x)
{
    eg_bits far;
    eg_wide tail;
    const eg_wide s = eg_arc_sine(x, &far, &tail), two = EG_WIDE(2.0), side = eg_with_sign(EG_WIDE(1.0), x);
    const eg_wide times = eg_blend(far, two, EG_WIDE(-1.0)) * side;
    return eg_add_octants(eg_blend(far, two - two * side, two), times * s, times * tail);
}

/* sinh(r) - r and cosh(r) - 1 of |r| <= ln(2)/2: Taylor series, whose rests are below 5e-18. */
static inline void eg_hyperbolic_series(eg_wide r, eg_wide *sine, eg_wide *cosine)
{
    const eg_wide z = r * r, z2 = z * z;
    *sine = r * z * (((EG_WIDE(1.0 / 6.0) + z * EG_WIDE(1.0 / 120.0))
        + z2 * (EG_WIDE(1.0 / 5040.0) + z * EG_WIDE(1.0 / 362880.0)))
        + z2 * z2 * (EG_WIDE(1.0 / 39916800.0) + z * EG_WIDE(1.0 / 6227020800.0)));
    *cosine = z * EG_WIDE(0.5) + z2 * (((EG_WIDE(1.0 / 24.0) + z * EG_WIDE(1.0 / 720.0))
        + z2 * (EG_WIDE(1.0 / 40320.0) + z * EG_WIDE(1.0 / 3628800.0)))
        + z2 * z2 * (EG_WIDE(1.0 / 479001600.0) + z * EG_WIDE(1.0 / 87178291200.0)));
}

/* Hyperbolic sine (part 0) or cosine (part 1) of |x|, within 1.4 units in the last place.
 *
 * |x| = n ln(2) + r; sinh|x| = b cosh(r) + a sinh(r) and cosh(x) = a cosh(r) + b sinh(r), with a = cosh(n ln(2)) and b
 * = sinh(n ln(2)). From n = 60 on both are 2^59, and the result is multiplied by a power of two, which may overflow.
 */
static inline eg_wide eg_hyperbolic(eg_wide x, int part)
{
    const eg_wide round = EG_WIDE(6755399441055744.0), one = EG_WIDE(1.0), most = EG_WIDE(60.0), end = EG_WIDE(711.0);
    const eg_wide size = eg_magnitude(x);
    eg_wide n, rest, sine, cosine;
    const eg_wide r = eg_reduce(eg_blend(EG_MASK(size > end), end, size), EG_WIDE(0.0), &n, &rest);
    const eg_wide m = eg_blend(EG_MASK(n > most), most, n);
    const eg_wide up = eg_power_of_two((m - one) + round), down = eg_power_of_two((round - m) - one);
    const eg_wide a = part ? up + down : up - down, b = part ? up - down : up + down;
    const eg_wide first = b * r, sum = a + first;
    eg_hyperbolic_series(r, &sine, &cosine);
    return (sum + (((a - sum) + first) + (b * (rest + sine) + a * cosine))) * eg_power_of_two((n - m) + round);
}
static inline eg_wide eg_sinh(eg_wide x) { return eg_with_sign(eg_hyperbolic(x, 0), x); }
static inline eg_wide eg_cosh(eg_wide x) { return eg_hyperbolic(x, 1); }

/* The hyperbolic tangent of x from 1/4 to 20: e / (e + 2), e = exp(2 x) - 1. */
static inline eg_wide eg_rising_tanh(eg_wide x)
{
    const eg_wide round = EG_WIDE(6755399441055744.0), one = EG_WIDE(1.0), two = EG_WIDE(2.0);
    eg_wide n, rest, sine, cosine;
    const eg_wide r = eg_reduce(two * x, EG_WIDE(0.0), &n, &rest), power = eg_power_of_two(n + round);
    eg_hyperbolic_series(r, &sine, &cosine);
    const eg_wide less = power - one, more = cosine + (sine + rest), sum = r + more, times = power * sum;
    const eg_wide e = less + times, e_low = ((less - e) + times) + power * ((r - sum) + more);
    const eg_wide d = e + two, d_low = e_low + (e - (d - two)), q = e / d; /* d_low matters, and is exact, below 2 */
    return q + (e_low - q * d_low) * (one / d);
}

/* The hyperbolic tangent of x from 0 to 1/4: a minimax polynomial. */
static inline eg_wide eg_small_tanh(eg_wide x)
{
    const eg_wide z = x * x, z2 = z * z;
    return x + x * z * (((EG_WIDE(-0.3333333333333331) + z * EG_WIDE(0.1333333333329479))
        + z2 * (EG_WIDE(-0.053968253869450214) + z * EG_WIDE(0.02186947902594781))) + z2 * z2 * ((
        EG_WIDE(-0.008862798753789404) + z * EG_WIDE(0.003581791786990957)) + z2 * EG_WIDE(-0.0013334287579797762)));
}

/* The hyperbolic tangent, within 1.4 units in the last place; of friction mostly of large and small numbers. */
static inline eg_wide eg_tanh(eg_wide x)
{
    const eg_wide size = eg_magnitude(x), most = eg_blend(EG_MASK(size > EG_WIDE(20.0)), EG_WIDE(1.0), size);
    const eg_bits far = EG_MASK(size > EG_WIDE(0.25)), between = EG_MASK(size > EG_WIDE(1e-8)) & EG_MASK(most == size);
    return eg_with_sign(eg_blend(between, eg_blend(far, eg_rising_tanh(size), eg_small_tanh(size)), most), x);
}

#define EG_TAN(x) eg_tan(x)
#define EG_ASIN(x) eg_asin(x)
#define EG_ACOS(x) eg_acos(x)
#define EG_ATAN(x) eg_atan(x)
#define EG_SINH(x) eg_sinh(x)
#define EG_COSH(x) eg_cosh(x)
#define EG_TANH(x) eg_tanh(x)
#define EG_EXP(x) eg_exp(x)
#define EG_LOG(x) eg_log(x)
#define EG_SQRT(x) eg_sqrt(x)
#define EG_ATAN2(y, x) eg_atan2(y, x)
#define EG_POW(x, y) eg_pow(x, y)
#define EG_ABS(x) eg_magnitude(x)
static inline void eg_sincos(eomgen_real x, eomgen_real *sine, eomgen_real *cosine) { eg_sincos_wide(x, sine, cosine); }
#endif

/* -- double, float and lanes ----------------------------------------------------------------------------------- */

#if !defined(EOMGEN_REAL_COMPLEX)
#define EG_C(c) EG_WIDE(c)
static inline eomgen_real eg_lt(eomgen_real x, eomgen_real y)
{
    return eg_truth(EG_MASK(x < y), EG_MASK((x != x) | (y != y)));
}
static inline eomgen_real eg_le(eomgen_real x, eomgen_real y)
{
    return eg_truth(EG_MASK(x <= y), EG_MASK((x != x) | (y != y)));
}
static inline eomgen_real eg_select(eomgen_real c, eomgen_real x, eomgen_real y) { return eg_choose(c, x, y); }
#if defined(EOMGEN_REAL_LANES)
#define EG_LANE(x, lane) ((x)[lane])
#else
#define EG_LANE(x, lane) (x)
#endif
#endif

#if defined(EOMGEN_REAL_FLOAT)
#define EG_TAN(x) tanf(x)
#define EG_ASIN(x) asinf(x)
#define EG_ACOS(x) acosf(x)
#define EG_ATAN(x) atanf(x)
#define EG_SINH(x) sinhf(x)
#define EG_COSH(x) coshf(x)
#define EG_TANH(x) tanhf(x)
#define EG_EXP(x) expf(x)
#define EG_LOG(x) logf(x)
#define EG_SQRT(x) sqrtf(x)
#define EG_ATAN2(y, x) atan2f(y, x)
#define EG_POW(x, y) powf(x, y)
#define EG_ABS(x) fabsf(x)
#endif

/* -- complex: comparisons look at real parts; every function is the analytic one around them ------------------- */

#if defined(EOMGEN_REAL_COMPLEX)
#define EG_C(c) ((eomgen_real)(c))
static inline eomgen_real eg_complex(double re, double im)
{
    double parts[2];
    eomgen_real z;
    parts[0] = re;
    parts[1] = im;
    memcpy(&z, parts, sizeof z);
    return z;
}
static inline void eg_sincos(eomgen_real x, eomgen_real *sine, eomgen_real *cosine)
{
    double s, c;
    const double sh = sinh(cimag(x)), ch = cosh(cimag(x));
    eg_sincos_wide(creal(x), &s, &c);
    *sine = eg_complex(s * ch, c * sh);
    *cosine = eg_complex(c * ch, -(s * sh));
}
static inline eomgen_real eg_lt(eomgen_real x, eomgen_real y)
{
    return (eomgen_real)eg_truth(EG_MASK(creal(x) < creal(y)), EG_MASK((x != x) | (y != y)));
}
static inline eomgen_real eg_le(eomgen_real x, eomgen_real y)
{
    return (eomgen_real)eg_truth(EG_MASK(creal(x) <= creal(y)), EG_MASK((x != x) | (y != y)));
}
static inline eomgen_real eg_select(eomgen_real c, eomgen_real x, eomgen_real y)
{
    return eg_complex(eg_choose(creal(c), creal(x), creal(y)), eg_choose(creal(c), cimag(x), cimag(y)));
}
static inline eomgen_real eg_abs(eomgen_real x) { return eg_select(eg_lt(x, EG_C(0.0)), -x, x); }
/* The angle of (x, y) turned back by the angle of the real parts is small: its arc tangent is on the right branch. */
static inline eomgen_real eg_atan2(eomgen_real y, eomgen_real x)
{
    const double angle = atan2(creal(y), creal(x)), c = cos(angle), s = sin(angle);
    return angle + catan((y * c - x * s) / (x * c + y * s));
}
/* x^y through the real parts, so that a negative base with an integer exponent stays exact. */
static inline eomgen_real eg_pow(eomgen_real x, eomgen_real y)
{
    const double a = creal(x), b = creal(y);
    eomgen_real value = (eomgen_real)pow(a, b);
    if (cimag(x) != 0.0) {
        value *= cexp(y * clog(x / a));
    }
    if (cimag(y) != 0.0) {
        value *= cexp(eg_complex(0.0, cimag(y) * log(a)));
    }
    return value;
}
#define EG_TAN(x) ctan(x)
#define EG_ASIN(x) casin(x)
#define EG_ACOS(x) cacos(x)
#define EG_ATAN(x) catan(x)
#define EG_SINH(x) csinh(x)
#define EG_COSH(x) ccosh(x)
#define EG_TANH(x) ctanh(x)
#define EG_EXP(x) cexp(x)
#define EG_LOG(x) clog(x)
#define EG_SQRT(x) csqrt(x)
#define EG_ATAN2(y, x) eg_atan2(y, x)
#define EG_POW(x, y) eg_pow(x, y)
#define EG_ABS(x) eg_abs(x)
#define EG_LANE(x, lane) (x)
#endif

/* -- the same for every type ----------------------------------------------------------------------------------- */

static inline eomgen_real eg_sin(eomgen_real x)
{
    eomgen_real of_sin, of_cos;
    eg_sincos(x, &of_sin, &of_cos);
    return of_sin;
}
#define EG_SIN(x) eg_sin(x)
static inline eomgen_real eg_cos(eomgen_real x)
{
    eomgen_real of_sin, of_cos;
    eg_sincos(x, &of_sin, &of_cos);
    return of_cos;
}
#define EG_COS(x) eg_cos(x)
/* NaN is kept by each of these macros: an argument outside of a curve must stop the run, not vanish in max(0,
 * curve). */
static inline eomgen_real eg_sign(eomgen_real x) { return eg_lt(EG_C(0.0), x) - eg_lt(x, EG_C(0.0)); }
static inline eomgen_real eg_min(eomgen_real x, eomgen_real y) { return eg_select(eg_lt(y, x), y, x); }
static inline eomgen_real eg_max(eomgen_real x, eomgen_real y) { return eg_select(eg_lt(x, y), y, x); }

#define EG_SINCOS(x, sine, cosine) eg_sincos(x, sine, cosine)
/* Angles in a loop: for lanes and without vector registers the given ones, else filled up to whole registers. */
#if defined(EOMGEN_REAL_LANES) || defined(EOMGEN_CUDA) || (defined(__arm__) && !defined(__ARM_NEON))
#define EG_ANGLES(there, filled) (there)
#else
#define EG_ANGLES(there, filled) (filled)
#endif
#define EG_LT(x, y) eg_lt(x, y)
#define EG_LE(x, y) eg_le(x, y)
#define EG_SELECT(c, x, y) eg_select(c, x, y)
#define EG_SIGN(x) eg_sign(x)
#define EG_MIN(x, y) eg_min(x, y)
#define EG_MAX(x, y) eg_max(x, y)

/* Parts of a function are not inlined, for any type: within one function compilers fuse products with sums. GCC 12
 * drops calls of parts that store in loops if it may look into them (it addresses the workspace from a table). */
#if defined(EOMGEN_CUDA)
#define EG_NOINLINE EG_CALLED
#elif defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 8
#define EG_NOINLINE __attribute__((noipa))
#elif defined(__GNUC__)
#define EG_NOINLINE __attribute__((noinline))
#else
#define EG_NOINLINE
#endif

#if defined(EOMGEN_SHORT_NAMES)
typedef eomgen_real real;
#define K(c) EG_C(c)
#endif

#endif /* __cplusplus */
#endif /* EOMGEN_REAL_H */
