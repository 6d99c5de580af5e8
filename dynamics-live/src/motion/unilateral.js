// How unilateral constraints switch: contacts lift off, rebound and close, sticking breaks away and takes
// hold again. As `dynamics-runtime/src/simulate/events/unilateral.rs`, `action.rs` there, and
// `simulate/stabilization/contacts.rs`.

/** Rest speed of a contact, in parts of its fastest hit; the same where it is hit again before it opened. */
const REST_SPEED = 1e-3,
  HIDDEN_HOP_REST_SPEED = 0.1;
/** Gap below which an open contact takes part in an impact, in parts of its size. */
const TOUCHING_GAP = 1e-11;
/** Rate of a row after an impact that is zero up to rounding, in parts of the largest speed in it. */
const AT_REST_RATE = 1e-10;
/** Half the time, in parts of 1 + |t|, across which a function is compared to find a jump at an instant. */
const JUMP_HALF_WIDTH = 1e-9;
/** Change of accelerations by friction, in parts of 1 + |q̈|, below which the side of a slip is the same. */
const NEGLIGIBLE_FRICTION = 1e-9;

Object.assign(FAILURES, {
  no_side: ({ row }) =>
    `the reaction of \`${row}\` does not say to which side it is released; say so with ` +
    `\`release_to("${row}", side)\``,
});

class UnilateralRules {
  constructor(motion, unilaterals) {
    this.motion = motion;
    this.contacts = unilaterals.filter(({ kind }) => kind === "contact");
  }

  is_held({ mode }) {
    return this.motion.m[mode] === 0;
  }

  /**
   * Switches a constraint whose function has fallen to zero. `instant`: velocities and modes before the first
   * action there. Returns what happens, "" where nothing does, null where it fails.
   */
  switch(one, instant) {
    const { motion } = this,
      { m, t, u, system } = motion,
      holds = this.is_held(one),
      ahead = one.reaction_ahead;
    one.reaction_ahead = null;
    // Another action at this instant has switched it.
    if (holds !== (instant.m[one.mode] === 0)) return "";
    const jumped = u.some((x, i) => x !== instant.u[i]);
    if (one.kind === "slip") {
      if (!holds) return this.stick(one, jumped);
      const side = this.breakaway_side(one, jumped ? null : ahead);
      if (side === null) return null;
      m[one.mode] = side;
      return "slips";
    }
    if (holds) {
      // Its reaction after the jump decides.
      if (jumped) return "";
      m[one.mode] = 1;
      one.lifted_at = t;
      one.grazes_until = -Infinity;
      return "lifts off";
    }
    if (one.lifted_at === t) {
      // Its reaction only grazed zero: it closes again before it was seen to open.
      one.grazes_until = t + Math.abs(motion.plan.h);
      m[one.mode] = 0;
      return "closes";
    }
    const rate = system.value("velocity_residual", t, motion.q, u)[one.row];
    return rate < 0 || !jumped ? this.close(one) : "";
  }

  // ---- sticking

  /** A slip that has come to zero takes hold, unless it jumps to the other side. */
  stick(one, jumped) {
    const { m } = this.motion;
    one.last_side = m[one.mode];
    if (this.slip_jumps_away(one)) {
      m[one.mode] = -one.last_side;
      return "slips";
    }
    if (jumped) return this.strike(one, true) ? "sticks" : null;
    m[one.mode] = 0;
    return "sticks";
  }

  /** Time and positions a moment later, in parts of 1 + |t|, or earlier. */
  state_after(part) {
    const { t, q, u } = this.motion,
      shift = part * (1 + Math.abs(t));
    return [t + shift, q.map((x, i) => x + shift * u[i])];
  }

  /** Whether the slip jumps here to the other side, as the speed of a belt may. */
  slip_jumps_away({ row, last_side }) {
    const { u, system } = this.motion,
      { constraints } = system;
    const [before, after] = [-JUMP_HALF_WIDTH, JUMP_HALF_WIDTH].map((part) => {
      const [t, q] = this.state_after(part);
      return constraints.slip_velocity(t, q, u, row);
    });
    const least = CONSISTENT * constraints.size_along(this.motion.t, this.motion.q, u, row, u);
    return Math.abs(after - before) > least && -last_side * after > least;
  }

  /**
   * The side to which sticking breaks away: against its reaction, `ahead` or here; null where it has none.
   */
  breakaway_side(one, ahead) {
    const { motion } = this,
      { t, q, u, l, slips } = motion,
      now = l[one.row];
    if (ahead !== null && ahead !== 0) return -Math.sign(ahead);
    const [later, there] = this.state_after(JUMP_HALF_WIDTH),
      behind = motion.solve_at(later, there, u)[1][one.row];
    // A change of less than half is no jump: the reaction here decides.
    if (Math.abs(behind - now) > 0.5 * Math.abs(behind)) return -Math.sign(behind);
    if (Math.abs(now) > 0) return -Math.sign(now);
    // It has neither a reaction nor friction, as where its contact lifts off at the same instant.
    if (!slips.side_matters(t, q, u, one.mode, NEGLIGIBLE_FRICTION)) return one.last_side;
    motion.system.fail({ kind: "no_side", row: one.row });
    return null;
  }

  // ---- impacts

  /** Speed up to which a contact is at rest, a part of its fastest hit unless it is given. */
  rest_speed({ rest_speed, fastest_hit }, part) {
    return rest_speed ?? part * fastest_hit;
  }

  /** The coefficient of restitution of a hit: 0 where it is too slow to rebound. */
  restitution(one, rate) {
    one.fastest_hit = Math.max(one.fastest_hit, -rate);
    return -rate > this.rest_speed(one, REST_SPEED) ? one.restitution : 0;
  }

  /** A contact that falls to zero rebounds or holds. One that moves away rebounded too slowly to be seen. */
  close(one) {
    const { t, q, u, system } = this.motion;
    one.grazes_until = -Infinity;
    const rate = system.value("velocity_residual", t, q, u)[one.row];
    const is_back =
      rate > 0 &&
      (rate <= this.rest_speed(one, HIDDEN_HOP_REST_SPEED) ||
        (one.rest_speed === null && this.is_unresolved(one)));
    if (!this.strike(one, is_back)) return null;
    return this.is_held(one) ? "closes" : "impact";
  }

  /** Whether a contact moves away no faster than the tolerance resolves velocities. */
  is_unresolved({ row }) {
    const { t, q, u, plan, system } = this.motion,
      { constraints } = system,
      part = plan.fixed ? CONSISTENT : plan.relative;
    return (
      Math.abs(constraints.slip_velocity(t, q, u, row)) <= part * constraints.size_along(t, q, u, row, u)
    );
  }

  /** Contacts that hold or touch. Velocities are projected before, so that those that hold have no drift. */
  touching_contacts() {
    const { t, q, u, system } = this.motion,
      { constraints } = system;
    system.switch_modes();
    if (!constraints.project_velocities(t, q, u)) return null;
    const gaps = system.value("residual", t, q, u)?.slice();
    return this.contacts.filter(
      (one) =>
        this.is_held(one) ||
        gaps[one.row] <= 0 ||
        !constraints.is_missed(t, q, u, one.row, gaps[one.row], TOUCHING_GAP),
    );
  }

  /** An impact on a constraint and all contacts that touch. `captures`: it holds then, pushed or pulled. */
  strike(struck, captures) {
    const { system, m, t, q, u } = this.motion,
      touching = this.touching_contacts();
    if (touching === null) return false;
    const rates = system.value("velocity_residual", t, q, u).slice(),
      before = u.slice(),
      others = touching.filter((one) => one !== struck),
      contacts = captures ? others : [struck, ...others];
    const returns = new Map(
      contacts.map((one) => [
        one,
        one !== struck && this.is_held(one) ? 0 : this.restitution(one, rates[one.row]),
      ]),
    );
    // A rocking body comes to rest as a bouncing one does: if all contacts are slow, all hold.
    const all_rest =
      !captures &&
      contacts.every(
        (one) => this.is_held(one) || Math.abs(rates[one.row]) <= this.rest_speed(one, REST_SPEED),
      );
    if (captures) m[struck.mode] = 0;
    for (const { mode } of contacts) m[mode] = all_rest ? 0 : 1;
    const hits = contacts.map((one) => ({
      row: one.row,
      restitution: returns.get(one),
      side: all_rest ? 0 : 1,
    }));
    if (captures) hits.unshift({ row: struck.row, restitution: 0, side: 0 });
    if (!impact(system.constraints, t, q, u, hits)) return false;
    // Contacts that are at rest after the impact hold. Rounding is relative to the fastest hit.
    const after = system.value("velocity_residual", t, q, u).slice(),
      jacobian = system.value("jacobian", t, q, u),
      { n } = this.motion;
    const fastest = Math.max(...hits.map(({ row }) => Math.abs(rates[row])));
    for (const { row, mode } of contacts) {
      let largest = fastest;
      for (let j = 0; j < n; j++) {
        const speed = Math.max(Math.abs(before[j]), Math.abs(u[j]));
        largest = Math.max(largest, Math.abs(jacobian[row * n + j]) * speed);
      }
      if (Math.abs(after[row]) <= AT_REST_RATE * largest) m[mode] = 0;
    }
    return true;
  }
}
