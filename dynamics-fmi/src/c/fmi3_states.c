/* <<BANNER>> */
/* Functions of FMI 3.0: saved states, and derivatives along a direction. */
#include "$_fmu.h"

/* What a serialized state begins with: states of other units, or of other builds, are refused. */
typedef struct {
  unsigned long long identity;
  size_t size;
} heading;

#define SERIALIZED (sizeof(heading) + sizeof($_fmu_values))

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
  static const char function[] = "fmi3GetFMUState";
  $_fmu *x = $_fmu_open(instance, ANY, function);
  fmi3Status status = fmi3Error;
  if (x == NULL) {
    status = fmi3Error;
  } else if (FMUState == NULL) {
    status = $_fmu_refused(x, function, "there is no place for the state");
  } else {
    if (*FMUState == NULL) {
      *FMUState = malloc(sizeof x->now);
    }
    if (*FMUState == NULL) {
      status = $_fmu_refused(x, function, "there is no memory");
    } else {
      (void)memcpy(*FMUState, &x->now, sizeof x->now);
      status = fmi3OK;
    }
  }
  return status;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
  static const char function[] = "fmi3SetFMUState";
  $_fmu *x = $_fmu_open(instance, ANY, function);
  fmi3Status status = fmi3Error;
  if (x == NULL) {
    status = fmi3Error;
  } else if (FMUState == NULL) {
    status = $_fmu_refused(x, function, "there is no state");
  } else {
    const $_fmu_values *saved = (const $_fmu_values *)FMUState;
    if (saved->is_model_exchange != x->now.is_model_exchange) {
      status = $_fmu_refused(x, function, "the state is one of the other interface");
    } else if ((x->now.is_model_exchange == 0) && (x->uses_event_mode == 0) && (saved->mode == EVENT)) {
      status = $_fmu_refused(x, function, "the state is one in Event Mode, which the instance lacks");
    } else {
      (void)memcpy(&x->now, saved, sizeof x->now);
      status = fmi3OK;
    }
  }
  return status;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
  const $_fmu *x = $_fmu_open(instance, ANY, "fmi3FreeFMUState");
  if ((x != NULL) && (FMUState != NULL)) {
    free(*FMUState);
    *FMUState = NULL;
  }
  return (x != NULL) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
  static const char function[] = "fmi3SerializedFMUStateSize";
  const $_fmu *x = $_fmu_open(instance, ANY, function);
  fmi3Status status = fmi3Error;
  if (x == NULL) {
    status = fmi3Error;
  } else if ((FMUState == NULL) || (size == NULL)) {
    status = $_fmu_refused(x, function, "there is no state, or no place for its size");
  } else {
    *size = SERIALIZED;
    status = fmi3OK;
  }
  return status;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
  size_t size)
{
  static const char function[] = "fmi3SerializeFMUState";
  const $_fmu *x = $_fmu_open(instance, ANY, function);
  fmi3Status status = fmi3Error;
  if (x == NULL) {
    status = fmi3Error;
  } else if ((FMUState == NULL) || (serializedState == NULL) || (size < SERIALIZED)) {
    status = $_fmu_refused(x, function, "there is no state, or too little place for it");
  } else {
    heading head;
    (void)memset(&head, 0, sizeof head);
    head.identity = IDENTITY;
    head.size = sizeof x->now;
    (void)memcpy(serializedState, &head, sizeof head);
    (void)memcpy(serializedState + sizeof head, FMUState, sizeof x->now);
    status = fmi3OK;
  }
  return status;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
  fmi3FMUState *FMUState)
{
  static const char function[] = "fmi3DeserializeFMUState";
  $_fmu *x = $_fmu_open(instance, ANY, function);
  fmi3Status status = fmi3Error;
  heading head;
  if (x == NULL) {
    status = fmi3Error;
  } else if ((serializedState == NULL) || (FMUState == NULL) || (size < SERIALIZED)) {
    status = $_fmu_refused(x, function, "there is no state, or it is cut off");
  } else {
    (void)memcpy(&head, serializedState, sizeof head);
    if ((head.identity != IDENTITY) || (head.size != sizeof x->now)) {
      status = $_fmu_refused(x, function, "this is the state of another unit, or of another build");
    } else {
      if (*FMUState == NULL) {
        *FMUState = malloc(sizeof x->now);
      }
      if (*FMUState == NULL) {
        status = $_fmu_refused(x, function, "there is no memory");
      } else {
        (void)memcpy(*FMUState, serializedState + sizeof head, sizeof x->now);
        status = fmi3OK;
      }
    }
  }
  return status;
}

#if %%_DIRECTIONAL > 0
/* Adds the rate of a variable to a direction; whether it may be one. */
static int add_rate($_fmu_direction *d, fmi3ValueReference reference, double rate)
{
  const int vr = (int)reference;
  int fits = 1;
  if (vr >= VR_MULTIPLIERS) {
    fits = 0;
  } else if (vr >= VR_INPUTS) {
    d->dw[vr - VR_INPUTS] += rate;
  } else if (vr >= VR_PARAMETERS) {
    d->dp[vr - VR_PARAMETERS] += rate;
  } else if (vr >= VR_RATE_OF_Q) {
    fits = 0;
  } else if (vr >= VR_U) {
    d->du[vr - VR_U] += rate;
  } else if (vr >= VR_Q) {
    d->dq[vr - VR_Q] += rate;
  } else {
    d->dt += rate;
  }
  return fits;
}

/* The rate of a variable along a direction; `out`: of accelerations, multipliers and results. */
static double rate_of(const $_fmu_direction *d, const double *out, fmi3ValueReference reference)
{
  const int vr = (int)reference;
  double rate = 0.0;
  if (vr >= VR_MULTIPLIERS) {
    rate = out[N + vr - VR_MULTIPLIERS];
  } else if (vr >= VR_INPUTS) {
    rate = d->dw[vr - VR_INPUTS];
  } else if (vr >= VR_PARAMETERS) {
    rate = d->dp[vr - VR_PARAMETERS];
  } else if (vr >= VR_RATE_OF_U) {
    rate = out[vr - VR_RATE_OF_U];
  } else if (vr >= VR_RATE_OF_Q) {
    rate = d->du[vr - VR_RATE_OF_Q];
  } else if (vr >= VR_U) {
    rate = d->du[vr - VR_U];
  } else if (vr >= VR_Q) {
    rate = d->dq[vr - VR_Q];
  } else {
    rate = d->dt;
  }
  return rate;
}
#endif

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
  size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
  fmi3Float64 sensitivity[], size_t nSensitivity)
{
#if %%_DIRECTIONAL > 0
  static const char function[] = "fmi3GetDirectionalDerivative";
  $_fmu *x = $_fmu_open(instance, ANY & ~INSTANTIATED, function);
  fmi3Status status = fmi3Error;
  $_fmu_direction d;
  double out[%%_DIRECTIONAL];
  size_t i;
  (void)memset(&d, 0, sizeof d);
  if (x != NULL) {
    status = $_fmu_references(x, function, unknowns, nUnknowns, sensitivity, nSensitivity);
    if (status == fmi3OK) {
      status = $_fmu_references(x, function, knowns, nKnowns, seed, nSeed);
    }
  }
  for (i = 0; (i < nKnowns) && (status == fmi3OK); i++) {
    if (add_rate(&d, knowns[i], seed[i]) == 0) {
      $_fmu_report(x, fmi3Error, "%s: `%s` is computed, so there are no derivatives by it", function,
        $_fmu_names[knowns[i]]);
      status = fmi3Error;
    }
  }
  if (status == fmi3OK) {
    status = $_fmu_computed(x, $_fmu_directional(&x->now, &d, out), function);
  }
  for (i = 0; (i < nUnknowns) && (status == fmi3OK); i++) {
    sensitivity[i] = rate_of(&d, out, unknowns[i]);
  }
  return status;
#else
  (void)unknowns;
  (void)nUnknowns;
  (void)knowns;
  (void)nKnowns;
  (void)seed;
  (void)nSeed;
  (void)sensitivity;
  (void)nSensitivity;
  return $_fmu_lacking(instance, "fmi3GetDirectionalDerivative", "directional derivatives");
#endif
}
