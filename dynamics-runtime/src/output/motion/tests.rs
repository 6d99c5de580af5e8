use alloc::vec;

use nalgebra::{SMatrix, SVector};

use super::*;
use crate::error::{SingularMassMatrix, SolveError};
use crate::expr::Expr;
use crate::model::{ActiveSet, Described, Dynamics, Events, Model, Outputs, Powers, Quantity, UnitDimension};

/// x = cos t and y = sin t: two masses on springs, one of which has no unit.
struct Springs;

#[derive(Clone, Copy, Debug, PartialEq)]
struct SpringsState {
    t: f64,
    q: SVector<f64, 2>,
    u: SVector<f64, 2>,
    inputs: SVector<f64, 0>,
    active_set: ActiveSet,
}

impl ModelState for SpringsState {
    type Vector = SVector<f64, 2>;
    type Inputs = SVector<f64, 0>;
    fn new(t: f64, q: Self::Vector, u: Self::Vector, inputs: Self::Inputs) -> Self {
        Self { t, q, u, inputs, active_set: ActiveSet::default() }
    }
    fn t(&self) -> f64 {
        self.t
    }
    fn q(&self) -> &Self::Vector {
        &self.q
    }
    fn u(&self) -> &Self::Vector {
        &self.u
    }
    fn inputs(&self) -> &Self::Inputs {
        &self.inputs
    }
    fn q_mut(&mut self) -> &mut Self::Vector {
        &mut self.q
    }
    fn u_mut(&mut self) -> &mut Self::Vector {
        &mut self.u
    }
    fn inputs_mut(&mut self) -> &mut Self::Inputs {
        &mut self.inputs
    }
    fn active_set(&self) -> ActiveSet {
        self.active_set
    }
    fn active_set_mut(&mut self) -> &mut ActiveSet {
        &mut self.active_set
    }
}

const fn quantity(name: &'static str, unit: &'static str) -> Quantity {
    Quantity { name, unit, dimension: UnitDimension::Other }
}

impl Described for Springs {
    type Coordinates = [Expr; 2];
    const NAME: &'static str = "Springs";
}

impl Model for Springs {
    type Vector = SVector<f64, 2>;
    type Matrix = SMatrix<f64, 2, 2>;
    type Inputs = SVector<f64, 0>;
    type State = SpringsState;
    fn coordinates_with(state: &SpringsState, a: &Self::Vector, _: &[f64]) -> [Expr; 2] {
        [0, 1].map(|k| Expr::coordinate(state.q[k], state.u[k], a[k]))
    }
}

impl Dynamics for Springs {
    type Constants = ();
    type Series = ();
    const COORDINATES: &'static [Quantity] = &[quantity("x", "m"), quantity("y[0]", "m")];
    const INPUTS: &'static [Quantity] = &[];
    const PARAMETERS: &'static [Quantity] = &[];
    const CONSERVED: &'static [crate::model::ConservedQuantity] = &[];
    fn constants(&self) -> Result<(), SingularMassMatrix> {
        Ok(())
    }
    fn accelerations_with(&self, (): &(), state: &SpringsState) -> Result<Self::Vector, SolveError> {
        Ok(-state.q)
    }
    fn mass_matrix(&self, _: &SpringsState) -> Self::Matrix {
        SMatrix::identity()
    }
    fn generalized_force(&self, state: &SpringsState) -> Self::Vector {
        -state.q
    }
    fn momenta(&self, state: &SpringsState) -> Self::Vector {
        state.u
    }
    fn energy_function(&self, state: &SpringsState) -> f64 {
        0.5 * (state.u.dot(&state.u) + state.q.dot(&state.q))
    }
    fn conserved(&self, _: &SpringsState, _: &mut [f64]) {}
}

impl Powers for Springs {
    const POWERS: &'static [Quantity] = &[];
    fn powers(&self, _: &SpringsState, _: &mut [f64]) {}
}

impl Outputs for Springs {
    const OUTPUTS: &'static [Quantity] = &[quantity("tension, left", "N"), quantity("lead", "m")];
    fn outputs(&self, state: &SpringsState, values: &mut [f64]) -> Result<(), SolveError> {
        values[0] = -state.q[0];
        values[1] = 10.0 * state.q[1];
        Ok(())
    }
}

crate::unconstrained!(Springs, 2);

impl Events for Springs {
    const EVENTS: &'static [Quantity] = &[];
    fn events(&self, _: &SpringsState, _: &mut [f64]) -> Result<(), SolveError> {
        Ok(())
    }
}

impl Draw for Springs {
    fn draw(&self, [x, y]: &[Expr; 2]) -> Drawing {
        Drawing::new().spring([0.0, 0.0], [*x, *y]).disc([*x, *y], 0.1)
    }
}

fn start() -> SpringsState {
    let vector = |a, b| SVector::from([a, b]);
    SpringsState {
        t: 0.0,
        q: vector(1.0, 0.0),
        u: vector(0.0, 1.0),
        inputs: SVector::zeros(),
        active_set: ActiveSet::default(),
    }
}

fn motion(end: f64) -> Motion<'static, Springs> {
    Springs.simulate(start()).until(end).tolerance(1e-11).run().unwrap()
}

fn table(text: &str) -> (Vec<&str>, Vec<Vec<f64>>) {
    let (header, rows) = text.split_once('\n').unwrap();
    let rows =
        rows.lines().map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect();
    // The one quoted name holds a comma.
    let header = header.split(',').collect();
    (header, rows)
}

#[test]
fn the_table_names_its_columns() {
    let text = motion(1.0).csv().to_text().unwrap();
    assert_eq!(
        text.lines().next().unwrap(),
        "t [s],x [m],y[0] [m],x_rate [m/s],y_rate[0] [m/s],x_acceleration [m/s^2],y_acceleration[0] [m/s^2],\
         \"tension, left [N]\",lead [m],energy [J]"
    );
}

#[test]
fn the_table_reads_back_bit_for_bit() {
    let motion = motion(3.0);
    let (_, rows) = table(&motion.csv().to_text().unwrap());
    let states: Vec<_> = motion.steps().collect();
    assert_eq!(rows.len(), states.len());
    for (row, state) in rows.iter().zip(states) {
        let expected = [
            state.t,
            state.q[0],
            state.q[1],
            state.u[0],
            state.u[1],
            -state.q[0],
            -state.q[1],
            -state.q[0],
            10.0 * state.q[1],
            Springs.energy_function(&state),
        ];
        assert_eq!(row.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), expected.map(f64::to_bits));
    }
}

#[test]
fn regular_rows_hold_the_motion_and_its_end() {
    for (end, interval, expected) in [(1.0, 0.1, 11), (-1.0, 0.1, 11), (1.05, 0.1, 11), (1.0, 2.0, 1)] {
        let (_, rows) = table(&motion(end).csv().every(interval).to_text().unwrap());
        assert_eq!(rows.len(), expected, "{end} {interval}");
        for (k, row) in rows.iter().enumerate() {
            let t = k as f64 * interval * end.signum();
            assert!((row[0] - t).abs() < 1e-15 && (row[1] - t.cos()).abs() < 1e-9, "{row:?}");
        }
    }
}

#[test]
fn an_interval_that_gets_nowhere_is_an_error() {
    for interval in [0.0, -0.1, f64::NAN, f64::INFINITY, 1e-20] {
        let error = motion(1.0).csv().every(interval).to_text().unwrap_err();
        assert!(matches!(error, OutputError::Interval { .. }), "{error}");
    }
}

fn well_formed(svg: &str) {
    roxmltree::Document::parse(svg).unwrap();
}

fn first_point(points: &str) -> [f64; 2] {
    let mut numbers = points.split([' ', ',']).map(|x| x.parse().unwrap());
    [numbers.next().unwrap(), numbers.next().unwrap()]
}

#[test]
fn many_curves_are_spread_over_panels() {
    let columns = (0..14).map(|k| Column { name: format!("q[{k}]"), unit: "m".to_string() });
    let rows = [(0.0, vec![0.0; 14]), (1.0, vec![1.0; 14])];
    assert_eq!(panels::<Springs>("q", columns, &rows).len(), 3);
}

#[test]
fn events_are_marked_by_name() {
    let motion = Springs.simulate(start()).until(7.0).tolerance(1e-9);
    let motion = motion.event("x is zero", |s| s.q[0]).event("y is half", |s| s.q[1] - 0.5);
    let motion = motion.event("far", |s| s.q[0] + s.q[1] - 5.0).run().unwrap();
    let svg = motion.energy_chart().to_svg();
    well_formed(&svg);
    assert!(svg.contains(">x is zero<") && svg.contains(">y is half<") && !svg.contains(">far<"));
    // π/2 and 3π/2; π/6, 5π/6 and 13π/6.
    let marks = svg.split("<path d=\"").filter(|path| path.contains(",0V380"));
    let counts: Vec<_> = marks.map(|path| path.split('"').next().unwrap().matches('M').count()).collect();
    assert_eq!((counts, Film::events(&motion).len()), (vec![2, 3], 5));
}

#[test]
fn the_history_has_a_panel_for_each_unit() {
    let svg = motion(10.0).history_chart().to_svg();
    well_formed(&svg);
    for part in [
        "Springs: coordinates and velocities",
        "coordinates in m",
        "velocities in m/s",
        "y_rate[0]",
        ">t in s<",
    ] {
        assert!(svg.contains(part), "{part}");
    }
    let svg = motion(10.0).outputs_chart().to_svg();
    well_formed(&svg);
    // Tension −cos t begins at the lower edge of its axes, lead 10 sin t in the middle.
    let curves: Vec<_> =
        svg.split("<polyline points=\"").skip(1).map(|tag| tag.split('"').next().unwrap()).collect();
    assert_eq!(curves.len(), 2);
    assert!(
        first_point(curves[0])[1] > 150.0 && (first_point(curves[1])[1] - 95.0).abs() < 2.0,
        "{curves:?}"
    );
    assert!(
        svg.contains(">tension, left in N<") && !svg.contains(">tension, left<"),
        "its axis names a single curve"
    );
}

#[test]
fn curves_are_fine_between_large_steps() {
    let states = motion(10.0).fine_states();
    assert!(states.len() >= 9 * MIN_CURVE_POINTS / 10, "{}", states.len());
    assert!(states.windows(2).all(|pair| pair[0].t < pair[1].t));
    let steps: Vec<_> = motion(10.0).steps().map(|state| state.t).collect();
    let longest = steps.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let finest = longest / MIN_CURVE_POINTS.div_ceil(steps.len()) as f64;
    assert!(states.windows(2).all(|pair| pair[1].t - pair[0].t < 1.001 * finest), "even parts");
    for state in states {
        assert!((state.q[0] - state.t.cos()).abs() < 1e-8);
    }
}

#[test]
fn the_phase_portrait_of_a_spring_is_a_circle_and_of_nothing_an_error() {
    let svg = motion(7.0).phase_chart("y[0]").unwrap().to_svg();
    well_formed(&svg);
    assert!(svg.contains("y[0] in m") && svg.contains("y_rate[0] in m/s"));
    // y = sin t begins with y = 0 and ẏ = 1: in the middle, at the upper edge.
    let start = first_point(svg.rsplit("<polygon points=\"").next().unwrap().split('"').next().unwrap());
    let numbers = start.map(|corner| corner + 3.0);
    let curve = first_point(svg.split("<polyline points=\"").last().unwrap().split('"').next().unwrap());
    assert!((0..2).all(|k| (curve[k] - numbers[k]).abs() < 0.2), "{curve:?} {numbers:?}");
    let axes = svg.split("<svg x=").nth(1).unwrap();
    let width: f64 = axes.split("width=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    assert!((numbers[0] - 0.5 * width).abs() < 2.0 && numbers[1] < 40.0, "{numbers:?} of {width}");
    let message = motion(1.0).phase_chart("z").unwrap_err().to_string();
    assert!(message.starts_with("there is no quantity `z`; "), "{message}");
}

#[test]
fn the_energy_chart_shows_the_drift() {
    let svg = motion(10.0).energy_chart().to_svg();
    well_formed(&svg);
    assert!(svg.contains("relative error of the energy") && svg.contains("×10⁻"), "{svg}");
}

#[test]
fn the_page_shows_model_method_and_summary() {
    let motion = motion(10.0);
    let html = motion.animation().plot(["x", "y_rate[0]", "tension, left"]).to_html().unwrap();
    assert!(html.contains("<h1>Springs</h1>"));
    let summary = Film::summary(&motion);
    assert!(summary.lines().all(|line| html.contains(&text::xml(line))));
    assert!(html.contains("\"frames\":601"));
    assert!(html.len() < 60_000, "{}", html.len());
}

#[test]
fn a_motion_of_one_instant_can_be_shown() {
    let motion = motion(0.0);
    for svg in [motion.history_chart(), motion.energy_chart(), motion.outputs_chart()] {
        well_formed(&svg.to_svg());
    }
    assert!(motion.animation().to_html().unwrap().contains("\"frames\":1"));
    assert_eq!(motion.csv().to_text().unwrap().lines().count(), 2);
}

#[cfg(feature = "std")]
#[test]
fn files_are_written_and_errors_name_them() {
    let folder = std::env::temp_dir().join(format!("dynamics-motion-{}", std::process::id()));
    let motion = motion(1.0);
    motion.write_csv(folder.join("run.csv")).unwrap();
    motion.plot(folder.join("charts/q.svg")).unwrap();
    motion.plot_outputs(folder.join("charts/o.svg")).unwrap();
    motion.plot_energy(folder.join("charts/e.svg")).unwrap();
    motion.plot_phase("x", folder.join("charts/p.svg")).unwrap();
    motion.animate(folder.join("run.html")).unwrap();
    for (name, begin) in [("run.csv", "t [s]"), ("charts/p.svg", "<svg"), ("run.html", "<!DOCTYPE html>")] {
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        assert!(text.starts_with(begin), "{name}");
    }
    let message = motion.write_csv(folder.join("charts")).unwrap_err().to_string();
    assert!(message.contains("charts"), "{message}");
    // Another format than the name's is not written.
    let path = |name: &str| folder.join(format!("other/{name}"));
    let refused = [
        (motion.plot(path("q.gif")), "`.svg` or `.png`"),
        (motion.plot_phase("x", path("p.html")), "`.svg` or `.png`"),
        (motion.animate(path("run.gif")), "`.html`"),
        (motion.write_csv(path("run.parquet")), "`.csv`"),
        (motion.history_chart().write_svg(path("q.png")).map_err(OutputError::File), "`Chart::write`"),
    ];
    for (result, remedy) in refused {
        let message = result.unwrap_err().to_string();
        assert!(message.contains(remedy), "{message}");
    }
    match motion.plot(path("q.png")) {
        Ok(()) => assert!(std::fs::read(path("q.png")).unwrap().starts_with(b"\x89PNG")),
        Err(error) => {
            let missing = if cfg!(feature = "png") { "no font" } else { "feature `png`" };
            assert!(error.to_string().contains(missing) && !path("").exists(), "{error}");
        }
    }
    let mut bytes: Vec<u8> = vec![];
    motion.csv().write_to(&mut bytes).unwrap();
    assert_eq!(bytes, std::fs::read(folder.join("run.csv")).unwrap());
    let mut short = [0u8; 10];
    let error = motion.csv().write_to(&mut short[..]).unwrap_err();
    assert!(matches!(error, OutputError::Stream(_)), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}
