//! The models that are timed.

#[path = "../../tests/models/double_pendulum.rs"]
mod double_pendulum;

use dynamics::prelude::*;

pub(crate) use double_pendulum::DoublePendulum;

/// A cart with a chain of links in absolute angles.
macro_rules! chain {
    ($name:ident, $links:literal, $($sines:ident)?) => {
        /// A cart with a chain of links in absolute angles.
        #[derive(Clone, Debug, Dynamics)]
        $(#[model(sin_cos = $sines)])?
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

chain!(Chain5, 5,);
chain!(Chain10, 10,);
