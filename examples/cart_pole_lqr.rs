//! A cart keeps its pole upright by a linear–quadratic regulator. How far may the pole be tilted?
//!
//!     L = ½ M ẋ² + ½ m |ṙ|² − m g y,        r = (x + l sin θ, l cos θ)
//!     F = −K (x, θ, ẋ, θ̇)
//!
//! K minimises ∫ (x²/x₀² + θ²/θ₀² + F²/F₀²) dt for the exact linearisation at the upright
//! (Anderson & Moore, *Optimal Control*). The nonlinear model then starts from a tilt, and from a grid of
//! tilts and rates. The starts from which it recovers are the basin of attraction.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: rad)]
#[inputs(force: N)]
#[units(cart: kg, bob: kg, length: m, g: m / s^2)]
struct CartPole {
    cart: f64,
    bob: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl CartPole {
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x + self.length * q.theta.sin(), self.length * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.tip(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.tip(q).y
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.force)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (cart, tip) = (vec2(q.x, 0.0), self.tip(q));
        Drawing::new()
            .ground([-1.5, -0.1], [1.5, -0.1])
            .tail("tip", tip, 1.0)
            .fill(Color::Faint)
            .rectangle(cart, 0.4, 0.2, 0.0)
            .line(cart, tip)
            .disc(tip, 0.06)
            .color(Color::Red)
            .arrow(cart, cart + vec2(0.03 * q.force, 0.0))
    }
}

fn main() -> common::Outcome {
    let model = CartPole { cart: 1.0, bob: 0.2, length: 0.5, g: 9.81 };
    let upright = model.state().force(0.0).build()?;
    let space = model.state_space(&upright)?;
    for mode in space.controllability(&["force"])? {
        println!("{mode}");
        assert!(mode.is_reached());
    }
    // Half a metre, 0.2 rad and 10 N weigh alike.
    let control = space.lqr().weight("x", 4.0).weight("theta", 25.0).weight("force", 0.01).solve()?;
    println!("\n{control}\n");
    assert!(control.closed_loop.iter().all(|x| x.re < 0.0) && control.residual < 1e-13);
    // The gain of an unstable plant pushes the cart under the pole: toward its own side first.
    assert!(control.gain_of("force", "theta").is_some_and(|k| k < 0.0));

    let start = |tilt: f64, rate: f64| model.state().theta(tilt).theta_rate(rate).force(0.0).build();
    let caught = model
        .simulate(start(0.6, 0.0)?)
        .until(8.0)
        .tolerance(1e-9)
        .inputs(|_, s| control.inputs_at(s))
        .run()?;
    println!("{}", caught.summary());
    let end = caught.end();
    println!(
        "let go at 34° it stands after 8 s within {:.1e} rad, {:.1e} m",
        end.theta().abs(),
        end.x().abs()
    );
    assert!(end.theta().abs() < 1e-4 && end.x().abs() < 1e-3);

    // Tilt and rate from which it comes back, the cart at rest in the middle: on all cores where the feature
    // `parallel` is there.
    let sweep = model.sweep(upright).over("theta", (-24..=24).map(|i| f64::from(i) * 0.06));
    let sweep = sweep.over("theta_rate", (-16..=16).map(|j| f64::from(j) * 0.5));
    let sweep = sweep.run(["stands"], |model, start| {
        let run = model.simulate(start).until(6.0).tolerance(1e-6).inputs(|_, s| control.inputs_at(s));
        let run = run.event("fallen", |s| 1.5 - s.theta().abs()).stop_at("fallen", Direction::Falling);
        let end = run.run_with(|_| {})?;
        Ok([f64::from(end.t() == 6.0 && end.theta().abs() < 0.05)])
    })?;
    let (mut back, mut lost) = (Vec::new(), Vec::new());
    for (k, result) in sweep.results.iter().enumerate() {
        let [stands] = result.as_ref().map_err(Clone::clone)?;
        let [tilt, rate] = sweep.at(k)[..] else { return Err("two axes".into()) };
        if *stands == 1.0 { &mut back } else { &mut lost }.push((tilt, rate));
    }
    println!("{} of {} starts come back", back.len(), back.len() + lost.len());
    // What comes back from one side does from the other: the model has no sides.
    assert!(
        back.iter()
            .all(|(tilt, rate)| back.iter().any(|(t, r)| (t + tilt).abs() < 1e-9 && (r + rate).abs() < 1e-9))
    );
    assert!(back.contains(&(0.0, 0.0)) && back.iter().any(|(tilt, rate)| *rate == 0.0 && *tilt > 0.6));

    let mut files = common::Files::of("cart_pole_lqr");
    let history: Vec<_> = caught.sample(common::times(8.0, 1000)).collect();
    let panel = |title| Panel::new(Axis::new("time in s"), Axis::new(title));
    Chart::new("A pole caught at 34°")
        .panel(panel("θ in rad").line("θ", history.iter().map(|s| (s.t, s.theta()))))
        .panel(panel("x in m").line("x", history.iter().map(|s| (s.t, s.x()))))
        .panel(panel("F in N").line("F", history.iter().map(|s| (s.t, s.force()))))
        .write_svg(files.path("caught.svg"))?;
    Chart::new("Basin of attraction of the upright")
        .panel(
            Panel::new(Axis::new("tilt in rad"), Axis::new("rate in rad/s"))
                .points("stands", back)
                .points("falls", lost),
        )
        .panel_height(420.0)
        .write_svg(files.path("basin.svg"))?;
    caught.animation().plot(["theta", "x"]).write_html(files.path("caught.html"))?;
    files.list();
    Ok(())
}
