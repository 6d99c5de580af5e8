//! Changes of a model's tokens: small ones that leave most of it valid, and a few that do not.

use proc_macro2::{Delimiter, Ident, Literal, Punct, Spacing, Span, TokenTree};

use crate::corpus::Seed;
use crate::random::Random;
use crate::trees::{Tree, parsed, place, size};

/// Largest input that mutations build up to.
const LARGEST: usize = 20_000;

/// Fragments of the language, and of Rust that lies just outside of it.
pub const WORDS: &[&str] = &[
    // Roles and attributes.
    "#[kinetic]",
    "#[potential]",
    "#[lagrangian]",
    "#[dissipation]",
    "#[force]",
    "#[output]",
    "#[event]",
    "#[drawing]",
    "#[holonomic]",
    "#[nonholonomic]",
    "#[holonomic(switched)]",
    "#[nonholonomic(switched, integrable)]",
    "#[redundant]",
    "q.reaction(Self::rod)",
    "q.slip(Self::rod)",
    "#[coordinates(x)]",
    "#[coordinates(theta: [rad; 3])]",
    "#[coordinates(y: [_; 2], s: m)]",
    "#[inputs(torque: N*m)]",
    "#[inputs(f)]",
    "#[units(m: kg, k: N/m)]",
    "#[units(a: m/s^2)]",
    "#[units(a: mm)]",
    "#[units(a: deg)]",
    "#[units(a: slug, b: ft)]",
    "#[nominal(m = 1.0)]",
    "#[nominal(m = -1e308)]",
    "#[model(crate = a::b)]",
    "#[cfg(test)]",
    "#[doc = \"x\"]",
    // Types.
    "f64",
    "Expr",
    "Vec2",
    "Vec3",
    "Mat3",
    "Vec3<f64>",
    "Mat3<f64>",
    "[f64; 3]",
    "[f64; 0]",
    "[f64; 100000]",
    "[[f64; 2]; 2]",
    "Force",
    "CubicSpline",
    "(Expr, Vec2)",
    "[Expr; 2]",
    "usize",
    "i32",
    "bool",
    "&str",
    "impl Fn(f64) -> f64",
    "Coordinates<Self>",
    "Drawing",
    "&Coordinates<Self>",
    "Self",
    "!",
    "_",
    "dyn Any",
    "&'a mut T",
    "[_; N]",
    "[rad; usize]",
    // Units.
    "rad",
    "m",
    "kg",
    "s",
    "N*m",
    "m/s^2",
    "kg m^2",
    "ft",
    "slug",
    "lb",
    "J",
    "mm",
    "deg",
    "1",
    "m^-1",
    "m^0.5",
    "m^(1/2)",
    "s^999999999999",
    "kg/(m*s)",
    "s^-170141183460469231731687303715884105728",
    // Expressions.
    "self",
    "q",
    "q.t",
    "q.x",
    "q.theta",
    "q.theta1",
    "q.theta[0]",
    "q.theta[i]",
    "self.m",
    "self.g",
    "self.track.at(q.s)",
    ".dt()",
    ".dt().dt()",
    ".dt().dt().dt()",
    ".x",
    ".y",
    ".z",
    ".0",
    ".1",
    "Expr::ZERO",
    "Expr::ONE",
    "Self::N",
    "PI",
    "f64::consts::PI",
    "std::f64::consts::TAU",
    "f64::MAX",
    "f64::NAN",
    "f64::INFINITY",
    "f64::EPSILON",
    "vec2(0.0, 1.0)",
    "vec3(q.x, 0.0, 1.0)",
    "vec2(q.x)",
    ".sin()",
    ".cos()",
    ".tan()",
    ".asin()",
    ".acos()",
    ".atan()",
    ".atan2(q.x)",
    ".sinh()",
    ".cosh()",
    ".tanh()",
    ".exp()",
    ".ln()",
    ".sqrt()",
    ".cbrt()",
    ".powi(2)",
    ".powi(-3)",
    ".powi(1000)",
    ".powi(2147483647)",
    ".powi(-2147483648)",
    ".powf(0.5)",
    ".powf(q.x)",
    ".recip()",
    ".hypot(q.x)",
    ".abs()",
    ".signum()",
    ".min(q.x)",
    ".max(0.0)",
    ".sin_cos()",
    ".to_radians()",
    ".floor()",
    ".mul_add(2.0, 3.0)",
    ".exp2()",
    ".log10()",
    ".ln_1p()",
    ".clamp(0.0, 1.0)",
    ".dot(q.x)",
    ".cross(self.axis)",
    ".norm()",
    ".norm_squared()",
    ".transpose()",
    ".trace()",
    ".determinant()",
    ".row(0)",
    ".column(2)",
    ".perp()",
    ".normalize()",
    ".iter()",
    ".len()",
    ".sum()",
    ".map(|x| x * x)",
    ".iter().map(|x| x.sin()).sum()",
    ".zip(q.theta)",
    ".enumerate()",
    ".rev()",
    ".fold(0.0, |a, b| a + b)",
    ".into_iter()",
    ".value()",
    ".unwrap()",
    ".clone()",
    "as f64",
    "as usize",
    "as Expr",
    "as u8",
    "Force::at(vec2(q.x, 0.0), vec2(1.0, 0.0))",
    "Force::along(q.x, 1.0)",
    "[q.x; 3]",
    "[0.0; 100000]",
    "[0.0; 99999999999999]",
    "[1.0, 2.0]",
    "(q.x, 1.0)",
    "1/2",
    "2^3",
    "1 / 0",
    "0 % 0",
    "1 << 200",
    "-i",
    "!true",
    // Statements and control.
    "let a = 1.0;",
    "let mut a = Expr::ZERO;",
    "let (a, b) = (1.0, 2.0);",
    "let [a, b] = [q.x, q.x];",
    "let x;",
    "a += q.x;",
    "a -= 1.0;",
    "a[0] += 1.0;",
    "a *= 2.0;",
    "for i in 0..3 { a += q.x; }",
    "for i in 0..=10 {}",
    "for i in (0..5).rev() {}",
    "for i in 0..99999999 {}",
    "for i in 0..i128::MAX {}",
    "for i in 170141183460469231731687303715884105727..0 {}",
    "while true {}",
    "loop {}",
    "return q.x;",
    "break;",
    "continue;",
    "if q.x > 0.0 { 1.0 } else { 2.0 }",
    "if true { 1 } else { 2 }",
    "if let Some(x) = q.x {}",
    "match 1 { 0 => 1.0, _ => 2.0 }",
    "match q.x { _ => 1.0 }",
    "|x| x",
    "&&",
    "||",
    "..",
    "..=",
    "self.helper(q)",
    "self.kinetic(q)",
    "Self::f(q)",
    "const N: usize = 3;",
    "const A: f64 = 1.0;",
    "const R: f64 = Self::R;",
    "fn helper(&self, q: &Coordinates<Self>) -> Expr { q.x }",
    "fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 \
     { if i == 0 { vec2(0.0, 0.0) } else { self.place(q, i - 1) } }",
    "unsafe {}",
    "async {}",
    "println!(\"{}\", 1)",
    "vec![1]",
    "assert!(true);",
    "x?",
    "&mut q",
    "*q",
    "'a: loop {}",
    "let x = x;",
    "static S: i32 = 1;",
    // Names that mean something elsewhere.
    "r#type",
    "r#fn",
    "r#self",
    "crate",
    "super",
    "_0",
    "__private",
    "t",
    "u",
    "h",
    "state",
    "simulate",
    "build",
    "at_time",
    "derivatives",
    "REPORT",
    "LISTING",
    "p0",
    "θ",
    "DoublePendulumState",
    "where Self: Sized",
    "<T>",
    "'static",
    "macro_rules!",
    "$crate",
    "pub(in a)",
];

/// Literals at the edges.
pub const LITERALS: &[&str] = &[
    "0",
    "1",
    "2",
    "3",
    "0.0",
    "-0.0",
    "1.0",
    "0.5",
    "1e308",
    "1e309",
    "1e-308",
    "1e-400",
    "4.9e-324",
    "1e999999999",
    "1e99999999999999999999",
    "0.1",
    "0.30000000000000004",
    "3.141592653589793238462643383279502884197",
    "9007199254740993.0",
    "18446744073709551616",
    "170141183460469231731687303715884105727",
    "170141183460469231731687303715884105728",
    "340282366920938463463374607431768211456",
    "99999999999999999999999999999999999999999999999999",
    "1_000_000",
    "0xff",
    "0b1",
    "0o7",
    "1f64",
    "1f32",
    "1.0f64",
    "1u8",
    "1usize",
    "1i128",
    "1.",
    "2305843009213693951.0",
    "2305843009213693952",
    "4611686018427387904",
    "4611686018427387903.5",
    "1e18",
    "1e19",
    "1e38",
    "1e-38",
    "\"text\"",
    "b\"bytes\"",
    "'c'",
    "b'x'",
    "true",
    "false",
    "1e+5",
    "0.000000000000000000000000000000000000001",
];

/// A piece of another model, a word or a literal.
fn fragment(random: &mut Random, seeds: &[Seed]) -> Vec<Tree> {
    let text = match random.below(8) {
        0..4 => random.pick(WORDS),
        4..6 => random.pick(LITERALS),
        _ => return donated(random, seeds),
    };
    parsed(text).unwrap_or_default()
}

/// A few neighbouring trees of another model.
fn donated(random: &mut Random, seeds: &[Seed]) -> Vec<Tree> {
    if seeds.is_empty() {
        return Vec::new();
    }
    let seed = &seeds[random.below(seeds.len())];
    let mut from = if random.one_in(3) { seed.declaration.clone() } else { seed.implementation.clone() };
    let (list, at) = place(&mut from, random);
    let end = (at + 1 + random.below(6)).min(list.len());
    list.get(at..end).unwrap_or_default().to_vec()
}

/// Changes `list` at one place.
pub fn mutate(list: &mut Vec<Tree>, random: &mut Random, seeds: &[Seed]) {
    let total = size(list);
    let new = fragment(random, seeds);
    let action = random.below(16);
    let depth = 1 << random.below(8);
    let (at, i) = place(list, random);
    if at.is_empty() {
        at.extend(new);
        return;
    }
    match action {
        0 | 1 => drop(at.remove(i)),
        2 => {
            let copy = at[i].clone();
            at.insert(i, copy);
        }
        3 => {
            let j = random.below(at.len());
            at.swap(i, j);
        }
        4..8 => drop(at.splice(i..=i, new)),
        8..11 => drop(at.splice(i..i, new)),
        11 => literal(&mut at[i], random),
        12 => name(at, i, random),
        13 => wrap(at, i, random),
        14 if total < LARGEST => repeat(at, i, depth, random),
        _ => delimiter(&mut at[i], random),
    }
}

/// Another literal, wherever the place is one.
fn literal(tree: &mut Tree, random: &mut Random) {
    let made = match random.below(4) {
        0 => Literal::f64_unsuffixed(f64::from_bits(random.draw() >> 1).min(f64::MAX).abs()),
        1 => Literal::u64_unsuffixed(random.draw() >> random.below(64)),
        2 => Literal::u128_unsuffixed(u128::from(random.draw()) << random.below(64)),
        _ => {
            if let Some([only]) = parsed(random.pick(LITERALS)).as_deref() {
                *tree = only.clone();
            }
            return;
        }
    };
    *tree = Tree::Leaf(made.into());
}

/// A name of the same list goes elsewhere: what was declared is unknown, what is unknown is declared.
fn name(list: &mut [Tree], i: usize, random: &mut Random) {
    let j = random.below(list.len());
    if let (Tree::Leaf(TokenTree::Ident(_)), Tree::Leaf(TokenTree::Ident(name))) = (&list[i], &list[j]) {
        let name = if random.one_in(4) {
            Ident::new(&format!("{}_", name.to_string().trim_start_matches("r#")), Span::call_site())
        } else {
            name.clone()
        };
        list[i] = Tree::Leaf(name.into());
    }
}

/// Parentheses, braces or the invisible group that `macro_rules!` puts around a fragment.
fn wrap(list: &mut Vec<Tree>, i: usize, random: &mut Random) {
    let end = (i + 1 + random.below(4)).min(list.len());
    let delimiters = [Delimiter::Parenthesis, Delimiter::Brace, Delimiter::Bracket, Delimiter::None];
    let inner: Vec<Tree> = list.drain(i..end).collect();
    list.insert(i, Tree::Group(delimiters[random.below(4)], inner));
}

/// The same thing very often: side by side, joined by an operator, or one inside the other.
fn repeat(list: &mut Vec<Tree>, i: usize, times: usize, random: &mut Random) {
    let piece = list[i].clone();
    let made: Vec<Tree> = match random.below(3) {
        0 => std::iter::repeat_n(piece, times).collect(),
        1 => {
            let operator =
                random.pick(&["+", "*", "-", "/", ",", ";", "."][..]).chars().next().unwrap_or('+');
            let operator = Tree::Leaf(Punct::new(operator, Spacing::Alone).into());
            std::iter::repeat_n([piece, operator], times).flatten().collect()
        }
        _ => {
            let delimiter = if random.one_in(2) { Delimiter::Parenthesis } else { Delimiter::Brace };
            vec![(0..times).fold(piece, |inner, _| Tree::Group(delimiter, vec![inner]))]
        }
    };
    list.splice(i..=i, made);
}

fn delimiter(tree: &mut Tree, random: &mut Random) {
    if let Tree::Group(delimiter, _) = tree {
        *delimiter =
            [Delimiter::Parenthesis, Delimiter::Brace, Delimiter::Bracket, Delimiter::None][random.below(4)];
    }
}
