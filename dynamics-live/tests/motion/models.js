// Models written by hand in the form in which the macro prints them, for the checks of the runtime.

const named = (names, more = {}) => names.map((name) => ({ name, unit: "", ...more }));
const valued = (values) => Object.entries(values).map(([name, value]) => ({ name, unit: "", value }));
const program = (results, run, constants = 0, hoist = undefined) => ({ results, constants, run, hoist });
const sizes = (coordinates, more = {}) => ({
  coordinates,
  parameters: 0,
  inputs: 0,
  rows: 0,
  holonomic: 0,
  switched: 0,
  speeds: 0,
  ...more,
});

const MODELS = {
  double_pendulum: [
    {
      sizes: sizes(2, { parameters: 5 }),
      accelerations: program(
        6,
        (p, k, f, t, q, u, w, m, a, l, out) => {
          const s0 = sin_cos(q[0]),
            c0 = cosine[0],
            s1 = sin_cos(q[1]),
            c1 = cosine[0];
          const v1 = s0 * s1 + c0 * c1,
            v2 = k[2] * v1,
            v3 = k[0] - k[1] * v1 * v2,
            v4 = c0 * s1 - s0 * c1;
          const v5 = k[4] * s1 + k[1] * (u[0] * u[0] * v4);
          const v6 = (1 / v3) * (k[1] * (v4 * (u[1] * u[1])) - k[3] * s0 + ((v5 * v2) / k[2]) * k[2]);
          out[0] = v6;
          out[1] = -(k[5] * v5 + v2 * v6);
          out[2] = v3;
          out[3] = k[0];
          out[4] = 1 / k[5];
          out[5] = 1 / k[5];
        },
        6,
        (p, f, k) => {
          const [m1, m2, l1, l2, g] = p,
            c1 = l1 * l1 * (m1 + m2),
            c2 = l2 * (m2 * l1),
            c3 = m2 * (l2 * l2);
          k.set([c1, c2, c2 / c3, g * (m1 * l1) + l1 * (m2 * g), l2 * (m2 * g), 1 / c3]);
        },
      ),
      kinetic_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        const [m1, m2, l1, l2] = p,
          s0 = sin_cos(q[0]),
          c0 = cosine[0],
          s1 = sin_cos(q[1]),
          c1 = cosine[0];
        const x = l1 * c0 * u[0],
          y = l1 * s0 * u[0],
          x2 = x + l2 * c1 * u[1],
          y2 = y + l2 * s1 * u[1];
        out[0] = 0.5 * m1 * (x * x + y * y) + 0.5 * m2 * (x2 * x2 + y2 * y2);
      }),
      potential_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        const [m1, m2, l1, l2, g] = p,
          c0 = cos(q[0]),
          c1 = cos(q[1]);
        out[0] = -g * (m1 * l1 * c0 + m2 * (l1 * c0 + l2 * c1));
      }),
      mass_matrix: program(4, (p, k, f, t, q, u, w, m, a, l, out) => {
        const [m1, m2, l1, l2] = p,
          c = m2 * l1 * l2 * cos(q[0] - q[1]);
        out.set([(m1 + m2) * l1 * l1, c, c, m2 * l2 * l2]);
      }),
      points: Object.assign(
        program(4, (p, k, f, t, q, u, w, m, a, l, out) => {
          out[0] = p[2] * sin(q[0]);
          out[1] = -p[2] * cos(q[0]);
          out[2] = out[0] + p[3] * sin(q[1]);
          out[3] = out[1] - p[3] * cos(q[1]);
        }),
        { names: ["bob1", "bob2"], dimensions: [2, 2] },
      ),
      assumptions: program(2, (p, k, f, t, q, u, w, m, a, l, out) => out.set([p[0], p[1]])),
    },
    {
      name: "DoublePendulum",
      coordinates: named(["theta1", "theta2"], { unit: "rad", angle: true }),
      pivots: [0, 1],
      parameters: valued({ m1: 1, m2: 1, l1: 1, l2: 1, g: 9.81 }),
      assumptions: [
        { kind: "mass", constant: true, text: "the mass of a body in `kinetic`, given by `m1`" },
        { kind: "mass", constant: true, text: "the mass of a body in `kinetic`, given by `m2`" },
      ],
    },
  ],

  // ẍ = −ω² x with a damper c, whose power is declared.
  oscillator: [
    {
      sizes: sizes(1, { parameters: 2 }),
      accelerations: program(3, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = -p[0] * q[0] - p[1] * u[0];
        out[1] = out[2] = 1;
      }),
      kinetic_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = 0.5 * u[0] * u[0])),
      potential_energy: program(
        1,
        (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = 0.5 * p[0] * q[0] * q[0]),
      ),
      powers: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = -p[1] * u[0] * u[0])),
      events: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = q[0])),
    },
    {
      name: "Oscillator",
      coordinates: named(["x"], { unit: "m" }),
      parameters: valued({ stiffness: 1, damping: 0 }),
      pivots: [0],
      events: named(["centre"]),
    },
  ],

  // A bob at (x, y) on a rod: ½(x² + y² − l²) = 0.
  cartesian_pendulum: [
    {
      sizes: sizes(2, { parameters: 3, rows: 1, holonomic: 1 }),
      accelerations: program(5, (p, k, f, t, q, u, w, m, a, l, out) => {
        const square = q[0] * q[0] + q[1] * q[1];
        const lambda = (p[0] * (p[2] * q[1] - (u[0] * u[0] + u[1] * u[1]))) / square;
        out[0] = (lambda * q[0]) / p[0];
        out[1] = (lambda * q[1]) / p[0] - p[2];
        out[2] = lambda;
        out[3] = square;
        out[4] = p[1] * p[1];
      }),
      correction: program(4, (p, k, f, t, q, u, w, m, a, l, out) => {
        const square = q[0] * q[0] + q[1] * q[1];
        out[0] = (l[0] * q[0]) / square;
        out[1] = (l[0] * q[1]) / square;
        out[2] = square;
        out[3] = p[1] * p[1];
      }),
      terms: program(9, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.set([p[0], 0, 0, p[0], 0, -p[0] * p[2], q[0], q[1], -(u[0] * u[0] + u[1] * u[1])]);
      }),
      residual: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - p[1] * p[1]);
      }),
      velocity_residual: program(
        1,
        (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = q[0] * u[0] + q[1] * u[1]),
      ),
      jacobian: program(2, (p, k, f, t, q, u, w, m, a, l, out) => out.set([q[0], q[1]])),
      kinetic_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = 0.5 * p[0] * (u[0] * u[0] + u[1] * u[1]);
      }),
      potential_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = p[0] * p[2] * q[1])),
      points: Object.assign(
        program(2, (p, k, f, t, q, u, w, m, a, l, out) => out.set([q[0], q[1]])),
        { names: ["bob"], dimensions: [2] },
      ),
    },
    {
      name: "CartesianPendulum",
      coordinates: named(["x", "y"], { unit: "m" }),
      parameters: valued({ m: 1, l: 1, g: 9.81 }),
      rows: [{ name: "rod", holonomic: true }],
    },
  ],

  // A parallelogram of three equal bars on a base of length b: angles a, b, c; the coupler stays parallel.
  // The third crank in the middle repeats what the two others hold.
  redundant_four_bar: [
    {
      sizes: sizes(3, { parameters: 2, rows: 4, holonomic: 4 }),
      accelerations: { results: 0, constants: 0, run() {} },
      terms: program(9 + 3 + 12 + 4, (p, k, f, t, q, u, w, m, a, l, out) => {
        const [L, g] = p,
          at = [sin(q[0]), cos(q[0]), sin(q[1]), cos(q[1]), sin(q[2]), cos(q[2])];
        out.fill(0);
        for (let i = 0; i < 3; i++) {
          out[4 * i] = L * L;
          out[9 + i] = -L * g * at[2 * i + 1];
        }
        // Rows: end of crank 0 less end of crank 1 is (0, 0) beside the base, likewise 0 and 2.
        const rows = 12,
          gamma = 24;
        for (let pair = 0; pair < 2; pair++) {
          const other = pair + 1,
            s0 = L * at[0],
            c0 = L * at[1],
            s1 = L * at[2 * other],
            c1 = L * at[2 * other + 1];
          out[rows + 6 * pair] = -s0;
          out[rows + 6 * pair + other] = s1;
          out[rows + 6 * pair + 3] = c0;
          out[rows + 6 * pair + 3 + other] = -c1;
          out[gamma + 2 * pair] = c0 * u[0] * u[0] - c1 * u[other] * u[other];
          out[gamma + 2 * pair + 1] = s0 * u[0] * u[0] - s1 * u[other] * u[other];
        }
      }),
      residual: program(4, (p, k, f, t, q, u, w, m, a, l, out) => {
        for (let i = 1; i < 3; i++) {
          out[2 * i - 2] = p[0] * (cos(q[0]) - cos(q[i]));
          out[2 * i - 1] = p[0] * (sin(q[0]) - sin(q[i]));
        }
      }),
      velocity_residual: program(4, (p, k, f, t, q, u, w, m, a, l, out) => {
        for (let i = 1; i < 3; i++) {
          out[2 * i - 2] = p[0] * (-sin(q[0]) * u[0] + sin(q[i]) * u[i]);
          out[2 * i - 1] = p[0] * (cos(q[0]) * u[0] - cos(q[i]) * u[i]);
        }
      }),
      jacobian: program(12, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.fill(0);
        for (let i = 1; i < 3; i++) {
          const x = 6 * (i - 1);
          out[x] = -p[0] * sin(q[0]);
          out[x + i] = p[0] * sin(q[i]);
          out[x + 3] = p[0] * cos(q[0]);
          out[x + 3 + i] = -p[0] * cos(q[i]);
        }
      }),
      kinetic_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = 0.5 * p[0] * p[0] * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
      }),
      potential_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = p[0] * p[1] * (sin(q[0]) + sin(q[1]) + sin(q[2]));
      }),
    },
    {
      name: "RedundantFourBar",
      coordinates: named(["a", "b", "c"], { unit: "rad", angle: true }),
      parameters: valued({ l: 1, g: 9.81 }),
      rows: ["first.x", "first.y", "second.x", "second.y"].map((name) => ({
        name,
        holonomic: true,
        redundant: true,
      })),
    },
  ],

  // A ball above the ground y = 0.
  ball: [
    {
      sizes: sizes(2, { parameters: 1, rows: 1, holonomic: 1, switched: 1 }),
      accelerations: program(5, (p, k, f, t, q, u, w, m, a, l, out) => out.set([0, 0, p[0], 1, 1])),
      correction: program(4, (p, k, f, t, q, u, w, m, a, l, out) => out.set([0, l[0], 1, 1])),
      released: [
        {
          modes: [0],
          accelerations: program(3, (p, k, f, t, q, u, w, m, a, l, out) => out.set([0, -p[0], 0])),
          correction: program(2, (p, k, f, t, q, u, w, m, a, l, out) => out.set([0, 0])),
        },
      ],
      terms: program(9, (p, k, f, t, q, u, w, m, a, l, out) => out.set([1, 0, 0, 1, 0, -p[0], 0, 1, 0])),
      residual: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = q[1])),
      velocity_residual: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = u[1])),
      jacobian: program(2, (p, k, f, t, q, u, w, m, a, l, out) => out.set([0, 1])),
      kinetic_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = 0.5 * (u[0] * u[0] + u[1] * u[1]);
      }),
      potential_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = p[0] * q[1])),
    },
    {
      name: "Ball",
      coordinates: named(["x", "y"], { unit: "m" }),
      parameters: valued({ g: 10 }),
      rows: [{ name: "ground", holonomic: true, switched: 0 }],
      contacts: [{ event: null, row: 0, restitution: 0.5 }],
      stick_slip: [],
    },
  ],

  // A block on a belt with speed v, on a spring: sticks (row u − v = 0) and slips with friction −μ m g
  // side.
  belt: [
    {
      sizes: sizes(1, { parameters: 4, rows: 1, holonomic: 0, switched: 1 }),
      accelerations: program(4, (p, k, f, t, q, u, w, m, a, l, out) => out.set([0, p[0] * q[0], 1, 1])),
      correction: program(3, (p, k, f, t, q, u, w, m, a, l, out) => out.set([l[0], 1, 1])),
      released: [
        {
          modes: [0],
          accelerations: program(2, (p, k, f, t, q, u, w, m, a, l, out) =>
            out.set([-p[0] * q[0] - p[2] * m[0], 0]),
          ),
          correction: program(1, (p, k, f, t, q, u, w, m, a, l, out) => out.set([0])),
        },
      ],
      terms: program(4, (p, k, f, t, q, u, w, m, a, l, out) =>
        out.set([1, -p[0] * q[0] - p[2] * m[0], 1, 0]),
      ),
      velocity_residual: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = u[0] - p[1])),
      jacobian: program(1, (p, k, f, t, q, u, w, m, a, l, out) => out.set([1])),
      events: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = p[3] - Math.abs(l[0]))),
    },
    {
      name: "Belt",
      coordinates: named(["x"], { unit: "m" }),
      parameters: valued({ stiffness: 1, speed: 0.2, kinetic: 0.5, static: 0.8 }),
      rows: [{ name: "belt", holonomic: false, switched: 0 }],
      events: named(["breakaway"]),
      contacts: [],
      stick_slip: [{ event: 0, row: 0 }],
    },
  ],

  // A block on rough ground: x along it, y off it; Q_x = F − μ |λ| where it slides forwards. No solution
  // of its own.
  rubbing_block: [
    {
      sizes: sizes(2, { parameters: 3, rows: 1, holonomic: 1 }),
      accelerations: { results: 0, constants: 0, run() {} },
      terms: program(9, (p, k, f, t, q, u, w, m, a, l, out) => out.set([1, 0, 0, 1, p[0], -p[2], 0, 1, 0])),
      friction: program(4, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.set([p[0] - p[1] * Math.abs(l[0]), -p[2], -p[1] * signum(l[0]), 0]);
      }),
      residual: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = q[1])),
      velocity_residual: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = u[1])),
      jacobian: program(2, (p, k, f, t, q, u, w, m, a, l, out) => out.set([0, 1])),
    },
    {
      name: "RubbingBlock",
      coordinates: named(["x", "y"], { unit: "m" }),
      parameters: valued({ force: 3, friction: 0.25, g: 10 }),
      rows: [{ name: "ground", holonomic: true }],
    },
  ],

  // A ball on a table that moves up and down: Φ = y − A sin ωt. Without the released solution of its own.
  table: [
    {
      sizes: sizes(1, { parameters: 3, rows: 1, holonomic: 1, switched: 1 }),
      accelerations: program(4, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = -p[0] * p[1] * p[1] * sin(p[1] * t);
        out[1] = out[0] + p[2];
        out[2] = out[3] = 1;
      }),
      terms: program(4, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.set([1, -p[2], 1, -p[0] * p[1] * p[1] * sin(p[1] * t)]);
      }),
      residual: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = q[0] - p[0] * sin(p[1] * t))),
      velocity_residual: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = u[0] - p[0] * p[1] * cos(p[1] * t);
      }),
      jacobian: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = 1)),
    },
    {
      name: "Table",
      coordinates: named(["y"], { unit: "m" }),
      parameters: valued({ amplitude: 0.2, omega: 10, g: 10 }),
      rows: [{ name: "table", holonomic: true, switched: 0 }],
      contacts: [{ event: null, row: 0, restitution: 0 }],
    },
  ],

  // A bar of length 2 and mass 1 above the ground, its ends are contacts: y ± sin φ ≥ 0.
  bar: [
    {
      sizes: sizes(3, { parameters: 1, rows: 2, holonomic: 2, switched: 2 }),
      accelerations: { results: 0, constants: 0, run() {} },
      terms: program(9 + 3 + 6 + 2, (p, k, f, t, q, u, w, m, a, l, out) => {
        const s = sin_cos(q[2]),
          c = cosine[0];
        out.set([
          1,
          0,
          0,
          0,
          1,
          0,
          0,
          0,
          1 / 3,
          0,
          -p[0],
          0,
          0,
          1,
          -c,
          0,
          1,
          c,
          -s * u[2] * u[2],
          s * u[2] * u[2],
        ]);
      }),
      residual: program(2, (p, k, f, t, q, u, w, m, a, l, out) =>
        out.set([q[1] - sin(q[2]), q[1] + sin(q[2])]),
      ),
      velocity_residual: program(2, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.set([u[1] - cos(q[2]) * u[2], u[1] + cos(q[2]) * u[2]]);
      }),
      jacobian: program(6, (p, k, f, t, q, u, w, m, a, l, out) =>
        out.set([0, 1, -cos(q[2]), 0, 1, cos(q[2])]),
      ),
      kinetic_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = 0.5 * (u[0] * u[0] + u[1] * u[1] + (u[2] * u[2]) / 3);
      }),
      potential_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = p[0] * q[1])),
      points: Object.assign(
        program(2, (p, k, f, t, q, u, w, m, a, l, out) => out.set([q[0], q[1]])),
        { names: ["centre"], dimensions: [2] },
      ),
    },
    {
      name: "Bar",
      coordinates: named(["x", "y", "phi"]),
      parameters: valued({ g: 10 }),
      rows: [
        { name: "left", holonomic: true, switched: 0 },
        { name: "right", holonomic: true, switched: 1 },
      ],
      contacts: [
        { event: null, row: 0, restitution: 0.5 },
        { event: null, row: 1, restitution: 0.5 },
      ],
    },
  ],

  // A block on a rough floor between two walls, of which the second comes nearer: x ≥ 0 and d − v t − x
  // ≥ 0.
  walls: [
    {
      sizes: sizes(1, { parameters: 4, rows: 3, holonomic: 2, switched: 3 }),
      accelerations: { results: 0, constants: 0, run() {} },
      terms: program(1 + 1 + 3 + 3, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.set([1, -p[2] * m[2], 1, -1, 1, 0, 0, 0]);
      }),
      residual: program(2, (p, k, f, t, q, u, w, m, a, l, out) => out.set([q[0], p[0] - p[1] * t - q[0]])),
      velocity_residual: program(3, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.set([u[0], -p[1] - u[0], u[0]]);
      }),
      jacobian: program(3, (p, k, f, t, q, u, w, m, a, l, out) => out.set([1, -1, 1])),
      events: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = p[3] - Math.abs(l[2]))),
    },
    {
      name: "Walls",
      coordinates: named(["x"], { unit: "m" }),
      parameters: valued({ distance: 1, speed: 0, kinetic: 2, static: 2.5 }),
      rows: [
        { name: "left", holonomic: true, switched: 0 },
        { name: "right", holonomic: true, switched: 1 },
        { name: "floor", holonomic: false, switched: 2 },
      ],
      events: named(["breakaway"]),
      contacts: [
        { event: null, row: 0, restitution: 0.9 },
        { event: null, row: 1, restitution: 0.9 },
      ],
      stick_slip: [{ event: 0, row: 2 }],
    },
  ],

  // Two equal cranks on a base of length 2 and a coupler of length 2: flat at a = b = c = 0, where it may
  // also go on as an antiparallelogram.
  parallelogram: [
    {
      sizes: sizes(3, { parameters: 0, rows: 2, holonomic: 2 }),
      accelerations: { results: 0, constants: 0, run() {} },
      terms: program(9 + 3 + 6 + 2, (p, k, f, t, q, u, w, m, a, l, out) => {
        const [sa, sb, sc] = [sin(q[0]), sin(q[1]), sin(q[2])],
          [ca, cb, cc] = [cos(q[0]), cos(q[1]), cos(q[2])];
        const [x, y, z] = [u[0] * u[0], u[1] * u[1], 4 * u[2] * u[2]];
        // Coupler: m = 1, its centre at the first crank's end plus (cos c, sin c).
        const m00 = 1 / 3 + 1,
          m02 = cos(q[0] - q[2]),
          s02 = sin(q[0] - q[2]);
        out.set([m00, 0, m02, 0, 1 / 3, 0, m02, 0, 1 + 1 / 3, -s02 * u[2] * u[2], 0, s02 * x]);
        out.set([-sa, sb, -2 * sc, ca, -cb, 2 * cc], 12);
        out.set([ca * x - cb * y + (cc * z) / 2, sa * x - sb * y + (sc * z) / 2], 18);
      }),
      residual: program(2, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.set([cos(q[0]) - cos(q[1]) + 2 * cos(q[2]) - 2, sin(q[0]) - sin(q[1]) + 2 * sin(q[2])]);
      }),
      velocity_residual: program(2, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = -sin(q[0]) * u[0] + sin(q[1]) * u[1] - 2 * sin(q[2]) * u[2];
        out[1] = cos(q[0]) * u[0] - cos(q[1]) * u[1] + 2 * cos(q[2]) * u[2];
      }),
      jacobian: program(6, (p, k, f, t, q, u, w, m, a, l, out) => {
        out.set([-sin(q[0]), sin(q[1]), -2 * sin(q[2]), cos(q[0]), -cos(q[1]), 2 * cos(q[2])]);
      }),
      kinetic_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => {
        const mixed = u[0] * u[2] * cos(q[0] - q[2]);
        out[0] = 0.5 * ((4 / 3) * u[0] * u[0] + (u[1] * u[1]) / 3 + (4 / 3) * u[2] * u[2]) + mixed;
      }),
      potential_energy: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = 0)),
    },
    {
      name: "Parallelogram",
      coordinates: named(["a", "b", "c"], { unit: "rad", angle: true }),
      parameters: [],
      rows: [
        { name: "loop.x", holonomic: true, redundant: false },
        { name: "loop.y", holonomic: true, redundant: false },
      ],
    },
  ],

  // A block on a slope: ẍ = pull − μ sign ẋ.
  dry_friction: [
    {
      sizes: sizes(1, { parameters: 2 }),
      accelerations: program(3, (p, k, f, t, q, u, w, m, a, l, out) => {
        out[0] = p[0] - p[1] * signum(u[0]);
        out[1] = out[2] = 1;
      }),
      kinks: program(1, (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = u[0])),
      kink_functions: [null],
    },
    {
      name: "DryFriction",
      coordinates: named(["x"], { unit: "m" }),
      parameters: valued({ pull: 1, friction: 3 }),
    },
  ],
};
