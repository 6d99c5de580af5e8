//! What inverse dynamics costs.

use super::model;

/// Operations of inverse dynamics of an arm of so many hinges, each axis at a right angle to the one before.
fn operations(hinges: usize) -> usize {
    let declaration = format!(
        "#[coordinates(angles: [rad; {hinges}])]
        pub struct Arm
        {{ masses: [f64; {hinges}], centers: [Vec3<f64>; {hinges}], inertia: Mat3<f64>,
            hinges: [Vec3<f64>; {hinges}], g: f64 }}"
    );
    let implementation = format!(
        "impl Arm {{
            fn link(&self, q: &Coordinates<Self>, i: usize) -> RigidBody {{
                let mut frame = Frame::world();
                for k in 0..=i {{
                    let quarter = if k % 2 == 0 {{ core::f64::consts::FRAC_PI_2 }} else
                    {{ -core::f64::consts::FRAC_PI_2 }};
                    frame = frame.frame(self.hinges[k], Mat3::rotation_x(quarter) *
                    Mat3::rotation_z(q.angles[k]));
                }}
                RigidBody::new(self.masses[i], self.centers[i], self.inertia, frame)
            }}
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{
                let mut sum = Expr::ZERO;
                for i in 0..{hinges} {{ sum += self.link(q, i).kinetic_energy(); }}
                sum
            }}
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {{
                let mut sum = Expr::ZERO;
                for i in 0..{hinges} {{ sum += self.link(q, i).potential_energy(-self.g * Vec3::Z); }}
                sum
            }}
        }}"
    );
    let model = model(&declaration, &implementation);
    model.compiled.programs.inverse.expect("it is small").cost.total()
}

/// In proportion to the joints: every further one takes as many operations as the one before, wherever the
/// arm is long enough for its base not to matter.
#[test]
fn inverse_dynamics_is_linear_in_the_joints() {
    let counts: Vec<(usize, usize)> = (2..=12).map(|n| (n, operations(n))).collect();
    println!("{counts:?}");
    let steps: Vec<usize> = counts.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
    // 1092 operations for seven hinges; an expert's for the arm of the tables, whose first axis is upright,
    // are 978.
    assert!(steps.iter().all(|step| *step == steps[0]), "{counts:?}");
    assert!(counts[5].1 <= 1100, "{counts:?}");
}
