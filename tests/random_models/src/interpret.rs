//! What the engine's interpreter makes of a model: the text goes through the macros' passes to the derived
//! equations, which are evaluated on the graph. Nothing is scheduled or emitted, and the equations are solved
//! densely.

mod manifold;
mod solve;
mod values;

use dynamics_symbolic::algebra::States;
use dynamics_symbolic::check;
use dynamics_symbolic::graph::{Bindings, Dependence, FunctionId, Graph, NodeId, Symbol};
use dynamics_symbolic::mechanics::{self, Equations, Manifold, Model, Solution};
use quote::ToTokens;

use crate::diagnostics::Diagnostics;
use crate::{elaborate, syntax};
use solve::System;

#[path = "../judge/states.rs"]
pub mod states;
use states::{Point, states};

/// Why a model is not interpreted.
#[derive(Clone, Debug)]
pub enum Refused {
    /// The macros or the engine refuse it: then so has the compiler.
    Model(String),
    /// Nothing here can interpret it.
    Unsupported(&'static str),
}

/// The interpreted values of a model at states by its name, as text for the judge.
///
/// A line `state` with time, coordinates, velocities and inputs, separated by bars, begins a state. The lines
/// behind it have a quantity each: its name, then every value with what rounding in the state does to it.
///
/// # Errors
/// What the macros refuse, and what has no values here.
pub fn interpreted(name: &str, text: &str) -> Result<String, Refused> {
    let (mut model, parameters) = read(text)?;
    if !model.functions.is_empty() {
        return Err(Refused::Unsupported("smooth functions have values at run time alone"));
    }
    let equations = derived(&mut model)?;
    let interpreter = Interpreter { model: &model, equations: &equations, parameters: &parameters };
    let mut said = String::new();
    // Euler parameters turn, and rows repeat each other, where the constraints hold.
    let has_norm = text.contains("norm_constraint()");
    let all = has_norm || model.constraints.iter().any(|c| c.redundant);
    let mut are_met = false;
    for (k, at) in states(name, model.coordinates.len(), model.inputs.len()).into_iter().enumerate() {
        let on_them = interpreter.on_constraints(&at);
        are_met |= on_them.is_some();
        match on_them {
            Some(on_them) if all || k == 2 => interpreter.tell(&on_them, has_norm, &mut said),
            _ if all => {}
            _ => interpreter.tell(&at, has_norm, &mut said),
        }
    }
    if equations.constraints.is_some() && !are_met {
        said += UNMET;
    }
    Ok(said)
}

/// The last line where no state was found at which the constraints hold; without any other there is nothing
/// that the judge could compare either.
pub const UNMET: &str = "unmet";

/// The equations, solved on the graph in the order that the engine's driver finds for the same model.
fn derived(model: &mut Model) -> Result<Equations, Refused> {
    let constraints = check::constraints::analyse(model);
    let [anywhere, likely, passed] =
        [&constraints.guides[..], constraints.likely.as_slice(), &constraints.passed]
            .map(|states| states.iter().map(|state| state as &dyn Bindings).collect::<Vec<_>>());
    let states = States { anywhere: &anywhere, likely: &likely, passed: &passed };
    let manifold = Manifold { states, redundant: constraints.redundant };
    mechanics::derive_on(model, &manifold).map_err(|e| Refused::Model(format!("{e:?}")))
}

/// The engine's model behind a text, and the values of its parameters.
fn read(text: &str) -> Result<(Model, Vec<f64>), Refused> {
    let file = syn::parse_file(text).map_err(|e| Refused::Model(e.to_string()))?;
    let has = |attributes: &[syn::Attribute], word: &str| {
        let said = |a: &syn::Attribute| a.to_token_stream().into_iter().any(|t| t.to_string().contains(word));
        attributes.iter().any(said)
    };
    let mut declared = None;
    let mut block = None;
    for item in file.items {
        match item {
            syn::Item::Struct(item) if has(&item.attrs, "Dynamics") => declared = declared.or(Some(item)),
            syn::Item::Impl(item) if has(&item.attrs, "dynamics") => block = block.or(Some(item)),
            _ => {}
        }
    }
    let (Some(mut declared), Some(mut block)) = (declared, block) else {
        return Err(Refused::Unsupported("struct and block are not items of the file"));
    };
    declared.attrs.retain(|a| syntax::ATTRIBUTES.iter().any(|own| a.path().is_ident(own)));
    block.attrs.clear();
    let mut diagnostics = Diagnostics::new();
    let declaration = syntax::parse_struct(declared.into_token_stream(), &mut diagnostics);
    let implementation = syntax::parse_impl(block.into_token_stream(), &mut diagnostics);
    let refused = |errors: Vec<syn::Error>| {
        Refused::Model(errors.first().map_or_else(|| "no reason".to_owned(), ToString::to_string))
    };
    diagnostics.checkpoint().map_err(refused)?;
    let (Some(declaration), Some(implementation)) = (declaration, implementation) else {
        return Err(Refused::Model("nothing was parsed".to_owned()));
    };
    let elaborated = elaborate::elaborate(&declaration, &implementation, &mut diagnostics);
    diagnostics.finish().map_err(refused)?;
    let literal = text.lines().find_map(|line| line.strip_prefix("// model: "));
    let parameters = literal.and_then(|literal| values::parameters(literal, &declaration));
    let parameters = parameters.ok_or(Refused::Unsupported("values of parameters are not literals"))?;
    Ok((elaborated.model, parameters))
}

/// Values for all symbols of a model.
struct Values<'a> {
    at: &'a Point,
    parameters: &'a [f64],
    accelerations: &'a [f64],
    multipliers: &'a [f64],
}

impl Bindings for Values<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        let of = |values: &[f64], i: u32| values.get(i as usize).copied().unwrap_or(f64::NAN);
        match symbol {
            Symbol::Time => self.at.t,
            Symbol::Coordinate(i) => of(&self.at.q, i),
            Symbol::Rate(i) => of(&self.at.u, i),
            Symbol::Acceleration(i) => of(self.accelerations, i),
            Symbol::Input(i) => of(&self.at.inputs, i),
            Symbol::Parameter(i) => of(self.parameters, i),
            Symbol::Multiplier(i) => of(self.multipliers, i),
            // Switched constraints hold.
            Symbol::Mode(_) => 0.0,
        }
    }
    fn smooth(&self, _: FunctionId, _: u8, _: f64) -> f64 {
        f64::NAN
    }
}

/// A model with its equations and the values of its parameters.
struct Interpreter<'a> {
    model: &'a Model,
    equations: &'a Equations,
    parameters: &'a [f64],
}

/// Name and values of a quantity.
type Quantity = (&'static str, Vec<f64>);

/// Relative size of the changes of the state by which it is found what rounding does.
const ROUNDING: f64 = 1e-13;

impl Interpreter<'_> {
    /// Adds the lines of a state.
    fn tell(&self, at: &Point, is_tangential: bool, to: &mut String) {
        let list = |values: &[f64]| values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(" ");
        *to += &format!("state {:?}|{}|{}|{}\n", at.t, list(&at.q), list(&at.u), list(&at.inputs));
        if is_tangential {
            *to += "tangential\n";
        }
        let here = self.quantities(at, 0.0);
        let beside = [-1.0, 1.0].map(|sign| {
            let mut beside = at.clone();
            let all = beside.q.iter_mut().chain(&mut beside.u).chain([&mut beside.t]);
            all.for_each(|x| *x *= 1.0 + sign * ROUNDING);
            self.quantities(&beside, sign * ROUNDING)
        });
        for (name, values) in &here {
            *to += name;
            // A pivot that is there or not there, as rounding has it, is doubt enough.
            let beside = beside.each_ref().map(|all| all.iter().find(|(other, _)| other == name));
            for (i, value) in values.iter().enumerate() {
                let off = |all: &Option<&Quantity>| all.map_or(f64::NAN, |(_, v)| (v[i] - value).abs());
                let noise =
                    beside.iter().map(off).fold(0.0, |a: f64, b| if b.is_nan() { b } else { a.max(b) });
                *to += &format!(" {value:?}~{noise:.1e}");
            }
            *to += "\n";
        }
    }

    fn evaluate(&self, nodes: &[NodeId], values: &Values) -> Vec<f64> {
        let g: &Graph = &self.model.graph;
        let all = g.evaluate(nodes, values);
        nodes.iter().map(|node| all[node.index()]).collect()
    }

    /// Everything at one state. The matrix of the linear equations is changed by `rounding` of its entries.
    fn quantities(&self, at: &Point, rounding: f64) -> Vec<Quantity> {
        let e = self.equations;
        let (accelerations, multipliers) = self.solution(at, rounding);
        let values = Values {
            at,
            parameters: self.parameters,
            accelerations: &accelerations,
            multipliers: &multipliers,
        };
        let named = |all: &[mechanics::Named]| all.iter().map(|n| n.node).collect::<Vec<_>>();
        let mut wanted: Vec<(&'static str, Vec<NodeId>)> = vec![
            ("mass", e.mass_matrix.concat()),
            ("force", e.generalized_force.clone()),
            ("momenta", e.momenta.clone()),
            ("energy", vec![e.energy_function]),
            ("powers", named(&e.powers)),
            ("outputs", named(&e.outputs)),
            ("events", named(&e.events)),
        ];
        if let Some(c) = &e.constraints {
            wanted.push(("residual", c.residual.clone()));
            wanted.push(("rates", c.velocity_residual.clone()));
            wanted.push(("jacobian", c.jacobian.concat()));
            wanted.push(("gamma", c.gamma.clone()));
        }
        let unrolled = self.on_graph(&values);
        if let (Ok(j), true) = (&e.jacobians, unrolled.is_some()) {
            wanted.push(("by_q", j.by_q.concat()));
            wanted.push(("by_u", j.by_u.concat()));
            wanted.push(("by_input", j.by_inputs.concat()));
            wanted.push(("by_parameter", j.by_parameters.concat()));
        }
        let all: Vec<NodeId> = wanted.iter().flat_map(|(_, nodes)| nodes.iter().copied()).collect();
        let mut found = self.evaluate(&all, &values).into_iter();
        let mut quantities: Vec<Quantity> =
            wanted.iter().map(|(name, nodes)| (*name, found.by_ref().take(nodes.len()).collect())).collect();
        quantities.extend(unrolled);
        quantities.push(("accelerations", accelerations));
        quantities.push(("multipliers", multipliers));
        quantities
    }

    /// The solution that the engine has on its graph, which is not the dense one.
    fn on_graph(&self, values: &Values) -> Option<Quantity> {
        let e = self.equations;
        let nodes = match e.constraints.as_ref().map(|c| &c.solution) {
            None => &e.accelerations,
            Some(Solution::Unrolled(u)) if self.applies(&u.guards, values) => &u.accelerations,
            Some(_) => return None,
        };
        Some(("unrolled", self.evaluate(nodes, values)))
    }

    /// Whether no pivot is next to nothing: there the general solver takes over.
    fn applies(&self, guards: &[mechanics::Guard], values: &Values) -> bool {
        let pairs: Vec<NodeId> = guards.iter().flat_map(|guard| [guard.pivot, guard.scale]).collect();
        self.evaluate(&pairs, values).chunks(2).all(|pair| pair[0].abs() > 1e-4 * pair[1].abs())
    }

    /// q̈ and λ by dense elimination; λ is NaN where rows repeat each other.
    fn solution(&self, at: &Point, rounding: f64) -> (Vec<f64>, Vec<f64>) {
        let e = self.equations;
        let n = e.generalized_force.len();
        let rows = e.constraints.as_ref().map_or(0, |c| c.rows.len());
        let by_multipliers = e.constraints.as_ref().and_then(|c| c.force_by_multipliers.as_ref());
        let mut multipliers = vec![0.0; rows];
        // Forces that contain reactions need not be linear in them.
        for _ in 0..MOST_STEPS {
            let values =
                Values { at, parameters: self.parameters, accelerations: &[], multipliers: &multipliers };
            let mut system = System {
                mass: self.evaluate(&e.mass_matrix.concat(), &values),
                force: self.evaluate(&e.generalized_force, &values),
                jacobian: Vec::new(),
                gamma: Vec::new(),
                by_multipliers: vec![0.0; n * rows],
            };
            if let Some(c) = &e.constraints {
                system.jacobian = self.evaluate(&c.jacobian.concat(), &values);
                system.gamma = self.evaluate(&c.gamma, &values);
            }
            if let Some(by) = by_multipliers {
                system.by_multipliers = self.evaluate(&by.concat(), &values);
                system.linearise(&multipliers);
            }
            let (accelerations, next) = system.solve(rounding);
            let is_linear = by_multipliers.is_none_or(|by| {
                let on = |node: &NodeId| self.model.graph.dependence(*node).on(Dependence::MULTIPLIERS);
                !by.iter().flatten().any(on)
            });
            let change = next.iter().zip(&multipliers).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let size = next.iter().fold(1.0_f64, |s, x| s.max(x.abs()));
            multipliers = next;
            if is_linear || change <= 1e-12 * size {
                return (accelerations, multipliers);
            }
        }
        (vec![f64::NAN; n], vec![f64::NAN; rows])
    }
}

/// Steps of Newton's method.
const MOST_STEPS: usize = 30;
