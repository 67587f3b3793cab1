/* {{ title or name }}: see {{ name }}.h.

   A step is an implicit midpoint step in the velocity: one scalar equation is solved for w, the velocity at mid-step,
   and the memory of friction follows exactly. Second order, and stable however stiff the bristles are. */
#include "{{ name }}.h"

#include <math.h>

static const double LONGEST = {{ longest_step }}; /* s, of a sub-step */
static const double SMALL = {{ scale }};   /* m/s, a small velocity */

const {{ name }}_parameters {{ name }}_fitted = {
{% for one in step.parameters %}
  {{ number(one.value) }}{{ "" if loop.last else "," }} /* {{ one.name }} [{{ comment(one.unit) }}] */
{% endfor %}
};

/* Time, sub-step, and the force at mid-step; then the same at the end of the sub-step. */
typedef struct {
  double time, h, force, force_end;
{% if step.delay %}
  double late, late_end; /* N, the force a dead time ago less the one now */
{% endif %}
} instant;

static inline double sign_of(double x) { return x < 0 ? -1.0 : x > 0 ? 1.0 : x; }

/* What has to vanish by the choice of w [N], and its slope by w. */
static void residual(double w, const {{ name }}_motion *s, const instant *e, const {{ name }}_parameters *p, double *value,
                     double *slope) {
  (void)s, (void)e, (void)p, (void)w;
{% for line in body.residual %}
  {{ line }}
{% endfor %}
}

/* Where the search for w starts [m/s]. */
static double first_guess(const {{ name }}_motion *s, const instant *e, const {{ name }}_parameters *p) {
  (void)s, (void)e, (void)p;
{% for line in body.guess %}
  {{ line }}
{% endfor %}
  return guess;
}

/* The motion after a sub-step, from w. */
static void advance(double w, const {{ name }}_motion *s, const instant *e, const {{ name }}_parameters *p,
                    {{ name }}_motion *next) {
  (void)s, (void)e, (void)p, (void)w;
{% for line in body.step %}
  {{ line }}
{% endfor %}
}

/* The position as it is measured. */
static double measured(const {{ name }}_motion *s, const instant *e, const {{ name }}_parameters *p) {
  (void)s, (void)e, (void)p, (void)sign_of;
{% for line in body.output %}
  {{ line }}
{% endfor %}
  return position;
}

/* Newton inside a bracket that the signs of the residual tighten; NaN where there is no root.
   The residual rises through its root. After 40 rounds only halving is left, and that always ends. */
static double solve(const {{ name }}_motion *s, const instant *e, const {{ name }}_parameters *p) {
  double w = first_guess(s, e, p), value, slope, low = -INFINITY, high = INFINITY, reach = SMALL;
  for (int i = 0; i < 120; ++i) {
    residual(w, s, e, p, &value, &slope);
    if (!isfinite(value)) return NAN;
    if (value > 0) high = w; else low = w;
    double after = w - value / slope;
    const double close = 1e-10 * (fabs(w) + SMALL);
    if (slope > 0 && fabs(after - w) <= close) return after;
    if (high - low <= close) return w;
    if (!(slope > 0 && after > low && after < high) || i > 40) {
      if (isinf(low)) { after = w - reach; reach *= 4; }
      else if (isinf(high)) { after = w + reach; reach *= 4; }
      else after = 0.5 * (low + high);
    }
    w = after;
  }
  return NAN;
}
{% if step.delay %}

#define AT(k) ((k) % {{ NAME }}_HISTORY)

/* Keep the force at a time; it replaces what was kept for the same time. */
static void keep({{ name }}_state *s, double time, double force) {
  if (s->samples == 0 || s->times[AT(s->samples - 1)] != time) s->samples += 1;
  s->times[AT(s->samples - 1)] = time;
  s->forces[AT(s->samples - 1)] = force;
}
{% if not hold %}

/* Slope of the kept force at sample k, of central differences; one-sided at the ends. */
static double slope_at(const {{ name }}_state *s, long k, long first) {
  const long last = s->samples - 1;
  const long before = k > first ? k - 1 : k, behind = k < last ? k + 1 : k;
  const double left = s->times[AT(k)] - s->times[AT(before)], right = s->times[AT(behind)] - s->times[AT(k)];
  const double u0 = s->forces[AT(before)], u1 = s->forces[AT(k)], u2 = s->forces[AT(behind)];
  if (behind == before) return 0;
  if (before == k) return (u2 - u1) / right;
  if (behind == k) return (u1 - u0) / left;
  return (left * left * u2 + (right * right - left * left) * u1 - right * right * u0) / (left * right * (left + right));
}
{% endif %}

/* The force a dead time before a sample of number `to`, less the one at it; NaN where it is no longer kept. */
static double late_at(const {{ name }}_state *s, long to) {
  const long first = s->samples > {{ NAME }}_HISTORY ? s->samples - {{ NAME }}_HISTORY : 0;
  const double then = s->times[AT(to)] - s->p.{{ step.delay }};
  long k = to > first ? to - 1 : first;
  while (k > first && s->times[AT(k)] > then) k -= 1;
  if (then <= s->times[AT(k)] && k == 0) return s->forces[AT(0)] - s->forces[AT(to)]; /* before the start */
  if (then < s->times[AT(k)] || (first > 0 && k == first)) return NAN;
  const double h = s->times[AT(k + 1)] - s->times[AT(k)], part = (then - s->times[AT(k)]) / h;
  const double u0 = s->forces[AT(k)], u1 = s->forces[AT(k + 1)];
{% if hold %}
  return u0 + part * (u1 - u0) - s->forces[AT(to)]; /* the mean of the held force over the step that follows */
{% else %}
  const double d0 = slope_at(s, k, first) * h, d1 = slope_at(s, k + 1, first) * h; /* cubic through the samples */
  const double c2 = 3 * (u1 - u0) - 2 * d0 - d1, c3 = d0 + d1 - 2 * (u1 - u0);
  return u0 + part * (d0 + part * (c2 + part * c3)) - s->forces[AT(to)];
{% endif %}
}
{% endif %}

void {{ name }}_init({{ name }}_state *s, const {{ name }}_parameters *p, double position, double velocity, double force) {
  s->p = p ? *p : {{ name }}_fitted;
  s->time = 0;
  s->force = force;
{% for one in step.states %}
  s->now.{{ one.name }} = {{ start(one.start) }};
{% endfor %}
{% if step.delay %}
  s->samples = 0;
  keep(s, 0, force);
{% endif %}
}

int {{ name }}_step({{ name }}_state *s, const {{ name }}_inputs *in, double dt) {
  const double count = dt > LONGEST ? ceil(dt / LONGEST - 1e-9) : 1;
  if (!(dt > 0) || count > 1e9) return {{ NAME }}_BAD_STEP;
{% if step.delay %}
  const long samples = s->samples;
  const double force = s->force;
{% if hold %}
  keep(s, s->time, in->force);
  const double late0 = late_at(s, s->samples - 1), late1 = late0;
{% else %}
  keep(s, s->time + dt, in->force);
  const double late0 = s->samples > 1 ? late_at(s, s->samples - 2) : 0, late1 = late_at(s, s->samples - 1);
{% endif %}
  if (isnan(late0) || isnan(late1)) {
    s->samples = samples;
{% if hold %}
    s->forces[AT(samples - 1)] = force;
{% else %}
    (void)force;
{% endif %}
    return {{ NAME }}_TOO_LATE;
  }
{% endif %}
{% if hold %}
  const double from = in->force, to = in->force;
{% else %}
  const double from = s->force, to = in->force;
{% endif %}
  {{ name }}_motion now = s->now;
  for (long j = 0; j < (long)count; ++j) {
    const double part = (j + 0.5) / count, end = (j + 1.0) / count;
    const instant e = {
      s->time + part * dt, dt / count, from + part * (to - from), from + end * (to - from),
{% if step.delay %}
      late0 + part * (late1 - late0), late0 + end * (late1 - late0),
{% endif %}
    };
    const double w = solve(&now, &e, &s->p);
    {{ name }}_motion next;
    if (isfinite(w)) advance(w, &now, &e, &s->p, &next);
    if (!isfinite(w){% for one in step.states %} || !isfinite(next.{{ one.name }}){% endfor %}) {
{% if step.delay %}
      s->samples = samples;
{% if hold %}
      s->forces[AT(samples - 1)] = force;
{% endif %}
{% endif %}
      return {{ NAME }}_NO_SOLUTION;
    }
    now = next;
  }
  s->now = now;
  s->time += dt;
  s->force = in->force;
{% if step.delay and hold %}
  keep(s, s->time, in->force);
{% endif %}
  return {{ NAME }}_OK;
}

double {{ name }}_position(const {{ name }}_state *s) {
{% if step.delay %}
  const double late = s->samples > 1 ? late_at(s, s->samples - 1) : 0;
  const instant e = {s->time, 0, s->force, s->force, late, late};
{% else %}
  const instant e = {s->time, 0, s->force, s->force};
{% endif %}
  return measured(&s->now, &e, &s->p);
}
