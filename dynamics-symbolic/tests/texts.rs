//! The texts of a model: report, equations, LaTeX, listing.

mod common;

use common::{chain, double_pendulum};
use dynamics_symbolic::compile::compile;

#[test]
fn the_double_pendulum_reads_like_a_textbook() {
    let compiled = compile(double_pendulum()).expect("a sound model");
    let expected = "\
DoublePendulum: equations of motion

(m1 + m2) l1^2 theta1'' + m2 l1 l2 cos(theta1 - theta2) theta2''
    = -(m1 + m2) l1 g sin(theta1) - m2 l1 l2 sin(theta1 - theta2) theta2'^2
m2 l1 l2 cos(theta1 - theta2) theta1'' + m2 l2^2 theta2''
    = m2 l1 l2 sin(theta1 - theta2) theta1'^2 - m2 l2 g sin(theta2)

energies

T = m2 l1 l2 cos(theta1 - theta2) theta1' theta2' + 0.5 (m1 + m2) l1^2 theta1'^2
    + 0.5 m2 l2^2 theta2'^2
V = -(m1 + m2) l1 g cos(theta1) - m2 l2 g cos(theta2)
";
    assert_eq!(compiled.equations_text, expected);
}

#[test]
fn the_same_model_gives_the_same_texts() {
    let [a, b] = [(), ()].map(|()| compile(chain(4)).expect("a sound model"));
    assert_eq!(a.report, b.report);
    assert_eq!(a.equations_text, b.equations_text);
    assert_eq!(a.latex, b.latex);
    assert_eq!(a.listing, b.listing);
}
