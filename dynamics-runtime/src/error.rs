//! Errors, with the values needed to act on them.

use core::fmt;

pub(crate) use dynamics_vocabulary::sentence_for_debugging;

use crate::declaration::{Assumption, AssumptionViolation, Constraint, TopContributors};

/// The mass matrix has no inverse at this state: a pivot of its factorization LDLᵀ vanished against its
/// diagonal.
#[derive(Clone, Copy, PartialEq)]
pub struct SingularMassMatrix {
    /// Index of the coordinate whose pivot vanished.
    pub coordinate: usize,
    /// Its name.
    pub name: &'static str,
    /// The pivot.
    pub pivot: f64,
    /// The pivot is negative although M comes from a kinetic energy: M is regular, but not positive definite.
    pub negative: bool,
}

impl fmt::Display for SingularMassMatrix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.negative {
            let (name, pivot) = (self.name, self.pivot);
            return write!(
                f,
                "the mass matrix is not positive definite: coordinate `{name}` has negative inertia at this \
                 state (pivot {pivot:e}); give what moves with it positive masses and moments of inertia"
            );
        }
        write!(
            f,
            "the mass matrix is singular: coordinate `{}` has no inertia of its own at this state (pivot \
             {:e}); give what moves with it a mass",
            self.name, self.pivot
        )
    }
}

sentence_for_debugging!(SingularMassMatrix);
impl core::error::Error for SingularMassMatrix {}

/// Why accelerations and reactions do not exist at a state.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The mass matrix has no inverse on the motions that the constraints leave.
    #[error(transparent)]
    SingularMassMatrix(#[from] SingularMassMatrix),
    /// The constraints contradict each other here: no acceleration satisfies them all.
    #[error(fmt = contradiction)]
    Contradiction {
        /// Row that is missed most, `closure.x`.
        row: &'static str,
        /// By how much: (Φ_q q̈ − γ) of that row.
        residual: f64,
        /// Rank of the constraint Jacobian there.
        rank: usize,
    },
    /// The constraints lose rank here, branches cross, and accelerations beside this position do not tell on
    /// which one the motion is.
    #[error(
        "branches of the constraints cross here, where {active} rows have rank {rank}, and accelerations \
         beside this position do not tell on which the motion goes on; start with velocities along one of \
         them, or pass it at another time"
    )]
    BranchUndetermined {
        /// Rank of the constraint Jacobian here.
        rank: usize,
        /// Number of rows that hold.
        active: usize,
    },
    /// Reaction-dependent forces leave no solution, or several (Painlevé's paradox). Of no solution it is a
    /// proof: the forces are linear for each pattern of signs of the reactions, and all patterns were tried.
    #[error(fmt = painleve)]
    Friction {
        /// The reaction that decides, `floor`.
        row: &'static str,
        /// Number of solutions found: 0; more than 1; or 1 that no motion with a contact of any compliance
        /// keeps to.
        solutions: usize,
    },
    /// No solution was found that a contact of any compliance keeps to, and whether there is one is not
    /// known: forces are not linear in the reactions for a pattern of their signs, or depend on so many
    /// reactions that not all patterns were tried.
    #[error(fmt = unsolved)]
    FrictionUnsolved {
        /// The reaction that decides, `floor[3]`.
        row: &'static str,
        /// Number of reactions on which forces depend.
        reactions: usize,
        /// Number of patterns that were tried, of 2 to the power of that.
        tried: u64,
    },
    /// No impulses that push let all contacts that hit at once come apart.
    #[error(
        "no impulses of `{row}` and the contacts that hit with it push all of them apart; contacts that \
         repeat each other cannot be told apart: leave one of them out"
    )]
    ImpactUndecided {
        /// The row of the first of them.
        row: &'static str,
    },
    /// A moving constraint presses bodies against constraints and contacts that do not give way: no
    /// velocities keep all contacts apart.
    #[error(
        "`{row}` is driven against constraints and contacts that do not give way: no velocities keep all of \
         them apart, and what lies between is squeezed; let what moves stop before, release what it presses \
         against, or make one of them compliant"
    )]
    ImpactSqueezes {
        /// The row of the contact that closes most, whatever the velocities are.
        row: &'static str,
        /// Φ̇ of it at the velocities at which all of them together are missed least.
        closing: f64,
    },
    /// Applied forces, or whether a contact lifts off, depend on a reaction that the constraints leave
    /// undecided, because they repeat each other.
    #[error(
        "a force, or a contact that may lift off, depends on the reaction of `{row}`, which is not decided: \
         other constraints repeat this one; leave one of them out, or make them compliant"
    )]
    ReactionNotUnique {
        /// Its row.
        row: &'static str,
    },
    /// Positions or velocities that satisfy the constraints were not found near the given ones.
    #[error(
        "no {what} that satisfy the constraints were found near the given ones: `{row}` is still missed by \
         {residual:e} (a distance of {distance:e}); the constraints contradict each other there, or the \
         mechanism cannot be closed"
    )]
    OffConstraint {
        /// What was sought: `positions` or `velocities`.
        what: &'static str,
        /// The row that is missed most, against the length of its gradient.
        row: &'static str,
        /// Its Φ, or Φ̇, where the search ended.
        residual: f64,
        /// How far away that is in coordinates: |Φ|/‖Φ_q‖ of the row.
        distance: f64,
    },
    /// A constraint restricts nothing here to first order: its gradient Φ_q vanishes.
    #[error(
        "the gradient of constraint `{row}` vanishes here, so that it restricts no acceleration; write it so \
         that it crosses zero with a slope (the root of a square instead of the square), or stay away from \
         this position"
    )]
    VanishingGradient {
        /// The row.
        row: &'static str,
    },
    /// Derivatives of the accelerations do not exist where a constraint row depends on the others.
    #[error(
        "constraint `{row}` depends on the others here (pivot {pivot:e}): the accelerations have no \
         derivatives; differentiate at another state"
    )]
    DependentRow {
        /// The row.
        row: &'static str,
        /// The pivot that vanished.
        pivot: f64,
    },
    /// Derivatives of the accelerations are generated for a model whose constraints all hold.
    #[error(
        "constraint `{constraint}` is released, and derivatives are generated for all constraints; linearise \
         a model without it"
    )]
    Released {
        /// The constraint that does not hold.
        constraint: &'static str,
    },
    /// Constraints depend on each other here, so that λ and its coefficients are not unique.
    #[error(
        "the motion has no Taylor series here: {rows} depend on each other, and what each of them carries is \
         not decided; choose another method, as methods::Dop853"
    )]
    NotExpandable {
        /// The rows that do, the largest contributor first.
        rows: TopContributors,
    },
    /// A constraint, its Jacobian or γ is infinite or not a number.
    #[error("constraint `{row}` is not finite here")]
    ConstraintNotFinite {
        /// The row.
        row: &'static str,
    },
    /// Reactions depend on inputs, and one was not set.
    #[error("the reactions depend on inputs, and `{input}` has no value; set it in the state")]
    InputNotSet {
        /// The input.
        input: &'static str,
    },
}

/// Residuals of accelerations from here on are not printed: they are those of a mechanism that locks up, and
/// their digits depend on the last step.
const MAX_PRINTED_RESIDUAL: f64 = 1e12;

fn contradiction(row: &str, residual: &f64, rank: &usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(f, "the constraints contradict each other: no acceleration satisfies `{row}` ")?;
    // Where velocities grow without bound, the residual does, too.
    if residual.abs() < MAX_PRINTED_RESIDUAL {
        write!(f, "(missed by {residual:e}) ")?;
    }
    write!(f, "together with the others, whose Jacobian has rank {rank} here")
}

/// No solution was found: why that is no proof, and what to do.
fn unsolved(row: &str, reactions: &usize, tried: &u64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let every = *reactions < u64::BITS as usize && *tried >= 1 << *reactions;
    write!(
        f,
        "no acceleration and reactions that satisfy the equations with friction were found here, of which \
         `{row}` decides; this does not prove that there are none: "
    )?;
    match every {
        true => f.write_str(
            "the forces are not linear in the reactions, and Newton's method, fixed points and growing \
             friction did not lead to any; see that the force is finite and continuous in the reactions, or \
             make the contact compliant",
        ),
        false => write!(
            f,
            "forces depend on {reactions} reactions, and of the 2^{reactions} patterns of their signs \
             {tried} were tried; let fewer contacts rub, or make them compliant"
        ),
    }
}

/// The three ways in which rigid friction has no answer.
fn painleve(row: &str, solutions: &usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let remedy = "make the contact compliant, or end the motion before";
    match solutions {
        0 => write!(
            f,
            "no acceleration and reaction of `{row}` satisfy the equations with friction here (Painlevé's \
             paradox): the rigid model has no motion; {remedy}"
        ),
        1 => write!(
            f,
            "the only reaction of `{row}` that satisfies the equations with friction here is unstable \
             (Painlevé's paradox: more reaction accelerates into the constraint): the rigid model does not \
             decide; {remedy}"
        ),
        _ => write!(
            f,
            "{solutions} different reactions of `{row}` satisfy the equations with friction here (Painlevé's \
             paradox): the rigid model does not decide; {remedy}"
        ),
    }
}

sentence_for_debugging!(SolveError);

/// Why values do not make a state of a model: one is not finite, the constraints do not hold, or they cannot
/// be made to hold.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// A coordinate, velocity, input, parameter or the time is infinite or not a number.
    #[error("{what} `{name}` is {value}; give a finite number")]
    NotFinite {
        /// What it is: `time`, `coordinate`, `velocity of`, `input`, `parameter`.
        what: &'static str,
        /// Its name; `t` for the time.
        name: &'static str,
        /// The value.
        value: f64,
    },
    /// No body has such a mass or inertia, or a matrix is no rotation.
    #[error("{assumption}: {why}")]
    Unphysical {
        /// The assumption, with its parameters and coordinates.
        assumption: &'static Assumption,
        /// Why it does not hold.
        why: AssumptionViolation,
    },
    /// A constraint to be engaged or released is not among the switched ones.
    #[error(fmt = not_switched)]
    NotSwitched {
        /// The name that was given.
        name: &'static str,
        /// The constraints of the model.
        constraints: &'static [Constraint],
    },
    /// A holonomic constraint does not hold at the coordinates.
    #[error(fmt = constraint_violated)]
    ConstraintViolated {
        /// The row, `closure.x`.
        row: &'static str,
        /// Φ there.
        residual: f64,
        /// |Φ| / ‖Φ_q‖: how far the coordinates are from fulfilling it.
        distance: f64,
        /// The constraint, where it is a switched one, which may be released instead.
        switched: Option<&'static str>,
    },
    /// The velocities do not fit a constraint: Φ̇ or A q̇ + b is not 0.
    #[error(fmt = velocity_violated)]
    VelocityViolated {
        /// The row.
        row: &'static str,
        /// Φ̇, or A q̇ + b.
        residual: f64,
        /// |Φ̇| / ‖Φ_q‖: how far the velocities are from fulfilling it.
        distance: f64,
        /// The constraint, where it is a switched one, which may be released instead.
        switched: Option<&'static str>,
    },
    /// A nonholonomic constraint is released to one side, and the velocities slip to the other.
    #[error(fmt = wrong_side)]
    WrongSide {
        /// The row.
        row: &'static str,
        /// A q̇ + b.
        slip: f64,
    },
    /// A constraint holds, but its gradient Φ_q vanishes there (Φ is a square, for example): it holds
    /// nothing.
    #[error(
        "constraint `{row}` holds nothing here: its gradient vanishes where it is fulfilled; write it \
         without the square, or start elsewhere"
    )]
    VanishingGradient {
        /// The row.
        row: &'static str,
    },
    /// A constraint or its gradient is infinite or not a number at the state, or, where coordinates are to be
    /// found, at the guess.
    #[error("constraint `{row}` is not finite here; give other coordinates or guesses")]
    ConstraintNotFinite {
        /// The row.
        row: &'static str,
    },
    /// A constraint is finite at the state or the guess, but its gradient is not: the length of a vector
    /// where it is zero, for example.
    #[error(
        "constraint `{row}` has no finite gradient here (a length or a root where it is 0); give other \
         coordinates or guesses, or write it with squares"
    )]
    GradientNotFinite {
        /// The row.
        row: &'static str,
    },
    /// No values of the coordinates that were not given fulfil the constraints, at least none that the guess
    /// leads to.
    #[error(fmt = not_assembled)]
    NotAssembled {
        /// The row that is missed most at the closest approach.
        row: &'static str,
        /// Φ there.
        residual: f64,
        /// |Φ| / ‖Φ_q‖ there.
        distance: f64,
        /// The given coordinates that keep it from closing; empty where the given values have no part in it.
        given: TopContributors,
    },
    /// The guess leads to no position that fulfils the constraints, and there is one elsewhere.
    #[error(
        "the guess leads to no position that fulfils the constraints (`{row}` is missed by {residual:e} \
         there), but there is one elsewhere, with `{coordinate}` = {value:.4}; give a guess nearer to what \
         is wanted"
    )]
    NotReached {
        /// The row that is missed most where the guess leads.
        row: &'static str,
        /// Φ there.
        residual: f64,
        /// The coordinate that is farthest from its guess in a position that fulfils them.
        coordinate: &'static str,
        /// Its value there.
        value: f64,
    },
    /// Where the guess leads, branches of solutions meet, and nothing decides between them.
    #[error(
        "the guess leads to a point where branches meet (`{row}` is missed by {residual:e} there) and does \
         not decide between them; give another guess for {coordinates}"
    )]
    SingularGuess {
        /// The row that is missed most there.
        row: &'static str,
        /// Φ there.
        residual: f64,
        /// The coordinates in which the branches differ.
        coordinates: TopContributors,
    },
    /// The position is singular, branches of motions meet there, and the velocities that were given do not
    /// say along which it moves.
    #[error(
        "the position is singular: {} here, branches meet, and the velocities that are given do not decide \
         between them; give the rates of {coordinates} as well, or start beside it",
        .rows.rank_loss()
    )]
    VelocityUndetermined {
        /// The rows that depend on each other at this position alone.
        rows: TopContributors,
        /// The coordinates whose velocities are open there, and are not beside it.
        coordinates: TopContributors,
    },
    /// A rate is given beside generalized speeds, from which all velocities follow.
    #[error(
        "the rate of `{coordinate}` is given beside generalized speeds, from which it follows; give the \
         speeds or the rates"
    )]
    RateBesideSpeeds {
        /// The coordinate whose rate it is.
        coordinate: &'static str,
    },
    /// The generalized speeds do not determine the velocities in this position, with the constraints that
    /// hold.
    #[error(
        "the generalized speeds do not tell the rates of {coordinates} apart in this position (pivot \
         {pivot:.1e}); start from rates, from another position, or with other speeds or coordinates"
    )]
    SpeedsSingular {
        /// The coordinates whose rates no speed tells apart.
        coordinates: TopContributors,
        /// What is left to divide by, of equations whose rows and columns have been scaled to 1; or the
        /// speeds against the velocities that they would take.
        pivot: f64,
    },
    /// The constraints that hold do not admit the speeds that were given.
    #[error(
        "the constraints that hold do not admit `{speed}` = {given:e}, it is {found:e}; give speeds that \
         they admit, or release the constraint that determines it"
    )]
    SpeedNotMet {
        /// The speed.
        speed: &'static str,
        /// Its value as given.
        given: f64,
        /// Its value with velocities that fulfil the other equations.
        found: f64,
    },
    /// No values of the velocities that were not given fulfil the constraints.
    #[error(fmt = velocity_not_assembled)]
    VelocityNotAssembled {
        /// The row that is missed most.
        row: &'static str,
        /// Φ̇, or A q̇ + b, that remains.
        residual: f64,
        /// The given velocities that keep it from being fulfilled; empty where the position is one that the
        /// constraints drive no further.
        given: TopContributors,
    },
}

fn constraint_violated(
    row: &str,
    residual: &f64,
    distance: &f64,
    switched: &Option<&'static str>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(
        f,
        "constraint `{row}` does not hold: its residual is {residual:e}, the coordinates are \
         {distance:e} away from it; give coordinates that fulfil it, or only some of them and \
         `.assemble()`"
    )?;
    or_release(f, *switched)
}

fn velocity_violated(
    row: &str,
    residual: &f64,
    distance: &f64,
    switched: &Option<&'static str>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(
        f,
        "the velocities violate constraint `{row}`: its residual is {residual:e}, they are \
         {distance:e} away from it; give velocities that fulfil it, or only some of them and \
         `.assemble()`"
    )?;
    or_release(f, *switched)
}

fn wrong_side(row: &str, slip: &f64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(
        f,
        "constraint `{row}` is released to the side of {} values, but slips with {slip:e}; release \
         it with `.release_to(name, {})`",
        if *slip < 0.0 { "growing" } else { "falling" },
        slip.signum()
    )
}

fn velocity_not_assembled(
    row: &str,
    residual: &f64,
    given: &TopContributors,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    if given.is_empty() {
        return write!(
            f,
            "no velocities fulfil the constraints here: `{row}` is missed by {residual:e}; the position is \
             singular, start from another"
        );
    }
    write!(
        f,
        "no velocities fulfil the constraints: `{row}` is missed by {residual:e}; change what is given for \
         the rates of {given}"
    )
}

/// The other way out where a constraint that does not hold is switched: at the start all of them hold that
/// are not released.
fn or_release(f: &mut fmt::Formatter<'_>, switched: Option<&str>) -> fmt::Result {
    match switched {
        Some(name) => write!(f, "; or begin with it released, `.release(\"{name}\")`"),
        None => Ok(()),
    }
}

fn not_switched(name: &str, constraints: &[Constraint], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if constraints.iter().any(|c| c.name == name) {
        return write!(f, "constraint `{name}` always holds; declare it with the option `switched`");
    }
    write!(f, "no switched constraint is called `{name}`; ")?;
    let mut switched = constraints.iter().filter(|c| c.switched.is_some()).peekable();
    if switched.peek().is_none() {
        return f.write_str("the model has none: declare one with the option `switched`");
    }
    f.write_str("there are")?;
    switched.enumerate().try_for_each(|(i, c)| write!(f, "{} `{}`", if i == 0 { "" } else { "," }, c.name))
}

fn not_assembled(
    row: &str,
    residual: &f64,
    distance: &f64,
    given: &TopContributors,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(
        f,
        "the constraints cannot be fulfilled: at the closest approach `{row}` is missed by {residual:e}"
    )?;
    if distance.is_finite() {
        write!(f, " (a distance of {distance:e})")?;
    }
    if given.is_empty() {
        write!(f, "; check the dimensions and other parameters, or give another guess")
    } else {
        write!(f, "; change what is given for {given}, or the dimensions, or give another guess")
    }
}

sentence_for_debugging!(StateError);
