//! One function for every system: its candidates, and what is printed.

use dynamics::families::measured::{Accelerations, DriftAndKick, NewtonStep};
use dynamics::families::model::{FamilyModel, View};

use crate::models::{Bar, Beam, CubicChain, PlanarString};
use crate::rivals;
use crate::timing::{Candidate, times};

/// What is measured, by name.
pub const ALL: [(&str, fn(usize)); 6] = [
    ("string", string),
    ("chain", chain),
    ("bar", bar),
    ("beam", beam),
    ("leapfrog", leapfrog),
    ("newton", newton),
];

/// Widths of vectors, in bits.
const WIDTHS: [usize; 3] = [128, 256, 512];

/// Measures and prints. Errors are those of the candidates' results, relative to the largest of the first.
fn row(system: &str, n: usize, unknowns: usize, errors: &[f64], mut candidates: Vec<Candidate<'_>>) {
    let times = times(&mut candidates);
    for (k, (candidate, time)) in candidates.iter().zip(&times).enumerate() {
        let each = time * 1e9 / unknowns as f64;
        let error = errors.get(k).map_or(String::new(), |error| format!(",\"error\":{error:.1e}"));
        println!(
            "{{\"system\":\"{system}\",\"n\":{n},\"candidate\":\"{}\",\"ns_per_unknown\":{each:.4}{error}}}",
            candidate.name
        );
    }
}

fn wide<'a>(bits: usize, mut call: impl FnMut() + 'a) -> Candidate<'a> {
    let limited = move || {
        dynamics_simd::limit_vectors(bits);
        call();
    };
    Candidate { name: format!("derived, {bits} bit"), call: Box::new(limited) }
}

fn rival<'a>(name: &str, call: impl FnMut() + 'a) -> Candidate<'a> {
    Candidate { name: name.to_owned(), call: Box::new(call) }
}

/// Largest difference, in parts of the largest value.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().fold(0.0f64, |most, a| most.max(a.abs()));
    a.iter().zip(b).fold(0.0f64, |most, (a, b)| most.max((a - b).abs())) / largest
}

/// Accelerations of a model with a diagonal mass matrix at all widths, and of rivals in C.
fn accelerations<M: FamilyModel>(
    system: &str,
    model: &M,
    n: usize,
    q: &[f64],
    inverse: &[f64],
    others: &[(&str, &dyn Fn(&mut [f64]))],
) {
    let zeros = vec![0.0; q.len()];
    let at = View { t: 0.0, q, u: &zeros, inputs: &[] };
    let mut results: Vec<Vec<f64>> = vec![zeros.clone(); WIDTHS.len() + others.len()];
    let mut candidates = Vec::new();
    let (ours, theirs) = results.split_at_mut(WIDTHS.len());
    for (bits, a) in WIDTHS.into_iter().zip(ours) {
        candidates.push(wide(bits, move || model.scaled_forces(at, inverse, a)));
    }
    for ((name, call), a) in others.iter().zip(theirs) {
        candidates.push(rival(name, move || call(a)));
    }
    candidates.iter_mut().for_each(|candidate| (candidate.call)());
    drop(candidates);
    let errors: Vec<f64> = results.iter().map(|a| difference(&results[0], a)).collect();
    let mut candidates = Vec::new();
    let (ours, theirs) = results.split_at_mut(WIDTHS.len());
    for (bits, a) in WIDTHS.into_iter().zip(ours) {
        candidates.push(wide(bits, move || model.scaled_forces(at, inverse, a)));
    }
    for ((name, call), a) in others.iter().zip(theirs) {
        candidates.push(rival(name, move || call(a)));
    }
    row(system, n, q.len(), &errors, candidates);
}

fn planar_string(n: usize) -> (PlanarString, Vec<f64>, Vec<f64>) {
    let mass = 1.0 / n as f64;
    let model =
        PlanarString { nodes: n, pitch: 1.0 / n as f64, ea: 1e4, tension: 10.0, mass: vec![mass; n] };
    let along = (0..n).map(|i| 1e-3 * (i as f64 * 7.0 / n as f64).sin() / n as f64);
    let across = (0..n).map(|i| 0.1 * (i as f64 * 3.0 / n as f64).sin());
    (model, along.chain(across).collect(), vec![1.0 / mass; 2 * n])
}

fn string(n: usize) {
    let (model, q, inverse) = planar_string(n);
    let (pitch, ea, tension) = (model.pitch, model.ea, model.tension);
    let (w, x) = (inverse.as_ptr(), q.as_ptr());
    // SAFETY: the slices have the lengths that the functions are told.
    let scattering =
        |a: &mut [f64]| unsafe { rivals::string_scattering(n, pitch, ea, tension, w, x, a.as_mut_ptr()) };
    let by_nodes =
        |a: &mut [f64]| unsafe { rivals::string_by_nodes(n, pitch, ea, tension, w, x, a.as_mut_ptr()) };
    let fast = |a: &mut [f64]| unsafe {
        rivals::string_by_nodes_fast(n, pitch, ea, tension, w, x, a.as_mut_ptr());
    };
    let others: [(&str, &dyn Fn(&mut [f64])); 3] = [
        ("gcc, scattering", &scattering),
        ("gcc, by nodes", &by_nodes),
        ("gcc -ffast-math, by nodes", &fast),
    ];
    accelerations("string", &model, n, &q, &inverse, &others);
}

fn chain(n: usize) {
    let model = CubicChain { nodes: n, m: 1.0, k: 1.0, beta: 0.3 };
    let q: Vec<f64> = (0..n).map(|i| (i as f64 * 3.0 / n as f64).sin()).collect();
    let inverse = vec![1.0; n];
    let (k, beta, w, x) = (model.k, model.beta, inverse.as_ptr(), q.as_ptr());
    // SAFETY: as above.
    let by_nodes = |a: &mut [f64]| unsafe { rivals::chain_by_nodes(n, k, beta, w, x, a.as_mut_ptr()) };
    let scattering = |a: &mut [f64]| unsafe { rivals::chain_scattering(n, k, beta, w, x, a.as_mut_ptr()) };
    let others: [(&str, &dyn Fn(&mut [f64])); 2] =
        [("gcc, by nodes", &by_nodes), ("gcc, scattering", &scattering)];
    accelerations("cubic chain", &model, n, &q, &inverse, &others);
}

fn beam(n: usize) {
    let model =
        Beam { elements: n, length: 1.0, ea: 1e4, ga: 4e3, ei: 1.0, rho: 1.0, spin: 1e-3 };
    let h = model.length / n as f64;
    let x = (0..n).map(|i| h * (i + 1) as f64);
    let y = (0..n).map(|i| 0.1 * (3.0 * h * (i + 1) as f64).sin());
    let theta = (0..=n).map(|i| (0.3 * (3.0 * h * i as f64).cos()).atan());
    let q: Vec<f64> = x.chain(y).chain(theta).collect();
    let end = |i: usize| if i == n { 0.5 } else { 1.0 };
    let places = (1..=n).map(|i| 1.0 / (model.rho * h * end(i)));
    let angles = (0..=n).map(|i| 1.0 / (model.spin * h * if i == 0 { 0.5 } else { end(i) }));
    let inverse: Vec<f64> = places.clone().chain(places).chain(angles).collect();
    let (ea, ga, ei, w, x) = (model.ea, model.ga, model.ei, inverse.as_ptr(), q.as_ptr());
    // SAFETY: as above.
    let gcc = |a: &mut [f64]| unsafe { rivals::beam_scattering(n, h, ea, ga, ei, w, x, a.as_mut_ptr()) };
    let fast =
        |a: &mut [f64]| unsafe { rivals::beam_scattering_fast(n, h, ea, ga, ei, w, x, a.as_mut_ptr()) };
    let others: [(&str, &dyn Fn(&mut [f64])); 2] =
        [("gcc, scattering", &gcc), ("gcc -ffast-math, scattering", &fast)];
    accelerations("beam", &model, n, &q, &inverse, &others);
}

/// A step of leapfrog of the string, beside the memory triad of as many numbers as there are unknowns. Every
/// call is a step, so that the string moves.
fn leapfrog(n: usize) {
    let (model, q, inverse) = planar_string(n);
    let ends = model.ends().expect("counts of the model");
    // Far below the shortest period, 2π / (2n √(ea + tension)).
    let h = 1e-3 / (n as f64 * 100.0);
    let step = DriftAndKick { t: 0.0, drift: h, kick: h, inputs: &[], scale: &inverse };
    let ways = [(128, 1), (256, 1), (512, 1), (512, 2)];
    let run = |steps: usize, (bits, threads): (usize, usize)| {
        dynamics_simd::limit_vectors(bits);
        let (mut q, mut u) = (q.clone(), vec![0.0; q.len()]);
        (0..steps).for_each(|_| step.apply(&model, threads, &ends, &mut q, &mut u));
        [q, u].concat()
    };
    let results: Vec<Vec<f64>> = ways.into_iter().map(|way| run(3, way)).collect();
    assert!(results.iter().all(|result| result == &results[0]), "bits depend on vectors or threads");
    let mut states: Vec<[Vec<f64>; 2]> = ways.map(|_| [q.clone(), vec![0.0; q.len()]]).to_vec();
    let mut candidates = Vec::new();
    for ((bits, threads), state) in ways.into_iter().zip(&mut states) {
        let (model, ends) = (&model, &ends);
        let mut candidate = wide(bits, move || {
            let [q, u] = state;
            step.apply(model, threads, ends, q, u);
        });
        if threads > 1 {
            candidate.name += ", two threads";
        }
        candidates.push(candidate);
    }
    let (x, w, unknowns) = (q.as_ptr(), inverse.as_ptr(), q.len());
    let mut into = vec![0.0; unknowns];
    // SAFETY: all slices have this length.
    candidates.push(rival("memory triad", move || unsafe {
        rivals::triad(unknowns, 0.5, x, w, into.as_mut_ptr());
    }));
    row("leapfrog step", n, unknowns, &[], candidates);
}
/// Accelerations of the bar: forces, and the solution with the constant factors of its mass matrix.
fn bar(n: usize) {
    let model = Bar { elements: n, length: 1.0, ea: 1e4, rho: 2.0 };
    let h = model.length / n as f64;
    let q: Vec<f64> = (0..n).map(|i| 1e-3 * (3.0 * h * (i + 1) as f64).sin()).collect();
    let (zeros, ends) = (vec![0.0; n], model.ends().expect("a count of the model"));
    let at = View { t: 0.0, q: &q, u: &zeros, inputs: &[] };
    let mut diagonal = vec![model.rho * h * 2.0 / 3.0; n];
    diagonal[n - 1] /= 2.0;
    let (mut l, mut p) = (zeros.clone(), zeros.clone());
    let beside = model.rho * h / 6.0;
    // SAFETY: all slices have this length.
    unsafe {
        rivals::tridiagonal_factor(n, diagonal.as_ptr(), beside, l.as_mut_ptr(), p.as_mut_ptr());
    }
    let (l, p, x, stiffness) = (l.as_ptr(), p.as_ptr(), q.as_ptr(), model.ea / h);
    let gcc = |a: &mut [f64]| {
        // SAFETY: as above.
        unsafe { rivals::bar_consistent(n, stiffness, l, p, x, a.as_mut_ptr()) }
    };
    let mut accelerations = Accelerations::new(&model, &ends).expect("M is positive definite");
    let (mut ours, mut theirs) = (zeros.clone(), zeros.clone());
    accelerations.evaluate(&model, at, &mut ours);
    gcc(&mut theirs);
    let errors = [0.0, difference(&ours, &theirs)];
    let candidates = vec![
        wide(512, || accelerations.evaluate(&model, at, &mut ours)),
        rival("gcc, forces and two recursions", || gcc(&mut theirs)),
    ];
    row("bar, consistent mass", n, n, &errors, candidates);
}

/// A Newton step of an implicit method on the string: assembly, factors and solution.
fn newton(n: usize) {
    let (model, q, inverse) = planar_string(n);
    let (zeros, ends) = (vec![0.0; 2 * n], model.ends().expect("counts of the model"));
    let at = View { t: 0.0, q: &q, u: &zeros, inputs: &[] };
    // 4/h^2 of a step of fifty times the longest of leapfrog.
    let coefficient = (model.ea * n as f64 * n as f64) / 2500.0;
    let mass: Vec<f64> = inverse.iter().map(|inverse| coefficient / inverse).collect();
    let right: Vec<f64> = (0..2 * n).map(|i| (0.1 * i as f64).sin()).collect();
    let mut step = NewtonStep::new(&model, at, &ends).expect("a banded tangent");
    let (mut ours, mut theirs) = (right.clone(), right.clone());
    let (mut diagonal, mut beside) = (vec![0.0; 3 * n], vec![0.0; 3 * n + 3]);
    let gcc = |x: &mut [f64], diagonal: &mut [f64], beside: &mut [f64]| {
        let (d, e) = (diagonal.as_mut_ptr(), beside.as_mut_ptr());
        let (m, q) = (mass.as_ptr(), q.as_ptr());
        // SAFETY: the slices have the lengths that the function needs.
        unsafe { rivals::string_newton(n, model.pitch, model.ea, model.tension, m, q, d, e, x.as_mut_ptr()) }
    };
    step.solve(&model, at, coefficient, &mut ours).expect("a regular tangent");
    gcc(&mut theirs, &mut diagonal, &mut beside);
    let errors = [0.0, difference(&ours, &theirs)];
    let derived = || {
        ours.copy_from_slice(&right);
        step.solve(&model, at, coefficient, &mut ours).expect("a regular tangent");
    };
    let thomas = || {
        theirs.copy_from_slice(&right);
        gcc(&mut theirs, &mut diagonal, &mut beside);
    };
    let candidates = vec![wide(512, derived), rival("gcc, block Thomas", thomas)];
    row("string, Newton step", n, 2 * n, &errors, candidates);
}
