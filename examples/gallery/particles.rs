//! Chapter 2: particles and constraints, what no example has.

use dynamics::prelude::*;

use crate::Page;

/// Two balls thrown together, one through air (red) and one through nothing (blue). Air takes almost half of
/// the range of a baseball. Lower k to zero, and the two fly as one; raise it, and see how steeply the ball
/// comes down.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 2], y: [m; 2])]
#[units(mass: kg, k: kg / m, g: m / s^2)]
struct TwoBalls {
    mass: f64,
    /// Half the density of air times area and drag coefficient.
    k: f64,
    g: f64,
}

#[dynamics]
impl TwoBalls {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x[i], q.y[i])
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (self.place(q, 0).dt().norm_squared() + self.place(q, 1).dt().norm_squared())
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.y[0] + q.y[1])
    }
    #[force]
    fn drag(&self, q: &Coordinates<Self>) -> Force {
        let velocity = self.place(q, 0).dt();
        Force::at(self.place(q, 0), -self.k * velocity.norm() * velocity)
    }
    /// The ball in air lands first, and waits for the other as it bounces.
    #[holonomic(switched)]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        q.y[0]
    }
    #[output]
    fn speed_in_air(&self, q: &Coordinates<Self>) -> Expr {
        self.place(q, 0).dt().norm()
    }
    #[event]
    fn landing(&self, q: &Coordinates<Self>) -> Expr {
        q.y[1]
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (air, vacuum) = (self.place(q, 0), self.place(q, 1));
        Drawing::new()
            .ground([0.0, 0.0], [210.0, 0.0])
            .color(Color::Blue)
            .trace("without air", vacuum)
            .disc(vacuum, 1.2)
            .color(Color::Red)
            .trace("in air", air)
            .disc(air, 1.2)
    }
}

/// The live page.
pub(crate) fn projectile_with_drag() -> Page {
    let balls = TwoBalls { mass: 0.145, k: 8.8e-4, g: 9.81 };
    let thrown = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let state = balls.state().y([1.0, 1.0]).x_rate([45.0 * cos; 2]).y_rate([45.0 * sin; 2]);
        state.release("ground").build()
    };
    Ok(balls
        .live(thrown(45.0)?)
        .title("Projectile with drag beside one without")
        .first_start("45°")
        .start("38°", thrown(38.0)?)
        .start("60°", thrown(60.0)?)
        .start("75°", thrown(75.0)?)
        .range("mass", 0.02, 1.0)
        .range("k", 0.0, 5e-3)
        .range("g", 1.0, 25.0)
        .contact("ground", 0.4)
        .plot(["y[0]", "y[1]", "speed_in_air"])
        .phase("y[0]")
        .stop_at("landing", Direction::Falling)
        .finish()?)
}

/// A bead on a rough wavy wire. The faster it goes through a bend, the harder it presses on the wire and the
/// more the wire takes from it. It stops where the slope is less than μ: lower μ, and it slips off again.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, g: m / s^2, a: m, k: 1 / m)]
struct RoughBead {
    mass: f64,
    g: f64,
    /// Half the height of the wave.
    a: f64,
    /// Wave number.
    k: f64,
    mu: f64,
}

#[dynamics]
impl RoughBead {
    fn bead(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    /// The unit vector along the wire, to the right.
    fn tangent(&self, q: &Coordinates<Self>) -> Vec2 {
        let along = vec2(1.0, -self.a * self.k * (self.k * q.x).sin());
        along / along.norm()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bead(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn wire(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.a * (self.k * q.x).cos()
    }
    /// It sticks wherever it is.
    #[nonholonomic(switched, integrable)]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.bead(q).dt().dot(self.tangent(q))
    }
    /// Push of the wire, upward where positive: λ ‖∇Φ‖, and ∇Φ is the unit normal over the
    /// tangent's x.
    #[output]
    fn push(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::wire) / self.tangent(q).x
    }
    #[force]
    fn friction(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.bead(q), -self.mu * self.push(q).abs() * q.slip(Self::grip) * self.tangent(q))
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.mu * self.push(q).abs() - q.reaction(Self::grip).abs()
    }
    #[output]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        self.bead(q).dt().dot(self.tangent(q))
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let bead = self.bead(q);
        let push = self.push(q) / (2.5 * self.mass * self.g) * self.tangent(q).perp();
        Drawing::new()
            .color(Color::Faint)
            .curve(-0.2, 3.35, 300, |x| [x, self.a * (self.k * x).cos()])
            .plain()
            .disc(bead, 0.05)
            .color(Color::Red)
            .arrow(bead, bead + push)
    }
}

/// The live page.
pub(crate) fn rough_wire() -> Page {
    let bead = RoughBead { mass: 0.1, g: 9.81, a: 0.5, k: 2.0, mu: 0.1 };
    let start = |x: f64, rate: f64| {
        let slope = -bead.a * bead.k * (bead.k * x).sin();
        let state = bead.state().x(x).y(bead.a * (bead.k * x).cos()).x_rate(rate).y_rate(rate * slope);
        state.release("grip").build()
    };
    Ok(bead
        .live(start(0.25, 0.0)?)
        .title("Bead on a rough wire")
        .first_start("let go near the crest")
        .start("pushed through the trough", start(std::f64::consts::FRAC_PI_2, 3.0)?)
        .start("on a gentle slope", start(1.4, 0.0)?)
        .range("mu", 0.01, 1.0)
        .range("a", 0.1, 0.6)
        .range("k", 1.0, 4.0)
        .range("g", 1.0, 25.0)
        .hold(["mass"])
        .stick_slip("grip", "breakaway")
        .tolerance(1e-9)
        .plot(["speed", "push"])
        .finish()?)
}

/// One pendulum twice, in Cartesian coordinates. The rod of the blue one is a constraint, and the bob is put
/// back onto it after each step. The red one has the same accelerations and nothing else: its length drifts
/// away from the circle, the faster the larger the tolerance.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 2], y: [m; 2])]
#[units(mass: kg, length: m, g: m / s^2)]
struct TwoPendulums {
    mass: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl TwoPendulums {
    fn bob(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x[i], q.y[i])
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (self.bob(q, 0).dt().norm_squared() + self.bob(q, 1).dt().norm_squared())
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.y[0] + q.y[1])
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        self.bob(q, 0).norm() - self.length
    }
    /// What keeps |r| constant by its second derivative alone: r·r̈ + |ṙ|² = 0.
    #[force]
    fn pull(&self, q: &Coordinates<Self>) -> Force {
        let bob = self.bob(q, 1);
        let pull = self.mass * (self.g * bob.y - bob.dt().norm_squared()) / bob.norm_squared();
        Force::at(bob, pull * bob)
    }
    #[output]
    fn off_projected(&self, q: &Coordinates<Self>) -> Expr {
        self.bob(q, 0).norm() - self.length
    }
    #[output]
    fn off_left_alone(&self, q: &Coordinates<Self>) -> Expr {
        self.bob(q, 1).norm() - self.length
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (kept, lost) = (self.bob(q, 0), self.bob(q, 1));
        Drawing::new()
            .color(Color::Faint)
            .circle([0.0, 0.0], self.length)
            .color(Color::Red)
            .line([0.0, 0.0], lost)
            .disc(lost, 0.04)
            .tail("left alone", lost, 1.0)
            .color(Color::Blue)
            .line([0.0, 0.0], kept)
            .disc(kept, 0.04)
            .tail("projected", kept, 1.0)
            .plain()
            .pivot([0.0, 0.0])
    }
}

/// The live page.
pub(crate) fn drift_and_projection() -> Page {
    let model = TwoPendulums { mass: 1.0, length: 1.0, g: 9.81 };
    let start = |theta: f64| model.state().x([theta.sin(); 2]).y([-theta.cos(); 2]).build();
    Ok(model
        .live(start(2.0)?)
        .title("Drift against projection")
        .first_start("large swing")
        .start("small swing", start(0.5)?)
        .start("once around", model.state().y([-1.0; 2]).x_rate([7.0; 2]).build()?)
        .range("length", 0.3, 2.0)
        .range("g", 1.0, 25.0)
        .hold(["mass"])
        .tolerance(1e-4)
        .plot(["off_projected", "off_left_alone"])
        .phase("x[1]")
        .finish()?)
}
