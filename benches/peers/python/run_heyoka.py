"""heyoka: Taylor series of adaptive order, compiled when it runs. The compilation is not counted."""

import heyoka as hy

from measure import TOLERANCES, measure
from problems import PROBLEMS, accelerations, andrews, eliminated


def system(name):
    n, start, _ = PROBLEMS[name]
    q = list(hy.make_vars(*[f"q{i}" for i in range(n)]))
    u = list(hy.make_vars(*[f"u{i}" for i in range(n)]))
    a = accelerations_of_andrews(q, u) if name == "Andrews" else accelerations(name, q, u, hy)
    return list(zip(q, u)) + list(zip(u, a)), start


def accelerations_of_andrews(q, u):
    kinetic, potential, constraints = andrews(q, u, hy)
    n, rows = len(q), len(constraints)
    momenta = [hy.diff(kinetic, x) for x in u]
    mass = [[hy.diff(p, x) for x in u] for p in momenta]
    total = lambda f: hy.sum([hy.diff(f, x) * v for x, v in zip(q, u)])
    force = [hy.diff(kinetic - potential, x) - total(p) for x, p in zip(q, momenta)]
    jacobian = [[hy.diff(phi, x) for x in q] for phi in constraints]
    gamma = [-total(hy.sum([entry * v for entry, v in zip(row, u)])) for row in jacobian]
    zero = hy.expression(0.0)

    def entry(i, j):
        if i < n and j < n:
            return mass[i][j]
        if i >= n and j >= n:
            return zero
        return jacobian[max(i, j) - n][min(i, j)]

    size = n + rows
    return eliminated([[entry(i, j) for j in range(size)] for i in range(size)], force + gamma)[:n]


for name, (_, _, end) in PROBLEMS.items():
    equations, start = system(name)
    for tolerance in TOLERANCES + [1e-15]:
        # Machine precision is the least that it takes.
        solver = hy.taylor_adaptive(equations, start, tol=max(tolerance, 2.3e-16), compact_mode=False)

        def run():
            solver.time = 0.0
            solver.state[:] = start
            solver.propagate_until(end)
            return None, solver.state.copy()

        measure(name, "heyoka (Taylor)", tolerance, run)
