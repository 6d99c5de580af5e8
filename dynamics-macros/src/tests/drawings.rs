//! Drawings as expressions, beside the same drawings on time jets: figure by figure, and what is not
//! followed.

use std::path::Path;

use dynamics::output::{Color, Figure as Drawn, Point as Place};
use dynamics::prelude::*;
use dynamics_runtime::model::{Draw, Model, ModelState, Vector};
use dynamics_symbolic::graph::{Bindings, FunctionId, NodeId, Symbol};
use dynamics_symbolic::mechanics::{Extra, Figure, Figures, Pen, Picture, Shape};
use proc_macro2::TokenStream;
use quote::ToTokens;
use syn::Item;

use crate::diagnostics::Diagnostics;
use crate::elaborate;
use crate::syntax::{parse_impl, parse_struct};

/// A model that the program has, and its text.
macro_rules! with_text {
    ({ $($item:tt)* } { $($block:tt)* }) => {
        #[derive(Clone, Debug, Dynamics)]
        $($item)*
        #[dynamics]
        $($block)*
        const TEXTS: [&str; 2] = [stringify!($($item)*), stringify!($($block)*)];
    };
}

with_text! {
    {
        #[coordinates(x: m, y: m, turn: rad)]
        #[inputs(push: N)]
        #[units(mass: kg, length: m, stiffness: N / m, track: m)]
        struct Words {
            mass: f64,
            length: f64,
            stiffness: f64,
            sides: [f64; 3],
            lean: Vec3<f64>,
            track: CubicSpline,
        }
    }
    {
        impl Words {
            const NAMES: [&str; 3] = ["left", "middle", "right"];
            const BRIGHT: Color = Color::Rgb(250, 0, 17);

            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let v = vec2(q.x, q.y).dt();
                0.5 * self.mass * (v.norm_squared() + (self.length * q.turn.dt()).powi(2))
            }
            #[potential]
            fn spring(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.stiffness * (q.y - self.track.at(q.x)).powi(2)
            }
            #[force]
            fn motor(&self, q: &Coordinates<Self>) -> Force {
                Force::along(q.x, q.push)
            }
            #[holonomic]
            fn guide(&self, q: &Coordinates<Self>) -> Expr {
                q.y - self.length * q.turn
            }
            fn middle(&self, q: &Coordinates<Self>) -> Vec2 {
                vec2(q.x, q.y)
            }
            fn way(&self, q: &Coordinates<Self>) -> Vec2 {
                self.middle(q).dt()
            }
            fn corners(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
                [-1.0, 1.0].map(|side| self.middle(q) + vec2(side * self.length, 0.0 * q.x))
            }
            fn frame(&self, q: &Coordinates<Self>) -> Frame {
                Frame::new(vec3(q.x, q.y, self.length), Mat3::rotation_z(q.turn))
            }
            fn wheel(&self, at: Vec2, radius: f64) -> Drawing {
                let spokes = (0..3).map(|k| {
                    let angle = f64::from(k) * std::f64::consts::FRAC_PI_3;
                    at + radius * vec2(Expr::from(angle.cos()), Expr::from(angle.sin()))
                });
                spokes.fold(Drawing::new().circle(at, radius), |drawing, end| drawing.line(at, end))
            }
            fn kinds(&self, q: &Coordinates<Self>) -> Drawing {
                let (middle, frame) = (self.middle(q), self.frame(q));
                Drawing::new()
                    .line([0.0, 0.0], middle)
                    .polyline([middle, vec2(q.x, 0.0), Vec2::ZERO])
                    .polygon(vec![middle, middle + vec2(1.0, 0.0), middle + vec2(0.0, 1.0)])
                    .rectangle(middle, self.length, 0.3, q.turn)
                    .rectangle(frame.origin(), 0.2, self.length, q.turn + 0.1)
                    .curve(0.0, 2.0 * self.length, 7, |s| [s, s * q.x.value() + self.length])
                    .arc(middle, self.length, 0.1, q.turn)
                    .arc([q.x.value(), 0.0, 1.0], 0.5, q.turn, 2.0)
                    .circle(middle, 0.3)
                    .disc(frame.origin(), self.length)
                    .dot(middle)
                    .pivot([self.length, 0.0])
                    .ground([-1.0, 0.0], [1.0, q.y.value()])
                    .spring([0.0; 3], frame.point(vec3(1.0, 0.0, 0.0)))
                    .coils(middle, Vec2::ZERO, 4)
                    .arrow(middle, middle + 0.2 * q.reaction(Self::guide) * middle.perp())
                    .text(middle, "centred")
                    .label([0.0, 1.0], "beside")
                    .trace("tip", middle)
                    .tail("late tip", middle, 2.0 * self.length)
                    .cuboid(frame, Vec3::ZERO, self.sides)
                    .cuboid(frame, vec3(self.length, 0.0, 0.0), [1.0, self.length, 0.5])
                    .cylinder(frame.origin(), self.lean, self.length)
                    .cone([0.0; 3], frame.origin(), 0.2)
                    .line([0.0, 0.0], frame.origin())
                    .arrow(frame.origin(), middle)
                    .cylinder(middle, frame.origin(), 0.1)
            }
            fn pens(&self, q: &Coordinates<Self>) -> Drawing {
                let middle = self.middle(q);
                let fast = q.x.dt() > 0.2;
                let name = if fast { "fast" } else { "slow" };
                Drawing::new()
                    .color(Color::Red)
                    .fill(Color::Faint)
                    .width(4.0)
                    .dashed()
                    .polygon([Vec2::ZERO, middle, vec2(1.0, 0.0)])
                    .axes(2.0)
                    .dot(middle)
                    .plain()
                    .dot(middle)
                    .color(Self::BRIGHT)
                    .dot(middle)
                    .color(Color::cycle(3))
                    .dot(middle)
                    .color(if fast { Color::Green } else { Color::Teal })
                    .label(middle, name)
                    .disc(middle, if fast { 2.0 * self.length } else { self.length })
                    .with(Drawing::new().dashed().dot(middle))
                    .dot(middle)
            }
            fn choices(&self, q: &Coordinates<Self>) -> Drawing {
                let middle = self.middle(q);
                let mut drawing = Drawing::new().dot(middle);
                if q.x > 0.0 {
                    drawing = drawing.color(Color::Blue).line(Vec2::ZERO, middle);
                } else {
                    drawing = drawing.color(Color::Blue).line(middle, vec2(q.y, q.x));
                }
                if self.length > 0.8 {
                    drawing = drawing.color(Color::Amber).spring(Vec2::ZERO, middle);
                }
                drawing = if q.turn > 0.3 && q.y < 0.4 {
                    drawing.dot(middle).circle(middle, 0.1)
                } else if q.x < 0.2 {
                    drawing.pivot(middle)
                } else {
                    drawing
                };
                drawing.dot(Vec2::ZERO)
            }
            fn lists(&self, q: &Coordinates<Self>) -> Drawing {
                let middle = self.middle(q);
                let along = |from: Vec2, times: f64| move |s: f64| from + times * s * middle;
                let line = along(middle, 0.5);
                let places: Vec<Vec2> = (0..3).map(|i| line(f64::from(i))).collect();
                let mut more = Vec::new();
                for (i, place) in places.iter().enumerate() {
                    more.push(*place + vec2(0.0, i as f64));
                }
                more.extend(places.iter().copied().rev());
                let [a, b, c] = self.sides.map(|side| 0.5 * side);
                let mut drawing = Drawing::new()
                    .polyline(std::iter::once(Vec2::ZERO).chain(places.iter().copied()))
                    .polyline(more)
                    .polyline([[a, b], [b, c]])
                    .curve(0.0, 1.0, 3, line)
                    .polyline((0..4).filter(|i| i % 2 == 1).map(|i| [f64::from(i), 0.0]))
                    .polyline([0.5, 1.5].iter().flat_map(|x| [[*x, 0.0], [*x, 1.0]]))
                    .with(places.iter().copied().fold(Drawing::new(), Drawing::dot));
                for (i, name) in Self::NAMES.iter().enumerate() {
                    drawing = drawing.trace(format!("{name} {{{i}}} of {}", 3), places[i]);
                }
                for pair in places.windows(2) {
                    drawing = drawing.line(pair[0], pair[1]);
                }
                drawing.dot(*places.last().unwrap()).with(self.wheel(middle, self.length))
            }
            fn numbers(&self, q: &Coordinates<Self>) -> Drawing {
                let [first, last] = self.track.domain();
                let run = (0.3 * q.t).value().rem_euclid(0.25);
                let mut drawing = Drawing::new()
                    .curve(first, last, 9, |x| [x, self.track.derivatives(x)[0]])
                    .dot([q.x.rate(), f64::hypot(q.x.value(), self.length)])
                    .dot([q.x.acceleration(), q.push.value()])
                    .dot([q.x.value().rem_euclid(-0.4), q.y.value().rem_euclid(self.length)])
                    .arrow(self.middle(q).value(), self.middle(q).value() + 0.1 * self.way(q).value())
                    .dot(vec2(self.track.at(q.x), q.y.dt().dt()));
                for k in 0..3 {
                    let (x, half) = (0.25 * f64::from(k) + run, f64::from(k / 2));
                    drawing = drawing.line([x, half], [x, -0.1]);
                }
                drawing
            }
            #[drawing]
            fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
                [self.kinds(q), self.pens(q), self.choices(q), self.lists(q), self.numbers(q)]
                    .into_iter()
                    .fold(Drawing::new(), |all, part| all.with(part))
            }
        }
    }
}

/// A state of the model, in which the picture has values.
struct Instant<'a> {
    picture: &'a Picture,
    model: &'a Words,
    parameters: Vec<f64>,
    t: f64,
    vectors: [[f64; 3]; 3],
    push: f64,
    reaction: f64,
    running: f64,
}

impl Bindings for Instant<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        let [q, u, a] = &self.vectors;
        match symbol {
            Symbol::Time => self.t,
            Symbol::Coordinate(i) => q[i as usize],
            Symbol::Rate(i) => u[i as usize],
            Symbol::Acceleration(i) => a[i as usize],
            Symbol::Input(_) => self.push,
            Symbol::Multiplier(_) => self.reaction,
            Symbol::Mode(_) => 0.0,
            Symbol::Parameter(i) if i < self.picture.first_extra => self.parameters[i as usize],
            Symbol::Parameter(i) => match self.picture.extras[(i - self.picture.first_extra) as usize] {
                Extra::Running => self.running,
                Extra::Start(_) => self.model.track.domain()[0],
                Extra::End(_) => self.model.track.domain()[1],
            },
        }
    }
    fn smooth(&self, _: FunctionId, order: u8, x: f64) -> f64 {
        self.model.track.derivatives(x)[usize::from(order)]
    }
}

impl Instant<'_> {
    fn values(&self, nodes: &[NodeId]) -> Vec<f64> {
        let all = self.picture.graph.evaluate(nodes, self);
        nodes.iter().map(|node| all[node.index()]).collect()
    }

    /// A shape as the page draws it: what it is in words, and its numbers.
    fn seen(&mut self, shape: &Shape) -> Option<(String, Vec<f64>)> {
        if shape.shown.is_some_and(|shown| self.values(&[shown]) == [0.0]) {
            return None;
        }
        let mut numbers = self.values(&shape.figure.numbers());
        let words = match &shape.figure {
            Figure::Curve { segments, point, .. } => {
                let (from, to) = (numbers[0], numbers[1]);
                numbers.clear();
                for k in 0..=*segments {
                    let part = k as f64 / *segments as f64;
                    self.running = from * (1.0 - part) + to * part;
                    numbers.extend(self.values(point));
                }
                String::from("polyline false")
            }
            Figure::Polyline { closed, .. } => format!("polyline {closed}"),
            Figure::Circle { filled, .. } => format!("circle {filled}"),
            Figure::Spring { coils, .. } => format!("spring {coils}"),
            Figure::Text { text, beside, .. } => format!("text {text} {beside}"),
            Figure::Trace { name, .. } => format!("trace {name}"),
            other => other.kind().to_owned(),
        };
        Some((format!("{words} {:?}", shape.pen), numbers))
    }
}

/// A shape that was drawn on jets, likewise.
fn drawn(shape: &dynamics::output::Shape) -> (String, Vec<f64>) {
    let all = |points: &[Place]| -> Vec<f64> {
        let in_space = points.iter().any(|point| matches!(point, Place::Spatial(_)));
        let numbers = points.iter().map(|point| match point {
            Place::Planar([x, y]) if in_space => vec![*x, 0.0, *y],
            Place::Planar(p) => p.to_vec(),
            Place::Spatial(p) => p.to_vec(),
        });
        numbers.flatten().collect()
    };
    let (words, numbers) = match &shape.figure {
        Drawn::Polyline { points, closed } => (format!("polyline {closed}"), all(points)),
        Drawn::Circle { center, radius, filled } => {
            (format!("circle {filled}"), [all(&[*center]), vec![*radius]].concat())
        }
        Drawn::Arc { center, radius, from, to } => {
            ("arc".to_owned(), [all(&[*center]), vec![*radius, *from, *to]].concat())
        }
        Drawn::Dot { center } => ("dot".to_owned(), all(&[*center])),
        Drawn::Spring { from, to, coils } => (format!("spring {coils}"), all(&[*from, *to])),
        Drawn::Arrow { from, to } => ("arrow".to_owned(), all(&[*from, *to])),
        Drawn::Text { at, text, beside } => (format!("text {text} {beside}"), all(&[*at])),
        Drawn::Trace { name, at, seconds } => {
            (format!("trace {name}"), all(&[*at]).into_iter().chain(*seconds).collect())
        }
        Drawn::Ground { from, to } => ("ground".to_owned(), all(&[*from, *to])),
        Drawn::Pivot { at } => ("pivot".to_owned(), all(&[*at])),
        Drawn::Cuboid { center, faces } => ("cuboid".to_owned(), [all(&[*center]), all(faces)].concat()),
        Drawn::Cone { from, to, radii } => ("cone".to_owned(), [all(&[*from, *to]), radii.to_vec()].concat()),
        other => panic!("{other:?}"),
    };
    let name = |color: Color| match color {
        Color::Rgb(r, g, b) => format!("#{r:02x}{g:02x}{b:02x}"),
        named => format!("{named:?}").to_lowercase(),
    };
    let (color, fill) = (name(shape.color), shape.fill.map(name));
    let pen = Pen { color, fill, width: shape.width, dashed: shape.dashed };
    (format!("{words} {pen:?}"), numbers)
}

/// The picture of a model by its tokens, which has no errors.
fn picture_of(declaration: TokenStream, implementation: TokenStream) -> Option<Picture> {
    let mut diagnostics = Diagnostics::new();
    let declaration = parse_struct(declaration, &mut diagnostics).expect("a struct");
    let implementation = parse_impl(implementation, &mut diagnostics).expect("a block");
    let elaborated = elaborate::elaborate(&declaration, &implementation, &mut diagnostics);
    diagnostics.finish().expect("the model has no errors");
    elaborated.model.picture
}

/// The same by its texts.
fn picture(declaration: &str, implementation: &str) -> Picture {
    let [declaration, implementation] =
        [declaration, implementation].map(|text| text.parse().expect("tokens"));
    picture_of(declaration, implementation).expect("it has points or a drawing")
}

fn vector<V: Vector>(values: &[f64]) -> V {
    let mut vector = V::zeros();
    vector.as_mut_slice().copy_from_slice(values);
    vector
}

#[test]
fn drawings_are_the_same_as_expressions_and_on_jets() {
    let picture = picture(TEXTS[0], TEXTS[1]);
    let Figures::Of(shapes) = &picture.figures else { panic!("{:?}", picture.figures) };
    let mut seed = 1.0_f64;
    let mut random = move || {
        seed = (seed * 997.0 + 0.123).rem_euclid(1.0) + 1e-3;
        2.0 * seed - 0.8
    };
    let mut seen_figures = std::collections::BTreeSet::new();
    for _ in 0..200 {
        let positive = |x: f64| x.abs() + 0.1;
        let knots = [-1.0, 0.7, 1.5 + positive(random()), 4.0];
        let model = Words {
            mass: positive(random()),
            length: positive(random()),
            stiffness: positive(random()),
            sides: [(); 3].map(|()| positive(random())),
            lean: Vec3::new(random(), random(), random()),
            track: CubicSpline::not_a_knot(&knots, &knots.map(|_| random())).expect("knots increase"),
        };
        let parameters = [model.mass, model.length, model.stiffness].into_iter().chain(model.sides);
        let parameters = parameters.chain([model.lean.x, model.lean.y, model.lean.z]).collect();
        let vectors = [(); 3].map(|()| [(); 3].map(|()| random()));
        let (t, push, reaction) = (random(), random(), random());
        let [q, u, a] = &vectors;
        let state = WordsState::new(t, vector(q), vector(u), vector(&[push]));
        let drawing = model.draw(&Words::coordinates_with(&state, &vector(a), &[reaction]));
        let (model, picture) = (&model, &picture);
        let mut instant =
            Instant { picture, model, parameters, t, vectors, push, reaction, running: f64::NAN };
        let seen: Vec<_> = shapes.iter().filter_map(|shape| instant.seen(shape)).collect();
        let expected: Vec<_> = drawing.shapes().iter().map(drawn).collect();
        let words =
            |all: &[(String, Vec<f64>)]| all.iter().map(|(words, _)| words.clone()).collect::<Vec<_>>();
        assert_eq!(words(&seen), words(&expected));
        for ((words, seen), (_, expected)) in seen.iter().zip(&expected) {
            assert_eq!(seen.len(), expected.len(), "{words}");
            for (x, y) in seen.iter().zip(expected) {
                assert!((x - y).abs() <= 1e-12 * y.abs().max(1.0), "{words}: {x} instead of {y}");
            }
        }
        seen_figures.insert(words(&seen));
    }
    assert!(seen_figures.len() > 8, "every choice was made: {}", seen_figures.len());
}

#[test]
fn points_have_names_and_are_places() {
    let found = picture(TEXTS[0], TEXTS[1]);
    let names: Vec<_> = found.points.iter().map(|point| (point.name.as_str(), point.at.len())).collect();
    // `way` is a velocity.
    assert_eq!(names, [("middle", 2), ("corners[0]", 2), ("corners[1]", 2)]);
    let mass = "#[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr { self.mass * (sum) }";
    let by_name = |coordinates: &str, sum: &str| {
        let declaration = format!("#[coordinates({coordinates})] struct Bodies {{ mass: f64 }}");
        let implementation = format!("impl Bodies {{ {} }}", mass.replace("sum", sum));
        let found = picture(&declaration, &implementation);
        assert_eq!(found.figures, Figures::None);
        found.points.into_iter().map(|point| (point.name, point.at.len())).collect::<Vec<_>>()
    };
    assert_eq!(
        by_name("x1: m, y1: m, z1: m", "vec3(q.x1, q.y1, q.z1).dt().norm_squared()"),
        [("x1, y1, z1".to_owned(), 3)]
    );
    assert_eq!(
        by_name(
            "x: [m; 2], y: [m; 2]",
            "(vec2(q.x[0], q.y[0]).dt() + vec2(q.x[1], 2.0 * q.y[1]).dt()).norm_squared() \
            + (q.x[1].dt().powi(2) + q.y[1].dt().powi(2))"
        ),
        [("x[0], y[0]".to_owned(), 2), ("x[1], y[1]".to_owned(), 2)]
    );
}

/// What of a drawing with this body is not followed.
fn not_followed(body: &str) -> String {
    let implementation = format!(
        "impl Bob {{
            #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{ self.mass * q.x.dt().powi(2) }}
            fn helper(&self, q: &Coordinates<Self>) -> f64 {{ self.lookup(q.x.value()) + 1.0 }}
            #[drawing] fn drawing(&self, q: &Coordinates<Self>) -> Drawing {{ {body} }}
        }}"
    );
    let found = picture("#[coordinates(x: m)] #[units(mass: kg)] struct Bob { mass: f64 }", &implementation);
    match found.figures {
        Figures::NotFollowed(reason) => reason.expression,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_not_followed_is_told_and_no_error() {
    for (body, expression) in [
        ("Drawing::new().dot(table()[0])", "table()"),
        ("Drawing::new().disc([0.0, 1.0], self.helper(q))", ".lookup(q.x.value())"),
        ("let d = Drawing::new(); d.dot([q.x.value().floor(), 0.0])", ".floor()"),
        ("Drawing::new().sparkle(1.0)", ".sparkle(1.0)"),
        // What is taken from it would be missing in the original.
        ("Drawing::new().polyline([[0.0, 1.0], [1.0, 2.0]].iter().by_ref())", ".by_ref()"),
        ("Drawing::new().width(self.mass).dot([0.0, q.x])", ".width(self.mass)"),
        ("while true {} Drawing::new()", "while true {}"),
        (
            "Drawing::new().label([0.0, 0.0], format!(\"{:.1}\", q.x.value()))",
            "format!(\"{:.1}\", q.x.value())",
        ),
        (
            "let mut k = 0.0; let mut next = || { k += 1.0; [k, 0.0] }; Drawing::new().dot(next()).dot(next())",
            "k += 1.0",
        ),
        (
            "let n = if q.x > 0.0 { 2 } else { 3 }; Drawing::new().coils([0.0; 2], [1.0; 2], n)",
            "if q.x > 0.0 { 2 } else { 3 }",
        ),
        ("#[cfg(test)] let q = q; Drawing::new().dot([q.x, q.x])", "cfg(test)"),
        ("Drawing::new().dot([E, 0.0])", "E"),
        ("Drawing::new().polyline([1.0, 2.0].map(r#type::made))", ".map(r#type::made)"),
    ] {
        assert_eq!(not_followed(body), expression, "{body}");
    }
}

/// The examples' drawings, where they are written out: one that is made by a macro is not.
#[test]
fn drawings_of_the_examples_are_followed() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let mut followed = 0;
    for entry in std::fs::read_dir(examples).expect("the examples are there") {
        let path = entry.expect("it can be read").path();
        if path.extension().is_none_or(|extension| extension != "rs") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("it can be read");
        let file = syn::parse_file(&text).expect("rustc reads it");
        for item in &file.items {
            let Item::Impl(block) = item else { continue };
            let block_text = block.to_token_stream().to_string();
            if !block_text.contains("# [drawing]") {
                continue;
            }
            let name = block.self_ty.to_token_stream().to_string();
            let is_model = |item: &&Item| matches!(item, Item::Struct(model) if model.ident == name);
            let Some(Item::Struct(declared)) = file.items.iter().find(is_model) else {
                panic!("{name} has no struct")
            };
            let (mut declared, mut block) = (declared.clone(), block.clone());
            declared.attrs.retain(|a| crate::syntax::ATTRIBUTES.iter().any(|own| a.path().is_ident(own)));
            block.attrs.clear();
            let found = picture_of(declared.into_token_stream(), block.into_token_stream());
            match found.map(|picture| picture.figures) {
                Some(Figures::Of(_)) => followed += 1,
                other => panic!("{}: {name}: {other:?}", path.display()),
            }
        }
    }
    assert!(followed >= 42, "{followed} drawings");
}
