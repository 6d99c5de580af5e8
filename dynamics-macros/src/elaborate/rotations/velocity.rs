//! Angular velocities and energies of what turns: the rates of the turns about the axes as the turns before
//! left them.

use std::rc::Rc;

use dynamics_symbolic::graph::Number;
use proc_macro2::Span;
use syn::Ident;

use super::super::Elaborator;
use super::super::calls::Argument;
use super::super::operators::Operator;
use super::super::values::{Scalar, Value};
use super::{Components, RotationParameters, Rows, Turn, key, transpose};
use crate::messages;
use crate::syntax::Role;

impl Elaborator<'_> {
    /// `r.angular_velocity()`, `r.angular_velocity_in_body()`.
    pub(in super::super) fn angular_velocity(
        &mut self,
        m: &Rc<Rows>,
        components: Components,
        name: &Ident,
    ) -> Value {
        let turns = self
            .turns(m)
            .unwrap_or_else(|| Rc::new(vec![Turn { rows: m.clone(), by: RotationParameters::Matrix }]));
        let velocity = match components {
            Components::World => self.in_the_world(&turns, name),
            Components::Body => {
                self.along_the_turns(&turns, name).and_then(|v| self.unmirrored(&turns, v, name))
            }
        };
        velocity.map_or(Value::Poison, |v| Value::Vector(v.to_vec()))
    }

    /// `r.rotational_energy(inertia)`: ½ ω·I ω, in the body's components or, where that is the same, in those
    /// before its last turns. A turn that leaves the inertia as it is adds its rate and nothing else.
    pub(in super::super) fn rotational_energy(
        &mut self,
        m: &Rc<Rows>,
        (inertia, at): Argument,
        name: &Ident,
    ) -> Value {
        let inertia = match inertia {
            Value::Matrix(inertia) => inertia,
            Value::Poison => return Value::Poison,
            other => return self.fail(at, &messages::expected_shape("a `Mat3`", other.shape())),
        };
        self.note_inertia(&inertia, at);
        let turns = self
            .turns(m)
            .unwrap_or_else(|| Rc::new(vec![Turn { rows: m.clone(), by: RotationParameters::Matrix }]));
        let mut needed = turns.len();
        while needed > 0 && self.leaves(&turns[needed - 1], &inertia, name.span()) {
            needed -= 1;
        }
        let Some(mut energy) = self.energy_before(&turns, needed, &inertia, name) else {
            return Value::Poison;
        };
        for turn in turns.iter() {
            if let RotationParameters::Parameters(e) = &turn.by
                && matches!(self.role, Role::Kinetic | Role::Lagrangian)
                && self.have_unit_norm(e)
            {
                let along = self.energy_along(e, &inertia, name);
                match along.and_then(|along| self.sum(Operator::Add, &energy, &along, name.span())) {
                    Some(sum) => energy = sum,
                    None => return Value::Poison,
                }
            }
        }
        energy.into()
    }

    /// Whether a constraint that always holds says that the squares of Euler parameters have the sum 1.
    /// (Constraints are elaborated before energies.)
    pub(in super::super) fn have_unit_norm(&mut self, e: &[Scalar; 4]) -> bool {
        let graph = &mut self.model.graph;
        let mut norm = graph.number(Number::integer(-1));
        for parameter in e {
            let square = graph.mul(parameter.node, parameter.node);
            norm = graph.add(norm, square);
        }
        let held = self.model.constraints.iter().filter(|c| c.is_holonomic() && !c.switched);
        held.flat_map(|c| &c.components).any(|(_, row)| *row == norm)
    }

    /// 2 J (e·ė)², with a third of the trace of the inertia for J: what makes the mass matrix of Euler
    /// parameters regular.
    ///
    /// Rotations do not depend on the length of e: along e there would be no inertia, and pivots would vanish
    /// wherever a parameter does. With the norm constraint, e·ė is zero on every motion. So are the term,
    /// its gradient and its part of the equations of motion, 4 J (e·ë + ė·ė) e, as that is half of Φ̈.
    /// Reactions do not change either (after F. E. Udwadia and A. D. Schutte, J. Appl. Mech. 77 (2010)
    /// 044505).
    fn energy_along(&mut self, e: &[Scalar; 4], inertia: &Rc<Rows>, name: &Ident) -> Option<Scalar> {
        let at = name.span();
        let Value::Vector(rates) = self.time_derivative(Value::Vector(e.to_vec()), name) else { return None };
        let along = self.dot(e, &rates, at)?;
        let square = self.product(&along, &along);
        let trace = self.sum(Operator::Add, &inertia[0][0], &inertia[1][1], at)?;
        let trace = self.sum(Operator::Add, &trace, &inertia[2][2], at)?;
        let factor = self.number(Number::ratio(2, 3));
        let factor = self.product(&factor, &trace);
        Some(self.product(&factor, &square))
    }

    /// ½ ω·I ω in the components before the turns from `first` on.
    fn energy_before(
        &mut self,
        turns: &[Turn],
        first: usize,
        inertia: &Rc<Rows>,
        name: &Ident,
    ) -> Option<Scalar> {
        let at = name.span();
        let before = self.along_the_turns(&turns[..first], name)?;
        let after = self.in_the_world(&turns[first..], name)?;
        let omega = self.added(&before, &after, at)?;
        let momentum = self.turned(inertia, &omega, at)?;
        let double = self.dot(&omega, &momentum, at)?;
        let half = self.number(Number::ratio(1, 2));
        Some(self.product(&half, &double))
    }

    /// Whether R I Rᵀ = I.
    fn leaves(&mut self, turn: &Turn, inertia: &Rc<Rows>, at: Span) -> bool {
        if matches!(turn.by, RotationParameters::Matrix) {
            return false;
        }
        let (r, back) = (Value::Matrix(turn.rows.clone()), Value::matrix(transpose(&turn.rows)));
        let turned = self.arithmetic(Operator::Mul, r, Value::Matrix(inertia.clone()), at);
        match self.arithmetic(Operator::Mul, turned, back, at) {
            Value::Matrix(turned) => key(&turned) == key(inertia),
            _ => false,
        }
    }

    /// In the world: each turn's rate, turned by all turns before it.
    fn in_the_world(&mut self, turns: &[Turn], name: &Ident) -> Option<[Scalar; 3]> {
        let at = name.span();
        let mut sum = self.nothing();
        let mut before: Option<Rc<Rows>> = None;
        for turn in turns {
            let own = self.own(turn, Components::World, name)?;
            let own = match &before {
                Some(before) => self.turned(before, &own, at)?,
                None => own,
            };
            sum = self.added(&sum, &own, at)?;
            let rows = self.proper(turn, at)?;
            before = Some(match before {
                Some(before) => {
                    let (left, right) = (Value::Matrix(before), Value::Matrix(rows));
                    let Value::Matrix(product) = self.arithmetic(Operator::Mul, left, right, at) else {
                        return None;
                    };
                    product
                }
                None => rows,
            });
        }
        Some(sum)
    }

    /// In the body: what there was before each turn, turned back by it, and the turn's own rate.
    fn along_the_turns(&mut self, turns: &[Turn], name: &Ident) -> Option<[Scalar; 3]> {
        let at = name.span();
        let mut sum = self.nothing();
        for (i, turn) in turns.iter().enumerate() {
            let own = self.own(turn, Components::Body, name)?;
            // Nothing is carried through the first.
            let back = if i == 0 { turn.rows.clone() } else { self.proper(turn, at)? };
            let back = self.turned(&Rc::new(transpose(&back)), &sum, at)?;
            sum = self.added(&back, &own, at)?;
        }
        Some(sum)
    }

    /// What carries angular velocities through a turn: det R · R. A matrix of the model's own may be a
    /// mirror, S with S (ω×) Sᵀ = −(Sω)×.
    fn proper(&mut self, turn: &Turn, at: Span) -> Option<Rc<Rows>> {
        let m = &turn.rows;
        if !matches!(turn.by, RotationParameters::Matrix) {
            return Some(m.clone());
        }
        let determinant = self.determinant_of(m, at)?;
        if self.model.graph.is_one(determinant.node) {
            return Some(m.clone());
        }
        Some(Rc::new(m.each_ref().map(|row| row.each_ref().map(|x| self.product(&determinant, x)))))
    }

    /// Rᵀω of what the turns make of Rᵀ Ṙ: the sign of every mirror among them is taken back.
    fn unmirrored(&mut self, turns: &[Turn], mut velocity: [Scalar; 3], name: &Ident) -> Option<[Scalar; 3]> {
        for turn in turns.iter().filter(|turn| matches!(turn.by, RotationParameters::Matrix)) {
            let determinant = self.determinant_of(&turn.rows, name.span())?;
            if !self.model.graph.is_one(determinant.node) {
                velocity = velocity.each_ref().map(|x| self.product(&determinant, x));
            }
        }
        Some(velocity)
    }

    fn determinant_of(&mut self, m: &Rows, at: Span) -> Option<Scalar> {
        let Value::Vector(normal) = self.cross(&m[1], &m[2], at) else { return None };
        self.dot(&m[0], &normal, at)
    }

    /// A turn's own angular velocity, in the components before it or after it.
    fn own(&mut self, turn: &Turn, components: Components, name: &Ident) -> Option<[Scalar; 3]> {
        let at = name.span();
        match &turn.by {
            RotationParameters::Angle { axis, angle } => {
                let Value::Scalar(rate) = self.time_derivative(Value::Scalar(angle.clone()), name) else {
                    return None;
                };
                Some(axis.each_ref().map(|x| self.product(x, &rate)))
            }
            RotationParameters::Parameters(e) => self.of_parameters(e, components, name),
            RotationParameters::Matrix => {
                let Value::Matrix(rates) = self.time_derivative(Value::Matrix(turn.rows.clone()), name)
                else {
                    return None;
                };
                let (m, rates) = match components {
                    Components::World => ((*turn.rows).clone(), (*rates).clone()),
                    Components::Body => (transpose(&turn.rows), transpose(&rates)),
                };
                // The rows of the transpose are columns: Rᵀ Ṙ has the products the other way round.
                let pairs = [(2, 1), (0, 2), (1, 0)];
                let pair =
                    |(i, j): (usize, usize)| if components == Components::World { (i, j) } else { (j, i) };
                let mut elements = pairs.map(pair).into_iter().map(|(i, j)| self.dot(&rates[i], &m[j], at));
                Some([elements.next()??, elements.next()??, elements.next()??])
            }
        }
    }

    /// The angular velocity of a turn by an angle, or of a matrix of numbers, which does not turn.
    pub(in super::super) fn rate_of_angle(&mut self, turn: &Turn, name: &Ident) -> Option<[Scalar; 3]> {
        match &turn.by {
            RotationParameters::Angle { .. } => self.own(turn, Components::Body, name),
            RotationParameters::Matrix
                if turn.rows.iter().flatten().all(|x| self.model.graph.is_constant(x.node)) =>
            {
                Some(self.nothing())
            }
            RotationParameters::Parameters(_) | RotationParameters::Matrix => None,
        }
    }

    /// 2(e₀ė − ė₀e ± e×ė).
    fn of_parameters(
        &mut self,
        e: &[Scalar; 4],
        components: Components,
        name: &Ident,
    ) -> Option<[Scalar; 3]> {
        let at = name.span();
        let all = Value::Vector(e.to_vec());
        let Value::Vector(rates) = self.time_derivative(all, name) else { return None };
        let two = self.number(Number::integer(2));
        let mut velocity = Vec::new();
        for i in 0..3 {
            let (j, k) = (1 + (i + 1) % 3, 1 + (i + 2) % 3);
            let forward = self.product(&e[0], &rates[1 + i]);
            let backward = self.product(&rates[0], &e[1 + i]);
            let difference = self.sum(Operator::Sub, &forward, &backward, at)?;
            let (one, other) = (self.product(&e[j], &rates[k]), self.product(&e[k], &rates[j]));
            let cross = self.sum(Operator::Sub, &one, &other, at)?;
            let sign = if components == Components::World { Operator::Add } else { Operator::Sub };
            let sum = self.sum(sign, &difference, &cross, at)?;
            velocity.push(self.product(&two, &sum));
        }
        velocity.try_into().ok()
    }

    fn nothing(&mut self) -> [Scalar; 3] {
        [(); 3].map(|()| self.number(Number::ZERO))
    }

    fn turned(&mut self, m: &Rc<Rows>, v: &[Scalar; 3], at: Span) -> Option<[Scalar; 3]> {
        Some([self.dot(&m[0], v, at)?, self.dot(&m[1], v, at)?, self.dot(&m[2], v, at)?])
    }

    fn added(&mut self, a: &[Scalar; 3], b: &[Scalar; 3], at: Span) -> Option<[Scalar; 3]> {
        let mut sum = |k: usize| self.sum(Operator::Add, &a[k], &b[k], at);
        Some([sum(0)?, sum(1)?, sum(2)?])
    }
}
