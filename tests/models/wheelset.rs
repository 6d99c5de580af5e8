//! A railway wheelset that hunts on its rails; test set for initial value problems, wheelset (B. Simeon, C.
//! Führer & P. Rentrop, Surv. Math. Ind. 1 (1991) 1–37).
//!
//! Conical wheels, circular rails, contact points as coordinates without inertia. Creep forces go with the
//! normal forces by tanh, and the radii of the contact ellipses by their cube root (A. Jaschinski, DLR-FB
//! 90-06, 1990), so that no force is given where nothing presses.

use dynamics::prelude::*;

/// Axle, yaw and roll, the turning of the wheels beside ω = v/r, and where the wheels touch: side −1 is the
/// wheel with ξ < 0.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, z, theta, phi, beta, psi_left, xi_left, psi_right, xi_right)]
#[nominal(
    mass = 16.08,
    g = 9.81,
    speed = 30.0,
    radius = 0.1,
    polar = 0.0605,
    across = 0.366,
    arm = 0.19,
    cx = 6400.0,
    cz = 6400.0,
    cone = 0.0262,
    half_width = 0.1506,
    rail = 0.06,
    mu = 0.12,
    shear = 7.92e10
)]
pub(crate) struct Wheelset {
    pub(crate) mass: f64,
    pub(crate) g: f64,
    pub(crate) speed: f64,
    pub(crate) radius: f64,
    pub(crate) polar: f64,
    pub(crate) across: f64,
    pub(crate) arm: f64,
    pub(crate) cx: f64,
    pub(crate) cz: f64,
    pub(crate) cone: f64,
    pub(crate) half_width: f64,
    pub(crate) rail: f64,
    pub(crate) mu: f64,
    pub(crate) shear: f64,
    /// E, G, σ and Cᵢⱼ of Hertz' and Kalker's tables; π as published.
    pub(crate) hertz: f64,
    pub(crate) ellipse: f64,
    pub(crate) poisson: f64,
    pub(crate) c11: f64,
    pub(crate) c22: f64,
    pub(crate) c23: f64,
    pub(crate) pi: f64,
    /// How far the start misses the contacts, as the published equations hold their rates.
    pub(crate) gap_left: f64,
    pub(crate) gap_right: f64,
}

#[dynamics]
impl Wheelset {
    fn wheel(&self, xi: Expr, side: f64) -> Expr {
        self.radius + self.cone.tan() * (self.half_width - side * xi)
    }
    fn slope(&self, side: f64) -> Expr {
        Expr::from(-side * self.cone.tan())
    }
    fn track_x(&self, q: &Coordinates<Self>, psi: Expr, xi: Expr, side: f64) -> Expr {
        let r = self.wheel(xi, side);
        q.x + xi * q.theta.cos() * q.phi.cos()
            + r * (q.theta.cos() * q.phi.sin() * psi.cos() - q.theta.sin() * psi.sin())
    }
    /// Distance of the middle of the rail's profile.
    fn beside(&self, at: Expr, side: f64) -> Expr {
        side * at - self.half_width - self.cone.sin() * self.rail
    }
    fn depth(&self, at: Expr, side: f64) -> Expr {
        (self.rail.powi(2) - self.beside(at, side).powi(2)).sqrt()
    }
    fn rail_height(&self, at: Expr, side: f64) -> Expr {
        self.depth(at, side) - self.radius - self.cone.cos() * self.rail
    }
    fn rail_slope(&self, at: Expr, side: f64) -> Expr {
        -side * self.beside(at, side) / self.depth(at, side)
    }
    fn gap(&self, q: &Coordinates<Self>, psi: Expr, xi: Expr, side: f64) -> Expr {
        let at = self.track_x(q, psi, xi, side);
        self.rail_height(at, side) - q.y - xi * q.phi.sin() + self.wheel(xi, side) * q.phi.cos() * psi.cos()
    }
    fn parallel(&self, q: &Coordinates<Self>, psi: Expr, xi: Expr, side: f64) -> Vec2 {
        let (st, ct, sp, cp) = (q.theta.sin(), q.theta.cos(), q.phi.sin(), q.phi.cos());
        let dg = self.rail_slope(self.track_x(q, psi, xi, side), side);
        let dr = self.slope(side);
        vec2(
            dg * (dr * sp + cp * psi.cos()) + dr * ct * cp - ct * sp * psi.cos() + st * psi.sin(),
            dr * st * cp - st * sp * psi.cos() - ct * psi.sin(),
        )
    }
    /// The gradient of a gap by x, θ and φ; by y it is −1.
    fn gradient(&self, q: &Coordinates<Self>, psi: Expr, xi: Expr, side: f64) -> Vec3 {
        let (st, ct, sp, cp) = (q.theta.sin(), q.theta.cos(), q.phi.sin(), q.phi.cos());
        let (r, dg) = (self.wheel(xi, side), self.rail_slope(self.track_x(q, psi, xi, side), side));
        vec3(
            dg,
            dg * (r * (-ct * psi.sin() - psi.cos() * sp * st) - cp * st * xi),
            -psi.cos() * r * sp - cp * xi + dg * (cp * psi.cos() * ct * r - ct * sp * xi),
        )
    }
    /// Angle of the contact plane.
    fn angle(&self, q: &Coordinates<Self>, psi: Expr, side: f64) -> Expr {
        let dr = self.slope(side);
        let w1 = (dr * q.phi.cos() - q.phi.sin() * psi.cos()) * q.theta.cos() + psi.sin() * q.theta.sin();
        let w2 = side * (dr * q.phi.sin() + psi.cos() * q.phi.cos());
        (w1 / w2).atan()
    }
    /// Normal forces.
    fn normals(&self, q: &Coordinates<Self>) -> Vec2 {
        let (left, right) = (q.reaction(Self::left), q.reaction(Self::right));
        let (dl, dr) = (self.angle(q, q.psi_left, -1.0), self.angle(q, q.psi_right, 1.0));
        let det = -dl.sin() * dr.cos() - dr.sin() * dl.cos();
        let (gl, gr) =
            (self.gradient(q, q.psi_left, q.xi_left, -1.0), self.gradient(q, q.psi_right, q.xi_right, 1.0));
        let w1 = gl.x * left + gr.x * right;
        let w2 = -left - right;
        vec2((dr.cos() * w1 - dr.sin() * w2) / det, (-dl.cos() * w1 - dl.sin() * w2) / det)
    }
    /// The creep force of a wheel.
    fn creep(&self, q: &Coordinates<Self>, psi: Expr, xi: Expr, side: f64, normal: Expr) -> Vec3 {
        let at = self.track_x(q, psi, xi, side);
        let (r, delta) = (self.wheel(xi, side), self.angle(q, psi, side));
        let t = self.cone.tan();
        let a = 0.5 / (r * (1.0 + t * t).sqrt());
        let dg = self.rail_slope(at, side);
        let rho = self.rail.powi(2) / self.depth(at, side).powi(3) / (1.0 + dg * dg).powf(1.5);
        let b = 0.5 * rho;
        let c = (3.0 * normal.abs() * (1.0 - self.poisson) * self.hertz
            / (2.0 * self.pi * (a + b) * self.shear * self.ellipse.sqrt()))
        .powf(1.0 / 3.0);
        let (st, ct) = ((q.theta / delta.cos()).sin(), (q.theta / delta.cos()).cos());
        let (sp, cp) = (q.phi.sin(), q.phi.cos());
        let spin = self.speed / self.radius + q.beta.dt();
        let (td, pd) = (q.theta.dt(), q.phi.dt());
        let w1 = -spin * r * (st * psi.cos() + ct * sp * psi.sin()) + q.x.dt()
            - td * (r * (st * sp * psi.cos() + ct * psi.sin()) + xi * st * cp)
            - pd * ct * (xi * sp - r * cp * psi.cos());
        let w2 = spin * r * cp * psi.sin() + q.y.dt() + pd * (xi * cp + r * sp * psi.cos());
        let w3 = -spin * r * (ct * psi.cos() - st * sp * psi.sin()) + self.speed + q.z.dt()
            - td * (xi * ct * cp + r * (ct * sp * psi.cos() - st * psi.sin()))
            + pd * st * (xi * sp - r * cp * psi.cos());
        let rolling = vec3(w1 - 2.0 * q.x.dt(), w2 - 2.0 * q.y.dt(), w3 - 2.0 * q.z.dt() - 2.0 * self.speed);
        let wr = 0.5 * rolling.norm();
        let (sd, cd) = (-side * delta.sin(), delta.cos());
        let nx = (st * w1 + ct * w3) / wr;
        let ny = (ct * cd * w1 + sd * w2 - st * cd * w3) / wr;
        let ns = (-sd * spin + cd * td) / wr;
        let wt = self.mu * normal;
        let along = (self.shear * c * c * self.c11 * nx / wt).tanh();
        let across =
            ((self.shear * c * c * self.c22 * ny + self.shear * c * c * c * self.c23 * ns) / wt).tanh();
        let over = (along * along + across * across).max(1.0).sqrt();
        let (tx, ty) = (-wt * along / over, -wt * across / over);
        vec3(st * tx + ct * cd * ty, sd * ty, ct * tx - st * cd * ty)
    }
    /// Torques of Euler's equations by a contact force.
    fn torques(&self, q: &Coordinates<Self>, psi: Expr, xi: Expr, side: f64, f: Vec3) -> Vec3 {
        let (st, ct, sp, cp) = (q.theta.sin(), q.theta.cos(), q.phi.sin(), q.phi.cos());
        let (r, ss, cs) = (self.wheel(xi, side), psi.sin(), psi.cos());
        vec3(
            -(xi * st + r * ss * ct * cp) * f.x - r * ss * sp * f.y + (-xi * ct + r * ss * st * cp) * f.z,
            -(xi * ct * sp - r * cs * ct * cp) * f.x
                + (xi * cp + r * cs * sp) * f.y
                + (xi * st * sp - r * cs * st * cp) * f.z,
            -r * (cs * st + ss * ct * sp) * f.x + r * ss * cp * f.y - r * (cs * ct - ss * st * sp) * f.z,
        )
    }
    fn one_contact(&self, q: &Coordinates<Self>, psi: Expr, xi: Expr, side: f64, normal: Expr) -> Force {
        let f = self.creep(q, psi, xi, side, normal);
        let w = self.torques(q, psi, xi, side, f);
        Force::at(vec3(q.x, q.y, q.z), f)
            + Force::along(q.theta, q.phi.cos() * w.x + q.phi.sin() * w.z)
            + Force::along(q.phi, w.y)
            + Force::along(q.beta, w.z)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec3(q.x, q.y, q.z).dt().norm_squared()
            + 0.5 * self.across * ((q.theta.dt() * q.phi.cos()).powi(2) + q.phi.dt().powi(2))
            + 0.5 * self.polar * (self.speed / self.radius + q.beta.dt() + q.theta.dt() * q.phi.sin()).powi(2)
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y + self.cx * q.x.powi(2) + self.cz * q.z.powi(2)
    }
    #[holonomic]
    fn left(&self, q: &Coordinates<Self>) -> Expr {
        self.gap(q, q.psi_left, q.xi_left, -1.0) - self.gap_left
    }
    #[holonomic]
    fn right(&self, q: &Coordinates<Self>) -> Expr {
        self.gap(q, q.psi_right, q.xi_right, 1.0) - self.gap_right
    }
    #[holonomic]
    fn touch_left(&self, q: &Coordinates<Self>) -> Vec2 {
        self.parallel(q, q.psi_left, q.xi_left, -1.0)
    }
    #[holonomic]
    fn touch_right(&self, q: &Coordinates<Self>) -> Vec2 {
        self.parallel(q, q.psi_right, q.xi_right, 1.0)
    }
    #[force]
    fn creepage(&self, q: &Coordinates<Self>) -> Force {
        let n = self.normals(q);
        self.one_contact(q, q.psi_left, q.xi_left, -1.0, n.x)
            + self.one_contact(q, q.psi_right, q.xi_right, 1.0, n.y)
    }
    #[force]
    fn yaw_springs(&self, q: &Coordinates<Self>) -> Force {
        let torque = -2.0 * self.arm.powi(2) * self.cz * q.theta;
        Force::along(q.theta, torque) + Force::along(q.beta, q.phi.sin() * torque)
    }
    /// The published equations take ∂Φ/∂θ for the torque about the axle's upright axis.
    #[force]
    fn as_published(&self, q: &Coordinates<Self>) -> Force {
        let left = self.gradient(q, q.psi_left, q.xi_left, -1.0).y * q.reaction(Self::left);
        let right = self.gradient(q, q.psi_right, q.xi_right, 1.0).y * q.reaction(Self::right);
        Force::along(q.theta, (q.phi.cos() - 1.0) * (left + right))
    }
}

impl Wheelset {
    /// As published.
    #[allow(clippy::approx_constant, reason = "the number of the published program, of eight digits")]
    pub(crate) fn published() -> Self {
        Self {
            mass: 16.08,
            g: 9.81,
            speed: 30.0,
            radius: 0.1,
            polar: 0.0605,
            across: 0.366,
            arm: 0.19,
            cx: 6400.0,
            cz: 6400.0,
            cone: 0.0262,
            half_width: 0.1506,
            rail: 0.06,
            mu: 0.12,
            shear: 7.92e10,
            hertz: 1.3537956,
            ellipse: 0.7115218,
            poisson: 0.28,
            c11: 4.72772197,
            c22: 4.27526987,
            c23: 1.97203505,
            pi: 3.1415926,
            gap_left: 0.0,
            gap_right: 0.0,
        }
    }
}
