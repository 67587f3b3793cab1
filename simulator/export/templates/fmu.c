/* FMI 2.0 for co-simulation around {{ name }}.c. Value references: see modelDescription.xml. */
#ifdef __GNUC__
#define FMI2_Export __attribute__((visibility("default")))
#endif
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "token.h"
#include "{{ name }}.h"

enum { FORCE, POSITION, STEM_POSITION, STEM_VELOCITY, INITIAL_POSITION, INITIAL_VELOCITY, PARAMETERS };
enum { COUNT = sizeof({{ name }}_parameters) / sizeof(double) };

typedef struct {
  {{ name }}_state state;
  double force, position, velocity; /* the input, and where to start */
  const fmi2CallbackFunctions *callbacks;
  char name[64];
} unit;

static fmi2Status failed(const unit *u, const char *text) {
  if (u->callbacks && u->callbacks->logger)
    u->callbacks->logger(u->callbacks->componentEnvironment, u->name, fmi2Error, "logStatusError", "%s", text);
  return fmi2Error;
}

/* Start anew, with the parameters as they are. */
static void start(unit *u) {
  const {{ name }}_parameters p = u->state.p;
  const double time = u->state.time;
  {{ name }}_init(&u->state, &p, u->position, u->velocity, u->force);
  u->state.time = time;
{% if step.delay %}
  u->state.times[0] = time;
{% endif %}
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
  (void)resources, (void)visible, (void)logging;
  unit *u = calloc(1, sizeof(unit));
  if (!u) return 0;
  u->callbacks = callbacks;
  snprintf(u->name, sizeof u->name, "%s", name ? name : "");
  if (type != fmi2CoSimulation || !token || strcmp(token, TOKEN)) {
    failed(u, "this unit is for co-simulation, and its token is that of its modelDescription.xml");
    free(u);
    return 0;
  }
  {{ name }}_init(&u->state, 0, 0, 0, 0);
  return u;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  (void)c, (void)on, (void)n, (void)categories;
  return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean bounded, fmi2Real tolerance, fmi2Real from,
                               fmi2Boolean ends, fmi2Real to) {
  (void)bounded, (void)tolerance, (void)ends, (void)to;
  ((unit *)c)->state.time = from;
  return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { start(c); return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { start(c); return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2Reset(fmi2Component c) {
  unit *u = c;
  u->force = u->position = u->velocity = 0;
  {{ name }}_init(&u->state, 0, 0, 0, 0);
  return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference which[], size_t n, fmi2Real value[]) {
  const unit *u = c;
  for (size_t i = 0; i < n; ++i) switch (which[i]) {
    case FORCE: value[i] = u->force; break;
    case POSITION: value[i] = {{ name }}_position(&u->state); break;
    case STEM_POSITION: value[i] = u->state.now.x; break;
    case STEM_VELOCITY: value[i] = u->state.now.v; break;
    case INITIAL_POSITION: value[i] = u->position; break;
    case INITIAL_VELOCITY: value[i] = u->velocity; break;
    default:
      if (which[i] >= PARAMETERS + COUNT) return failed(u, "there is no such variable");
      value[i] = ((const double *)&u->state.p)[which[i] - PARAMETERS];
  }
  return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference which[], size_t n, const fmi2Real value[]) {
  unit *u = c;
  for (size_t i = 0; i < n; ++i) switch (which[i]) {
    case FORCE: u->force = value[i]; break;
    case INITIAL_POSITION: u->position = value[i]; break;
    case INITIAL_VELOCITY: u->velocity = value[i]; break;
    default:
      if (which[i] < PARAMETERS || which[i] >= PARAMETERS + COUNT) return failed(u, "the variable cannot be set");
      ((double *)&u->state.p)[which[i] - PARAMETERS] = value[i];
  }
  return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean keep) {
  (void)keep;
  unit *u = c;
  const {{ name }}_inputs in = {u->force};
{% if not step.delay %}
  u->state.time = time;
{% else %}
  (void)time; /* the history has its own */
{% endif %}
  switch ({{ name }}_step(&u->state, &in, step)) {
    case {{ NAME }}_OK: return fmi2OK;
    case {{ NAME }}_BAD_STEP: return failed(u, "the step is not positive, or too long");
    case {{ NAME }}_NO_SOLUTION: return failed(u, "the motion is not finite: check force and parameters");
    default: return failed(u, "the dead time is longer than the history that is kept");
  }
}

/* The whole unit is plain data, so its state is a copy of it. */
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
  if (!*state) *state = malloc(sizeof(unit));
  if (!*state) return failed(c, "no memory is left");
  memcpy(*state, c, sizeof(unit));
  return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  memcpy(c, state, sizeof(unit));
  return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
  (void)c;
  free(*state);
  *state = 0;
  return fmi2OK;
}

/* What the standard names and this unit does not have. */
#define NONE(name, ...) \
  fmi2Status name(fmi2Component c, __VA_ARGS__) { return failed(c, #name " is not supported"); }
#define NO_TYPE(type) \
  fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2##type v[]) { \
    (void)r, (void)v; \
    return n ? failed(c, "all variables are real numbers") : fmi2OK; \
  } \
  fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2##type v[]) { \
    (void)r, (void)v; \
    return n ? failed(c, "all variables are real numbers") : fmi2OK; \
  }
NO_TYPE(Integer)
NO_TYPE(Boolean)
NO_TYPE(String)
NONE(fmi2SerializedFMUstateSize, fmi2FMUstate s, size_t *n)
NONE(fmi2SerializeFMUstate, fmi2FMUstate s, fmi2Byte b[], size_t n)
NONE(fmi2DeSerializeFMUstate, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
NONE(fmi2GetDirectionalDerivative, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[], size_t nk,
     const fmi2Real dk[], fmi2Real du[])
NONE(fmi2SetRealInputDerivatives, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], const fmi2Real v[])
NONE(fmi2GetRealOutputDerivatives, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], fmi2Real v[])
fmi2Status fmi2CancelStep(fmi2Component c) { return failed(c, "no step runs in the background"); }
NONE(fmi2GetStatus, const fmi2StatusKind k, fmi2Status *v)
NONE(fmi2GetRealStatus, const fmi2StatusKind k, fmi2Real *v)
NONE(fmi2GetIntegerStatus, const fmi2StatusKind k, fmi2Integer *v)
NONE(fmi2GetBooleanStatus, const fmi2StatusKind k, fmi2Boolean *v)
NONE(fmi2GetStringStatus, const fmi2StatusKind k, fmi2String *v)
