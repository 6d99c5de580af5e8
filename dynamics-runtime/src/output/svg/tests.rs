use alloc::vec;

use proptest::prelude::*;

use super::super::chart::{Axis, Mark, Panel, Series};
use super::super::xml_check;
use super::*;

fn assert_sound(svg: &str) {
    xml_check::assert_well_formed(svg);
    for bad in ["NaN", "inf", "e-", "e1", "e2", "e3"] {
        for part in svg.split('"').skip(1).step_by(2) {
            assert!(
                !(part.contains(bad) && part.starts_with(|c: char| c.is_ascii_digit() || c == '-')),
                "attribute `{part}` holds `{bad}`"
            );
        }
    }
}

fn chart_of(points: Vec<(f64, f64)>, x: Axis, y: Axis) -> String {
    Chart::from(Panel::new(x, y).line("values", points)).to_svg()
}

#[test]
fn a_small_chart_has_its_parts() {
    let svg = Chart::new("A & B")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("angle in rad"))
                .line("theta<1>", [(0.0, 0.0), (1.0, 2.0)])
                .curve("theta2", [(0.0, 1.0), (1.0, 1.0)]),
        )
        .to_svg();
    assert_sound(&svg);
    assert!(svg.contains("A &amp; B"));
    assert!(svg.contains("theta&lt;1&gt;") && svg.contains("theta2"), "a legend");
    assert!(svg.contains("time in s") && svg.contains("angle in rad"));
    assert_eq!(svg.matches("<polyline").count(), 2 + 2, "two curves, two samples in the legend");
    assert_eq!(svg.matches("stroke-dasharray").count(), 2, "the second curve is dashed, here and in the legend");
}

#[test]
fn a_line_goes_where_its_values_are() {
    let svg = chart_of(vec![(0.0, 0.0), (10.0, 5.0)], Axis::new("x").range(0.0, 10.0), Axis::new("y").range(0.0, 5.0));
    let plot = svg.split("<svg x=\"").nth(1).unwrap();
    let attribute = |name: &str| plot.split(name).nth(1).unwrap().split('"').next().unwrap();
    let (width, height) = (attribute("width=\""), attribute("height=\""));
    assert_eq!(attribute("points=\""), format!("0,{height} {width},0"));
}

#[test]
fn hard_data_give_sound_pictures() {
    let axes = || [(Axis::new("x"), Axis::new("y")), (Axis::log("x"), Axis::log("y"))];
    let hard = [
        vec![],
        vec![(1.0, 1.0)],
        vec![(f64::NAN, 1.0), (1.0, f64::INFINITY)],
        vec![(0.0, 3.0), (1.0, 3.0), (2.0, 3.0)],
        vec![(1e-300, 1e-300), (1e300, 1e300)],
        vec![(-f64::MAX, f64::MAX), (f64::MAX, -f64::MAX)],
        vec![(0.0, 5e-324), (1.0, 0.0)],
        vec![(0.0, 1e9), (1.0, 1e9 + 1e-6)],
        vec![(-1.0, 1.0), (0.0, 0.0), (1.0, -1.0)],
    ];
    for points in hard {
        for (x, y) in axes() {
            assert_sound(&chart_of(points.clone(), x, y));
        }
    }
    assert_sound(&Chart::new("").to_svg());
    assert_sound(&chart_of(
        vec![(0.0, 1e308), (1.0, -1e308)],
        Axis::new("x").range(0.0, 1e-300),
        Axis::new("y").range(1.0, 1.0),
    ));
}

#[test]
fn instants_are_upright_lines_with_one_name() {
    let svg = Chart::from(
        Panel::new(Axis::new("t"), Axis::new("x"))
            .line("x", [(0.0, 0.0), (4.0, 1.0)])
            .instants("impact", [1.0, 2.0, 2.0 + 1e-9, 9.0, f64::NAN])
            .instants("never", []),
    )
    .to_svg();
    assert_sound(&svg);
    assert_eq!((svg.matches(">impact<").count(), svg.matches(">never<").count()), (1, 0));
    let path = svg.split("<path d=\"").find(|path| path.contains(",0V380")).unwrap();
    assert_eq!(path.split('"').next().unwrap().matches('M').count(), 2, "{path}");
}

#[test]
fn a_crowd_of_instants_stays_at_the_edge() {
    let panel = Panel::new(Axis::new("t"), Axis::new("x")).line("x", [(0.0, 0.0), (100.0, 1.0)]);
    let marked = |count: u32| Chart::from(panel.clone().instants("tick", (0..count).map(f64::from))).to_svg();
    assert!(marked(20).contains(",0V380") && !marked(20).contains(",0V7"));
    assert!(marked(90).contains(",0V7") && !marked(90).contains(",0V380"));
}

#[test]
fn dashes_are_for_curves_that_can_be_followed() {
    let wave = |cycles: f64| (0..2000).map(move |k| (f64::from(k), (f64::from(k) * cycles * 0.00314).sin()));
    let svg = |cycles: f64| {
        let panel = Panel::new(Axis::new("t"), Axis::new("x")).line("a", wave(1.0)).line("b", wave(cycles));
        Chart::from(panel).to_svg()
    };
    assert_eq!(svg(2.0).matches("stroke-dasharray").count(), 2, "curve and legend");
    assert_eq!(svg(100.0).matches("stroke-dasharray").count(), 0);
}

#[test]
fn an_axis_has_more_than_one_label() {
    for height in [80.0, 100.0, 160.0, 190.0] {
        for hi in [1.0, 1.3, 1.9, 2.4, 3.3, 4.9, 7.0, 9.9] {
            let axis = Axis::new("y").range(-0.45 * hi, 0.55 * hi);
            let chart = Chart::from(Panel::new(Axis::new("x"), axis)).panel_height(height);
            let svg = chart.to_svg();
            let labels = svg.split("<g text-anchor=\"end\"").nth(1).unwrap().split("</g>").next().unwrap();
            assert!(labels.matches("<text").count() > 1, "{height} {hi}");
        }
    }
}

#[test]
fn values_that_cannot_be_shown_are_counted() {
    let svg = chart_of(vec![(1.0, -1.0), (2.0, 0.0), (3.0, 4.0), (4.0, f64::NAN)], Axis::log("x"), Axis::log("y"));
    assert!(svg.contains("2 points are not positive"), "{svg}");
    assert!(svg.contains("1 point is not finite"), "{svg}");
}

#[test]
fn a_gap_parts_the_line() {
    let svg = chart_of(
        vec![(0.0, 0.0), (1.0, 1.0), (2.0, f64::NAN), (3.0, 1.0), (4.0, 0.0), (5.0, f64::NAN), (6.0, 0.5)],
        Axis::new("x"),
        Axis::new("values"),
    );
    assert_eq!(svg.matches("<polyline").count(), 2);
    assert_eq!(svg.matches("<circle").count(), 1, "a point by itself is a dot");
}

#[test]
fn many_points_make_a_short_file() {
    let points = (0..400_000).map(|k| (f64::from(k), (f64::from(k) * 0.3).sin()));
    let svg = Chart::from(Panel::new(Axis::new("x"), Axis::new("y")).series(Series::new("s", points))).to_svg();
    assert!(svg.len() < 60_000, "{}", svg.len());
}

#[test]
fn one_series_named_by_its_axis_needs_no_legend() {
    let svg = Chart::from(Panel::new(Axis::new("time"), Axis::new("energy")).line("energy", [(0.0, 0.0), (1.0, 1.0)]))
        .to_svg();
    assert_eq!(svg.matches(">energy<").count(), 1);
}

proptest! {
    #[test]
    fn any_numbers_give_sound_pictures(
        points in prop::collection::vec((prop::num::f64::ANY, prop::num::f64::ANY), 0..40),
        near in prop::collection::vec((-1.0..1.0f64, -1e-9..1e-9f64), 0..40),
        (middle, power) in (-9.0..9.0f64, -320i32..308),
        (log_x, log_y, equal) in any::<(bool, bool, bool)>(),
        range in prop::option::of((prop::num::f64::ANY, prop::num::f64::ANY)),
        mark in prop::sample::select(vec![Mark::Line, Mark::Points, Mark::LineAndPoints]),
    ) {
        let axis = |log: bool, title: &str| if log { Axis::log(title) } else { Axis::new(title) };
        let scale = 10f64.powi(power);
        let mut y = axis(log_y, "y");
        if let Some((lo, hi)) = range {
            y = y.range(lo, hi);
        }
        let far = Series::new("far", points).mark(mark);
        let near = Series::new("near", near.into_iter().map(|(x, y)| ((middle + x) * scale, (middle + y) * scale))).mark(mark);
        for series in [vec![far.clone()], vec![near.clone()], vec![far, near]] {
            let panel = series.into_iter().fold(Panel::new(axis(log_x, "x"), y.clone()), Panel::series);
            let panel = if equal { panel.equal_axes() } else { panel };
            let svg = Chart::from(panel).to_svg();
            assert_sound(&svg);
            prop_assert!(svg.len() < 100_000);
        }
    }

    #[test]
    fn names_of_any_kind_stay_text(title in any::<String>(), name in "[<>&\"']{0,60}", wide in "[mW漢]{0,200}") {
        let panel = Panel::new(Axis::new(&name), Axis::new(&wide)).line(&title, [(0.0, 1.0)]).line(&wide, [(0.0, 1.0)]);
        xml_check::assert_well_formed(&Chart::new(&title).panel(panel.instants(name, [0.0])).to_svg());
    }
}
