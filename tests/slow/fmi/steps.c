/* Steps of Co-Simulation with Event Mode to RUN_END, at most RUN_STEP long: prints the times of events, and
 * what the unit says. From the time CHANGE_AT on the first parameter is CHANGE_TO, which is set in Event Mode
 * where IN_EVENT_MODE is 1. The exit status is 1 where a step is refused, 2 where a value is not finite. */
#include UNIT

#include <math.h>
#include <stdio.h>

#ifndef CHANGE_AT
#define CHANGE_AT HUGE_VAL
#define CHANGE_TO 0.0
#endif
#ifndef IN_EVENT_MODE
#define IN_EVENT_MODE 0
#endif

static void hear(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
  fmi3String message)
{
  (void)environment;
  (void)status;
  (void)category;
  (void)printf("says %s\n", message);
}

/* A warning is no reason to stop. */
static fmi3Status passed(fmi3Status status)
{
  return (status == fmi3Warning) ? fmi3OK : status;
}

/* Event Mode, where the first parameter is set if there is a value for it. */
static fmi3Status handle(fmi3Instance x, const double *to)
{
  const fmi3ValueReference vr = VR_PARAMETERS;
  bool b = false;
  double next = 0.0;
  fmi3Status status = fmi3EnterEventMode(x);
  if ((status == fmi3OK) && (to != NULL)) {
    status = fmi3SetFloat64(x, &vr, 1, to, 1);
  }
  if (status == fmi3OK) {
    status = passed(fmi3UpdateDiscreteStates(x, &b, &b, &b, &b, &b, &next));
  }
  return (status == fmi3OK) ? fmi3EnterStepMode(x) : status;
}

int main(void)
{
  fmi3Instance x = fmi3InstantiateCoSimulation("one", TOKEN, NULL, fmi3False, fmi3False, fmi3True, fmi3True,
    NULL, 0, NULL, hear, NULL);
  fmi3Status status = fmi3EnterInitializationMode(x, fmi3False, 0.0, 0.0, fmi3False, 0.0);
  double t = 0.0;
  int is_changed = 0;
  int result = 0;
  int i;
  if (status == fmi3OK) {
    status = fmi3ExitInitializationMode(x);
  }
  status = (status == fmi3OK) ? fmi3EnterStepMode(x) : status;
  while ((status == fmi3OK) && (t < RUN_END)) {
    bool event = false;
    bool stop = false;
    bool early = false;
    if ((t >= CHANGE_AT) && (is_changed == 0)) {
      const fmi3ValueReference vr = VR_PARAMETERS;
      const double to = CHANGE_TO;
      is_changed = 1;
      status = (IN_EVENT_MODE != 0) ? handle(x, &to) : fmi3SetFloat64(x, &vr, 1, &to, 1);
    }
    if (status == fmi3OK) {
      status = passed(fmi3DoStep(x, t, fmin(RUN_STEP, RUN_END - t), fmi3True, &event, &stop, &early, &t));
    }
    if ((status == fmi3OK) && event) {
      (void)printf("event %.17g\n", t);
      status = handle(x, NULL);
    }
  }
  for (i = VR_Q; i < VR_RATE_OF_Q; i++) {
    const fmi3ValueReference vr = (fmi3ValueReference)i;
    double value = 0.0;
    if ((fmi3GetFloat64(x, &vr, 1, &value, 1) != fmi3OK) || !isfinite(value)) {
      result = 2;
    }
  }
  (void)printf("%.17g\n", t);
  fmi3FreeInstance(x);
  return (result != 0) ? result : ((status == fmi3OK) ? 0 : 1);
}
