// What ends a motion, or refuses a state, in the words of the library.

/** Texts by the kinds of failures. Constraints and events add theirs. */
const FAILURES = {
  singular_mass_matrix: ({ coordinate, pivot, negative }) =>
    negative
      ? `the mass matrix is not positive definite: coordinate \`${coordinate}\` has negative inertia at ` +
        `this state (pivot ${scientific(pivot)}); give what moves with it positive masses and moments ` +
        `of inertia`
      : `the mass matrix is singular: coordinate \`${coordinate}\` has no inertia of its own at this ` +
        `state (pivot ${scientific(pivot)}); give what moves with it a mass`,
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
  rests_on_jump: ({ coordinate }) =>
    `the motion comes to rest on a jump of its accelerations, of \`${coordinate}\`, which lead to it from ` +
    `both sides, as friction does; let what sticks there be a switched constraint, or smooth the jump`,
  overflow: ({ coordinate, order, value }) =>
    `the motion grows beyond all numbers: ${["", "the velocity of "][order]}\`${coordinate}\` is ` +
    `${scientific(value, 1)}; end it before, or look for what feeds it, as a force or a damper of the ` +
    `wrong sign, or a start or a parameter that is far off`,
  assumption: ({ text }) => text,
};
