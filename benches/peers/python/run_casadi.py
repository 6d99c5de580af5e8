"""IDAS of SUNDIALS 2.7, which is part of CasADi's wheel, on Andrews' mechanism with its constraints.

It stands for SUNDIALS where that cannot be installed. Stabilised index-2 form (Gear, Gupta, Leimkuhler),
semi-explicit as CasADi requires it, with accelerations a among the algebraic variables:

    q' = u - G^T mu        u' = a        M a = f - G^T lambda        phi = 0        G u = 0

CasADi derives the Jacobian, writes both as C and has gcc compile them.
"""

import time

import casadi as ca
import numpy as np

from measure import TOLERANCES, measure
from problems import ANDREWS_START, PROBLEMS, andrews

q, u, a = (ca.SX.sym(name, 7) for name in "qua")
multipliers, mu = ca.SX.sym("lambda", 6), ca.SX.sym("mu", 6)
kinetic, potential, rows = andrews(ca.vertsplit(q), ca.vertsplit(u), ca)
rows = ca.vertcat(*rows)
momenta = ca.gradient(kinetic, u)
mass, jacobian = ca.jacobian(momenta, u), ca.jacobian(rows, q)
force = ca.gradient(kinetic - potential, q) - ca.jtimes(momenta, q, u)
gamma = -ca.jtimes(jacobian @ u, q, u)
dae = {
    "x": ca.vertcat(q, u),
    "z": ca.vertcat(a, multipliers, mu),
    "ode": ca.vertcat(u - jacobian.T @ mu, a),
    "alg": ca.vertcat(mass @ a - force + jacobian.T @ multipliers, rows, jacobian @ u),
}

# Accelerations and multipliers at the start, as IDAS finds no consistent values by itself.
kkt = ca.vertcat(ca.horzcat(mass, jacobian.T), ca.horzcat(jacobian, ca.SX(6, 6)))
solved = ca.Function("start", [q, u], [ca.solve(kkt, ca.vertcat(force, gamma))])
start = np.array(ANDREWS_START + [0.0] * 7)
rates = np.array(solved(start[:7], start[7:])).ravel()
algebraic = np.concatenate([rates, np.zeros(6)])
_, _, end = PROBLEMS["Andrews"]

for tolerance in TOLERANCES:
    # As in `../sundials/run.c`: tolerances by component, as its first step fails with equal ones, and
    # algebraic variables out of the error test.
    options = {
        "abstolv": [tolerance] * 7 + [1e2 * tolerance] * 7 + [1e8 * tolerance] * 19,
        "reltol": tolerance,
        "suppress_algebraic": True,
        "calc_ic": False,
        "init_xdot": list(start[7:]) + list(rates[:7]),
        "step0": 1e-7,
        "max_num_steps": 1000000,
        "jit": True,
        "compiler": "shell",
        "jit_options": {"flags": ["-O3", "-march=native"]},
    }
    try:
        idas = ca.integrator("idas", "idas", dae, 0.0, end, options)
    except RuntimeError as error:
        print(error)
        break

    def run():
        result = idas(x0=start, z0=algebraic)
        statistics = idas.stats()
        return int(statistics["nfevals"]), np.array(result["xf"]).ravel()

    # Runs of many milliseconds, into which other jobs on a busy machine break.
    measure("Andrews", "IDA (index 2, GGL), CasADi's", tolerance, run, clock=time.process_time)
