// A model's programs with values for its parameters, inputs and modes: accelerations and everything else that
// is evaluated at a state.

/**
 * Largest defect of a rotation or an axis from parameters alone, and of a rotation that depends on a state.
 */
const PARAMETER_DEFECT = 1e-9,
  STATE_DEFECT = 1e-5;
/** Largest angle between welded frames, in rad. */
const WELD_ANGLE = 1e-3;
/** Signs and triangle inequalities of inertia matrices hold to this part of their size. */
const INERTIA_ROUNDING = 1e-9;

/** The programs of a model at given parameters. `failure` is why the last evaluation did not succeed. */
class System {
  constructor(programs, model) {
    const { coordinates, rows = 0, holonomic = 0, switched = 0 } = programs.sizes;
    this.programs = programs;
    this.model = model;
    this.n = coordinates;
    this.r = rows;
    this.holonomic = holonomic;
    this.p = Float64Array.from(model.parameters ?? [], (p) => p.value);
    this.w = Float64Array.from(model.inputs ?? [], (w) => w.value ?? NaN);
    /** Modes of switched constraints: 0 while one holds, else ±1, the side to which it was left. */
    this.m = new Float64Array(switched);
    this.f = (model.functions ?? []).map((pieces) => (pieces ? piecewise(pieces) : undefined));
    this.evaluations = 0;
    this.failure = null;
    this.no_a = new Float64Array(this.n);
    this.no_l = new Float64Array(this.r);
    this.bound = {};
    for (const [name, program] of Object.entries(programs)) {
      if (typeof program?.run === "function") this.bound[name] = this.bind(program, programs.bounds?.[name]);
    }
    this.released = (programs.released ?? []).map(({ modes, accelerations, correction, bounds }) => ({
      modes,
      accelerations: accelerations && this.bind(accelerations, bounds?.accelerations),
      correction: correction && this.bind(correction, bounds?.correction),
    }));
    /** M comes from a kinetic energy: a negative pivot is negative inertia. */
    this.kinetic = programs.model?.positive ?? this.has("kinetic_energy");
    /** The coordinates of the pivots of M. */
    this.pivots = programs.model?.pivots ?? model.pivots ?? [];
    this.row_mode = (model.rows ?? []).map((row) => row.switched ?? -1);
    this.switch_modes();
  }

  /** A program with its constants and a place for its results. */
  bind(program, bounds = null) {
    return {
      program,
      run: program.run,
      k: new Float64Array(program.constants ?? 0),
      out: new Float64Array(program.results),
      results: program.results,
      bounds,
    };
  }

  has(name) {
    const program = this.bound[name];
    return program !== undefined && program.results > 0;
  }

  /** Computes the constants of all programs anew, after parameters have changed. */
  hoist() {
    const all = Object.values(this.bound);
    for (const { accelerations, correction } of this.released) all.push(accelerations, correction);
    for (const bound of all) {
      if (bound && bound.program.hoist) bound.program.hoist(this.p, this.f, bound.k);
    }
  }

  /** Evaluates a program; returns its results, which the next call of it overwrites. */
  call(bound, t, q, u, a = this.no_a, l = this.no_l) {
    bound.run(this.p, bound.k, this.f, t, q, u, this.w, this.m, a, l, bound.out);
    return bound.out;
  }

  /** The same by name; `null` where the model has no such program. */
  value(name, t, q, u, a, l) {
    return this.has(name) ? this.call(this.bound[name], t, q, u, a, l) : null;
  }

  /** Whether the constraint of a row holds. */
  holds(row) {
    const mode = this.row_mode[row];
    return mode < 0 || this.m[mode] === 0;
  }

  /** The model's own size of a coordinate: its largest parameter of the same unit, up to 1; else 1. */
  own_size(coordinate) {
    const { unit = "", angle = false } = this.model.coordinates[coordinate];
    if (unit === "" || angle) return 1;
    let largest = 0;
    (this.model.parameters ?? []).forEach((parameter, i) => {
      if (parameter.unit === unit) largest = Math.max(largest, Math.abs(this.p[i]));
    });
    return largest > 0 ? Math.min(largest, 1) : 1;
  }

  /** Chooses the programs for the constraints that hold now. */
  switch_modes() {
    let solver = this.bound.accelerations ?? null,
      correction = this.bound.correction ?? null;
    const free = [];
    this.m.forEach((mode, i) => mode !== 0 && free.push(i));
    if (free.length > 0) {
      const own = this.released.find(
        ({ modes }) => modes.length === free.length && free.every((x) => modes.includes(x)),
      );
      [solver, correction] = [own?.accelerations ?? null, own?.correction ?? null];
    }
    this.solver = solver !== null && solver.results > 0 ? solver : null;
    this.correction = correction !== null && correction.results > 0 ? correction : null;
  }

  /** Whether the guards of a solution with constraints admit it: its last results are pivots and scales. */
  is_admitted(bound, from) {
    const { out, bounds, results } = bound;
    for (let i = from, k = 0; i < results; i += 2, k++) {
      const bound_of = bounds === null ? PIVOT_TOLERANCE : bounds[k];
      if (!(Math.abs(out[i]) > bound_of * Math.abs(out[i + 1]))) return false;
    }
    return true;
  }

  /** The place of the first pivot of M that vanishes or is negative; −1 where none does. A NaN is none. */
  singular_pivot(bound) {
    const { out, results } = bound;
    for (let i = this.n; i < results; i += 2) {
      const size = this.kinetic ? out[i] : Math.abs(out[i]);
      if (size <= PIVOT_TOLERANCE * Math.abs(out[i + 1])) return i;
    }
    return -1;
  }

  /** q̈ and λ at a state; false where they do not exist, and `failure` says why. */
  accelerate(t, q, u, a, l) {
    this.evaluations++;
    const { n, r, solver } = this;
    if (solver !== null) {
      const out = this.call(solver, t, q, u);
      if (r === 0) {
        const at = this.singular_pivot(solver);
        if (at >= 0) return this.fail(this.name_pivot(solver, at));
        for (let i = 0; i < n; i++) a[i] = out[i];
        return true;
      }
      if (this.is_admitted(solver, n + r)) {
        for (let i = 0; i < n; i++) a[i] = out[i];
        for (let i = 0; i < r; i++) l[i] = out[n + i];
        return true;
      }
    }
    return this.constraints.solve(t, q, u, a, l);
  }

  fail(failure) {
    this.failure = failure;
    return false;
  }

  name_pivot({ out }, at) {
    const coordinate = this.pivots[(at - this.n) / 2] ?? 0,
      pivot = out[at];
    const negative = this.kinetic && pivot < -PIVOT_TOLERANCE * Math.abs(out[at + 1]);
    return { kind: "singular_mass_matrix", coordinate, pivot, negative };
  }

  /**
   * The first of the model's assumptions that does not hold at a state, or without one; `null` where all do.
   */
  broken_assumption(t, q, u, of_state) {
    const values = this.value("assumptions", t, q, u),
      assumptions = this.model.assumptions ?? [];
    let at = 0;
    for (const { kind = "mass", constant = true, text = "" } of values === null ? [] : assumptions) {
      const count = { inertia: 9, rotation: 9, axis: 3, weld: 18 }[kind] ?? 1;
      const own = values.subarray(at, at + count);
      at += count;
      if (!constant && !of_state) continue;
      const why = why_not(kind, own, constant);
      if (why !== null) return { kind: "assumption", text: text === "" ? why : `${text}: ${why}` };
    }
    return null;
  }

  /** What happened, in the library's words. */
  words(failure) {
    const coordinate = (i) => this.model.coordinates[i]?.name ?? "";
    const row = (i) => this.model.rows?.[i]?.name ?? "";
    const text = FAILURES[failure.kind];
    return typeof text === "function"
      ? text({ ...failure, coordinate: coordinate(failure.coordinate), row: row(failure.row) })
      : (failure.text ?? failure.kind);
  }
}

/** Why values do not fulfil an assumption; `null` where they do. */
function why_not(kind, x, constant) {
  if (kind === "mass" || kind === "moment") {
    const what = kind === "mass" ? "mass" : "moment of inertia";
    return x[0] >= 0 && Number.isFinite(x[0])
      ? null
      : `a body cannot have the ${what} ${x[0]}; give a finite number that is not negative`;
  }
  if (kind === "inertia") {
    return is_inertia(x)
      ? null
      : "no body has this inertia: it has to be symmetric and without a negative principal " +
          "moment, none of which is larger than the sum of the others";
  }
  if (kind === "axis") {
    const length = Math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    return Math.abs(length - 1) <= PARAMETER_DEFECT
      ? null
      : `divided by its length it has the length ${length}, as the square of that is none that a number ` +
          `can hold; give a length near 1`;
  }
  if (kind === "rotation") {
    const defect = orthonormal_defect(x);
    return defect <= (constant ? PARAMETER_DEFECT : STATE_DEFECT)
      ? null
      : `this is no rotation: its rows miss unit length or right angles by ${scientific(defect, 1)}`;
  }
  // A weld: |R − 1| is √8 |sin θ/2| for a rotation by θ.
  let square = 0;
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 3; j++) {
      let turned = i === j ? -1 : 0;
      for (let l = 0; l < 3; l++) turned += x[3 * l + i] * x[9 + 3 * l + j];
      square += turned * turned;
    }
  }
  const half = Math.min(Math.sqrt(square / 8), 1),
    angle = 2 * Math.atan2(half, Math.sqrt(1 - half * half));
  return angle <= WELD_ANGLE
    ? null
    : `its rows hold, and yet the frames are turned against one another by ` +
        `${angle.toFixed(3)} rad; give a start in which they are one`;
}

/** Largest element of |RᵀR − 1|. */
function orthonormal_defect(x) {
  let most = 0;
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 3; j++) {
      let product = i === j ? -1 : 0;
      for (let l = 0; l < 3; l++) product += x[3 * l + i] * x[3 * l + j];
      most = max(most, Math.abs(product));
    }
  }
  return most;
}

/**
 * Whether some body has this inertia matrix: it is symmetric, and ½ tr(J) 1 − J, the second moments of the
 * mass, has no negative eigenvalue. That of a 3×3 matrix is so if its principal minors are not negative.
 */
function is_inertia(x) {
  const size = max_abs(x),
    least = -INERTIA_ROUNDING * size,
    half = 0.5 * (x[0] + x[4] + x[8]);
  if (!Number.isFinite(size)) return false;
  const skew = Math.max(Math.abs(x[1] - x[3]), Math.abs(x[2] - x[6]), Math.abs(x[5] - x[7]));
  if (skew > INERTIA_ROUNDING * size) return false;
  const [a, b, c, d, e, f] = [half - x[0], half - x[4], half - x[8], -x[1], -x[2], -x[5]];
  const minors = [a * b - d * d, a * c - e * e, b * c - f * f];
  const det = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e);
  return Math.min(a, b, c) >= least && Math.min(...minors) >= least * size && det >= least * size * size;
}
