// Models with families: loops over elements, whose counts are known when the page is made.
//
// The macro prints a function of the counts that returns loops; `family` makes of them the programs that
// every model has, so that the rest of the scripts need not know. Sums go block by block as in
// `dynamics-families/src/generated.rs`, and steps of Runge–Kutta methods are made with accelerations alone,
// as in `dynamics-families/src/integrate/explicit.rs`: with the same bits where M is diagonal.

/** Elements that are handled together, and those at the edges of grids. */
const BLOCK = 256,
  EDGE = 64;
/** Points of a line that are drawn, lines of a grid in either direction, and points of each of these. */
const MOST_LINE_POINTS = 400,
  MOST_GRID_LINES = 13,
  MOST_GRID_POINTS = 25;
/** Up to so many points have dots; so many points of a line, or of a row of a grid, can be taken hold of. */
const MOST_DOTS = 24,
  MOST_HELD = 100,
  MOST_HELD_IN_ROW = 12;
/** h ω up to which oscillations of explicit methods with fixed steps stay bounded. */
const STABILITY_BORDERS = { verlet: 2, rk4: 2.82842712474619 };
/** With stiff springs: if a correction below this part of a step's change stops falling, it is rounding. */
const STIFF_ROUNDING = 1e-7;
/** Radius of the half disc of h λ, on the side of decay, in which RK4 is stable. */
const RK4_HALF_DISC = 2.6;

// ---- what loops are made of

const room = (length) => new Float64Array(Math.max(0, length));
const blocks = [room(BLOCK), room(BLOCK)],
  edges = [];
const edge = (k) => (edges[k] ??= room(EDGE));

/** The reciprocal of the root that `root` returned last. */
const reciprocal = new Float64Array(1);
const root_bits = new Float64Array(1),
  root_words = new Uint32Array(root_bits.buffer);

/** √x; leaves 1/√x in `reciprocal[0]`. With the bits of `dynamics-simd/src/reciprocal_root.rs`. */
function root(x) {
  if (!(x >= 2.2250738585072014e-308 && x <= Number.MAX_VALUE)) {
    const r = Math.sqrt(x);
    reciprocal[0] = 1 / r;
    return r;
  }
  // 0x5fe6eb50c7b537a9 less half of the bits of x.
  root_bits[0] = x;
  const low = root_words[0],
    high = root_words[1],
    difference = 0xc7b537a9 - (((low >>> 1) | (high << 31)) >>> 0);
  root_words[0] = difference;
  root_words[1] = 0x5fe6eb50 - (high >>> 1) - (difference < 0 ? 1 : 0);
  const guess = root_bits[0],
    s = x * guess * guess;
  const y = guess * (1.87659834 + s * (-1.25210034 + s * 0.37550221));
  const r = 1 - x * y * y;
  reciprocal[0] = y + y * (r * (0.5 + r * (0.375 + r * 0.3125)));
  return x * reciprocal[0];
}

/** The indices from `start` to before `end` that are not in the range from `stop` to before `again`. */
function outside(start, end, stop, again) {
  const first = Math.min(Math.max(stop, start), end);
  return [
    [start, first],
    [Math.max(first, again), end],
  ];
}

/** The sum of at most a block: eight sums side by side, then those pairwise. */
function block_sum(values, from, to) {
  let [a, b, c, d, e, f, g, h] = [0, 0, 0, 0, 0, 0, 0, 0],
    i = from;
  for (; i + 8 <= to; i += 8) {
    a += values[i];
    b += values[i + 1];
    c += values[i + 2];
    d += values[i + 3];
    e += values[i + 4];
    f += values[i + 5];
    g += values[i + 6];
    h += values[i + 7];
  }
  if (i < to) a += values[i];
  if (i + 1 < to) b += values[i + 1];
  if (i + 2 < to) c += values[i + 2];
  if (i + 3 < to) d += values[i + 3];
  if (i + 4 < to) e += values[i + 4];
  if (i + 5 < to) f += values[i + 5];
  if (i + 6 < to) g += values[i + 6];
  return a + e + (c + g) + (b + f + (d + h));
}

/** A sum of the sums of blocks, pairwise. Blocks have to come in order. */
class BlockSum {
  constructor() {
    this.levels = new Float64Array(64);
    this.begin();
  }

  begin() {
    this.count = 0;
    return this;
  }

  add(block) {
    let carried = block,
      level = 0;
    for (let rest = this.count; rest & 1; rest >>>= 1) carried += this.levels[level++];
    this.levels[level] = carried;
    this.count++;
  }

  total() {
    let sum = 0;
    for (let level = 0; this.count >>> level > 0; level++) {
      if ((this.count >>> level) & 1) sum += this.levels[level];
    }
    return sum;
  }
}
const sums = [new BlockSum(), new BlockSum(), new BlockSum()];

/** The sum over the rounds from `start` to before `end`, in the blocks of nodes that the Rust loops have. */
function sum_of_rounds(values, start, end, first, last, top, negative) {
  const sum = sums[2].begin();
  for (let from = 0; from < top; ) {
    let to = Math.min(from + BLOCK, top);
    if (from < first) to = Math.min(to, first);
    else if (from < last) to = Math.min(to, last);
    const [low, high] = [Math.max(from, start), Math.min(to, end)];
    if (low < high) {
      const block = block_sum(values, low - start, high - start);
      sum.add(negative ? -block : block);
    }
    from = to;
  }
  return sum.total();
}

// ---- the mass matrix

/**
 * M = L Lᵀ by rows from the first entry that is not zero: unknowns go node by node, ordinary coordinates
 * come last. The factor lies in the constants of a program.
 */
class Profile {
  constructor(n, fields, each) {
    const order = [];
    fields.forEach(({ from, rows, columns, numbered }, field) => {
      for (let k = 0; k < rows * columns; k++) order.push([numbered ? k : Infinity, field, from + k]);
    });
    order.sort((a, b) => (a[0] === b[0] ? a[1] - b[1] : a[0] - b[0]));
    this.n = n;
    this.place = new Int32Array(n);
    order.forEach(([, , unknown], place) => {
      this.place[unknown] = place;
    });
    this.first = Int32Array.from({ length: n }, (_, i) => i);
    each((row, column) => {
      const [i, j] = [this.place[row], this.place[column]];
      if (j < i && j < this.first[i]) this.first[i] = j;
    });
    // Where the entry of column 0 of a row would be.
    this.base = new Int32Array(n);
    let next = 0;
    for (let i = 0; i < n; i++) {
      this.base[i] = next - this.first[i];
      next += i - this.first[i] + 1;
    }
    this.length = next;
    this.ordered = room(n);
  }

  /**
   * Factors the matrix with these entries into `l`; the unknown of the least pivot, and the pivot. Ends at
   * the first pivot that is not positive.
   */
  factor(each, l) {
    const { n, first, base, place } = this;
    l.fill(0);
    each((row, column, value) => {
      const [i, j] = [place[row], place[column]];
      if (j <= i) l[base[i] + j] += value;
    });
    let [least, worst] = [Infinity, 0];
    for (let i = 0; i < n; i++) {
      const diagonal = l[base[i] + i];
      for (let j = first[i]; j <= i; j++) {
        const from = Math.max(first[i], first[j]);
        let sum = l[base[i] + j];
        for (let k = from; k < j; k++) sum -= l[base[i] + k] * l[base[j] + k];
        if (j < i) {
          l[base[i] + j] = sum / l[base[j] + j];
          continue;
        }
        const pivot = sum === 0 ? 0 : sum / Math.abs(diagonal);
        if (!(sum > 0)) return [place.indexOf(i), pivot];
        l[base[i] + i] = Math.sqrt(sum);
        if (pivot < least) [least, worst] = [pivot, i];
      }
    }
    return [place.indexOf(worst), least];
  }

  /** Replaces x by M⁻¹ x. */
  solve(l, x) {
    const { n, first, base, place, ordered: y } = this;
    for (let i = 0; i < n; i++) y[place[i]] = x[i];
    for (let i = 0; i < n; i++) {
      let sum = y[i];
      for (let j = first[i], at = base[i] + j; j < i; j++, at++) sum -= l[at] * y[j];
      y[i] = sum / l[base[i] + i];
    }
    for (let i = n - 1; i >= 0; i--) {
      const value = y[i] / l[base[i] + i];
      y[i] = value;
      for (let j = first[i], at = base[i] + j; j < i; j++, at++) y[j] -= l[at] * value;
    }
    for (let i = 0; i < n; i++) x[i] = y[place[i]];
  }
}

/** q̈ = M⁻¹ Q. Behind the accelerations stand a pivot of M and its scale. */
function accelerations_of(loops, pivots) {
  const { n, diagonal, fields } = loops,
    ones = room(n).fill(1);
  const each = (p, f) => (add) => loops.mass(p, f, add);
  const profile = diagonal ? null : new Profile(n, fields, (add) => loops.mass([], [], add));
  const size = diagonal ? n : profile.length;
  return {
    results: n + 2,
    constants: size + 1,
    hoist(p, f, k) {
      k.fill(0);
      if (diagonal) {
        loops.mass(p, f, (row, column, value) => {
          k[row] += value;
        });
        let least = 0;
        for (let i = 1; i < n && k[least] > 0; i++) if (!(k[i] >= k[least])) least = i;
        [pivots[0], k[size]] = [least, k[least]];
        for (let i = 0; i < n; i++) k[i] = 1 / k[i];
      } else {
        [pivots[0], k[size]] = profile.factor(each(p, f), k.subarray(0, size));
      }
    },
    run(p, k, f, t, q, u, w, m, a, l, out) {
      loops.forces(p, f, t, q, u, w, diagonal ? k : ones, out);
      if (!diagonal) profile.solve(k, out);
      out[n] = k[size];
      out[n + 1] = diagonal ? 0 : 1;
    },
  };
}

// ---- what is shown

/** At most so many of the indices from `start` to before `end`, the first and the last among them. */
function thinned([start, end], most) {
  const length = Math.max(0, end - start),
    kept = Math.min(length, most);
  return Array.from(
    { length: kept },
    (_, k) => start + Math.floor((k * (length - 1)) / Math.max(kept - 1, 1)),
  );
}

/** Lines through the nodes of a place: lists of indices, and whether they have dots. */
function lines_of({ ranges: [rows, columns] }) {
  if (columns === undefined) {
    const line = thinned(rows, MOST_LINE_POINTS).map((i) => [i, 0]);
    return [{ line, dots: line.length <= MOST_DOTS }];
  }
  const across = thinned(rows, MOST_GRID_LINES).map((i) =>
    thinned(columns, MOST_GRID_POINTS).map((j) => [i, j]),
  );
  const down = thinned(columns, MOST_GRID_LINES).map((j) =>
    thinned(rows, MOST_GRID_POINTS).map((i) => [i, j]),
  );
  return [...across, ...down].map((line) => ({ line, dots: false }));
}

/** A program that writes where the nodes of a list are: [place, i, j] each. */
function program_of_places(nodes) {
  const results = nodes.reduce((sum, [place]) => sum + place.dimension, 0);
  return {
    results,
    constants: 0,
    dimensions: nodes.map(([place]) => place.dimension),
    run(p, k, f, t, q, u, w, m, a, l, out) {
      let at = 0;
      for (const [place, i, j] of nodes) {
        place.run(p, f, t, q, u, w, i, j, out, at);
        at += place.dimension;
      }
    },
  };
}

/** The picture: lines through the places of the nodes, thinned out, and points to take hold of. */
function picture_of({ places }) {
  const nodes = [],
    figures = [],
    held = [],
    space = places.some(({ dimension }) => dimension === 3);
  let next = 0;
  places.forEach((place, k) => {
    const { dimension, ranges, name } = place,
      color = ["blue", "amber", "green", "purple", "teal"][k % 5],
      extra = space && dimension === 2 ? { dimension } : {};
    for (const { line, dots } of lines_of(place)) {
      figures.push(["polyline", [[next, dimension * line.length]], { color }, extra]);
      line.forEach(([i, j], at) => {
        nodes.push([place, i, j]);
        if (dots) figures.push(["dot", [[next + at * dimension, dimension]], { color }, extra]);
      });
      next += dimension * line.length;
    }
    const [rows, columns] = ranges,
      most = columns ? MOST_HELD_IN_ROW : MOST_HELD;
    for (const i of thinned(rows, most)) {
      for (const j of columns ? thinned(columns, most) : [0]) {
        const own = columns ? `${name}[${i}][${j}]` : `${name}[${i}]`;
        if (place.touched(i, j).length > 0) held.push({ name: own, node: [place, i, j] });
      }
    }
  });
  return { nodes, figures, held, space };
}

/** Names and units of the coordinates, node by node. */
function coordinates_of({ fields }, declared) {
  const all = [];
  fields.forEach(({ rows, columns, numbered }, k) => {
    const { name, grid, ...rest } = declared[k];
    for (let i = 0; i < rows * columns; i++) {
      const index = grid ? `[${Math.floor(i / columns)}][${i % columns}]` : numbered ? `[${i}]` : "";
      all.push({ ...rest, name: name + index, node: numbered });
    }
  });
  return all;
}

/** Names and units of the outputs, value by value. */
function outputs_of({ outputs }) {
  return outputs.flatMap(({ name, unit, suffixes, numbered, count }) =>
    Array.from({ length: count }, (_, k) => (numbered ? `${name}[${k}]` : name)).flatMap((own) =>
      suffixes.map((suffix) => ({ name: own + suffix, unit })),
    ),
  );
}

/** The programs of a model with families, as the macro prints those of others. */
function family(loops, { fields }) {
  const { n, outputs } = loops,
    pivots = [0],
    both = room(2),
    picture = picture_of(loops);
  const energy = (part) => ({
    results: 1,
    constants: 0,
    run(p, k, f, t, q, u, w, m, a, l, out) {
      loops.energies(p, f, t, q, u, w, both);
      out[0] = both[part];
    },
  });
  const programs = {
    sizes: { coordinates: n },
    model: {
      pivots,
      coordinates: coordinates_of(loops, fields),
      outputs: outputs_of(loops),
      powers: loops.balanced && !loops.conservative ? [{ name: "power", unit: "W" }] : [],
      space: picture.space,
      points: picture.held.map(({ name, node: [{ dimension }] }) => ({ name, dimension })),
    },
    family: { ...loops, held: picture.held.map(({ node }) => node) },
    accelerations: accelerations_of(loops, pivots),
  };
  // Where time or inputs change the energies themselves, their balance is not known.
  if (loops.balanced) {
    const energies = (p, k, f, t, q, u, w, m, a, l, out) => loops.energies(p, f, t, q, u, w, out);
    programs.energies = { results: 2, constants: 0, run: energies };
    programs.kinetic_energy = energy(0);
    programs.potential_energy = energy(1);
  }
  if (loops.balanced && !loops.conservative) {
    programs.powers = {
      results: 1,
      constants: 0,
      run: (p, k, f, t, q, u, w, m, a, l, out) => loops.powers(p, f, t, q, u, w, out),
    };
  }
  const values = programs.model.outputs.length;
  if (values > 0) {
    programs.outputs = {
      results: values,
      constants: 0,
      reads_accelerations: outputs.some(reads_accelerations),
      run(p, k, f, t, q, u, w, m, a, l, out) {
        let at = 0;
        for (const output of outputs) {
          output.run(p, f, t, q, u, w, a, out, at);
          at += output.count * output.suffixes.length;
        }
      },
    };
  }
  if (picture.nodes.length > 0) {
    programs.drawing = program_of_places(picture.nodes);
    programs.figures = picture.figures;
    if (picture.held.length > 0) programs.points = program_of_places(programs.family.held);
  }
  offer_methods(loops);
  return programs;
}

// ---- methods

/**
 * Störmer–Verlet, order 2: between steps the velocities are half a kick ahead, and a state gets its own
 * kick. Kicks that follow one another are one.
 */
const VERLET = {
  name: "Störmer–Verlet (order 2)",
  order: 2,
  fixed: true,
  panels: 4,
  first_same_as_last: true,
  attempt(stepper, h) {
    const { n, q, u, a, t, next, stage, system, plan } = stepper,
      ahead = (plan.ahead ??= { t: NaN, u: room(n), h: 0 });
    // Where the motion goes on from its last step, the kick of both is one.
    const goes_on = ahead.t === t && ahead.count === plan.count,
      kicked = stage.u[1];
    for (let i = 0; i < n; i++) {
      kicked[i] = goes_on ? ahead.u[i] + 0.5 * (ahead.h + h) * a[i] : u[i] + 0.5 * h * a[i];
      next.q[i] = q[i] + h * kicked[i];
    }
    const end = stage.k_u[6];
    if (!system.accelerate(t + h, next.q, kicked, end, stage.l[6])) return system.failure;
    for (let i = 0; i < n; i++) next.u[i] = kicked[i] + h * end[i] + -0.5 * h * end[i];
    plan.made = { t: t + h, h };
    return null;
  },
  /** Keeps what the next step goes on from. */
  accept(stepper) {
    const { plan, stage } = stepper;
    plan.ahead.u.set(stage.u[1]);
    Object.assign(plan.ahead, plan.made, { t: stepper.t, count: plan.count });
  },
};

/** Where M, D and K have entries. */
function tangent_profile(loops, each) {
  return (loops.tangent ??= new Profile(loops.n, loops.fields, each));
}

/**
 * The matrix of simplified Newton steps of the implicit midpoint rule, M + h D/2 + h² K/4, factored by rows;
 * null where it is not positive definite.
 */
const newton_ordinary = ImplicitMidpoint.prototype.newton_matrix;
ImplicitMidpoint.prototype.newton_matrix = function (h) {
  const { system, n, t, q, u, stage } = this.stepper,
    { p, f, w } = system,
    loops = system.programs.family;
  if (!loops) return newton_ordinary.call(this, h);
  // If springs are stiff, the accelerations at the beginning do not predict the end of a step.
  this.end.set(u);
  if (!this.evaluate(h, this.end)) return null;
  const state = [t + 0.5 * h, stage.q[1], stage.u[1], w];
  const each = (add) => {
    loops.mass(p, f, add);
    loops.damping(p, f, ...state, (row, column, value) => add(row, column, 0.5 * h * value));
    loops.stiffness(p, f, ...state, (row, column, value) => add(row, column, 0.25 * h * h * value));
  };
  const profile = tangent_profile(loops, each),
    l = room(profile.length),
    [, least] = profile.factor(each, l);
  if (!(least > 1e-14)) return null;
  return {
    rounding: STIFF_ROUNDING,
    solve(miss, step) {
      step.fill(0);
      loops.mass(p, f, (row, column, value) => {
        step[row] += value * miss[column];
      });
      profile.solve(l, step);
    },
  };
};

/** Offers the methods that suit the model. */
function offer_methods({ velocity_forces }) {
  delete METHODS.explicit_euler;
  delete METHODS.euler;
  delete METHODS.heun;
  if (!velocity_forces) METHODS.verlet = VERLET;
}

/**
 * Weights of accelerations: uᵢ = u + h Σ aᵢⱼ kⱼ, qᵢ = q + cᵢ h u + h² Σ (A²)ᵢⱼ kⱼ.
 */
function weights_of_accelerations({ a, b, c }) {
  const stages = c.length,
    dense = (pairs) => {
      const row = room(stages);
      for (const [stage, weight] of pairs) row[stage] = weight;
      return row;
    };
  const square = [[], ...a, ...(a.length + 1 < stages ? [b] : [])].map(dense);
  const row = (pairs, node) => {
    const own = dense(pairs),
      terms = [];
    for (let l = 0; l < stages; l++) {
      let position = 0;
      for (let j = 0; j < stages; j++) position += own[j] * square[j][l];
      if (own[l] !== 0 || position !== 0) terms.push([l, own[l], position]);
    }
    return {
      node,
      stages: Int32Array.from(terms, (term) => term[0]),
      velocity: Float64Array.from(terms, (term) => term[1]),
      position: Float64Array.from(terms, (term) => term[2]),
    };
  };
  return { rows: a.map((pairs, s) => row(pairs, c[s + 1])), result: row(b, 1) };
}
for (const method of Object.values(METHODS)) {
  if (!method.explicit) continue;
  const { rows, result } = weights_of_accelerations(method);
  method.rows.forEach((row, s) => {
    row.family = rows[s];
  });
  method.result.family = result;
}

const combine_ordinary = Stepper.prototype.combine;
Stepper.prototype.combine = function (to_q, to_u, h, row) {
  if (!this.system.programs.family) {
    combine_ordinary.call(this, to_q, to_u, h, row);
    return;
  }
  const { n, q, u } = this,
    { stages, velocity, position, node } = row.family,
    drift = node * h;
  to_q.fill(0);
  to_u.fill(0);
  for (let j = 0; j < stages.length; j++) {
    const k = this.stage.k_u[stages[j]],
      of_q = position[j],
      of_u = velocity[j];
    for (let i = 0; i < n; i++) {
      to_q[i] += of_q * k[i];
      to_u[i] += of_u * k[i];
    }
  }
  for (let i = 0; i < n; i++) {
    to_q[i] = q[i] + (drift * u[i] + h * h * to_q[i]);
    to_u[i] = u[i] + h * to_u[i];
  }
};

/** Work of all forces in a step of Störmer–Verlet: by the powers at its ends, of the same order. */
const work_ordinary = Motion.prototype.work_of_step;
Motion.prototype.work_of_step = function (h) {
  if (this.plan.method !== VERLET) return work_ordinary.call(this, h);
  if (this.work_values.length === 0) return 0;
  const { from } = this;
  return 0.5 * h * (this.power(from.t, from.q, from.u) + this.power(this.t, this.q, this.u));
};

/** Halvings of an enclosure of the largest frequency. */
const ENCLOSURE_STEPS = 12;

/**
 * A bound of xᵀ A x / xᵀ M x where M is not dominant on its diagonal: for all λ above it λ M − A is
 * positive definite. `entries` of A are symmetric.
 */
function enclosed({ system: { p, f, w }, t, q, u, programs: { family: loops } }, entries) {
  const mass = (add) => loops.mass(p, f, add);
  const profile = tangent_profile(loops, (add) => {
    mass(add);
    loops.stiffness(p, f, t, q, u, w, add);
    loops.damping(p, f, t, q, u, w, add);
  });
  const l = room(profile.length);
  const is_above = (bound) => {
    const each = (add) => {
      mass((row, column, value) => add(row, column, bound * value));
      entries((row, column, value) => add(row, column, -value));
    };
    return profile.factor(each, l)[1] > 0;
  };
  let [below, above] = [0, 1];
  while (!is_above(above) && above < 1e200) [below, above] = [above, 16 * above];
  for (let k = 0; k < ENCLOSURE_STEPS; k++) {
    const middle = below > 0 ? Math.sqrt(below * above) : above / 16;
    if (is_above(middle)) above = middle;
    else below = middle;
  }
  return above;
}

/**
 * The longest step of a method with fixed steps at the present state, by
 *
 *     ω² ≤ maxᵢ Σⱼ |kᵢⱼ| / (mᵢᵢ − Σⱼ |mᵢⱼ|)
 *
 * as in `dynamics-families/src/step_bound.rs`, and the same for damping. Where M is not dominant on its
 * diagonal, both are enclosed; |xᵀ D x| is at most Σᵢ rᵢ xᵢ², where rᵢ is half the sum of the sizes in
 * row i and column i.
 * Infinite where there is no bound.
 */
Motion.prototype.longest_step = function (method) {
  const border = STABILITY_BORDERS[method],
    { system, n, t, q, u } = this,
    loops = this.programs.family;
  if (border === undefined || !loops) return Infinity;
  const inertia = room(n),
    own = room(n),
    sums = room(n),
    damping = room(n),
    means = room(n);
  loops.mass(system.p, system.f, (row, column, value) => {
    inertia[row] += row === column ? value : -Math.abs(value);
  });
  const stiffness = (add) => loops.stiffness(system.p, system.f, t, q, u, system.w, add);
  stiffness((row, column, value) => {
    if (row === column) own[row] += value;
    else sums[row] += Math.abs(value);
  });
  loops.damping(system.p, system.f, t, q, u, system.w, (row, column, value) => {
    damping[row] += Math.abs(value);
    means[row] += 0.5 * Math.abs(value);
    means[column] += 0.5 * Math.abs(value);
  });
  let [square, decay] = [0, 0];
  if (inertia.every((x) => x > 0)) {
    for (let i = 0; i < n; i++) {
      square = Math.max(square, (Math.abs(own[i]) + sums[i]) / inertia[i]);
      decay = Math.max(decay, damping[i] / inertia[i]);
    }
  } else {
    square = enclosed(this, stiffness);
    if (max_abs(means) > 0) decay = enclosed(this, (add) => means.forEach((x, i) => add(i, i, x)));
  }
  const omega = Math.sqrt(square),
    bound = border / omega;
  if (!(decay > 0)) return bound;
  return Math.min(bound, RK4_HALF_DISC / (0.5 * decay + Math.sqrt(0.25 * decay * decay + square)));
};

// ---- dragging

/**
 * Shapes of the changes that move a point: of each coordinate that it depends on, a triangle that falls to
 * zero one node beyond the ends of its field, as a string is plucked.
 */
function plucked_shapes({ fields, held }, point) {
  const [place, first, second] = held[point],
    touched = place.touched(first, second);
  const field_of = (at) => fields.find(({ from, rows, columns }) => at >= from && at < from + rows * columns);
  const nodes = touched.filter((at) => field_of(at).numbered);
  const side = (i, at, length) => (i <= at ? (i + 1) / (at + 1) : (length - i) / (length - at));
  return (nodes.length > 0 ? nodes : touched).map((at) => {
    const { from, rows, columns } = field_of(at),
      [row, column] = [Math.floor((at - from) / columns), (at - from) % columns];
    const value = (k) => {
      const [i, j] = [Math.floor(k / columns), k % columns];
      return side(i, row, rows) * (columns > 1 ? side(j, column, columns) : 1);
    };
    return { from, values: Float64Array.from({ length: rows * columns }, (_, k) => value(k)) };
  });
}

/** The velocities of a point by these shapes, by rows: central differences. */
function slopes_of_shapes(motion, point, q, shapes) {
  const { t } = motion,
    moved = q.slice(),
    [, dimension] = place_of_point(motion, point),
    slopes = room(dimension * shapes.length);
  shapes.forEach(({ from, values }, s) => {
    const size = values.reduce((most, _, k) => Math.max(most, Math.abs(q[from + k])), 0),
      by = 1e-6 * (1e-3 + size);
    const at = (sign) => {
      for (let k = 0; k < values.length; k++) moved[from + k] = q[from + k] + sign * by * values[k];
      return position_of_point(motion, point, t, moved);
    };
    const [ahead, behind] = [at(1), at(-1)];
    for (let k = 0; k < values.length; k++) moved[from + k] = q[from + k];
    for (let i = 0; i < dimension; i++) slopes[i * shapes.length + s] = (ahead[i] - behind[i]) / (2 * by);
  });
  return slopes;
}

/** The least amounts of the shapes that change a point by e, as nearly as damping permits. */
function amounts_of_shapes(slopes, count, e) {
  const rows = e.length,
    square = room(rows * rows),
    weights = room(rows);
  let trace = 0;
  for (let i = 0; i < rows; i++) {
    for (let j = 0; j < rows; j++) square[i * rows + j] = dot(slopes, i * count, slopes, j * count, count);
    trace += square[i * rows + i];
  }
  if (!(trace > 0)) return room(count);
  for (let i = 0; i < rows; i++) square[i * rows + i] += 1e-9 * trace;
  solve_lu(square, rows, factor_lu(square, rows), e, weights);
  return Float64Array.from({ length: count }, (_, s) => {
    let sum = 0;
    for (let i = 0; i < rows; i++) sum += slopes[i * count + s] * weights[i];
    return sum;
  });
}

const drag_ordinary = Motion.prototype.drag,
  throw_ordinary = Motion.prototype.throw_point;
Motion.prototype.drag = function (point, target, along = null) {
  const loops = this.programs.family;
  if (!loops) return drag_ordinary.call(this, point, target, along);
  const shapes = plucked_shapes(loops, point),
    q = this.q.slice();
  const away = () => {
    const at = position_of_point(this, point, this.t, q);
    const e = Float64Array.from(at, (x, i) => target[i] - x);
    return along ? across(along, e) : e;
  };
  for (let turn = 0; turn < 8; turn++) {
    const full = slopes_of_shapes(this, point, q, shapes),
      slopes = along ? across(along, full, shapes.length) : full,
      amounts = amounts_of_shapes(slopes, shapes.length, away());
    shapes.forEach(({ from, values }, s) => {
      for (let k = 0; k < values.length; k++) q[from + k] += amounts[s] * values[k];
    });
    if (!(max_abs(amounts) > 1e-12 * (1 + max_abs(q)))) break;
  }
  this.start(this.t, q, new Float64Array(this.n), this.w);
  return norm(away());
};
Motion.prototype.throw_point = function (point, velocity) {
  const loops = this.programs.family;
  if (!loops) return throw_ordinary.call(this, point, velocity);
  const shapes = plucked_shapes(loops, point),
    slopes = slopes_of_shapes(this, point, this.q, shapes),
    amounts = amounts_of_shapes(slopes, shapes.length, Float64Array.from(velocity)),
    u = new Float64Array(this.n);
  shapes.forEach(({ from, values }, s) => {
    for (let k = 0; k < values.length; k++) u[from + k] += amounts[s] * values[k];
  });
  return this.start(this.t, this.q, u, this.w);
};
