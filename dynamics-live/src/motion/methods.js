// Methods of integration: tables of Runge–Kutta methods and their step control.
//
// The numbers and the order of operations are those of `dynamics-runtime/src/integrate/explicit/`. A row of a
// tableau is a list of [stage, weight] without its zeros; a sum adds them from left to right. A test compares
// this file with the Rust tables.

/** A row for sums: the stages and the weights apart, so that loops read typed arrays. */
function tableau_row(pairs) {
  return { stages: Int32Array.from(pairs, (p) => p[0]), weights: Float64Array.from(pairs, (p) => p[1]) };
}

const DORMAND_PRINCE_5 = {
  c: [0, 0.2, 0.3, 0.8, 8 / 9, 1, 1],
  a: [
    [[0, 0.2]],
    [
      [0, 3 / 40],
      [1, 9 / 40],
    ],
    [
      [0, 44 / 45],
      [1, -56 / 15],
      [2, 32 / 9],
    ],
    [
      [0, 19372 / 6561],
      [1, -25360 / 2187],
      [2, 64448 / 6561],
      [3, -212 / 729],
    ],
    [
      [0, 9017 / 3168],
      [1, -355 / 33],
      [2, 46732 / 5247],
      [3, 49 / 176],
      [4, -5103 / 18656],
    ],
  ],
  b: [
    [0, 35 / 384],
    [2, 500 / 1113],
    [3, 125 / 192],
    [4, -2187 / 6784],
    [5, 11 / 84],
  ],
  e: [
    [0, 71 / 57600],
    [2, -71 / 16695],
    [3, 71 / 1920],
    [4, -17253 / 339200],
    [5, 22 / 525],
    [6, -1 / 40],
  ],
};

const DOP853 = {
  c: [
    0.0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 0.3333333333333333,
    0.25, 0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0,
  ],
  a: [
    [[0, 0.05260015195876773]],
    [
      [0, 0.0197250569845379],
      [1, 0.0591751709536137],
    ],
    [
      [0, 0.02958758547680685],
      [2, 0.08876275643042054],
    ],
    [
      [0, 0.2413651341592667],
      [2, -0.8845494793282861],
      [3, 0.924834003261792],
    ],
    [
      [0, 0.037037037037037035],
      [3, 0.17082860872947386],
      [4, 0.12546768756682242],
    ],
    [
      [0, 0.037109375],
      [3, 0.17025221101954405],
      [4, 0.06021653898045596],
      [5, -0.017578125],
    ],
    [
      [0, 0.03709200011850479],
      [3, 0.17038392571223998],
      [4, 0.10726203044637328],
      [5, -0.015319437748624402],
      [6, 0.008273789163814023],
    ],
    [
      [0, 0.6241109587160757],
      [3, -3.3608926294469414],
      [4, -0.868219346841726],
      [5, 27.59209969944671],
      [6, 20.154067550477894],
      [7, -43.48988418106996],
    ],
    [
      [0, 0.47766253643826434],
      [3, -2.4881146199716677],
      [4, -0.590290826836843],
      [5, 21.230051448181193],
      [6, 15.279233632882423],
      [7, -33.28821096898486],
      [8, -0.020331201708508627],
    ],
    [
      [0, -0.9371424300859873],
      [3, 5.186372428844064],
      [4, 1.0914373489967295],
      [5, -8.149787010746927],
      [6, -18.52006565999696],
      [7, 22.739487099350505],
      [8, 2.4936055526796523],
      [9, -3.0467644718982196],
    ],
    [
      [0, 2.273310147516538],
      [3, -10.53449546673725],
      [4, -2.0008720582248625],
      [5, -17.9589318631188],
      [6, 27.94888452941996],
      [7, -2.8589982771350235],
      [8, -8.87285693353063],
      [9, 12.360567175794303],
      [10, 0.6433927460157636],
    ],
  ],
  b: [
    [0, 0.054293734116568765],
    [5, 4.450312892752409],
    [6, 1.8915178993145003],
    [7, -5.801203960010585],
    [8, 0.3111643669578199],
    [9, -0.1521609496625161],
    [10, 0.20136540080403034],
    [11, 0.04471061572777259],
  ],
  b3: [
    [0, 0.2440944881889764],
    [8, 0.7338466882816118],
    [11, 0.022058823529411766],
  ],
  e: [
    [0, 0.01312004499419488],
    [5, -1.2251564463762044],
    [6, -0.4957589496572502],
    [7, 1.6643771824549864],
    [8, -0.35032884874997366],
    [9, 0.3341791187130175],
    [10, 0.08192320648511571],
    [11, -0.022355307863886294],
  ],
};

/** Prepares a table for the stage loop. */
function explicit_method(method) {
  const { a, b, e, b3 } = method;
  const weights = new Float64Array(method.c.length);
  for (const [stage, weight] of b) weights[stage] = weight;
  return {
    ...method,
    explicit: true,
    rows: a.map(tableau_row),
    result: tableau_row(b),
    weights,
    error: e && tableau_row(e),
    third: b3 && tableau_row(b3),
  };
}

/**
 * The methods by name.
 *
 * `fixed`: the accuracy is the size of a step, else a tolerance. `order`: that of the step, `error_order`
 * that of its error estimate. `control`: constants of the controller. `panels`: parts in which a step is
 * scanned for events. `teaching`: a method that shows a failure rather than one to be chosen.
 */
const METHODS = {
  euler: { name: "semi-implicit Euler (order 1)", order: 1, fixed: true, panels: 4, kind: "semi_implicit" },
  rk4: explicit_method({
    name: "RK4 (order 4)",
    order: 4,
    fixed: true,
    panels: 4,
    c: [0, 0.5, 0.5, 1],
    a: [[[0, 0.5]], [[1, 0.5]], [[2, 1]]],
    b: [
      [0, 1 / 6],
      [1, 1 / 3],
      [2, 1 / 3],
      [3, 1 / 6],
    ],
  }),
  dp5: explicit_method({
    name: "Dormand–Prince 5(4)",
    order: 5,
    error_order: 4,
    panels: 4,
    first_same_as_last: true,
    control: { safety: 0.9, beta: 0.04, shrink: 0.2, grow: 10 },
    ...DORMAND_PRINCE_5,
  }),
  dop853: explicit_method({
    name: "DOP853 (order 8)",
    order: 8,
    error_order: 7,
    panels: 8,
    control: { safety: 0.9, beta: 0, shrink: 0.333, grow: 6 },
    ...DOP853,
  }),
  midpoint: { name: "implicit midpoint (order 2)", order: 2, fixed: true, panels: 4, kind: "midpoint" },
  explicit_euler: explicit_method({
    name: "explicit Euler (order 1)",
    order: 1,
    fixed: true,
    panels: 4,
    teaching: true,
    c: [0],
    a: [],
    b: [[0, 1]],
  }),
  heun: explicit_method({
    name: "Heun (order 2)",
    order: 2,
    fixed: true,
    panels: 4,
    teaching: true,
    c: [0, 1],
    a: [[[0, 1]]],
    b: [
      [0, 0.5],
      [1, 0.5],
    ],
  }),
};

/** Most stages that are kept of a step. */
const MOST_STAGES = 12;

/** Errors below this count as this large in the next step: that of `dopri5.f`. */
const MIN_PREVIOUS_ERROR = 1e-4;

/** Step control by a PI controller, as `dynamics-runtime/src/integrate/controller.rs`. */
class Controller {
  constructor(settings, error_order) {
    this.settings = settings;
    this.alpha = 1 / (error_order + 1) - 0.75 * settings.beta;
    this.restart();
  }

  /** Forgets the history, after a discontinuity. */
  restart() {
    this.previous = MIN_PREVIOUS_ERROR;
    this.rejected = false;
    this.factor = 1;
  }

  /** Whether a step with this error is accepted; `factor` is then that of the next step size. */
  judge(error) {
    const { safety, beta, shrink, grow } = this.settings;
    const integral = Math.pow(Math.max(error, 1e-300), this.alpha);
    if (error <= 1) {
      const wanted = (safety * Math.pow(this.previous, beta)) / integral;
      const factor = Math.min(Math.max(wanted, shrink), grow);
      this.previous = Math.max(error, MIN_PREVIOUS_ERROR);
      this.factor = this.rejected ? Math.min(factor, 1) : factor;
      this.rejected = false;
      return true;
    }
    this.rejected = true;
    this.factor = Math.min(Math.max(safety / integral, shrink), 1);
    return false;
  }
}

/** The increment for a difference quotient: √ε of the element's scale, and representable. */
function difference_increment(x, largest) {
  const size = Math.max(Math.abs(x), 1e-2 * largest, 1e-3);
  return x + 1.4901161193847656e-8 * size - x;
}

/**
 * When a fixed-point iteration has reached rounding, as
 * `dynamics-runtime/src/integrate/geometric/fixed_point.rs` decides it.
 */
class FixedPoint {
  constructor() {
    this.previous = Infinity;
    this.smallest = Infinity;
    this.left = 100;
    this.stalled = 0;
  }

  /** `size`: the correction as a part of what the step changes; `rounding`: that which rounding may cause. */
  judge(size, rounding) {
    const previous = this.previous;
    this.previous = size;
    this.stalled = size < 0.9 * this.smallest ? 0 : this.stalled + 1;
    if (size < this.smallest) this.smallest = size;
    this.left--;
    const at_rounding = size >= previous && size < Math.max(1e-12, rounding);
    if (size === 0 || at_rounding || (this.stalled >= 10 && size < 1e-9)) return "converged";
    const diverges = this.left === 0 || size !== size || size > 1e3 * Math.max(this.smallest, rounding);
    return diverges ? "diverged" : "continue";
  }
}
