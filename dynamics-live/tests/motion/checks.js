// Checks of the runtime in the page against closed forms. `CHECKS` are functions that throw; no engine's own
// functions are used, so that any engine runs them.

function expect(condition, text) {
  if (!condition) throw new Error(text);
}
function expect_near(found, wanted, tolerance, text) {
  expect(Math.abs(found - wanted) <= tolerance, `${text}: ${found} instead of ${wanted}`);
}
function motion_of(name, change = {}) {
  const [programs, model] = MODELS[name];
  return new Motion(programs, { ...model, ...change });
}
function started(name, q, u, change = {}, m = undefined, parameters = {}) {
  const motion = motion_of(name, change);
  for (const [i, value] of Object.entries(parameters)) motion.p[i] = value;
  const refused = motion.refresh() ?? motion.start(0, q, u, motion.w, m);
  expect(refused === null, `${name}: ${refused}`);
  return motion;
}
function run(motion, method, accuracy, end) {
  while (motion.t < end) {
    if (!motion.step(method, accuracy, end)) return motion.reason;
  }
  return null;
}
const energy = (motion) => motion.energies([0, 0, 0])[2];

const CHECKS = {
  sines_are_within_one_unit_and_odd() {
    for (let i = 0; i < 20000; i++) {
      const x = (i - 10000) * 0.7301 + i * 1e-7,
        s = sin_cos(x),
        c = cosine[0];
      expect(Math.abs(s - Math.sin(x)) <= 2.3e-16 && Math.abs(c - Math.cos(x)) <= 2.3e-16, `sin ${x}`);
      expect(sin_cos(-x) === -s && cosine[0] === c, `parity ${x}`);
    }
    expect(Object.is(sin_cos(-0), -0) && Number.isNaN(sin_cos(Infinity)), "corners");
    expect(
      min(NaN, 1) !== min(NaN, 1) && max(1, NaN) !== 1 && signum(0) === 1 && signum(-0) === -1,
      "corners",
    );
    expect(powf(1, NaN) === 1 && powf(-1, Infinity) === 1 && powi(2, -3) === 0.125, "powers");
  },
  pieces_have_their_derivatives() {
    const f = piecewise({
      knots: [0, 1, 3],
      coefficients: [
        [1, 2, 0, 4],
        [7, 14, 12, 0],
      ],
      outside: "linear",
    });
    expect(f(0.5, 0) === 2.5 && f(0.5, 1) === 5 && f(2, 0) === 33 && f(2, 2) === 24, "inside");
    expect(f(-1, 0) === -1 && f(-1, 1) === 2 && f(4, 1) === 62 && f(4, 2) === 0, "outside");
    expect(Number.isNaN(piecewise({ knots: [0, 1], coefficients: [[1]] })(2, 0)), "no data outside");
  },
  a_periodic_function_has_no_gap_at_its_seam() {
    const f = piecewise({
      knots: [0.1, 0.2, 0.4],
      coefficients: [
        [1, 2, 0, 4],
        [2, 3, -40, 60],
      ],
      outside: "periodic",
    });
    // Inside the domain nothing is wrapped: the last knot belongs to the last piece.
    expect(f(0.4, 0) === polynomial([2, 3, -40, 60], 0.4 - 0.2, 0), "last knot");
    for (let turn = -2000; turn <= 2000; turn++) {
      for (const by of [-2e-16, -1e-16, 0, 1e-16, 2e-16]) {
        const x = 0.1 + turn * (0.4 - 0.1) + by * Math.max(1, Math.abs(turn)),
          [lower, upper] = f.piece(x);
        expect(Number.isFinite(f(x, 0)) && Number.isFinite(f(x, 3)), `at ${x}`);
        expect(upper - lower > 0.09 && upper - lower < 0.21, `piece at ${x}: ${lower} ${upper}`);
      }
    }
    expect(Number.isNaN(f(Infinity, 0)), "infinity");
  },
  methods_have_their_orders() {
    const orders = { euler: 1, explicit_euler: 1, heun: 2, midpoint: 2, rk4: 4 };
    for (const [method, order] of Object.entries(orders)) {
      const errors = [0.02, 0.01].map((h) => {
        const motion = started("oscillator", [1], [0]);
        expect(run(motion, method, h, 1) === null, method);
        return Math.hypot(motion.q[0] - Math.cos(1), motion.u[0] + Math.sin(1));
      });
      expect_near(Math.log2(errors[0] / errors[1]), order, 0.1, `order of ${method}`);
    }
  },
  adaptive_methods_follow_their_tolerance() {
    for (const method of ["dp5", "dop853"]) {
      for (const tolerance of [1e-5, 1e-8, 1e-11]) {
        const motion = started("oscillator", [1], [0]);
        expect(run(motion, method, tolerance, 20) === null, method);
        expect_near(motion.q[0], Math.cos(20), 30 * tolerance, `${method} ${tolerance}`);
      }
    }
  },
  the_double_pendulum_keeps_its_energy() {
    const motion = started("double_pendulum", [2, 2.6], [0, 0]),
      before = energy(motion);
    expect(run(motion, "dop853", 1e-11, 20) === null, motion.reason);
    expect_near(energy(motion), before, 1e-8, "energy");
  },
  a_stiff_oscillator_is_for_the_implicit_method() {
    const stiff = started("oscillator", [1], [0], {}, undefined, { 0: 1e8, 1: 1e6 });
    expect(run(stiff, "midpoint", 0.01, 1) === null, stiff.reason);
    expect(Math.abs(stiff.q[0]) < 2, "midpoint stays bounded");
    const explicit = started("oscillator", [1], [0], {}, undefined, { 0: 1e8, 1: 1e6 });
    const reason = run(explicit, "rk4", 0.01, 1);
    expect(reason !== null && /grows beyond|not finite/.test(reason), `rk4: ${reason}`);
  },
  the_interpolant_is_of_order_four_in_velocities() {
    const motion = started("oscillator", [1], [0]),
      out = new Float64Array(2);
    while (motion.t < 5) {
      motion.step("dp5", 1e-9, 5);
      const t = 0.5 * (motion.t0 + motion.t);
      motion.at(t, out);
      expect_near(out[0], Math.cos(t), 1e-7, "position");
      expect_near(out[1], -Math.sin(t), 1e-6, "velocity");
    }
  },
  works_of_forces_close_the_account() {
    for (const method of ["dp5", "dop853", "rk4", "midpoint", "euler"]) {
      const motion = started("oscillator", [1], [0], {}, undefined, { 1: 0.3 }),
        before = energy(motion);
      run(motion, method, METHODS[method].fixed ? 1e-3 : 1e-9, 5);
      const off = energy(motion) - before - motion.work;
      expect(
        Math.abs(off) < (method === "euler" ? 2e-3 : method === "midpoint" ? 1e-6 : 1e-7),
        `${method}: ${off}`,
      );
    }
  },
  a_singular_mass_matrix_names_its_coordinate() {
    const motion = motion_of("double_pendulum");
    expect(motion.start(0, [1, 1], [0, 0]) === null, "starts");
    motion.p[1] = 0;
    const refused = motion.refresh();
    expect(/mass matrix is singular: coordinate `theta2`|not finite/.test(refused), refused);
    motion.p[1] = -1;
    expect(/given by `m2`: a body cannot have the mass -1/.test(motion.refresh()), "assumption");
    motion.p[1] = 1;
    expect(motion.refresh() === null && motion.step("dp5", 1e-6), "goes on");
  },
  a_pendulum_on_a_rod_stays_on_it() {
    const polar = started("double_pendulum", [Math.PI / 2, 0], [0, 0]);
    expect(polar.q[0] > 1, "there");
    for (const [method, accuracy] of [
      ["dp5", 1e-9],
      ["dop853", 1e-9],
      ["rk4", 1e-3],
      ["midpoint", 1e-3],
    ]) {
      const motion = started("cartesian_pendulum", [1, 0], [0, 0]),
        before = energy(motion);
      let most = 0,
        smallest = 0;
      while (motion.t < 3) {
        expect(motion.step(method, accuracy, 3), `${method}: ${motion.reason}`);
        const [at, rate] = motion.residual();
        most = Math.max(most, at, rate);
        smallest = Math.min(smallest, motion.l[0]);
      }
      expect(most < 1e-13, `${method}: residual ${most}`);
      expect_near(energy(motion), before, method === "midpoint" ? 1e-4 : 1e-6, `${method}: energy`);
      // At the bottom λ l = −m (g + v²/l) = −3 m g.
      expect_near(smallest, -3 * 9.81, 0.2, `${method}: reaction`);
    }
  },
  a_start_is_put_onto_the_constraints_or_refused() {
    const motion = motion_of("cartesian_pendulum");
    expect(motion.start(0, [1 + 1e-8, 0], [1e-8, 0.5]) === null, "near");
    expect(motion.residual()[0] < 1e-15 && motion.residual()[1] < 1e-15, "projected");
    expect(/constraint `rod` does not hold/.test(motion.start(0, [1.2, 0], [0, 0])), "position");
    expect(/velocities violate constraint `rod`/.test(motion.start(0, [1, 0], [0.3, 0])), "velocity");
    expect(/coordinate `x` is NaN/.test(motion.start(0, [NaN, 0], [0, 0])), "value");
    expect_near(motion.q[0], 1, 1e-12, "the motion before stays");
    // A longer rod: the motion goes on from the nearest position.
    motion.p[1] = 1.5;
    expect(motion.refresh() === null, "longer");
    expect_near(Math.hypot(motion.q[0], motion.q[1]), 1.5, 1e-14, "longer rod");
  },
  redundant_rows_share_their_load() {
    for (const [method, accuracy] of [
      ["dp5", 1e-9],
      ["dop853", 1e-9],
      ["rk4", 1e-2],
    ]) {
      const motion = started("redundant_four_bar", [0.4, 0.4, 0.4], [1, 1, 1]),
        before = energy(motion);
      expect(run(motion, method, accuracy, 4) === null, `${method}: ${motion.reason}`);
      expect(motion.residual()[0] < 1e-13, "residual");
      expect_near(energy(motion), before, 1e-6, `${method}: energy`);
      // As one pendulum: a = −g cos q / l.
      expect_near(motion.a[0], -9.81 * Math.cos(motion.q[0]), 1e-9, "acceleration");
      expect_near(motion.a[2], motion.a[0], 1e-9, "alike");
    }
  },
  a_ball_bounces_as_in_the_closed_form() {
    for (const [method, accuracy] of [
      ["dp5", 1e-9],
      ["rk4", 0.013],
      ["dop853", 1e-6],
      ["euler", 1e-3],
    ]) {
      const motion = started("ball", [0, 5], [1, 0], {}, [1]),
        times = [];
      const reason = run(motion, method, accuracy, 6);
      expect(reason === null, `${method}: ${reason}`);
      for (const { t, what } of motion.events) if (what === "impact") times.push(t);
      // Falls for 1 s, hits with 10 m/s, then flights of 1, 1/2, 1/4 s, ...
      const tolerance = method === "euler" ? 1e-2 : 1e-9;
      [1, 2, 2.5, 2.75].forEach((t, i) => expect_near(times[i], t, tolerance, `${method}: hit ${i}`));
      expect(motion.events[motion.events.length - 1].what === "closes", "comes to rest");
      expect(motion.m[0] === 0 && Math.abs(motion.q[1]) < 1e-12, "lies on the ground");
      expect_near(motion.q[0], 6, 1e-9, "slides on");
      expect_near(motion.l[0], 10, 1e-12, "reaction");
      expect_near(energy(motion) - 50.5 - motion.work, 0, method === "euler" ? 1 : 1e-6, "work of impacts");
    }
  },
  an_elastic_ball_never_stops_and_a_frantic_one_does() {
    const motion = started(
      "ball",
      [0, 5],
      [0, 0],
      { contacts: [{ event: null, row: 0, restitution: 1 }] },
      [1],
    );
    expect(run(motion, "dop853", 1e-9, 20) === null, motion.reason);
    expect(motion.events.length === 10, `${motion.events.length} hits`);
    expect_near(motion.q[1], 5, 1e-6, "height");
    // A thousand hits in a millisecond are no accumulation.
    const contact = (restitution, rest_speed) => ({
      contacts: [{ event: null, row: 0, restitution, rest_speed }],
    });
    const fast = started("ball", [0, 1.25e-6], [0, 0], contact(1), [1], { 0: 1e7 });
    expect(run(fast, "dop853", 1e-9, 1e-3) === null, fast.reason);
    expect(fast.events.length === 1000, `${fast.events.length} hits`);
    const frantic = started("ball", [0, 5], [0, 0], contact(0.5, 1e-300), [1]);
    const reason = run(frantic, "dp5", 1e-9, 60);
    expect(/accumulates at about t = 3; give `.contact\("ground"/.test(reason), reason);
  },
  friction_brakes_after_an_impact() {
    for (const method of ["dp5", "dop853"]) {
      const motion = started("walls", [0.5], [3], {}, [1, 1, 1]);
      expect(run(motion, method, 1e-9, 3) === null, motion.reason);
      // v² falls by 4 a metre, and to 0.81 of it at a wall: 9, 7 → 5.67, 1.67 → 1.3527, and nothing.
      const hits = [(3 - Math.sqrt(7)) / 2, (Math.sqrt(5.67) - Math.sqrt(1.67)) / 2, Math.sqrt(1.3527) / 2];
      let t = 0;
      expect(motion.events.map(({ what }) => what).join() === "impact,impact,sticks", "events");
      hits.forEach((by, i) => expect_near(motion.events[i].t, (t += by), 1e-8, `event ${i}`));
      expect_near(motion.q[0], 1.3527 / 4, 1e-8, "rests");
    }
  },
  a_slip_that_jumps_to_the_other_side_goes_on_slipping() {
    const [programs, model] = MODELS.belt,
      speed = (t) => (t < 1 ? 0.2 : -0.4);
    const motion = new Motion(
      {
        ...programs,
        velocity_residual: program(
          1,
          (p, k, f, t, q, u, w, m, a, l, out) => (out[0] = u[0] - speed(t)),
        ),
      },
      model,
    );
    motion.p.set([0, 0, 0.1, 0.2]);
    expect(motion.refresh() === null && motion.start(0, [0], [0], [], [-1]) === null, "starts");
    expect(run(motion, "dp5", 1e-9, 1.5) === null, motion.reason);
    expect(motion.events.map(({ what }) => what).join() === "slips", JSON.stringify(motion.events));
    // The belt drives it to 0.1, and brakes it from there on.
    expect_near(motion.events[0].t, 1, 1e-9, "jump");
    expect_near(motion.u[0], 0.05, 1e-9, "speed");
  },
  stops_in_both_directions_stop_at_either() {
    const stops = [-1, 1].map((direction) => ({ event: 0, direction }));
    for (const [q, given] of [
      [1, stops],
      [-1, stops],
      [1, [stops[0]]],
    ]) {
      const motion = started("oscillator", [q], [0], { stops: given });
      expect(/ends at event `centre`/.test(run(motion, "dp5", 1e-9, 3)), motion.reason);
      expect_near(motion.t, Math.PI / 2, 1e-8, "first crossing");
    }
    const rising = started("oscillator", [1], [0], { stops: [stops[1]] });
    run(rising, "dp5", 1e-9, 6);
    expect_near(rising.t, 1.5 * Math.PI, 1e-8, "second crossing");
  },
  a_reversal_without_a_rule_ends_the_motion() {
    const motion = started("belt", [0], [0.5], { stick_slip: [] }, [1]),
      reason = run(motion, "dop853", 1e-9, 5);
    // x = 0.5 (cos t + sin t − 1) has the speed 0.2 of the belt where cos t − sin t = 0.4.
    const t = Math.acos(0.4 / Math.sqrt(2)) - Math.PI / 4;
    expect(/`belt` is released and comes to rest, .* it sticks, /.test(reason), reason);
    expect_near(motion.t, t, 1e-7, "reversal");
    expect_near(motion.u[0], 0.2, 1e-8, "slip");
  },
  a_contact_between_walls_is_squeezed() {
    const motion = started("walls", [0], [0], {}, [0, 1, 0], { 1: 0.5 }),
      reason = run(motion, "dp5", 1e-9, 5);
    expect(/`right` is driven against constraints and contacts that do not give way/.test(reason), reason);
    expect_near(motion.t, 2, 1e-9, "time");
  },
  a_parameter_that_moves_a_contact_through_a_body_is_refused() {
    const motion = started("walls", [0.5], [0], {}, [1, 1, 0]),
      before = motion.l.slice();
    motion.p[0] = 0.4;
    expect(/contact `right` is open on the wrong side/.test(motion.refresh()), "refused");
    expect(motion.l.every((x, i) => x === before[i]) && motion.q[0] === 0.5, "as before");
    motion.p[0] = 0.6;
    expect(motion.refresh() === null, "fits");
    // Millionths of a millimetre are no distance of millimetres.
    motion.model.coordinates.concat(motion.model.parameters).forEach((one) => (one.unit = "m"));
    expect(!motion.system.constraints.is_missed(0, [1], [0], 1, 1e-7, CONSISTENT), "near");
    expect(motion.system.constraints.is_missed(0, [1], [0], 1, 1e-5, CONSISTENT), "far");
  },
  a_block_on_a_belt_sticks_and_slips() {
    const motion = started("belt", [0], [0.2], {}, [0]);
    expect(run(motion, "dop853", 1e-9, 20) === null, motion.reason);
    // It sticks to x = 0.8 at t = 4, slips as x = 0.5 + 0.3 cos τ + 0.2 sin τ until it has the belt's
    // speed.
    const [slips, sticks] = motion.events.filter(({ what }) => what !== "event");
    expect_near(slips.t, 4, 1e-8, "breaks away");
    const slip = 2 * (Math.PI - Math.atan2(0.3, 0.2)),
      again = sticks.t - slips.t;
    expect_near(again, slip, 1e-7, "sticks again");
  },
  events_are_told_and_stops_stop() {
    const motion = started("oscillator", [1], [0]);
    run(motion, "dp5", 1e-9, 10);
    expect(
      motion.events.length === 3 && motion.events[0].direction === -1,
      `${motion.events.length} crossings`,
    );
    expect_near(motion.events[1].t, 1.5 * Math.PI, 1e-6, "second crossing");
    const stopping = started("oscillator", [1], [0], { stops: [0] });
    const reason = run(stopping, "rk4", 0.1, 10);
    expect(/ends at event `centre`/.test(reason), reason);
    expect_near(stopping.q[0], 0, 1e-12, "at the centre");
    expect(
      !stopping.step("rk4", 0.1) && stopping.start(0, [1], [0]) === null && stopping.step("rk4", 0.1),
      "again",
    );
  },
  a_point_is_dragged_and_thrown() {
    const motion = started("double_pendulum", [0.2, 0.1], [0, 0]);
    expect(motion.drag(1, [1.2, -0.9]) < 2e-3, "reached");
    const [x, y] = motion.value("points").slice(2);
    expect(Math.hypot(x - 1.2, y + 0.9) < 2e-3, "there");
    const left = motion.drag(1, [5, 0]);
    expect_near(left, 3, 1e-2, "out of reach: stretched towards it");
    const rod = started("cartesian_pendulum", [0, -1], [0, 0]);
    rod.drag(0, [3, 0]);
    expect_near(rod.q[0], 1, 1e-6, "on its circle");
    expect(rod.throw_point(0, [0.5, 2]) === null, "thrown");
    expect_near(rod.u[1], 2, 1e-3, "along the circle");
    expect_near(rod.u[0], 0, 1e-6, "not across");
  },
  fixed_steps_meet_their_grid() {
    const motion = started("oscillator", [1], [0]);
    for (let i = 1; i <= 30; i++) {
      expect(motion.step("rk4", 0.1), motion.reason);
      expect(motion.t === i * 0.1, `step ${i} at ${motion.t}`);
    }
  },
  friction_depends_on_the_reaction() {
    const motion = started("rubbing_block", [0, 0], [1, 0]);
    expect(run(motion, "dp5", 1e-9, 2) === null, motion.reason);
    expect_near(motion.l[0], 10, 1e-12, "reaction");
    expect_near(motion.q[0], 2 + 0.5 * (3 - 2.5) * 4, 1e-9, "path");
  },
  a_ball_lifts_off_a_table_and_returns() {
    const motion = started("table", [0], [2], {}, [0]);
    expect(run(motion, "dop853", 1e-9, 1.2) === null, motion.reason);
    const [lifts, closes] = motion.events;
    // λ = g − Aω² sin ωt.
    const lift = Math.asin(0.5) / 10;
    expect(
      lifts.what === "lifts off" && closes.what === "closes",
      motion.events.map(({ what }) => what).join(),
    );
    expect_near(lifts.t, lift, 1e-8, "lifts off");
    const gap = (t) => {
      const d = t - lift;
      return 0.2 * 0.5 + 2 * Math.cos(Math.asin(0.5)) * d - 5 * d * d - 0.2 * Math.sin(10 * t);
    };
    expect_near(gap(closes.t), 0, 1e-8, "returns");
  },
  a_bar_falls_flat_on_both_ends() {
    const motion = started("bar", [0, 5, 0], [1, 0, 0], {}, [1, 1]);
    expect(run(motion, "dp5", 1e-9, 1.5) === null, motion.reason);
    expect_near(motion.events[0].t, 1, 1e-9, "hit");
    expect_near(motion.u[1], 5 - 10 * 0.5, 1e-8, "rebound");
    expect_near(motion.u[2], 0, 1e-9, "no turn");
    const tilted = started("bar", [0, 3, 0.3], [0, 0, 0], {}, [1, 1]),
      before = energy(tilted);
    let last = before;
    while (tilted.t < 8) {
      expect(tilted.step("dp5", 1e-8, 8), tilted.reason);
      const now = energy(tilted);
      expect(now <= last + 1e-6, `gains energy: ${now - last}`);
      last = now;
    }
    expect_near(tilted.q[1], 0, 1e-6, "lies on the ground");
    expect(tilted.m[0] === 0 && tilted.m[1] === 0, "both ends rest");
    expect_near(tilted.l[0] + tilted.l[1], 10, 1e-9, "weight");
    tilted.drag(0, [1, 2]);
    expect_near(tilted.q[1], 2, 1e-6, "lifted");
    tilted.drag(0, [1, -3]);
    expect(
      tilted.value("residual").every((gap) => gap > -1e-9),
      "not below the ground",
    );
  },
  a_change_point_is_passed_or_told() {
    for (const [method, accuracy] of [
      ["dp5", 1e-7],
      ["dop853", 1e-7],
    ]) {
      const motion = started("parallelogram", [1, 1, 0], [-1, -1, 0]),
        before = energy(motion);
      const reason = run(motion, method, accuracy, 20);
      if (reason === null) expect_near(energy(motion), before, 1e-3, `${method}: energy`);
      else expect(/singular position/.test(reason), reason);
    }
  },
  dry_friction_turns_or_rests() {
    // Upwards it is braked by both, and slides back with what is left of the pull.
    const sliding = started("dry_friction", [0], [-8], {}, undefined, { 0: 3, 1: 1 });
    expect(run(sliding, "dp5", 1e-9, 5) === null, sliding.reason);
    expect_near(sliding.q[0], -8 + 0.5 * 2 * 3 * 3, 1e-8, "turns after 2 s");
    expect(sliding.steps < 40, `${sliding.steps} steps`);
    const resting = started("dry_friction", [0], [4]);
    expect(/comes to rest on a jump/.test(run(resting, "dp5", 1e-9, 5)), `${resting.reason} at ${resting.t}`);
    expect_near(resting.t, 2, 1e-3, "rests after 2 s");
  },
};
