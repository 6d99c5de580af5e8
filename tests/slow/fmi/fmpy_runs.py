"""Validates, builds and moves units in FMPy, and compares them with motions that jobs.json has.

Called with the folder of jobs.json. Prints a line for each motion; the exit status is 1 where one is off.
"""

import json
import os
import shutil
import sys

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.build import build_platform_binary
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

# FMPy brings CMake along, beside the interpreter.
os.environ["PATH"] = os.path.dirname(sys.executable) + os.pathsep + os.environ["PATH"]

folder = sys.argv[1]
with open(os.path.join(folder, "jobs.json")) as file:
    jobs = json.load(file)
tolerance, most = jobs["tolerance"], jobs["most"]
# Errors of CVode are those of all its steps together.
OF_CVODE = 1e-3
# Where Co-Simulation exchanges values.
STEP = 0.05
failures = 0


def judge(unit, what, off, bound=most):
    """Prints how far something is off, in tolerances."""
    global failures
    failures += not off <= bound
    print(f"{unit:16} {what:42} {off:9.3g} tolerances{'' if off <= bound else '  FAILED'}")


def build(unit):
    """The unit's folder, with a library that was built without a warning."""
    place = os.path.join(folder, unit["name"])
    shutil.rmtree(place, ignore_errors=True)
    extract(unit["path"], place)
    out = os.open(os.path.join(folder, unit["name"] + ".log"), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    kept = os.dup(1), os.dup(2)
    try:
        sys.stdout.flush()
        os.dup2(out, 1), os.dup2(out, 2)
        build_platform_binary(place, all_warnings=True)
    finally:
        os.dup2(kept[0], 1), os.dup2(kept[1], 2)
    with open(os.path.join(folder, unit["name"] + ".log")) as log:
        text = log.read()
    assert "warning" not in text.lower(), text
    return place


def apart(unit, run, result):
    """The largest difference from Rust, in tolerances."""
    worst = 0.0
    assert len(run["times"]) == len(run["values"]) > 0, unit["name"]
    for t, expected in zip(run["times"], run["values"]):
        assert len(expected) == len(unit["compared"]), unit["name"]
        row = result[np.argmin(abs(result["time"] - t))]
        assert abs(row["time"] - t) < 1e-9, (t, row["time"])
        for i, (name, value) in enumerate(zip(unit["compared"], expected)):
            size = unit["size"] if i < unit["states"] else 1
            off = abs(row[name] - value) / (size + abs(value))
            # A comparison with NaN is false, and `max` would leave it out.
            worst = max(worst, off) if np.isfinite(off) else np.inf
    return worst / tolerance


def moved(unit, place, run, kind):
    """The motion of a unit in FMPy."""
    signals = None
    end = run["times"][-1]
    if run["jump"] is not None:
        description = read_model_description(place)
        name, start = next((v.name, float(v.start)) for v in description.modelVariables if v.causality == "input")
        points = [(0.0, start), (jobs["jump"], start), (jobs["jump"], run["jump"]), (end, run["jump"])]
        signals = np.array(points, dtype=[("time", float), (name, float)])
    return simulate_fmu(
        place, fmi_type=kind, stop_time=end, output_interval=STEP, start_values=run["changed"], input=signals,
        relative_tolerance=tolerance * (OF_CVODE if kind == "ModelExchange" else 1), output=unit["compared"])


def slave(place):
    """An instance of Co-Simulation at its start."""
    description = read_model_description(place)
    instance = FMU3Slave(guid=description.instantiationToken, unzipDirectory=place,
                         modelIdentifier=description.coSimulation.modelIdentifier, instanceName="one")
    return description, instance


def begin(instance, **options):
    instance.instantiate(**options)
    instance.enterInitializationMode(tolerance=tolerance, startTime=0.0)
    instance.exitInitializationMode()


def saved_state(unit, place):
    """A state that is saved, as bytes, and restored leads to the same bits."""
    description, instance = slave(place)
    begin(instance)
    references = [v.valueReference for v in description.modelVariables]
    walk = lambda begin: [instance.doStep(begin + STEP * i, STEP) for i in range(5)]
    walk(0.0)
    state = instance.getFMUState()
    data = instance.serializeFMUState(state)
    walk(5 * STEP)
    first = list(instance.getFloat64(references))
    instance.setFMUState(state)
    walk(5 * STEP)
    second = list(instance.getFloat64(references))
    read = instance.deserializeFMUState(data)
    instance.setFMUState(read)
    walk(5 * STEP)
    third = list(instance.getFloat64(references))
    for each in [state, read]:
        instance.freeFMUState(each)
    instance.terminate()
    instance.freeInstance()
    same = first == second == third and all(np.isfinite(first))
    judge(unit["name"], "a saved state, restored", 0.0 if same else 1.0, 0.0)


def events(unit, place, run):
    """Steps of Co-Simulation that end at declared events."""
    _, instance = slave(place)
    begin(instance, eventModeUsed=True, earlyReturnAllowed=True)
    instance.updateDiscreteStates()
    instance.enterStepMode()
    time, end, found = 0.0, run["times"][-1], []
    while time < end:
        needed, _, _, time = instance.doStep(time, end - time)
        if needed:
            found.append(time)
            instance.enterEventMode()
            instance.updateDiscreteStates()
            instance.enterStepMode()
    instance.terminate()
    instance.freeInstance()
    same = len(found) == len(run["events"]) and all(np.isfinite(found))
    off = max([abs(a - b) for a, b in zip(found, run["events"])], default=0.0)
    judge(unit["name"], f"{len(found)} events", off / tolerance if same else float("inf"))


for unit in jobs["units"]:
    problems = validate_fmu(unit["path"])
    judge(unit["name"], "problems that the validator finds", len(problems), 0)
    for problem in problems:
        print(problem)
    place = build(unit)
    for run in unit["runs"]:
        print(f"{unit['name']:16} {'Rust, ' + run['about']:42} {run['own']:9.3g} tolerances")
        for kind in ["ModelExchange", "CoSimulation"]:
            judge(unit["name"], f"{kind}, {run['about']}", apart(unit, run, moved(unit, place, run, kind)))
    saved_state(unit, place)
    events(unit, place, unit["runs"][0])
unit = next(unit for unit in jobs["units"] if unit["name"] == "cart_pole")
problems = validate_fmu(jobs["binary"])
judge("with a library", "problems that the validator finds", len(problems), 0)
result = moved(unit, jobs["binary"], unit["runs"][0], "CoSimulation")
judge("with a library", "CoSimulation, as it is", apart(unit, unit["runs"][0], result))
sys.exit(1 if failures else 0)
