// What ends a motion, or refuses a state, in the words of the library.

/** The text for rows that lose rank. */
function rank_loss(names) {
  const all = names.map((name) => `\`${name}\``).join(", ");
  return names.length === 1
    ? `constraint ${all} loses its gradient`
    : `the constraints ${all} depend on each other`;
}

/** Texts of what ends a motion, or refuses one: those of the library. */
const FAILURES = {
  singular_mass_matrix: ({ coordinate, pivot, negative }) =>
    negative
      ? `the mass matrix is not positive definite: coordinate \`${coordinate}\` has negative inertia at ` +
        `this state (pivot ${scientific(pivot)}); give what moves with it positive masses and moments ` +
        `of inertia`
      : `the mass matrix is singular: coordinate \`${coordinate}\` has no inertia of its own at this ` +
        `state (pivot ${scientific(pivot)}); give what moves with it a mass`,
  contradiction: ({ row, residual, rank }) =>
    `the constraints contradict each other: no acceleration satisfies \`${row}\` ` +
    (Math.abs(residual) < 1e12 ? `(missed by ${scientific(residual)}) ` : "") +
    `together with the others, whose Jacobian has rank ${rank} here`,
  singular_position: ({ names, condition, cause }) =>
    `singular position: ${rank_loss(names)} here (conditioning ${scientific(condition, 1)}), so that the ` +
    `motion cannot be continued; change dimensions or start so that it is passed at a distance, or end ` +
    `the motion before. The method met: ${cause}`,
  singular_start: ({ names }) =>
    `the start is a singular position: ${rank_loss(names)} there, so that accelerations are not ` +
    `determined; start beside it, or with velocities along a branch`,
  branch_undetermined: ({ rank, active }) =>
    `branches of the constraints cross here, where ${active} rows have rank ${rank}, and accelerations ` +
    `beside this position do not tell on which the motion goes on; start with velocities along one of ` +
    `them, or pass it at another time`,
  constraint_not_finite: ({ row }) => `constraint \`${row}\` is not finite here`,
  off_constraint: ({ what, row, residual, distance }) =>
    `no ${what} that satisfy the constraints were found near the given ones: \`${row}\` is still missed ` +
    `by ${scientific(residual)} (a distance of ${scientific(distance)}); the constraints contradict each ` +
    `other there, or the mechanism cannot be closed`,
  vanishing_gradient: ({ row }) =>
    `the gradient of constraint \`${row}\` vanishes here, so that it restricts no acceleration; write it ` +
    `so that it crosses zero with a slope (the root of a square instead of the square), or stay away from ` +
    `this position`,
  reaction_not_unique: ({ row }) =>
    `a force, or a contact that may lift off, depends on the reaction of \`${row}\`, which is not ` +
    `decided: other constraints repeat this one; leave one of them out, or make them compliant`,
  friction: ({ row, solutions }) => {
    const remedy = "make the contact compliant, or end the motion before";
    if (solutions === 0) {
      return (
        `no acceleration and reaction of \`${row}\` satisfy the equations with friction here (Painlevé's ` +
        `paradox): the rigid model has no motion; ${remedy}`
      );
    }
    return solutions === 1
      ? `the only reaction of \`${row}\` that satisfies the equations with friction here is unstable ` +
          `(Painlevé's paradox: more reaction accelerates into the constraint): the rigid model does not ` +
          `decide; ${remedy}`
      : `${solutions} different reactions of \`${row}\` satisfy the equations with friction here ` +
          `(Painlevé's paradox): the rigid model does not decide; ${remedy}`;
  },
  friction_unsolved: ({ row }) =>
    `no acceleration and reactions that satisfy the equations with friction were found here, of which ` +
    `\`${row}\` decides; this does not prove that there are none: see that the force is finite and ` +
    `continuous in the reactions, or make the contact compliant`,
  impact_undecided: ({ row }) =>
    `no impulses of \`${row}\` and the contacts that hit with it push all of them apart; contacts that ` +
    `repeat each other cannot be told apart: leave one of them out`,
  constraint_violated: ({ row, residual, distance }) =>
    `constraint \`${row}\` does not hold: its residual is ${scientific(residual)}, the coordinates are ` +
    `${scientific(distance)} away from it`,
  velocity_violated: ({ row, residual, distance }) =>
    `the velocities violate constraint \`${row}\`: its residual is ${scientific(residual)}, they are ` +
    `${scientific(distance)} away from it`,
  penetration: ({ row, residual }) =>
    `contact \`${row}\` is open on the wrong side, its residual is ${scientific(residual)}; place it ` +
    `where the residual is 0 or positive`,
  state_not_finite: ({ what, name, value }) => `${what} \`${name}\` is ${value}; give a finite number`,
  not_finite: ({ coordinate }) =>
    `the acceleration of \`${coordinate}\` is not finite; keep the motion away from where a force or a ` +
    `length has no finite value, or, if it does not come there, tighten the tolerance`,
  step_too_small: ({ coordinate }) =>
    `the step size collapsed, the error of \`${coordinate}\` stays above the tolerance: a value or a ` +
    `force becomes infinite here, or something jumps, or the tolerance is below the rounding of this ` +
    `method; end the motion before, make the jump an event, or loosen the tolerance (tighten it where it ` +
    `is above 1e-3: the motion may have been lost before)`,
  time_not_resolved: ({ t, h }) =>
    `a step of ${scientific(h)} at t = ${rounded(t)} is below the resolution of time; choose a longer step`,
  step_not_solved: ({ coordinate }) =>
    `the equations of an implicit step do not converge, least of all for \`${coordinate}\`; make a fixed ` +
    `step shorter, smooth a force that jumps or make the jump an event`,
  step_displaced: ({ coordinate }) =>
    `putting the end of this step back onto the constraints, or what its stages disagree by, would move ` +
    `it, \`${coordinate}\` most, by a large part of the way that it had come; make the fixed step ` +
    `shorter, or give a tolerance instead`,
  rests_on_jump: ({ coordinate }) =>
    `the motion comes to rest on a jump of its accelerations, of \`${coordinate}\`, which lead to it from ` +
    `both sides, as friction does; let what sticks there be a switched constraint, or smooth the jump`,
  overflow: ({ coordinate, order, value }) =>
    `the motion grows beyond all numbers: ${["", "the velocity of "][order]}\`${coordinate}\` is ` +
    `${scientific(value, 1)}; end it before, or look for what feeds it, as a force or a damper of the ` +
    `wrong sign, or a start or a parameter that is far off`,
  too_many_events: ({ name, t, count }) =>
    `event \`${name}\` happens in ever shorter time: more than ${count} events in one second of the ` +
    `motion, at t = ${rounded(t)}; give contacts a smaller restitution, or end the motion before`,
  event_repeats: ({ name, contact }) =>
    contact
      ? `event \`${name}\` happens again at once, without end; give the contact a larger \`rest_speed\`, ` +
        `below which it closes instead of rebounding`
      : `event \`${name}\` happens again at once, without end: it neither sticks nor slips; let it break ` +
        `away at no less than the friction with which it slips`,
  event_not_a_number: ({ name }) => `the function of event \`${name}\` is not a number`,
  stopped: ({ name, t }) => `the motion ends at event \`${name}\`, t = ${rounded(t)}`,
  assumption: ({ text }) => text,
};
