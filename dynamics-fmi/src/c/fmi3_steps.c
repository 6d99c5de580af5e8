/* <<BANNER>> */
/* Functions of FMI 3.0: events, Model Exchange and Co-Simulation. */
#include "$_fmu.h"

/* Drift from the constraints, as a part of the tolerance, from which a state is corrected. */
#define DRIFT 0.1

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
  fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
  fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime)
{
  static const char function[] = "fmi3UpdateDiscreteStates";
  $_fmu *x = $_fmu_open(instance, EVENT, function);
  fmi3Status status = fmi3Error;
  if (x == NULL) {
    status = fmi3Error;
  } else if ((discreteStatesNeedUpdate == NULL) || (terminateSimulation == NULL)
    || (nominalsOfContinuousStatesChanged == NULL) || (valuesOfContinuousStatesChanged == NULL)
    || (nextEventTimeDefined == NULL) || (nextEventTime == NULL)) {
    status = $_fmu_refused(x, function, "there is no place for the results");
  } else {
    double moved = 0.0;
    status = $_fmu_settle(x, &moved, function);
    *discreteStatesNeedUpdate = fmi3False;
    *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = (moved > 0.0) ? fmi3True : fmi3False;
    *nextEventTimeDefined = fmi3False;
    *nextEventTime = 0.0;
  }
  return status;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
  return $_fmu_lacking(instance, "fmi3EvaluateDiscreteStates", "discrete states");
}

/* The instance, if it is one of Model Exchange and in one of these modes. */
static $_fmu *exchanged(fmi3Instance instance, int modes, const char *function)
{
  $_fmu *x = $_fmu_open(instance, modes, function);
  if ((x != NULL) && (x->now.is_model_exchange == 0)) {
    (void)$_fmu_refused(x, function, "the instance is one of Co-Simulation");
    x = NULL;
  }
  return x;
}

/* The same, where arrays of a length are read or written. */
static $_fmu *counted(fmi3Instance instance, int modes, const char *function, const void *values,
  size_t given, size_t wanted)
{
  $_fmu *x = exchanged(instance, modes, function);
  if ((x != NULL) && ((given != wanted) || ((values == NULL) && (wanted > 0)))) {
    $_fmu_report(x, fmi3Error, "%s: %lu values are given, and there are %lu", function, (unsigned long)given,
      (unsigned long)wanted);
    x = NULL;
  }
  return x;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
  $_fmu *x = exchanged(instance, EVENT, "fmi3EnterContinuousTimeMode");
  if (x != NULL) {
    x->now.mode = CONTINUOUS;
  }
  return (x != NULL) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
  fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
  static const char function[] = "fmi3CompletedIntegratorStep";
  $_fmu *x = exchanged(instance, CONTINUOUS, function);
  fmi3Status status = fmi3Error;
  (void)noSetFMUStatePriorToCurrentPoint;
  if (x == NULL) {
    status = fmi3Error;
  } else if ((enterEventMode == NULL) || (terminateSimulation == NULL)) {
    status = $_fmu_refused(x, function, "there is no place for the results");
  } else {
    double moved = 0.0;
    $_fmu_values next = x->now;
    /* States change in Event Mode alone: this asks for it where the drift is too large. */
    status = $_fmu_computed(x, $_fmu_project(&next, &moved), function);
    *enterEventMode = (moved > DRIFT*next.tolerance) ? fmi3True : fmi3False;
    *terminateSimulation = fmi3False;
  }
  return status;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
  static const char function[] = "fmi3SetTime";
  $_fmu *x = exchanged(instance, CONTINUOUS | EVENT, function);
  fmi3Status status = (x != NULL) ? fmi3OK : fmi3Error;
  if ((x != NULL) && !isfinite(time)) {
    status = $_fmu_refused(x, function, "the time has to be finite");
  } else if (x != NULL) {
    x->now.t = time;
    $_fmu_changed(&x->now);
  } else {
    status = fmi3Error;
  }
  return status;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
  size_t nContinuousStates)
{
  static const char function[] = "fmi3SetContinuousStates";
  $_fmu *x = counted(instance, CONTINUOUS, function, continuousStates, nContinuousStates, 2U*N);
  fmi3Status status = (x != NULL) ? fmi3OK : fmi3Error;
  int i;
  for (i = 0; (i < 2*N) && (status == fmi3OK); i++) {
    if (!isfinite(continuousStates[i])) {
      $_fmu_report(x, fmi3Discard, "%s: the state `%s` is %g", function, $_fmu_names[VR_Q + i],
        continuousStates[i]);
      status = fmi3Discard;
    }
  }
  if (status == fmi3OK) {
    (void)memcpy(x->now.q, continuousStates, sizeof x->now.q);
    (void)memcpy(x->now.u, continuousStates + N, sizeof x->now.u);
    $_fmu_changed(&x->now);
  }
  return status;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[],
  size_t nContinuousStates)
{
  const $_fmu *x = counted(instance, ANY & ~INSTANTIATED, "fmi3GetContinuousStates", continuousStates,
    nContinuousStates, 2U*N);
  if (x != NULL) {
    (void)memcpy(continuousStates, x->now.q, sizeof x->now.q);
    (void)memcpy(continuousStates + N, x->now.u, sizeof x->now.u);
  }
  return (x != NULL) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
  size_t nContinuousStates)
{
  const $_fmu *x = counted(instance, ANY & ~INSTANTIATED, "fmi3GetNominalsOfContinuousStates", nominals,
    nContinuousStates, 2U*N);
  size_t i;
  for (i = 0; (x != NULL) && (i < nContinuousStates); i++) {
    nominals[i] = $_fmu_nominals[i];
  }
  return (x != NULL) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
  size_t nContinuousStates)
{
  static const char function[] = "fmi3GetContinuousStateDerivatives";
  $_fmu *x = counted(instance, ANY & ~INSTANTIATED, function, derivatives, nContinuousStates, 2U*N);
  fmi3Status status = fmi3Error;
  if (x != NULL) {
    status = $_fmu_computed(x, $_fmu_solve(&x->now), function);
  }
  if (status == fmi3OK) {
    (void)memcpy(derivatives, x->now.u, sizeof x->now.u);
    (void)memcpy(derivatives + N, x->now.a, sizeof x->now.a);
  }
  return status;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[],
  size_t nEventIndicators)
{
  static const char function[] = "fmi3GetEventIndicators";
  $_fmu *x = counted(instance, ANY & ~INSTANTIATED, function, eventIndicators, nEventIndicators,
    (size_t)(NV + NK));
  return (x != NULL) ? $_fmu_computed(x, $_fmu_indicators(&x->now, eventIndicators), function) : fmi3Error;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
  $_fmu *x = exchanged(instance, ANY, "fmi3GetNumberOfEventIndicators");
  if ((x != NULL) && (nEventIndicators != NULL)) {
    *nEventIndicators = (size_t)(NV + NK);
  }
  return ((x != NULL) && (nEventIndicators != NULL)) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
  $_fmu *x = exchanged(instance, ANY, "fmi3GetNumberOfContinuousStates");
  if ((x != NULL) && (nContinuousStates != NULL)) {
    *nContinuousStates = 2U*N;
  }
  return ((x != NULL) && (nContinuousStates != NULL)) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
  static const char function[] = "fmi3EnterStepMode";
  $_fmu *x = $_fmu_open(instance, EVENT, function);
  fmi3Status status = (x != NULL) ? fmi3OK : fmi3Error;
  if ((x != NULL) && (x->now.is_model_exchange != 0)) {
    status = $_fmu_refused(x, function, "the instance is one of Model Exchange");
  } else if (x != NULL) {
    x->now.mode = STEP;
  } else {
    status = fmi3Error;
  }
  return status;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
  fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
  fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
  fmi3Float64 *lastSuccessfulTime)
{
  static const char function[] = "fmi3DoStep";
  $_fmu *x = $_fmu_open(instance, STEP, function);
  const double end = currentCommunicationPoint + communicationStepSize;
  /* Importers add up their steps, with roundings. */
  const double near = 1e-6*fabs(communicationStepSize) + 64.0*DBL_EPSILON*fabs(end);
  fmi3Status status = fmi3Error;
  (void)noSetFMUStatePriorToCurrentPoint;
  if (x == NULL) {
    status = fmi3Error;
  } else if ((eventHandlingNeeded == NULL) || (terminateSimulation == NULL) || (earlyReturn == NULL)
    || (lastSuccessfulTime == NULL)) {
    status = $_fmu_refused(x, function, "there is no place for the results");
  } else if (!((communicationStepSize > 0.0) && isfinite(end))) {
    status = $_fmu_refused(x, function, "the step has to be a positive number");
  } else if (!(fabs(currentCommunicationPoint - x->now.t) <= near)) {
    $_fmu_report(x, fmi3Error, "%s: the step begins at %.17g, and the instance is at %.17g", function,
      currentCommunicationPoint, x->now.t);
    status = fmi3Error;
  } else if ((x->now.has_stop_time != 0) && (end > x->now.stop_time + near)) {
    $_fmu_report(x, fmi3Error, "%s: the step ends at %.17g, behind the stop time %.17g", function, end,
      x->now.stop_time);
    status = fmi3Error;
  } else {
    const int stops = ((x->uses_event_mode != 0) && (x->returns_early != 0)) ? 1 : 0;
    int stopped = 0;
    double moved = 0.0;
    const fmi3Status settled = (x->now.inconsistent != 0) ? $_fmu_settle(x, &moved, function) : fmi3OK;
    status = settled;
    if (settled != fmi3Discard) {
      status = $_fmu_computed(x, $_fmu_advance(&x->now, end, stops, &stopped), function);
    }
    *eventHandlingNeeded = (stopped != 0) ? fmi3True : fmi3False;
    *earlyReturn = ((stopped != 0) && (x->now.t < end)) ? fmi3True : fmi3False;
    *terminateSimulation = fmi3False;
    *lastSuccessfulTime = x->now.t;
    /* A step that ends elsewhere than it should is no step. */
    status = (status == fmi3OK) ? settled : fmi3Error;
  }
  return status;
}
