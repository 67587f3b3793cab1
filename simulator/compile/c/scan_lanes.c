/* Runs over the samples of LANES segments at once, behind `sub_step_lanes.c`: what `scan` of `loop.c` does for one, with
   derivatives. */

/* A segment: n samples, times t (n), inputs u (n, NU), which are held from sample to sample or interpolated; resets (n,
   NS), or null: values that replace states behind a sample, NaN where one goes on; its first state s (NS). The run
   fills y (n, NY) and Y (n, NY, NC), the outputs and their derivatives. `c_loop.py` has the same fields in the same
   order. */
typedef struct {
  const double *t, *u, *resets, *s;
  double *y, *Y;
  long n, hold;
} Segment;

/* The output of a segment at sample k, from lane l of the states and their derivatives; whether all of it is finite. */
static int sample_of(const Segment *of, long k, int l, const double *p, const Lanes *s, const Lanes *S) {
  double e[NE], state[NS], C[DIM(NY * NS)], D[DIM(NY * NP)], *out[3] = {of->y + k * NY, C, D};
  const double *u = of->u + k * NU;
  e[0] = of->t[k]; e[1] = 0;
  fill(e, u, u, 0, 0);
  for (int i = 0; i < NS; ++i) state[i] = s[i][l];
  CALL(output_jac, {state, e, p})
  for (int r = 0; r < NY; ++r) {
    double *row = of->Y + (k * NY + r) * NC;
    for (int c = 0; c < NC; ++c) row[c] = c < NP ? D[r + NY * c] : 0;
    for (int i = 0; i < NZ; ++i) row[COLUMN[i]] += C[r + NY * ROW[i]] * S[i][l];
  }
  return finite_all(NS, state) && finite_all(NY, out[0]) && finite_all(NY * NC, of->Y + k * NY * NC);
}

/* Sets states of lane l back behind sample k; position and velocity forget what they depended on. */
static void set_back(const Segment *of, long k, int l, Lanes *s, Lanes *S) {
  const double *given = of->resets + k * NS;
  for (int i = 0; i < NS; ++i) if (!isnan(given[i])) {
    s[i][l] = given[i];
    for (int z = 0; i < MOTION && z < NZ; ++z) if (ROW[z] == i) S[z][l] = 0;
  }
}

/* Interval k of a segment as lane l of a block. */
static void put(const Segment *of, long k, int l, Block *b) {
  b->t[l] = of->t[k];
  b->dt[l] = of->t[k + 1] - of->t[k];
  for (int i = 0; i < NU; ++i) {
    b->from[i][l] = of->u[k * NU + i];
    b->to[i][l] = of->u[(k + !of->hold) * NU + i];
  }
}

/* How many segments are run at once. */
int lanes(void) { return LANES; }

/* Runs `count` segments, LANES at most. Returns 1, or 0 where the model has no solution on one of them. A lane whose
   segment is over goes on beside one that is not, and nobody reads it. */
int scan_lanes(long count, const Segment *segments, double h_max, const double *p) {
  Lanes s[NS], S[NZ];
  Block b;
  long longest = 0;
  for (int i = 0; i < NZ; ++i) S[i] = all(COLUMN[i] == NP + ROW[i]);
  for (int l = 0; l < LANES; ++l) for (int i = 0; i < NS; ++i) s[i][l] = segments[l < count ? l : 0].s[i];
  for (long l = 0; l < count; ++l) if (segments[l].n > longest) longest = segments[l].n;
  for (long k = 0; k < longest; ++k) {
    int open = -1;
    for (int l = 0; l < count; ++l) {
      const Segment *of = segments + l;
      if (k >= of->n) continue;
      if (!sample_of(of, k, l, p, s, S)) return 0;
      if (k + 1 == of->n) continue;
      if (of->resets) set_back(of, k, l, s, S);
      put(of, k, l, &b);
      open = l;
    }
    if (open < 0) break;
    for (int l = 0; l < LANES; ++l) if (l >= count || k + 1 >= segments[l].n) {
      put(segments + open, k, l, &b);
      for (int i = 0; i < NS; ++i) s[i][l] = s[i][open];
      for (int i = 0; i < NZ; ++i) S[i][l] = S[i][open];
    }
    run_lanes(&b, sub_steps(&b, h_max), p, s, S);
  }
  return 1;
}
