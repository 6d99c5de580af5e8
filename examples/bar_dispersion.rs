//! Dispersion in a bar of finite elements: ω² = K(κ)/M(κ) for waves with the phase κ from node to node.
//!
//! In a bar all waves have the speed c. In a row of elements short waves are slower (lumped masses) or faster
//! (consistent masses: velocities linear between nodes). The mean of both mass matrices is of order 4. Energy
//! moves with the group velocity dω/dκ, which short packets of waves show. A standing wave is the sum of two
//! waves that run towards each other, so natural frequencies lie on the same curve.
//!
//! Source: Hughes, The Finite Element Method (1987), §9.3; Belytschko, Mullen, On dispersive properties of
//! finite element solutions, in: Modern Problems in Elastic Wave Propagation (1978).

mod common;

use core::f64::consts::PI;

use dynamics::output::{Axis, Chart, Panel, Series};
use dynamics::prelude::*;

/// A bar, clamped left and free right. Of every mass `share` is consistent, the rest is lumped.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.elements])]
#[units(length: m, ea: N, rho: kg / m)]
struct Bar {
    elements: usize,
    length: f64,
    ea: f64,
    rho: f64,
    share: f64,
}

#[dynamics]
impl Bar {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    /// Node 0 is clamped. Displacements along the bar are drawn across it.
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(self.h() * i as f64, if i == 0 { Expr::ZERO } else { q.s[i - 1] })
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let (a, b) = (self.place(q, e).y.dt(), self.place(q, e + 1).y.dt());
                let (lumped, consistent) = ((a * a + b * b) / 4.0, (a * a + a * b + b * b) / 6.0);
                self.rho * self.h() * ((1.0 - self.share) * lumped + self.share * consistent)
            })
            .sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.elements {
            sum += 0.5 * self.ea / self.h() * (self.place(q, e + 1).y - self.place(q, e).y).powi(2);
        }
        sum
    }
}

fn main() -> common::Outcome {
    let bar = |share| Bar { elements: 400, length: 400.0, ea: 1.0, rho: 1.0, share };
    println!("{}", Bar::REPORT);
    let mut curves = Panel::new(Axis::new("phase per node κ"), Axis::new("ω h/c"));
    let mut errors = Panel::new(Axis::log("phase per node κ"), Axis::log("error of the speed"));
    for (name, share) in [("lumped", 0.0), ("consistent", 1.0), ("averaged", 0.5)] {
        let model = bar(share);
        let rest = model.state().build()?;
        let omega = |phase: f64| model.dispersion(&rest, [phase]).map(|branches| branches[0].frequency);
        // ω² = 12 (1 − cos κ)/(6 − 2 share (1 − cos κ)), with c = h = 1.
        let mut curve = Vec::new();
        for phase in (1..=60).map(|k| PI * f64::from(k) / 60.0) {
            let (own, versine) = (omega(phase)?, 1.0 - phase.cos());
            assert!((own / (12.0 * versine / (6.0 - 2.0 * share * versine)).sqrt() - 1.0).abs() < 1e-12);
            curve.push((phase, own));
        }
        let [coarse, fine] = [omega(0.1)? / 0.1 - 1.0, omega(0.05)? / 0.05 - 1.0];
        let order = (coarse / fine).log2();
        println!("{name} mass: error {coarse:+.1e} at phase 0.1, order {order:.3}");
        assert!((order - if share == 0.5 { 4.0 } else { 2.0 }).abs() < 0.01);
        errors = errors.line(name, curve.iter().map(|(phase, own)| (*phase, (own / phase - 1.0).abs())));
        curves = curves.line(format!("{name} mass"), curve);

        // Standing waves: a quarter wave, and half a wave more for each mode.
        for (k, mode) in model.modes(&rest, 4)?.iter().enumerate() {
            let exact = omega((k as f64 + 0.5) * PI / 400.0)?;
            assert!((mode.frequency() / exact - 1.0).abs() < 1e-9, "{k}: {} {exact}", mode.frequency());
        }
    }
    curves = curves.series(Series::new("exact", [(0.0, 0.0), (PI, PI)]).dashed());

    // A packet of short waves runs with the group velocity.
    let (model, phase) = (bar(0.0), 2.0);
    let wave = model.dispersion(&model.state().build()?, [phase])?[0];
    let packet = |j: f64| 40.0 * (-((j - 100.0) / 20.0).powi(2)).exp();
    let nodes = || (1..=400).map(f64::from);
    let rates = nodes().map(|j| wave.frequency * packet(j) * (phase * j).sin());
    let start = model.state().s(nodes().map(|j| packet(j) * (phase * j).cos())).s_rate(rates).build()?;
    let motion = model.simulate(start).until(200.0).tolerance(1e-9).run()?;
    let middle = |u: &[f64]| {
        let weight: f64 = u.iter().map(|u| u * u).sum();
        u.iter().zip(nodes()).map(|(u, j)| j * u * u).sum::<f64>() / weight
    };
    let speed = (middle(motion.end().s_rate()) - middle(motion.start().s_rate())) / 200.0;
    let (group, crests) = (wave.group_velocity, wave.frequency / phase);
    println!("a packet of phase 2 runs with {speed:.4}; group velocity {group:.4}, of crests {crests:.4}");
    assert!((speed / group - 1.0).abs() < 5e-3);
    println!("\n{}", motion.summary());

    let mut files = common::Files::of("bar_dispersion");
    let packets = Panel::new(Axis::new("node"), Axis::new("displacement"))
        .line("start", nodes().zip(motion.start().s().to_vec()))
        .line("after 200 h/c", nodes().zip(motion.end().s().to_vec()));
    Chart::new("Three mass matrices, and a packet of short waves")
        .panel(curves)
        .panel(errors)
        .panel(packets)
        .write_svg(files.path("dispersion.svg"))?;
    motion.animate(files.path("packet.html"))?;
    files.list();
    Ok(())
}
