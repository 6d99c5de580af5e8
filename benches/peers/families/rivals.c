/* What a careful programmer writes by hand in C for the systems of `src/models.rs`.
 *
 * The library has them twice: as gcc compiles this file with -O3 -march=native, and with -ffast-math, whose names
 * end in _fast. Fields lie one after the other, as in the models. Ends are held where the models hold them.
 */
#include <math.h>
#include <stddef.h>

#ifdef FAST
#define NAME(name) name##_fast
#else
#define NAME(name) name
#endif

/* A planar string of n free nodes between two pegs: elements add what they find to both of their nodes. */
void NAME(string_scattering)(size_t n, double pitch, double ea, double tension, const double *inverse,
                             const double *restrict q, double *restrict a) {
    const double *s = q, *w = q + n;
    double *x = a, *y = a + n;
    for (size_t i = 0; i < 2 * n; i++) a[i] = 0.0;
    for (size_t e = 0; e < n + 1; e++) {
        double s0 = e == 0 ? 0.0 : s[e - 1], w0 = e == 0 ? 0.0 : w[e - 1];
        double s1 = e == n ? 0.0 : s[e], w1 = e == n ? 0.0 : w[e];
        double dx = pitch + s1 - s0, dy = w1 - w0;
        double length = sqrt(dx * dx + dy * dy);
        double c = (tension + ea * (length / pitch - 1.0)) / length;
        double fx = c * dx, fy = c * dy;
        if (e > 0) {
            x[e - 1] += fx;
            y[e - 1] += fy;
        }
        if (e < n) {
            x[e] -= fx;
            y[e] -= fy;
        }
    }
    for (size_t i = 0; i < 2 * n; i++) a[i] *= inverse[i];
}

static inline void string_element(double pitch, double ea_by_pitch, double slack, double s0, double s1, double w0,
                                  double w1, double *fx, double *fy) {
    double dx = pitch + s1 - s0, dy = w1 - w0;
    double c = ea_by_pitch + slack / sqrt(dx * dx + dy * dy);
    *fx = c * dx;
    *fy = c * dy;
}

/* The same by nodes: every node makes both of its elements. */
void NAME(string_by_nodes)(size_t n, double pitch, double ea, double tension, const double *inverse,
                           const double *restrict q, double *restrict a) {
    const double *s = q, *w = q + n;
    double *x = a, *y = a + n;
    double k = ea / pitch, slack = tension - ea, lx, ly, rx, ry;
    string_element(pitch, k, slack, 0.0, s[0], 0.0, w[0], &lx, &ly);
    string_element(pitch, k, slack, s[0], s[1], w[0], w[1], &rx, &ry);
    x[0] = (rx - lx) * inverse[0];
    y[0] = (ry - ly) * inverse[n];
    for (size_t i = 1; i + 1 < n; i++) {
        string_element(pitch, k, slack, s[i - 1], s[i], w[i - 1], w[i], &lx, &ly);
        string_element(pitch, k, slack, s[i], s[i + 1], w[i], w[i + 1], &rx, &ry);
        x[i] = (rx - lx) * inverse[i];
        y[i] = (ry - ly) * inverse[n + i];
    }
    string_element(pitch, k, slack, s[n - 2], s[n - 1], w[n - 2], w[n - 1], &lx, &ly);
    string_element(pitch, k, slack, s[n - 1], 0.0, w[n - 1], 0.0, &rx, &ry);
    x[n - 1] = (rx - lx) * inverse[n - 1];
    y[n - 1] = (ry - ly) * inverse[2 * n - 1];
}

/* A chain of n masses and n + 1 springs, k d + beta d^3, between two walls: by nodes. */
static inline double spring(double k, double beta, double d) { return d * (k + beta * (d * d)); }
void NAME(chain_by_nodes)(size_t n, double k, double beta, const double *inverse, const double *restrict s,
                          double *restrict a) {
    a[0] = (spring(k, beta, s[1] - s[0]) - spring(k, beta, s[0])) * inverse[0];
    for (size_t i = 1; i + 1 < n; i++)
        a[i] = (spring(k, beta, s[i + 1] - s[i]) - spring(k, beta, s[i] - s[i - 1])) * inverse[i];
    a[n - 1] = (spring(k, beta, -s[n - 1]) - spring(k, beta, s[n - 1] - s[n - 2])) * inverse[n - 1];
}

/* The same, elements adding to both of their nodes. */
void NAME(chain_scattering)(size_t n, double k, double beta, const double *inverse, const double *restrict s,
                            double *restrict a) {
    for (size_t i = 0; i < n; i++) a[i] = 0.0;
    a[0] -= spring(k, beta, s[0]);
    for (size_t e = 1; e < n; e++) {
        double f = spring(k, beta, s[e] - s[e - 1]);
        a[e - 1] += f;
        a[e] -= f;
    }
    a[n - 1] += spring(k, beta, -s[n - 1]);
    for (size_t i = 0; i < n; i++) a[i] *= inverse[i];
}

/* Factors L D L^T of a symmetric tridiagonal matrix: l[i] couples i and i - 1, p[i] is an inverse pivot. */
void NAME(tridiagonal_factor)(size_t n, const double *diagonal, double beside, double *l, double *p) {
    l[0] = 0.0;
    p[0] = 1.0 / diagonal[0];
    for (size_t i = 1; i < n; i++) {
        l[i] = beside * p[i - 1];
        p[i] = 1.0 / (diagonal[i] - l[i] * beside);
    }
}

/* A bar in linear finite elements with consistent mass, held at its left end: forces, then two recursions. */
void NAME(bar_consistent)(size_t n, double stiffness, const double *l, const double *p, const double *restrict s,
                          double *restrict a) {
    a[0] = stiffness * (s[1] - 2.0 * s[0]);
    for (size_t i = 1; i + 1 < n; i++) a[i] = stiffness * (s[i - 1] - 2.0 * s[i] + s[i + 1]);
    a[n - 1] = stiffness * (s[n - 2] - s[n - 1]);
    for (size_t i = 1; i < n; i++) a[i] -= l[i] * a[i - 1];
    a[n - 1] *= p[n - 1];
    for (size_t i = n - 1; i-- > 0;) a[i] = a[i] * p[i] - l[i + 1] * a[i + 1];
}

/* A geometrically exact planar beam of n elements, hinged at its root: places of n nodes, angles of n + 1. Lumped
 * mass. Elements add to both of their nodes. */
void NAME(beam_scattering)(size_t n, double h, double ea, double ga, double ei, const double *inverse,
                           const double *restrict q, double *restrict a) {
    const double *px = q, *py = q + n, *angle = q + 2 * n;
    double *ax = a, *ay = a + n, *at = a + 2 * n;
    for (size_t i = 0; i < 3 * n + 1; i++) a[i] = 0.0;
    for (size_t e = 0; e < n; e++) {
        double x0 = e == 0 ? 0.0 : px[e - 1], y0 = e == 0 ? 0.0 : py[e - 1];
        double dx = (px[e] - x0) / h, dy = (py[e] - y0) / h;
        double middle = 0.5 * (angle[e] + angle[e + 1]), turn = (angle[e + 1] - angle[e]) / h;
        double c = cos(middle), s = sin(middle);
        double along = c * dx + s * dy - 1.0, across = c * dy - s * dx;
        double normal = ea * along, shear = ga * across, moment = ei * turn;
        double fx = c * normal - s * shear, fy = s * normal + c * shear;
        double couple = 0.5 * h * (normal * across - shear * (along + 1.0));
        if (e > 0) {
            ax[e - 1] += fx;
            ay[e - 1] += fy;
        }
        ax[e] -= fx;
        ay[e] -= fy;
        at[e] += moment - couple;
        at[e + 1] -= moment + couple;
    }
    for (size_t i = 0; i < 3 * n + 1; i++) a[i] *= inverse[i];
}

/* A Newton step of an implicit method on the string: mass c_m M + K at a state, factored by blocks of two from one
 * end to the other (block Thomas), and the solution for a right-hand side r, which it replaces. diagonal and beside
 * have three numbers for each node, right two. */
void NAME(string_newton)(size_t n, double pitch, double ea, double tension, const double *mass,
                         const double *restrict q, double *restrict diagonal, double *restrict beside,
                         double *restrict r) {
    const double *s = q, *w = q + n;
    double k = ea / pitch, slack = tension - ea;
    for (size_t i = 0; i < n; i++) {
        diagonal[3 * i] = mass[i];
        diagonal[3 * i + 1] = 0.0;
        diagonal[3 * i + 2] = mass[n + i];
    }
    for (size_t e = 0; e < n + 1; e++) {
        double s0 = e == 0 ? 0.0 : s[e - 1], w0 = e == 0 ? 0.0 : w[e - 1];
        double s1 = e == n ? 0.0 : s[e], w1 = e == n ? 0.0 : w[e];
        double dx = pitch + s1 - s0, dy = w1 - w0;
        double square = dx * dx + dy * dy, inverse = 1.0 / sqrt(square);
        double c = k + slack * inverse, g = -slack * inverse / square;
        double a = c + g * dx * dx, b = g * dx * dy, d = c + g * dy * dy;
        if (e > 0) {
            diagonal[3 * e - 3] += a;
            diagonal[3 * e - 2] += b;
            diagonal[3 * e - 1] += d;
        }
        if (e < n) {
            diagonal[3 * e] += a;
            diagonal[3 * e + 1] += b;
            diagonal[3 * e + 2] += d;
            beside[3 * e] = -a;
            beside[3 * e + 1] = -b;
            beside[3 * e + 2] = -d;
        }
    }
    /* beside[3 e ..] couples nodes e - 1 and e. */
    for (size_t i = 0; i < n; i++) {
        double *D = diagonal + 3 * i, x = r[i], y = r[n + i];
        if (i > 0) {
            const double *E = beside + 3 * i, *I = D - 3;
            double p0 = I[0] * E[0] + I[1] * E[1], p1 = I[0] * E[1] + I[1] * E[2];
            double p2 = I[1] * E[0] + I[2] * E[1], p3 = I[1] * E[1] + I[2] * E[2];
            double u = r[i - 1], v = r[n + i - 1];
            D[0] -= E[0] * p0 + E[1] * p2;
            D[1] -= E[0] * p1 + E[1] * p3;
            D[2] -= E[1] * p1 + E[2] * p3;
            x -= p0 * u + p2 * v;
            y -= p1 * u + p3 * v;
        }
        double t = 1.0 / (D[0] * D[2] - D[1] * D[1]), d0 = D[0];
        D[0] = D[2] * t;
        D[1] = -D[1] * t;
        D[2] = d0 * t;
        r[i] = x;
        r[n + i] = y;
    }
    double x = 0.0, y = 0.0;
    for (size_t i = n; i-- > 0;) {
        double u = r[i], v = r[n + i];
        const double *D = diagonal + 3 * i;
        if (i + 1 < n) {
            const double *E = beside + 3 * i + 3;
            u -= E[0] * x + E[1] * y;
            v -= E[1] * x + E[2] * y;
        }
        x = D[0] * u + D[1] * v;
        y = D[1] * u + D[2] * v;
        r[i] = x;
        r[n + i] = y;
    }
}

/* The memory triad. */
void NAME(triad)(size_t n, double factor, const double *restrict b, const double *restrict c, double *restrict a) {
    for (size_t i = 0; i < n; i++) a[i] = b[i] + factor * c[i];
}
