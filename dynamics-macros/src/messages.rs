//! The one catalogue of wording: lower case, *problem; remedy*, the user's names in backticks, no full stop.
//!
//! Every entry has a case under `tests/ui/` whose file is named after it; `tests/sources/catalogue.rs`
//! checks that.

use std::fmt::{self, Display};

/// A message of the catalogue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Message {
    /// Its entry.
    pub(crate) id: &'static str,
    text: String,
}

impl Message {
    /// The same, about what a function of the library did with what it was given.
    pub(crate) fn inside(&self, function: impl Display) -> Self {
        Self { id: self.id, text: format!("inside `{function}`, {}", self.text) }
    }
}

impl Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// A number as people write it: with an exponent where plain digits would be mostly zeros.
pub(crate) fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e16).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

macro_rules! catalogue {
    ($($name:ident($($argument:ident),*) $text:literal;)*) => {
        $(pub(crate) fn $name($($argument: impl Display),*) -> Message {
            Message { id: stringify!($name), text: format!($text) }
        })*
    };
}

catalogue! {
    // The struct.
    not_a_struct(name) "`{name}` is no struct; a model is a struct, its fields are the parameters";
    name_of_language(name) "a struct called `{name}` hides the `{name}` that the functions of models name; \
        choose another name for the struct";
    generic_model() "a model cannot be generic; its derived program is concrete `f64`";
    unnamed_fields() "a model's parameters need names; write a struct with named fields";
    parameter_type(ty) "a parameter cannot be `{ty}`; use `f64`, an array, `Vec2<f64>`, `Vec3<f64>`, \
        `Mat3<f64>`, or a type with the `SmoothFunction` trait";
    parameter_without_f64(ty) "a parameter is made of `f64`; write `{ty}<f64>`";
    array_of_functions() "arrays of smooth functions are not supported; give each function a field of its \
        own";
    length_not_literal(length) "`{length}` has no value while the macro runs; write the length as a literal \
        such as `5`";
    length_zero() "an array of length 0 holds nothing; leave it out";
    too_many_parameters(limit) "more than {limit} scalars in one model; check the array lengths";
    no_coordinates(name) "`{name}` has no coordinates; name them with `#[coordinates(theta: rad, x: m)]`";
    attribute_twice(name) "`#[{name}(..)]` is given twice; put all entries into one";
    attribute_without_list(name, example) "`{name}` needs its entries; write `{example}`";
    attribute_entry(form) "this entry cannot be read; write {form}";
    attribute_of_unknown_field(attribute, name, hint) "`{attribute}` names `{name}`, which is no field of \
        the struct{hint}";
    units_of_unknown(name, hint) "`units` names `{name}`, which is no field of the struct and no \
        `#[output]`{hint}";
    entry_twice(attribute, name) "`{attribute}` names `{name}` twice; keep one entry";
    nominal_of_function(name, what) "`{name}` is {what}, which has no nominal value; leave it out";
    nominal_shape(name, form) "the nominal value of `{name}` has another shape than the field; write {form}";
    model_argument() "`model` takes `crate`, `sin_cos` and `targets`, each once; write `#[model(crate = \
        path::to::dynamics)]`, `#[model(sin_cos = accurate)]` or `#[model(targets(c))]`";
    unknown_target(name, known) "`{name}` is no target; the targets are {known}";
    target_of_families() "a model with families has loops, which are not printed in C; leave the target out";
    keyword_as_name(name, what) "`{name}` is a keyword of Rust; choose another name for the {what}";
    reserved_name(name, what) "`{name}` cannot be {what}: the state has something of that name already; \
        choose another name";
    duplicate_name(name, other) "`{name}` is {other} already; choose another name";
    rate_name(name, coordinate) "`{name}` is the name of the rate of `{coordinate}`; choose another name";
    generated_name(name) "every model has a `{name}` already; choose another name";
    result_name(name, role, other) "results are found by name, and `{name}` is {other} already; choose \
        another name for this `#[{role}]`";
    guess_name(name, coordinate) "`{name}` is the name of the guess of `{coordinate}`; choose another name";
    nested_too_deeply() "this is nested too deeply or chained too long; split it into several `let`s or \
        functions";

    // The impl block and its roles.
    attribute_arguments() "`#[dynamics]` takes no arguments; remove them";
    not_an_impl() "`#[dynamics]` stands on an impl block; write `#[dynamics] impl Model {{ .. }}`";
    impl_of_other_type() "`#[dynamics]` needs the name of a struct; write `impl Model {{ .. }}`";
    two_impls(model) "there are two `#[dynamics] impl {model}` in this module; move these functions into the \
        other";
    trait_impl() "`#[dynamics]` describes a model in its inherent impl block; write `impl Model {{ .. }}` \
        without a trait";
    macro_in_model(name, remedy) "the macro call `{name}!` cannot be followed; {remedy}";
    cfg_in_model(name) "`#[{name}]` is not known to the macro, which would derive the model as if it held; \
        keep it out of the model: choose by a parameter, or put functions that the model does not use into \
        an `impl` block of their own";
    lagrangian_beside(role, function) "`#[lagrangian]` stands for T − V as a whole, yet `{function}` is \
        marked `#[{role}]`; put everything into `#[lagrangian]`, or use `#[kinetic]` and `#[potential]` \
        alone";
    role_with_arguments(name) "`#[{name}]` takes no arguments; write it bare";
    role_outside(name) "`#[{name}]` says nothing here; put it on a method in the `impl` block with \
        `#[dynamics]`";
    role_twice(name, function) "`{function}` is marked `#[{name}]` twice; remove one";
    two_roles(function, first, second) "`{function}` is both `#[{first}]` and `#[{second}]`; give each role \
        its own function";
    duplicate_role(name, first) "`#[{name}]` is already on `{first}`; a model has only one";
    misspelt_role(name, role) "no role is called `{name}`; did you mean `#[{role}]`?";
    constraint_options(name, option) "the options of `#[{name}]` stand in parentheses, separated by commas; \
        write `#[{name}({option})]`, or `#[{name}]` without any";
    unknown_constraint_option(name, option, hint) "`#[{name}]` has no option `{option}`{hint}";
    constraint_option_twice(option) "`{option}` is said twice; say it once";
    integrable_holonomic() "`integrable` belongs to `#[nonholonomic]`, a holonomic constraint is integrated \
        already; leave it out";
    redundant_as_option(name) "`redundant` is an attribute of its own; write `#[{name}] #[redundant]`";
    redundant_without_constraint(function) "`{function}` is no constraint that could be redundant; write \
        `#[holonomic]` or `#[nonholonomic]` beside it, or remove `#[redundant]`";
    too_many_switched(limit) "more than {limit} switched constraints in one model; let those that are \
        switched together be one array";
    forgotten_role(function, field) "`{function}` has no role and no function calls it, yet only it reads \
        `{field}`; mark it `#[potential]`, `#[force]`, `#[holonomic]`, `#[output]` or what it is meant to be";
    no_kinetic_energy(name) "`{name}` has no kinetic energy; mark a function `#[kinetic]` or `#[lagrangian]`";
    role_signature(role, form) "`#[{role}]` needs another signature; write `{form}`";
    role_result(role, expected, found) "`#[{role}]` returns {found} here; return {expected}";

    // Families.
    length_of_no_count(name, hint) "`{name}` is no count; the length of a family is a field of type \
        `usize`{hint}";
    family_of(what) "an array of this length would be a family, and only coordinates have families; give the \
        {what} a length such as `5`";
    array_beside_families(name) "`{name}` has a fixed length beside families of coordinates; give each of \
        its coordinates a name of its own";
    length_of_family(length, most) "`{length}` is no length of a family; write `self.n`, `self.n + k` or \
        `self.n - k`, with k at most {most}";
    grid_of_families() "both lengths of a grid are counts, `[[m; self.columns]; self.rows]`; give each of \
        few rows or columns a family of its own";
    three_indices() "coordinates have two indices at most; write several grids";
    family_as_list(found) "a loop runs over a range or an array, not over {found}; loop over `0..self.n`, \
        and read the nodes by their index";
    index_form(what, most) "`{what}` makes no index; an index of a family is `i + k`, `i - k`, `self.n + k`, \
        `self.n - k` or a number, with k at most {most}";
    index_far(index, most) "`{index}` is too far from the first node; a number among indices is at most \
        {most}, as the model is unrolled up to there to be checked";
    index_below(name, index, rounds) "`{name}[{index}]`{rounds} is below `{name}[0]`; begin the range later, \
        or give the first nodes an `if`";
    index_above(name, index, rounds, what, length) "`{name}[{index}]`{rounds} is above the last {what} of \
        `{name}`, which has `{length}` of them; end the range earlier, or give the last nodes an `if`";
    index_of_other_count(name, index, rounds, length) "`{name}[{index}]`{rounds} may be outside of `{name}`, \
        which has `{length}` nodes: nothing says which of two counts is larger; use one count for both";
    row_of_other_count(name, index, rounds, length) "`{name}[{index}]`{rounds} may be outside of `{name}`, \
        which has `{length}` rows; the first index is that of the row, the second that of the column";
    indices_compared() "the indices of two loops are compared here, and either may be the larger one; \
        compare an index with a number or a count";
    counts_compared() "two counts are compared here, and either may be the larger one; compare indices with \
        one count";
    range_of_round() "the ends of a range are counts or numbers; the index of a round cannot be one";
    rounds_in_rounds() "a sum over an index stands within two others; sums have two indices at most, let one \
        of them have a length such as `5`";
    round_left(word) "`{word}` would leave a sum over an index early; give the range its end, or use an `if`";
    round_assigns(name) "`{name}` is assigned by every round of this loop, which may only add to it as a \
        whole, with `+=` or `-=`, and not read it; put what a round needs into a variable of its own";
    mass_moves(function) "the mass matrix of `{function}` is not constant, which is not supported \
        beside families; write kinetic energies with masses that are constant";
    energy_not_quadratic(function) "`{function}` is no quadratic function of the velocities, which is not \
        supported beside families; write `0.5 * self.mass * velocity.powi(2)`";
    elements_differ(what, coordinate) "{what} of `{coordinate}` differs between the elements and the model \
        unrolled; this is a mistake of `dynamics`, please report it";
    sum_as_value() "of a sum over an index only sums, differences and multiples can be made yet; do this \
        with every summand, or give what the sum stands for a coordinate of its own";
    constraint_of_two_indices() "constraints over two indices are not supported yet; write stiff springs, or a \
        constraint over one index for each of few rows";
    constraint_option_beside_families(option) "`{option}` is not supported in a model with families of \
        coordinates; write the constraint without it, or a model of fixed size";
    reaction_in_force_of_families() "forces that depend on reactions are not supported in a model with \
        families of coordinates; read reactions in an `#[output]`, or write a model of fixed size";
    role_beside_families(role, instead) "`#[{role}]` is not supported in a model with families of \
        coordinates; {instead}, or write a model of fixed size";

    // Names.
    unknown_name(name, hint) "`{name}` is not known here; {hint}";
    unknown_parameter(name, hint) "the model has no parameter `{name}`{hint}";
    unknown_coordinate(name, hint) "the model has no coordinate or input `{name}`{hint}";
    unknown_function(name, hint) "the model's `impl` has no function `{name}`; {hint}";
    unknown_constant(name, hint) "the model's `impl` has no constant `{name}`; {hint}";
    unknown_method(shape, name, hint) "{shape} has no method `{name}`; {hint}";
    coordinate_as_parameter(name) "`{name}` is a coordinate or an input; write `q.{name}`";
    parameter_as_coordinate(name) "`{name}` is a parameter; write `self.{name}`";
    rate_as_coordinate(name, coordinate) "rates are derivatives here; write `q.{coordinate}.dt()` instead of \
        `q.{name}`";
    constant_without_self(name) "`{name}` is a constant of the impl; write `Self::{name}`";
    not_the_constant_of_std(path, name) "`{path}` is not std's `{name}`, and its value is not visible to the \
        macro; declare it as a constant of the `impl` and write `Self::` before its name";
    constant_differs(name) "rustc gives `Self::{name}` another value than the equations were derived with; \
        write its value without arithmetic that rounds or wraps";
    function_of_f64(name) "`f64::{name}` takes an `f64`, and this changes as the model moves; write \
        `.{name}(..)` after the expression";
    foreign_constant(name) "the value of `{name}` is not visible to the macro; declare it as a constant of \
        the `impl` and write `Self::` before its name";
    function_without_self(name) "`{name}` is a function of the impl; write `self.{name}(..)` or \
        `Self::{name}(..)`";
    foreign_function(name, hint) "`{name}` is not part of the model and cannot be followed{hint}; write a \
        function of the `impl`";
    unset_variable(name) "`{name}` has no value yet; give it one where it is declared";
    no_field(shape, member) "{shape} has no field `{member}`; use it as a whole or by its methods";
    no_component(name, length) "a `Vec{length}` has no component `{name}`; its first ones are `x` and `y`, \
        only a `Vec3` has `z`";

    // Shapes.
    shape_mismatch(operator, left, right) "`{operator}` does not combine {left} with {right}; make the \
        shapes fit";
    expected_shape(expected, found) "expected {expected}, found {found}; pass {expected}";
    operand(operator, found) "`{operator}` does not apply to {found}; apply it to the parts";
    comparison_of(left, right) "{left} cannot be compared with {right}; compare scalars";
    not_a_condition(found) "a condition is a comparison, this is {found}; compare scalars with `<`, `<=`, \
        `>`, `>=`, `==` or `!=`";
    branches_differ(then, otherwise) "the branches differ: one is {then}, the other {otherwise}; make them \
        alike";
    pattern_mismatch(found) "this pattern does not fit {found}; bind as many parts as there are";
    argument_count(function, expected, found) "`{function}` gets {found} arguments instead of {expected}; \
        pass what it takes";
    index_out_of_range(index, what, length) "index {index} is out of range; {what} has {length} elements, \
        counted from 0";
    index_unknown(found) "an index has to be an integer known at compile time, this is {found}; use a \
        literal or a loop variable";
    matrix_index() "a matrix is indexed by a pair; write `m[(i, j)]`";
    not_indexable(found) "{found} cannot be indexed; use its fields or methods";
    negative_index(value) "{value} is negative and cannot become an index; check the arithmetic";
    no_time_derivative(found) "{found} has no time derivative; take `.dt()` of scalars, vectors, matrices, \
        arrays and tuples of them";
    read_out(name) "`.{name}()` reads a number while the model runs; in the model's functions use the \
        expression itself";

    // Numbers.
    caret_as_power() "`^` is not a power in Rust; write `.powi(2)`";
    bit_operator(operator) "`{operator}` works on bits, not on numbers; use arithmetic";
    remainder_of_expression() "`%` jumps and has no derivative; use it on integers only";
    integer_division(value) "this division of integers drops its remainder and gives {value}; write the \
        numbers with a decimal point";
    integer_overflow(operator, left, right) "`{operator}` of the integers {left} and {right} has no result; \
        check them";
    integer_beyond(operation, value, ty) "`{operation}` gives {value} here, which is beyond {ty}; convert to \
        `f64` before";
    integer_of_unknown_type(name) "what `{name}` gives depends on the integer's type, which is not known \
        here; write the type, as in `3_usize`";
    integer_with_real(operator, value, other) "`{operator}` does not combine the integer {value} with \
        {other}; write `{value}.0`, or `f64::from(i)` of a variable";
    single_precision(what) "`{what}` is single precision, whose rounding the equations would not have; write \
        `f64`";
    integer_too_large(value) "the integer `{value}` is too large; write it with a decimal point";
    division_by_zero() "this divides by zero whatever the values are; check the denominator";
    domain(function, value) "`{function}` of {value} is not a real number; check the argument";
    not_finite(what) "{what} is not a finite number; models need finite numbers";
    power_too_large(power, limit) "the power {power} is beyond {limit}; use `exp` and `ln`";
    clamp_order(low, high) "`clamp` from {low} to {high} has its bounds in the wrong order; swap them";
    cast(shape, to) "{shape} cannot become `{to}` here; integers are known at compile time, and `as f64` \
        makes them real";
    literal_kind(literal) "`{literal}` has no meaning in a model; use numbers";

    // Statements.
    unsupported(what, remedy) "{what} cannot be followed; {remedy}";
    closure_method(name) "`{name}` takes a closure, which cannot be followed; write a `for` loop, or `map`";
    mutable_reference() "`&mut` and `ref mut` cannot be followed; return the new value";
    mutable_iterator() "`iter_mut` cannot be followed; write a `for` loop over indices and assign to the \
        elements";
    not_assignable(place) "`{place}` cannot be assigned to; assign to a `let mut` variable";
    recursion(function) "`{function}` calls itself, directly or through others; write a `for` loop";
    call_of_value() "only functions can be called; call a function of the `impl` by its name";
    loop_bound(found) "the bounds of a loop have to be integers known at compile time, this is {found}; use \
        literals, array lengths or constants of the `impl`";
    open_range() "this range has no end; give it both bounds";
    not_iterable(found) "a loop runs over a range or an array, not over {found}; loop over indices known at \
        compile time";
    too_many_iterations(count, limit) "{count} rounds are too many to unroll, the limit is {limit}; check \
        the bounds";
    length_unknown() "the length of an array has to be known at compile time; use a literal or a constant of \
        the `impl`";
    undecided_exit(name) "`{name}` here depends on the motion; let the `if` give both values instead";
    undecided_integer() "this integer would depend on the motion; let the branches give real numbers";
    match_on(found) "`match` needs an integer known at compile time, this is {found}; use `if` on \
        comparisons";
    no_arm(value) "no arm matches {value}; add one";
    too_many_operations() "the model grows beyond what can be compiled here; use shorter loops or fewer \
        elements";

    // Time.
    rate_of_input(name) "the rate of the input `{name}` is not known; make it a coordinate, or take `.dt()` \
        of something without it";
    third_derivative() "derivatives beyond accelerations are not known; take `.dt()` at most twice";
    rate_of_reaction() "the rate of a reaction is not known; take the derivative of what does not contain it";

    // Reactions.
    reaction_argument(method) "`{method}` is asked of the coordinates about a constraint; write \
        `q.{method}(Self::name)`";
    unknown_constraint(name, hint) "the model has no constraint `{name}`{hint}";
    reaction_of_no_constraint(method, name) "`{method}` needs a constraint, and `{name}` is none; name a \
        function with `#[holonomic]` or `#[nonholonomic]`";
    reaction_in_role(method, role) "`{method}` has no place in a function with `#[{role}]`, which \
        constraints are derived with; use it with `#[force]`, `#[output]` or `#[event]`";
    slip_of_unswitched(name) "`{name}` always holds and is never slipping; declare it with the option \
        `switched`";

    // Speeds.
    kinematic_without_speed(name, hint) "no speed is called `{name}`{hint}; name it on the struct: \
        `#[speeds({name}: rad/s)]`";
    speed_without_kinematic(name) "the speed `{name}` is not said; give it a function with `#[kinematic]` of \
        this name: `fn {name}(&self, q: &Coordinates<Self>)`";
    kinematic_shape(name, expected, found) "the speed `{name}` is declared as {expected}, and this is \
        {found}; make them agree";
    speed_as_coordinate(name) "`{name}` is a speed, which the coordinates do not hold; write \
        `self.{name}(q)`";
    unit_of_speed(name, found, expected) "`{name}` is in `{found}`, and declared in `{expected}`; check its \
        factors, or the declaration";
    speed_not_linear(name) "the speed `{name}` is not linear in the velocities, which could not be solved \
        for; write sums of velocities times functions of coordinates and time";
    speeds_count(speeds, left, needed) "{speeds}, and {left}; declare {needed}";
    speed_dependent(name, what) "the speed `{name}` {what}, so that the speeds do not determine the \
        velocities; choose another";

    // Units.
    unknown_unit(name, hint) "`{name}` is no unit; {hint}";
    scaled_unit(name, equals, coherent) "`{name}` is a scaled unit, 1 {name} = {equals}; give values in \
        `{coherent}`";
    mixed_systems(unit, system, other, other_system) "`{unit}` is {system}, but `{other}` is {other_system}; \
        use one system of units";
    mixed_unit(unit, system, other_system) "`{unit}` is {system}, but what stands before it is \
        {other_system}; use one system of units";
    unit_syntax(expected, found) "a unit needs {expected} here, found {found}; write for example `kg*m^2/s`";
    unit_mismatch(operator, left, right, remedy) "`{operator}` combines `{left}` with `{right}`; {remedy}";
    unit_of_argument(function, unit) "`{function}` of a quantity in `{unit}`; its argument has to be a plain \
        number or an angle";
    unit_of_branches(then, otherwise) "one branch is in `{then}`, the other in `{otherwise}`; both need the \
        same unit";
    unit_of_role(name, found, what, expected) "`{name}` is in `{found}`, but {what} is in `{expected}`; \
        check its factors, literals have no unit";
    unit_of_force(name, found, expected) "`{name}` does work in `{found}` instead of `{expected}`; check \
        force and point, or magnitude and expression";
    unit_of_function_argument(found, expected) "this smooth function is used with an argument in `{found}` \
        and elsewhere in `{expected}`; use one unit";

    // What the engine finds.
    not_followed(name) "`{name}` could not be followed; write it with simpler statements";
    unused(what, name) "the {what} `{name}` has no influence on anything; use it, or remove it";
    no_inertia(direction) "no kinetic energy moves `{direction}`: the mass matrix is singular everywhere; \
        give it inertia or remove it";
    too_large(function, operations, limit) "`{function}` would take {operations} operations, the limit is \
        {limit}; use fewer coordinates or simpler expressions";
    zero_denominator() "something divides by an expression that is zero on every motion; check the \
        denominators of outputs and events";
    not_quadratic(name) "`{name}` is not quadratic in the velocities; if it is meant so, write T − V as one \
        `#[lagrangian]`";
    corner_in_position(name) "`{name}` has velocities of positions that are chosen (`if`, `min`, `max`): \
        where they have a corner masses would be struck; make the position a smooth function, as a \
        `CubicSpline` parameter with `.at(..)`, or leave contact to `#[holonomic(switched)]` or a force";
    energy_jumps(name) "`{name}` jumps where a choice (`if`, `abs`, `signum`) changes: masses would be \
        struck there, and their energy would not be accounted for; make the position or the mass a smooth \
        function, as a `CubicSpline` parameter with `.at(..)`, or leave contact to `#[holonomic(switched)]` \
        or a force";
    potential_jumps(name) "`{name}` jumps where a choice (`if`, `abs`, `signum`) changes: no force stands \
        for a step, and energy would be lost or gained there; make it continuous, as a steep `tanh`, or act \
        at an `#[event]`; where it is so for the parameters that are meant alone, give them by \
        `#[nominal(..)]`";
    contains(role, name, what, reason) "the {role} `{name}` contains {what}; {reason}";
    no_effect(role, name, reason) "the {role} `{name}` {reason}; remove it or correct it";
    negative_inertia(direction, when) "the kinetic energy is negative where `{direction}` moves{when}; check \
        its signs";
    negative_mass(what, name, value) "a body in `{name}` has the {what} {value}, and no body has a negative \
        one; check its signs";
    unphysical_inertia(name, why) "the inertia of a body in `{name}` {why}; check signs, units and about \
        which point it is";
    not_a_rotation(name, by) "a frame in `{name}` is turned by a matrix that is no rotation, RᵀR differs \
        from the identity by {by}; turn by angles, or give unit vectors at right angles";
    not_an_axis(name) "the axis of a turn in `{name}` has a length whose square is 0 or infinite as a \
        number; give it a length near 1";
    not_kept_a_rotation(name, of) "the matrix of {of} that turns a frame in `{name}` is no rotation in \
        general, and nothing makes it one; hold it by a `#[holonomic]` such as \
        `EulerParameters::norm_constraint`, or turn by angles";
    finding(text) "the model cannot be derived: {text}; change what it names";

    // What the engine finds of constraints.
    constraint_contains(name, what, reason) "the constraint `{name}` contains {what}: {reason}; write it in \
        coordinates and time, a nonholonomic one in velocities too";
    constraint_with_velocities(name) "`{name}` contains velocities, a holonomic constraint has none; mark it \
        `#[nonholonomic]`, or write it in coordinates";
    constraint_without_velocities(name) "`{name}` contains no velocities, so that it restricts coordinates; \
        mark it `#[holonomic]`";
    constraint_not_linear(name) "`{name}` is not linear in the velocities; write constraints on velocities \
        as sums of velocities times functions of coordinates and time, and what controls a speed as a \
        `#[force]`";
    constraint_always_zero(name) "`{name}` is zero in every state and restricts nothing; correct it, remove \
        it, or mark it `#[redundant]` if that is meant";
    constraint_without_coordinate(name) "`{name}` involves no coordinate and restricts nothing that moves; \
        write it in terms of coordinates, or remove it";
    constraint_repeats(name, of) "`{name}` repeats {of}; remove it, or mark its constraint `#[redundant]` if \
        the repetition is meant";
    constraint_repeats_where_held(name, of) "`{name}` repeats {of} wherever the constraints hold; remove it, \
        or mark its constraint `#[redundant]` if the repetition is meant";
    constraint_tangent(name, to) "`{name}` is tangent to {to} wherever the constraints hold, so that it \
        holds positions but no velocities; write what it holds as rows that cross the others, or mark its \
        constraint `#[redundant]` to have it nonetheless";
    constraint_contradicts(name, with) "`{name}` contradicts {with}: they cannot hold together; correct or \
        remove one of them";
    constraint_unsatisfiable(missed) "no state was found in which all constraints hold at the nominal \
        values: at the closest approach {missed}; correct one of them, or `#[nominal(..)]`";
    constraint_too_many(rows, coordinates, name) "{rows} rows of constraints on {coordinates} leave no \
        state: `{name}` is one too many; remove it, or mark it `#[redundant]` if it follows from the others";
    constraint_redundant_in_vain(name) "`{name}` repeats nothing; remove `#[redundant]`";
    constraint_integrable(which, names) "{which} integrable: {names}; declare the integral as \
        `#[holonomic]`, or say `#[nonholonomic(integrable)]` if that is meant";
    constraint_without_freedom(names) "{names} leave no velocity free, so that time alone decides how the \
        model moves; mark their constraints `#[nonholonomic(integrable)]` if that is meant, or remove what \
        should not hold";
    constraint_integrable_in_vain(name) "`{name}` cannot be integrated; remove `integrable`";
    constraint_gradient_vanishes(name) "the gradient of `{name}` vanishes, turns round or is infinite \
        wherever it holds, so that no reaction can hold it; write the root of a square, the inside of an \
        absolute value or of a root, and each term of a sum of squares by itself";
    constraint_leaves_without_inertia(direction) "the constraints leave `{direction}` free, and no kinetic \
        energy moves it; give it inertia or restrict it";
}
