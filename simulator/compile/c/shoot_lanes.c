/* Shots of LANES intervals at once, behind `sub_step_lanes.c`: what `shoot` of `loop.c` does, interval by interval.
   `shots.h` declares what others call. */

/* The block of `count` intervals from `first` on, the last of them repeated where there are less than LANES, and the
   states of the path z that they start from. */
static Block block_of(long first, long count, const double *t, const double *u, const double *z, Lanes *s) {
  Block b;
  for (int l = 0; l < LANES; ++l) {
    const long k = first + (l < count ? l : count - 1);
    b.t[l] = t[k];
    b.dt[l] = t[k + 1] - t[k];
    for (int i = 0; i < NU; ++i) { b.from[i][l] = u[k * NU + i]; b.to[i][l] = u[(k + 1) * NU + i]; }
    for (int i = 0; i < NS; ++i) s[i][l] = z[k * NS + i];
  }
  return b;
}

/* Shoots a block of intervals from the path z (n, NS): their ends, and the derivatives of these, of which only the NZ
   entries are written. Returns 0 where there is no solution. */
HIDDEN int shoot_lanes(long first, long count, const double *t, const double *u, double h_max, const double *p,
                       const double *z, double ends[LANES][NS], double by[LANES][NS][NC]) {
  Lanes s[NS], S[NZ];
  const Block b = block_of(first, count, t, u, z, s);
  for (int i = 0; i < NZ; ++i) S[i] = all(COLUMN[i] == NP + ROW[i]);
  run_lanes(&b, sub_steps(&b, h_max), p, s, S);
  for (int i = 0; i < NS; ++i) if (any(~finite(s[i]))) return 0;
  for (int l = 0; l < LANES; ++l) {
    for (int i = 0; i < NS; ++i) ends[l][i] = s[i][l];
    for (int i = 0; i < NZ; ++i) by[l][ROW[i]][COLUMN[i]] = S[i][l];
  }
  return 1;
}

/* The output at a sample, with its derivatives. */
HIDDEN int output_jac_apart(const double **in, double **out) { return output_jac(in, out, 0, 0, 0); }
