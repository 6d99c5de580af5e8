"""Wraps what was generated into functions of a state (q, u) and q̈, and lists them and others for
`benches/peers/evaluation`.

    evaluation_table.py FOLDER [FURTHER...]

FOLDER holds `*.txt` with a line `name operations work` for each `name.c`; FURTHER are functions that are
there otherwise: `arm_mujoco_forward`.
"""

import glob
import os
import sys

# In the order in which they are searched: the ends of names.
KINDS = [
    ("_casadi", "CasADi, generated C"),
    ("_sympy", "SymPy, generated C"),
    ("_aba_at_run_time", "Pinocchio, ABA at run time"),
    ("_aba", "Pinocchio's ABA, generated C"),
    ("_crba", "Pinocchio's CRBA, generated C"),
    ("_mujoco_forward", "MuJoCo, mj_forward"),
    ("_mujoco_parts", "MuJoCo, its parts"),
]
MODELS = {
    "double_pendulum": "double pendulum",
    "slider_crank": "slider-crank",
    "andrews": "Andrews",
    "arm": "arm",
}


def described(name):
    """Model and what it is, of a name."""
    end, kind = next((end, kind) for end, kind in KINDS if name.endswith(end))
    model = name[: -len(end)]
    return MODELS.get(model, model.replace("_", " ")), kind


def wrapped(name, work):
    """C that calls a generated function. Pinocchio's chains have relative angles, the table absolute ones."""
    model, kind = described(name)
    sizes = {"double pendulum": 2, "slider-crank": 3, "Andrews": 7, "arm": 7}
    n = sizes.get(model) or int(model.split()[1]) + 1
    relative = kind.startswith("Pinocchio") and model != "arm"
    first = 0 if n == 2 else 1
    lines = [f'#include "{name}.c"', f"void peer_{name}(const double *q, double *a) {{"]
    lines += [f"    const double *u = q + {n};"]
    if relative:
        lines += [f"    double at[{n}], rates[{n}];", f"    for (int i = 0; i < {n}; i++) {{"]
        own = f"at[i] = q[i] - (i > {first} ? q[i - 1] : 0.0)"
        lines += [f"        {own}, rates[i] = u[i] - (i > {first} ? u[i - 1] : 0.0);", "    }"]
    arguments = "at, rates" if relative else "q, u"
    lines += [f"    const double *in[8] = {{{arguments}}};", f"    double *out[8] = {{a}}, work[{work + 1}];"]
    lines += [f"    {name}(in, out, 0, work, 0);"]
    if relative:
        lines += [f"    for (int i = {first + 1}; i < {n}; i++) a[i] += a[i - 1];"]
    return "\n".join(lines + ["}", ""])


def main(folder, further):
    names = []
    for listed in sorted(glob.glob(os.path.join(folder, "*.txt"))):
        for line in open(listed):
            name, _, work = line.split()
            names.append(name)
            with open(os.path.join(folder, f"peer_{name}.c"), "w") as file:
                file.write(wrapped(name, int(work)))
    names += further
    with open(os.path.join(folder, "table.c"), "w") as file:
        file.write("typedef void function(const double *, double *);\n")
        file.write("".join(f"function peer_{name};\n" for name in names))
        file.write("const struct { const char *model, *name; function *run; } PEERS[] = {\n")
        file.write("".join('    {"%s", "%s", peer_%s},\n' % (*described(name), name) for name in names))
        file.write("};\nconst unsigned long PEERS_COUNT = %d;\n" % len(names))


main(sys.argv[1], sys.argv[2:])
