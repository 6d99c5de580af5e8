use alloc::format;
use alloc::string::ToString;
use alloc::vec;

use serde_json::{Value, json};

use super::clock::Clock;
use super::*;
use crate::point::tests::Body;
use crate::text::fill;

/// A disc that goes once around while `angle` counts.
struct Wheel {
    name: &'static str,
    span: [f64; 2],
}

const WHEEL: Wheel = Wheel { name: "Wheel", span: [0.0, 10.0] };

impl Film for Wheel {
    fn title(&self) -> String {
        self.name.to_string()
    }
    fn method(&self) -> String {
        "drawn by hand".to_string()
    }
    fn summary(&self) -> String {
        "1 step < 2 steps & more\n".to_string()
    }
    fn span(&self) -> [f64; 2] {
        self.span
    }
    fn quantities(&self) -> Vec<(String, String)> {
        [("angle", "rad"), ("turns", ""), ("bad", "")]
            .map(|(name, unit)| (name.to_string(), unit.to_string()))
            .to_vec()
    }
    fn events(&self) -> Vec<(f64, String)> {
        [(2.5, "bump".to_string())].to_vec()
    }
    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64])) {
        for t in times {
            let (sin, cos) = libm::sincos(*t);
            let drawing = Drawing::new()
                .line([0.0, 0.0], [cos, sin])
                .trace("rim", [cos, sin])
                .disc([cos, sin], 0.1)
                .label([cos, sin], self.name);
            show(&drawing, &[*t, t / 6.0, f64::NAN]);
        }
    }
}

fn read(json: &str) -> Value {
    serde_json::from_str(json).unwrap()
}

fn data(html: &str) -> &str {
    html.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap().trim()
}

#[test]
fn the_page_has_its_parts_and_is_self_contained() {
    let html = Animation::new().add(&WHEEL, "").to_html().unwrap();
    for part in ["<!DOCTYPE html>", "<h1>Wheel</h1>", "drawn by hand", "1 step &lt; 2 steps &amp; more</pre>"]
    {
        assert!(html.contains(part), "{part}");
    }
    for outside in ["http:", "https:", "//cdn", "import ", "fetch(", "{{"] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.contains("default-src 'none'"), "the browser refuses requests, too");
    assert!(data(&html).contains("\"frames\":601,\"speed\":1,"));
    assert!(html.len() < 60_000, "{}", html.len());
}

/// The page and its scripts name the same controls, and every control has a name.
#[test]
fn scripts_find_their_controls() {
    let html = Animation::new().add(&WHEEL, "A").to_html().unwrap();
    for id in
        ["picture", "hint", "scale", "whole", "follow", "play", "sign", "again", "scrub", "time", "speed"]
    {
        assert_eq!(html.matches(&format!(" id=\"{id}\"")).count(), 1, "{id}");
        assert!(html.contains(&format!("$(\"{id}\")")), "{id}");
    }
    for tag in ["<button ", "<input ", "<select ", "<canvas "] {
        for control in html.split(tag).skip(1).map(|rest| rest.split("</").next().unwrap()) {
            assert!(control.contains("aria-label") || control.ends_with(">whole"), "{tag}{control}");
        }
    }
}

#[test]
fn hostile_names_stay_text() {
    let name = "</script><script>alert('{{data}}')</script>";
    let wheel = Wheel { name, ..WHEEL };
    let html = Animation::new().add(&wheel, name).add(&wheel, "<b>").to_html().unwrap();
    assert_eq!(html.matches("<script").count(), 2);
    assert_eq!(html.matches("</script").count(), 2);
    assert!(!html.contains("<b>"));
    assert!(html.contains("alert(&#39;{{data}}&#39;)"));
}

#[test]
fn an_unknown_quantity_is_an_error_that_names_its_neighbour() {
    let error = Animation::new().add(&WHEEL, "").plot(["angl"]).to_html().unwrap_err();
    assert_eq!(error.to_string(), "there is no quantity `angl`; did you mean `angle`?");
}

#[test]
fn a_speed_or_a_number_of_instants_that_make_no_sense_are_errors() {
    for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = Animation::new().add(&WHEEL, "").speed(speed).to_html().unwrap_err();
        assert!(matches!(error, OutputError::Speed { .. }), "{error}");
    }
    let error = Animation::new().add(&WHEEL, "").frames(1).to_html().unwrap_err();
    assert!(error.to_string().contains("allow at least 2"), "{error}");
    assert!(
        Animation::new()
            .add(&WHEEL, "")
            .frames(2)
            .speed(0.5)
            .to_html()
            .unwrap()
            .contains("\"frames\":2,\"speed\":0.5")
    );
}

#[test]
fn curves_are_chosen_by_name_or_by_their_common_unit() {
    let html = |animation: Animation<'_>| animation.to_html().unwrap();
    let page = html(Animation::new().add(&WHEEL, ""));
    assert!(data(&page).contains("\"name\":\"angle\"") && !data(&page).contains("\"turns\""));
    let units = ["m", "m", "m", "m", "m", "s"].map(|unit| ("q".to_string(), unit.to_string()));
    let chosen = |units: &[(String, String)], most| Strip::Automatic.choose(units, most).unwrap().len();
    assert_eq!((chosen(&units, 4), chosen(&units, 1), chosen(&units[3..], 4), chosen(&[], 4)), (4, 1, 2, 0));
    let page = html(Animation::new().add(&WHEEL, "").plot(["turns", "bad"]));
    assert!(data(&page).contains("\"turns\"") && !data(&page).contains("\"name\":\"angle\""));
    let page = html(Animation::new().add(&WHEEL, "").without_plot());
    assert!(data(&page).contains("\"strip\":[]"));
    let page = html(Animation::new().add(&WHEEL, "A").add(&WHEEL, "B"));
    assert!(data(&page).contains("\"angle (A)\"") && data(&page).contains("\"angle (B)\""));
}

#[test]
fn values_that_are_no_numbers_are_null() {
    let html = Animation::new().add(&WHEEL, "").frames(3).plot(["bad"]).to_html().unwrap();
    assert!(data(&html).contains("\"values\":[null,null,null]"));
    assert!(!data(&html).contains("NaN"));
}

#[test]
fn speeds_and_instants() {
    let clock = |span: [f64; 2]| {
        let wheel = Wheel { span, ..WHEEL };
        Clock::of(&Animation::new().add(&wheel, ""))
    };
    let real = clock([1.0, 11.0]);
    assert_eq!((real.frames, real.speed, real.notes.len()), (601, 1.0, 0));
    let long = clock([0.0, 1000.0]);
    assert_eq!((long.frames, long.speed), (3600, 20.0));
    assert_eq!(long.notes, ["played 20 × as fast as real time", "one instant every 0.278 s"]);
    let short = clock([0.0, 0.01]);
    assert_eq!((short.frames, short.speed), (601, 0.001));
    let back = clock([10.0, 0.0]);
    assert_eq!((back.start, back.frames), (10.0, 601));
    assert!((back.step + 10.0 / 600.0).abs() < 1e-15);
    let still = clock([3.0, 3.0]);
    assert_eq!((still.start, still.step, still.frames), (3.0, 0.0, 1));
    for hard in [[0.0, 1e300], [0.0, 1e-300], [-1e300, 1e-300]] {
        let clock = clock(hard);
        assert!(clock.frames >= 2 && clock.speed.is_normal(), "{hard:?} {clock:?}");
        let times = clock.times(hard);
        assert_eq!(times[0], hard[0]);
        assert!((times[clock.frames - 1] - hard[1]).abs() <= 1e-12 * hard[1].abs().max(hard[0].abs()));
        assert!(times.iter().all(|t| t.is_finite()));
    }
}

#[test]
fn a_motion_that_is_over_stays_where_it_ended() {
    let short = Wheel { span: [0.0, 5.0], ..WHEEL };
    let animation = Animation::new().add(&WHEEL, "A").add(&short, "B");
    let clock = Clock::of(&animation);
    let times = clock.times(short.span);
    assert_eq!(times.len(), 601);
    assert_eq!(times[600], 5.0);
    assert_eq!(times[150], 2.5);
}

#[test]
fn a_page_without_motions_is_a_page() {
    let html = Animation::new().to_html().unwrap();
    assert!(html.contains("<h1>No motion</h1>"));
    assert!(data(&html).contains("\"films\":[]"));
}

#[test]
fn templates_are_filled_once() {
    assert_eq!(fill("{{a}}-{{b}}-{{a}}", &[("a", "{{b}}"), ("b", "2")]), "{{b}}-2-{{b}}");
    assert_eq!(fill("{{open", &[]), "");
    let values = vec![("x", "1")];
    assert_eq!(fill("none", &values), "none");
}

/// What the page makes of a column: sums of differences.
fn summed(column: &Value) -> Vec<f64> {
    let mut sum = 0.0;
    let mut add = |difference: &Value| match difference {
        Value::Null => f64::NAN,
        difference => {
            sum += difference.as_f64().unwrap();
            sum
        }
    };
    column.as_array().unwrap().iter().map(&mut add).collect()
}

#[test]
fn the_page_holds_the_motion_to_a_part_of_a_pixel() {
    let html = Animation::new().add(&WHEEL, "<A>").plot(["angle", "bad"]).to_html().unwrap();
    let page = read(data(&html));
    let frames = page["frames"].as_f64().unwrap() as usize;
    let times: Vec<_> = (0..frames)
        .map(|k| page["start"].as_f64().unwrap() + k as f64 * page["step"].as_f64().unwrap())
        .collect();
    assert!((times[frames - 1] - 10.0).abs() < 1e-12);

    let reel = &page["films"][0]["reel"];
    let scene = &reel["scenes"][0];
    let kinds: Vec<_> =
        scene["figures"].as_array().unwrap().iter().map(|figure| figure["k"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["line", "trace", "disc", "text"]);
    // Numbers in order: the line's two points, the trace's, the disc's and its radius, the text's.
    let place = |number: usize| &scene["columns"][scene["places"][number].as_f64().unwrap() as usize];
    let quantum = page["quantum"].as_f64().unwrap();
    let origin = page["origin"].as_array().unwrap();
    let (x, y) = (summed(place(2)), summed(place(3)));
    let ids = scene["places"].as_array().unwrap();
    assert_eq!(ids[2..4], ids[6..8], "rod and disc share their end");
    for (k, t) in times.iter().enumerate() {
        let (sin, cos) = libm::sincos(*t);
        assert!((origin[0].as_f64().unwrap() + quantum * x[k] - cos).abs() < 0.51 * quantum);
        assert!((origin[1].as_f64().unwrap() + quantum * y[k] - sin).abs() < 0.51 * quantum);
    }
    assert!((quantum * place(8).as_f64().unwrap() - 0.1).abs() < 0.51 * quantum);
    assert_eq!(scene["words"][0], "Wheel");

    assert_eq!(page["events"][0], json!([150, "bump"]), "2.5 of 10 s in 600 steps");

    let curves = &page["strip"];
    assert_eq!([&curves[0]["color"], &curves[1]["color"]], ["blue", "red"]);
    assert_eq!(curves[0]["name"], "angle");
    for (value, t) in summed(&curves[0]["values"]).iter().zip(&times) {
        let value = curves[0]["lo"].as_f64().unwrap() + curves[0]["unit_of_values"].as_f64().unwrap() * value;
        assert!((value - t).abs() < 1e-4, "{value} {t}");
    }
    assert!(summed(&curves[1]["values"]).iter().all(|value| value.is_nan()));
}

#[test]
fn data_are_json_whatever_happens() {
    let hostile = Wheel { name: "\"\\</script>\u{2028}\n\u{1}", span: [1e300, -1e300] };
    for animation in [
        Animation::new(),
        Animation::new().add(&hostile, hostile.name).plot(["bad", "turns"]),
        Animation::new().add(&WHEEL, "A").add(&hostile, "B"),
        Animation::new().add(Wheel { span: [2.0, 2.0], ..WHEEL }, ""),
    ] {
        let html = animation.frames(50).to_html().unwrap();
        let page = read(data(&html));
        assert!(page["speed"].as_f64().unwrap() > 0.0);
        assert!(page["half"].as_array().unwrap().iter().any(|half| half.as_f64().unwrap() > 0.0));
    }
}

#[test]
fn motions_in_space_are_seen_from_an_eye() {
    let planar = Animation::new().add(&WHEEL, "").frames(2).to_html().unwrap();
    let page = read(data(&planar));
    assert_eq!((page["origin"].as_array().unwrap().len(), page["half"].as_array().unwrap().len()), (2, 2));
    assert!(planar.contains("const makePlane") && !planar.contains("const makeSpace"));

    let ball = Ball;
    let html = Animation::new().add(&ball, "").frames(3).seen_from(30.0, 90.0).to_html().unwrap();
    assert!(html.contains("const makeSpace") && !html.contains("const makePlane"));
    assert!(html.contains("<p id=\"subtitle\">played"), "a film without a method has no empty place");
    let page = read(data(&html));
    let scene = &page["films"][0]["reel"]["scenes"][0];
    let kinds: Vec<_> =
        scene["figures"].as_array().unwrap().iter().map(|figure| figure["k"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["dot", "disc", "cuboid", "cone"]);
    // A planar point stands in the plane of x and z.
    assert_eq!(scene["places"].as_array().unwrap().len(), 3 + 4 + 12 + 8);
    let still = |number: usize| {
        scene["columns"][scene["places"][number].as_f64().unwrap() as usize].as_f64().unwrap()
    };
    let (origin, quantum) = (page["origin"].as_array().unwrap(), page["quantum"].as_f64().unwrap());
    for (axis, expected) in [2.0, 0.0, 1.0].into_iter().enumerate() {
        assert!((origin[axis].as_f64().unwrap() + quantum * still(axis) - expected).abs() < quantum);
    }
    assert!((quantum * still(25) - 0.2).abs() < quantum && still(26) == 0.0, "radii of a cone");
    let eye: Vec<_> = page["eye"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
    assert!((eye[0] - 30f64.to_radians()).abs() < 1e-12 && (eye[1] - 90f64.to_radians()).abs() < 1e-12);

    for [azimuth, elevation] in [[f64::NAN, 0.0], [0.0, 90.1], [0.0, f64::NAN]] {
        let error = Animation::new().add(&ball, "").seen_from(azimuth, elevation).to_html().unwrap_err();
        assert!(error.to_string().contains("is nowhere"), "{error}");
    }
}

/// A ball that moves through space, past things that stand.
struct Ball;

impl Film for Ball {
    fn title(&self) -> String {
        "Ball".into()
    }
    fn method(&self) -> String {
        String::new()
    }
    fn summary(&self) -> String {
        String::new()
    }
    fn span(&self) -> [f64; 2] {
        [0.0, 1.0]
    }
    fn quantities(&self) -> Vec<(String, String)> {
        Vec::new()
    }
    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64])) {
        for t in times {
            let stands = Drawing::new().dot([2.0, 1.0]).disc([*t, 1.0, -1.0], 0.5);
            let world = Body { origin: [0.0; 3], about_x: 0.0, about_z: 0.0 };
            let solids = stands.cuboid(world, [0.0; 3], [1.0, 2.0, 3.0]);
            show(&solids.cone([0.0; 3], [0.0, 0.0, 1.0], 0.2), &[]);
        }
    }
}
