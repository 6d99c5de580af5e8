"""Writes the accelerations of `benches/evaluation` as C: one file for each model.

CasADi derives them from T, V and the constraints.

    evaluation_c.py FOLDER

Constants are folded into the code; M q̈ = Q is solved by CasADi's LDLᵀ, the constrained systems by
elimination of the whole matrix in an order of little fill.
"""

import os
import sys

import casadi as ca

from evaluation_models import CHAINS, chain, double_pendulum, slider_crank
from problems import G, andrews, eliminated

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


def accelerations(name, n, model):
    q, u = ca.SX.sym("q", n), ca.SX.sym("u", n)
    kinetic, potential, rows = model(ca.vertsplit(q), ca.vertsplit(u), ca)
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
    models = [("double_pendulum", 2, double_pendulum), ("slider_crank", 3, slider_crank), ("andrews", 7, andrews)]
    models.append(("arm", 7, lambda q, u, _: arm(q, u)))
    for links in CHAINS:
        models.append((f"chain_{links}", links + 1, lambda q, u, lib, links=links: chain(links, q, u, lib)))
    for name, n, model in models:
        function = accelerations(f"{name}_casadi", n, model)
        code = ca.CodeGenerator(f"{name}_casadi.c", {"with_header": False})
        code.add(function)
        code.generate()
        print(f"{name}_casadi", function.n_instructions(), function.sz_w(), flush=True)


main(sys.argv[1])
