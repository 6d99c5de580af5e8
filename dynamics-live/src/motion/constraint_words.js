// What constraints refuse, in the words of the library.

/** The text for rows that lose rank. */
function rank_loss(names) {
  const all = names.map((name) => `\`${name}\``).join(", ");
  return names.length === 1
    ? `constraint ${all} loses its gradient`
    : `the constraints ${all} depend on each other`;
}

Object.assign(FAILURES, {
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
  impact_squeezes: ({ row }) =>
    `\`${row}\` is driven against constraints and contacts that do not give way: no velocities keep all ` +
    `of them apart, and what lies between is squeezed; let what moves stop before, release what it ` +
    `presses against, or make one of them compliant`,
  constraint_violated: ({ row, residual, distance }) =>
    `constraint \`${row}\` does not hold: its residual is ${scientific(residual)}, the coordinates are ` +
    `${scientific(distance)} away from it`,
  velocity_violated: ({ row, residual, distance }) =>
    `the velocities violate constraint \`${row}\`: its residual is ${scientific(residual)}, they are ` +
    `${scientific(distance)} away from it`,
  penetration: ({ row, residual }) =>
    `contact \`${row}\` is open on the wrong side, its residual is ${scientific(residual)}; place it ` +
    `where the residual is 0 or positive`,
  step_displaced: ({ coordinate }) =>
    `putting the end of this step back onto the constraints, or what its stages disagree by, would move ` +
    `it, \`${coordinate}\` most, by a large part of the way that it had come; make the fixed step ` +
    `shorter, or give a tolerance instead`,
});
