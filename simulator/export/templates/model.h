/* {{ title or name }}: a control valve from the force on its stem to its measured position.

   Effects: {{ comment(step.model.effects | join(", ")) }}. SI units throughout. C99; needs the C library's mathematics only.
   Made by Bristle from a valve model. */
#ifndef {{ NAME }}_H
#define {{ NAME }}_H

#ifdef __cplusplus
extern "C" {
#endif

/* The parameters of the valve. */
typedef struct {
{% for one in step.parameters %}
  double {{ one.name }}; /* {{ comment(one.unit) }}: {{ comment(one.meaning) }} ({{ comment(one.known) }}) */
{% endfor %}
} {{ name }}_parameters;

/* The values of the model. */
extern const {{ name }}_parameters {{ name }}_fitted;

/* What moves. */
typedef struct {
{% for one in step.states %}
  double {{ one.name }}; /* {{ comment(one.unit) }}: {{ comment(one.meaning) }} */
{% endfor %}
} {{ name }}_motion;
{% if step.delay %}

/* How many samples of the force are kept for the dead time. */
#ifndef {{ NAME }}_HISTORY
#define {{ NAME }}_HISTORY 1024
#endif
{% endif %}

/* One valve: its parameters, which may be changed between steps, its time and its motion. */
typedef struct {
  {{ name }}_parameters p;
  double time;  /* s, 0 at the start */
  double force; /* N, the force on the stem at that time */
  {{ name }}_motion now;
{% if step.delay %}
  long samples;                         /* number of samples so far */
  double times[{{ NAME }}_HISTORY];  /* s, the last of them */
  double forces[{{ NAME }}_HISTORY]; /* N */
{% endif %}
} {{ name }}_state;

/* What acts on the valve in a step. */
typedef struct {
{% if hold %}
  double force; /* N: net force of the actuator on the stem, held during the step */
{% else %}
  double force; /* N: net force of the actuator on the stem at the end of the step, to which it runs linearly */
{% endif %}
} {{ name }}_inputs;

/* What a step returns. Where it is not {{ NAME }}_OK the state is as it was before. */
enum {
  {{ NAME }}_OK = 0,
  {{ NAME }}_BAD_STEP = 1,   /* the step is not positive, or too long to be divided */
  {{ NAME }}_NO_SOLUTION = 2{{ "," if step.delay else " " }} /* the motion is not finite: parameters or force cannot be */
{% if step.delay %}
  {{ NAME }}_TOO_LATE = 3    /* the dead time is longer than what is kept: raise {{ NAME }}_HISTORY */
{% endif %}
};

/* Start at a position [m], a velocity [m/s] and a force [N]. p: the parameters, or 0 for those of the model. */
void {{ name }}_init({{ name }}_state *s, const {{ name }}_parameters *p, double position, double velocity, double force);

/* Go on by dt [s]. It is divided into sub-steps of {{ longest_step }} s at most. */
int {{ name }}_step({{ name }}_state *s, const {{ name }}_inputs *in, double dt);

/* The position [m] as it is measured. */
double {{ name }}_position(const {{ name }}_state *s);

#ifdef __cplusplus
}
#endif

#endif
