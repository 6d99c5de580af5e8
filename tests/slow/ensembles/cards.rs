//! Ensembles on graphics cards, or on the cores where there is none.

use std::env;

use dynamics::ensembles::{Cores, Ensemble, EnsembleError, Grid, OpenEnsemble};
use dynamics::gpu::{Gpu, SingleGpu};
use dynamics::prelude::*;

use super::Folder;

/// A pendulum with friction in its pivot.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c, wgsl))]
#[coordinates(theta: rad)]
#[units(mass: kg, length: m, g: m / s^2, friction: N * m * s)]
struct Pendulum {
    mass: f64,
    length: f64,
    g: f64,
    friction: f64,
}

#[dynamics]
impl Pendulum {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.length * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
    #[dissipation]
    fn pivot(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.friction * q.theta.dt().powi(2)
    }
}

const MODEL: Pendulum = Pendulum { mass: 0.5, length: 0.8, g: 9.81, friction: 0.1 };

/// 20 × 25 runs, in blocks of 16.
fn ensemble() -> Ensemble<'static, Pendulum> {
    let angles = (0..20).map(|k| 0.1 * f64::from(k));
    let lengths = (0..25).map(|k| 0.5 + 0.02 * f64::from(k));
    let inputs = Grid::new().over("theta", angles).over("length", lengths);
    MODEL.ensemble(MODEL.state().build().unwrap(), inputs).until(1.5).tolerance(1e-5).block(16)
}

/// The same call runs with a card and without.
#[test]
fn without_a_card_the_cores_make_the_runs() {
    let of_cores = ensemble().on(Cores::default()).run().unwrap();
    let gpu = Gpu::first();
    let why = gpu.as_ref().err().map(ToString::to_string);
    let table = ensemble().on(gpu).run().unwrap();
    assert_eq!(table.len(), 500);
    let report = table.report();
    for ((_, a), (_, b)) in table.rows().zip(of_cores.rows()) {
        let equal = |(a, b): (&f64, &f64)| match why {
            Some(_) => a.to_bits() == b.to_bits(),
            None => (a - b).abs() < 1e-9,
        };
        assert!(a.iter().zip(b).all(equal), "{a:?} {b:?}");
    }
    match why {
        Some(why) => assert!(report.place.contains(&why), "{report}"),
        None => assert!(report.way.contains("threads of the card"), "{report}"),
    }
}

/// In single precision rows are near those of doubles, the report tells how near, and a file of the one is
/// not taken for one of the other.
#[test]
fn single_precision_is_said_and_measured() {
    let Ok(gpu) = SingleGpu::first() else {
        assert!(env::var_os("DYNAMICS_WGPU").is_none(), "DYNAMICS_WGPU is set, but there is no card");
        eprintln!("skipped: there is no card");
        return;
    };
    let of_cores = ensemble().run().unwrap();
    let table = ensemble().on(gpu).run().unwrap();
    let mut largest = 0.0f64;
    for ((_, a), (_, b)) in table.rows().zip(of_cores.rows()) {
        largest = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(largest, f64::max);
    }
    assert!(largest > 1e-9 && largest < 5e-4, "{largest:e}");
    let report = table.report();
    assert_eq!((report.made, report.failed), (500, 0));
    assert!(
        report.way.contains("in single precision, to ") && report.way.contains("runs that were repeated")
    );
    let folder = Folder::new("single");
    let path = folder.path("runs.csv");
    ensemble().to(&path).run().unwrap();
    let error = ensemble().to(&path).on(SingleGpu::first()).run().unwrap_err();
    assert!(matches!(error, EnsembleError::OtherPlan { .. }), "{error}");
    assert!(error.to_string().contains("ends, in single precision on "), "{error}");
    // Blocks of a card are those of others: in files, in order, complete.
    let path = folder.path("card.csv");
    let written = ensemble().to(&path).on(SingleGpu::first()).run().unwrap();
    let read = ensemble().to(&path).on(SingleGpu::first()).run().unwrap();
    assert_eq!(read.report().made, 0);
    assert!(written.report().way.contains("in single precision"), "{}", written.report());
    for (((_, a), (_, b)), (_, c)) in written.rows().zip(read.rows()).zip(table.rows()) {
        assert!(a == b && a == c);
    }
}

/// What a card cannot make at all is refused by name; what it does not make, the cores make.
#[test]
fn what_cards_do_not_make_is_made_or_refused() {
    let Ok(gpu) = SingleGpu::first() else { return };
    let error = ensemble().tolerance(1e-9).on(gpu).run().unwrap_err();
    assert!(matches!(error, EnsembleError::Place { .. }), "{error}");
    assert!(error.to_string().contains("single precision"), "{error}");
    let by_motions = ensemble().keep(["work"], |motion| [motion.end().theta()]);
    let table = by_motions.on(SingleGpu::first()).run().unwrap();
    assert!(table.report().way.starts_with("one by one"), "{}", table.report());
    assert!(table.report().place.contains("core"), "{}", table.report());
}
