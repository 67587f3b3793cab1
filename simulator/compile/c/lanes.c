/* Numbers of several intervals at once, a vector of the processor each, and the operations of `casadi_to_lanes.py` on
   them. They mean what they mean for one number; exp and expm1 are right to two units in the last place. */
#include <math.h>
#include <stdint.h>

#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4
#endif
typedef double Lanes __attribute__((vector_size(8 * LANES)));
typedef int64_t Mask __attribute__((vector_size(8 * LANES)));

static inline Lanes all(double x) { return (Lanes){0} + x; }

static inline Lanes choose(Mask which, Lanes yes, Lanes no) {
  return (Lanes)(((Mask)yes & which) | ((Mask)no & ~which));
}

static inline int any(Mask which) {
  int64_t found = 0;
  for (int l = 0; l < LANES; ++l) found |= which[l];
  return found != 0;
}

static inline Lanes truth(Mask which) { return choose(which, all(1), all(0)); }
static inline Lanes taken(Lanes which, Lanes x) { return choose(which != 0, x, all(0)); }
static inline Lanes absolute(Lanes x) { return (Lanes)((Mask)x & ~(Mask)all(-0.0)); }
static inline Mask finite(Lanes x) { return absolute(x) < INFINITY; }
static inline Lanes smaller(Lanes x, Lanes y) { return choose((x < y) | (y != y), x, y); }
static inline Lanes larger(Lanes x, Lanes y) { return choose((x > y) | (y != y), x, y); }
static inline Lanes sign_of(Lanes x) { return choose(x < 0, all(-1), choose(x > 0, all(1), x)); }

static inline Lanes root(Lanes x) {
  for (int l = 0; l < LANES; ++l) x[l] = sqrt(x[l]);
  return x;
}

/* exp(x) = (1 + near) 2^k for x = k log 2 + r and near = exp(r) - 1. The power comes as two factors, which are normal
   numbers even where the result overflows or vanishes. */
static inline void split(Lanes x, Lanes *near, Lanes *power, Lanes *rest) {
  const double shift = 0x1.8p52, high = 6.93147180369123816490e-01, low = 1.90821492927058770002e-10;
  static const double series[] = {1 / 479001600.0, 1 / 39916800.0, 1 / 3628800.0, 1 / 362880.0, 1 / 40320.0, 1 / 5040.0,
                                  1 / 720.0, 1 / 120.0, 1 / 24.0, 1 / 6.0, 1 / 2.0};
  x = choose(x < -1400, all(-1400), choose(x > 1400, all(1400), x));
  const Lanes shifted = x * 1.44269504088896340736 + shift, k = shifted - shift;
  const Lanes r = (x - k * high) - k * low;
  Lanes sum = all(1 / 6227020800.0);
  for (int i = 0; i < 11; ++i) sum = sum * r + series[i];
  *near = r + r * r * sum;
  const Mask whole = (Mask)shifted - (Mask)all(shift), half = whole >> 1;
  *power = (Lanes)((half + 1023) << 52);
  *rest = (Lanes)((whole - half + 1023) << 52);
}

static inline Lanes exponential(Lanes x) {
  Lanes near, power, rest;
  split(x, &near, &power, &rest);
  return choose(x != x, x, (1 + near) * power * rest);
}

static inline Lanes exponential_less_1(Lanes x) {
  Lanes near, power, rest;
  split(x, &near, &power, &rest);
  const Lanes far = (1 + near) * power * rest - 1, close = near * (power * rest) + (power * rest - 1);
  return choose(x != x, x, choose(absolute(x) < 40, close, far));
}

/* Functions of the C library, number by number. */
#define UNARY(f) static inline Lanes lanes_##f(Lanes x) { for (int l = 0; l < LANES; ++l) x[l] = f(x[l]); return x; }
#define BINARY(f) static inline Lanes lanes_##f(Lanes x, Lanes y) \
  { for (int l = 0; l < LANES; ++l) x[l] = f(x[l], y[l]); return x; }
UNARY(log) UNARY(sin) UNARY(cos) UNARY(tan) UNARY(asin) UNARY(acos) UNARY(atan) UNARY(sinh) UNARY(cosh) UNARY(tanh)
UNARY(asinh) UNARY(acosh) UNARY(atanh) UNARY(log1p) UNARY(erf) UNARY(floor) UNARY(ceil)
BINARY(pow) BINARY(atan2) BINARY(hypot) BINARY(remainder) BINARY(copysign) BINARY(fmod)
