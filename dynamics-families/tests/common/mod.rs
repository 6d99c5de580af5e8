//! Models written by hand: what the macro would emit, without haste.

use dynamics_families::generated::sum;
use dynamics_families::model::{
    Described, EnergyParts, Entries, FamilyModel, FamilyState, Field, Length, Multipliers, OutputDeclaration,
    Places, Quantity, SizeError, Sizes, View,
};

/// A state without names.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct State {
    t: f64,
    q: Vec<f64>,
    u: Vec<f64>,
    inputs: Vec<f64>,
    ends: Sizes,
}

impl FamilyState for State {
    fn new(t: f64, q: Vec<f64>, u: Vec<f64>, inputs: Vec<f64>, ends: Sizes) -> Self {
        Self { t, q, u, inputs, ends }
    }
    fn t(&self) -> f64 {
        self.t
    }
    fn q(&self) -> &[f64] {
        &self.q
    }
    fn u(&self) -> &[f64] {
        &self.u
    }
    fn inputs(&self) -> &[f64] {
        &self.inputs
    }
    fn ends(&self) -> &Sizes {
        &self.ends
    }
    fn parts_mut(&mut self) -> (&mut f64, &mut [f64], &mut [f64], &mut [f64]) {
        (&mut self.t, &mut self.q, &mut self.u, &mut self.inputs)
    }
}

/// A state of a model from functions of the index, inputs not set.
pub(crate) fn state<M: FamilyModel<State = State>>(
    model: &M,
    q: impl Fn(usize) -> f64,
    u: impl Fn(usize) -> f64,
) -> State {
    let ends = model.ends().expect("sizes");
    let n = *ends.last().expect("fields");
    State::new(0.0, (0..n).map(q).collect(), (0..n).map(u).collect(), vec![f64::NAN; M::INPUTS.len()], ends)
}

/// Coordinates, which outputs are called with.
pub(crate) struct Jets {
    pub(crate) q: Vec<f64>,
}

impl Jets {
    fn new(state: &State, _: &[f64]) -> Self {
        Self { q: state.q.clone() }
    }
}

/// A bar between a wall and a free end, or a second wall, in linear elements. Lumped: half of the mass of an
/// element at each of its nodes; the free end is half a mass.
#[derive(Clone, Debug)]
pub(crate) struct Bar<const CONSISTENT: bool> {
    pub elements: usize,
    pub length: f64,
    pub ea: f64,
    pub rho: f64,
    pub between_walls: bool,
}

impl<const CONSISTENT: bool> Bar<CONSISTENT> {
    pub(crate) fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    /// Speed of waves.
    pub(crate) fn c(&self) -> f64 {
        (self.ea / self.rho).sqrt()
    }
    pub(crate) fn nodes(&self) -> usize {
        self.elements - usize::from(self.between_walls)
    }
    /// Displacement of a node; 0 at walls.
    fn node(q: &[f64], i: usize) -> f64 {
        if i == 0 { 0.0 } else { q.get(i - 1).copied().unwrap_or(0.0) }
    }
    fn add_element(&self, e: usize, local: [[f64; 2]; 2], add: &mut Entries<'_>) {
        for (a, row) in local.iter().enumerate() {
            for (b, value) in row.iter().enumerate() {
                let (i, j) = (e + a, e + b);
                if i > 0 && j > 0 && i <= self.nodes() && j <= self.nodes() {
                    add(i - 1, j - 1, *value);
                }
            }
        }
    }
}

impl<const CONSISTENT: bool> Described for Bar<CONSISTENT> {
    type Coordinates = Jets;
    const NAME: &'static str = "Bar";
}

impl<const CONSISTENT: bool> FamilyModel for Bar<CONSISTENT> {
    type State = State;
    const FIELDS: &'static [Field] =
        &[Field { name: "s", unit: "m", length: Length::Count { count: "elements", plus: 0 } }];
    const INPUTS: &'static [Quantity] = &[];
    const OUTPUTS: &'static [OutputDeclaration] = &[
        OutputDeclaration { name: "wall", unit: "N", numbered: false },
        OutputDeclaration { name: "normal_force", unit: "N", numbered: true },
    ];
    const CONSERVATIVE: bool = true;
    const VELOCITY_FORCES: bool = false;
    const DIAGONAL: bool = !CONSISTENT;
    const OPERATIONS: usize = 5;
    const REPORT: &'static str = "";
    const EQUATIONS: &'static str = "";

    fn ends(&self) -> Result<Sizes, SizeError> {
        if self.elements < 2 {
            return Err(SizeError::TooFew { count: "elements", value: self.elements, least: 2 });
        }
        Ok(vec![self.nodes()].into())
    }
    fn forces(&self, at: View<'_>, forces: &mut [f64]) {
        let k = self.ea / self.h();
        let free = !self.between_walls;
        for (i, force) in forces.iter_mut().enumerate() {
            let x = at.q[i];
            let right = if free && i + 1 == self.elements { x } else { Self::node(at.q, i + 2) };
            *force = k * (right - x) - k * (x - Self::node(at.q, i));
        }
    }
    fn scaled_forces(&self, at: View<'_>, scale: &[f64], accelerations: &mut [f64]) {
        self.forces(at, accelerations);
        accelerations.iter_mut().zip(scale).for_each(|(a, scale)| *a *= scale);
    }
    fn kick(&self, _: f64, q: &[f64], _: &[f64], scale: &[f64], h: f64, u: &mut [f64]) {
        let k = self.ea / self.h();
        let free = !self.between_walls;
        for (i, u) in u.iter_mut().enumerate() {
            let x = q[i];
            let right = if free && i + 1 == self.elements { x } else { Self::node(q, i + 2) };
            *u += h * (scale[i] * (k * (right - x) - k * (x - Self::node(q, i))));
        }
    }
    fn energies(&self, at: View<'_>) -> EnergyParts {
        let (h, free) = (self.h(), !self.between_walls);
        let last = if free { self.elements } else { self.elements + 1 };
        let ends = |values: &[f64], e: usize| {
            let b = if e + 1 == last && !free { 0.0 } else { Self::node(values, e + 1) };
            (Self::node(values, e), b)
        };
        let kinetic = |e: usize| {
            let (a, b) = ends(at.u, e);
            let form = if CONSISTENT { (a * a + a * b + b * b) / 6.0 } else { (a * a + b * b) / 4.0 };
            self.rho * h * form
        };
        let potential = |e: usize| {
            let (a, b) = ends(at.q, e);
            0.5 * self.ea / h * (b - a) * (b - a)
        };
        EnergyParts { kinetic: sum(0..self.elements, kinetic), potential: sum(0..self.elements, potential) }
    }
    fn mass(&self, add: &mut Entries<'_>) {
        let m = self.rho * self.h();
        let local = if CONSISTENT {
            [[m / 3.0, m / 6.0], [m / 6.0, m / 3.0]]
        } else {
            [[m / 2.0, 0.0], [0.0, m / 2.0]]
        };
        (0..self.elements).for_each(|e| {
            self.add_element(e, local, &mut |i, j, value| {
                if CONSISTENT || i == j {
                    add(i, j, value);
                }
            });
        });
    }
    fn stiffness(&self, _: View<'_>, add: &mut Entries<'_>) {
        let k = self.ea / self.h();
        (0..self.elements).for_each(|e| self.add_element(e, [[k, -k], [-k, k]], add));
    }
    fn damping(&self, _: View<'_>, _: &mut Entries<'_>) {}
    fn coordinates(state: &State, accelerations: &[f64], _: Multipliers) -> Jets {
        Jets::new(state, accelerations)
    }
    fn output(&self, index: usize, q: &Jets) -> Vec<f64> {
        let k = self.ea / self.h();
        match index {
            0 => vec![k * q.q[0]],
            1 => (0..self.nodes()).map(|e| k * (Self::node(&q.q, e + 1) - Self::node(&q.q, e))).collect(),
            _ => Vec::new(),
        }
    }
    fn places(&self, q: &Jets) -> Vec<Places> {
        let place = |i: usize| [self.h() * (i + 1) as f64 + q.q[i], 0.0, 0.0];
        vec![Places { function: "node", points: (0..q.q.len()).map(place).collect(), columns: None }]
    }
}

/// Masses 1 between walls, springs with V(r) = r²/2 + α r³/3: Fermi, Pasta, Ulam and Tsingou 1955.
#[derive(Clone, Debug)]
pub(crate) struct Lattice {
    pub masses: usize,
    pub alpha: f64,
}

impl Lattice {
    fn stretch(q: &[f64], e: usize) -> f64 {
        let right = q.get(e).copied().unwrap_or(0.0);
        if e == 0 { right } else { right - q[e - 1] }
    }
    fn force(&self, q: &[f64], i: usize) -> f64 {
        let pull = |r: f64| r + self.alpha * r * r;
        pull(Self::stretch(q, i + 1)) - pull(Self::stretch(q, i))
    }
}

impl Described for Lattice {
    type Coordinates = Jets;
    const NAME: &'static str = "Lattice";
}

impl FamilyModel for Lattice {
    type State = State;
    const FIELDS: &'static [Field] =
        &[Field { name: "x", unit: "m", length: Length::Count { count: "masses", plus: 0 } }];
    const INPUTS: &'static [Quantity] = &[];
    const OUTPUTS: &'static [OutputDeclaration] = &[];
    const CONSERVATIVE: bool = true;
    const VELOCITY_FORCES: bool = false;
    const DIAGONAL: bool = true;
    const OPERATIONS: usize = 8;
    const REPORT: &'static str = "";
    const EQUATIONS: &'static str = "";

    fn ends(&self) -> Result<Sizes, SizeError> {
        Ok(vec![self.masses].into())
    }
    fn forces(&self, at: View<'_>, forces: &mut [f64]) {
        forces.iter_mut().enumerate().for_each(|(i, force)| *force = self.force(at.q, i));
    }
    fn scaled_forces(&self, at: View<'_>, scale: &[f64], accelerations: &mut [f64]) {
        self.forces(at, accelerations);
        accelerations.iter_mut().zip(scale).for_each(|(a, scale)| *a *= scale);
    }
    fn kick(&self, _: f64, q: &[f64], _: &[f64], scale: &[f64], h: f64, u: &mut [f64]) {
        u.iter_mut().enumerate().for_each(|(i, u)| *u += h * (scale[i] * self.force(q, i)));
    }
    fn energies(&self, at: View<'_>) -> EnergyParts {
        let potential = |e| {
            let r = Self::stretch(at.q, e);
            0.5 * r * r + self.alpha * r * r * r / 3.0
        };
        EnergyParts {
            kinetic: 0.5 * sum(0..self.masses, |i| at.u[i] * at.u[i]),
            potential: sum(0..self.masses + 1, potential),
        }
    }
    fn mass(&self, add: &mut Entries<'_>) {
        (0..self.masses).for_each(|i| add(i, i, 1.0));
    }
    fn stiffness(&self, at: View<'_>, add: &mut Entries<'_>) {
        for e in 0..=self.masses {
            let k = 1.0 + 2.0 * self.alpha * Self::stretch(at.q, e);
            if e > 0 {
                add(e - 1, e - 1, k);
            }
            if e < self.masses {
                add(e, e, k);
            }
            if e > 0 && e < self.masses {
                add(e - 1, e, -k);
                add(e, e - 1, -k);
            }
        }
    }
    fn damping(&self, _: View<'_>, _: &mut Entries<'_>) {}
    fn coordinates(state: &State, accelerations: &[f64], _: Multipliers) -> Jets {
        Jets::new(state, accelerations)
    }
    fn output(&self, _: usize, _: &Jets) -> Vec<f64> {
        Vec::new()
    }
}

/// A string between two pegs, s along it and w across it, whose tension grows as it swings out; damped
/// across, with a force on its middle across.
#[derive(Clone, Debug)]
pub(crate) struct GuitarString {
    pub nodes: usize,
    pub pitch: f64,
    pub ea: f64,
    pub tension: f64,
    pub mass: Vec<f64>,
    pub damping: f64,
}

impl GuitarString {
    pub(crate) fn uniform(nodes: usize) -> Self {
        let pitch = 1.0 / (nodes + 1) as f64;
        Self { nodes, pitch, ea: 50.0, tension: 1.0, mass: vec![pitch; nodes], damping: 0.2 * pitch }
    }
    /// The element's vector, its length and its tension.
    fn element(&self, q: &[f64], e: usize) -> ([f64; 2], f64, f64) {
        let n = self.nodes;
        let at = |i: usize, field: usize| {
            if i == 0 || i == n + 1 { 0.0 } else { q[field * n + i - 1] }
        };
        let d = [self.pitch + at(e + 1, 0) - at(e, 0), at(e + 1, 1) - at(e, 1)];
        let length = d[0].hypot(d[1]);
        (d, length, self.tension + self.ea * (length / self.pitch - 1.0))
    }
}

impl Described for GuitarString {
    type Coordinates = Jets;
    const NAME: &'static str = "GuitarString";
}

impl FamilyModel for GuitarString {
    type State = State;
    const FIELDS: &'static [Field] = &[
        Field { name: "s", unit: "m", length: Length::Count { count: "nodes", plus: 0 } },
        Field { name: "w", unit: "m", length: Length::Count { count: "nodes", plus: 0 } },
    ];
    const INPUTS: &'static [Quantity] = &[Quantity::without_unit("pluck")];
    const OUTPUTS: &'static [OutputDeclaration] =
        &[OutputDeclaration { name: "middle", unit: "m", numbered: false }];
    const CONSERVATIVE: bool = false;
    const VELOCITY_FORCES: bool = true;
    const DIAGONAL: bool = true;
    const OPERATIONS: usize = 20;
    const REPORT: &'static str = "";
    const EQUATIONS: &'static str = "";

    fn ends(&self) -> Result<Sizes, SizeError> {
        if self.mass.len() < self.nodes {
            let last = self.nodes - 1;
            return Err(SizeError::TooShort { parameter: "mass", length: self.mass.len(), last });
        }
        Ok(vec![self.nodes, 2 * self.nodes].into())
    }
    fn forces(&self, at: View<'_>, forces: &mut [f64]) {
        let n = self.nodes;
        for i in 0..n {
            let (left, right) = (self.element(at.q, i), self.element(at.q, i + 1));
            for field in 0..2 {
                let pull = |(d, length, tension): ([f64; 2], f64, f64)| tension * d[field] / length;
                forces[field * n + i] = pull(right) - pull(left);
            }
            forces[n + i] -= self.damping * at.u[n + i];
        }
        forces[n + n / 2] += at.inputs[0];
    }
    fn scaled_forces(&self, at: View<'_>, scale: &[f64], accelerations: &mut [f64]) {
        self.forces(at, accelerations);
        accelerations.iter_mut().zip(scale).for_each(|(a, scale)| *a *= scale);
    }
    fn kick(&self, t: f64, q: &[f64], inputs: &[f64], scale: &[f64], h: f64, u: &mut [f64]) {
        let zeros = vec![0.0; q.len()];
        let mut forces = vec![0.0; q.len()];
        self.forces(View { t, q, u: &zeros, inputs }, &mut forces);
        u.iter_mut().zip(forces.iter().zip(scale)).for_each(|(u, (force, scale))| *u += h * (force * scale));
    }
    fn energies(&self, at: View<'_>) -> EnergyParts {
        let n = self.nodes;
        let potential = |e| {
            let stretch = self.element(at.q, e).1 / self.pitch - 1.0;
            self.pitch * (self.tension * stretch + 0.5 * self.ea * stretch * stretch)
        };
        let kinetic = |i: usize| 0.5 * self.mass[i % n] * at.u[i] * at.u[i];
        EnergyParts { kinetic: sum(0..2 * n, kinetic), potential: sum(0..n + 1, potential) }
    }
    fn mass(&self, add: &mut Entries<'_>) {
        (0..2 * self.nodes).for_each(|i| add(i, i, self.mass[i % self.nodes]));
    }
    fn stiffness(&self, at: View<'_>, add: &mut Entries<'_>) {
        let n = self.nodes;
        for e in 0..n + 1 {
            let (d, length, tension) = self.element(at.q, e);
            let axis = [d[0] / length, d[1] / length];
            for a in 0..2 {
                for b in 0..2 {
                    let along = axis[a] * axis[b];
                    let across = if a == b { 1.0 } else { 0.0 } - along;
                    let k = self.ea / self.pitch * along + tension / length * across;
                    for (i, j, k) in [(e, e, k), (e + 1, e + 1, k), (e, e + 1, -k), (e + 1, e, -k)] {
                        if i > 0 && j > 0 && i <= n && j <= n {
                            add(a * n + i - 1, b * n + j - 1, k);
                        }
                    }
                }
            }
        }
    }
    fn damping(&self, _: View<'_>, add: &mut Entries<'_>) {
        (self.nodes..2 * self.nodes).for_each(|i| add(i, i, self.damping));
    }
    fn coordinates(state: &State, accelerations: &[f64], _: Multipliers) -> Jets {
        Jets::new(state, accelerations)
    }
    fn output(&self, index: usize, q: &Jets) -> Vec<f64> {
        if index == 0 { vec![q.q[self.nodes + self.nodes / 2]] } else { Vec::new() }
    }
    fn places(&self, q: &Jets) -> Vec<Places> {
        let n = self.nodes;
        let place = |i: usize| [self.pitch * (i + 1) as f64 + q.q[i], q.q[n + i], 0.0];
        vec![Places { function: "place", points: (0..n).map(place).collect(), columns: None }]
    }
}

/// A trolley on a rail and a chain of masses 1 and springs k behind it, their places counted from the
/// trolley: M couples the trolley to every mass.
#[derive(Clone, Debug)]
pub(crate) struct Trolley {
    pub(crate) masses: usize,
    pub(crate) trolley: f64,
    pub(crate) k: f64,
}

impl Trolley {
    fn stretch(q: &[f64], e: usize) -> f64 {
        q[e + 1] - if e == 0 { 0.0 } else { q[e] }
    }
}

impl Described for Trolley {
    type Coordinates = Jets;
    const NAME: &'static str = "Trolley";
}

impl FamilyModel for Trolley {
    type State = State;
    const FIELDS: &'static [Field] = &[
        Field { name: "cart", unit: "m", length: Length::One },
        Field { name: "x", unit: "m", length: Length::Count { count: "masses", plus: 0 } },
    ];
    const INPUTS: &'static [Quantity] = &[];
    const OUTPUTS: &'static [OutputDeclaration] = &[];
    const CONSERVATIVE: bool = true;
    const VELOCITY_FORCES: bool = false;
    const DIAGONAL: bool = false;
    const OPERATIONS: usize = 5;
    const REPORT: &'static str = "";
    const EQUATIONS: &'static str = "";

    fn ends(&self) -> Result<Sizes, SizeError> {
        Ok(vec![1, 1 + self.masses].into())
    }
    fn forces(&self, at: View<'_>, forces: &mut [f64]) {
        forces[0] = 0.0;
        for i in 0..self.masses {
            let right = if i + 1 < self.masses { Self::stretch(at.q, i + 1) } else { 0.0 };
            forces[i + 1] = self.k * (right - Self::stretch(at.q, i));
        }
    }
    fn scaled_forces(&self, at: View<'_>, scale: &[f64], accelerations: &mut [f64]) {
        self.forces(at, accelerations);
        accelerations.iter_mut().zip(scale).for_each(|(a, scale)| *a *= scale);
    }
    fn kick(&self, _: f64, _: &[f64], _: &[f64], _: &[f64], _: f64, _: &mut [f64]) {
        unreachable!("M is not diagonal")
    }
    fn energies(&self, at: View<'_>) -> EnergyParts {
        let kinetic = sum(1..self.masses + 1, |i| 0.5 * (at.u[0] + at.u[i]) * (at.u[0] + at.u[i]));
        let potential = sum(0..self.masses, |e| 0.5 * self.k * Self::stretch(at.q, e).powi(2));
        EnergyParts { kinetic: kinetic + 0.5 * self.trolley * at.u[0] * at.u[0], potential }
    }
    fn mass(&self, add: &mut Entries<'_>) {
        add(0, 0, self.trolley);
        for i in 1..=self.masses {
            for (row, column) in [(0, 0), (0, i), (i, 0), (i, i)] {
                add(row, column, 1.0);
            }
        }
    }
    fn stiffness(&self, _: View<'_>, add: &mut Entries<'_>) {
        for e in 0..self.masses {
            add(e + 1, e + 1, self.k);
            if e > 0 {
                add(e, e, self.k);
                add(e, e + 1, -self.k);
                add(e + 1, e, -self.k);
            }
        }
    }
    fn damping(&self, _: View<'_>, _: &mut Entries<'_>) {}
    fn coordinates(state: &State, accelerations: &[f64], _: Multipliers) -> Jets {
        Jets::new(state, accelerations)
    }
    fn output(&self, _: usize, _: &Jets) -> Vec<f64> {
        Vec::new()
    }
}
