/* Moves the model by the classical Runge-Kutta method with a fixed step and prints its trajectory: in each
 * line the time, the coordinates and their rates. */
#include "$.h"

#include <stddef.h>
#include <stdio.h>

#define N %%_COORDINATES

static const $_real step_size = <<STEP>>;
static const long steps = <<STEPS>>L;
/* Steps between two lines. */
static const long every = <<EVERY>>L;

<<ARRAYS>>
/* Coordinates and their rates, or the derivatives of both. */
typedef struct {
  $_real q[N];
  $_real u[N];
} phase;

static int derivative(const $_real *k, $_real t, const phase *y, phase *slope)
{
<<MULTIPLIERS>>  int i;
  for (i = 0; i < N; i++) {
    slope->q[i] = y->u[i];
  }
  return $_accelerations(<<PARAMETERS>>, k, t, y->q, y->u<<MORE>>, slope->u<<REACTIONS>>);
}

/* y + h (weighted sum of slopes). */
static void advance(const phase *y, $_real h, const $_real *weights, const phase *slopes,
  int count, phase *end)
{
  int i;
  int j;
  for (i = 0; i < N; i++) {
    $_real of_q = 0.0@;
    $_real of_u = 0.0@;
    for (j = 0; j < count; j++) {
      of_q += weights[j]*slopes[j].q[i];
      of_u += weights[j]*slopes[j].u[i];
    }
    end->q[i] = y->q[i] + h*of_q;
    end->u[i] = y->u[i] + h*of_u;
  }
}

/* One step from t. */
static int step(const $_real *k, $_real t, phase *y)
{
  static const $_real half[1] = { 0.5@ };
  static const $_real whole[1] = { 1.0@ };
  static const $_real ends[4] = { 1.0@/6.0@, 1.0@/3.0@, 1.0@/3.0@, 1.0@/6.0@ };
  const $_real h = step_size;
  phase slopes[4];
  phase at;
  int status = derivative(k, t, y, &slopes[0]);
  if (status == %%_OK) {
    advance(y, h, half, &slopes[0], 1, &at);
    status = derivative(k, t + 0.5@*h, &at, &slopes[1]);
  }
  if (status == %%_OK) {
    advance(y, h, half, &slopes[1], 1, &at);
    status = derivative(k, t + 0.5@*h, &at, &slopes[2]);
  }
  if (status == %%_OK) {
    advance(y, h, whole, &slopes[2], 1, &at);
    status = derivative(k, t + 1.0@*h, &at, &slopes[3]);
  }
  if (status == %%_OK) {
    at = *y;
    advance(&at, h, ends, slopes, 4, y);
  }
  return status;
}

<<PROJECTION>>static void print($_real t, const phase *y)
{
  int i;
  (void)printf("%.<<DIGITS>>g", (double)t);
  for (i = 0; i < N; i++) {
    (void)printf(" %.<<DIGITS>>g", (double)y->q[i]);
  }
  for (i = 0; i < N; i++) {
    (void)printf(" %.<<DIGITS>>g", (double)y->u[i]);
  }
  (void)printf("\n");
}

int main(void)
{
  $_real k[<<CONSTANTS>>] = { 0.0@ };
  $_real t = <<TIME>>;
  phase y;
  long number;
  int i;
  int status = %%_OK;
  for (i = 0; i < N; i++) {
    y.q[i] = start_q[i];
    y.u[i] = start_u[i];
  }
  $_constants(<<PARAMETERS>>, k);
  print(t, &y);
  for (number = 1; (number <= steps) && (status == %%_OK); number++) {
    status = step(k, t, &y);
    t = t + step_size;
<<PROJECT>>    if ((status == %%_OK) && (((number % every) == 0) || (number == steps))) {
      print(t, &y);
    }
  }
  if (status != %%_OK) {
    (void)fprintf(stderr, "status %d at t = %g: the header says what that is\n", status, (double)t);
  }
  return status;
}
