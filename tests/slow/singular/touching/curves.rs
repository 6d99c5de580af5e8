//! Beads on plane curves with singular points, each by one row Φ(x, y) = 0 and by a parameter of its branch
//! alone. Curves are turned and moved, so that a singular point lies nowhere in particular: rounding of
//! coordinates is rounding of Φ.

use dynamics::model::{Constraints, Model};
use dynamics::prelude::*;

/// Where a curve lies, and what the bead weighs along both axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene {
    pub(crate) mass: f64,
    pub(crate) pull: [f64; 2],
    pub(crate) place: [f64; 2],
    pub(crate) along: [f64; 2],
}

impl Scene {
    /// From the curve's own axes.
    pub(crate) fn out(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.along;
        [self.place[0] + c * x - s * y, self.place[1] + s * x + c * y]
    }

    /// Likewise, of velocities.
    pub(crate) fn turn(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.along;
        [c * x - s * y, s * x + c * y]
    }
}

/// A curve as both of its models give it: where a motion by the parameter ends, and the start of one on the
/// row.
pub(crate) trait Curve {
    type Bead: Simulate + Constraints;
    fn bead(scene: &Scene) -> Self::Bead;
    /// Where the motion is from a parameter and its rate, at its end and in the curve's own axes.
    fn truth(scene: &Scene, start: (f64, f64), end: f64) -> [f64; 2];
    fn start(model: &Self::Bead, scene: &Scene, start: (f64, f64)) -> <Self::Bead as Model>::State;
}

macro_rules! curve {
    ($module:ident, |$x:ident, $y:ident| $row:expr, |$s:ident| $place:expr) => {
        pub(crate) mod $module {
            use super::*;

            #[derive(Clone, Debug, Dynamics)]
            #[coordinates(x, y)]
            pub(crate) struct Bead {
                pub(crate) mass: f64,
                pub(crate) pull: [f64; 2],
                pub(crate) place: [f64; 2],
                pub(crate) along: [f64; 2],
            }

            #[dynamics]
            impl Bead {
                #[kinetic]
                fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                    0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
                }
                #[potential]
                fn weight(&self, q: &Coordinates<Self>) -> Expr {
                    self.mass * (self.pull[0] * q.x + self.pull[1] * q.y)
                }
                #[holonomic]
                fn way(&self, q: &Coordinates<Self>) -> Expr {
                    let $x = self.along[0] * (q.x - self.place[0]) + self.along[1] * (q.y - self.place[1]);
                    let $y = self.along[0] * (q.y - self.place[1]) - self.along[1] * (q.x - self.place[0]);
                    $row
                }
            }

            #[derive(Clone, Debug, Dynamics)]
            #[coordinates(s)]
            pub(crate) struct Alone {
                pub(crate) mass: f64,
                pub(crate) pull: [f64; 2],
            }

            #[dynamics]
            impl Alone {
                fn place(&self, q: &Coordinates<Self>) -> Vec2 {
                    let $s = q.s;
                    $place
                }
                #[kinetic]
                fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                    0.5 * self.mass * self.place(q).dt().norm_squared()
                }
                #[potential]
                fn weight(&self, q: &Coordinates<Self>) -> Expr {
                    self.mass * (self.pull[0] * self.place(q).x + self.pull[1] * self.place(q).y)
                }
            }

            pub(crate) struct At;

            impl Curve for At {
                type Bead = Bead;
                fn bead(scene: &Scene) -> Bead {
                    let Scene { mass, pull, place, along } = *scene;
                    Bead { mass, pull, place, along }
                }
                fn truth(scene: &Scene, (s, rate): (f64, f64), end: f64) -> [f64; 2] {
                    // Gravity in the axes of the curve.
                    let [c, sine] = scene.along;
                    let pull =
                        [c * scene.pull[0] + sine * scene.pull[1], c * scene.pull[1] - sine * scene.pull[0]];
                    let model = Alone { mass: scene.mass, pull };
                    let start = model.state().s(s).s_rate(rate).build().unwrap();
                    let end = model
                        .simulate(start)
                        .until(end)
                        .method(methods::Dop853)
                        .tolerance(1e-13)
                        .run()
                        .unwrap()
                        .end();
                    let q = <Alone as Model>::coordinates_with(&end, &Default::default(), &[]);
                    let place = model.place(&q);
                    [place.x.value(), place.y.value()]
                }
                fn start(model: &Bead, scene: &Scene, (s, rate): (f64, f64)) -> State<Bead> {
                    let alone = Alone { mass: 1.0, pull: [0.0; 2] };
                    let state = alone.state().s(s).s_rate(rate).build().unwrap();
                    let q = <Alone as Model>::coordinates_with(&state, &Default::default(), &[]);
                    let place = alone.place(&q);
                    let speed = place.dt();
                    let [x, y] = scene.out([place.x.value(), place.y.value()]);
                    let [x_rate, y_rate] = scene.turn([speed.x.value(), speed.y.value()]);
                    model.state().x(x).y(y).x_rate(x_rate).y_rate(y_rate).build().unwrap()
                }
            }
        }
    };
}

// y² = x⁴.
curve!(tacnode, |x, y| y * y - 0.25 * x.powi(4), |s| vec2(s, 0.5 * s * s));
// circles of radius 1 and 2 that touch from inside.
curve!(inside, |x, y| (x * x + y * y - 2.0 * y) * (x * x + y * y - 4.0 * y), |s| vec2(
    s.sin(),
    1.0 - s.cos()
));
// unit circles that touch from outside.
curve!(outside, |x, y| (x * x + y * y - 2.0 * y) * (x * x + y * y + 2.0 * y), |s| vec2(
    s.sin(),
    1.0 - s.cos()
));
// y² = x⁶.
curve!(osculating, |x, y| y * y - x.powi(6), |s| vec2(s, s * s * s));
// r = sin 2φ.
curve!(rose, |x, y| (x * x + y * y).powi(3) - 4.0 * x * x * y * y, |s| vec2(
    (2.0 * s).sin() * s.cos(),
    (2.0 * s).sin() * s.sin()
));
// r = cos 3φ.
curve!(trifolium, |x, y| (x * x + y * y).powi(2) - x * (x * x - 3.0 * y * y), |s| vec2(
    (3.0 * s).cos() * s.cos(),
    (3.0 * s).cos() * s.sin()
));
// (x² + y²)² = x² − y².
curve!(lemniscate, |x, y| (x * x + y * y).powi(2) - (x * x - y * y), |s| vec2(s.cos(), s.sin() * s.cos())
    / (1.0 + s.sin() * s.sin()));
// y² = x² (x + 1).
curve!(node, |x, y| y * y - x * x * (x + 1.0), |s| vec2(s * s - 1.0, s * (s * s - 1.0)));
// y² = x² (x² + 0.01).
curve!(acute, |x, y| y * y - x * x * (x * x + 0.01), |s| vec2(s, s * (s * s + 0.01).sqrt()));
// y² = x³.
curve!(cusp, |x, y| y * y - x.powi(3), |s| vec2(s * s, s * s * s));
