//! What reports say of waves, beside the numbers of `dispersion`.

use dynamics::prelude::*;

/// Masses with springs between them, and each with a spring to the ground and one across two nodes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.masses])]
#[units(mass: kg, spring: N / m, ground: N / m)]
struct Grounded {
    masses: usize,
    mass: f64,
    spring: f64,
    ground: f64,
}

#[dynamics]
impl Grounded {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.masses).map(|i| 0.5 * self.mass * q.x[i].dt().powi(2)).sum()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.masses - 1).map(|i| 0.5 * self.spring * (q.x[i + 1] - q.x[i]).powi(2)).sum()
    }
    #[potential]
    fn on_the_ground(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.masses).map(|i| 0.5 * self.ground * q.x[i].powi(2)).sum()
    }
}

#[test]
fn springs_to_the_ground_leave_a_band() {
    let report = Grounded::REPORT;
    for line in [
        "omega^2 = (2 spring - 2 spring cos(kappa) + ground)/mass",
        "between ground/mass at kappa = 0 and (4 spring + ground)/mass at kappa = pi",
        "sqrt(4 mass/ground) and sqrt(4 mass/(4 spring + ground)) with leapfrog",
    ] {
        assert!(words(report).contains(line), "{line}\n{report}");
    }
    let model = Grounded { masses: 20, mass: 2.0, spring: 3.0, ground: 0.7 };
    let rest = model.state().build().expect("finite");
    for phase in [0.0, 0.4, 3.0] {
        let own = model.dispersion(&rest, [phase]).expect("waves")[0];
        let exact: f64 = (0.7 + 6.0 - 6.0 * f64::cos(phase)) / 2.0;
        assert!((own.frequency / exact.sqrt() - 1.0).abs() < 1e-13);
        let slope = 3.0 * f64::sin(phase) / 2.0 / exact.sqrt();
        assert!((own.group_velocity - slope).abs() < 1e-13, "{own:?} {slope}");
    }
}

/// A beam that bends, by second differences.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(w: [m; self.nodes])]
#[units(pitch: m, ei: N * m^2, rho: kg / m)]
struct Bending {
    nodes: usize,
    pitch: f64,
    ei: f64,
    rho: f64,
}

#[dynamics]
impl Bending {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.rho * self.pitch * q.w[i].dt().powi(2)).sum()
    }
    #[potential]
    fn bending(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 1..self.nodes - 1 {
            let curvature = (q.w[i - 1] - 2.0 * q.w[i] + q.w[i + 1]) / self.pitch.powi(2);
            sum += 0.5 * self.ei * self.pitch * curvature.powi(2);
        }
        sum
    }
}

/// ω = √(EI/ρ) (2 sin(κ/2)/h)²: waves of bending, whose energy runs twice as fast as their crests.
#[test]
fn waves_of_bending_have_the_fourth_power() {
    let report = Bending::REPORT;
    for line in [
        "omega^2 = 2 ei (3 - 4 cos(kappa) + cos(2 kappa))/(pitch^4 rho)",
        "omega^2 = ei kappa^4/(pitch^4 rho) (1 - kappa^2/6 + ..), an error of order 2",
        "16 ei/(pitch^4 rho) at kappa = pi",
        "0.5 pitch^2 sqrt(rho/ei) with leapfrog",
    ] {
        assert!(words(report).contains(line), "{line}\n{report}");
    }
    let model = Bending { nodes: 40, pitch: 0.5, ei: 3.0, rho: 2.0 };
    let rest = model.state().build().expect("finite");
    for phase in [0.02, 0.3, 2.0] {
        let own = model.dispersion(&rest, [phase]).expect("waves")[0];
        let exact = 1.5f64.sqrt() * ((0.5 * phase).sin() / 0.25).powi(2);
        let slope = exact / (0.5 * phase).tan();
        assert!((own.frequency / exact - 1.0).abs() < 1e-6, "{own:?} {exact}");
        assert!((own.group_velocity / slope - 1.0).abs() < 1e-6, "{own:?} {slope}");
    }
    let slow = model.dispersion(&rest, [0.0]).expect("waves")[0];
    assert_eq!((slow.frequency, slow.group_velocity), (0.0, 0.0));
}

/// Light and heavy masses in turn, two to a cell: an acoustic and an optical branch (Born, von Kármán 1912).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: [m; self.cells], b: [m; self.cells])]
#[units(light: kg, heavy: kg, spring: N / m)]
struct Crystal {
    cells: usize,
    light: f64,
    heavy: f64,
    spring: f64,
}

#[dynamics]
impl Crystal {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.cells {
            sum += 0.5 * (self.light * q.a[i].dt().powi(2) + self.heavy * q.b[i].dt().powi(2));
        }
        sum
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.cells {
            sum += 0.5 * self.spring * (q.b[i] - q.a[i]).powi(2);
        }
        for i in 0..self.cells - 1 {
            sum += 0.5 * self.spring * (q.a[i + 1] - q.b[i]).powi(2);
        }
        sum
    }
}

#[test]
fn a_crystal_of_two_masses_has_two_branches() {
    let report = Crystal::REPORT;
    assert!(words(report).contains("a, b: ") || words(report).contains("omega^4"), "{report}");
    let model = Crystal { cells: 30, light: 1.0, heavy: 3.0, spring: 2.0 };
    let rest = model.state().build().expect("finite");
    for phase in [0.0f64, 0.5, 1.7, 3.1] {
        let [acoustic, optical] = model.dispersion(&rest, [phase]).expect("waves")[..] else { panic!("two") };
        // ω² = k (1/m + 1/M) ∓ k √((1/m + 1/M)² − 4 sin²(κ/2)/(m M)).
        let (sum, root) = (4.0f64 / 3.0, (16.0f64 / 9.0 - 4.0 / 3.0 * (0.5 * phase).sin().powi(2)).sqrt());
        assert!((acoustic.frequency.powi(2) - 2.0 * (sum - root)).abs() < 1e-13, "{phase} {acoustic:?}");
        assert!((optical.frequency.powi(2) - 2.0 * (sum + root)).abs() < 1e-13, "{phase} {optical:?}");
    }
    // Long waves move the mass m + M of a cell against two springs in a row.
    let sound = model.dispersion(&rest, [0.0]).expect("waves")[0].group_velocity;
    assert!((sound - (2.0f64 / 2.0 / 4.0).sqrt()).abs() < 1e-13, "{sound}");
}

/// A chain that hangs: at zero coordinates its weight is not carried.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: [m; self.masses])]
#[units(mass: kg, spring: N / m, g: m / s^2)]
struct Hanging {
    masses: usize,
    mass: f64,
    spring: f64,
    g: f64,
}

#[dynamics]
impl Hanging {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.masses).map(|i| 0.5 * self.mass * q.y[i].dt().powi(2)).sum()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.masses).map(|i| self.mass * self.g * q.y[i]).sum()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let held = 0.5 * self.spring * q.y[0].powi(2);
        held + (1..self.masses).map(|i| 0.5 * self.spring * (q.y[i] - q.y[i - 1]).powi(2)).sum::<Expr>()
    }
}

#[test]
fn what_is_left_out_has_a_reason() {
    let report = Hanging::REPORT;
    let line = "left out: forces on `y` do not vanish where all coordinates are zero";
    assert!(words(report).contains(line), "{report}");
    let model = Hanging { masses: 12, mass: 1.0, spring: 5.0, g: 9.81 };
    let start = model.state().build().expect("finite");
    let hanging = model.equilibrium(&start).expect("hangs").state;
    let own = model.dispersion(&hanging, [0.8]).expect("waves")[0];
    assert!((own.frequency - 2.0 * 5.0f64.sqrt() * 0.4f64.sin()).abs() < 1e-13);
}

/// A report without its line breaks.
fn words(report: &str) -> String {
    report.split_whitespace().collect::<Vec<_>>().join(" ")
}
