/* sin x; cos x goes to `cosine`. With %%_LIBRARY_SINES defined they have the bits of Rust, where
 * multiplications and additions are not fused (-ffp-contract=off) and doubles are computed as such. */
#ifdef %%_LIBRARY_SINES
#include <float.h>
#if defined(__FAST_MATH__) || FLT_EVAL_METHOD != 0 || DBL_MANT_DIG != 53
#error "these sines need doubles that are computed as such: compile without -ffast-math and -mfpmath=387"
#endif
static real $_sin_cos(real x, real *cosine)
{
  real sine;
  if (!((x >= -1048576.0) && (x <= 1048576.0))) {
    *cosine = cos(x);
    sine = sin(x);
  } else {
    /* k = round(2x/pi); 1.5*2^52 leaves the nearest integer. Then x = k pi/2 + r - c. */
    const double k = x*0.6366197723675814 + 6755399441055744.0 - 6755399441055744.0;
    const double first = x - k*1.5707963267341256;
    const double w = k*6.077100506303966e-11;
    const double second = first - w;
    const double rest = k*2.0222662487959506e-21 - ((first - second) - w);
    const double r = second - rest;
    const double c = rest - (second - r);
    const double z = r*r;
    const double v = z*r;
    const double zz = z*z;
    /* sin(r - c) */
    const double of_c = c*(z*-0.5 + 1.0);
    const double of_sine = zz*(zz*1.58969099521155e-10 + (z*-2.5050760253406863e-8 + 2.7557313707070068e-6))
      + (z*-0.0001984126982985795 + 0.00833333333332249);
    const double s = r - ((of_c - z*v*of_sine) - v*-0.16666666666666632);
    /* cos(r - c) */
    const double half = 0.5*r;
    const double less = 1.0 - half*r;
    const double added = half*r + (less - 1.0);
    const double of_cosine = zz*(zz*(z*-1.1359647557788195e-11 + 2.087572321298175e-9)
      + (z*-2.7557314351390663e-7 + 2.480158728947673e-5)) + (z*-0.001388888888887411 + 0.0416666666666666);
    const double e = less - ((added - r*c) - zz*of_cosine);
    const long quarter = (long)k & 3L;
    const double swapped = ((quarter & 1L) != 0L) ? e : s;
    const double other = ((quarter & 1L) != 0L) ? s : e;
    sine = ((quarter & 2L) != 0L) ? -swapped : swapped;
    *cosine = ((quarter == 1L) || (quarter == 2L)) ? -other : other;
  }
  return sine;
}
#else
static real $_sin_cos(real x, real *cosine)
{
  *cosine = cos@(x);
  return sin@(x);
}
#endif
