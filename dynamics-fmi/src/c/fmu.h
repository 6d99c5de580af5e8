/* <<BANNER>> */
/* An instance of the model $ as a functional mock-up unit of FMI 3.0. */
#ifndef %%_FMU_H
#define %%_FMU_H

/* The standard's header declares two callbacks without arguments. */
#if defined(__clang__)
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wstrict-prototypes"
#endif
#include "fmi3Functions.h"
#if defined(__clang__)
#pragma clang diagnostic pop
#endif

#include "$.h"

/* These stand before the macros, whose short names are no business of theirs. */
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Sizes; arrays of nothing have one element. */
#define N %%_COORDINATES
#define NP %%_PARAMETERS
#define NW %%_INPUTS
#define NR %%_ROWS
#define NE %%_ENERGIES
#define NO %%_OUTPUTS
#define NV %%_EVENTS
#define NK %%_KINKS
#define SOME(count) (((count) > 0) ? (count) : 1)

#define TOKEN "<<TOKEN>>"
/* The same as a number: what serialized states begin with. */
#define IDENTITY <<IDENTITY>>
#define TOLERANCE <<TOLERANCE>>
#define START_TIME <<TIME>>

/* Value references: one for each number, these groups one behind the other. */
enum {
  VR_TIME = 0,
  VR_Q = 1,
  VR_U = VR_Q + N,
  VR_RATE_OF_Q = VR_U + N,
  VR_RATE_OF_U = VR_RATE_OF_Q + N,
  VR_PARAMETERS = VR_RATE_OF_U + N,
  VR_INPUTS = VR_PARAMETERS + NP,
  VR_MULTIPLIERS = VR_INPUTS + NW,
  VR_ENERGIES = VR_MULTIPLIERS + NR,
  VR_OUTPUTS = VR_ENERGIES + NE,
  VR_EVENTS = VR_OUTPUTS + NO,
  VR_KINKS = VR_EVENTS + NV,
  VR_END = VR_KINKS + NK
};

/* States of the standard's state machine. */
enum {
  INSTANTIATED = 1,
  INITIALIZATION = 2,
  EVENT = 4,
  CONTINUOUS = 8,
  STEP = 16,
  TERMINATED = 32,
  ANY = 63
};

/* What is known of `a`, `l` and the results at this state. */
enum { SOLVED = 1, ENERGIES = 2, OUTPUTS = 4, EVENTS = 8, KINKS = 16 };

/* Why there is no result, beside the statuses of $.h. */
enum { NOT_FINITE = 16, OFF = 17, TOO_SHORT = 18, CHATTERS = 19 };

/* Everything that changes: what a saved state holds. */
typedef struct {
  int is_model_exchange;
  int mode;
  int known;
  int has_constants;
  /* Whether something was set from which constraints do not follow. */
  int inconsistent;
  int has_stop_time;
  double t;
  double stop_time;
  double tolerance;
  /* The next step of Co-Simulation; 0: not chosen. */
  double h;
  double previous_error;
  double q[N];
  double u[N];
  double p[SOME(NP)];
  double w[SOME(NW)];
  double k[<<CONSTANTS>>];
  double a[N];
  double l[SOME(NR)];
  double energies[SOME(NE)];
  double outputs[SOME(NO)];
  double events[SOME(NV)];
  double kinks[SOME(NK)];
} $_fmu_values;

/* An instance. */
typedef struct {
  $_fmu_values now;
  int uses_event_mode;
  int returns_early;
  fmi3InstanceEnvironment environment;
  fmi3LogMessageCallback log;
} $_fmu;

extern const char *const $_fmu_names[VR_END];
/* Sizes of the states below which errors are absolute, in parts of them. */
extern const double $_fmu_nominals[2*N];
<<MODES_HEAD>>
/* Reports why something was refused. */
void $_fmu_report(const $_fmu *x, fmi3Status status, const char *format, ...);
/* A mode in words. */
const char *$_fmu_mode(int mode);
/* The instance, if this function may be called now, else NULL. */
$_fmu *$_fmu_open(fmi3Instance instance, int modes, const char *function);
/* Reports and returns fmi3Error. */
fmi3Status $_fmu_refused(const $_fmu *x, const char *function, const char *reason);
/* The same, of a function for what the model lacks. */
fmi3Status $_fmu_lacking(fmi3Instance instance, const char *function, const char *what);
/* What a computation returns: where it failed, another state may do. */
fmi3Status $_fmu_computed(const $_fmu *x, int status, const char *function);
/* Whether there are as many values as references, and all of these exist. */
fmi3Status $_fmu_references(const $_fmu *x, const char *function, const fmi3ValueReference references[],
  size_t count, const void *values, size_t values_count);
/* The start that the model was written with. */
void $_fmu_reset($_fmu_values *x);
/* Forgets what was computed, after a change of the state or of an input. */
void $_fmu_changed($_fmu_values *x);
/* Accelerations and multipliers; a status of $.h or NOT_FINITE. */
int $_fmu_solve($_fmu_values *x);
/* A status in words. */
const char *$_fmu_words(int status);
/* Energies, outputs, events or kinks: those whose bit is given. */
int $_fmu_results($_fmu_values *x, int wanted);
/* The value of a variable. */
int $_fmu_value($_fmu_values *x, fmi3ValueReference reference, double *value);
/* Events, then kinks: <<INDICATORS>> of them. */
int $_fmu_indicators($_fmu_values *x, double *z);
/* How fast everything changes along a direction: of t, q, u, w and p. */
typedef struct {
  double dt;
  double dq[N];
  double du[N];
  double dw[SOME(NW)];
  double dp[SOME(NP)];
} $_fmu_direction;
int $_fmu_directional($_fmu_values *x, const $_fmu_direction *d, double *out);
/* Brings coordinates and velocities to the constraints; `moved`: the largest change, as a part of what is
 * changed, or of its nominal value. */
int $_fmu_project($_fmu_values *x, double *moved);
/* The same for an instance, which is left as it is where that fails. Logs by how much it was moved after
 * something was set, and then returns fmi3Warning. */
fmi3Status $_fmu_settle($_fmu *x, double *moved, const char *function);
/* Moves from a state on the constraints to `end`, or to the first event where `stops` says so. */
int $_fmu_advance($_fmu_values *x, double end, int stops, int *stopped);

#endif
