//! Chapter 9: waves in a bar.

use dynamics::prelude::*;

use crate::Page;

/// A pulse in a bar that is clamped on the left and free on the right, drawn as the height of a curve: above
/// by finite differences, below by finite elements. The free end returns it upright, the clamped end upside
/// down. Take the narrow pulse: short waves are late by differences and early by elements, and the pulse
/// falls apart.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(differences: [m; 20], elements: [m; 20])]
#[units(length: m, ea: N, rho: kg / m)]
struct Bar {
    length: f64,
    /// Stiffness of the section.
    ea: f64,
    /// Mass per length.
    rho: f64,
}

#[dynamics]
impl Bar {
    fn h(&self) -> f64 {
        self.length / 20.0
    }
    /// Node 0 is clamped.
    fn difference(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.differences[i - 1] }
    }
    /// The same of the elements.
    fn element(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.elements[i - 1] }
    }
    /// Differences are masses at the nodes; between nodes of elements the velocity is linear.
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..20 {
            let (a, b) = (self.difference(q, e).dt(), self.difference(q, e + 1).dt());
            sum += 0.25 * self.rho * self.h() * (a * a + b * b);
            let (a, b) = (self.element(q, e).dt(), self.element(q, e + 1).dt());
            sum += self.rho * self.h() / 6.0 * (a * a + a * b + b * b);
        }
        sum
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..20 {
            let stretch = self.difference(q, e + 1) - self.difference(q, e);
            sum += 0.5 * self.ea / self.h() * stretch.powi(2);
            let stretch = self.element(q, e + 1) - self.element(q, e);
            sum += 0.5 * self.ea / self.h() * stretch.powi(2);
        }
        sum
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let place = |i: usize, base: f64, s: Expr| vec2(i as f64 * self.h(), base + s);
        let above: Vec<_> = (0..21).map(|i| place(i, 0.2, self.difference(q, i))).collect();
        let below: Vec<_> = (0..21).map(|i| place(i, -0.2, self.element(q, i))).collect();
        let mut drawing = Drawing::new()
            .color(Color::Faint)
            .line([0.0, 0.2], [self.length, 0.2])
            .line([0.0, -0.2], [self.length, -0.2])
            .width(4.0)
            .line([0.0, 0.1], [0.0, 0.3])
            .line([0.0, -0.3], [0.0, -0.1])
            .plain()
            .color(Color::Blue)
            .polyline(above.iter().copied())
            .color(Color::Amber)
            .polyline(below.iter().copied());
        for i in 1..21 {
            drawing =
                drawing.color(Color::Blue).disc(above[i], 0.008).color(Color::Amber).disc(below[i], 0.008);
        }
        drawing
            .color(Color::Blue)
            .label([0.02 * self.length, 0.33], "finite differences")
            .color(Color::Amber)
            .label([0.02 * self.length, -0.07], "finite elements")
    }
}

/// The live page: a speed of 0.5 m/s, so that the wave is seen.
pub(crate) fn waves() -> Page {
    let bar = Bar { length: 1.0, ea: 0.25, rho: 1.0 };
    let speed = f64::sqrt(bar.ea / bar.rho);
    // A pulse that runs to the right: ṡ = −c s′.
    let pulse = |width: f64| {
        let shape = |i: usize| {
            let away = (bar.length * (i + 1) as f64 / 20.0 - 0.35) / width;
            let height = 0.1 * (-away * away).exp();
            (height, speed * 2.0 * away / width * height)
        };
        let (heights, rates) = (std::array::from_fn(|i| shape(i).0), std::array::from_fn(|i| shape(i).1));
        let state = bar.state().differences(heights).elements(heights);
        state.differences_rate(rates).elements_rate(rates).build()
    };
    let mode: [f64; 20] =
        std::array::from_fn(|i| 0.08 * (1.5 * std::f64::consts::PI * (i + 1) as f64 / 20.0).sin());
    Ok(bar
        .live(pulse(0.12)?)
        .title("Waves in a bar: differences beside elements")
        .first_start("wide pulse")
        .start("narrow pulse", pulse(0.05)?)
        .start("second mode", bar.state().differences(mode).elements(mode).build()?)
        .range("ea", 0.02, 1.0)
        .range("rho", 0.2, 5.0)
        .range("length", 0.5, 2.0)
        .tolerance(1e-6)
        .plot(["differences[19]", "elements[19]"])
        .phase("differences[19]")
        .finish()?)
}
