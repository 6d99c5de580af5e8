//! A rectangular drum: a membrane on a square grid, with large deflections.
//!
//! Struck softly in the shape of one mode, it moves in that mode alone, with the frequency of the closed form
//! ω² = 4 T/m (sin²(p π/(2 (rows + 1))) + sin²(q π/(2 (columns + 1)))). Struck hard, its pitch falls: the
//! tension of the skin, a soap film, does not grow with its slope. A blow at one place makes waves that are
//! reflected at the rim.
//!
//! Source: Rayleigh, The Theory of Sound (1877), chapter 9.

mod common;

use std::f64::consts::PI;

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(w: [[m; self.columns]; self.rows])]
#[units(pitch: m, tension: N / m, mass: kg)]
struct Drum {
    rows: usize,
    columns: usize,
    pitch: f64,
    tension: f64,
    mass: f64,
}

#[dynamics]
impl Drum {
    /// Nodes 0 and rows + 1, and 0 and columns + 1, are the rim.
    fn height(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
        if i == 0 || j == 0 || i == self.rows + 1 || j == self.columns + 1 {
            Expr::ZERO
        } else {
            q.w[i - 1][j - 1]
        }
    }
    /// Where a node is.
    fn place(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Vec3 {
        vec3(self.pitch * i as f64, self.pitch * j as f64, self.height(q, i, j))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows {
            for j in 0..self.columns {
                sum += 0.5 * self.mass * q.w[i][j].dt().powi(2);
            }
        }
        sum
    }
    /// The skin is a soap film: its energy is its tension times its area, less that of the flat one.
    #[potential]
    fn stretched_area(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows + 1 {
            for j in 0..self.columns + 1 {
                let here = self.place(q, i, j);
                let a = (self.place(q, i + 1, j).z - here.z) / self.pitch;
                let b = (self.place(q, i, j + 1).z - here.z) / self.pitch;
                sum += self.tension * self.pitch.powi(2) * ((1.0 + a * a + b * b).sqrt() - 1.0);
            }
        }
        sum
    }
}

/// ω of mode (p, q) of small motions.
fn closed_form(drum: &Drum, p: usize, q: usize) -> f64 {
    let part = |k: usize, n: usize| (k as f64 * PI / (2.0 * (n + 1) as f64)).sin().powi(2);
    (4.0 * drum.tension / drum.mass * (part(p, drum.rows) + part(q, drum.columns))).sqrt()
}

/// The shape of mode (p, q), row after row.
fn shape(drum: &Drum, p: usize, q: usize, height: f64) -> Vec<f64> {
    let sine = |k: usize, i: usize, n: usize| (k as f64 * PI * (i + 1) as f64 / (n + 1) as f64).sin();
    let nodes = (0..drum.rows).flat_map(|i| (0..drum.columns).map(move |j| (i, j)));
    nodes.map(|(i, j)| height * sine(p, i, drum.rows) * sine(q, j, drum.columns)).collect()
}

fn main() -> common::Outcome {
    let drum = Drum { rows: 39, columns: 59, pitch: 0.01, tension: 800.0, mass: 2e-5 };
    println!("{}\n{}", Drum::EQUATIONS, Drum::REPORT);

    // The lowest modes are those of the closed form; none is missed.
    let mut exact: Vec<f64> =
        (1..=5).flat_map(|p| (1..=5).map(move |q| (p, q))).map(|(p, q)| closed_form(&drum, p, q)).collect();
    exact.sort_by(f64::total_cmp);
    for (mode, exact) in drum.modes(&drum.state().build()?, 6)?.iter().zip(exact) {
        println!("mode at {:.3} rad/s, closed form {exact:.3} rad/s", mode.frequency());
        assert!((mode.frequency() / exact - 1.0).abs() < 1e-9);
    }

    // Half a period after a soft release in mode (2, 3) the shape is upside down; a hard one is late, and
    // still on its way.
    let half = PI / closed_form(&drum, 2, 3);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let after = |height: f64| -> Result<[f64; 2], Box<dyn std::error::Error>> {
        let start = drum.state().w(shape(&drum, 2, 3, height)).build()?;
        let motion = drum.simulate(start).until(half).tolerance(1e-10).record(Every::Last).run()?;
        let (first, last) = (motion.start().w(), motion.end());
        Ok([last.w(), last.w_rate()].map(|end| dot(first, end) / dot(first, first)))
    };
    let ([soft, _], [hard, rate]) = (after(1e-6)?, after(0.03)?);
    println!(
        "overlap with the start after half a period: soft {soft:.8}, hard {hard:.8}, its rate {rate:.1}"
    );
    assert!((soft + 1.0).abs() < 1e-6 && hard > -0.999 && rate < 0.0);

    // A blow at one place.
    let blow =
        |i: usize, j: usize| -8.0 * (-0.1 * (i.abs_diff(12).pow(2) + j.abs_diff(20).pow(2)) as f64).exp();
    let rates = (0..drum.rows).flat_map(|i| (0..drum.columns).map(move |j| blow(i, j)));
    let motion = drum.simulate(drum.state().w_rate(rates).build()?).until(6e-3).tolerance(1e-7).run()?;
    println!("\n{}", motion.summary());
    let middle = motion.end().w_at(19, 29).ok_or("the drum has a middle")?;
    println!("the middle is at {:.4} mm at the end", 1e3 * middle);
    let mut files = common::Files::of("drum");
    motion.animate(files.path("drum.html"))?;
    files.list();
    Ok(())
}
