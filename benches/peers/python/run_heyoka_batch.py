"""heyoka: eight double pendulums at once, from the starts that the benchmark `ensembles` has written.

The equations are Hamilton's, which take heyoka a fifth less time than M q'' = f. Prints lines as the benchmark
does: tolerance, time per run, median and 90 % of the errors. Compilation is not counted.
"""

import sys
import time

import heyoka as hy
import numpy as np

LANES, UNTIL, G = 8, 10.0, 9.81

table = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
starts, exact = table[:, :2], table[:, 2:]

t1, t2, p1, p2 = hy.make_vars("t1", "t2", "p1", "p2")
c, s = hy.cos(t1 - t2), hy.sin(t1 - t2)
w1, w2 = (p1 - c * p2) / (2.0 - c * c), (2.0 * p2 - c * p1) / (2.0 - c * c)
torque = s * w1 * w2
equations = [
    (t1, w1),
    (t2, w2),
    (p1, -torque - 2.0 * G * hy.sin(t1)),
    (p2, torque - G * hy.sin(t2)),
]

print(f"heyoka, batches of {LANES}, {len(starts)} runs")
print(f"{'tolerance':>9}  {'µs per run':>14}{'error':>10}{'90 %':>10}")
for tolerance in [1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13]:
    solver = hy.taylor_adaptive_batch(equations, np.zeros((4, LANES)), tol=tolerance)
    least = np.inf
    for _ in range(5):
        ends, taken = np.empty((len(starts), 2)), 0.0
        for k in range(0, len(starts), LANES):
            solver.set_time(0.0)
            solver.state[:2] = starts[k : k + LANES].T
            solver.state[2:] = 0.0
            begun = time.perf_counter()
            solver.propagate_until(UNTIL)
            taken += time.perf_counter() - begun
            ends[k : k + LANES] = solver.state[:2].T
        least = min(least, taken)
    errors = np.sort(np.abs(ends - exact).max(axis=1))
    median, most = errors[len(errors) // 2], errors[len(errors) * 9 // 10]
    print(f"{tolerance:>9.0e}  {1e6 * least / len(starts):>14.2f}{median:>10.1e}{most:>10.1e}", flush=True)
