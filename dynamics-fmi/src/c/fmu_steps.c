/* <<BANNER>> */
/* Motions of an instance: projection to the constraints, and <<METHOD>> with its own
 * steps, which end at events that are asked for and where accelerations are not smooth. */
#include "$_fmu.h"

/* Stages of a step, the first of which is known, and the derivative at its end. */
#define STAGES <<STAGES>>

/* An entry of a row of the method's table. */
typedef struct {
  int stage;
  double weight;
} entry;

static const double nodes[STAGES] = {
<<NODES>>
};
/* Rows of the stages, one behind the other; where each begins. */
static const entry rows[] = {
<<ROWS>>
};
static const int row_begins[STAGES + 1] = { <<BEGINS>> };
#if <<REUSES>> == 0
/* Weights of the result; elsewhere it is the state of the last stage. */
static const entry result[<<RESULTS>>] = {
<<RESULT>>
};
#endif
/* Weights of the error estimate. */
static const entry error_weights[<<ERRORS>>] = {
<<ERROR>>
};
#if <<THIRDS>> > 0
/* Weights of the embedded result of order 3. */
static const entry third_order[<<THIRDS>>] = {
<<THIRD>>
};
#endif

/* Step control: h grows by safety*error^-ALPHA*previous^BETA. */
#define SAFETY <<SAFETY>>
#define BETA <<BETA>>
#define ALPHA <<ALPHA>>
#define SHRINK <<SHRINK>>
#define GROW <<GROW>>
/* Errors below this count as this large in the next step. */
#define LEAST_ERROR 1e-4

/* Derivatives of the stages. */
typedef struct {
  double q[STAGES][N];
  double u[STAGES][N];
} slopes;

/* Weighted sum of slopes. */
static void sum(const entry *row, int count, const slopes *k, double *of_q, double *of_u)
{
  int i;
  int j;
  for (i = 0; i < N; i++) {
    of_q[i] = 0.0;
    of_u[i] = 0.0;
    for (j = 0; j < count; j++) {
      of_q[i] += row[j].weight*k->q[row[j].stage][i];
      of_u[i] += row[j].weight*k->u[row[j].stage][i];
    }
  }
}

/* Sum of squares of an error, each part by its tolerance. */
static double squares(const $_fmu_values *from, const $_fmu_values *to, const double *of_q,
  const double *of_u)
{
  const double tolerance = from->tolerance;
  double all = 0.0;
  int i;
  for (i = 0; i < N; i++) {
    const double scale_q = tolerance*($_fmu_nominals[i] + fmax(fabs(from->q[i]), fabs(to->q[i])));
    const double scale_u = tolerance*($_fmu_nominals[N + i] + fmax(fabs(from->u[i]), fabs(to->u[i])));
    all += (of_q[i]/scale_q)*(of_q[i]/scale_q) + (of_u[i]/scale_u)*(of_u[i]/scale_u);
  }
  return all;
}

/* Whether a state has numbers alone. */
static int is_finite(const $_fmu_values *x)
{
  int i;
  int all = 1;
  for (i = 0; i < N; i++) {
    all = (isfinite(x->q[i]) && isfinite(x->u[i])) ? all : 0;
  }
  return all;
}

/* A step of size h from a solved state; its error, 1 where it is just permitted. */
static int attempt(const $_fmu_values *from, double h, double end, $_fmu_values *to, double *error)
{
  slopes k;
  double of_q[N];
  double of_u[N];
  double five;
  int status = %%_OK;
  int stage;
  int i;
  (void)memcpy(k.q[0], from->u, sizeof k.q[0]);
  (void)memcpy(k.u[0], from->a, sizeof k.u[0]);
  *to = *from;
  for (stage = 1; (stage < STAGES) && (status == %%_OK); stage++) {
    sum(rows + row_begins[stage], row_begins[stage + 1] - row_begins[stage], &k, of_q, of_u);
    for (i = 0; i < N; i++) {
      to->q[i] = from->q[i] + h*of_q[i];
      to->u[i] = from->u[i] + h*of_u[i];
    }
    to->t = (nodes[stage] == 1.0) ? end : (from->t + nodes[stage]*h);
    $_fmu_changed(to);
    status = $_fmu_solve(to);
    (void)memcpy(k.q[stage], to->u, sizeof k.q[0]);
    (void)memcpy(k.u[stage], to->a, sizeof k.u[0]);
  }
  if (status == %%_OK) {
#if <<REUSES>> == 0
    sum(result, <<RESULTS>>, &k, of_q, of_u);
    for (i = 0; i < N; i++) {
      to->q[i] = from->q[i] + h*of_q[i];
      to->u[i] = from->u[i] + h*of_u[i];
    }
    to->t = end;
    $_fmu_changed(to);
#endif
#if <<THIRDS>> > 0
    {
      double third_q[N];
      double third_u[N];
      double both;
      sum(third_order, <<THIRDS>>, &k, third_q, third_u);
      for (i = 0; i < N; i++) {
        third_q[i] = of_q[i] - third_q[i];
        third_u[i] = of_u[i] - third_u[i];
      }
      both = 0.01*squares(from, to, third_q, third_u);
      sum(error_weights, <<ERRORS>>, &k, of_q, of_u);
      five = squares(from, to, of_q, of_u);
      both += five;
      *error = (both > 0.0) ? (h*five/sqrt(2.0*(double)N*both)) : both;
    }
#else
    sum(error_weights, <<ERRORS>>, &k, of_q, of_u);
    five = squares(from, to, of_q, of_u);
    *error = h*sqrt(five/(2.0*(double)N));
#endif
    status = (isfinite(*error) && (is_finite(to) != 0)) ? $_fmu_solve(to) : NOT_FINITE;
  }
  return status;
}

/* Norm of a change by tolerances, for the first step. */
static double norm(const $_fmu_values *x, const double *of_q, const double *of_u)
{
  return sqrt(squares(x, x, of_q, of_u)/(2.0*(double)N));
}

/* A first step: a hundredth of the time in which the state changes by its own size. */
static double first_step(const $_fmu_values *x)
{
  const double size = norm(x, x->q, x->u);
  const double speed = norm(x, x->u, x->a);
  const double h = ((size > 1e-10) && (speed > 1e-10)) ? (0.01*size/speed) : 1e-6;
  return isfinite(h) ? h : 1e-6;
}

#if (NR > 0)
/* The largest change, as a part of what is changed, or of its nominal value; not finite where one is not. */
static double largest(const double *change, const double *values, const double *nominals)
{
  double most = 0.0;
  int i;
  for (i = 0; (i < N) && isfinite(most); i++) {
    const double part = fabs(change[i])/fmax(nominals[i], fabs(values[i]));
    most = !(part <= most) ? part : most;
  }
  return most;
}

/* Corrections below this are rounding. They are left out, so that a second projection moves nothing. */
#define ROUNDING 1e-13
/* Corrections that stay above this do not converge. */
#define LEFT 1e-9
#define PASSES 12

/* Subtracts a correction that is more than rounding. */
static void correct(double *values, const double *change, double size)
{
  int i;
  for (i = 0; (i < N) && (size > ROUNDING); i++) {
    values[i] -= change[i];
  }
}

int $_fmu_project($_fmu_values *x, double *moved)
{
  double r[NR] = { 0.0 };
  double change[N];
  double q[N];
  double u[N];
  double size = 0.0;
  int status = %%_OK;
  int pass;
  int i;
  (void)memcpy(q, x->q, sizeof q);
  (void)memcpy(u, x->u, sizeof u);
  if (x->has_constants == 0) {
    $_constants(x->p, x->k);
    x->has_constants = 1;
  }
#if %%_HOLONOMIC > 0
  size = 1.0;
  for (pass = 0; (pass < PASSES) && (status == %%_OK) && (size > ROUNDING) && isfinite(size); pass++) {
    $_residual(x->p, x->t, q, u<<MORE>>, r);
    status = $_correction(x->p, x->k, x->t, q, u<<MORE>>, r, change);
    size = largest(change, q, $_fmu_nominals);
    if (status == %%_OK) {
      correct(q, change, size);
    }
  }
  status = ((status == %%_OK) && !(size <= LEFT)) ? OFF : status;
#endif
  /* These are linear: what the second pass changes is rounding. */
  for (pass = 0; (pass < 2) && (status == %%_OK); pass++) {
    $_velocity_residual(x->p, x->t, q, u<<MORE>>, r);
    status = $_correction(x->p, x->k, x->t, q, u<<MORE>>, r, change);
    size = largest(change, u, $_fmu_nominals + N);
    if (status == %%_OK) {
      correct(u, change, size);
    }
  }
  status = ((status == %%_OK) && !(size <= LEFT)) ? OFF : status;
  *moved = 0.0;
  if (status == %%_OK) {
    double of_q[N];
    double of_u[N];
    for (i = 0; i < N; i++) {
      of_q[i] = x->q[i] - q[i];
      of_u[i] = x->u[i] - u[i];
    }
    *moved = fmax(largest(of_q, q, $_fmu_nominals), largest(of_u, u, $_fmu_nominals + N));
    x->inconsistent = 0;
  }
  if (*moved > 0.0) {
    (void)memcpy(x->q, q, sizeof q);
    (void)memcpy(x->u, u, sizeof u);
    $_fmu_changed(x);
  }
  return status;
}
#else
int $_fmu_project($_fmu_values *x, double *moved)
{
  x->inconsistent = 0;
  *moved = 0.0;
  return %%_OK;
}
#endif

#if (NV + NK) > 0
/* Whether a declared event has crossed 0. One that begins at 0 has not: its sign is the first that it has. */
static int has_event(const double *before, const double *after)
{
  int i;
  int found = 0;
  for (i = 0; i < NV; i++) {
    if (((before[i] > 0.0) && (after[i] <= 0.0)) || ((before[i] < 0.0) && (after[i] >= 0.0))) {
      found = 1;
    }
  }
  return found;
}

/* Whether a step has to end earlier: at kinks always, at events where `stops` says so. */
static int crosses(const double *before, const double *after, int stops)
{
  int i;
  int found = (stops != 0) ? has_event(before, after) : 0;
  for (i = NV; i < NV + NK; i++) {
    found = ((before[i] > 0.0) != (after[i] > 0.0)) ? 1 : found;
  }
  return found;
}

/* Crossings are located to this part of a tolerance, in steps. */
#define LOCATED 1e-3
#define MOST_BISECTIONS 60
/* So many steps in a row that end at a crossing after this part of their length go nowhere. */
#define MOST_CROSSINGS 50
#define NOWHERE 1e-4

/* Shortens a step so that it ends just behind the first crossing in it. All ends are on the constraints: a
 * projection behind the search could move the end to before the crossing, which would then be found twice. */
static int locate(const $_fmu_values *from, int stops, double *h, $_fmu_values *to, int *stopped)
{
  double before[NV + NK];
  double after[NV + NK];
  double low = 0.0;
  double high = *h;
  double error;
  double moved = 0.0;
  const double width = fmax(LOCATED*from->tolerance*high, 4.0*DBL_EPSILON*fabs(from->t));
  $_fmu_values start = *from;
  $_fmu_values trial;
  int status = $_fmu_indicators(&start, before);
  int count;
  if (status == %%_OK) {
    status = $_fmu_indicators(to, after);
  }
  if ((status == %%_OK) && (crosses(before, after, stops) != 0)) {
    for (count = 0; (count < MOST_BISECTIONS) && (high - low > width) && (status == %%_OK); count++) {
      const double middle = 0.5*(low + high);
      status = attempt(from, middle, from->t + middle, &trial, &error);
      if (status == %%_OK) {
        status = $_fmu_project(&trial, &moved);
      }
      if (status == %%_OK) {
        status = $_fmu_indicators(&trial, after);
      }
      if ((status == %%_OK) && (crosses(before, after, stops) != 0)) {
        high = middle;
        *to = trial;
      } else {
        low = middle;
      }
    }
    *h = high;
    if (status == %%_OK) {
      status = $_fmu_indicators(to, after);
    }
    if ((status == %%_OK) && (stops != 0)) {
      *stopped = has_event(before, after);
    }
  }
  return status;
}
#endif

int $_fmu_advance($_fmu_values *x, double end, int stops, int *stopped)
{
  $_fmu_values to;
  double error = 0.0;
  double moved = 0.0;
  int rejected = 0;
  int crossings = 0;
  int status = %%_OK;
  *stopped = 0;
  status = $_fmu_solve(x);
  if ((status == %%_OK) && !(x->h > 0.0)) {
    x->h = first_step(x);
    x->previous_error = LEAST_ERROR;
  }
  while ((status == %%_OK) && (x->t < end) && (*stopped == 0)) {
    const double rest = end - x->t;
    /* A last step is stretched rather than followed by a tiny one. */
    const int is_last = (x->h*1.01 >= rest) ? 1 : 0;
    double h = (is_last != 0) ? rest : x->h;
    int failed = attempt(x, h, (is_last != 0) ? end : (x->t + h), &to, &error);
    if ((failed == %%_OK) && (error <= 1.0)) {
      failed = $_fmu_project(&to, &moved);
    }
    if ((failed != %%_OK) || !(error <= 1.0)) {
      const double factor = (failed != %%_OK) ? 0.25 : (SAFETY*pow(error, -ALPHA));
      x->h = h*fmin(1.0, fmax(SHRINK, factor));
      rejected = 1;
      if (x->h <= 16.0*DBL_EPSILON*fabs(x->t)) {
        status = (failed != %%_OK) ? failed : TOO_SHORT;
      }
    } else {
      const double whole = h;
      double next;
      double factor = SAFETY*pow(x->previous_error, BETA)*pow(fmax(error, 1e-300), -ALPHA);
      factor = fmin(GROW, fmax(SHRINK, factor));
      factor = (rejected != 0) ? fmin(1.0, factor) : factor;
      /* A step that ended early says little about the next one. */
      next = (is_last != 0) ? fmax(x->h, h*factor) : (h*factor);
      rejected = 0;
#if (NV + NK) > 0
      status = locate(x, stops, &h, &to, stopped);
      crossings = (h < NOWHERE*whole) ? (crossings + 1) : 0;
      status = ((status == %%_OK) && (crossings >= MOST_CROSSINGS)) ? CHATTERS : status;
#else
      (void)stops;
      (void)crossings;
#endif
      if (status == %%_OK) {
        to.h = (h < whole) ? fmin(next, whole) : next;
        to.previous_error = fmax(error, LEAST_ERROR);
        *x = to;
        status = $_fmu_solve(x);
      }
    }
  }
  return status;
}
