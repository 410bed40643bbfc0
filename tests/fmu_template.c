// Template of an FMI 2.0 FMU for tests; fmu_maker.py defines the sizes and puts C texts in the marked places. A model
// is plain memory, so that a saved state is a copy of it.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#define TEXT 256
#define MEMORY 16
#define LOG(status, ...) m->callbacks->logger(m->callbacks->componentEnvironment, m->name, status, "log", __VA_ARGS__)
#define VALUES                      \
  double* real = m->real;           \
  int* integer = m->integer;        \
  int* boolean = m->boolean;        \
  char(*string)[TEXT] = m->string;  \
  double* memory = m->memory;       \
  double* indicator = m->indicator; \
  double(*slope)[4] = m->slope;

typedef struct {
  const fmi2CallbackFunctions* callbacks;
  char name[TEXT];
  char resources[4096];
  fmi2Type interface;
  double real[REALS];
  int integer[INTEGERS];
  int boolean[BOOLEANS];
  char string[STRINGS][TEXT];
  double slope[REALS][4];  // [order]: derivatives of inputs, as fmi2SetRealInputDerivatives gave them
  double memory[MEMORY];
  double indicator[INDICATORS + 1];
  double time, start_time, stop_time, tolerance;  // tolerance 0, stop time infinity where not defined
  double next_event;                              // infinity: none
  double reached;                                 // answer to fmi2LastSuccessfulTime
  int terminated;                                 // answer to fmi2Terminated
  int no_state_before;                            // what fmi2DoStep was told: noSetFMUStatePriorToCurrentPoint
  int steps;
  int initialised;
} Model;

static const unsigned state_references[] = {STATE_REFERENCES};
static const unsigned derivative_references[] = {DERIVATIVE_REFERENCES};

/*HEAD*/

static void start(Model* m) {
  m->next_event = INFINITY;
  m->stop_time = INFINITY;
  /*STARTS*/
}

static void update(Model* m) {
  VALUES
  double t = m->time;
  /*OUTPUT*/
}

static void handle_event(Model* m) {
  VALUES
  double t = m->time;
  update(m);
  /*EVENT*/
  update(m);
}

static void slopes(Model* m, double* k) {
  update(m);
  for (int i = 0; i < STATES; i++) k[i] = m->real[derivative_references[i]];
}

static void rk4(Model* m, double h) {
  double x[STATES + 1], k[4][STATES + 1], t = m->time;
  static const double at[4] = {0.0, 0.5, 0.5, 1.0};
  for (int i = 0; i < STATES; i++) x[i] = m->real[state_references[i]];
  for (int s = 0; s < 4; s++) {
    for (int i = 0; i < STATES; i++) m->real[state_references[i]] = x[i] + (s ? at[s] * h * k[s - 1][i] : 0.0);
    m->time = t + at[s] * h;
    slopes(m, k[s]);
  }
  for (int i = 0; i < STATES; i++)
    m->real[state_references[i]] = x[i] + h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
  m->time = t + h;
}

static fmi2Status integrate(Model* m, double length) {
  double end = m->time + length, part = length / SUBSTEPS;
  while (end - m->time > 1e-12 * length) {
    double before[INDICATORS + 1];
    update(m);
    memcpy(before, m->indicator, sizeof before);
    double next = fmin(m->time + part, fmin(end, m->next_event));
    if (next > m->time) rk4(m, next - m->time);
    m->time = next;
    update(m);
    int event = m->time >= m->next_event;
    for (int i = 0; i < INDICATORS; i++) event |= (before[i] > 0.0) != (m->indicator[i] > 0.0);
    if (event) {
      m->next_event = INFINITY;
      handle_event(m);
    }
  }
  m->time = end - length;  // fmi2DoStep advances it
  return fmi2OK;
}

static fmi2Status advance(Model* m, double t, double h) {
  VALUES
  int no_state_before = m->no_state_before;
  /*STEP*/
  return fmi2OK;
}

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) { return fmi2OK; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* callbacks, fmi2Boolean visible, fmi2Boolean logging) {
  Model* m = calloc(1, sizeof *m);
  VALUES
  m->callbacks = callbacks;
  m->interface = type;
  snprintf(m->name, TEXT, "%s", name);
  snprintf(m->resources, sizeof m->resources, "%s", resources ? resources : "");
  start(m);
  /*INSTANTIATE*/
  return m;
}

void fmi2FreeInstance(fmi2Component c) {
  Model* m = c;
  /*FREE*/
  free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, double tolerance, double start_time,
                               fmi2Boolean stop_defined, double stop) {
  Model* m = c;
  VALUES
  m->start_time = m->time = start_time;
  m->tolerance = tolerance_defined ? tolerance : 0.0;
  m->stop_time = stop_defined ? stop : INFINITY;
  /*SETUP*/
  return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  Model* m = c;
  VALUES
  /*ENTER*/
  return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  Model* m = c;
  VALUES
  m->initialised = 1;
  /*LEAVE*/
  if (m->interface == fmi2CoSimulation) handle_event(m);  // a host of model exchange asks for it
  return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
  Model* m = c;
  /*TERMINATE*/
  return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
  Model *m = c, old = *m;
  memset(m, 0, sizeof *m);
  m->callbacks = old.callbacks;
  m->interface = old.interface;
  memcpy(m->name, old.name, sizeof m->name);
  memcpy(m->resources, old.resources, sizeof m->resources);
  start(m);
  return fmi2OK;
}

#define ACCESS(Type, type, member)                                                           \
  fmi2Status fmi2Get##Type(fmi2Component c, const unsigned v[], size_t n, type out[]) {      \
    Model* m = c;                                                                            \
    update(m);                                                                               \
    for (size_t k = 0; k < n; k++) out[k] = m->member[v[k]];                                 \
    return fmi2OK;                                                                           \
  }                                                                                          \
  fmi2Status fmi2Set##Type(fmi2Component c, const unsigned v[], size_t n, const type in[]) { \
    Model* m = c;                                                                            \
    for (size_t k = 0; k < n; k++) m->member[v[k]] = in[k];                                  \
    return fmi2OK;                                                                           \
  }
ACCESS(Integer, fmi2Integer, integer)
ACCESS(Boolean, fmi2Boolean, boolean)

fmi2Status fmi2GetReal(fmi2Component c, const unsigned v[], size_t n, double out[]) {
  Model* m = c;
  update(m);
  for (size_t k = 0; k < n; k++) out[k] = m->real[v[k]];
  return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const unsigned v[], size_t n, const double in[]) {
  Model* m = c;
  for (size_t k = 0; k < n; k++) {
    m->real[v[k]] = in[k];
    memset(m->slope[v[k]], 0, sizeof m->slope[0]);
  }
  return fmi2OK;
}

fmi2Status fmi2GetString(fmi2Component c, const unsigned v[], size_t n, fmi2String out[]) {
  Model* m = c;
  update(m);
  for (size_t k = 0; k < n; k++) out[k] = m->string[v[k]];
  return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const unsigned v[], size_t n, const fmi2String in[]) {
  Model* m = c;
  for (size_t k = 0; k < n; k++) snprintf(m->string[v[k]], TEXT, "%s", in[k]);
  return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* state) {
  Model* m = c;
  /*SAVE*/
  if (!*state) *state = malloc(sizeof *m);
  memcpy(*state, m, sizeof *m);
  return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  Model* m = c;
  memcpy(m, state, sizeof *m);
  /*RESTORE*/
  return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* state) {
  free(*state);
  *state = NULL;
  return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t* size) {
  *size = sizeof(Model);
  return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  memcpy(bytes, state, sizeof(Model));
  return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate* state) {
  if (size != sizeof(Model)) return fmi2Error;
  if (!*state) *state = malloc(sizeof(Model));
  memcpy(*state, bytes, sizeof(Model));
  return fmi2OK;
}

// Difference quotient through the output function: exact for models that are linear in their inputs.
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const unsigned unknown[], size_t nu, const unsigned known[],
                                        size_t nk, const double seed[], double out[]) {
  Model *m = c, copy = *m;
  update(&copy);
  Model moved = copy;
  for (size_t k = 0; k < nk; k++) moved.real[known[k]] += seed[k] * 0.0009765625;
  update(&moved);
  for (size_t k = 0; k < nu; k++) out[k] = (moved.real[unknown[k]] - copy.real[unknown[k]]) * 1024.0;
  return fmi2OK;
}

#ifndef INPUT_ORDER  // highest order of input derivatives that is taken
#define INPUT_ORDER 3
#endif

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const unsigned v[], size_t n, const int order[],
                                       const double value[]) {
  Model* m = c;
  for (size_t k = 0; k < n; k++) {
    if (order[k] < 1 || order[k] > INPUT_ORDER) return fmi2Error;
    m->slope[v[k]][order[k]] = value[k];
  }
  return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const unsigned v[], size_t n, const int order[],
                                        double value[]) {
  Model* m = c;
  VALUES
  double rate[REALS], t = m->time;
  memset(rate, 0, sizeof rate);
  update(m);
  /*RATES*/
  for (size_t k = 0; k < n; k++) value[k] = order[k] == 1 ? rate[v[k]] : 0.0;
  return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, double t, double h, fmi2Boolean no_state_before) {
  Model* m = c;
  m->time = t;
  m->no_state_before = no_state_before;
  fmi2Status status = advance(m, t, h);
  if (status > fmi2Warning) return status;
  m->time = t + h;
  m->reached = t + h;
  m->steps++;
  update(m);
  return status;
}

fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status* value) { return fmi2Discard; }
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, int* value) { return fmi2Discard; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String* value) { return fmi2Discard; }

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, double* value) {
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = ((Model*)c)->reached;
  return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, int* value) {
  if (kind != fmi2Terminated) return fmi2Discard;
  *value = ((Model*)c)->terminated;
  return fmi2OK;
}

fmi2Status fmi2EnterEventMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return fmi2OK; }

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo* info) {
  Model* m = c;
  memset(info, 0, sizeof *info);
  if (m->time >= m->next_event) m->next_event = INFINITY;
  double before[STATES + 1];
  for (int i = 0; i < STATES; i++) before[i] = m->real[state_references[i]];
  handle_event(m);
  for (int i = 0; i < STATES; i++) info->valuesOfContinuousStatesChanged |= before[i] != m->real[state_references[i]];
  info->terminateSimulation = m->terminated;
  info->nextEventTimeDefined = isfinite(m->next_event);
  info->nextEventTime = m->next_event;
  return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_state_before, fmi2Boolean* enter_event_mode,
                                       fmi2Boolean* terminate) {
  *enter_event_mode = *terminate = 0;
  return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, double time) {
  ((Model*)c)->time = time;
  return fmi2OK;
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const double x[], size_t n) {
  for (size_t i = 0; i < n; i++) ((Model*)c)->real[state_references[i]] = x[i];
  return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, double x[], size_t n) {
  for (size_t i = 0; i < n; i++) x[i] = ((Model*)c)->real[state_references[i]];
  return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component c, double dx[], size_t n) {
  slopes(c, dx);
  return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, double z[], size_t n) {
  Model* m = c;
  update(m);
  memcpy(z, m->indicator, n * sizeof *z);
  return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, double nominal[], size_t n) {
  for (size_t i = 0; i < n; i++) nominal[i] = 1.0;
  return fmi2OK;
}
