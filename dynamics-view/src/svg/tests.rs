use alloc::vec;

use proptest::prelude::*;

use super::*;
use crate::chart::{Axis, Mark, Panel, Series};

fn assert_sound(svg: &str) {
    roxmltree::Document::parse(svg).unwrap();
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
    // Readers that know no page take sizes from styles, and a height of `auto` for none.
    assert!(
        !svg.contains("style=")
            && svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"760\" height=\"")
    );
    assert!(svg.contains("A &amp; B"));
    assert!(svg.contains("theta&lt;1&gt;") && svg.contains("theta2"), "a legend");
    assert!(svg.contains("time in s") && svg.contains("angle in rad"));
    assert_eq!(svg.matches("<polyline").count(), 2 + 2, "two curves, two samples in the legend");
    assert_eq!(
        svg.matches("stroke-dasharray").count(),
        2,
        "the second curve is dashed, here and in the legend"
    );
}

#[test]
fn a_line_goes_where_its_values_are() {
    let svg = chart_of(
        vec![(0.0, 0.0), (10.0, 5.0)],
        Axis::new("x").range(0.0, 10.0),
        Axis::new("y").range(0.0, 5.0),
    );
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
    let svg =
        chart_of(vec![(1.0, -1.0), (2.0, 0.0), (3.0, 4.0), (4.0, f64::NAN)], Axis::log("x"), Axis::log("y"));
    assert!(svg.contains("2 points are not positive"), "{svg}");
    assert!(svg.contains("1 point is not finite"), "{svg}");
}

#[test]
fn a_range_that_cannot_be_shown_is_reported() {
    let svg = |axis: Axis| chart_of(vec![(1.0, 1.0)], Axis::new("x"), axis);
    for axis in
        [Axis::new("y").range(2.0, 2.0), Axis::log("y").range(0.0, 1.0), Axis::new("y").range(0.0, f64::NAN)]
    {
        assert!(svg(axis).contains("the axis cannot go from"));
    }
    assert!(!svg(Axis::log("y").range(0.5, 2.0)).contains("the axis cannot"));
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
    let svg =
        Chart::from(Panel::new(Axis::new("x"), Axis::new("y")).series(Series::new("s", points))).to_svg();
    assert!(svg.len() < 60_000, "{}", svg.len());
}

#[test]
fn one_series_named_by_its_axis_needs_no_legend() {
    let svg = Chart::from(
        Panel::new(Axis::new("time"), Axis::new("energy")).line("energy", [(0.0, 0.0), (1.0, 1.0)]),
    )
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
        mark in prop::sample::select(vec![Mark::Line, Mark::Points, Mark::LineAndPoints, Mark::Dots]),
    ) {
        let axis = |log: bool, title: &str| if log { Axis::log(title) } else { Axis::new(title) };
        let scale = 10f64.powi(power);
        let mut y = axis(log_y, "y");
        if let Some((lo, hi)) = range {
            y = y.range(lo, hi);
        }
        let far = Series::new("far", points).mark(mark);
        let near = near.into_iter().map(|(x, y)| ((middle + x) * scale, (middle + y) * scale));
        let near = Series::new("near", near).mark(mark);
        for series in [vec![far.clone()], vec![near.clone()], vec![far, near]] {
            let panel = series.into_iter().fold(Panel::new(axis(log_x, "x"), y.clone()), Panel::series);
            let panel = if equal { panel.equal_axes() } else { panel };
            let svg = Chart::from(panel).to_svg();
            assert_sound(&svg);
            prop_assert!(svg.len() < 100_000);
        }
    }

    #[test]
    fn labels_of_x_keep_apart(
        (middle, power) in (-9.99..9.99f64, -200i32..200),
        spread in 0.0..9.0f64,
        width in 320.0..900.0f64,
        log in any::<bool>(),
    ) {
        let middle = middle * 10f64.powi(power);
        let half = middle.abs() * 10f64.powf(-spread);
        let axis = if log {
            Axis::log("x").range(middle.abs(), middle.abs() * 10f64.powf(10f64.powf(2.0 - spread)))
        } else {
            Axis::new("x").range(middle - half, middle + half)
        };
        let panel = Panel::new(axis, Axis::new("y")).line("y", [(1.0, 0.0), (2.0, 1.0)]);
        let svg = Chart::from(panel).width(width).to_svg();
        let labels = svg.split("<g text-anchor=\"middle\"").nth(1).unwrap().split("</g>").next().unwrap();
        let texts = boxes(&svg);
        let texts: Vec<_> = texts.iter().filter(|(_, text)| labels.contains(&format!(">{text}<"))).collect();
        for pair in texts.windows(2).filter(|pair| pair[0].0[2] == pair[1].0[2]) {
            prop_assert!(pair[0].0[1] + 4.0 < pair[1].0[0], "{pair:?}");
        }
    }

    #[test]
    fn names_of_any_kind_stay_text(
        title in any::<String>(),
        name in "[<>&\"']{0,60}",
        wide in "[mW漢]{0,200}",
    ) {
        let panel = Panel::new(Axis::new(&name), Axis::new(&wide));
        let panel = panel.line(&title, [(0.0, 1.0)]).line(&wide, [(0.0, 1.0)]);
        let svg = Chart::new(&title).panel(panel.instants(name, [0.0])).to_svg();
        roxmltree::Document::parse(&svg).unwrap();
    }
}

/// The attribute of a tag, which is given without its brackets.
fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    let (_, value) = tag.split_once(&format!(" {name}=\"")).unwrap_or_else(|| panic!("no `{name}` in {tag}"));
    value.split('"').next().unwrap()
}

/// Left, right, upper and lower edge of every level text that is anchored by its own tag or by its group.
fn boxes(svg: &str) -> Vec<([f64; 4], &str)> {
    let mut anchor = "start";
    let mut boxes = Vec::new();
    for piece in svg.split('<').skip(1) {
        let (tag, content) = piece.split_once('>').unwrap();
        if tag.starts_with("g ") {
            anchor = attribute(tag, "text-anchor");
        } else if tag.starts_with("/g") {
            anchor = "start";
        } else if tag.starts_with("text") && !tag.contains("transform") {
            let own = if tag.contains("text-anchor") { attribute(tag, "text-anchor") } else { anchor };
            let size = if tag.contains("font-size") {
                attribute(tag, "font-size").parse().unwrap()
            } else {
                FONT_SIZE
            };
            let place = |name: &str| attribute(tag, name).parse::<f64>().unwrap();
            // Real glyphs are narrower than the layout's careful measure.
            let width = 0.93 * measure::width(content, size);
            let left = place("x")
                - width
                    * match own {
                        "start" => 0.0,
                        "middle" => 0.5,
                        _ => 1.0,
                    };
            boxes.push(([left, left + width, place("y") - 0.75 * size, place("y") + 0.2 * size], content));
        }
    }
    boxes
}

#[test]
fn no_text_covers_another_or_leaves_the_page() {
    let waves = |count: usize| {
        (0..count).map(|k| Series::new(format!("angle of link number {k}"), [(0.0, k as f64), (1.0, 0.0)]))
    };
    for (width, scale, height) in
        [(760.0, 1.0, 190.0), (320.0, 1.234_567_8e-5, 80.0), (500.0, 123_456.7, 120.0), (320.0, 1e7, 400.0)]
    {
        for (x_log, y_log) in [(false, false), (true, true)] {
            let axis = |log: bool, title: &str| if log { Axis::log(title) } else { Axis::new(title) };
            let points =
                [(1.0 * scale, -3.0 * scale), (7.7 * scale, 9.0 * scale), (0.2 * scale, 2e6 * scale)];
            let crowd =
                waves(9).fold(Panel::new(Axis::new("time in s"), Axis::new("angles in rad")), Panel::series);
            let one = Panel::new(
                axis(x_log, "a title that is longer than there is room for in a chart as narrow as this one"),
                axis(y_log, "y"),
            )
            .curve("measured", points)
            .instants("switched", [2.0 * scale]);
            let svg = Chart::new(
                "A title that is rather long, so long that it has to be cut somewhere in the narrow ones",
            )
            .panel(one)
            .panel(crowd)
            .width(width)
            .panel_height(height)
            .to_svg();
            assert_sound(&svg);
            let boxes = boxes(&svg);
            assert!(boxes.len() > 15, "{boxes:?}");
            for upright in svg.split("translate(").skip(1) {
                let x: f64 = upright.split(',').next().unwrap().parse().unwrap();
                let left_of_it =
                    boxes.iter().filter(|(edges, _)| edges[0] < x + 0.2 * FONT_SIZE && edges[3] > 45.0);
                assert_eq!(left_of_it.count(), 0, "the title of y at {x} is covered");
            }
            for (k, (a, text)) in boxes.iter().enumerate() {
                assert!(a[0] >= 0.0 && a[1] <= width, "`{text}` leaves the page of {width}: {a:?}");
                for (b, other) in &boxes[..k] {
                    let apart = a[1] <= b[0] || b[1] <= a[0] || a[3] <= b[2] || b[3] <= a[2];
                    assert!(apart, "`{text}` covers `{other}`: {a:?} {b:?}");
                }
            }
        }
    }
}

#[test]
fn what_has_no_place_is_not_drawn_and_curves_differ() {
    let panel = Panel::new(Axis::new("x"), Axis::log("y"));
    let svg = Chart::from(panel.points("a", [(1.0, -1.0), (2.0, 0.0), (3.0, 4.0)]).points("b", [(1.0, 1.0)]))
        .to_svg();
    assert_eq!(svg.matches("<circle").count(), 1 + 1, "one point and its legend");
    let colors: Vec<_> = svg.split("<circle").chain(svg.split("<polygon")).skip(1).collect();
    assert_ne!(attribute(colors[0], "fill"), attribute(svg.split("<polygon").nth(1).unwrap(), "fill"));
}
