/* What separately compiled parts of a library have in common. Sizes NS (states), NE (t, h, inputs, and inputs at the end
   of a sub-step where the recurrence asks for them), NU (inputs), NP (parameters that derivatives are taken by), NY and
   NC = NP + NS come as definitions. */
#include <math.h>

#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4
#endif
#define HIDDEN __attribute__((visibility("hidden")))
#define DIM(n) ((n) > 0 ? (n) : 1)
#define CALL(f, ...) { const double *in[] = __VA_ARGS__; f(in, out, 0, 0, 0); }

static int finite_all(int n, const double *values) {
  for (int i = 0; i < n; ++i) if (!isfinite(values[i])) return 0;
  return 1;
}

/* The inputs of exo: at a part of the way from u0 to u1, and at its end where there is room for them. */
static void fill(double *e, const double *u0, const double *u1, double part, double end) {
  for (int i = 0; i < NE - 2; ++i) {
    const double way = i < NU ? part : end;
    const int column = i < NU ? i : i - NU;
    e[2 + i] = u0[column] + way * (u1[column] - u0[column]);
  }
}
