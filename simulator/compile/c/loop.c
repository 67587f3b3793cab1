/* The loops over samples and sub-steps, behind `sub_step.c`; `loop.py` is the same in Python. They return -1, or the
   sample at which state, output or derivatives are not finite, or before which the implicit equation has no
   solution. Without DERIVATIVES nothing is read or written by way of S (but for resets), T and Y. */
long scan(long n, const double *t, const double *u, int hold, double h_max, const double *p,
          double *s, double *y, double *S, double *Y, const double *resets) {
  double e[NE];
  for (long k = 0; k < n; ++k) {
    const double *u0 = u + k * NU, *u1 = k + 1 < n ? u0 + NU : u0;
    e[0] = t[k]; e[1] = 0;
    fill(e, u0, u0, 0, 0);
    if (!sample(k, e, p, s, S, y, Y)) return k;
    if (k + 1 == n) break;
    if (resets) for (int i = 0; i < NS; ++i) if (!isnan(resets[k * NS + i])) {
      s[i] = resets[k * NS + i];
      for (int c = 0; i < MOTION && c < NC; ++c) S[i * NC + c] = 0;
    }
    const double dt = t[k + 1] - t[k];
    const long steps = h_max > 0 && dt > h_max ? (long)ceil(dt / h_max - 1e-9) : 1;
    for (long j = 0; j < steps; ++j)
      if (!sub_step(t[k], dt, j, steps, u0, hold ? u0 : u1, p, s, S)) return k + 1;
  }
  return -1;
}

/* Every interval between samples on its own: from state z[k] of a given path to the end f[k], with the derivatives
   T[k] (NS x NC) of that end, and the output y[k] at the sample with its derivatives Y[k].
   carried[i]: state i starts where the interval before it ended instead, and is written to the path. Samples `from` to
   `to` (excluded), so that threads can share the work. Returns -1 or the sample behind which it failed. */
long shoot(long from, long to, long n, const double *t, const double *u, double h_max, const double *p, double *z,
           double *f, double *T, double *y, double *Y, const unsigned char *carried) {
  double e[NE], s[DIM(NS)], S[DIM(NS * NC)];
  for (long k = from; k < to; ++k) {
    const double *u0 = u + k * NU, *u1 = k + 1 < n ? u0 + NU : u0;
    for (int i = 0; i < NS; ++i) s[i] = z[k * NS + i];
    for (int i = 0; i < NS * NC && DERIVATIVES; ++i) S[i] = 0;
    for (int i = 0; i < NS && DERIVATIVES; ++i) S[i * NC + NP + i] = 1;
    e[0] = t[k]; e[1] = 0;
    fill(e, u0, u0, 0, 0);
    if (!sample(k, e, p, s, S, y, Y)) return k;
    if (k + 1 == n) break;
    const double dt = t[k + 1] - t[k];
    const long steps = h_max > 0 && dt > h_max ? (long)ceil(dt / h_max - 1e-9) : 1;
    for (long j = 0; j < steps; ++j)
      if (!sub_step(t[k], dt, j, steps, u0, u1, p, s, S)) return k;
    for (int i = 0; i < NS; ++i) {
      f[k * NS + i] = s[i];
      if (carried[i]) z[(k + 1) * NS + i] = s[i];
    }
    for (int i = 0; i < NS * NC && DERIVATIVES; ++i) T[k * NS * NC + i] = S[i];
  }
  return -1;
}
