//! Families of models of any size: those of the snapshots, and what crosses thresholds of emission.
//! `tests/random_models` compiles and runs them, too.

/// A family of models; `N` stands for the size.
pub(crate) struct Family {
    pub(crate) name: &'static str,
    pub(crate) coordinates: &'static str,
    pub(crate) fields: &'static str,
    pub(crate) functions: &'static str,
    /// The velocity of coordinate `i` that a damper sees.
    pub(crate) damped: &'static str,
    /// The largest size that every run asks for: derivation and parsing take up to a second there.
    pub(crate) usual: usize,
}

pub(crate) const SIZES: [usize; 10] = [1, 2, 3, 5, 10, 20, 21, 30, 50, 80];

#[rustfmt::skip]
pub(crate) const FAMILIES: &[Family] = &[
    Family {
        name: "masses between walls",
        coordinates: "x: [m; N]",
        fields: "m: f64, k: f64",
        functions: "
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += 0.5 * self.m * q.x[i].dt().powi(2); } sum
            }
            #[potential] fn springs(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = 0.5 * self.k * (q.x[0].powi(2) + q.x[N - 1].powi(2));
                for i in 1..N { sum += 0.5 * self.k * (q.x[i] - q.x[i - 1]).powi(2); } sum
            }",
        damped: "q.x[i].dt()",
        usual: 50,
    },
    Family {
        name: "masses that hold one another",
        coordinates: "gap: [m; N]",
        fields: "m: f64, k: f64",
        functions: "
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let (mut x, mut sum) = (Expr::ZERO, Expr::ZERO);
                for i in 0..N { x += q.gap[i]; sum += 0.5 * self.m * x.dt().powi(2); } sum
            }
            #[potential] fn springs(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += 0.25 * self.k * q.gap[i].powi(4); } sum
            }",
        damped: "q.gap[i].dt()",
        usual: 21,
    },
    Family {
        name: "pendulums",
        coordinates: "theta: [rad; N]",
        fields: "m: [f64; N], l: f64, g: f64",
        functions: "
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += 0.5 * self.m[i] * (self.l * q.theta[i].dt()).powi(2);
                }
                sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += -self.m[i] * self.g * self.l * q.theta[i].cos();
                }
                sum
            }",
        damped: "q.theta[i].dt()",
        usual: 50,
    },
    Family {
        name: "chains",
        coordinates: "x: m, theta: [rad; N]",
        fields: "cart: f64, m: [f64; N], l: [f64; N], g: f64",
        functions: "
            fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
                let mut place = vec2(q.x, 0.0);
                for k in 0..=i { place += self.l[k] * vec2(q.theta[k].sin(), -q.theta[k].cos()); } place
            }
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = 0.5 * self.cart * q.x.dt().powi(2);
                for i in 0..N { sum += 0.5 * self.m[i] * self.place(q, i).dt().norm_squared(); } sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += self.m[i] * self.g * self.place(q, i).y; }
                sum
            }",
        damped: "q.theta[i].dt()",
        usual: 5,
    },
    Family {
        name: "carts with poles and their drives",
        coordinates: "x: [m; N], theta: [rad; N]",
        fields: "cart: f64, bob: f64, l: f64, g: f64",
        functions: "
            fn tip(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
                vec2(q.x[i], 0.0) + self.l * vec2(q.theta[i].sin(), -q.theta[i].cos())
            }
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += 0.5 * self.cart * q.x[i].dt().powi(2)
                        + 0.5 * self.bob * self.tip(q, i).dt().norm_squared();
                }
                sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += self.bob * self.g * self.tip(q, i).y; } sum
            }
            #[force] fn drive(&self, q: &Coordinates<Self>) -> Force {
                let mut sum = Force::along(q.x[0], q.push[0]);
                for i in 1..N { sum = sum + Force::along(q.x[i], q.push[i]); } sum
            }",
        damped: "q.x[i].dt()",
        usual: 10,
    },
    Family {
        name: "spherical pendulums",
        coordinates: "theta: [rad; N], phi: [rad; N]",
        fields: "m: f64, l: f64, g: f64",
        functions: "
            fn bob(&self, q: &Coordinates<Self>, i: usize) -> Vec3 {
                let ((s, c), (sp, cp)) = (q.theta[i].sin_cos(), q.phi[i].sin_cos());
                self.l * vec3(s * cp, s * sp, -c)
            }
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += 0.5 * self.m * self.bob(q, i).dt().norm_squared();
                }
                sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += self.m * self.g * self.bob(q, i).z; } sum
            }",
        damped: "q.phi[i].dt()",
        usual: 10,
    },
    Family {
        name: "beads on a wire",
        coordinates: "x: [m; N]",
        fields: "m: f64, g: f64, track: CubicSpline",
        functions: "
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += 0.5 * self.m * vec2(q.x[i], self.track.at(q.x[i])).dt().norm_squared();
                }
                sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += self.m * self.g * self.track.at(q.x[i]); }
                sum
            }",
        damped: "q.x[i].dt()",
        usual: 21,
    },
    Family {
        name: "pendulums on shaken pivots, sines of sines",
        coordinates: "theta: [rad; N]",
        fields: "m: f64, l: f64, g: f64, omega: f64",
        functions: "
            fn bob(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
                let pivot = (self.omega * (i + 1) as f64 * q.t).sin();
                vec2(pivot.sin(), pivot.cos().cos()) + self.l * vec2((q.theta[i] + pivot).sin(),
                -q.theta[i].sin().cos())
            }
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += 0.5 * self.m * (self.bob(q, i).dt().norm_squared() + q.theta[i].dt().powi(2));
                }
                sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += self.m * self.g * self.bob(q, i).y; } sum
            }",
        damped: "q.theta[i].dt()",
        usual: 5,
    },
    Family {
        name: "balls against walls, with drag, outputs and events",
        coordinates: "x: [m; N], y: [m; N]",
        fields: "m: f64, k: f64, g: f64, gap: f64, drag: f64",
        functions: "
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += 0.5 * self.m * vec2(q.x[i], q.y[i]).dt().norm_squared();
                }
                sum
            }
            #[potential] fn walls(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += self.m * self.g * q.y[i] + 0.5 * self.k * (q.x[i] - self.gap).max(0.0).powi(2);
                }
                sum
            }
            fn resistance(&self, q: &Coordinates<Self>, i: usize) -> Force {
                let place = vec2(q.x[i], q.y[i]);
                Force::at(place, -self.drag * place.dt().norm() * place.dt())
            }
            #[force] fn drags(&self, q: &Coordinates<Self>) -> Force {
                let mut sum = self.resistance(q, 0); for i in 1..N { sum = sum + self.resistance(q, i); } sum
            }
            #[output] fn speed(&self, q: &Coordinates<Self>) -> [Expr; N] {
                let mut all = [Expr::ZERO; N]; for i in 0..N { all[i] = vec2(q.x[i], q.y[i]).dt().norm(); }
                all
            }
            #[event] fn ground(&self, q: &Coordinates<Self>) -> Expr { q.y[N - 1] }",
        damped: "q.y[i].dt()",
        usual: 10,
    },
    Family {
        name: "charges in a field",
        coordinates: "x: [m; N], y: [m; N], z: [m; N]",
        fields: "mass: f64, charge: f64, magnetic: Vec3<f64>, electric: Vec3<f64>",
        functions: "
            #[lagrangian] fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    let place = vec3(q.x[i], q.y[i], q.z[i]);
                    let potential = -self.electric.dot(place);
                    sum += 0.5 * self.mass * place.dt().norm_squared()
                        + self.charge * (place.dt().dot(0.5 * self.magnetic.cross(place)) - potential);
                }
                sum
            }",
        damped: "q.x[i].dt()",
        usual: 10,
    },
    Family {
        name: "bodies by angles",
        coordinates: "yaw: [rad; N], tilt: [rad; N], spin: [rad; N]",
        fields: "inertia: Mat3<f64>",
        functions: "
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    let r = Mat3::rotation_z(q.yaw[i]) * Mat3::rotation_x(q.tilt[i]) *
                    Mat3::rotation_z(q.spin[i]);
                    let turning = r.transpose() * r.dt();
                    let omega = vec3(turning[(2, 1)], turning[(0, 2)], turning[(1, 0)]);
                    sum += 0.5 * omega.dot(self.inertia * omega);
                }
                sum
            }",
        damped: "q.spin[i].dt()",
        usual: 3,
    },
    Family {
        name: "beads in turned tubes",
        coordinates: "r: [m; N], phi: [rad; N]",
        fields: "m: f64, hub: f64",
        functions: "
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    let place = q.r[i] * vec2(q.phi[i].cos(), q.phi[i].sin());
                    sum += 0.5 * self.m * place.dt().norm_squared() + 0.5 * self.hub * q.phi[i].dt().powi(2);
                }
                sum
            }",
        damped: "q.r[i].dt()",
        usual: 10,
    },
    Family {
        name: "chains of points with rods",
        coordinates: "x: [m; N], y: [m; N]",
        fields: "m: f64, l: f64, g: f64",
        functions: "
            fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 { vec2(q.x[i], q.y[i]) }
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += 0.5 * self.m * self.place(q, i).dt().norm_squared();
                }
                sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += self.m * self.g * q.y[i]; } sum
            }
            #[holonomic] fn rod(&self, q: &Coordinates<Self>) -> [Expr; N] {
                let mut rows = [self.place(q, 0).norm_squared() - self.l.powi(2); N];
                for i in 1..N {
                    rows[i] = (self.place(q, i) - self.place(q, i - 1)).norm_squared() - self.l.powi(2);
                }
                rows
            }
            #[output] fn tension(&self, q: &Coordinates<Self>) -> [Expr; N] { q.reaction(Self::rod) }",
        damped: "q.x[i].dt()",
        usual: 5,
    },
    Family {
        name: "slider-cranks",
        coordinates: "crank: [rad; N], rod: [rad; N], slide: [m; N]",
        fields: "m: f64, r: f64, l: f64, g: f64",
        functions: "
            fn pin(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
                self.r * vec2(q.crank[i].cos(), q.crank[i].sin())
            }
            fn along(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
                self.l * vec2(q.rod[i].cos(), -q.rod[i].sin())
            }
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += self.m * (self.pin(q, i).dt().norm_squared() + q.slide[i].dt().powi(2) + (self.l
                    * q.rod[i].dt()).powi(2));
                }
                sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO; for i in 0..N { sum += self.g * self.m * self.pin(q, i).y; } sum
            }
            #[holonomic] fn closure(&self, q: &Coordinates<Self>) -> [Vec2; N] {
                let mut rows = [Vec2::ZERO; N];
                for i in 0..N { rows[i] = self.pin(q, i) + self.along(q, i) - vec2(q.slide[i], 0.0); }
                rows
            }",
        damped: "q.slide[i].dt()",
        usual: 3,
    },
    Family {
        name: "sleighs",
        coordinates: "x: [m; N], y: [m; N], heading: [rad; N]",
        fields: "m: f64, inertia: f64, ahead: f64",
        functions: "
            fn direction(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
                vec2(q.heading[i].cos(), q.heading[i].sin())
            }
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    let centre = vec2(q.x[i], q.y[i]) + self.ahead * self.direction(q, i);
                    sum += 0.5 * self.m * centre.dt().norm_squared() + 0.5 * self.inertia *
                    q.heading[i].dt().powi(2);
                }
                sum
            }
            #[nonholonomic] fn edge(&self, q: &Coordinates<Self>) -> [Expr; N] {
                let mut rows = [Expr::ZERO; N];
                for i in 0..N { rows[i] = self.direction(q, i).perp().dot(vec2(q.x[i], q.y[i]).dt()); }
                rows
            }",
        damped: "q.heading[i].dt()",
        usual: 3,
    },
    Family {
        name: "blocks that stick and slide",
        coordinates: "x: [m; N], y: [m; N]",
        fields: "m: f64, g: f64, slope: f64, friction: f64",
        functions: "
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += 0.5 * self.m * vec2(q.x[i], q.y[i]).dt().norm_squared();
                }
                sum
            }
            #[potential] fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..N {
                    sum += self.m * self.g * (q.y[i] * self.slope.cos() - q.x[i] * self.slope.sin());
                }
                sum
            }
            #[holonomic] fn floor(&self, q: &Coordinates<Self>) -> [Expr; N] { q.y }
            #[nonholonomic(switched, integrable)] fn stick(&self, q: &Coordinates<Self>) -> [Expr; N] {
                q.x.dt()
            }
            #[force] fn rubbing(&self, q: &Coordinates<Self>) -> Force {
                let brake = -self.friction * q.slip(Self::stick);
                let mut sum = Force::along(q.x[0], brake * q.reaction(Self::floor)[0]);
                for i in 1..N { sum = sum + Force::along(q.x[i], brake * q.reaction(Self::floor)[i]); } sum
            }
            #[event] fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
                self.friction * q.reaction(Self::floor)[0] - q.reaction(Self::stick)[0].abs()
            }",
        damped: "q.x[i].dt()",
        usual: 5,
    },
];

impl Family {
    /// Struct and impl block of one size.
    pub(crate) fn source(&self, n: usize, damped: bool) -> [String; 2] {
        let (field, damper) = match damped {
            false => ("", String::new()),
            true => (
                ", damping: f64",
                format!(
                    "#[dissipation] fn damper(&self, q: &Coordinates<Self>) -> Expr {{
                        let mut sum = Expr::ZERO;
                        for i in 0..N {{ sum += 0.5 * self.damping * {}.powi(2); }}
                        sum
                    }}",
                    self.damped
                ),
            ),
        };
        let inputs = if self.functions.contains("q.push") { "#[inputs(push: [N; COUNT])]" } else { "" };
        let declaration = format!(
            "#[coordinates({})] {inputs} pub struct Subject {{ {}{field} }}",
            sized(self.coordinates, n),
            sized(self.fields, n)
        );
        let implementation = format!("impl Subject {{ {}{} }}", sized(self.functions, n), sized(&damper, n));
        [declaration.replace("COUNT", &n.to_string()), implementation]
    }
}

/// `N` as a number, where it is a word.
fn sized(text: &str, n: usize) -> String {
    ["; N]", "..N ", "[N "]
        .iter()
        .fold(text.to_owned(), |text, form| text.replace(form, &form.replace('N', &n.to_string())))
}
