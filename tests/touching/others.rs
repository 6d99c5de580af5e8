use super::*;
use dynamics::methods::Any;

/// Driven y² = x⁶.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Driven { mass: f64, rate: f64 }
#[dynamics]
impl Driven {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr { 0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr { q.x - self.rate * q.t }
    #[holonomic]
    fn way(&self, q: &Coordinates<Self>) -> Expr { q.y * q.y - q.x.powi(6) }
}
/// Surfaces that touch along a curve: a bead in space on z² = (y + x²)⁴ or so.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, z)]
struct Sheet { mass: f64, g: f64 }
#[dynamics]
impl Sheet {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr { 0.5 * self.mass * vec3(q.x, q.y, q.z).dt().norm_squared() }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr { self.mass * self.g * (q.z + 0.3 * q.y) }
    #[holonomic]
    fn way(&self, q: &Coordinates<Self>) -> Expr { let h = q.x + 0.3 * q.y * q.y; (q.z - 0.2 * q.y) .powi(2) - h.powi(4) }
}
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct SheetAlone { mass: f64, g: f64 }
#[dynamics]
impl SheetAlone {
    fn z(&self, q: &Coordinates<Self>) -> Expr { let h = q.x + 0.3 * q.y * q.y; 0.2 * q.y + h * h }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr { 0.5 * self.mass * vec3(q.x, q.y, self.z(q)).dt().norm_squared() }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr { self.mass * self.g * (self.z(q) + 0.3 * q.y) }
}

fn report<'a, M: Simulate>(name: &str, label: String, run: Result<dynamics::motion::Motion<'a, M>, dynamics::motion::SimulationError<M>>, off: impl Fn(&M::State) -> f64) {
    match run {
        Ok(m) => { let w = m.summary().to_string(); let warns = w.lines().filter(|l| l.trim_start().starts_with("warning")).map(|l| l.trim().chars().take(100).collect::<String>()).collect::<Vec<_>>().join("|");
            let off = off(&m.end()); println!("{name} {label}: {} off {off:.1e} {warns}", if off > 1e-2 { if warns.is_empty() {"WRONG"} else {"wrong-warned"} } else {"right"}); }
        Err(e) => println!("{name} {label}: err {}", e.kind.to_string().chars().take(90).collect::<String>()),
    }
}

#[test]
fn driven() {
    let model = Driven { mass: 1.0, rate: 1.0 };
    for formulation in FORMULATIONS { for method in methods::<Driven>() { for digits in [4, 6, 8, 9, 10, 11, 12] { for begin in [-1.0, -0.83] {
        let y = f64::powi(begin, 3);
        let start = model.state().at_time(begin).x(begin).y(y).x_rate(1.0).y_rate(3.0 * begin * begin).build().unwrap();
        let run = model.simulate(start).until(0.9).method(&method).formulation(formulation).tolerance(10f64.powi(-digits)).run();
        report("driven", format!("{formulation} {method} 1e-{digits} {begin}"), run, |s| (s.y() - 0.9f64.powi(3)).abs());
    }}}}
}
#[test]
fn sheet() {
    let model = Sheet { mass: 1.0, g: 0.5 };
    let alone = SheetAlone { mass: 1.0, g: 0.5 };
    for formulation in FORMULATIONS { for method in methods::<Sheet>() { for digits in [4, 6, 8, 9, 10, 11, 12] { for k in 0..6 {
        let x0 = -0.8 + 0.07 * k as f64; let y0 = 0.3 - 0.1 * k as f64;
        let a = alone.state().x(x0).y(y0).x_rate(0.9).y_rate(0.2).build().unwrap();
        let truth = alone.simulate(a).until(1.8).tolerance(1e-13).run().unwrap().end();
        let h0 = x0 + 0.3 * y0 * y0; let hr = 0.9 + 0.6 * y0 * 0.2;
        let start = model.state().x(x0).y(y0).z(0.2 * y0 + h0 * h0).x_rate(0.9).y_rate(0.2).z_rate(0.04 + 2.0 * h0 * hr).build().unwrap();
        let run = model.simulate(start).until(1.8).method(&method).formulation(formulation).tolerance(10f64.powi(-digits)).run();
        report("sheet", format!("{formulation} {method} 1e-{digits} {k}"), run, |s| (s.y() - truth.y()).abs().max((s.x() - truth.x()).abs()));
    }}}}
}
#[test]
fn cusps() {
    for k in 0..6 {
        let scene = scene(k, 0.4);
        let model = <cusp::At as Curve>::bead(&scene);
        let start = <cusp::At as Curve>::start(&model, &scene, (-0.9 + 0.05 * k as f64, 0.8));
        for formulation in FORMULATIONS { for method in methods::<cusp::Bead>() { for digits in 2..=12 {
            let run = model.simulate(start).until(2.0).method(&method).formulation(formulation).tolerance(10f64.powi(-digits)).run();
            report("cusp", format!("{k} {formulation} {method} 1e-{digits}"), run, |_| 1.0);
        }}}
    }
}
#[test]
fn fixed() {
    for k in 0..10 {
        let scene = scene(k, 0.4);
        macro_rules! go { ($m:ident) => {{
            let model = <$m::At as Curve>::bead(&scene);
            let at = (-0.9 + 0.05 * k as f64, 1.0);
            let start = <$m::At as Curve>::start(&model, &scene, at);
            let place = scene.out(<$m::At as Curve>::truth(&scene, at, 2.0));
            let ms: Vec<Any<_>> = vec![methods::Rk4.into(), methods::Dop853.into(), methods::GeneralizedAlpha::default().into(), methods::Esdirk4.into(), methods::Rattle.into()];
            for formulation in [Formulation::Projected, Formulation::Embedded] { for method in &ms { for h in [0.1, 0.03, 0.01, 0.003] {
                let run = model.simulate(start).until(2.0).method(method).formulation(formulation).fixed_step(h).run();
                report(stringify!($m), format!("{k} {formulation} {method} {h}"), run, |s| (0..2).map(|i| (s.q()[i] - place[i]).abs()).fold(0.0, f64::max));
            }}}
        }}}
        go!(tacnode); go!(osculating); go!(lemniscate); go!(inside);
    }
}
