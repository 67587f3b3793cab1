/* A sub-step and the output around the generated functions of one recurrence, behind `parts.h`; `loop.py` has the same in
   Python. DERIVATIVES: whether they are wanted; SCALE: a small w; both come as definitions. */

/* Newton inside a bracket that the signs of the residual tighten; NaN when there is no root to be found.
   The residual rises through its root. After 40 rounds only halving is left, and that always ends. */
static double solve(const double *s, const double *e, const double *p) {
  double w, r[2], lo = -INFINITY, hi = INFINITY, reach = SCALE;
  double *out[2] = {&w, 0};
  CALL(guess, {s, e, p})
  out[0] = &r[0]; out[1] = &r[1];
  for (int i = 0; i < 120; ++i) {
    CALL(residual, {&w, s, e, p})
    if (!isfinite(r[0])) return NAN;
    if (r[0] > 0) hi = w; else lo = w;
    double after = w - r[0] / r[1];
    const double close = 1e-10 * (fabs(w) + SCALE);
    if (r[1] > 0 && fabs(after - w) <= close) return after;
    if (hi - lo <= close) return w;
    if (!(r[1] > 0 && after > lo && after < hi) || i > 40) {
      if (isinf(lo)) { after = w - reach; reach *= 4; }
      else if (isinf(hi)) { after = w + reach; reach *= 4; }
      else after = 0.5 * (lo + hi);
    }
    w = after;
  }
  return NAN;
}

/* result = A S + [B 0]; A is rows x NS and B rows x NP (both column-major), S and result row-major with NC columns.
   Returns whether all of it is finite. */
static int chain(int rows, const double *A, const double *B, const double *S, double *result) {
  int fine = 1;
  for (int i = 0; i < rows; ++i) {
    double *row = result + i * NC;
    for (int c = 0; c < NC; ++c) row[c] = c < NP ? B[i + rows * c] : 0;
    for (int j = 0; j < NS; ++j) {
      const double a = A[i + rows * j];
      if (a != 0) for (int c = 0; c < NC; ++c) row[c] += a * S[j * NC + c];
    }
    for (int c = 0; c < NC; ++c) fine = fine && isfinite(row[c]);
  }
  return fine;
}

/* One sub-step of the state, and of its derivatives S where they are wanted; 0 when no implicit root was found. */
static int advance(const double *e, const double *p, double *s, double *S) {
  double next[DIM(NS)];
  const double w = solve(s, e, p);
  if (!isfinite(w)) return 0;
#if DERIVATIVES
  double A[DIM(NS * NS)], B[DIM(NS * NP)], T[DIM(NS * NC)], *out[3] = {next, A, B};
  CALL(step_jac, {&w, s, e, p})
  chain(NS, A, B, S, T);
  for (int i = 0; i < NS * NC; ++i) S[i] = T[i];
#else
  double *out[1] = {next};
  CALL(step, {&w, s, e, p})
#endif
  for (int i = 0; i < NS; ++i) s[i] = next[i];
  return 1;
}

/* Sub-step j of so many between two samples; `end` is the sample that the inputs go to. */
static int sub_step(const double t, const double dt, long j, long steps, const double *u0, const double *end,
                    const double *p, double *s, double *S) {
  double e[NE];
#if STAGES == 2
  double s0[DIM(NS)], S0[DIM(NS * NC)];
  for (int i = 0; i < NS; ++i) s0[i] = s[i];
  if (DERIVATIVES) for (int i = 0; i < NS * NC; ++i) S0[i] = S[i];
  e[0] = t + (j + GAMMA) / steps * dt; e[1] = GAMMA * dt / steps;
  fill(e, u0, end, (j + GAMMA) / steps, (j + GAMMA) / steps);
  if (!advance(e, p, s, S)) return 0;
  for (int i = 0; i < NS; ++i) {
    s[i] = s0[i] + AHEAD[i] * (s[i] - s0[i]);
    if (DERIVATIVES) for (int c = i * NC; c < (i + 1) * NC; ++c) S[c] = S0[c] + AHEAD[i] * (S[c] - S0[c]);
  }
  e[0] = t + (j + 1.0) / steps * dt;
  fill(e, u0, end, (j + 1.0) / steps, (j + 1.0) / steps);
#else
  e[0] = t + (j + 0.5) / steps * dt; e[1] = dt / steps;
  fill(e, u0, end, (j + 0.5) / steps, (j + 1.0) / steps);
#endif
  return advance(e, p, s, S);
}

/* The output at sample k, with its derivatives where they are wanted; whether it and the state are finite. */
static int sample(long k, const double *e, const double *p, const double *s, const double *S, double *y, double *Y) {
  y += k * NY;
#if DERIVATIVES
  double C[DIM(NY * NS)], D[DIM(NY * NP)], *out[3] = {y, C, D};
  CALL(output_jac, {s, e, p})
  return finite_all(NS, s) && finite_all(NY, y) && chain(NY, C, D, S, Y + k * NY * NC);
#else
  double *out[1] = {y};
  CALL(output, {s, e, p})
  return finite_all(NS, s) && finite_all(NY, y);
#endif
}
