//! A rigid column on a hinge, held by a spring, slightly out of the upright. Depending on where the spring
//! is, it buckles gently or without warning.
//!
//!     spring at the hinge:       P l sin θ = k (θ − ε)
//!     level spring at the head:  P l sin θ = c l² (sin θ − ε) cos θ
//!
//! The first buckles at k/l and carries more beyond. The second buckles at c l and carries less beyond: at
//! most P = c l (1 − ε^⅔)^{3/2} (Z. P. Bažant & L. Cedolin, *Stability of Structures*, §4.5). Like
//! shells, the second is sensitive to imperfections: a hundredth out of the upright takes 7 % of its
//! strength, by the two-thirds law of W. T. Koiter (1945).

mod common;
use dynamics::analysis::SpecialKind;
use dynamics::analysis::{Page, continuation, fold_curve};
use dynamics::output::{Animation, Axis, Panel, Series};
use dynamics::prelude::*;
use dynamics::simulate::Direction;

/// A column on a hinge, held by a level spring at its head and slightly out of the upright. Raise the load:
/// at 86 N it suddenly falls. Now take the spring at the hinge instead, 100 N m against a level one of 0: it
/// only bends.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(mass: kg, length: m, hinge: N * m, level: N / m, damper: N * m * s, imperfection: rad, load: N)]
struct Column {
    mass: f64,
    length: f64,
    /// Spring at the hinge, and level one at the head.
    hinge: f64,
    level: f64,
    /// At the hinge.
    damper: f64,
    /// Where the springs are without force.
    imperfection: f64,
    load: f64,
}

#[dynamics]
impl Column {
    fn head(&self, q: &Coordinates<Self>) -> Vec2 {
        self.length * vec2(q.theta.sin(), q.theta.cos())
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (foot, head) = (vec2(0.0, 0.0), self.head(q));
        let column = Drawing::new()
            .ground(vec2(-0.4, 0.0), vec2(0.4, 0.0))
            .pivot(foot)
            .line(foot, head)
            .dot(head)
            .arrow(head + vec2(0.0, 0.35), head + vec2(0.0, 0.05));
        if self.level > 0.0 { column.spring(vec2(-0.8 * self.length, head.y), head) } else { column }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.head(q).dt().norm_squared()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let aside = self.head(q).x - self.length * self.imperfection;
        0.5 * self.hinge * (q.theta - self.imperfection).powi(2) + 0.5 * self.level * aside.powi(2)
    }
    #[dissipation]
    fn damping(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damper * q.theta.dt().powi(2)
    }
    #[event]
    fn lies(&self, q: &Coordinates<Self>) -> Expr {
        q.theta - 0.5 * std::f64::consts::PI
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.head(q), vec2(0.0, -self.load))
    }
}

/// The motions of a column that bends and of one that falls.
type BendingAndFalling<'m> = (Motion<'m, Column>, Motion<'m, Column>);

/// Lets two columns go, 0.03 rad out of the upright: the first comes to rest, the second falls.
fn let_go<'m>(
    bends: &'m Column,
    falls: &'m Column,
) -> Result<BendingAndFalling<'m>, Box<dyn std::error::Error>> {
    let fall = |column: &Column| column.state().theta(0.03).build();
    let bending = bends.simulate(fall(bends)?).until(4.0).run()?;
    let falling = falls.simulate(fall(falls)?).until(4.0).stop_at("lies", Direction::Rising).run()?;
    let rest = bends.equilibrium(&bending.end())?;
    println!(
        "under 0.9 of the critical load one comes to rest at {:.4} rad, the other lies after {:.3} s",
        rest.state.theta(),
        falling.end_time()
    );
    assert!((bending.end().theta() - rest.state.theta()).abs() < 1e-3 && falling.end_time() < 4.0);
    Ok((bending, falling))
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let column = Column {
        mass: 1.0,
        length: 1.0,
        hinge: 0.0,
        level: 100.0,
        damper: 3.0,
        imperfection: 0.03,
        load: 60.0,
    };
    let start = |theta: f64| column.state().theta(theta).build();
    Ok(column
        .live(start(0.03)?)
        .title("Buckling column")
        .first_start("the load comes at once")
        .start("pushed aside", start(0.4)?)
        .range("load", 0.0, 200.0)
        .range("imperfection", 0.0, 0.1)
        .range("hinge", 0.0, 200.0)
        .range("level", 0.0, 200.0)
        .range("damper", 0.0, 20.0)
        .hold(["mass", "length"])
        .plot(["theta"])
        .stop_at("lies", Direction::Rising)
        .finish()?)
}

fn main() -> common::Outcome {
    let column = Column {
        mass: 1.0,
        length: 1.0,
        hinge: 100.0,
        level: 0.0,
        damper: 3.0,
        imperfection: 0.0,
        load: 0.0,
    };
    let level = Column { hinge: 0.0, level: 100.0, ..column.clone() };
    let critical = 100.0;
    let mut page = Page::new("A column buckles");
    let mut limits = Vec::new();
    for (name, column, supercritical) in
        [("Spring at the hinge", &column, true), ("Level spring at the head", &level, false)]
    {
        let of = |imperfection: f64| move |load: f64| Column { imperfection, load, ..column.clone() };
        let from = |imperfection: f64| {
            let perfect = of(imperfection)(0.0);
            perfect
                .equilibrium(&perfect.state().theta(imperfection).build()?)
                .map_err(Box::<dyn std::error::Error>::from)
        };
        // The perfect column: the load from the eigenvalue problem, and located; with both bent branches.
        let family =
            continuation(of(0.0)).from(&from(0.0)?.state, 0.0).until(0.0..=2.0 * critical).named("load in N");
        let buckling = family.buckling()?;
        let diagram = family.branches(3)?;
        println!("{name}: {}\n{diagram}\n", buckling.loads[0].parameter);
        let [point] = &diagram.branches[0].special[..] else { return Err(diagram.to_string().into()) };
        assert_eq!(point.kind, SpecialKind::Pitchfork { supercritical });
        assert!((point.parameter / critical - 1.0).abs() < 1e-12);
        assert!((buckling.loads[0].parameter / critical - 1.0).abs() < 1e-12);

        // Imperfect ones.
        let mut panel = diagram.panel("θ in rad", |state| state.theta());
        for (imperfection, color) in [(0.01, Color::Green), (0.03, Color::Amber), (0.1, Color::Purple)] {
            let family = continuation(of(imperfection)).from(&from(imperfection)?.state, 0.0);
            let branch = family.until(0.0..=2.0 * critical).run()?;
            panel = panel.series(
                Series::new(
                    format!("ε = {imperfection}"),
                    branch.points.iter().map(|p| (p.parameter, p.state.theta())),
                )
                .color(color)
                .solid(),
            );
            assert_eq!(branch.folds().count(), usize::from(!supercritical));
            limits.extend(branch.folds().map(|fold| (imperfection, fold.clone())));
        }
        page = page.diagram(name, &diagram, [panel]);
    }

    // The limit load over the imperfection, as one curve of folds.
    let of = |load: f64, imperfection: f64| Column { imperfection, load, ..level.clone() };
    let (from, fold) = limits.last().ok_or("the level spring has limit loads")?;
    let curve = fold_curve(of, fold, *from).until(0.0..=critical, 1e-4..=0.1).backward().run()?;
    for ([limit, imperfection], _) in &curve.points {
        assert!((limit / critical - (1.0 - imperfection.powf(2.0 / 3.0)).powf(1.5)).abs() < 1e-11);
    }
    let lost = |limit: f64| 1.0 - limit / critical;
    let panel = Panel::new(Axis::log("imperfection ε"), Axis::log("part of the strength that is lost"))
        .line(
            "limit loads",
            curve.points.iter().map(|([limit, imperfection], _)| (*imperfection, lost(*limit))),
        )
        .line("3/2 ε^(2/3)", [1e-4, 1e-1].map(|e: f64| (e, 1.5 * e.powf(2.0 / 3.0))));
    // Both columns, 0.03 rad out of the upright, under a load that comes at once: nine tenths of the critical
    // one. One bends, the other falls.
    let [bends, falls] =
        [&column, &level].map(|column| Column { imperfection: 0.03, load: 0.9 * critical, ..column.clone() });
    let (bending, falling) = let_go(&bends, &falls)?;

    let words = "The limit load of the column with the level spring, followed over its imperfection.";
    let mut files = common::Files::of("buckling_column");
    page.panels("Imperfections", words, [panel]).write_html(files.path("buckling_column.html"))?;
    let film =
        Animation::new().add(&bending, "spring at the hinge").add(&falling, "level spring at the head");
    film.speed(0.5).write_html(files.path("under_load.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
