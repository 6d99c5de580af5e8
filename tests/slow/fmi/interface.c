/* Drives a unit through all functions of FMI 3.0, in right and in wrong order, with right and wrong
 * arguments. Prints derivatives at the start, and the state at t = 1 by Co-Simulation. Returns 1 where
 * something is not as the standard has it. UNIT is the header of the unit, DIRECTIONAL the number of results
 * with derivatives along a direction, HELD that of rows of constraints that are not released. */
#include UNIT

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;
static int messages = 0;
static char last[600] = "";

static void hear(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
  fmi3String message)
{
  (void)environment;
  (void)category;
  messages++;
  (void)snprintf(last, sizeof last, "%d %s", (int)status, message);
}

static void check(int holds, int line, const char *what)
{
  if (!holds) {
    failures++;
    (void)fprintf(stderr, "line %d: %s; the unit said: %s\n", line, what, last);
  }
}

#define CHECK(what) check((what) ? 1 : 0, __LINE__, #what)
/* A call that is refused with a message. */
#define REFUSED(call) do { \
  const int before = messages; \
  CHECK((call) == fmi3Error); \
  CHECK(messages == before + 1); \
} while (0)

static fmi3Instance exchange(void)
{
  return fmi3InstantiateModelExchange("one", TOKEN, NULL, fmi3False, fmi3False, NULL, hear);
}

static fmi3Instance simulation(fmi3Boolean events)
{
  return fmi3InstantiateCoSimulation("two", TOKEN, NULL, fmi3False, fmi3False, events, events, NULL, 0, NULL,
    hear, NULL);
}

static double value(fmi3Instance x, int reference)
{
  const fmi3ValueReference vr = (fmi3ValueReference)reference;
  double result = NAN;
  CHECK(fmi3GetFloat64(x, &vr, 1, &result, 1) == fmi3OK);
  return result;
}

static fmi3Status set(fmi3Instance x, int reference, double to)
{
  const fmi3ValueReference vr = (fmi3ValueReference)reference;
  return fmi3SetFloat64(x, &vr, 1, &to, 1);
}

/* What needs no instance, and what gets none. */
static void without_an_instance(void)
{
  const fmi3ValueReference vr = 0;
  double x = 0.0;
  size_t size = 0;
  bool b = false;
  fmi3FMUState state = NULL;
  CHECK(strcmp(fmi3GetVersion(), "3.0") == 0);
  CHECK(fmi3InstantiateModelExchange("one", "another", NULL, fmi3False, fmi3False, NULL, hear) == NULL);
  CHECK(strstr(last, "token") != NULL);
  CHECK(fmi3InstantiateModelExchange("one", NULL, NULL, fmi3False, fmi3False, NULL, NULL) == NULL);
  CHECK(fmi3InstantiateModelExchange("", TOKEN, NULL, fmi3False, fmi3False, NULL, hear) == NULL);
  CHECK(strstr(last, "name") != NULL);
  CHECK(fmi3InstantiateCoSimulation("two", TOKEN, NULL, fmi3False, fmi3False, fmi3False, fmi3False, &vr, 1,
    NULL, hear, NULL) == NULL);
  CHECK(fmi3InstantiateScheduledExecution("three", TOKEN, NULL, fmi3False, fmi3False, NULL, hear, NULL, NULL,
    NULL) == NULL);
  CHECK(strstr(last, "partitions") != NULL);
  CHECK(fmi3EnterInitializationMode(NULL, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3Error);
  CHECK(fmi3ExitInitializationMode(NULL) == fmi3Error);
  CHECK(fmi3EnterEventMode(NULL) == fmi3Error);
  CHECK(fmi3EnterContinuousTimeMode(NULL) == fmi3Error);
  CHECK(fmi3EnterStepMode(NULL) == fmi3Error);
  CHECK(fmi3Terminate(NULL) == fmi3Error);
  CHECK(fmi3Reset(NULL) == fmi3Error);
  CHECK(fmi3SetDebugLogging(NULL, fmi3True, 0, NULL) == fmi3Error);
  CHECK(fmi3GetFloat64(NULL, &vr, 1, &x, 1) == fmi3Error);
  CHECK(fmi3SetFloat64(NULL, &vr, 1, &x, 1) == fmi3Error);
  CHECK(fmi3GetFMUState(NULL, &state) == fmi3Error);
  CHECK(fmi3SetFMUState(NULL, NULL) == fmi3Error);
  CHECK(fmi3FreeFMUState(NULL, &state) == fmi3Error);
  CHECK(fmi3SerializedFMUStateSize(NULL, NULL, &size) == fmi3Error);
  CHECK(fmi3SerializeFMUState(NULL, NULL, NULL, 0) == fmi3Error);
  CHECK(fmi3DeserializeFMUState(NULL, NULL, 0, &state) == fmi3Error);
  CHECK(fmi3GetDirectionalDerivative(NULL, &vr, 1, &vr, 1, &x, 1, &x, 1) == fmi3Error);
  CHECK(fmi3UpdateDiscreteStates(NULL, &b, &b, &b, &b, &b, &x) == fmi3Error);
  CHECK(fmi3CompletedIntegratorStep(NULL, fmi3False, &b, &b) == fmi3Error);
  CHECK(fmi3SetTime(NULL, 0.0) == fmi3Error);
  CHECK(fmi3SetContinuousStates(NULL, &x, 1) == fmi3Error);
  CHECK(fmi3GetContinuousStates(NULL, &x, 1) == fmi3Error);
  CHECK(fmi3GetContinuousStateDerivatives(NULL, &x, 1) == fmi3Error);
  CHECK(fmi3GetNominalsOfContinuousStates(NULL, &x, 1) == fmi3Error);
  CHECK(fmi3GetEventIndicators(NULL, &x, 1) == fmi3Error);
  CHECK(fmi3GetNumberOfContinuousStates(NULL, &size) == fmi3Error);
  CHECK(fmi3GetNumberOfEventIndicators(NULL, &size) == fmi3Error);
  CHECK(fmi3DoStep(NULL, 0.0, 1.0, fmi3False, &b, &b, &b, &x) == fmi3Error);
  fmi3FreeInstance(NULL);
}

/* Functions for what the model lacks. */
static void lacking(fmi3Instance x)
{
  const fmi3ValueReference vr = 0;
  double d = 0.0;
  float f = 0.0F;
  int8_t i8 = 0;
  uint8_t u8 = 0;
  int16_t i16 = 0;
  uint16_t u16 = 0;
  int32_t i32 = 0;
  uint32_t u32 = 0;
  int64_t i64 = 0;
  uint64_t u64 = 0;
  bool b = false;
  size_t size = 0;
  fmi3String text = "";
  fmi3Binary binary = NULL;
  fmi3IntervalQualifier qualifier = fmi3IntervalUnchanged;
  fmi3DependencyKind kind = fmi3Dependent;
  REFUSED(fmi3GetFloat32(x, &vr, 1, &f, 1));
  REFUSED(fmi3SetFloat32(x, &vr, 1, &f, 1));
  REFUSED(fmi3GetInt8(x, &vr, 1, &i8, 1));
  REFUSED(fmi3SetInt8(x, &vr, 1, &i8, 1));
  REFUSED(fmi3GetUInt8(x, &vr, 1, &u8, 1));
  REFUSED(fmi3SetUInt8(x, &vr, 1, &u8, 1));
  REFUSED(fmi3GetInt16(x, &vr, 1, &i16, 1));
  REFUSED(fmi3SetInt16(x, &vr, 1, &i16, 1));
  REFUSED(fmi3GetUInt16(x, &vr, 1, &u16, 1));
  REFUSED(fmi3SetUInt16(x, &vr, 1, &u16, 1));
  REFUSED(fmi3GetInt32(x, &vr, 1, &i32, 1));
  REFUSED(fmi3SetInt32(x, &vr, 1, &i32, 1));
  REFUSED(fmi3GetUInt32(x, &vr, 1, &u32, 1));
  REFUSED(fmi3SetUInt32(x, &vr, 1, &u32, 1));
  REFUSED(fmi3GetInt64(x, &vr, 1, &i64, 1));
  REFUSED(fmi3SetInt64(x, &vr, 1, &i64, 1));
  REFUSED(fmi3GetUInt64(x, &vr, 1, &u64, 1));
  REFUSED(fmi3SetUInt64(x, &vr, 1, &u64, 1));
  REFUSED(fmi3GetBoolean(x, &vr, 1, &b, 1));
  REFUSED(fmi3SetBoolean(x, &vr, 1, &b, 1));
  REFUSED(fmi3GetString(x, &vr, 1, &text, 1));
  REFUSED(fmi3SetString(x, &vr, 1, &text, 1));
  REFUSED(fmi3GetBinary(x, &vr, 1, &size, &binary, 1));
  REFUSED(fmi3SetBinary(x, &vr, 1, &size, &binary, 1));
  REFUSED(fmi3GetClock(x, &vr, 1, &b));
  REFUSED(fmi3SetClock(x, &vr, 1, &b));
  REFUSED(fmi3GetNumberOfVariableDependencies(x, vr, &size));
  REFUSED(fmi3GetVariableDependencies(x, vr, &size, &u32, &size, &kind, 1));
  REFUSED(fmi3GetAdjointDerivative(x, &vr, 1, &vr, 1, &d, 1, &d, 1));
  REFUSED(fmi3EnterConfigurationMode(x));
  REFUSED(fmi3ExitConfigurationMode(x));
  REFUSED(fmi3GetIntervalDecimal(x, &vr, 1, &d, &qualifier));
  REFUSED(fmi3GetIntervalFraction(x, &vr, 1, &u64, &u64, &qualifier));
  REFUSED(fmi3GetShiftDecimal(x, &vr, 1, &d));
  REFUSED(fmi3GetShiftFraction(x, &vr, 1, &u64, &u64));
  REFUSED(fmi3SetIntervalDecimal(x, &vr, 1, &d));
  REFUSED(fmi3SetIntervalFraction(x, &vr, 1, &u64, &u64));
  REFUSED(fmi3SetShiftDecimal(x, &vr, 1, &d));
  REFUSED(fmi3SetShiftFraction(x, &vr, 1, &u64, &u64));
  REFUSED(fmi3GetOutputDerivatives(x, &vr, 1, &i32, &d, 1));
  REFUSED(fmi3EvaluateDiscreteStates(x));
  REFUSED(fmi3ActivateModelPartition(x, vr, 0.0));
}

/* Values that are refused, and change nothing. */
static void values(fmi3Instance x)
{
  const fmi3ValueReference unknown = VR_END;
  const fmi3ValueReference pair[2] = { VR_Q, VR_U };
  const double half[2] = { 0.25, NAN };
  double two[2] = { 0.0, 0.0 };
  const double before = value(x, VR_Q);
  REFUSED(fmi3GetFloat64(x, &unknown, 1, two, 1));
  CHECK(strstr(last, "value reference") != NULL);
  REFUSED(fmi3GetFloat64(x, pair, 2, two, 1));
  REFUSED(fmi3GetFloat64(x, NULL, 2, two, 2));
  REFUSED(fmi3GetFloat64(x, pair, 2, NULL, 2));
  REFUSED(fmi3SetFloat64(x, &unknown, 1, two, 1));
  REFUSED(fmi3SetFloat64(x, pair, 2, half, 2));
  CHECK(strstr(last, "finite") != NULL);
  CHECK(value(x, VR_Q) == before);
  REFUSED(set(x, VR_TIME, 1.0));
  REFUSED(set(x, VR_RATE_OF_U, 1.0));
  REFUSED(set(x, VR_ENERGIES, 1.0));
  CHECK(strstr(last, "computed") != NULL);
  REFUSED(set(x, VR_Q, INFINITY));
  if (NP > 0) {
    REFUSED(set(x, VR_PARAMETERS, NAN));
  }
  if (NW > 0) {
    REFUSED(set(x, VR_INPUTS, NAN));
  }
  CHECK(fmi3GetFloat64(x, NULL, 0, NULL, 0) == fmi3OK);
  CHECK(fmi3SetFloat64(x, NULL, 0, NULL, 0) == fmi3OK);
}

/* Derivatives along a direction against central differences, one known after the other. */
static void derivatives(fmi3Instance x)
{
#if DIRECTIONAL > 0
  const double h = 1e-6;
  int known;
  int i;
  for (known = VR_Q; known < VR_MULTIPLIERS; known++) {
    const int may = ((known < VR_RATE_OF_Q) || (known >= VR_PARAMETERS)) ? 1 : 0;
    const fmi3ValueReference vr = (fmi3ValueReference)known;
    const double one = 1.0;
    double low[VR_END];
    double high[VR_END];
    double found;
    double before;
    if (may == 0) {
      const fmi3ValueReference unknown = VR_Q;
      REFUSED(fmi3GetDirectionalDerivative(x, &unknown, 1, &vr, 1, &one, 1, &found, 1));
      continue;
    }
    before = value(x, known);
    CHECK(set(x, known, before - h) == fmi3OK);
    for (i = 0; i < VR_END; i++) {
      low[i] = value(x, i);
    }
    CHECK(set(x, known, before + h) == fmi3OK);
    for (i = 0; i < VR_END; i++) {
      high[i] = value(x, i);
    }
    CHECK(set(x, known, before) == fmi3OK);
    for (i = 0; i < VR_END; i++) {
      const fmi3ValueReference unknown = (fmi3ValueReference)i;
      const double expected = (high[i] - low[i])/(2.0*h);
      const double scale = 1.0 + fabs(expected) + fabs(high[i]);
      CHECK(fmi3GetDirectionalDerivative(x, &unknown, 1, &vr, 1, &one, 1, &found, 1) == fmi3OK);
      if (found != 0.0) {
        (void)printf("rate %d %d\n", i, known);
      }
      if (!(fabs(found - expected) < 1e-6*scale)) {
        failures++;
        (void)fprintf(stderr, "d %d/d %d is %.9g, by differences %.9g\n", i, known, found, expected);
      }
    }
  }
#else
  (void)x;
#endif
}

static void model_exchange(void)
{
  fmi3Instance x = exchange();
  double states[2*N];
  double rates[2*N];
  double indicators[SOME(NV + NK)];
  double next = 0.0;
  size_t size = 0;
  bool update = true;
  bool end = true;
  bool nominals = true;
  bool changed = true;
  bool defined = true;
  int i;
  const fmi3String category = "logStatusError";
  const fmi3String other = "logAll";
  CHECK(x != NULL);
  REFUSED(fmi3ExitInitializationMode(x));
  CHECK(strstr(last, "Instantiated") != NULL);
  REFUSED(fmi3EnterContinuousTimeMode(x));
  REFUSED(fmi3Terminate(x));
  REFUSED(fmi3GetContinuousStates(x, states, 2*N));
  REFUSED(fmi3DoStep(x, 0.0, 1.0, fmi3False, &update, &end, &changed, &next));
  CHECK(fmi3SetDebugLogging(x, fmi3True, 1, &category) == fmi3OK);
  REFUSED(fmi3SetDebugLogging(x, fmi3True, 1, &other));
  REFUSED(fmi3EnterInitializationMode(x, fmi3True, -1.0, 0.0, fmi3False, 0.0));
  REFUSED(fmi3EnterInitializationMode(x, fmi3True, NAN, 0.0, fmi3False, 0.0));
  REFUSED(fmi3EnterInitializationMode(x, fmi3False, 0.0, NAN, fmi3False, 0.0));
  REFUSED(fmi3EnterInitializationMode(x, fmi3False, 0.0, 0.0, fmi3True, -1.0));
  CHECK(fmi3EnterInitializationMode(x, fmi3False, 0.0, 0.0, fmi3True, 10.0) == fmi3OK);
  values(x);
  lacking(x);
  derivatives(x);
  CHECK(fmi3ExitInitializationMode(x) == fmi3OK);
  REFUSED(fmi3SetContinuousStates(x, states, 2*N));
  REFUSED(set(x, VR_Q, 0.0));
  REFUSED(fmi3EnterStepMode(x));
  REFUSED(fmi3UpdateDiscreteStates(x, NULL, NULL, NULL, NULL, NULL, NULL));
  CHECK(fmi3UpdateDiscreteStates(x, &update, &end, &nominals, &changed, &defined, &next) == fmi3OK);
  CHECK(!update && !end && !nominals && !defined);
  CHECK(fmi3EnterContinuousTimeMode(x) == fmi3OK);
  REFUSED(fmi3UpdateDiscreteStates(x, &update, &end, &nominals, &changed, &defined, &next));
  if (NP > 0) {
    REFUSED(set(x, VR_PARAMETERS, value(x, VR_PARAMETERS)));
  }
  if (NW > 0) {
    CHECK(set(x, VR_INPUTS, value(x, VR_INPUTS)) == fmi3OK);
  }
  CHECK((fmi3GetNumberOfContinuousStates(x, &size) == fmi3OK) && (size == 2*N));
  CHECK((fmi3GetNumberOfEventIndicators(x, &size) == fmi3OK) && (size == NV + NK));
  REFUSED(fmi3GetContinuousStates(x, states, 1));
  REFUSED(fmi3GetContinuousStates(x, NULL, 2*N));
  CHECK(fmi3GetContinuousStates(x, states, 2*N) == fmi3OK);
  CHECK(fmi3GetNominalsOfContinuousStates(x, rates, 2*N) == fmi3OK);
  CHECK((rates[0] > 0.0) && (rates[0] <= 1.0));
  CHECK(fmi3GetContinuousStateDerivatives(x, rates, 2*N) == fmi3OK);
  CHECK(fmi3GetEventIndicators(x, indicators, NV + NK) == fmi3OK);
  for (i = 0; i < 2*N; i++) {
    CHECK(value(x, VR_Q + i) == states[i]);
    CHECK(value(x, VR_RATE_OF_Q + i) == rates[i]);
    (void)printf("%.17g\n", rates[i]);
  }
  for (i = 0; i < NV + NK; i++) {
    CHECK(value(x, VR_EVENTS + i) == indicators[i]);
  }
  REFUSED(fmi3SetTime(x, INFINITY));
  CHECK(fmi3SetTime(x, 0.5) == fmi3OK);
  CHECK(value(x, VR_TIME) == 0.5);
  CHECK(fmi3SetTime(x, 0.0) == fmi3OK);
  next = states[0];
  states[0] = NAN;
  CHECK(fmi3SetContinuousStates(x, states, 2*N) == fmi3Discard);
  CHECK(value(x, VR_Q) == next);
  REFUSED(fmi3CompletedIntegratorStep(x, fmi3True, NULL, NULL));
  states[0] = next;
  CHECK(fmi3SetContinuousStates(x, states, 2*N) == fmi3OK);
  CHECK(fmi3CompletedIntegratorStep(x, fmi3True, &update, &end) == fmi3OK);
  CHECK(!update && !end);
  /* A drift that matters asks for Event Mode, which corrects it. */
  states[0] = next + 1e-5;
  CHECK(fmi3SetContinuousStates(x, states, 2*N) == fmi3OK);
  CHECK(fmi3CompletedIntegratorStep(x, fmi3True, &update, &end) == fmi3OK);
  CHECK(update == (HELD > 0));
  CHECK(fmi3EnterEventMode(x) == fmi3OK);
  CHECK(fmi3UpdateDiscreteStates(x, &update, &end, &nominals, &changed, &defined, &next) == fmi3OK);
  CHECK(changed == (HELD > 0));
  CHECK(fmi3EnterContinuousTimeMode(x) == fmi3OK);
  CHECK(fmi3CompletedIntegratorStep(x, fmi3True, &update, &end) == fmi3OK);
  CHECK(!update);
  CHECK(fmi3Terminate(x) == fmi3OK);
  CHECK(fmi3GetContinuousStates(x, states, 2*N) == fmi3OK);
  REFUSED(fmi3SetFloat64(x, NULL, 0, NULL, 0));
  REFUSED(fmi3Terminate(x));
  CHECK(fmi3Reset(x) == fmi3OK);
  CHECK(fmi3EnterInitializationMode(x, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3OK);
  CHECK(fmi3ExitInitializationMode(x) == fmi3OK);
  fmi3FreeInstance(x);
}

static fmi3Instance begun(fmi3Boolean events)
{
  fmi3Instance x = simulation(events);
  bool b = false;
  double d = 0.0;
  CHECK(x != NULL);
  CHECK(fmi3EnterInitializationMode(x, fmi3False, 0.0, 0.0, fmi3True, 10.0) == fmi3OK);
  CHECK(fmi3ExitInitializationMode(x) == fmi3OK);
  if (events) {
    CHECK(fmi3UpdateDiscreteStates(x, &b, &b, &b, &b, &b, &d) == fmi3OK);
    CHECK(fmi3EnterStepMode(x) == fmi3OK);
  }
  return x;
}

/* Steps of one length to an end. */
static void walk(fmi3Instance x, double start, double end, int steps)
{
  int i;
  for (i = 0; i < steps; i++) {
    const double from = start + (end - start)*i/steps;
    const double to = start + (end - start)*(i + 1)/steps;
    bool event = true;
    bool stop = true;
    bool early = true;
    double reached = 0.0;
    CHECK(fmi3DoStep(x, from, to - from, fmi3True, &event, &stop, &early, &reached) == fmi3OK);
    CHECK(!event && !stop && !early && (reached == from + (to - from)));
  }
}

static void co_simulation(void)
{
  fmi3Instance x = begun(fmi3False);
  fmi3Instance y = begun(fmi3False);
  bool b = false;
  double reached = 0.0;
  double first[VR_END];
  size_t size = 0;
  fmi3FMUState state = NULL;
  fmi3FMUState read = NULL;
  fmi3Byte *bytes;
  int i;
  REFUSED(fmi3DoStep(x, 0.5, 0.1, fmi3True, &b, &b, &b, &reached));
  CHECK(strstr(last, "begins at") != NULL);
  REFUSED(fmi3DoStep(x, 0.0, -0.1, fmi3True, &b, &b, &b, &reached));
  REFUSED(fmi3DoStep(x, 0.0, NAN, fmi3True, &b, &b, &b, &reached));
  REFUSED(fmi3DoStep(x, 0.0, 11.0, fmi3True, &b, &b, &b, &reached));
  CHECK(strstr(last, "stop time") != NULL);
  REFUSED(fmi3DoStep(x, 0.0, 0.1, fmi3True, NULL, NULL, NULL, NULL));
  REFUSED(fmi3EnterEventMode(x));
  REFUSED(fmi3SetTime(x, 0.0));
  REFUSED(set(x, VR_Q, 0.0));
  walk(x, 0.0, 0.5, 10);
  REFUSED(fmi3GetFMUState(x, NULL));
  CHECK(fmi3GetFMUState(x, &state) == fmi3OK);
  walk(x, 0.5, 1.0, 10);
  for (i = 0; i < VR_END; i++) {
    first[i] = value(x, i);
  }
  for (i = 0; i < 2*N; i++) {
    (void)printf("%.17g\n", first[VR_Q + i]);
  }
  /* From a saved state the same bits. */
  CHECK(fmi3SetFMUState(x, state) == fmi3OK);
  CHECK(value(x, VR_TIME) == 0.5);
  walk(x, 0.5, 1.0, 10);
  for (i = 0; i < VR_END; i++) {
    CHECK(value(x, i) == first[i]);
  }
  /* The same through bytes, in another instance. */
  CHECK(fmi3SerializedFMUStateSize(x, state, &size) == fmi3OK);
  bytes = (fmi3Byte *)malloc(size);
  REFUSED(fmi3SerializeFMUState(x, state, bytes, size - 1));
  REFUSED(fmi3SerializeFMUState(x, NULL, bytes, size));
  CHECK(fmi3SerializeFMUState(x, state, bytes, size) == fmi3OK);
  REFUSED(fmi3DeserializeFMUState(y, bytes, size - 1, &read));
  bytes[0] ^= 1;
  REFUSED(fmi3DeserializeFMUState(y, bytes, size, &read));
  bytes[0] ^= 1;
  CHECK(fmi3DeserializeFMUState(y, bytes, size, &read) == fmi3OK);
  REFUSED(fmi3SetFMUState(y, NULL));
  CHECK(fmi3SetFMUState(y, read) == fmi3OK);
  walk(y, 0.5, 1.0, 10);
  for (i = 0; i < VR_END; i++) {
    CHECK(value(y, i) == first[i]);
  }
  CHECK(fmi3FreeFMUState(x, &state) == fmi3OK);
  CHECK(state == NULL);
  CHECK(fmi3FreeFMUState(y, &read) == fmi3OK);
  free(bytes);
  /* Other steps lead to nearly the same. */
  CHECK(fmi3Reset(y) == fmi3OK);
  CHECK(fmi3EnterInitializationMode(y, fmi3True, 1e-9, 0.0, fmi3False, 0.0) == fmi3OK);
  CHECK(fmi3ExitInitializationMode(y) == fmi3OK);
  walk(y, 0.0, 1.0, 3);
  for (i = VR_Q; i < VR_RATE_OF_Q; i++) {
    CHECK(fabs(value(y, i) - first[i]) < 1e-5*(1.0 + fabs(first[i])));
  }
  /* Parameters may be tuned between steps. */
  if (NP > 0) {
    CHECK(set(y, VR_PARAMETERS, 1.01*value(y, VR_PARAMETERS)) == fmi3OK);
    CHECK(fmi3DoStep(y, 1.0, 0.1, fmi3True, &b, &b, &b, &reached) == fmi3OK);
  }
  CHECK(fmi3Terminate(x) == fmi3OK);
  REFUSED(fmi3DoStep(x, 1.0, 0.1, fmi3True, &b, &b, &b, &reached));
  fmi3FreeInstance(x);
  fmi3FreeInstance(y);
}

/* States belong to one interface, also as bytes; those of Event Mode to instances that have it. */
static void foreign_states(void)
{
  fmi3Instance x = exchange();
  fmi3Instance y = begun(fmi3False);
  fmi3Instance z = begun(fmi3True);
  fmi3FMUState state = NULL;
  fmi3FMUState read = NULL;
  fmi3Byte *bytes;
  size_t size = 0;
  bool b = false;
  double reached = 0.0;
  CHECK(fmi3EnterInitializationMode(x, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3OK);
  CHECK(fmi3ExitInitializationMode(x) == fmi3OK);
  CHECK(fmi3EnterContinuousTimeMode(x) == fmi3OK);
  CHECK(fmi3GetFMUState(x, &state) == fmi3OK);
  REFUSED(fmi3SetFMUState(y, state));
  CHECK(strstr(last, "other interface") != NULL);
  CHECK(fmi3SerializedFMUStateSize(x, state, &size) == fmi3OK);
  bytes = (fmi3Byte *)malloc(size);
  CHECK(fmi3SerializeFMUState(x, state, bytes, size) == fmi3OK);
  CHECK(fmi3DeserializeFMUState(y, bytes, size, &read) == fmi3OK);
  REFUSED(fmi3SetFMUState(y, read));
  CHECK(fmi3FreeFMUState(y, &read) == fmi3OK);
  free(bytes);
  CHECK(fmi3FreeFMUState(x, &state) == fmi3OK);
  CHECK(fmi3EnterEventMode(z) == fmi3OK);
  CHECK(fmi3GetFMUState(z, &state) == fmi3OK);
  REFUSED(fmi3SetFMUState(y, state));
  CHECK(strstr(last, "Event Mode") != NULL);
  REFUSED(fmi3SetFMUState(x, state));
  /* What was refused changed nothing. */
  CHECK(fmi3DoStep(y, 0.0, 0.1, fmi3True, &b, &b, &b, &reached) == fmi3OK);
  CHECK(fmi3FreeFMUState(z, &state) == fmi3OK);
  /* A reset keeps the interface. */
  CHECK(fmi3Reset(x) == fmi3OK);
  CHECK(fmi3GetFMUState(x, &state) == fmi3OK);
  REFUSED(fmi3SetFMUState(y, state));
  CHECK(fmi3SetFMUState(x, state) == fmi3OK);
  CHECK(fmi3FreeFMUState(x, &state) == fmi3OK);
  fmi3FreeInstance(x);
  fmi3FreeInstance(y);
  fmi3FreeInstance(z);
}

/* A start off the constraints is moved to them, with a warning. */
static void starts(void)
{
  fmi3Instance x = exchange();
  const int before = messages;
  fmi3Status status;
  double moved;
  CHECK(set(x, VR_Q, value(x, VR_Q) + 0.01) == fmi3OK);
  CHECK(fmi3EnterInitializationMode(x, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3OK);
  moved = value(x, VR_Q);
  status = fmi3ExitInitializationMode(x);
  if (HELD > 0) {
    CHECK(status == fmi3Warning);
    CHECK(messages == before + 1);
    CHECK(strstr(last, "off the constraints") != NULL);
    CHECK(value(x, VR_Q) != moved);
    CHECK(fabs(value(x, VR_Q) - moved) < 0.1);
  } else {
    CHECK(status == fmi3OK);
    CHECK(messages == before);
    CHECK(value(x, VR_Q) == moved);
  }
  fmi3FreeInstance(x);
}

/* With Event Mode steps end where declared events cross 0: prints these times. */
static void events(void)
{
  fmi3Instance x = begun(fmi3True);
  double t = 0.0;
  int count = 0;
  while ((t < 1.0) && (count < 1000)) {
    bool event = false;
    bool stop = false;
    bool early = false;
    bool b = false;
    double next = 0.0;
    const double from = t;
    CHECK(fmi3DoStep(x, from, 1.0 - from, fmi3True, &event, &stop, &early, &t) == fmi3OK);
    CHECK(!stop && (t > from) && (early == (t < 1.0)) && (event || !early));
    CHECK(value(x, VR_TIME) == t);
    if (event) {
      (void)printf("event %.17g\n", t);
      CHECK(fmi3EnterEventMode(x) == fmi3OK);
      CHECK(fmi3UpdateDiscreteStates(x, &b, &b, &b, &b, &b, &next) == fmi3OK);
      CHECK(fmi3EnterStepMode(x) == fmi3OK);
    }
    count++;
  }
  CHECK(count < 1000);
  fmi3FreeInstance(x);
}

int main(void)
{
  without_an_instance();
  model_exchange();
  co_simulation();
  foreign_states();
  starts();
  events();
  return (failures == 0) ? 0 : 1;
}
