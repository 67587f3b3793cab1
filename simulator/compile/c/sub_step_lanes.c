/* Sub-steps of LANES intervals at once, behind `lanes.c`, `parts.h` and the functions of one recurrence, on lanes but
   for the output: what `sub_step.c` does for one.

   The derivatives S of the state have only NZ entries that can differ from zero; entry i is of state ROW[i] by column
   COLUMN[i], in the order of `sub_step.c`: NP parameters, then NS states of the start. */

/* `solve` of `sub_step.c`, until every interval has its root or none. */
static Lanes solve_lanes(const Lanes *s, const Lanes *e, const double *p) {
  Lanes w, r, slope, lo = all(-INFINITY), hi = all(INFINITY), reach = all(SCALE), found = all(NAN);
  lanes_guess(s, e, p, &w);
  Mask open = w == w;
  for (int i = 0; i < 120 && any(open); ++i) {
    lanes_residual(&w, s, e, p, &r, &slope);
    open &= finite(r);
    hi = choose(r > 0, w, hi);
    lo = choose(r > 0, lo, w);
    Lanes after = w - r / slope;
    const Lanes close = 1e-10 * (absolute(w) + SCALE);
    const Mask newton = (slope > 0) & (absolute(after - w) <= close), shut = hi - lo <= close;
    found = choose(open & (newton | shut), choose(newton, after, w), found);
    open &= ~(newton | shut);
    const Mask inside = (slope > 0) & (after > lo) & (after < hi) & (i > 40 ? (Mask){0} : ~(Mask){0});
    if (any(open & ~inside)) {
      const Mask below = lo == -INFINITY, above = hi == INFINITY;
      const Lanes step = choose(below, w - reach, choose(above, w + reach, 0.5 * (lo + hi)));
      reach = choose(~inside & (below | above), 4 * reach, reach);
      after = choose(inside, after, step);
    }
    w = after;
  }
  return found;
}

/* One sub-step of the states, which are NaN from there on where an implicit root is missing, and of their derivatives S
   unless that is null. */
static inline void advance_lanes(const Lanes *e, const double *p, Lanes *s, Lanes *S) {
  Lanes next[NS], T[NZ];
  const Lanes w = solve_lanes(s, e, p);
  if (S) {
    lanes_carry(&w, s, e, p, S, next, T);
    for (int i = 0; i < NZ; ++i) S[i] = T[i];
  } else lanes_step(&w, s, e, p, next);
  for (int i = 0; i < NS; ++i) s[i] = choose(finite(w), next[i], all(NAN));
}

/* The intervals of a block: times of their starts, lengths, inputs at both ends. */
typedef struct { Lanes t, dt, from[DIM(NU)], to[DIM(NU)]; } Block;

/* The exo of a stage that takes `share` of a sub-step, inputs at parts of the interval. */
static inline void fill_lanes(const Block *b, Lanes *e, double share, Lanes steps, Lanes at, Lanes end) {
  e[0] = b->t + at * b->dt;
  e[1] = share * b->dt / steps;
  for (int i = 0; i < NE - 2; ++i) {
    const int column = i < NU ? i : i - NU;
    e[2 + i] = b->from[column] + (i < NU ? at : end) * (b->to[column] - b->from[column]);
  }
}

/* `sub_step` of `sub_step.c`. */
static inline void sub_step_lanes(const Block *b, double j, Lanes steps, const double *p, Lanes *s, Lanes *S) {
  Lanes e[NE];
  const Lanes end = (j + 1.0) / steps;
#if STAGES == 2
  Lanes s0[NS], S0[NZ];
  const Lanes at = (j + GAMMA) / steps;
  for (int i = 0; i < NS; ++i) s0[i] = s[i];
  for (int i = 0; i < NZ && S; ++i) S0[i] = S[i];
  fill_lanes(b, e, GAMMA, steps, at, at);
  advance_lanes(e, p, s, S);
  for (int i = 0; i < NS; ++i) s[i] = s0[i] + AHEAD[i] * (s[i] - s0[i]);
  for (int i = 0; i < NZ && S; ++i) S[i] = S0[i] + AHEAD[ROW[i]] * (S[i] - S0[i]);
  fill_lanes(b, e, GAMMA, steps, end, end);
#else
  fill_lanes(b, e, 1.0, steps, (j + 0.5) / steps, end);
#endif
  advance_lanes(e, p, s, S);
}

/* The numbers of sub-steps, none longer than h_max. Fewer, where twice as many end at the same place but for a tenth of
   the model's noise, take longer to find than all of them do, and errors of a valve at rest add up: over a staircase
   the break-away force moved by 0.16 of its standard deviation. */
static Lanes sub_steps(const Block *b, double h_max) {
  Lanes steps = all(1);
  for (int l = 0; l < LANES; ++l) if (h_max > 0 && b->dt[l] > h_max) steps[l] = ceil(b->dt[l] / h_max - 1e-9);
  return steps;
}

/* Goes through all sub-steps; intervals with fewer than the others wait at their end. */
static void run_lanes(const Block *b, Lanes steps, const double *p, Lanes *s, Lanes *S) {
  for (double j = 0; any(steps > j); ++j) {
    const Mask open = steps > j;
    Lanes s0[NS], S0[NZ];
    const int waiting = any(~open);
    if (waiting) {
      for (int i = 0; i < NS; ++i) s0[i] = s[i];
      for (int i = 0; i < NZ && S; ++i) S0[i] = S[i];
    }
    sub_step_lanes(b, j, steps, p, s, S);
    if (waiting) {
      for (int i = 0; i < NS; ++i) s[i] = choose(open, s[i], s0[i]);
      for (int i = 0; i < NZ && S; ++i) S[i] = choose(open, S[i], S0[i]);
    }
  }
}
