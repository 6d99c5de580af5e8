"""Strings, chains and rods in Python: NumPy by whole arrays, PyElastica's step of a rod.

Prints a line of JSON for every measurement, as `families/` does: the least of many calls. A rod of PyElastica
moves in space and turns about three axes: six unknowns for each element.
"""

import json
import sys
import time
from importlib.metadata import version

import numpy as np


def least(call, seconds=1.0):
    """Seconds of the shortest call."""
    call()
    best, begin = float("inf"), time.perf_counter()
    while time.perf_counter() - begin < seconds:
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return best


def report(system, n, candidate, seconds, unknowns):
    line = {"system": system, "n": n, "candidate": candidate, "ns_per_unknown": seconds * 1e9 / unknowns}
    print(json.dumps(line), flush=True)


def string(n):
    pitch, ea, tension = 1.0 / n, 1e4, 10.0
    s, w = np.zeros(n + 2), np.zeros(n + 2)
    i = np.arange(n)
    s[1:-1], w[1:-1] = 1e-3 * np.sin(7.0 * i / n) / n, 0.1 * np.sin(3.0 * i / n)
    inverse = np.full(n, float(n))

    def call():
        dx, dy = np.diff(s) + pitch, np.diff(w)
        c = ea / pitch + (tension - ea) / np.sqrt(dx * dx + dy * dy)
        return np.diff(c * dx) * inverse, np.diff(c * dy) * inverse

    report("string", n, f"NumPy {np.__version__}", least(call), 2 * n)


def chain(n):
    s = np.zeros(n + 2)
    s[1:-1] = np.sin(3.0 * np.arange(n) / n)

    def call():
        d = np.diff(s)
        return np.diff(d * (1.0 + 0.3 * (d * d)))

    report("cubic chain", n, f"NumPy {np.__version__}", least(call), n)


def rod(n):
    try:
        import elastica
    except ImportError as error:
        print(f"PyElastica passed over: {error}", file=sys.stderr)
        return

    class System(elastica.BaseSystemCollection):
        pass

    system = System()
    rod = elastica.CosseratRod.straight_rod(
        n,
        np.zeros(3),
        np.array([0.0, 0.0, 1.0]),
        np.array([0.0, 1.0, 0.0]),
        base_length=1.0,
        base_radius=0.01,
        density=1e3,
        youngs_modulus=1e6,
        shear_modulus=4e5,
    )
    system.append(rod)
    system.finalize()
    stepper, time_now = elastica.PositionVerlet(), np.float64(0.0)

    def call():
        stepper.step(system, time_now, np.float64(1e-9))

    report("rod, one step", n, f"PyElastica {version('pyelastica')}", least(call), 6 * n)


for count in (1_000, 100_000, 1_000_000):
    string(count)
    chain(count)
for count in (100, 1_000, 10_000):
    rod(count)
