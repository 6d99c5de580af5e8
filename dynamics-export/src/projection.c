/* Brings positions and velocities back to the constraints, by the smallest step that does it: a few steps of
 * Newton's method. */
static int project(const $_real *k, $_real t, phase *y)
{
  $_real l[%%_ROWS];
  $_real change[N];
  int status = %%_OK;
  int pass;
  int i;
#if %%_HOLONOMIC > 0
  for (pass = 0; (pass < 3) && (status == %%_OK); pass++) {
    for (i = 0; i < %%_ROWS; i++) {
      l[i] = 0.0@;
    }
    $_residual(<<PARAMETERS>>, t, y->q, y->u<<MORE>>, l);
    status = $_correction(<<PARAMETERS>>, k, t, y->q, y->u<<MORE>>, l, change);
    for (i = 0; (i < N) && (status == %%_OK); i++) {
      y->q[i] -= change[i];
    }
  }
#endif
  for (pass = 0; (pass < 2) && (status == %%_OK); pass++) {
    $_velocity_residual(<<PARAMETERS>>, t, y->q, y->u<<MORE>>, l);
    status = $_correction(<<PARAMETERS>>, k, t, y->q, y->u<<MORE>>, l, change);
    for (i = 0; (i < N) && (status == %%_OK); i++) {
      y->u[i] -= change[i];
    }
  }
  return status;
}

