use proptest::array::uniform5;
use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::{Value, json};

use super::*;
use crate::point::tests::Body;

#[test]
fn differences_add_up_and_gaps_are_null() {
    let values = [Some(5), Some(7), None, Some(4), Some(4)];
    assert_eq!(differences(values.into_iter()), "[5,2,null,-3,0]");
    assert_eq!(differences([].into_iter()), "[]");
}

#[test]
fn what_stands_still_and_what_is_equal_is_written_once() {
    let mut reel = Reel::new(Color::Ink);
    for k in 0..4 {
        let x = f64::from(k);
        reel.push(&Drawing::new().line([0.0, 0.0], [x, 1.0]).disc([x, 1.0], 0.5));
    }
    let json = reel.to_json(&reel.bounds.grid(reel.spatial));
    // The bounds are −0.5 … 3.5 by 0 … 1.5: 20,000 parts of 4, counted from (1.5, 0.75).
    assert!(json.contains("\"columns\":[-7500,-3750,[-7500,5000,5000,5000],1250,2500]"), "{json}");
    assert!(json.contains("\"places\":[0,1,2,3,2,3,4]"), "{json}");
    assert!(!json.contains("order"));
}

#[test]
fn a_change_of_figures_begins_a_scene_and_the_old_one_is_found_again() {
    let mut reel = Reel::new(Color::Ink);
    let one = Drawing::new().dot([0.0, 0.0]);
    let two = one.clone().dot([1.0, 0.0]);
    for drawing in [&one, &two, &one] {
        reel.push(drawing);
    }
    let json = reel.to_json(&reel.bounds.grid(reel.spatial));
    assert!(json.ends_with("\"order\":[0,1,0]}"), "{json}");
    assert_eq!(json.matches("figures").count(), 2);
}

#[test]
fn what_is_not_finite_is_null_and_does_not_spoil_the_view() {
    let mut reel = Reel::new(Color::Ink);
    for x in [0.0, f64::NAN, f64::NAN, f64::INFINITY, 1e200, 2.0] {
        reel.push(&Drawing::new().disc([x, 0.0], 1.0));
    }
    let grid = reel.bounds.grid(reel.spatial);
    assert_eq!((grid.origin[0], grid.origin[2]), (1.0, 0.0));
    let json = reel.to_json(&grid);
    assert!(json.contains("[-5000,null,null,null,null,10000]"), "{json}");
}

/// Points on the surface of every figure, at every instant of a tumbling motion, against the view.
#[test]
fn the_view_holds_all_of_every_figure_at_every_instant() {
    let mut reel = Reel::new(Color::Ink);
    let mut surface: Vec<[f64; 3]> = Vec::new();
    for k in 0..60 {
        let s = 0.1 * f64::from(k);
        let body = Body { origin: [s, -s, 0.3 * s], about_x: 0.7 * s, about_z: s };
        let (foot, tip) = (body.place([0.0, 0.0, -1.0]), body.place([0.0, 0.0, 2.0]));
        // The tip first: what is wide may stand at either end.
        reel.push(
            &Drawing::new()
                .cuboid(body, [0.5, 0.0, 0.0], [1.0, 4.0, 0.2])
                .cone(tip, foot, 0.0)
                .cone(foot, tip, 1.5)
                .disc(foot, 0.4),
        );
        for corner in 0..8 {
            let side = |axis: u32, half: f64| if corner >> axis & 1 == 1 { half } else { -half };
            surface.push(body.place([0.5 + side(0, 0.5), side(1, 2.0), side(2, 0.1)]));
        }
        for around in 0..32 {
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * f64::from(around) / 32.0);
            surface.push(body.place([1.5 * cos, 1.5 * sin, -1.0]));
        }
        surface.extend([0, 1, 2].map(|axis| {
            let mut place = foot;
            place[axis] += 0.4;
            place
        }));
    }
    let grid = reel.bounds.grid(reel.spatial);
    for place in surface {
        for axis in 0..3 {
            let from_middle = (place[axis] - grid.origin[axis]).abs();
            assert!(
                from_middle <= (grid.half[axis] as f64 + 1.0) * grid.quantum,
                "{place:?} leaves {grid:?}"
            );
        }
    }
    // And it is no larger than that by much: a flat wheel is not a ball.
    let mut wheel = Reel::new(Color::Ink);
    wheel.push(&Drawing::new().cylinder([0.0, -0.01, 0.0], [0.0, 0.01, 0.0], 1.0));
    let grid = wheel.bounds.grid(true);
    assert_eq!(grid.half, [10_000, 100, 10_000]);
}

#[test]
fn any_bounds_have_a_grid() {
    for points in [&[][..], &[[3.0, 4.0]], &[[1e149, 0.0], [-1e149, 0.0]], &[[0.0, 0.0], [1e-300, 0.0]]] {
        for (spatial, depth) in [(false, 0.0), (true, 0.0), (true, 2.0)] {
            let mut bounds = Bounds::EMPTY;
            for [x, up] in points {
                bounds.include([*x, depth, *up], [0.0; 3]);
            }
            let grid = bounds.grid(spatial);
            assert!(grid.quantum > 0.0 && grid.quantum.is_finite());
            assert!(grid.half.iter().all(|half| (0..=10_001).contains(half)), "{grid:?}");
        }
    }
}

proptest! {
    #[test]
    fn any_picture_can_be_read_back(
        pictures in vec(vec(uniform5(prop::num::f64::ANY), 0..4), 0..6),
    ) {
        let mut reel = Reel::new(Color::Ink);
        for picture in &pictures {
            let figures = picture.iter().fold(Drawing::new(), |drawing, [a, b, c, d, e]| {
                drawing
                    .width(*e)
                    .spring([*a, *b], [*c, *d, *e])
                    .disc([*a, *b], *c)
                    .tail("tail", [*d, *e], *a)
                    .arc([*a, *b], *c, *d, *e)
            });
            reel.push(&figures);
        }
        let grid = reel.bounds.grid(reel.spatial);
        prop_assert!(grid.quantum > 0.0 && grid.half.iter().any(|half| *half >= 9_999));
        let json: Value = serde_json::from_str(&reel.to_json(&grid)).unwrap();
        let instants: usize = reel.scenes.iter().map(|scene| scene.instants).sum();
        prop_assert_eq!(instants, pictures.len());
        for (scene, read) in reel.scenes.iter().zip(json["scenes"].as_array().unwrap()) {
            let axes = grid.axes().count();
            let numbers: usize = scene.figures.len() / 4 * (5 * axes + 1 + 3);
            prop_assert_eq!(read["places"].as_array().unwrap().len(), numbers);
        }
    }
}

#[test]
fn space_and_dashes_are_told_to_the_page() {
    let mut reel = Reel::new(Color::Ink);
    reel.push(&Drawing::new().dot([0.0, 0.0, 1.0]).dot([1.0, 1.0]));
    reel.push(&Drawing::new().dashed().fill(Color::Red).circle([0.0, 0.0], 1.0));
    assert!(reel.spatial);
    let json = reel.to_json(&reel.bounds.grid(reel.spatial));
    let json: Value = serde_json::from_str(&json).unwrap();
    let figure = &json["scenes"][1]["figures"][0];
    assert_eq!([&figure["d"], &figure["f"], &figure["c"]], [&json!(1), &json!("red"), &json!("ink")]);
}

#[test]
fn words_that_change_are_a_column() {
    let mut reel = Reel::new(Color::Ink);
    for k in 0..2 {
        reel.push(&Drawing::new().text([0.0, 0.0], format!("<{k}>")).label([0.0, 0.0], "still"));
    }
    let json = reel.to_json(&reel.bounds.grid(reel.spatial));
    assert!(json.contains(r#""words":[["\u003c0\u003e","\u003c1\u003e"],"still"]"#), "{json}");
}
