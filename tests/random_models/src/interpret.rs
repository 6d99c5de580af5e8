//! What the engine's interpreter makes of a model: the text goes through the macros' passes to the derived
//! equations, which are evaluated on the graph. Nothing is scheduled or emitted, and the equations are solved
//! densely.

mod solve;
mod values;

use dynamics_symbolic::graph::{Bindings, Dependence, FunctionId, Graph, NodeId, Symbol};
use dynamics_symbolic::mechanics::{self, Equations, Model, Solution};
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
    let equations = mechanics::derive(&mut model).map_err(|e| Refused::Model(format!("{e:?}")))?;
    let interpreter = Interpreter { model: &model, equations: &equations, parameters: &parameters };
    let mut said = String::new();
    for at in states(name, model.coordinates.len(), model.inputs.len()) {
        interpreter.tell(&at, &mut said);
    }
    Ok(said)
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
    fn tell(&self, at: &Point, to: &mut String) {
        let list = |values: &[f64]| values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(" ");
        *to += &format!("state {:?}|{}|{}|{}\n", at.t, list(&at.q), list(&at.u), list(&at.inputs));
        let here = self.quantities(at, 0.0);
        let beside = [-1.0, 1.0].map(|sign| {
            let mut beside = at.clone();
            let all = beside.q.iter_mut().chain(&mut beside.u).chain([&mut beside.t]);
            all.for_each(|x| *x *= 1.0 + sign * ROUNDING);
            self.quantities(&beside, sign * ROUNDING)
        });
        for (k, (name, values)) in here.iter().enumerate() {
            *to += name;
            for (i, value) in values.iter().enumerate() {
                let noise = beside.iter().map(|all| (all[k].1[i] - value).abs()).fold(0.0, f64::max);
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
        if let Ok(j) = &e.jacobians {
            wanted.push(("by_q", j.by_q.concat()));
            wanted.push(("by_u", j.by_u.concat()));
            wanted.push(("by_input", j.by_inputs.concat()));
            wanted.push(("by_parameter", j.by_parameters.concat()));
        }
        let all: Vec<NodeId> = wanted.iter().flat_map(|(_, nodes)| nodes.iter().copied()).collect();
        let mut found = self.evaluate(&all, &values).into_iter();
        let mut quantities: Vec<Quantity> =
            wanted.iter().map(|(name, nodes)| (*name, found.by_ref().take(nodes.len()).collect())).collect();
        quantities.extend(self.on_graph(&values));
        quantities.push(("accelerations", accelerations));
        quantities.push(("multipliers", multipliers));
        quantities
    }

    /// The solution that the engine has on its graph, which is not the dense one.
    fn on_graph(&self, values: &Values) -> Vec<Quantity> {
        let e = self.equations;
        match e.constraints.as_ref().map(|c| &c.solution) {
            None => vec![("unrolled", self.evaluate(&e.accelerations, values))],
            Some(Solution::Unrolled(u)) => vec![("unrolled", self.evaluate(&u.accelerations, values))],
            Some(Solution::General(_)) => Vec::new(),
        }
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
