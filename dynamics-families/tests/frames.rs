//! What is recorded, and what a motion answers.

use dynamics_families::model::FamilyState;
use dynamics_families::{Every, FamilyMotionError, SimulateFamilies};

use crate::common::{Bar, state};

fn bar() -> Bar<false> {
    Bar { elements: 20, length: 1.0, ea: 1.0, rho: 1.0, between_walls: false }
}

/// Mode 1 of the lumped bar, exact in time: ω = 2 c/h sin(π/4N).
fn mode(bar: &Bar<false>) -> (impl Fn(usize) -> f64 + use<>, f64) {
    let n = bar.elements as f64;
    let theta = core::f64::consts::PI / (2.0 * n);
    (move |i: usize| ((i + 1) as f64 * theta).sin(), 2.0 * bar.c() / bar.h() * (0.5 * theta).sin())
}

#[test]
fn frames_are_at_the_times_that_were_asked_for() {
    let bar = bar();
    let (shape, omega) = mode(&bar);
    let start = state(&bar, &shape, |_| 0.0);
    let run = || bar.simulate(start.clone()).until(1.0);
    for motion in [run().run(), run().fixed_step(0.0007).record(Every::time(0.05)).run()] {
        let motion = motion.expect("runs");
        let permitted =
            if motion.summary().rejected == 0 && motion.frames().len() == 21 { 1e-4 } else { 1e-7 };
        for frame in motion.frames() {
            let state = frame.state.expect("in memory");
            let exact = (omega * frame.t).cos() * shape(7);
            assert!((state.q()[7] - exact).abs() < permitted, "{} {:e}", frame.t, state.q()[7] - exact);
            assert!((frame.energies.total() - motion.energies_of(state).total()).abs() < 1e-15);
        }
    }
    let motion = run().run().expect("runs");
    assert_eq!(motion.frames().len(), 300);
    let wall = motion.output("wall", 1.0).expect("the end");
    let exact = 20.0 * shape(0) * omega.cos();
    assert!((wall - exact).abs() < 1e-6, "{wall} {exact}");
    assert_eq!(motion.numbered_output("normal_force", 1.0).expect("the end")[0], wall);
}

/// Frames change no bit of fixed steps.
#[test]
fn recording_does_not_change_the_motion() {
    let bar = bar();
    let (shape, _) = mode(&bar);
    let start = state(&bar, &shape, |_| 0.0);
    let run = |every| bar.simulate(start.clone()).until(1.0).fixed_step(0.013).record(every).run();
    let ends = [Every::Last, Every::steps(1), Every::time(0.003), Every::frames(7)];
    let ends = ends.map(|every| run(every).expect("runs").end().clone());
    assert!(ends.iter().all(|end| *end == ends[0]));
    let motion = run(Every::steps(3)).expect("runs");
    // 77 steps: 0, 3, .., 75, and the end.
    assert_eq!(motion.frames().len(), 27);
}

#[test]
fn states_between_frames_are_not_invented() {
    let bar = bar();
    let (shape, omega) = mode(&bar);
    let run = || bar.simulate(state(&bar, &shape, |_| 0.0)).until(1.0);
    let motion = run().record(Every::time(0.25)).fixed_step(0.01).run().expect("runs");
    assert!(motion.at(0.75).is_ok());
    let error = motion.at(0.3).expect_err("between frames");
    assert!(matches!(error, FamilyMotionError::NotRecorded { before: 0.25, after: 0.5, .. }));
    assert_eq!(motion.nearest(0.3).expect("inside").t, 0.25);
    assert!(matches!(motion.at(1.1), Err(FamilyMotionError::OutOfRange { .. })));
    assert!(matches!(motion.at(f64::NAN), Err(FamilyMotionError::OutOfRange { .. })));
    assert_eq!(
        motion.output("wal", 0.0).expect_err("typo").to_string(),
        "there is no output `wal`; did you mean `wall`?"
    );
    assert!(matches!(motion.output("normal_force", 0.0), Err(FamilyMotionError::OtherOutput { .. })));
    // Both ends of a step are known: the quintic between them.
    let motion = run().record(Every::steps(1)).tolerance(1e-6).run().expect("runs");
    let state = motion.at(0.4321).expect("inside a step");
    assert!((state.q()[3] - shape(3) * (omega * 0.4321).cos()).abs() < 1e-5);
    assert!((state.u()[3] + omega * shape(3) * (omega * 0.4321).sin()).abs() < 1e-4);
}

/// The files as NumPy reads them, also of a run that failed.
#[test]
fn files_have_the_format_of_numpy() {
    let bar = bar();
    let (shape, _) = mode(&bar);
    let folder = std::env::temp_dir().join(format!("dynamics-families-{}", std::process::id()));
    let start = state(&bar, &shape, |_| 0.0);
    let run = || bar.simulate(start.clone()).until(1.0).record(Every::time(0.125)).to_file(&folder);
    let ends: [&dyn Fn() -> f64; 2] = [&|| run().run().expect("runs").end_time(), &|| {
        run().fixed_step(0.01).max_steps(30).run().expect_err("too many").time
    }];
    for (end, frames) in ends.into_iter().zip([9, 4]) {
        let end = end();
        let file = std::fs::read(folder.join("q.npy")).expect("written");
        assert_eq!(&file[..10], b"\x93NUMPY\x01\x00\x76\x00");
        let header = core::str::from_utf8(&file[10..128]).expect("text");
        let expected = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({frames}, 20), }}");
        assert_eq!(header.trim_end(), expected);
        assert!(header.ends_with('\n') && file.len() == 128 + frames * 20 * 8);
        let number = |at: usize| f64::from_le_bytes(file[at..at + 8].try_into().expect("eight bytes"));
        assert_eq!(number(128 + 8 * 4), start.q()[4]);
        let times = std::fs::read(folder.join("t.npy")).expect("written");
        let last = f64::from_le_bytes(times[times.len() - 8..].try_into().expect("eight bytes"));
        assert_eq!(last, end);
    }
    let motion = run().run().expect("runs");
    assert!(matches!(motion.at(0.5), Err(FamilyMotionError::NotRecorded { .. })));
    assert!(motion.output("wall", 0.5).is_ok() && motion.at(1.0).is_ok());
    std::fs::remove_dir_all(folder).expect("removed");
}
