//! Rigid links with springs between them, clamped at the foot, under a dead load; H. Hencky, Der Eisenbau 11
//! (1920) 437.

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: [rad; 5])]
#[units(m: kg, l: m, k: N * m, p: N)]
pub(crate) struct Hencky {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) k: f64,
    pub(crate) p: f64,
}

#[dynamics]
impl Hencky {
    fn end(&self, q: &Coordinates<Self>, links: usize) -> Vec2 {
        let mut place = vec2(Expr::ZERO, Expr::ZERO);
        for i in 0..links {
            place += self.l * vec2(q.theta[i].sin(), q.theta[i].cos());
        }
        place
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..5 {
            sum += 0.5 * self.m * self.end(q, i + 1).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.k * q.theta[0].powi(2);
        for i in 1..5 {
            sum += 0.5 * self.k * (q.theta[i] - q.theta[i - 1]).powi(2);
        }
        sum
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.end(q, 5), vec2(0.0, -self.p))
    }
}
