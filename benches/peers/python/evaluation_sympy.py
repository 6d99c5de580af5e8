"""Writes the accelerations of `benches/evaluation` as C by SymPy: one file for each model.

Lagrange's equations, M q̈ = Q with common subexpressions; C code for M and Q, and where there are constraints
for their Jacobian and γ, with all constants as numbers. SymPy solves no symbolic systems of this size: LDLᵀ,
and the Schur complement of the constraints, are written out in C for the fixed size.

    evaluation_sympy.py FOLDER

The arm is left out: a chain of four of its hinges takes SymPy two minutes, of five more than four.
"""

import os
import sys

import sympy as sm

from evaluation_models import CHAINS, chain, double_pendulum, slider_crank
from problems import andrews


def equations(n, model):
    """M, Q, Φ_q and γ as symbols q0.. and u0.. have them."""
    q, u = sm.symbols(f"q:{n}"), sm.symbols(f"u:{n}")
    kinetic, potential, rows = model(list(q), list(u), sm)
    momenta = [sm.diff(kinetic, rate) for rate in u]
    mass = [[sm.diff(momenta[i], u[j]) for j in range(i + 1)] for i in range(n)]
    along = lambda x: sum(sm.diff(x, q[j]) * u[j] for j in range(n))
    force = [sm.diff(kinetic - potential, q[i]) - along(momenta[i]) for i in range(n)]
    jacobian = [[sm.diff(row, coordinate) for coordinate in q] for row in rows]
    gamma = [-along(along(row)) for row in rows]
    return mass, force, jacobian, gamma


class Code:
    """Lines of C. What is known to be zero gets no line: the compiler may not assume that 0·x is 0."""

    def __init__(self):
        self.lines, self.zero = [], set()

    def set(self, name, value):
        if value == "0":
            self.zero.add(name)
        else:
            self.lines.append(f"const double {name} = {value};")

    def less(self, value, products):
        """The value less these products."""
        terms = [f" - {a} * {b}" for a, b in products if not {a, b} & self.zero]
        value = "0" if value in self.zero else value
        return ("" if value == "0" and terms else value) + "".join(terms)

    def factor(self, name, n, entry):
        """LDLᵀ of n rows: W is L times D, which is kept as its inverse."""
        for j in range(n):
            for i in range(j, n):
                terms = [(f"{name}L{i}_{k}", f"{name}W{j}_{k}") for k in range(j)]
                self.set(f"{name}W{i}_{j}", self.less(entry(i, j), terms))
                if i == j:
                    self.set(f"{name}D{j}", f"1.0 / {name}W{j}_{j}")
                else:
                    self.set(f"{name}L{i}_{j}", self.times(f"{name}W{i}_{j}", f"{name}D{j}"))

    def times(self, a, b):
        return "0" if {a, b} & self.zero else f"{a} * {b}"

    def solve(self, name, n, to, right):
        """The solution `to` of the factored system with this right-hand side."""
        for i in range(n):
            self.set(f"{to}y{i}", self.less(right(i), [(f"{name}L{i}_{k}", f"{to}y{k}") for k in range(i)]))
        for i in reversed(range(n)):
            terms = [(f"{name}L{k}_{i}", f"{to}{k}") for k in range(i + 1, n)]
            self.set(f"{to}{i}", self.less(self.times(f"{to}y{i}", f"{name}D{i}"), terms))

    def sum(self, products):
        terms = [f"{a} * {b}" for a, b in products if not {a, b} & self.zero]
        return "(" + " + ".join(terms) + ")" if terms else "0"


def write(name, n, model):
    mass, force, jacobian, gamma = equations(n, model)
    flat = [x for row in mass for x in row] + force + [x for row in jacobian for x in row] + gamma
    shared, flat = sm.cse(flat, symbols=sm.numbered_symbols("z"))
    code, rows = Code(), len(gamma)
    for i in range(n):
        code.set(f"q{i}", f"in[0][{i}]")
        code.set(f"u{i}", f"in[1][{i}]")
    for symbol, value in shared:
        code.set(symbol, sm.ccode(value))
    values = iter([sm.ccode(value) for value in flat])
    for place in [f"M{i}_{j}" for i in range(n) for j in range(i + 1)] + [f"Q{i}" for i in range(n)]:
        code.set(place, next(values))
    for place in [f"G{r}_{i}" for r in range(rows) for i in range(n)] + [f"g{r}" for r in range(rows)]:
        code.set(place, next(values))
    code.factor("m", n, lambda i, j: f"M{i}_{j}")
    code.solve("m", n, "f", lambda i: f"Q{i}")
    for r in range(rows):
        code.solve("m", n, f"x{r}_", lambda i, r=r: f"G{r}_{i}")
    row = lambda r, x: code.sum([(f"G{r}_{i}", f"{x}{i}") for i in range(n)])
    if rows:
        code.factor("s", rows, lambda r, c: row(r, f"x{c}_"))
        code.solve("s", rows, "l", lambda r: code.less(row(r, "f"), [(f"g{r}", "1.0")]))
    lines = code.lines
    for i in range(n):
        lines.append(f"out[0][{i}] = " + code.less(f"f{i}", [(f"x{r}_{i}", f"l{r}") for r in range(rows)]) + ";")
    with open(f"{name}.c", "w") as file:
        file.write("#include <math.h>\nstatic void %s(const double **in, double **out, " % name)
        file.write("long *whole, double *work, int memory) {\n    ")
        file.write("\n    ".join(lines) + "\n}\n")
    print(name, sum(sm.count_ops(value) for _, value in shared), 0, flush=True)


def main(folder):
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)
    models = [("double_pendulum", 2, double_pendulum), ("slider_crank", 3, slider_crank), ("andrews", 7, andrews)]
    for links in CHAINS:
        if links <= 10:
            models.append((f"chain_{links}", links + 1, lambda q, u, lib, links=links: chain(links, q, u, lib)))
    for name, n, model in models:
        write(f"{name}_sympy", n, model)


main(sys.argv[1])
