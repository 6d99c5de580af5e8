//! What cannot be written in C is refused by name, and nothing is written.

use dynamics::SmoothFunction;
use dynamics::export::ExportError;
use dynamics::model::{PrintedInC, SimulationModel};
use dynamics::prelude::*;

use crate::compiler::folder;
use crate::models::{Block, CartPole, CartesianPendulum, DoublePendulum, Sleigh};

/// A function of the user's own.
#[derive(Clone, Debug)]
struct Bumps;

impl SmoothFunction for Bumps {
    fn derivatives(&self, x: f64) -> [f64; 4] {
        let (sin, cos) = x.sin_cos();
        [sin, cos, -sin, -cos]
    }
}

#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m)]
#[units(m: kg, g: m / s^2, track: m)]
struct Wave {
    m: f64,
    g: f64,
    track: Bumps,
}

#[dynamics]
impl Wave {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, self.track.at(q.x))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.place(q).y
    }
}

/// Sines of the platform in Rust.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c), sin_cos = accurate)]
#[coordinates(theta: rad)]
struct Accurate {
    m: f64,
}

#[dynamics]
impl Accurate {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.theta.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        -self.m * q.theta.cos()
    }
}

/// The error of files that are not written.
#[track_caller]
fn refused<M: SimulationModel + PrintedInC>(export: dynamics::export::CExport<'_, M>) -> ExportError {
    let folder = folder("refused").join("never");
    let error = export.write(&folder).unwrap_err();
    assert!(!folder.exists());
    error
}

#[test]
fn what_cannot_be_printed_is_refused_by_name() {
    let block = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let error = refused(block.in_c());
    assert!(matches!(error, ExportError::NotPrintable { .. }), "{error}");
    assert!(error.to_string().contains("`Block`") && error.to_string().contains("reactions"), "{error}");

    let error = refused(Wave { m: 1.0, g: 9.81, track: Bumps }.in_c());
    assert!(matches!(&error, ExportError::Function { name } if name == "track"), "{error}");
}

#[test]
fn sines_of_floats_are_refused() {
    let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let error = refused(model.in_c().single_precision().library_sines());
    assert!(matches!(error, ExportError::Sines { .. }), "{error}");
    let error = refused(Accurate { m: 1.0 }.in_c().library_sines());
    assert!(matches!(error, ExportError::Sines { .. }), "{error}");
    assert!(Accurate { m: 1.0 }.in_c().files().is_ok());
    let error = refused(DoublePendulum { m1: 1e200, ..model }.in_c().single_precision());
    assert!(matches!(&error, ExportError::Float { what, .. } if what.contains("`m1`")), "{error}");
}

#[test]
fn examples_that_cannot_begin_are_refused() {
    let pendulum = CartesianPendulum { m: 0.7, l: 1.3, g: 9.81 };
    let error = refused(pendulum.in_c());
    assert!(matches!(error, ExportError::Start { is_given: false, .. }), "{error}");
    assert!(error.to_string().ends_with("give `.start(..)`"), "{error}");
    let cart = CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
    let error = refused(cart.in_c().start(cart.state().build().unwrap()));
    assert!(matches!(error, ExportError::Input { name: "push", .. }), "{error}");
    for (step, duration) in [(0.0, 1.0), (f64::NAN, 1.0), (0.1, -1.0), (1e-12, 1.0)] {
        let error = refused(cart.in_c().step(step).duration(duration));
        assert!(matches!(error, ExportError::Number { .. }), "{error}");
    }
}

/// Where the edge lies along an axis, its constraint does not determine the velocity that is eliminated.
#[test]
fn starts_without_a_solution_in_c_are_refused() {
    let sleigh = Sleigh { m: 1.3, inertia: 0.4, ahead: 0.2 };
    let errors = [0.0, core::f64::consts::FRAC_PI_2].map(|heading| {
        let start = sleigh.state().heading(heading).build().unwrap();
        sleigh.in_c().start(start).files().err()
    });
    let error = errors.into_iter().flatten().next().expect("one of both axes");
    assert!(matches!(error, ExportError::Unsolved { remedy: "begin elsewhere", .. }), "{error}");
    assert!(error.to_string().contains("`.without_example()`"), "{error}");
}

#[test]
fn numbers_that_no_float_holds_are_refused() {
    let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1_rate(1e-60).build().unwrap();
    let error = refused(model.in_c().single_precision().start(start));
    assert!(matches!(&error, ExportError::Float { what, .. } if what.contains("`theta1`")), "{error}");
    assert!(
        DoublePendulum { m1: 1e200, ..model }.in_c().single_precision().without_example().files().is_ok()
    );
}

/// Without an example nothing of it is checked, and files of its names stay.
#[test]
fn files_of_the_users_own_stay() {
    let cart = CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
    let start = cart.state().push(0.0).build().unwrap();
    for name in ["main.c", "Makefile"] {
        let folder = folder(&format!("own_{name}"));
        std::fs::write(folder.join(name), "mine\n").unwrap();
        let error = cart.in_c().start(start).write(&folder).unwrap_err();
        assert!(matches!(&error, ExportError::Foreign { path } if path.ends_with(name)), "{error}");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
        cart.in_c().step(-1.0).without_example().write(&folder).unwrap();
        assert_eq!(std::fs::read_to_string(folder.join(name)).unwrap(), "mine\n");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
        std::fs::remove_file(folder.join(name)).unwrap();
        cart.in_c().start(start).write(&folder).unwrap();
        cart.in_c().start(start).write(&folder).unwrap();
    }
}

/// A folder that cannot be made is an error with its path.
#[test]
fn files_that_cannot_be_written_are_named() {
    let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let file = folder("a_file").join("file");
    std::fs::write(&file, "").unwrap();
    let error = model.write_c(file.join("below")).unwrap_err();
    assert!(matches!(error, ExportError::File(_)) && error.to_string().contains("below"), "{error}");
}
