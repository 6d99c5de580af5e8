//! Chapter 5: planar bodies, what no example has.

use dynamics::prelude::*;

use crate::Page;

/// A platform on three parallel cranks. Two of them would make a four-bar; the third adds constraints that
/// repeat the others, and carries the linkage through the positions in which the first two lie in line. The
/// forces in the pins are not unique, the motion is: drag the platform around.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: [rad; 3], x: m, y: m, tilt: rad)]
#[units(mass: kg, inertia: kg * m^2, crank_inertia: kg * m^2, length: m, width: m, g: m / s^2)]
struct ThreeCranks {
    /// Of the platform.
    mass: f64,
    /// Of the platform about its centre of mass.
    inertia: f64,
    /// Of each crank about its bearing.
    crank_inertia: f64,
    /// Of each crank.
    length: f64,
    /// Between the outer bearings.
    width: f64,
    g: f64,
}

#[dynamics]
impl ThreeCranks {
    /// The bearings over the width; the platform has its pins in the same places.
    const BEARINGS: [[f64; 2]; 3] = [[-0.5, 0.0], [0.5, 0.0], [0.1, 0.25]];

    fn bearing(&self, i: usize) -> Vec2 {
        self.width * vec2(Self::BEARINGS[i][0], Self::BEARINGS[i][1])
    }
    fn crank_end(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        self.bearing(i) + self.length * vec2(q.crank[i].cos(), q.crank[i].sin())
    }
    fn platform(&self, q: &Coordinates<Self>) -> PlanarBody {
        PlanarBody::new(self.mass, Vec2::ZERO, self.inertia, PlanarFrame::new(vec2(q.x, q.y), q.tilt))
    }
    fn pin(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        self.platform(q).frame.point(self.bearing(i))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = self.platform(q).kinetic_energy();
        for i in 0..3 {
            sum += 0.5 * self.crank_inertia * q.crank[i].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.platform(q).potential_energy(-self.g * Vec2::Y)
    }
    #[holonomic]
    fn outer_pins(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        [self.crank_end(q, 0) - self.pin(q, 0), self.crank_end(q, 1) - self.pin(q, 1)]
    }
    /// One of its rows repeats what the outer pins say.
    #[holonomic]
    #[redundant]
    fn inner_pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.crank_end(q, 2) - self.pin(q, 2)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let pins = [self.pin(q, 0), self.pin(q, 1), self.pin(q, 2)];
        let mut drawing = Drawing::new().fill(Color::Faint).polygon(pins).plain();
        for i in 0..3 {
            drawing = drawing.line(self.bearing(i), self.crank_end(q, i)).pivot(self.bearing(i)).dot(pins[i]);
        }
        drawing.color(Color::Blue).trace("centre of mass", self.platform(q).frame.origin())
    }
}

/// The live page.
pub(crate) fn redundant_four_bar() -> Page {
    let model =
        ThreeCranks { mass: 2.0, inertia: 0.15, crank_inertia: 0.01, length: 0.3, width: 1.0, g: 9.81 };
    let start = |angle: f64, rate: f64| {
        let (sin, cos) = angle.sin_cos();
        let place = model.state().crank([angle; 3]).x(model.length * cos).y(model.length * sin);
        let (x_rate, y_rate) = (-model.length * sin * rate, model.length * cos * rate);
        place.crank_rate([rate; 3]).x_rate(x_rate).y_rate(y_rate).build()
    };
    Ok(model
        .live(start(0.6, 0.0)?)
        .title("Four-bar with a redundant crank")
        .first_start("let go")
        .start("nearly upright", start(1.55, 0.0)?)
        .start("around and around", start(-1.57, 13.0)?)
        .range("mass", 0.2, 10.0)
        .range("length", 0.1, 0.6)
        .range("width", 0.5, 1.5)
        .range("g", 0.0, 25.0)
        .hold(["inertia", "crank_inertia"])
        .tolerance(1e-9)
        .plot(["crank[0]", "tilt"])
        .finish()?)
}

/// A disc on a slope; the arrow is the force of friction. It rolls as long as tan α < μ (1 + m r²/J),
/// three times μ for a full disc; on a steeper slope it slips. Give it backspin, and it slips until its rim
/// is as fast as it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: m, phi: rad)]
#[units(mass: kg, radius: m, slope: rad, length: m, g: m / s^2)]
struct Disc {
    mass: f64,
    radius: f64,
    /// J/(m r²): ½ for a full disc, 1 for a hoop.
    hollow: f64,
    slope: f64,
    /// Of the slope.
    length: f64,
    mu: f64,
    g: f64,
}

#[dynamics]
impl Disc {
    /// Down the slope.
    fn down(&self) -> Vec2 {
        vec2(self.slope.cos(), -self.slope.sin())
    }
    fn contact(&self, q: &Coordinates<Self>) -> Vec2 {
        q.s * self.down()
    }
    fn centre(&self, q: &Coordinates<Self>) -> Vec2 {
        self.contact(q) + self.radius * self.down().perp()
    }
    /// Of the slope on the disc.
    fn pressure(&self) -> f64 {
        self.mass * self.g * self.slope.cos()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (q.s.dt().powi(2) + self.hollow * (self.radius * q.phi.dt()).powi(2))
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.centre(q).y
    }
    /// Rolling, from wherever it begins.
    #[nonholonomic(switched, integrable)]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        q.s.dt() - self.radius * q.phi.dt()
    }
    #[force]
    fn sliding(&self, q: &Coordinates<Self>) -> Force {
        let friction = -self.mu * self.pressure() * q.slip(Self::grip);
        Force::along(q.s, friction) + Force::along(q.phi, -self.radius * friction)
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.mu * self.pressure() - q.reaction(Self::grip).abs()
    }
    /// Force of friction down the slope.
    #[output]
    fn friction(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::grip) - self.mu * self.pressure() * q.slip(Self::grip)
    }
    /// Speed of the lowest point of the disc; zero while it rolls.
    #[output]
    fn slip(&self, q: &Coordinates<Self>) -> Expr {
        q.s.dt() - self.radius * q.phi.dt()
    }
    #[event]
    fn end_of_slope(&self, q: &Coordinates<Self>) -> Expr {
        q.s - self.length
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (centre, contact, r) = (self.centre(q), self.contact(q), self.radius);
        let spoke = r * vec2(q.phi.sin(), q.phi.cos());
        let across = spoke.perp();
        Drawing::new()
            .ground(-0.15 * self.length * self.down(), 1.05 * self.length * self.down())
            .circle(centre, r)
            .line(centre - spoke, centre + spoke)
            .line(centre - across, centre + across)
            .dot(centre + 0.8 * spoke)
            .color(Color::Red)
            .width(3.0)
            .arrow(contact, contact + 2.0 * r * self.friction(q) / (self.mass * self.g) * self.down())
    }
}

/// The live page.
pub(crate) fn rolling_disc() -> Page {
    let disc = Disc { mass: 1.0, radius: 0.25, hollow: 0.5, slope: 0.15, length: 6.0, mu: 0.2, g: 9.81 };
    let start = |speed: f64, spin: f64| disc.state().s_rate(speed).phi_rate(spin);
    Ok(disc
        .live(start(0.0, 0.0).build()?)
        .title("Rolling disc")
        .first_start("let go")
        .start("pushed with backspin", start(3.0, -16.0).release("grip").build()?)
        .start("pushed without spin", start(3.0, 0.0).release("grip").build()?)
        .start("spinning on the spot", start(0.0, 20.0).release("grip").build()?)
        .range("slope", 0.0, 1.0)
        .range("mu", 0.01, 1.0)
        .range("hollow", 0.3, 1.0)
        .range("radius", 0.1, 0.5)
        .range("g", 1.0, 25.0)
        .hold(["mass", "length"])
        .stick_slip("grip", "breakaway")
        .plot(["slip", "friction"])
        .stop_at("end_of_slope", Direction::Rising)
        .finish()?)
}
