/* A status of this example: off the constraints. */
#define OFF 4

/* Largest correction that may be left, as a part of 1 or of what is corrected. */
static const $_real left_over = <<LEFT>>;

/* Whether corrections are small; not where they are no numbers. */
static int is_small(const $_real *change, const $_real *values)
{
  int small = 1;
  int i;
  for (i = 0; i < N; i++) {
    const $_real size = (values[i] < 0.0@) ? -values[i] : values[i];
    const $_real bound = left_over*((size > 1.0@) ? size : 1.0@);
    small = ((change[i] <= bound) && (change[i] >= -bound)) ? small : 0;
  }
  return small;
}

/* Brings positions and velocities back to the constraints, by the smallest step that does it: a few steps of
 * Newton's method. A last one is computed alone, to see that it would change nothing. */
static int project(const $_real *k, $_real t, phase *y)
{
  $_real l[%%_ROWS];
  $_real change[N];
  int status = %%_OK;
  int pass;
  int i;
#if %%_HOLONOMIC > 0
  for (pass = 0; (pass < 4) && (status == %%_OK); pass++) {
    for (i = 0; i < %%_ROWS; i++) {
      l[i] = 0.0@;
    }
    $_residual(<<PARAMETERS>>, t, y->q, y->u<<MORE>>, l);
    status = $_correction(<<PARAMETERS>>, k, t, y->q, y->u<<MORE>>, l, change);
    for (i = 0; (i < N) && (status == %%_OK) && (pass < 3); i++) {
      y->q[i] -= change[i];
    }
    if ((status == %%_OK) && (pass == 3) && !is_small(change, y->q)) {
      status = OFF;
    }
  }
#endif
  for (pass = 0; (pass < 3) && (status == %%_OK); pass++) {
    $_velocity_residual(<<PARAMETERS>>, t, y->q, y->u<<MORE>>, l);
    status = $_correction(<<PARAMETERS>>, k, t, y->q, y->u<<MORE>>, l, change);
    for (i = 0; (i < N) && (status == %%_OK) && (pass < 2); i++) {
      y->u[i] -= change[i];
    }
    if ((status == %%_OK) && (pass == 2) && !is_small(change, y->u)) {
      status = OFF;
    }
  }
  return status;
}

