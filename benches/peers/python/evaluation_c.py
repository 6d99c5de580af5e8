"""Writes the accelerations of `benches/evaluation` as C: one file for each model.

CasADi derives them from T, V and the constraints.

    evaluation_c.py FOLDER

Constants are folded into the code; M q̈ = Q is solved by CasADi's LDLᵀ, the constrained systems by
elimination of the whole matrix in an order of little fill.
"""

import os
import sys

import casadi as ca

from problems import G, andrews, eliminated

CHAINS = (5, 10, 20)


def chain(links, q, u):
    """T and V of a cart with links in absolute angles; the numbers of `by_hand.rs`."""
    x, rise, fall = u[0], 0, 0
    kinetic, potential = 0.5 * 2.0 * u[0] ** 2, 0
    for i in range(links):
        m, length = 1.0 + 0.1 * ((i + 1) % 7), 1.0 - 0.02 * ((i + 1) % 9)
        s, c = ca.sin(q[i + 1]), ca.cos(q[i + 1])
        x, rise, fall = x + length * c * u[i + 1], rise + length * s * u[i + 1], fall - length * c
        kinetic, potential = kinetic + 0.5 * m * (x**2 + rise**2), potential + m * G * fall
    return kinetic, potential, []


def double_pendulum(q, u):
    x, rise, fall, kinetic, potential = 0, 0, 0, 0, 0
    for m, length, angle, rate in zip((1.0, 1.3), (1.0, 0.8), q, u):
        s, c = ca.sin(angle), ca.cos(angle)
        x, rise, fall = x + length * c * rate, rise + length * s * rate, fall - length * c
        kinetic, potential = kinetic + 0.5 * m * (x**2 + rise**2), potential + m * G * fall
    return kinetic, potential, []


def arm(q, u):
    """Velocities in the axes of each link, from link to link; the numbers of `arm7.rs`."""
    def cross(a, b):
        return ca.vertcat(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

    inertia = ca.DM([[0.02, 0.001, 0.002], [0.001, 0.018, 0.0015], [0.002, 0.0015, 0.01]])
    velocity, omega, up, height = ca.SX.zeros(3), ca.SX.zeros(3), ca.SX([0, 0, 1]), 0
    kinetic, potential = 0, 0
    for i in range(1, 8):
        hinge = ca.DM([0.02, -0.01 * i, 0.2 + 0.01 * i])
        velocity, height = velocity + cross(omega, hinge), height + ca.dot(up, hinge)
        quarter = 0 if i == 1 else 1 if i % 2 else -1
        s, c = ca.sin(q[i - 1]), ca.cos(q[i - 1])
        turned = ca.DM.eye(3) if quarter == 0 else ca.DM([[1, 0, 0], [0, 0, -quarter], [0, quarter, 0]])
        about = ca.blockcat([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        back = (turned @ about).T
        velocity, omega, up = back @ velocity, back @ omega, back @ up
        omega = omega + ca.vertcat(0, 0, u[i - 1])
        center, m = ca.DM([0.01, 0.02 if i % 2 == 0 else -0.02, 0.1]), 3.0 - 0.3 * i
        own = velocity + cross(omega, center)
        kinetic = kinetic + 0.5 * m * ca.dot(own, own) + 0.5 * ca.dot(omega, inertia @ omega)
        potential = potential + m * G * (height + ca.dot(up, center))
    return kinetic, potential, []


def slider_crank(q, u):
    (theta, phi, _), (crank, rod) = q, (0.5, 1.2)
    x = -crank * ca.sin(theta) * u[0] - 0.5 * rod * ca.sin(phi) * u[1]
    y = crank * ca.cos(theta) * u[0] + 0.5 * rod * ca.cos(phi) * u[1]
    kinetic = 0.5 * (crank**2 / 3) * u[0] ** 2 + 0.5 * 2.0 * u[2] ** 2
    kinetic = kinetic + 0.5 * 1.5 * (x**2 + y**2) + 0.5 * (1.5 * rod**2 / 12) * u[1] ** 2
    rows = [crank * ca.cos(theta) + rod * ca.cos(phi) - q[2], crank * ca.sin(theta) + rod * ca.sin(phi)]
    height = crank * ca.sin(theta) + 0.5 * rod * ca.sin(phi)
    potential = 1.0 * G * 0.5 * crank * ca.sin(theta) + 1.5 * G * height
    return kinetic, potential, rows


def accelerations(name, n, model):
    q, u = ca.SX.sym("q", n), ca.SX.sym("u", n)
    kinetic, potential, rows = model(ca.vertsplit(q), ca.vertsplit(u))
    momenta = ca.gradient(kinetic, u)
    mass = ca.jacobian(momenta, u)
    force = ca.gradient(kinetic - potential, q) - ca.jtimes(momenta, q, u)
    if not rows:
        d, lt, order = ca.ldl(mass, False)
        solved = ca.ldl_solve(force, d, lt, order)
    else:
        rows = ca.vertcat(*rows)
        jacobian = ca.jacobian(rows, q)
        gamma, size = -ca.jtimes(jacobian @ u, q, u), n + rows.shape[0]
        matrix = ca.vertcat(ca.horzcat(mass, jacobian.T), ca.horzcat(jacobian, ca.SX(size - n, size - n)))
        right = ca.vertcat(force, gamma)
        entries = [[matrix[i, j] for j in range(size)] for i in range(size)]
        solved = ca.vertcat(*eliminated(entries, [right[i] for i in range(size)])[:n])
    return ca.Function(name, [q, u], [ca.densify(solved)], {"cse": True})


def main(folder):
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)
    models = [("double_pendulum", 2, double_pendulum), ("arm", 7, arm), ("slider_crank", 3, slider_crank)]
    models.append(("andrews", 7, lambda q, u: andrews(q, u, ca)))
    for links in CHAINS:
        models.append((f"chain_{links}", links + 1, lambda q, u, links=links: chain(links, q, u)))
    for name, n, model in models:
        function = accelerations(f"{name}_casadi", n, model)
        code = ca.CodeGenerator(f"{name}_casadi.c", {"with_header": False})
        code.add(function)
        code.generate()
        print(f"{name}_casadi", function.n_instructions(), function.sz_w(), flush=True)


main(sys.argv[1])
