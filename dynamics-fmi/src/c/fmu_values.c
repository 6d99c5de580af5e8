/* <<BANNER>> */
/* Values of the variables of an instance. */
#include "$_fmu.h"

/* The check that value references are those of modelDescription.xml. */
typedef char references_agree[(VR_END == <<REFERENCES>>) ? 1 : -1];

const char *const $_fmu_names[VR_END] = {
<<NAMES>>
};

const double $_fmu_nominals[2*N] = {
<<NOMINALS>>
};

static const double start_q[N] = {
<<Q>>
};
static const double start_u[N] = {
<<U>>
};
#if NP > 0
static const double start_p[NP] = {
<<P>>
};
#endif
#if NW > 0
static const double start_w[NW] = {
<<W>>
};
#endif
<<MODES>>
void $_fmu_reset($_fmu_values *x)
{
  const int is_model_exchange = x->is_model_exchange;
  (void)memset(x, 0, sizeof *x);
  x->is_model_exchange = is_model_exchange;
  x->mode = INSTANTIATED;
  x->t = START_TIME;
  x->tolerance = TOLERANCE;
  (void)memcpy(x->q, start_q, sizeof start_q);
  (void)memcpy(x->u, start_u, sizeof start_u);
#if NP > 0
  (void)memcpy(x->p, start_p, sizeof start_p);
#endif
#if NW > 0
  (void)memcpy(x->w, start_w, sizeof start_w);
#endif
}

void $_fmu_changed($_fmu_values *x)
{
  x->known = 0;
}

const char *$_fmu_words(int status)
{
  const char *words = "the equations have no solution at this state";
  if (status == NOT_FINITE) {
    words = "the accelerations are not finite at this state";
  } else if (status == OFF) {
    words = "no projection leads from this state to the constraints";
  } else if (status == TOO_SHORT) {
    words = "the steps become too short: the motion is too fast, or ends here";
  } else if (status == CHATTERS) {
    words = "accelerations that jump hold the motion at a place where they do: make the force smooth there";
  } else if (status == <<GUARDED>>) {
    words = "the order in which the constraints are eliminated does not apply at this state";
  } else if (status == <<SINGULAR>>) {
    words = "the mass matrix is singular, or not positive, at this state";
  } else {
    words = "the equations have no solution at this state";
  }
  return words;
}

int $_fmu_solve($_fmu_values *x)
{
  int status = %%_OK;
  int i;
  if (x->has_constants == 0) {
    $_constants(x->p, x->k);
    x->has_constants = 1;
    x->known = 0;
  }
  if ((x->known & SOLVED) == 0) {
    status = $_accelerations(x->p, x->k, x->t, x->q, x->u<<MORE>>, x->a<<REACTIONS>>);
    for (i = 0; i < N; i++) {
      if ((status == %%_OK) && !isfinite(x->a[i])) {
        status = NOT_FINITE;
      }
    }
    if (status == %%_OK) {
      x->known |= SOLVED;
    }
  }
  return status;
}

int $_fmu_results($_fmu_values *x, int wanted)
{
  const int missing = wanted & ~x->known;
  int status = %%_OK;
  if ((missing & ENERGIES) != 0) {
    $_energies(x->p, x->t, x->q, x->u<<MORE>>, x->energies);
  }
#if NO > 0
  if ((missing & OUTPUTS) != 0) {
    status = <<FIRST>>;
    if (status == %%_OK) {
      status = $_outputs(x->p, x->t, x->q, x->u<<MORE>><<SOLUTION>>, x->outputs);
    }
  }
#endif
#if NV > 0
  if (((missing & EVENTS) != 0) && (status == %%_OK)) {
    status = <<FIRST>>;
    if (status == %%_OK) {
      status = $_events(x->p, x->t, x->q, x->u<<MORE>><<SOLUTION>>, x->events);
    }
  }
#endif
#if NK > 0
  if ((missing & KINKS) != 0) {
    $_kinks(x->p, x->t, x->q, x->u<<MORE>>, x->kinks);
<<PIECES>>  }
#endif
  if (status == %%_OK) {
    x->known |= wanted;
  }
  return status;
}

int $_fmu_value($_fmu_values *x, fmi3ValueReference reference, double *value)
{
  const int vr = (reference < (fmi3ValueReference)VR_END) ? (int)reference : VR_TIME;
  int status = %%_OK;
  if (vr >= VR_KINKS) {
    status = $_fmu_results(x, KINKS);
    *value = x->kinks[vr - VR_KINKS];
  } else if (vr >= VR_EVENTS) {
    status = $_fmu_results(x, EVENTS);
    *value = x->events[vr - VR_EVENTS];
  } else if (vr >= VR_OUTPUTS) {
    status = $_fmu_results(x, OUTPUTS);
    *value = x->outputs[vr - VR_OUTPUTS];
  } else if (vr >= VR_ENERGIES) {
    status = $_fmu_results(x, ENERGIES);
    *value = x->energies[vr - VR_ENERGIES];
  } else if (vr >= VR_MULTIPLIERS) {
    status = $_fmu_solve(x);
    *value = x->l[vr - VR_MULTIPLIERS];
  } else if (vr >= VR_INPUTS) {
    *value = x->w[vr - VR_INPUTS];
  } else if (vr >= VR_PARAMETERS) {
    *value = x->p[vr - VR_PARAMETERS];
  } else if (vr >= VR_RATE_OF_U) {
    status = $_fmu_solve(x);
    *value = x->a[vr - VR_RATE_OF_U];
  } else if (vr >= VR_RATE_OF_Q) {
    *value = x->u[vr - VR_RATE_OF_Q];
  } else if (vr >= VR_U) {
    *value = x->u[vr - VR_U];
  } else if (vr >= VR_Q) {
    *value = x->q[vr - VR_Q];
  } else {
    *value = x->t;
  }
  return status;
}

int $_fmu_indicators($_fmu_values *x, double *z)
{
  int status = $_fmu_results(x, EVENTS | KINKS);
  (void)z;
#if NV > 0
  (void)memcpy(z, x->events, sizeof x->events);
#endif
#if NK > 0
  (void)memcpy(z + NV, x->kinks, sizeof x->kinks);
#endif
  return status;
}

int $_fmu_directional($_fmu_values *x, const $_fmu_direction *d, double *out)
{
#if %%_DIRECTIONAL > 0
  const int status = $_fmu_solve(x);
  if (status == %%_OK) {
    $_directional(x->p, x->t, x->q, x->u<<MORE>><<SOLUTION>>, d->dt, d->dq, d->du<<DW>>, d->dp, out);
<<SLOPES>>  }
  return status;
#else
  (void)x;
  (void)d;
  (void)out;
  return NOT_FINITE;
#endif
}
