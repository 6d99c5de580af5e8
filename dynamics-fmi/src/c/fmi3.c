/* <<BANNER>> */
/* Functions of FMI 3.0: instances, modes and values. A call that is refused changes nothing and says why
 * through the log. */
#include "$_fmu.h"

void $_fmu_report(const $_fmu *x, fmi3Status status, const char *format, ...)
{
  char message[512];
  va_list arguments;
  va_start(arguments, format);
  (void)vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  if (x->log != NULL) {
    x->log(x->environment, status, (status == fmi3Warning) ? "logStatusWarning" : "logStatusError", message);
  }
}

const char *$_fmu_mode(int mode)
{
  const char *words = "Terminated";
  if (mode == INSTANTIATED) {
    words = "Instantiated";
  } else if (mode == INITIALIZATION) {
    words = "Initialization Mode";
  } else if (mode == EVENT) {
    words = "Event Mode";
  } else if (mode == CONTINUOUS) {
    words = "Continuous-Time Mode";
  } else if (mode == STEP) {
    words = "Step Mode";
  } else {
    words = "Terminated";
  }
  return words;
}

/* The instance, if this function may be called now, else NULL. */
$_fmu *$_fmu_open(fmi3Instance instance, int modes, const char *function)
{
  $_fmu *x = ($_fmu *)instance;
  if ((x != NULL) && ((x->now.mode & modes) == 0)) {
    $_fmu_report(x, fmi3Error, "%s: must not be called in the state %s", function, $_fmu_mode(x->now.mode));
    x = NULL;
  }
  return x;
}

fmi3Status $_fmu_refused(const $_fmu *x, const char *function, const char *reason)
{
  $_fmu_report(x, fmi3Error, "%s: %s", function, reason);
  return fmi3Error;
}

/* A function for what the model lacks. */
fmi3Status $_fmu_lacking(fmi3Instance instance, const char *function, const char *what)
{
  const $_fmu *x = (const $_fmu *)instance;
  if (x != NULL) {
    $_fmu_report(x, fmi3Error, "%s: the model has no %s", function, what);
  }
  return fmi3Error;
}

/* What a computation that failed returns: another state may do. */
fmi3Status $_fmu_computed(const $_fmu *x, int status, const char *function)
{
  if (status != %%_OK) {
    $_fmu_report(x, fmi3Discard, "%s: at t = %.17g %s", function, x->now.t, $_fmu_words(status));
  }
  return (status == %%_OK) ? fmi3OK : fmi3Discard;
}

fmi3Status $_fmu_settle($_fmu *x, double *moved, const char *function)
{
  $_fmu_values next = x->now;
  fmi3Status status = $_fmu_computed(x, $_fmu_project(&next, moved), function);
  if (status == fmi3OK) {
    if ((x->now.inconsistent != 0) && (*moved > next.tolerance)) {
      $_fmu_report(x, fmi3Warning,
        "%s: the state was off the constraints; it was moved by up to %.3g to the nearest state on them",
        function, *moved);
      status = fmi3Warning;
    }
    x->now = next;
  }
  return status;
}

const char *fmi3GetVersion(void)
{
  return "3.0";
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
  const fmi3String categories[])
{
  const $_fmu *x = $_fmu_open(instance, ANY, "fmi3SetDebugLogging");
  fmi3Status status = (x != NULL) ? fmi3OK : fmi3Error;
  size_t i;
  (void)loggingOn;
  for (i = 0; (i < nCategories) && (status == fmi3OK); i++) {
    if ((categories == NULL) || (categories[i] == NULL) || ((strcmp(categories[i], "logStatusError") != 0)
        && (strcmp(categories[i], "logStatusWarning") != 0))) {
      status = $_fmu_refused(x, "fmi3SetDebugLogging", "categories are logStatusError, logStatusWarning");
    }
  }
  return status;
}

static fmi3Instance instantiate(fmi3String name, fmi3String token, fmi3InstanceEnvironment environment,
  fmi3LogMessageCallback log, int is_model_exchange)
{
  $_fmu *x = ($_fmu *)calloc(1, sizeof *x);
  if (x != NULL) {
    x->environment = environment;
    x->log = log;
    x->now.is_model_exchange = is_model_exchange;
    $_fmu_reset(&x->now);
    if ((name == NULL) || (name[0] == '\0')) {
      (void)$_fmu_refused(x, "fmi3Instantiate", "the instance needs a name");
      free(x);
      x = NULL;
    } else if ((token == NULL) || (strcmp(token, TOKEN) != 0)) {
      (void)$_fmu_refused(x, "fmi3Instantiate", "the token is not that of modelDescription.xml");
      free(x);
      x = NULL;
    } else {
      x->now.mode = INSTANTIATED;
    }
  }
  return x;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
  fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
  fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage)
{
  (void)resourcePath;
  (void)visible;
  (void)loggingOn;
  return instantiate(instanceName, instantiationToken, instanceEnvironment, logMessage, 1);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
  fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
  fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
  size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
  fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate)
{
  $_fmu *x = ($_fmu *)instantiate(instanceName, instantiationToken, instanceEnvironment, logMessage, 0);
  (void)resourcePath;
  (void)visible;
  (void)loggingOn;
  (void)requiredIntermediateVariables;
  (void)intermediateUpdate;
  if ((x != NULL) && (nRequiredIntermediateVariables > 0)) {
    (void)$_fmu_refused(x, "fmi3InstantiateCoSimulation", "there are no intermediate updates");
    free(x);
    x = NULL;
  }
  if (x != NULL) {
    x->uses_event_mode = eventModeUsed ? 1 : 0;
    x->returns_early = earlyReturnAllowed ? 1 : 0;
  }
  return x;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
  fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
  fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
  fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
  fmi3UnlockPreemptionCallback unlockPreemption)
{
  $_fmu none;
  (void)instanceName;
  (void)instantiationToken;
  (void)resourcePath;
  (void)visible;
  (void)loggingOn;
  (void)clockUpdate;
  (void)lockPreemption;
  (void)unlockPreemption;
  none.environment = instanceEnvironment;
  none.log = logMessage;
  (void)$_fmu_refused(&none, "fmi3InstantiateScheduledExecution", "the model has no partitions");
  return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
  free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
  fmi3Float64 tolerance, fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
  static const char function[] = "fmi3EnterInitializationMode";
  $_fmu *x = $_fmu_open(instance, INSTANTIATED, function);
  fmi3Status status = (x != NULL) ? fmi3OK : fmi3Error;
  if (x == NULL) {
    status = fmi3Error;
  } else if (!isfinite(startTime)) {
    status = $_fmu_refused(x, function, "the start time has to be finite");
  } else if (stopTimeDefined && !(stopTime >= startTime)) {
    status = $_fmu_refused(x, function, "the stop time lies before the start time");
  } else if (toleranceDefined && !((tolerance > 0.0) && isfinite(tolerance))) {
    status = $_fmu_refused(x, function, "the tolerance has to be a positive number");
  } else {
    x->now.t = startTime;
    x->now.has_stop_time = stopTimeDefined ? 1 : 0;
    x->now.stop_time = stopTimeDefined ? stopTime : 0.0;
    x->now.tolerance = toleranceDefined ? tolerance : TOLERANCE;
    x->now.mode = INITIALIZATION;
    x->now.inconsistent = (NR > 0) ? 1 : 0;
    $_fmu_changed(&x->now);
  }
  return status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
  static const char function[] = "fmi3ExitInitializationMode";
  $_fmu *x = $_fmu_open(instance, INITIALIZATION, function);
  fmi3Status status = fmi3Error;
  if (x != NULL) {
    const $_fmu_values before = x->now;
    double moved = 0.0;
    fmi3Status solved = fmi3OK;
    status = $_fmu_settle(x, &moved, function);
    if ((status == fmi3OK) || (status == fmi3Warning)) {
      solved = $_fmu_computed(x, $_fmu_solve(&x->now), function);
    }
    if ((solved == fmi3OK) && (status != fmi3Discard)) {
      x->now.mode = ((x->now.is_model_exchange != 0) || (x->uses_event_mode != 0)) ? EVENT : STEP;
    } else {
      x->now = before;
      status = fmi3Error;
    }
  }
  return status;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
  $_fmu *x = $_fmu_open(instance, CONTINUOUS | STEP, "fmi3EnterEventMode");
  fmi3Status status = (x != NULL) ? fmi3OK : fmi3Error;
  if ((x != NULL) && (x->now.is_model_exchange == 0) && (x->uses_event_mode == 0)) {
    status = $_fmu_refused(x, "fmi3EnterEventMode", "the instance was made without Event Mode");
  } else if (x != NULL) {
    x->now.mode = EVENT;
  } else {
    status = fmi3Error;
  }
  return status;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
  $_fmu *x = $_fmu_open(instance, INITIALIZATION | EVENT | CONTINUOUS | STEP, "fmi3Terminate");
  if (x != NULL) {
    x->now.mode = TERMINATED;
  }
  return (x != NULL) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
  $_fmu *x = $_fmu_open(instance, ANY, "fmi3Reset");
  if (x != NULL) {
    $_fmu_reset(&x->now);
  }
  return (x != NULL) ? fmi3OK : fmi3Error;
}

/* Whether there are as many values as references, and all of these exist. */
fmi3Status $_fmu_references(const $_fmu *x, const char *function, const fmi3ValueReference references[],
  size_t count, const void *values, size_t values_count)
{
  fmi3Status status = fmi3OK;
  size_t i;
  if ((count != values_count) || ((count > 0) && ((references == NULL) || (values == NULL)))) {
    status = $_fmu_refused(x, function, "there has to be one value for each value reference");
  }
  for (i = 0; (i < count) && (status == fmi3OK); i++) {
    if (references[i] >= (fmi3ValueReference)VR_END) {
      $_fmu_report(x, fmi3Error, "%s: there is no variable with the value reference %lu", function,
        (unsigned long)references[i]);
      status = fmi3Error;
    }
  }
  return status;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Float64 values[], size_t nValues)
{
  static const char function[] = "fmi3GetFloat64";
  $_fmu *x = $_fmu_open(instance, ANY, function);
  fmi3Status status = fmi3Error;
  size_t i;
  if (x != NULL) {
    status = $_fmu_references(x, function, valueReferences, nValueReferences, values, nValues);
  }
  for (i = 0; (i < nValueReferences) && (status == fmi3OK); i++) {
    status = $_fmu_computed(x, $_fmu_value(&x->now, valueReferences[i], &values[i]), function);
  }
  return status;
}

/* In which modes a variable is set. */
static int modes_of_setting(fmi3ValueReference reference)
{
  const int vr = (int)reference;
  int modes = 0;
  if (vr >= VR_MULTIPLIERS) {
    modes = 0;
  } else if (vr >= VR_INPUTS) {
    modes = INSTANTIATED | INITIALIZATION | EVENT | STEP | CONTINUOUS;
  } else if (vr >= VR_PARAMETERS) {
    modes = INSTANTIATED | INITIALIZATION | EVENT | STEP;
  } else if (vr >= VR_RATE_OF_Q) {
    modes = 0;
  } else if (vr >= VR_Q) {
    modes = INSTANTIATED | INITIALIZATION;
  } else {
    modes = 0;
  }
  return modes;
}

static void set_value($_fmu_values *x, fmi3ValueReference reference, double value)
{
  const int vr = (int)reference;
  if (vr >= VR_INPUTS) {
    x->w[vr - VR_INPUTS] = value;
  } else if (vr >= VR_PARAMETERS) {
    x->p[vr - VR_PARAMETERS] = value;
    x->has_constants = 0;
  } else if (vr >= VR_U) {
    x->u[vr - VR_U] = value;
  } else {
    x->q[vr - VR_Q] = value;
  }
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Float64 values[], size_t nValues)
{
  static const char function[] = "fmi3SetFloat64";
  $_fmu *x = $_fmu_open(instance, ANY & ~TERMINATED, function);
  fmi3Status status = fmi3Error;
  size_t i;
  if (x != NULL) {
    status = $_fmu_references(x, function, valueReferences, nValueReferences, values, nValues);
  }
  for (i = 0; (i < nValueReferences) && (status == fmi3OK); i++) {
    const int modes = modes_of_setting(valueReferences[i]);
    const char *name = $_fmu_names[valueReferences[i]];
    if (modes == 0) {
      $_fmu_report(x, fmi3Error, "%s: `%s` is computed and cannot be set", function, name);
      status = fmi3Error;
    } else if ((modes & x->now.mode) == 0) {
      $_fmu_report(x, fmi3Error, "%s: `%s` cannot be set in the state %s", function, name,
        $_fmu_mode(x->now.mode));
      status = fmi3Error;
    } else if (!isfinite(values[i])) {
      $_fmu_report(x, fmi3Error, "%s: `%s` has to be a finite number, and is %g", function, name, values[i]);
      status = fmi3Error;
    } else {
      status = fmi3OK;
    }
  }
  for (i = 0; (i < nValueReferences) && (status == fmi3OK); i++) {
    set_value(&x->now, valueReferences[i], values[i]);
    x->now.inconsistent = (NR > 0) ? 1 : 0;
  }
  if ((x != NULL) && (status == fmi3OK) && (nValueReferences > 0)) {
    $_fmu_changed(&x->now);
  }
  return status;
}
