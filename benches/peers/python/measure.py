"""Repeats, and the line that `Study::add_outside` reads."""

import json
import statistics
import time

TOLERANCES = [10.0**-k for k in range(3, 14)]


def measure(problem, solver, tolerance, run, seconds=0.3, clock=time.perf_counter):
    """Prints one line: `run` returns (evaluations or None, q and u at the end) or raises. `clock` times."""
    line = {"problem": problem, "solver": solver, "tolerance": tolerance}
    times, begun = [], time.perf_counter()
    try:
        while len(times) < 3 or (time.perf_counter() - begun < seconds and len(times) < 101):
            started = clock()
            evaluations, end = run()
            times.append(clock() - started)
            if time.perf_counter() - begun > 20.0:
                break
        line["time_us"] = round(1e6 * statistics.median_low(times), 3)
        line["repeats"] = len(times)
        line["evaluations"] = evaluations
        line["end"] = [float(x) for x in end]
        if not all(abs(x) < 1e300 for x in line["end"]):
            raise ArithmeticError("its end is not finite")
    except Exception as error:  # whatever a solver raises is its answer
        line = {key: line[key] for key in ("problem", "solver", "tolerance")} | {"failure": str(error)[:200]}
    print(json.dumps(line), flush=True)
