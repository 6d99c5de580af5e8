// Slip directions: released constraints of the velocities have a side, the sign of their slip A q̇ + b, by
// which friction brakes. After an action the side follows the slip. Where the slip reverses within a step and
// no rule of sticking decides, friction would drive the motion, which ends there. As
// `dynamics-runtime/src/simulate/events/slip_direction.rs` and `run/monitors/slip_reversal.rs`.

/** Parts of a step at which the slip is checked. */
const PROBED_PARTS = [0.25, 0.5, 0.75, 1];
/** Bisections of the part of a step in which a slip reverses. */
const REVERSAL_BISECTIONS = 48;
/** Times that a step is made to end at a reversal: secants gain more than two digits each. */
const END_CORRECTIONS = 4;

Object.assign(FAILURES, {
  slips_back: ({ row, side, slip, at, sticks }) =>
    sticks
      ? `constraint \`${row}\` is released and comes to rest, or is at rest, where its friction holds it: ` +
        `it sticks, and friction by its side would drive it (${scientific(slip)} at t = ${rounded(at)}); ` +
        `let it stick and break away with \`.stick_slip("${row}", ..)\`, or engage it by an event where ` +
        `its slip is zero`
      : `constraint \`${row}\` is released to the side of ${side < 0 ? "falling" : "growing"} values and ` +
        `begins to slip to the other (${scientific(slip)} at t = ${rounded(at)}), where its friction would ` +
        `drive it; let it stick and break away with \`.stick_slip("${row}", ..)\`, or engage it by an ` +
        `event where its slip is zero, or release it with \`release_to("${row}", ${-side})\` where it ` +
        `slips that way`,
});

class SlipDirections {
  constructor(motion) {
    const { system, model } = motion,
      rows_of_mode = new Map();
    this.motion = motion;
    for (const mode of system.row_mode) rows_of_mode.set(mode, (rows_of_mode.get(mode) ?? 0) + 1);
    /** Switched constraints of the velocities with one row: [row, mode]. */
    this.rows = Array.from(system.row_mode, (mode, row) => [row, mode]).filter(
      ([row, mode]) => row >= system.holonomic && mode >= 0 && rows_of_mode.get(mode) === 1,
    );
    const ruled = new Set((model.stick_slip ?? []).map(({ row }) => row));
    this.without_rule = this.rows.filter(([row]) => !ruled.has(row));
  }

  /** Sets the sides of rows that slipped before an action, with these modes, and slip still. */
  align(before) {
    const { m, t, q, u, system } = this.motion;
    for (const [row, mode] of this.rows) {
      if (before[mode] === 0 || m[mode] === 0) continue;
      const side = system.constraints.slip_side(t, q, u, row);
      if (side !== 0) m[mode] = side;
    }
  }

  /** Whether accelerations depend on the side to which a row is released, by more than this part of them. */
  side_matters(t, q, u, mode, negligible) {
    const one = this.accelerations(t, q, u, mode, 1),
      other = this.accelerations(t, q, u, mode, -1);
    if (one === null || other === null) return true;
    const size = negligible * (1 + max_abs(one));
    return !one.every((x, i) => Math.abs(x - other[i]) <= size);
  }

  /** q̈ with a constraint released to a side; null where it does not exist. Not counted. */
  accelerations(t, q, u, mode, side) {
    const { m, n, r, system } = this.motion,
      [kept, count, failure] = [m[mode], system.evaluations, system.failure];
    const a = new Float64Array(n);
    m[mode] = side;
    system.switch_modes();
    const found = system.accelerate(t, q, u, a, new Float64Array(r));
    m[mode] = kept;
    system.switch_modes();
    [system.evaluations, system.failure] = [count, failure];
    return found ? a : null;
  }

  /** Fails where a row without rule slips against its side in the step just made, which then ends there. */
  check_step() {
    const { motion } = this;
    if (motion.t === motion.t0) return true;
    let first = null;
    for (const one of this.without_rule) {
      const found = motion.m[one[1]] === 0 ? null : this.reversal(one);
      if (found !== null && (first === null || found.theta < first.theta)) first = found;
    }
    if (first === null) return true;
    return this.end_at(first) && motion.system.fail({ kind: "slips_back", ...first });
  }

  /** Makes the step again to end at a reversal: the end of a method is more exact than its interpolant. */
  end_at({ row, theta, rate }) {
    const { motion } = this,
      from = motion.t0;
    let to = from + theta * (motion.t - from),
      slope = rate,
      last = null;
    for (let turn = 0; turn < END_CORRECTIONS; turn++) {
      motion.undo();
      if (to === from) return true;
      if (!motion.repeat(to)) return false;
      const slip = motion.system.value("velocity_residual", to, motion.q, motion.u)[row];
      if (last !== null && last.to !== to) slope = (slip - last.slip) / (to - last.to);
      last = { to, slip };
      const better = to - slip / slope;
      if (better === to || !((better - from) * (to - from) > 0)) break;
      to = better;
    }
    return true;
  }

  /** Where the slip of a row reverses in the step just made; null where it does not. */
  reversal([row, mode]) {
    const { motion } = this,
      { system, n, t0, m } = motion,
      h = motion.t - t0,
      side = m[mode];
    const at = (theta) => {
      const t = theta < 1 ? t0 + theta * h : motion.t,
        y = motion.at(t, new Float64Array(2 * n)),
        q = y.subarray(0, n),
        u = y.subarray(n);
      return { t, q, u, slip: system.value("velocity_residual", t, q, u)[row] };
    };
    const is_against = ({ t, q, u, slip }) =>
      slip * side < 0 &&
      system.constraints.slip_side(t, q, u, row) !== 0 &&
      this.side_matters(t, q, u, mode, 0);
    const part = PROBED_PARTS.findIndex((theta) => is_against(at(theta)));
    if (part < 0) return null;
    const found = at(PROBED_PARTS[part]);
    let low = part === 0 ? 0 : PROBED_PARTS[part - 1],
      high = PROBED_PARTS[part];
    for (let turn = 0; turn < REVERSAL_BISECTIONS; turn++) {
      const middle = 0.5 * (low + high);
      if (at(middle).slip * side > 0) low = middle;
      else high = middle;
    }
    const zero = at(low),
      rate = found.slip / (found.t - zero.t);
    const here = this.accelerations(zero.t, zero.q, zero.u, mode, side),
      there = this.accelerations(zero.t, zero.q, zero.u, mode, -side);
    let sticks = false;
    if (here !== null && there !== null) {
      const jacobian = system.value("jacobian", zero.t, zero.q, zero.u);
      let change = 0;
      for (let j = 0; j < n; j++) change += jacobian[row * n + j] * (there[j] - here[j]);
      // It sticks if, released to the other side, it would be driven back to this one.
      sticks = side * (rate + change) > 0;
    }
    return { row, side, slip: found.slip, at: found.t, theta: low, rate, sticks };
  }
}
