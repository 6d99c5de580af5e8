"""SciPy's `solve_ivp`, with right-hand sides that numba compiles."""

import math
import warnings

import numba
import numpy as np
from scipy.integrate import solve_ivp

from measure import TOLERANCES, measure
from problems import G, PROBLEMS

warnings.simplefilter("ignore")


@numba.njit
def double_pendulum(t, y):
    s, c = math.sin(y[0] - y[1]), math.cos(y[0] - y[1])
    f1 = -1.04 * s * y[3] * y[3] - 2.3 * G * math.sin(y[0])
    f2 = 1.04 * s * y[2] * y[2] - 1.04 * G * math.sin(y[1])
    m = 1.04 * c
    inverse = 1.0 / (2.3 * 0.832 - m * m)
    return np.array([y[2], y[3], (0.832 * f1 - m * f2) * inverse, (2.3 * f2 - m * f1) * inverse])


@numba.njit
def kepler(t, y):
    square = y[0] * y[0] + y[1] * y[1]
    cube = 1.0 / (square * math.sqrt(square))
    return np.array([y[2], y[3], -y[0] * cube, -y[1] * cube])


@numba.njit
def spring(t, y):
    r = math.sqrt(y[0] * y[0] + y[1] * y[1])
    pull = -(1e8 * (r - 1.0) + 2e4 * (y[0] * y[2] + y[1] * y[3]) / r) / r
    return np.array([y[2], y[3], pull * y[0], pull * y[1] - G])


for name, right, methods in [
    ("double pendulum", double_pendulum, ["DOP853", "LSODA"]),
    ("Kepler e = 0.9", kepler, ["DOP853", "LSODA"]),
    ("stiff spring pendulum", spring, ["Radau", "BDF", "LSODA"]),
]:
    _, start, end = PROBLEMS[name]
    right(0.0, np.array(start))
    for method in methods:
        for tolerance in TOLERANCES[:-1]:
            # Implicit methods in Python take minutes below this.
            if name == "stiff spring pendulum" and tolerance < 1e-7:
                continue

            def run():
                relative = max(tolerance, 2.3e-14)
                result = solve_ivp(right, (0.0, end), start, method=method, rtol=relative, atol=tolerance)
                if not result.success:
                    raise ArithmeticError(result.message)
                return int(result.nfev), result.y[:, -1]

            measure(name, f"SciPy {method}", tolerance, run, seconds=0.2)
