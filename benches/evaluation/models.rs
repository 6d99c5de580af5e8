//! The models that are timed.

use dynamics::prelude::*;

/// Two bobs on massless rods.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1, theta2)]
pub(crate) struct DoublePendulum {
    pub(crate) m1: f64,
    pub(crate) m2: f64,
    pub(crate) l1: f64,
    pub(crate) l2: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl DoublePendulum {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l1 * vec2(q.theta1.sin(), -q.theta1.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l2 * vec2(q.theta2.sin(), -q.theta2.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
    }
}

/// A cart with a chain of links in absolute angles.
macro_rules! chain {
    ($name:ident, $links:literal) => {
        /// A cart with a chain of links in absolute angles.
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(x, theta: [_; $links])]
        pub(crate) struct $name {
            pub(crate) cart: f64,
            pub(crate) m: [f64; $links],
            pub(crate) l: [f64; $links],
            pub(crate) g: f64,
        }

        #[dynamics]
        impl $name {
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut place = vec2(q.x, 0.0);
                let mut sum = 0.5 * self.cart * q.x.dt().powi(2);
                for i in 0..$links {
                    place += self.l[i] * vec2(q.theta[i].sin(), -q.theta[i].cos());
                    sum += 0.5 * self.m[i] * place.dt().norm_squared();
                }
                sum
            }
            #[potential]
            fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut height = Expr::ZERO;
                let mut sum = Expr::ZERO;
                for i in 0..$links {
                    height -= self.l[i] * q.theta[i].cos();
                    sum += self.m[i] * self.g * height;
                }
                sum
            }
        }
    };
}

chain!(Chain5, 5);
chain!(Chain10, 10);
