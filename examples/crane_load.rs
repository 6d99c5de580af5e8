//! How detailed a model does a crane load need? Four models, from the small swing to the elastic rope.
//!
//!     small swing        L φ̈ + g φ = −a(t)                        rope force m g
//!     point mass         L φ̈ + g sin φ = −a(t) cos φ              m |r̈ − g|
//!     body               (L + J/(m L)) φ̈ + g sin φ = −a(t) cos φ  the same
//!     elastic rope       m r̈ = S + m g,  S = k (r − l) + c ṙ      J φ̈ joins in
//!
//! A trolley carries a load of five tonnes, 4 m high, over 12 m in 6 s and stops. `compare` runs all four
//! models from the same rest. It says which of them suffices for the place of the load and for the force in
//! the rope. The program checks what tells them apart. The inertia of the body makes the swing slower by
//! √(1 + J/(m L²)). Swinging through, the load pulls with m g (3 − 2 cos φ₀), which the small swing
//! does not show.

mod common;
use std::f64::consts::TAU;

use dynamics::SmoothFunction;
use dynamics::analysis::{Rung, compare};
use dynamics::prelude::*;

/// From rest to rest: x(t) = D (τ − sin 2πτ / 2π) with τ = t/T, and D from then on. Its acceleration is a
/// full sine.
#[derive(Clone, Debug)]
struct Travel {
    distance: f64,
    duration: f64,
}

impl SmoothFunction for Travel {
    fn derivatives(&self, t: f64) -> [f64; 4] {
        let Self { distance, duration } = *self;
        if t >= duration {
            return [distance, 0.0, 0.0, 0.0];
        }
        let (w, tau) = (TAU / duration, t / duration);
        let (s, c) = (w * t).sin_cos();
        let v = distance / duration;
        [distance * (tau - s / TAU), v * (1.0 - c), v * w * s, v * w * w * c]
    }
}

/// cos φ ≈ 1 − φ²/2 in the potential, the load on a level line: linear equations.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad)]
#[units(mass: kg, length: m, g: m / s^2)]
struct SmallSwing {
    mass: f64,
    length: f64,
    g: f64,
    trolley: Travel,
}

#[dynamics]
impl SmallSwing {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.place(q).dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.g * self.length * q.phi.powi(2)
    }
    #[output]
    fn place(&self, q: &Coordinates<Self>) -> Expr {
        self.trolley.at(q.t) + self.length * q.phi
    }
    #[output]
    fn cable_force(&self, _q: &Coordinates<Self>) -> Expr {
        Expr::from(self.mass * self.g)
    }
}

/// A point mass on a rope that keeps its length.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad)]
#[units(mass: kg, length: m, g: m / s^2)]
struct PointMass {
    mass: f64,
    length: f64,
    g: f64,
    trolley: Travel,
}

#[dynamics]
impl PointMass {
    fn load(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.trolley.at(q.t), 0.0) + self.length * vec2(q.phi.sin(), -q.phi.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.load(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.load(q).y
    }
    #[output]
    fn place(&self, q: &Coordinates<Self>) -> Expr {
        self.load(q).x
    }
    /// Along the rope; the rope carries nothing else.
    #[output]
    fn cable_force(&self, q: &Coordinates<Self>) -> Expr {
        let pull = self.mass * (self.load(q).dt().dt() + vec2(0.0, self.g));
        pull.dot(vec2(-q.phi.sin(), q.phi.cos()))
    }
}

/// A body that turns with its rope: four falls of rope keep it in line.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad)]
#[units(mass: kg, inertia: kg * m^2, length: m, g: m / s^2)]
struct Body {
    mass: f64,
    inertia: f64,
    length: f64,
    g: f64,
    trolley: Travel,
}

#[dynamics]
impl Body {
    fn load(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.trolley.at(q.t), 0.0) + self.length * vec2(q.phi.sin(), -q.phi.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.load(q).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.load(q).y
    }
    #[output]
    fn place(&self, q: &Coordinates<Self>) -> Expr {
        self.load(q).x
    }
    #[output]
    fn cable_force(&self, q: &Coordinates<Self>) -> Expr {
        let pull = self.mass * (self.load(q).dt().dt() + vec2(0.0, self.g));
        pull.dot(vec2(-q.phi.sin(), q.phi.cos()))
    }
}

/// The body on a rope that gives.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad, stretch: m)]
#[units(mass: kg, inertia: kg * m^2, unstretched: m, stiffness: N / m, damping: N * s / m, g: m / s^2)]
struct ElasticRope {
    mass: f64,
    inertia: f64,
    unstretched: f64,
    stiffness: f64,
    damping: f64,
    g: f64,
    trolley: Travel,
}

#[dynamics]
impl ElasticRope {
    fn load(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.trolley.at(q.t), 0.0) + (self.unstretched + q.stretch) * vec2(q.phi.sin(), -q.phi.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.load(q).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.load(q).y
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.stretch.powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * q.stretch.dt().powi(2)
    }
    #[output]
    fn place(&self, q: &Coordinates<Self>) -> Expr {
        self.load(q).x
    }
    #[output]
    fn cable_force(&self, q: &Coordinates<Self>) -> Expr {
        self.stiffness * q.stretch + self.damping * q.stretch.dt()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (trolley, load) = (vec2(self.trolley.at(q.t), 0.0), self.load(q));
        Drawing::new()
            .color(Color::Faint)
            .line([-2.0, 0.0], [15.0, 0.0])
            .plain()
            .fill(Color::Ink)
            .rectangle(trolley, 1.0, 0.4, 0.0)
            .line(trolley, load)
            .trace("load", load)
            .fill(Color::Blue)
            .rectangle(load, 1.6, 4.0, q.phi)
    }
}

const END: f64 = 24.0;

/// The models, from the plainest to the fullest.
struct Models {
    small: SmallSwing,
    point: PointMass,
    body: Body,
    elastic: ElasticRope,
    /// By which the rope is stretched at rest.
    sag: f64,
}

/// Five tonnes whose centre hangs 9 m below the trolley: a box 4 m high and 1.6 m wide on four falls of steel
/// rope.
fn models(trolley: &Travel) -> Models {
    let (mass, length, stiffness, damping, g) = (5000.0, 9.0, 4.0e6, 8.0e3, 9.81);
    let (inertia, sag) = (mass * (4.0f64.powi(2) + 1.6f64.powi(2)) / 12.0, mass * g / stiffness);
    let (trolley, unstretched) = (|| trolley.clone(), length - sag);
    Models {
        small: SmallSwing { mass, length, g, trolley: trolley() },
        point: PointMass { mass, length, g, trolley: trolley() },
        body: Body { mass, inertia, length, g, trolley: trolley() },
        elastic: ElasticRope { mass, inertia, unstretched, stiffness, damping, g, trolley: trolley() },
        sag,
    }
}

fn main() -> common::Outcome {
    let Models { small, point, body, elastic, sag } = models(&Travel { distance: 12.0, duration: 6.0 });
    let hanging = elastic.state().stretch(sag).build()?;
    let comparison = compare("crane load")
        .rung(Rung::new("small swing", &small, small.state().build()?))
        .rung(Rung::new("point mass", &point, point.state().build()?))
        .rung(Rung::new("body", &body, body.state().build()?))
        .rung(Rung::new("elastic rope", &elastic, hanging))
        .until(END)
        .run()?;
    println!("{comparison}\n");
    for sentence in comparison.sentences() {
        println!("{sentence}");
    }
    // A crane driver asks for a few percent, a rope's fatigue for the elastic rope.
    for (accuracy, rung) in [(0.1, "point mass"), (0.01, "body"), (0.001, "elastic rope")] {
        assert_eq!(comparison.sufficient(accuracy)?.rung, rung);
    }
    assert!(
        comparison
            .difference("small swing", "cable_force")
            .is_some_and(|d| d.largest > 0.25 * body.mass * body.g)
    );
    physics()?;

    let mut files = common::Files::of("crane_load");
    comparison.write_svg(files.path("crane_load.svg"))?;
    comparison.write_html(files.path("crane_load.html"))?;
    let motion = elastic.simulate(hanging).until(END).run()?;
    let film = motion.animation().title("A crane load on its elastic rope").plot(["phi"]);
    film.write_html(files.path("animation.html"))?;
    files.list();
    Ok(())
}

/// What tells the models apart, on a trolley that stands.
fn physics() -> common::Outcome {
    let Models { point, body, .. } = models(&Travel { distance: 0.0, duration: 1.0 });
    let swing = 0.4;
    let of_point = point.simulate(point.state().phi(swing).build()?).until(END).tolerance(1e-12);
    let of_point = of_point.event("straight", |state| state.phi()).run()?;
    let of_body = body.simulate(body.state().phi(swing).build()?).until(END).tolerance(1e-12);
    let of_body = of_body.event("straight", |state| state.phi()).run()?;
    // A quarter of a swing.
    let (quick, slow) = (of_point.events()[0].time(), of_body.events()[0].time());
    let ratio = (1.0 + body.inertia / (body.mass * body.length.powi(2))).sqrt();
    println!(
        "\nthe body swings {:.4} times as slowly as the point mass; √(1 + J/(m L²)) = {ratio:.4}",
        slow / quick
    );
    assert!((slow / quick / ratio - 1.0).abs() < 1e-9);
    let force = of_point.output("cable_force", quick)?;
    let known = point.mass * point.g * (3.0 - 2.0 * swing.cos());
    println!("hanging straight, the point mass pulls with {force:.1} N; m g (3 − 2 cos φ₀) = {known:.1} N");
    assert!((force / known - 1.0).abs() < 1e-9);
    Ok(())
}
