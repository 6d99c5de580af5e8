// The implicit midpoint rule: u₁ = u₀ + h a(t + h/2, (y₀ + y₁)/2), q₁ = q₀ + h (u₀ + u₁)/2.
//
// A fixed-point iteration on u₁ to rounding. Where it diverges, as for stiff forces, Newton's method with
// the derivatives of q̈ by differences, whose matrix is factored once for the step.

class ImplicitMidpoint {
  constructor(stepper) {
    this.stepper = stepper;
    this.end = new Float64Array(stepper.n);
  }

  /** Makes the end of a step into `next` of the stepper. Returns null, or why it cannot be made. */
  attempt(h) {
    const { next, q, u, n, stage } = this.stepper,
      { end } = this;
    this.predict(h);
    let failure = this.iterate(h, null);
    if (failure !== null) {
      this.predict(h);
      const newton = this.newton_matrix(h);
      failure = newton === null ? failure : this.iterate(h, newton);
    }
    if (failure !== null) return failure;
    for (let i = 0; i < n; i++) {
      next.u[i] = end[i];
      next.q[i] = q[i] + 0.5 * h * (u[i] + end[i]);
    }
    stage.k_q[1].set(stage.u[1]);
    return null;
  }

  predict(h) {
    const { u, a, n } = this.stepper;
    for (let i = 0; i < n; i++) this.end[i] = u[i] + h * a[i];
  }

  /** Iterates on the velocities of the end; `newton` has the matrix of simplified Newton steps. */
  iterate(h, newton) {
    const { q, u, n, t, system, stage } = this.stepper,
      { end } = this,
      progress = new FixedPoint();
    const miss = new Float64Array(n),
      step = new Float64Array(n);
    const rounding = (4 * Number.EPSILON * max_abs(q)) / Math.abs(h);
    for (;;) {
      if (!this.evaluate(h, end)) return system.failure;
      let correction = 0,
        change = 0;
      for (let i = 0; i < n; i++) miss[i] = u[i] + h * stage.k_u[1][i] - end[i];
      if (newton === null) step.set(miss);
      else if (newton.solve) newton.solve(miss, step);
      else solve_lu(newton.matrix, n, newton.lu, miss, step);
      for (let i = 0; i < n; i++) {
        end[i] += step[i];
        correction = max(correction, Math.abs(step[i]));
        change = Math.max(change, Math.abs(end[i] - u[i]), 1e-2 * Math.abs(end[i]));
      }
      // At rest nothing changes: no correction is a part of that.
      const part = (x) => (x === 0 ? 0 : x / change),
        status = progress.judge(part(correction), Math.max(part(rounding), newton?.rounding ?? 0));
      if (status === "converged") return null;
      if (status === "diverged") {
        let coordinate = 0;
        for (let i = 1; i < n; i++) if (Math.abs(step[i]) > Math.abs(step[coordinate])) coordinate = i;
        return { kind: "step_not_solved", coordinate, t, h };
      }
    }
  }

  /** q̈ at the middle of a step that ends with these velocities. */
  evaluate(h, end) {
    const { stage, q, u, n, t, system } = this.stepper;
    for (let i = 0; i < n; i++) {
      stage.u[1][i] = 0.5 * (u[i] + end[i]);
      stage.q[1][i] = q[i] + 0.25 * h * (u[i] + end[i]);
    }
    return system.accelerate(t + 0.5 * h, stage.q[1], stage.u[1], stage.k_u[1], stage.l[1]);
  }

  /** 1 − h (∂a/∂u/2 + h ∂a/∂q/4), factored; null where it cannot be evaluated. */
  newton_matrix(h) {
    const { n, stage } = this.stepper,
      { end } = this,
      largest = max_abs(end);
    if (!this.evaluate(h, end)) return null;
    const here = stage.k_u[1].slice(),
      moved = end.slice(),
      matrix = new Float64Array(n * n);
    for (let j = 0; j < n; j++) {
      const by = difference_increment(end[j], largest);
      moved[j] = end[j] + by;
      if (!this.evaluate(h, moved)) return null;
      moved[j] = end[j];
      const there = stage.k_u[1];
      for (let i = 0; i < n; i++) matrix[i * n + j] = (i === j ? 1 : 0) - (h * (there[i] - here[i])) / by;
    }
    const lu = factor_lu(matrix, n);
    return lu.least > 1e-14 ? { matrix, lu } : null;
  }
}
