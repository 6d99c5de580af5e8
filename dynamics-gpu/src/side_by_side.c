/* A run side by side with others: attempts at steps of Verner's method of order 9(8) until it ends, pauses or
 * needs another method. Each has its own step. With PLUS as a product and a sum, every number has the bits of
 * the lanes of the processor. */
#ifndef PLUS
#define PLUS(a, b, c) ((a)*(b) + (c))
#endif

/* The larger and the smaller of two; b where one is no number. */
#define MOST(a, b) (((b) < (a)) ? (a) : (b))
#define LEAST(a, b) (((a) < (b)) ? (a) : (b))

#define ENDED 1
#define UNUSUAL 2
#define PAUSED 4

<<SIZES>>
/* Accelerations; not a number where there are none. */
static void slope(const double *p, const double *k, double t, const double *q, const double *u,
  const double *w, double *a)
{
  int i;
  (void)w;
  if (<<CALL>> != %%_OK) {
    for (i = 0; i < N; i++) {
      a[i] = (double)NAN;
    }
  }
}

/* The sum of the squares of the differences. */
static double square_distance(const double *x, const double *y)
{
  double sum = 0.0;
  int i;
  for (i = 0; i < N; i++) {
    const double difference = x[i] - y[i];
    sum = PLUS(difference, difference, sum);
  }
  return sum;
}

/* A part of a sum of slopes, of the coordinates and of the rates. */
static void add(double weight, const double *q, const double *u, double *of_q, double *of_u)
{
  int i;
  for (i = 0; i < N; i++) {
    of_q[i] = PLUS(weight, q[i], of_q[i]);
    of_u[i] = PLUS(weight, u[i], of_u[i]);
  }
}

/* No part of a sum. */
static void clear(double *of_q, double *of_u)
{
  int i;
  for (i = 0; i < N; i++) {
    of_q[i] = 0.0;
    of_u[i] = 0.0;
  }
}

/* y + h times a sum of slopes. */
static void move(double h, const double *of_q, const double *of_u, const double *q, const double *u,
  double *to_q, double *to_u)
{
  int i;
  for (i = 0; i < N; i++) {
    to_q[i] = PLUS(h, of_q[i], q[i]);
    to_u[i] = PLUS(h, of_u[i], u[i]);
  }
}

/* The slopes at a stage. */
static void stage(const double *p, const double *k, double t, const double *q, const double *u,
  const double *w, double *slope_q, double *slope_u)
{
  int i;
  slope(p, k, t, q, u, w, slope_u);
  for (i = 0; i < N; i++) {
    slope_q[i] = u[i];
  }
}

/* Adds the square of the error of a coordinate or rate, in permitted errors, and its size. */
static void measure(double absolute, double relative, double error, double from, double to, double *squares,
  double *size)
{
  const double largest = MOST(fabs(from), fabs(to));
  const double part = error/(absolute + relative*largest);
  *squares = *squares + part*part;
  *size = *size + largest;
}

/* Moves the run of a number by so many attempts at most. Element e of a run r is number e*runs + r of an
 * array. Returns what became of the run, 0 where it goes on. */
<<HEAD>>
{
  const double *const values = given + run;
  double *const place = moving + run;
  double p[P + 1];
  double w[W + 1];
  double k[<<CONSTANTS>> + 1];
  double q[N], u[N], from_q[N], from_u[N], at_q[N], at_u[N], of_q[N], of_u[N];
  double before_q[N], before_u[N];
  double t = place[0];
  double from_t = place[(1 + 2*N)*runs];
  const double end = values[(P + W)*runs];
  const double most = values[(P + W + 1)*runs];
  const double absolute = values[(P + W + 2)*runs];
  const double relative = values[(P + W + 3)*runs];
  double *const control = place + 2*(1 + 2*N)*runs;
  double next_h = control[0];
  double left = control[runs];
  double rejections = control[2*runs];
  double beyond_stability = control[3*runs];
  int outcome = 0;
  int made = 0;
  int i;
  for (i = 0; i < P; i++) {
    p[i] = values[i*runs];
  }
  for (i = 0; i < W; i++) {
    w[i] = values[(P + i)*runs];
  }
  for (i = 0; i < N; i++) {
    q[i] = place[(1 + i)*runs];
    u[i] = place[(1 + N + i)*runs];
    from_q[i] = place[(2 + 2*N + i)*runs];
    from_u[i] = place[(2 + 3*N + i)*runs];
  }
  <<NAME>>_constants(p, k);
  for (made = 0; (made < attempts) && (outcome == 0); made++) {
    /* The step. The last one may be a little longer, to meet the end. */
    const double way = end - t;
    const double proposed = LEAST(fabs(next_h), most);
    const int is_last = fabs(way) <= proposed*<<STRETCHED>>;
    const double end_t = is_last ? end : (t + ((way < 0.0) ? -proposed : proposed));
    const double h = end_t - t;
    double squares = 0.0;
    double size = 0.0;
<<STAGES>>
    /* The end, and the square of the error. */
    {
      double error_q[N], error_u[N], none_q[N], none_u[N];
      double squared, root, factor, next, new_h;
      int has_value, is_accepted, is_stiff, is_unresolved;
      double of_rates, of_coordinates, of_slopes;
      clear(none_q, none_u);
<<ERRORS>>
      move(h, of_q, of_u, none_q, none_u, error_q, error_u);
<<ENDS>>
      move(h, of_q, of_u, q, u, of_q, of_u);
      for (i = 0; i < N; i++) {
        measure(absolute, relative, error_q[i], q[i], of_q[i], &squares, &size);
      }
      for (i = 0; i < N; i++) {
        measure(absolute, relative, error_u[i], u[i], of_u[i], &squares, &size);
      }
      squared = squares*<<SHARE>>;
      has_value = (squared < (double)INFINITY) && (size < (double)INFINITY);
      is_accepted = has_value && (squared <= 1.0);
      /* The next step. */
      root = sqrt(sqrt(sqrt(sqrt(squared))));
      factor = <<SAFETY>>/root;
      factor = MOST(factor, <<SHRINK>>);
      factor = LEAST(factor, <<GROW>>);
      if (!(is_accepted && (rejections <= 0.0))) {
        factor = LEAST(factor, 1.0);
      }
      next = fabs(h)*(has_value ? factor : <<FAILED>>);
      new_h = (is_accepted && (fabs(h) < <<CUT>>*proposed)) ? MOST(next, proposed) : next;
      /* What has happened. */
      of_rates = square_distance(before_u, at_u);
      of_coordinates = square_distance(before_q, at_q);
      of_slopes = square_distance(ku<<BEFORE>>, ku<<LAST>>);
      is_stiff = (<<BORDER_2>>*of_rates < h*h*of_slopes)
        && (<<BORDER_4>>*of_coordinates < h*h*(h*h)*of_slopes);
      if (is_accepted) {
        const double more = beyond_stability + (is_stiff ? 1.0 : -1.0);
        beyond_stability = MOST(more, 0.0);
      }
      rejections = is_accepted ? 0.0 : (rejections + 1.0);
      left = left - 1.0;
      is_unresolved = new_h <= <<RESOLVED>>*(fabs(t) + fabs(end));
      outcome = (is_accepted && is_last) ? ENDED : 0;
      if ((!is_last && (is_unresolved || (fabs(h) <= 0.0))) || (<<REJECTIONS>> < rejections)
        || (<<STIFF>> <= beyond_stability)) {
        outcome |= UNUSUAL;
      }
      if (left <= 0.0) {
        outcome |= PAUSED;
      }
      next_h = new_h;
      if (is_accepted) {
        from_t = t;
        t = end_t;
        for (i = 0; i < N; i++) {
          from_q[i] = q[i];
          from_u[i] = u[i];
          q[i] = of_q[i];
          u[i] = of_u[i];
        }
      }
    }
  }
  place[0] = t;
  place[(1 + 2*N)*runs] = from_t;
  for (i = 0; i < N; i++) {
    place[(1 + i)*runs] = q[i];
    place[(1 + N + i)*runs] = u[i];
    place[(2 + 2*N + i)*runs] = from_q[i];
    place[(2 + 3*N + i)*runs] = from_u[i];
  }
  control[0] = next_h;
  control[runs] = left;
  control[2*runs] = rejections;
  control[3*runs] = beyond_stability;
  return outcome;
}
