"""The double pendulum of SymPy's mechanics beside that of `mechanisms`: accelerations, and their time.

The page docs/guide/from-sympy.md shows both models side by side. Needs sympy.
"""

import time

import numpy as np
import sympy as sp
from mechanisms import DoublePendulum
from sympy.physics.mechanics import LagrangesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

# The limit of the difference, relative to the largest acceleration of a state: both round differently.
AGREEMENT = 1e-12
EVALUATIONS = 100_000


def of_sympy():
    """q̈ as a function of q, q̇ and parameters, by SymPy's own ways."""
    theta1, theta2 = dynamicsymbols("theta1 theta2")
    u1, u2 = dynamicsymbols("theta1 theta2", 1)
    m1, m2, l1, l2, g = sp.symbols("m1 m2 l1 l2 g", positive=True)
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    bob1 = origin.locatenew("B1", l1 * (sp.sin(theta1) * frame.x - sp.cos(theta1) * frame.y))
    bob2 = bob1.locatenew("B2", l2 * (sp.sin(theta2) * frame.x - sp.cos(theta2) * frame.y))
    for bob in [bob1, bob2]:
        bob.set_vel(frame, bob.pos_from(origin).dt(frame))
    particles = [Particle("P1", bob1, m1), Particle("P2", bob2, m2)]
    kinetic = sum(particle.kinetic_energy(frame) for particle in particles)
    potential = g * sum(p.mass * p.point.pos_from(origin).dot(frame.y) for p in particles)
    method = LagrangesMethod(kinetic - potential, [theta1, theta2])
    method.form_lagranges_equations()
    accelerations = method.mass_matrix.LUsolve(method.forcing)
    arguments = [theta1, theta2, u1, u2, m1, m2, l1, l2, g]
    plain = sp.symbols("a b c d")
    # Velocities first: a coordinate stands inside of its derivative.
    swaps = dict(zip([u1, u2, theta1, theta2], [plain[2], plain[3], plain[0], plain[1]]))
    return sp.lambdify([*plain, *arguments[4:]], list(accelerations.xreplace(swaps)), "numpy", cse=True)


def best(call, repeats=5):
    """The shortest time of several calls, in seconds."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return min(times)


def main():
    begin = time.perf_counter()
    lambdified = of_sympy()
    derived = time.perf_counter() - begin
    parameters = {"m1": 1.0, "m2": 0.7, "l1": 1.0, "l2": 0.8, "g": 9.81}
    model = DoublePendulum(**parameters)
    rng = np.random.default_rng(0)
    q, u = rng.uniform(-3, 3, size=(EVALUATIONS, 2)), rng.normal(scale=3, size=(EVALUATIONS, 2))
    values = list(parameters.values())

    ours, theirs = model.accelerations(q, u), np.stack(lambdified(*q.T, *u.T, *values), axis=1)
    difference = (np.abs(ours - theirs).max(axis=1) / np.abs(theirs).max(axis=1)).max()
    assert difference < AGREEMENT, difference

    states = [(q[i], u[i]) for i in range(2_000)]
    one = best(lambda: [model.accelerations(q, u) for q, u in states]) / len(states)
    one_sympy = best(lambda: [lambdified(*q, *u, *values) for q, u in states]) / len(states)
    all_at_once = best(lambda: model.accelerations(q, u))
    all_at_once_sympy = best(lambda: lambdified(*q.T, *u.T, *values))
    print(f"largest difference         {difference:.1e}, relative, of {EVALUATIONS} states")
    print(f"SymPy derives and prints   {derived:.2f} s, whenever the program starts")
    print(f"{EVALUATIONS} states at once     {all_at_once * 1e3:.1f} ms; lambdify {all_at_once_sympy * 1e3:.1f} ms")
    print(f"ratio                      {all_at_once_sympy / all_at_once:.1f}")
    print(f"one state a call           {one * 1e6:.2f} µs; lambdify {one_sympy * 1e6:.2f} µs")
    print(f"ratio                      {one_sympy / one:.1f}")


if __name__ == "__main__":
    main()
