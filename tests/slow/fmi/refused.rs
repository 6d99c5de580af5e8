//! What cannot be written is refused by name, before there is a file; and what is written is one file.

use std::path::PathBuf;
use std::process::Command;

use dynamics::export::ExportError;
use dynamics::fmi::{Fmu, FmuError};
use dynamics::model::{PrintedInC, SimulationModel};
use dynamics::prelude::*;

use crate::compiler::compilers;
use crate::models::{CartPole, SliderCrank};
use crate::units::folder;

/// A block on a floor, whose friction depends on the reaction of the same instant.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, y: m)]
#[units(m: kg, g: m / s^2)]
struct Block {
    m: f64,
    g: f64,
    friction: f64,
}

#[dynamics]
impl Block {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[force]
    fn rubbing(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.friction * q.reaction(Self::floor))
    }
}

/// The error of a unit that is not written.
#[track_caller]
fn refused<M: SimulationModel + PrintedInC>(fmu: Fmu<'_, M>) -> FmuError {
    let path = folder("refused").join("never.fmu");
    let error = fmu.write(&path).unwrap_err();
    assert!(!path.exists());
    error
}

fn cart() -> CartPole {
    CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 }
}

#[test]
fn models_that_c_cannot_hold_are_refused() {
    let block = Block { m: 2.0, g: 9.81, friction: 0.3 };
    let error = refused(block.fmu(block.state().x_rate(1.0).build().unwrap()));
    assert!(matches!(error, FmuError::Export(ExportError::NotPrintable { .. })), "{error}");
    assert!(error.to_string().contains("`Block`") && error.to_string().contains("reactions"), "{error}");
}

#[test]
fn starts_and_numbers_are_refused_by_name() {
    let cart = cart();
    let error = refused(cart.fmu(cart.state().build().unwrap()));
    assert!(matches!(error, FmuError::Input { name: "push", .. }), "{error}");
    let start = cart.state().push(0.0).build().unwrap();
    for tolerance in [0.0, -1e-8, f64::NAN, 1e-20, 1.0] {
        let error = refused(cart.fmu(start).tolerance(tolerance));
        assert!(matches!(error, FmuError::Number { option: "the tolerance", .. }), "{error}");
    }
    for duration in [0.0, f64::INFINITY] {
        let error = refused(cart.fmu(start).duration(duration));
        assert!(matches!(error, FmuError::Number { .. }), "{error}");
    }
    let massless = CartPole { cart: f64::NAN, ..cart };
    let error = refused(massless.fmu(start));
    assert!(matches!(error, FmuError::Start { .. }) && error.to_string().contains("`cart`"), "{error}");
    // A state of another crank is off the constraints of this one.
    let crank = SliderCrank { m: [1.0, 2.0, 3.0], r: 0.5, l: 1.5, g: 9.81, brake: 0.1 };
    let start = crank.state().slide(2.0).build().unwrap();
    let error = refused(SliderCrank { r: 0.6, ..crank }.fmu(start));
    assert!(matches!(error, FmuError::Start { .. }) && error.to_string().contains("closure"), "{error}");
}

#[test]
fn a_unit_is_a_file_of_its_own_extension() {
    let cart = cart();
    let fmu = || cart.fmu(cart.state().push(0.0).build().unwrap());
    let folder = folder("extensions");
    let error = fmu().write(folder.join("cart.zip")).unwrap_err();
    assert!(matches!(error, FmuError::File(_)) && error.to_string().contains("`.fmu`"), "{error}");
    let path: PathBuf = folder.join("a/b/cart.fmu");
    fmu().write(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert!(bytes.starts_with(b"PK\x03\x04"));
    // No clock is in it: the same again.
    fmu().write(&path).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), bytes);
    let below = path.join("below.fmu");
    let error = fmu().write(&below).unwrap_err();
    assert!(matches!(error, FmuError::File(_)) && error.to_string().contains("cart.fmu"), "{error}");
}

/// Where no scripts are wanted.
#[test]
fn the_documentation_has_equations_and_variables() {
    let cart = cart();
    let fmu = || cart.fmu(cart.state().push(0.0).build().unwrap());
    let page = |fmu: Fmu<'_, CartPole>| {
        let files = fmu.files().unwrap();
        let file = files.iter().find(|file| file.name == "documentation/index.html").unwrap();
        String::from_utf8(file.bytes.clone()).unwrap()
    };
    let plain = page(fmu().without_live_page());
    assert!(!plain.contains("<script") && page(fmu()).contains("<script"));
    for text in
        ["A cart with a bob &amp; an &lt;input&gt;.", "<math", "<code>der(theta_rate)</code>", "rad/s²"]
    {
        assert!(plain.contains(text), "{text}: {plain}");
    }
}

/// Tokens differ where units do.
#[test]
fn tokens_tell_units_apart() {
    let cart = cart();
    let start = cart.state().push(0.0).build().unwrap();
    let token = |fmu: Fmu<'_, CartPole>| {
        let files = fmu.files().unwrap();
        let text = String::from_utf8(files[0].bytes.clone()).unwrap();
        let (_, rest) = text.split_once("instantiationToken=\"").unwrap();
        rest.split('"').next().unwrap().to_owned()
    };
    let first = token(cart.fmu(start));
    assert_eq!(token(cart.fmu(start)), first);
    assert_ne!(token(cart.fmu(start).tolerance(1e-6)), first);
    assert_ne!(token(cart.fmu(start).method(methods::Dop853)), first);
    let other = CartPole { l: 1.0, ..cart };
    assert_ne!(token(other.fmu(start)), first);
}

#[test]
fn a_library_is_added_where_there_is_a_compiler() {
    if compilers().is_empty() {
        return;
    }
    let cart = cart();
    let files = cart.fmu(cart.state().push(0.0).build().unwrap()).with_binary().files().unwrap();
    let library = files.last().unwrap();
    assert!(library.name.starts_with("binaries/"), "{}", library.name);
    assert!(library.name.contains("/cart_pole."), "{}", library.name);
    assert!(library.bytes.len() > 10_000);
}

/// Runs one of these tests again in a process of its own with another `CC`, because the variable belongs to
/// all of one. Whether this is that process.
fn is_inner(test: &str, cc: &str) -> bool {
    const INNER: &str = "DYNAMICS_FMI_INNER";
    if std::env::var_os(INNER).is_some() {
        return true;
    }
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", &format!("refused::{test}")]);
    let status = command.env(INNER, "1").env("CC", cc).output().unwrap();
    assert!(status.status.success(), "{}", String::from_utf8_lossy(&status.stdout));
    false
}

#[test]
fn a_compiler_that_is_not_there_is_named() {
    if !is_inner("a_compiler_that_is_not_there_is_named", "no-such-compiler") {
        return;
    }
    let cart = cart();
    let error = refused(cart.fmu(cart.state().push(0.0).build().unwrap()).with_binary());
    assert!(matches!(error, FmuError::NoCompiler { .. }), "{error}");
    assert!(error.to_string().contains("no-such-compiler") && error.to_string().contains("CC"), "{error}");
}

/// The sources that a compiler refuses stay where the error says.
#[test]
fn sources_that_do_not_compile_are_kept() {
    if compilers().is_empty() || !is_inner("sources_that_do_not_compile_are_kept", "cc -no-such-option") {
        return;
    }
    let cart = cart();
    let error = refused(cart.fmu(cart.state().push(0.0).build().unwrap()).with_binary());
    let FmuError::Compiler { folder, said, .. } = error else { panic!("{error}") };
    assert!(said.contains("no-such-option"), "{said}");
    assert!(folder.join("cart_pole_fmu.h").is_file(), "{}", folder.display());
    std::fs::remove_dir_all(folder).unwrap();
}

/// `CC` may have arguments, as in `ccache gcc`.
#[test]
fn compilers_may_have_arguments() {
    if compilers().is_empty() || !is_inner("compilers_may_have_arguments", "cc -O1") {
        return;
    }
    let cart = cart();
    let files = cart.fmu(cart.state().push(0.0).build().unwrap()).with_binary().files().unwrap();
    assert!(files.last().unwrap().name.starts_with("binaries/"));
}
