"""The problems of `examples/work_precision.rs` for solvers that do not derive them.

Right-hand sides, starts, ends. Names, coordinates and their order are those of the models in `tests/models`,
so that the ends can be compared number by number.
"""

import math

G = 9.81

# Andrews' squeezing mechanism (Test Set for IVP Solvers).
M = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498]
I = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5]
XA, YA, XB, YB, XC, YC = -0.06934, -0.00227, -0.03635, 0.03273, 0.014, 0.072
C0, L0, MOMENT = 4530.0, 7785e-5, 33e-3
D, DA, E, EA, RR, RA, SS = 28e-3, 115e-4, 2e-2, 1421e-5, 7e-3, 92e-5, 35e-3
SA, SB, SC, SD, TA, TB = 1874e-5, 1043e-5, 18e-3, 2e-2, 2308e-5, 916e-5
U, UA, UB, ZF, ZT, FA = 4e-2, 1228e-5, 449e-5, 2e-2, 4e-2, 1421e-5
ANDREWS_START = [
    -0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885,
    0.487364979543842550, -0.222668390165885885, 1.230547444549821192,
]

# name: (number of coordinates, start of q and u, end)
PROBLEMS = {
    "double pendulum": (2, [1.5, 1.0, 0.0, 0.0], 10.0),
    "Kepler e = 0.9": (2, [0.1, 0.0, 0.0, math.sqrt(19.0)], 20.0),
    "stiff spring pendulum": (2, [1.0, 0.0, 0.0, 0.0], 10.0),
    "Andrews": (7, ANDREWS_START + [0.0] * 7, 0.03),
}


def accelerations(name, q, u, lib):
    """The accelerations of a problem without constraints, with the sin, cos and sqrt of `lib`."""
    if name == "double pendulum":
        a, b = q
        s, c = lib.sin(a - b), lib.cos(a - b)
        f1 = -1.04 * s * u[1] * u[1] - 2.3 * G * lib.sin(a)
        f2 = 1.04 * s * u[0] * u[0] - 1.04 * G * lib.sin(b)
        m = 1.04 * c
        inverse = 1.0 / (2.3 * 0.832 - m * m)
        return [(0.832 * f1 - m * f2) * inverse, (2.3 * f2 - m * f1) * inverse]
    x, y = q
    if name == "Kepler e = 0.9":
        cube = (x * x + y * y) ** (-1.5)
        return [-x * cube, -y * cube]
    if name == "stiff spring pendulum":
        r = lib.sqrt(x * x + y * y)
        pull = -(1e8 * (r - 1.0) + 2e4 * ((x * u[0] + y * u[1]) / r)) / r
        return [pull * x, pull * y - G]
    raise KeyError(name)


def andrews(q, u, lib):
    """T, V and the constraints of Andrews' mechanism, the mass matrix as published."""
    beta, theta, gamma, phi, delta, omega, epsilon = q
    sin, cos = lib.sin, lib.cos
    zf, ee = ZF - FA, E - EA
    m = {
        (0, 0): M[0] * RA**2 + M[1] * (RR**2 - 2 * DA * RR * cos(theta) + DA**2) + I[0] + I[1],
        (1, 0): M[1] * (DA**2 - DA * RR * cos(theta)) + I[1],
        (1, 1): M[1] * DA**2 + I[1],
        (2, 2): M[2] * (SA**2 + SB**2) + I[2],
        (3, 3): M[3] * ee**2 + I[3],
        (4, 3): M[3] * (ee**2 + ZT * ee * sin(phi)) + I[3],
        (4, 4): M[3] * (ZT**2 + 2 * ZT * ee * sin(phi) + ee**2) + M[4] * (TA**2 + TB**2) + I[3] + I[4],
        (5, 5): M[5] * zf**2 + I[5],
        (6, 5): M[5] * (zf**2 - U * zf * sin(omega)) + I[5],
        (6, 6): M[5] * (zf**2 - 2 * U * zf * sin(omega) + U**2) + M[6] * (UA**2 + UB**2) + I[5] + I[6],
    }
    kinetic = sum((0.5 if i == j else 1.0) * term * u[i] * u[j] for (i, j), term in m.items())
    xd = SD * cos(gamma) + SC * sin(gamma) + XB
    yd = SD * sin(gamma) - SC * cos(gamma) + YB
    length = lib.sqrt((xd - XC) ** 2 + (yd - YC) ** 2)
    potential = 0.5 * C0 * (length - L0) ** 2 - MOMENT * beta
    x = RR * cos(beta) - D * cos(beta + theta)
    y = RR * sin(beta) - D * sin(beta + theta)
    constraints = [
        x - SS * sin(gamma) - XB, y + SS * cos(gamma) - YB,
        x - E * sin(phi + delta) - ZT * cos(delta) - XA, y + E * cos(phi + delta) - ZT * sin(delta) - YA,
        x - ZF * cos(omega + epsilon) - U * sin(epsilon) - XA,
        y - ZF * sin(omega + epsilon) + U * cos(epsilon) - YA,
    ]
    return kinetic, potential, constraints


def eliminated(matrix, right):
    """The solution of a symmetric system by LDLᵀ, on symbols."""
    n = len(right)
    lower, pivots = [[None] * n for _ in range(n)], [None] * n
    for j in range(n):
        pivots[j] = matrix[j][j]
        for k in range(j):
            pivots[j] = pivots[j] - lower[j][k] * lower[j][k] * pivots[k]
        for i in range(j + 1, n):
            entry = matrix[i][j]
            for k in range(j):
                entry = entry - lower[i][k] * lower[j][k] * pivots[k]
            lower[i][j] = entry / pivots[j]
    x = list(right)
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - lower[i][k] * x[k]
    x = [entry / pivot for entry, pivot in zip(x, pivots)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - lower[k][i] * x[k]
    return x
