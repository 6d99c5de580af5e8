//! Steps of Co-Simulation: where they end, and why one is refused.

use std::fs;
use std::path::Path;
use std::process::Command;

use dynamics::fmi::Fmu;
use dynamics::model::{PrintedInC, SimulationModel, State};
use dynamics::prelude::*;

use crate::compiler::{compile, compilers};
use crate::models::SliderCrank;
use crate::units::{cranked, folder, largest};

/// A sledge that dry friction stops: its force jumps where the speed is 0.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m)]
#[units(m: kg, friction: N)]
struct Sledge {
    m: f64,
    friction: f64,
}

#[dynamics]
impl Sledge {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn rubbing(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.friction * q.x.dt().signum())
    }
}

/// A body that falls from rest; an event of each sign that is 0 at the start, and one at half a second.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(y)]
struct Falling {
    g: f64,
}

#[dynamics]
impl Falling {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.y.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * q.y
    }
    #[event]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        q.y.dt()
    }
    #[event]
    fn depth(&self, q: &Coordinates<Self>) -> Expr {
        -q.y
    }
    #[event]
    fn half_a_second(&self, q: &Coordinates<Self>) -> Expr {
        q.t - 0.5
    }
}

/// A bead on a rail whose distance is the root of a parameter, and another bead that is free.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x, y)]
struct Rail {
    square: f64,
}

#[dynamics]
impl Rail {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[holonomic]
    fn rail(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.square.sqrt()
    }
}

/// What the program `steps.c` does with a unit.
struct Steps {
    /// Its exit status.
    status: Option<i32>,
    /// Times of events.
    events: Vec<f64>,
    /// What the unit says.
    said: String,
    /// How far it came.
    reached: f64,
}

/// Steps of a unit in C, with macros of `steps.c`.
fn steps<M: SimulationModel + PrintedInC>(compiler: &str, fmu: &Fmu<'_, M>, macros: &[&str]) -> Steps {
    let prefix = M::C.name;
    let folder = folder(&format!("{prefix}_steps_{compiler}"));
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("fmi/steps.c");
    fs::copy(here, folder.join("steps.c")).unwrap();
    let mut in_c = vec!["steps.c".to_owned()];
    for file in fmu.files().unwrap() {
        let Some(name) = file.name.strip_prefix("sources/") else { continue };
        fs::write(folder.join(name), &file.bytes).unwrap();
        in_c.extend(name.ends_with(".c").then(|| name.to_owned()));
    }
    let in_c: Vec<&str> = in_c.iter().map(String::as_str).collect();
    let header = format!("-DUNIT=\"{prefix}_fmu.h\"");
    compile(compiler, &folder, &[&[header.as_str()], macros].concat(), &in_c, "steps");
    let output = Command::new(folder.join("steps")).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let number = |text: &str| text.parse::<f64>().unwrap();
    Steps {
        status: output.status.code(),
        events: text.lines().filter_map(|line| line.strip_prefix("event ")).map(number).collect(),
        said: text.lines().filter_map(|line| line.strip_prefix("says ")).collect(),
        reached: number(text.lines().last().unwrap()),
    }
}

/// Times of declared events in Rust.
fn events<M: SimulationModel>(model: &M, start: State<M>, end: f64) -> Vec<f64> {
    let motion = model.simulate(start).until(end).tolerance(1e-11).run().unwrap();
    motion.events().iter().map(|event| event.time()).collect()
}

/// The projection to constraints never moves a step back to before its event, which would come twice.
#[test]
fn events_of_constrained_motions_come_once() {
    let model = SliderCrank { m: [1.0, 2.0, 3.0], r: 0.5, l: 1.5, g: 9.81, brake: 0.1 };
    let start = cranked(&model, 0.4);
    let expected = events(&model, start, 10.0);
    assert!(expected.len() > 40, "{expected:?}");
    for compiler in compilers() {
        for tolerance in [1e-6, 1e-8] {
            let fmu = model.fmu(start).tolerance(tolerance);
            for step in ["-DRUN_STEP=10.0", "-DRUN_STEP=0.01"] {
                let found = steps(&compiler, &fmu, &["-DRUN_END=10.0", step]);
                assert_eq!(found.status, Some(0), "{}", found.said);
                let times = &found.events;
                assert_eq!(times.len(), expected.len(), "{tolerance:e}, {step}: {times:?} {expected:?}");
                let apart = times.iter().zip(&expected).map(|(a, b)| (a - b).abs());
                let off = largest(apart);
                assert!(off <= 1e3 * tolerance, "{tolerance:e}, {step}: {off:e}");
            }
        }
    }
}

/// An event function that is 0 at the start has not crossed, on whichever side it leaves; one that is 0 where
/// the importer ends a step has, once.
#[test]
fn events_begin_at_zero_and_end_at_communication_points() {
    let model = Falling { g: 9.81 };
    let start = model.state().build().unwrap();
    assert_eq!(events(&model, start, 1.0), [0.5]);
    for compiler in compilers() {
        for step in ["-DRUN_STEP=1.0", "-DRUN_STEP=0.25", "-DRUN_STEP=0.125"] {
            let found = steps(&compiler, &model.fmu(start), &["-DRUN_END=1.0", step]);
            assert_eq!(found.status, Some(0), "{}", found.said);
            assert_eq!(found.events.len(), 1, "{step}: {:?}", found.events);
            assert!((found.events[0] - 0.5).abs() < 1e-8, "{step}: {:?}", found.events);
        }
    }
}

/// After a change of a parameter the unit says by how much it moves to the constraints. Constraints that are
/// not numbers are an error, also where other coordinates are.
#[test]
fn changed_parameters_move_the_state_to_the_constraints() {
    let model = Rail { square: 4.0 };
    let start = model.state().x(2.0).y_rate(1.0).build().unwrap();
    for compiler in compilers() {
        for mode in ["-DIN_EVENT_MODE=0", "-DIN_EVENT_MODE=1"] {
            let macros = |square| ["-DRUN_END=1.0", "-DRUN_STEP=0.25", "-DCHANGE_AT=0.5", mode, square];
            let found = steps(&compiler, &model.fmu(start), &macros("-DCHANGE_TO=9.0"));
            assert_eq!((found.status, found.reached), (Some(0), 1.0), "{}", found.said);
            // From 2 to 3, in parts of 3.
            assert!(found.said.contains("moved by up to 0.333"), "{mode}: {}", found.said);
            let found = steps(&compiler, &model.fmu(start), &macros("-DCHANGE_TO=4.0"));
            assert_eq!((found.status, found.said.as_str()), (Some(0), ""));
            let found = steps(&compiler, &model.fmu(start), &macros("-DCHANGE_TO=(-1.0)"));
            assert_eq!((found.status, found.reached), (Some(1), 0.5), "{}", found.said);
            assert!(found.said.contains("no projection leads"), "{}", found.said);
        }
    }
}

/// A force that jumps and holds the motion at the jump ends a step with a reason, after a moment.
#[test]
fn motions_that_chatter_end_with_a_reason() {
    for compiler in compilers() {
        let sledge = Sledge { m: 2.0, friction: 4.0 };
        let start = sledge.state().x_rate(1.0).build().unwrap();
        let found = steps(&compiler, &sledge.fmu(start), &["-DRUN_END=2.0", "-DRUN_STEP=0.125"]);
        let Steps { status, said, reached, .. } = found;
        assert_eq!(status, Some(1), "{said}");
        assert!(said.contains("fmi3DoStep: at t = 0.5") && said.contains("make the force smooth"), "{said}");
        // Friction of 2 m/s² stops it after half a second.
        assert!((reached - 0.5).abs() < 1e-6, "{reached}");
    }
}
