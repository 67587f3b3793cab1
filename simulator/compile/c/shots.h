/* What `shoot_lanes.c` has for C text that is compiled apart from it, and so once for all recurrences of some sizes. */
HIDDEN int shoot_lanes(long first, long count, const double *t, const double *u, double h_max, const double *p,
                       const double *z, double ends[LANES][NS], double by[LANES][NS][NC]);
HIDDEN int output_jac_apart(const double **in, double **out);
#define output_jac(in, out, iw, w, memory) output_jac_apart(in, out)
