/* One pass of the smoother's filter along a path: every interval is shot from the path, its affine model is filtered
   with the derivatives of the means by the free coordinates, and the normal equations of the innovations are summed.
   The same as `linearised_model.py` does with `recursions.py`, in one go, so that what only the next step needs stays
   in the processor.

   Compiled behind `sub_step.c` and `shoot_lanes.c` of the simulator, whose derivatives are by the M = NP free
   parameters and the NS states [x, v, memory..., u, du]. All means are deviations from the path. Rows of M numbers are
   kept in WIDE ones, whole vectors of the processor, with zeros at their end. */
#define M NP
#define WIDE (M > 0 ? (M + 3) / 4 * 4 : 1)
#define FORCE (NS - 2)

/* What a pass is given; `compiled_pass.py` has the same fields in the same order. Rows of t (n), inputs (n, NU), path
   (n, NS), y and force (n), measured, NaN where nothing was; slope (M): of the parameters by their coordinates; first
   (NS): variances of the first state; base (NS - 2): variances of the noise of an interval, curvature: share of the
   square of its jump that is added; intensity (n - 1): of the noise of the force's slope, its scale in it. */
typedef struct {
  const double *t, *inputs, *p, *slope, *path, *y, *force, *first, *base, *intensity;
  double h_max, curvature, noise_y, noise_force, intensity_scale, runaway, tuning, outlier;
  long n, honest;
} Given;

/* What it fills, as `filtered` of `recursions.py` does; by (n, 2, M): derivatives of the innovations; scored, variances
   (n, 2): those by which an estimate is judged; gradient (M), matrix (M, M): of the normal equations; totals: robust
   loss of position and force, sum of the logarithms of their variances, number of positions, and of those far off. */
typedef struct {
  double *A, *P, *S, *E, *V, *J, *K, *H, *F, *by, *scored, *variances, *gradient, *matrix, *totals;
} Filled;

/* The sum of the logarithms of many factors, of which the product is kept as long as it is within range. */
typedef struct { double sum, product; } Logs;

static void multiply(Logs *logs, double factor) {
  logs->product *= factor;
  if (!(logs->product > 1e-100 && logs->product < 1e100)) { logs->sum += log(logs->product); logs->product = 1; }
}

/* A mean, its covariance, and its derivatives by the free coordinates. */
typedef struct { double a[NS], P[NS][NS], S[NS][WIDE]; } Belief;

/* What one scalar measurement says: its innovation e and that one's variance v, by how much it falls with the
   coordinates, J, and the gains K. */
typedef struct { double e, v, J[WIDE], K[NS]; } Innovation;

/* Takes a scalar measurement, which is off the path by e with noise variance r, into a belief. Its row by the states is
   h and its derivatives by the coordinates are D, or it is of one state alone where h is null. Returns whether the
   innovation is finite. */
static inline int take(Belief *b, int sensitive, const double *h, const double *D, int state, double e, double r,
                       Innovation *found) {
  double across[NS], v = r;
  for (int i = 0; i < NS; ++i) {
    across[i] = h ? 0 : b->P[i][state];
    for (int j = 0; j < NS && h; ++j) across[i] += b->P[i][j] * h[j];
  }
  for (int i = 0; i < NS && h; ++i) { e -= h[i] * b->a[i]; v += h[i] * across[i]; }
  if (!h) { e -= b->a[state]; v += across[state]; }
  for (int j = 0; j < WIDE && sensitive; ++j) {
    double fall = h ? D[j] : b->S[state][j];
    for (int i = 0; i < NS && h; ++i) fall += h[i] * b->S[i][j];
    found->J[j] = fall;
  }
  int fine = v > 0 && isfinite(e);
  for (int i = 0; i < NS; ++i) {
    const double gain = found->K[i] = across[i] / v;
    b->a[i] += gain * e;
    for (int j = 0; j < WIDE && sensitive; ++j) b->S[i][j] -= gain * found->J[j];
    for (int j = 0; j <= i; ++j) b->P[j][i] = b->P[i][j] -= gain * across[j];
  }
  for (int j = 0; j < WIDE && sensitive; ++j) fine &= isfinite(found->J[j]) != 0;
  found->e = e;
  found->v = v;
  return fine;
}

/* Nothing was measured. */
static inline int miss(Innovation *found) {
  *found = (Innovation){.v = INFINITY};
  return 1;
}

/* Carries a belief over an interval with transition F, derivatives G by the coordinates, jump and noise Q. The force
   and its slope depend on nothing before them among the states. */
static inline void predict(Belief *b, int sensitive, const double F[NS][NS], const double G[NS][WIDE],
                           const double *jump, const double Q[NS][NS]) {
  double a[NS], T[NS][NS], S[NS][WIDE];
  for (int i = 0; i < NS; ++i) {
    const int first = i < FORCE ? 0 : FORCE;
    a[i] = jump[i];
    for (int j = first; j < NS; ++j) a[i] += F[i][j] * b->a[j];
    for (int j = 0; j < NS; ++j) T[i][j] = 0;
    for (int k = first; k < NS; ++k) for (int j = 0; j < NS; ++j) T[i][j] += F[i][k] * b->P[k][j];
    if (!sensitive) continue;
    for (int j = 0; j < WIDE; ++j) S[i][j] = G[i][j];
    for (int k = first; k < NS; ++k) for (int j = 0; j < WIDE; ++j) S[i][j] += F[i][k] * b->S[k][j];
  }
  for (int i = 0; i < NS; ++i) {
    b->a[i] = a[i];
    for (int j = 0; j < WIDE && sensitive; ++j) b->S[i][j] = S[i][j];
    for (int j = 0; j <= i; ++j) {
      double value = Q[i][j];
      for (int k = j < FORCE ? 0 : FORCE; k < NS; ++k) value += T[i][k] * F[j][k];
      b->P[i][j] = b->P[j][i] = value;
    }
  }
}

/* The measurements of a sample, off the path by e (2), NaN where nothing was measured, and the third of
   `recursions.py`, which holds a velocity that nothing tells. Returns whether all is finite. */
static inline int measure(Belief *b, int sensitive, const Given *g, const double *e, const double *H, const double *D,
                          Innovation found[3]) {
  const double y = g->noise_y, u = g->noise_force, held = g->runaway;
  int fine = isnan(e[0]) ? miss(found) : take(b, sensitive, H, D, 0, e[0], y * y, found);
  fine &= isnan(e[1]) ? miss(found + 1) : take(b, sensitive, 0, 0, FORCE, e[1], u * u, found + 1);
  fine &= b->P[1][1] > held * held ? take(b, sensitive, 0, 0, 1, 0, held * held, found + 2) : miss(found + 2);
  return fine;
}

/* The covariance Q of an interval of length dt that ends `jump` beside the path. */
static inline void noise_of(const Given *g, long k, double dt, const double *jump, double curvature, double Q[NS][NS]) {
  const double w = g->intensity_scale * g->intensity[k];
  for (int i = 0; i < FORCE; ++i) Q[i][i] = g->base[i] + curvature * (jump[i] * jump[i]);
  Q[FORCE][FORCE] = w * (dt * dt * dt) / 3;
  Q[FORCE + 1][FORCE + 1] = w * dt;
  Q[FORCE][FORCE + 1] = Q[FORCE + 1][FORCE] = w * (dt * dt) / 2;
}

static void copy(const double *from, double *to, int count) { for (int i = 0; i < count; ++i) to[i] = from[i]; }

static void scaled(const double *from, const double *slope, double *to) {
  for (int i = 0; i < M; ++i) to[i] = from[i] * slope[i];
}

/* Keeps what the way back and the judgement of an estimate need of a sample. */
static inline void keep(const Filled *out, long k, const Innovation found[3]) {
  for (int c = 0; c < 3; ++c) {
    out->E[3 * k + c] = found[c].e;
    out->V[3 * k + c] = found[c].v;
    copy(found[c].K, out->K + (3 * k + c) * NS, NS);
    copy(found[c].J, out->J + (3 * k + c) * M, M);
  }
  for (int c = 0; c < 2; ++c) for (int j = 0; j < M; ++j) out->by[(2 * k + c) * M + j] = -found[c].J[j];
}

/* Sums of a pass; losses of the position and the force, and all variances, as products. */
typedef struct {
  double gradient[WIDE], matrix[WIDE][WIDE];
  Logs losses[2], variances;
  long positions, far;
} Sums;

/* Adds one innovation e of variance v to the normal equations, with the weight that Cauchy's loss gives it. */
static inline void add(Sums *sums, double e, double v, const double *J, double tuning) {
  const double weight = 1 / (v * (1 + e * e / (v * (tuning * tuning))));
  for (int j = 0; j < WIDE; ++j) sums->gradient[j] -= weight * e * J[j];
  for (int i = 0; i < M; ++i) {
    const double heavy = weight * J[i];
    for (int j = 0; j < WIDE; ++j) sums->matrix[i][j] += heavy * J[j];
  }
}

/* Adds one innovation by which the estimate is judged; channel 0 is the position. */
static inline void judge(Sums *sums, int channel, double e, double v, const Given *g) {
  const double square = e * e / v;
  multiply(&sums->losses[channel], 1 + square / (g->tuning * g->tuning));
  multiply(&sums->variances, v);
  if (channel == 0) { ++sums->positions; sums->far += square > g->outlier * g->outlier; }
}

static void hand_over(const Sums *sums, const Given *g, const Filled *out) {
  const double scale = g->tuning * g->tuning;
  copy(sums->gradient, out->gradient, M);
  for (int i = 0; i < M; ++i) copy(sums->matrix[i], out->matrix + i * M, M);
  for (int c = 0; c < 2; ++c) out->totals[c] = scale * (sums->losses[c].sum + log(sums->losses[c].product));
  out->totals[2] = sums->variances.sum + log(sums->variances.product);
  out->totals[3] = sums->positions;
  out->totals[4] = sums->far;
}

/* The output at sample k: what was measured less the path, e (2), and its rows by states, H, and coordinates, D. */
static inline int seen(const Given *g, long k, double *e, double *H, double *D) {
  const double *s = g->path + k * NS, *u = g->inputs + k * NU;
  double exo[NE], y, by[DIM(NP)], *out[3] = {&y, H, by};
  exo[0] = g->t[k]; exo[1] = 0;
  fill(exo, u, u, 0, 0);
  CALL(output_jac, {s, exo, g->p})
  scaled(by, g->slope, D);
  e[0] = g->y[k] - y;
  e[1] = g->force[k] - s[FORCE];
  return isfinite(y) && finite_all(NS, s) && finite_all(NS, H) && finite_all(M, by);
}

/* Interval k, shot to `end` with derivatives `by`: where it ends beside the path, its transition, and its derivatives
   by the coordinates. */
static inline void along(const Given *g, long k, const double *end, double by[NS][NC], double *jump, double F[NS][NS],
                         double G[NS][WIDE]) {
  for (int i = 0; i < NS; ++i) {
    jump[i] = end[i] - g->path[(k + 1) * NS + i];
    copy(by[i] + NP, F[i], NS);
    scaled(by[i], g->slope, G[i]);
  }
}

/* Keeps and adds up the innovations by which the estimate is judged. */
static inline void judge_all(const Given *g, const Filled *out, long k, const Innovation found[3], Sums *sums) {
  for (int c = 0; c < 2; ++c) {
    out->scored[2 * k + c] = found[c].e;
    out->variances[2 * k + c] = found[c].v;
    if (found[c].v < INFINITY) judge(sums, c, found[c].e, found[c].v, g);
  }
}

/* The pass. Returns 1, or 0 where the model or the filter has no finite answer. */
int filter_pass(const Given *g, const Filled *out) {
  double e[2], H[2 * NS] = {0}, D[WIDE] = {0}, F[NS][NS], G[NS][WIDE] = {{0}}, jump[NS], Q[NS][NS] = {{0}};
  double ends[LANES][NS], by[LANES][NS][NC] = {{{0}}};
  Innovation found[3];
  Belief b = {{0}}, plain = {{0}};
  Sums sums = {{0}};
  sums.losses[0].product = sums.losses[1].product = sums.variances.product = 1;
  H[NS + FORCE] = 1;
  for (int i = 0; i < NS; ++i) b.P[i][i] = plain.P[i][i] = g->first[i];
  for (long k = 0; k < g->n; ++k) {
    copy(b.a, out->A + k * NS, NS);
    copy(b.P[0], out->P + k * NS * NS, NS * NS);
    for (int i = 0; i < NS; ++i) copy(b.S[i], out->S + (k * NS + i) * M, M);
    if (!seen(g, k, e, H, D)) return 0;
    copy(H, out->H + k * 2 * NS, 2 * NS);
    if (!measure(&b, 1, g, e, H, D, found)) return 0;
    keep(out, k, found);
    for (int c = 0; c < 2; ++c) if (found[c].v < INFINITY) add(&sums, found[c].e, found[c].v, found[c].J, g->tuning);
    if (g->honest && !measure(&plain, 0, g, e, H, D, found)) return 0;
    judge_all(g, out, k, found, &sums);
    if (k + 1 == g->n) break;
    if (k % LANES == 0) {
      const long count = g->n - 1 - k < LANES ? g->n - 1 - k : LANES;
      if (!shoot_lanes(k, count, g->t, g->inputs, g->h_max, g->p, g->path, ends, by)) return 0;
    }
    along(g, k, ends[k % LANES], by[k % LANES], jump, F, G);
    copy(F[0], out->F + k * NS * NS, NS * NS);
    const double dt = g->t[k + 1] - g->t[k];
    if (g->honest) {
      noise_of(g, k, dt, jump, 0, Q);
      predict(&plain, 0, F, G, jump, Q);
    }
    noise_of(g, k, dt, jump, g->curvature, Q);
    predict(&b, 1, F, G, jump, Q);
  }
  hand_over(&sums, g, out);
  return 1;
}

/* The way back: a path beside that of the linearisation, out (n, NS), as `smoothed` of `recursions.py` has it, with the
   coordinates moved by `move` (M), null where they stay, and `share` of the step at unchanged coordinates; and where
   adjoints (n, NS) is not null, the gradient of half the sum of squares by the predicted states. */
void way_back(const Filled *from, long n, const double *move, double share, double *out, double *adjoints) {
  double adjoint[NS] = {0};
  for (long k = n - 1; k >= 0; --k) {
    double before[NS] = {0};
    for (int j = 0; j < NS && k + 1 < n; ++j)
      for (int i = 0; i < NS; ++i) before[i] += from->F[(k * NS + j) * NS + i] * adjoint[j];
    copy(before, adjoint, NS);
    for (int c = 2; c >= 0; --c) {
      const long at = 3 * k + c;
      if (from->V[at] == INFINITY) continue;
      double e = share * from->E[at];
      for (int j = 0; j < M && move; ++j) e -= from->J[at * M + j] * move[j];
      double strength = -e / from->V[at];
      for (int i = 0; i < NS; ++i) strength -= from->K[at * NS + i] * adjoint[i];
      if (c == 2) adjoint[1] += strength;
      else for (int i = 0; i < NS; ++i) adjoint[i] += from->H[(2 * k + c) * NS + i] * strength;
    }
    double *to = out + k * NS;
    for (int i = 0; i < NS; ++i) to[i] = share * from->A[k * NS + i];
    for (int i = 0; i < NS && move; ++i)
      for (int j = 0; j < M; ++j) to[i] += from->S[(k * NS + i) * M + j] * move[j];
    for (int j = 0; j < NS; ++j)
      for (int i = 0; i < NS; ++i) to[i] -= from->P[(k * NS + j) * NS + i] * adjoint[j];
    if (adjoints) copy(adjoint, adjoints + k * NS, NS);
  }
}
