//! Accelerations of models in C beside those in Rust, at the same states, in turn; and how long `cc -O2`
//! takes for the text.
//!
//! `cargo bench -p dynamics-benches --bench in_c`. Both evaluate states one after the other, none of which
//! depends on the results of another. The program in C is a process of its own, which times itself. With
//! constraints both solve for the multipliers, too.

#[path = "../tests/models/andrews.rs"]
mod andrews;
#[path = "../tests/models/double_pendulum.rs"]
mod double_pendulum;
#[path = "evaluation/states.rs"]
mod states;

use std::fs;
use std::hint::black_box;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use dynamics::model::{ModelState, PrintedInC, SimulationModel, State, Vector};
use dynamics::prelude::*;

use andrews::Andrews;
use double_pendulum::DoublePendulum;
use states::{states, states_near};

/// Rounds of both in turn, of which the fastest counts.
const ROUNDS: usize = 15;
/// How long a round takes about, in seconds.
const ROUND: f64 = 0.05;

macro_rules! chain {
    ($name:ident, $links:literal) => {
        /// A cart with a chain of links in absolute angles.
        #[derive(Clone, Debug, Dynamics)]
        #[model(targets(c))]
        #[coordinates(x, theta: [_; $links])]
        struct $name {
            cart: f64,
            m: [f64; $links],
            l: [f64; $links],
            g: f64,
        }

        #[dynamics]
        impl $name {
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut place = vec2(q.x, 0.0);
                let mut sum = 0.5 * self.cart * q.x.dt().powi(2);
                for i in 0..$links {
                    place += self.l[i] * vec2(q.theta[i].sin(), -q.theta[i].cos());
                    sum += 0.5 * self.m[i] * place.dt().norm_squared();
                }
                sum
            }
            #[potential]
            fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut height = Expr::ZERO;
                let mut sum = Expr::ZERO;
                for i in 0..$links {
                    height -= self.l[i] * q.theta[i].cos();
                    sum += self.m[i] * self.g * height;
                }
                sum
            }
        }

        impl $name {
            fn usual() -> Self {
                Self { cart: 2.0, m: [0.5; $links], l: [0.3; $links], g: 9.81 }
            }
        }
    };
}
chain!(Chain10, 10);
chain!(Chain50, 50);

/// The program that times accelerations: it reads the number of passes, parameters and states, and prints
/// nanoseconds per call.
fn timer<M: SimulationModel + PrintedInC>() -> String {
    let (name, n, p, r) = (M::C.name, M::COORDINATES.len(), M::PARAMETERS.len(), M::ROWS.len());
    let multipliers = if r > 0 { ", l" } else { "" };
    format!(
        "#include \"{name}.h\"\n#include <stdio.h>\n#include <time.h>\n\
         static double p[{p}], k[{constants}], q[{count}][{n}], u[{count}][{n}];\n\
         static double a[{count}][{n}], l[{r} + 1];\n\
         int main(void)\n{{\n  double passes = 0.0;\n  long pass;\n  int i, ok, status = 0;\n\
         \x20 clock_t start;\n\
         \x20 ok = fread(&passes, sizeof passes, 1, stdin) == 1 && fread(p, sizeof p, 1, stdin) == 1\n\
         \x20   && fread(q, sizeof q, 1, stdin) == 1 && fread(u, sizeof u, 1, stdin) == 1;\n\
         \x20 {name}_constants(p, k);\n  l[0] = 0.0;\n  start = clock();\n\
         \x20 for (pass = 0; ok && pass < (long)passes; pass++) {{\n\
         \x20   for (i = 0; i < {count}; i++) {{\n\
         \x20     status |= {name}_accelerations(p, k, 0.0, q[i], u[i], a[i]{multipliers});\n    }}\n  }}\n\
         \x20 printf(\"%.17g %.17g\\n\", (double)(clock() - start)*1e9/CLOCKS_PER_SEC/passes/{count},\n\
         \x20   a[{count} - 1][{n} - 1] + l[0]*0.0);\n  return status | !ok;\n}}\n",
        constants = M::C.constants.max(1),
        count = states::STATES,
    )
}

/// Compiles the program of a folder; the seconds that the model's own text takes.
fn build<M: SimulationModel + PrintedInC>(folder: &Path) -> Option<f64> {
    let flags = ["-std=c99", "-O2", "-ffp-contract=off"];
    let cc = |arguments: &[&str]| {
        let status = Command::new("cc").current_dir(folder).args(flags).args(arguments).status();
        status.is_ok_and(|status| status.success())
    };
    let text = format!("{}.c", M::C.name);
    let start = Instant::now();
    let done = cc(&["-c", &text, "-o", "model.o"]);
    let seconds = start.elapsed().as_secs_f64();
    (done && cc(&["timer.c", "model.o", "-o", "timer", "-lm"])).then_some(seconds)
}

/// One round in C: nanoseconds per call, and an acceleration.
fn in_c(folder: &Path, input: &[u8]) -> [f64; 2] {
    let mut command = Command::new(folder.join("timer"));
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it was built");
    child.stdin.take().expect("a pipe").write_all(input).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    let text = String::from_utf8(output.stdout).expect("numbers");
    let mut numbers = text.split_whitespace().map(|x| x.parse().expect("a number"));
    [numbers.next().expect("a time"), numbers.next().expect("an acceleration")]
}

fn measure<M: SimulationModel + PrintedInC>(model: &M, states: &[M::State], start: State<M>) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("in_c").join(M::C.name);
    model.in_c().start(start).library_sines().write(&folder).expect("a folder for the texts");
    fs::write(folder.join("timer.c"), timer::<M>()).expect("a file");
    let Some(seconds) = build::<M>(&folder) else {
        println!("{}: there is no compiler of C", M::NAME);
        return;
    };
    let constants = model.constants().expect("parameters of a body");
    let solve = |state: &M::State| {
        if M::ROWS.is_empty() {
            model.accelerations_with(&constants, state).expect("regular")
        } else {
            model.solve_unrolled(&constants, state).expect("regular").accelerations
        }
    };
    let mut results = vec![M::Vector::zeros(); states.len()];
    let mut round = |passes: usize| {
        let start = Instant::now();
        for _ in 0..passes {
            for (state, result) in black_box(states).iter().zip(&mut results) {
                *result = solve(state);
            }
            black_box(&mut results);
        }
        start.elapsed().as_secs_f64() * 1e9 / (passes * states.len()) as f64
    };
    let passes = (ROUND * 1e9 / (round(20) * states.len() as f64)) as usize + 1;
    let mut numbers = vec![passes as f64];
    numbers.extend((0..M::PARAMETERS.len()).map(|i| model.parameter(i).expect("a parameter")));
    numbers.extend(states.iter().flat_map(|state| state.q().as_slice()));
    numbers.extend(states.iter().flat_map(|state| state.u().as_slice()));
    let input: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let (mut rust, mut c, mut last) = (f64::INFINITY, f64::INFINITY, 0.0);
    for _ in 0..ROUNDS {
        rust = rust.min(round(passes));
        let [time, value] = in_c(&folder, &input);
        (c, last) = (c.min(time), value);
    }
    let value = results.last().and_then(|a| a.as_slice().last()).expect("a state");
    let agree = if *value == last { "same bits" } else { "other bits" };
    println!(
        "{:<16} Rust {rust:>8.1} ns   C {c:>8.1} ns   {:.2} times   {agree}   cc -O2 {seconds:.2} s",
        M::NAME,
        c / rust
    );
}

fn main() {
    let pendulum = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    measure(&pendulum, &states::<State<DoublePendulum>, 2>(), pendulum.state().build().expect("a start"));
    let chain = Chain10::usual();
    measure(&chain, &states::<State<Chain10>, 11>(), chain.state().build().expect("a start"));
    let mechanism = andrews::PUBLISHED;
    let near = states_near::<State<Andrews>, 7>(&andrews::START, 0.05);
    let closed = State::<Andrews>::new(0.0, andrews::START.into(), [0.0; 7].into(), Default::default());
    measure(&mechanism, &near, closed);
    let chain = Chain50::usual();
    measure(&chain, &states::<State<Chain50>, 51>(), chain.state().build().expect("a start"));
}
