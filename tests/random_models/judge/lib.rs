//! Judges models of a batch: what was emitted for them beside their own functions run on jets.
//!
//! A batch package holds a hundred models, each with glue that lists its roles. Everything here but
//! [`Derived`] is compiled once, not once for every model.

mod compare;
mod derived;
mod interpreted;
mod states;
mod tangent;

use dynamics::{Expr, Vec2, Vec3};

pub use derived::{Derived, Find, WithJacobians, Without};
pub use states::Point;

/// What is emitted, at one state; matrices by rows.
#[derive(Clone, Debug)]
pub struct Emitted {
    /// Accelerations and multipliers, or why there are none.
    pub solved: Result<(Vec<f64>, Vec<f64>), String>,
    pub mass: Vec<f64>,
    pub force: Vec<f64>,
    pub momenta: Vec<f64>,
    pub energy: f64,
    pub powers: Vec<f64>,
    pub outputs: Vec<f64>,
    pub events: Vec<f64>,
    /// Φ.
    pub residual: Vec<f64>,
    /// Φ̇ joined by A q̇ + b.
    pub rates: Vec<f64>,
    pub jacobian: Vec<f64>,
    pub gamma: Vec<f64>,
}

/// Emitted derivatives of the accelerations, by rows.
#[derive(Clone, Debug)]
pub struct Slopes {
    pub by_q: Vec<f64>,
    pub by_u: Vec<f64>,
    pub by_input: Vec<f64>,
    pub by_parameter: Vec<f64>,
}

/// Sizes and names of a model.
#[derive(Clone, Debug)]
pub struct Shape {
    pub coordinates: usize,
    pub inputs: usize,
    pub parameters: usize,
    pub holonomic: usize,
    pub rows: usize,
    pub outputs: Vec<&'static str>,
    pub events: usize,
    pub powers: Vec<&'static str>,
}

/// A model, whatever its type.
pub trait Subject {
    fn shape(&self) -> Shape;
    fn emitted(&self, at: &Point) -> Emitted;
    fn slopes(&self, at: &Point) -> Option<Slopes>;
    /// Whether there are Jacobians, and whether `REPORT` says so.
    fn has_jacobians(&self) -> (bool, bool);
    /// q̈ with one parameter changed by this much.
    fn with_parameter(&self, at: &Point, index: usize, by: f64) -> Option<Vec<f64>>;
    /// What the interpreter says; empty where nothing.
    fn interpreted(&self) -> &'static str;
    /// The model's own functions, q̈ and λ as given.
    fn own(&self, at: &Point, accelerations: &[f64], multipliers: &[f64]) -> Own;
}

/// What a model's own functions say, run on jets.
#[derive(Clone, Debug, Default)]
pub struct Own {
    /// Sum of kinetic energies and Lagrangians less potentials.
    pub lagrangian: Option<Expr>,
    /// Rayleigh's functions, summed.
    pub dissipation: Option<Expr>,
    /// Places or quantities that forces go along, with the size of the force.
    pub along: Vec<(Expr, f64)>,
    /// How many forces were given so.
    pub given_along: usize,
    /// Powers of all forces.
    pub forces: Vec<f64>,
    pub holonomic: Vec<Expr>,
    pub nonholonomic: Vec<Expr>,
    pub outputs: Vec<f64>,
    /// Generalized speeds: outputs behind those of the model.
    pub speeds: Vec<f64>,
    pub events: Vec<f64>,
}

impl Own {
    fn add(to: &mut Option<Expr>, term: Expr) {
        *to = Some(to.map_or(term, |sum| sum + term));
    }
    pub fn kinetic(&mut self, term: Expr) {
        Self::add(&mut self.lagrangian, term);
    }
    pub fn lagrangian(&mut self, term: Expr) {
        Self::add(&mut self.lagrangian, term);
    }
    pub fn potential(&mut self, term: Expr) {
        Self::add(&mut self.lagrangian, -term);
    }
    pub fn dissipation(&mut self, term: Expr) {
        Self::add(&mut self.dissipation, term);
    }
    pub fn force(&mut self, force: dynamics::Force) {
        self.forces.push(force.power());
    }
    /// The same force once more, as what it goes along and its size.
    pub fn along(&mut self, place: impl Parts, size: impl Parts) {
        let (places, sizes) = (place.parts(), size.parts());
        self.given_along += 1;
        self.along.extend(places.into_iter().zip(sizes.into_iter().map(|s| s.value())));
    }
    pub fn holonomic(&mut self, rows: impl Parts) {
        self.holonomic.extend(rows.parts());
    }
    pub fn nonholonomic(&mut self, rows: impl Parts) {
        self.nonholonomic.extend(rows.parts());
    }
    pub fn output(&mut self, value: impl Parts) {
        self.outputs.extend(value.parts().iter().map(|v| v.value()));
    }
    pub fn kinematic(&mut self, value: impl Parts) {
        self.speeds.extend(value.parts().iter().map(|v| v.value()));
    }
    pub fn event(&mut self, value: Expr) {
        self.events.push(value.value());
    }
}

/// The scalars of what a function returns, in the order of rows and outputs.
pub trait Parts {
    fn parts(self) -> Vec<Expr>;
}

impl Parts for Expr {
    fn parts(self) -> Vec<Expr> {
        vec![self]
    }
}
impl Parts for Vec2<Expr> {
    fn parts(self) -> Vec<Expr> {
        vec![self.x, self.y]
    }
}
impl Parts for Vec3<Expr> {
    fn parts(self) -> Vec<Expr> {
        vec![self.x, self.y, self.z]
    }
}
impl<P: Parts, const N: usize> Parts for [P; N] {
    fn parts(self) -> Vec<Expr> {
        self.into_iter().flat_map(Parts::parts).collect()
    }
}

/// Judges each of the models and prints a line for everything that differs, `name: what`, and a last line for
/// each model that was judged.
pub fn run(models: &[(&str, &dyn Subject)]) {
    for (name, model) in models {
        let original =
            name.strip_suffix("_twin").and_then(|name| models.iter().find(|(other, _)| *other == name));
        if let Some((_, original)) = original {
            let alike = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                compare::twins(name, *original, *model)
            }));
            alike.unwrap_or_default().iter().for_each(|finding| println!("finding {name}: {finding}"));
        }
        let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| compare::judge(name, *model)));
        match found {
            Ok(report) => {
                report.findings.iter().for_each(|finding| println!("finding {name}: {finding}"));
                println!(
                    "judged {name}: {} comparisons, {} undecided, {} with the interpreter",
                    report.made, report.undecided, report.by_interpreter
                );
            }
            Err(panic) => {
                let message = panic.downcast_ref::<String>().cloned();
                let message = message.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
                println!("finding {name}: a function of the model panics: {}", message.unwrap_or_default());
                println!("judged {name}: panicked");
            }
        }
    }
}
