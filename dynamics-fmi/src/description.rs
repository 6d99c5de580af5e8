//! `modelDescription.xml` and `buildDescription.xml`.

use std::collections::BTreeSet;
use std::fmt::Write;

use dynamics_runtime::model::{ModelState, PrintedInC, SimulationModel};
use dynamics_view::text::xml;

use crate::fmu::Fmu;
use crate::plan::Plan;
use crate::units::{BASES, base_unit, quantity};
use crate::variables::{Role, Variable};

const HEAD: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";

/// A text in one line.
fn line(text: &str) -> String {
    xml(&text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// `modelDescription.xml`.
pub(crate) fn model<M: SimulationModel + PrintedInC>(fmu: &Fmu<'_, M>, plan: &Plan) -> String {
    let variables = &plan.variables;
    let mut out = HEAD.to_owned();
    let about = line(M::DOCUMENTATION);
    let about = if about.is_empty() { String::new() } else { format!("\n  description=\"{about}\"") };
    let convention = if variables.is_structured { "structured" } else { "flat" };
    let _ = write!(
        out,
        "<fmiModelDescription\n  fmiVersion=\"3.0\"\n  modelName=\"{}\"\n  instantiationToken=\"{}\"{about}\n  \
         generationTool=\"dynamics {}\"\n  variableNamingConvention=\"{convention}\">\n",
        xml(M::NAME),
        xml(&plan.token),
        env!("CARGO_PKG_VERSION"),
    );
    out.push_str(&interfaces::<M>());
    out.push_str(&units(&variables.all));
    out.push_str(
        "  <LogCategories>\n    <Category name=\"logStatusError\" description=\"Why a call was refused.\"/>\n    \
         <Category name=\"logStatusWarning\" description=\"What was changed.\"/>\n  </LogCategories>\n",
    );
    let (start, stop) = (fmu.start.t(), fmu.start.t() + fmu.duration);
    let _ = writeln!(
        out,
        "  <DefaultExperiment startTime=\"{start:?}\" stopTime=\"{stop:?}\" tolerance=\"{:?}\"/>",
        fmu.tolerance
    );
    out.push_str("  <ModelVariables>\n");
    for (reference, variable) in variables.all.iter().enumerate() {
        out.push_str(&element(reference, variable, !M::ROWS.is_empty(), &variables.all));
    }
    out.push_str("  </ModelVariables>\n");
    out.push_str(&structure::<M>(plan));
    out.push_str("</fmiModelDescription>\n");
    out
}

/// What both interfaces can do.
fn interfaces<M: PrintedInC>() -> String {
    let (name, derivatives) = (M::C.name, M::C.directional);
    let common = format!(
        "modelIdentifier=\"{name}\"\n    canGetAndSetFMUState=\"true\"\n    canSerializeFMUState=\"true\"\n    \
         providesDirectionalDerivatives=\"{derivatives}\""
    );
    format!(
        "  <ModelExchange\n    {common}\n    needsCompletedIntegratorStep=\"true\"/>\n  <CoSimulation\n    {common}\n    \
         canHandleVariableCommunicationStepSize=\"true\"\n    mightReturnEarlyFromDoStep=\"true\"\n    \
         hasEventMode=\"true\"/>\n"
    )
}

/// Units and types.
fn units(variables: &[Variable]) -> String {
    let used: BTreeSet<&str> = variables.iter().map(|v| v.unit.as_str()).filter(|u| !u.is_empty()).collect();
    if used.is_empty() {
        return String::new();
    }
    let mut out = String::from("  <UnitDefinitions>\n");
    for unit in &used {
        let name = xml(unit);
        let Some(base) = base_unit(unit) else {
            let _ = writeln!(out, "    <Unit name=\"{name}\"/>");
            continue;
        };
        let powers = BASES.iter().zip(base.powers).filter(|(_, power)| *power != 0);
        let powers: String = powers.map(|(of, power)| format!(" {of}=\"{power}\"")).collect();
        let factor =
            if base.factor == 1.0 { String::new() } else { format!(" factor=\"{:?}\"", base.factor) };
        // An angle shown in degrees is this many times its value in radians.
        let shown = match *unit {
            "rad" => format!("<DisplayUnit name=\"deg\" factor=\"{:?}\"/>", 1f64.to_degrees()),
            _ => String::new(),
        };
        let _ = writeln!(out, "    <Unit name=\"{name}\"><BaseUnit{powers}{factor}/>{shown}</Unit>");
    }
    out.push_str("  </UnitDefinitions>\n");
    let types: Vec<String> = used.iter().filter_map(|unit| declared_type(unit, variables)).collect();
    let listed: BTreeSet<&String> = types.iter().collect();
    if !listed.is_empty() {
        out.push_str("  <TypeDefinitions>\n");
        for name in listed {
            let unit = used.iter().find(|unit| declared_type(unit, variables).as_ref() == Some(name));
            let unit = unit.copied().unwrap_or_default();
            let _ = writeln!(
                out,
                "    <Float64Type name=\"{name}\" quantity=\"{name}\" unit=\"{}\"/>",
                xml(unit)
            );
        }
        out.push_str("  </TypeDefinitions>\n");
    }
    out
}

/// The type of variables with a unit; none where a variable has the type's name.
fn declared_type(unit: &str, variables: &[Variable]) -> Option<String> {
    let name = quantity(unit)?;
    let is_taken = variables.iter().any(|variable| variable.name == name);
    // Two units of one quantity, as J and ft*lb, never stand in one model.
    (!is_taken).then(|| name.to_owned())
}

/// A variable.
fn element(reference: usize, variable: &Variable, has_rows: bool, all: &[Variable]) -> String {
    let role = match variable.role {
        Role::Time => "causality=\"independent\" variability=\"continuous\"".to_owned(),
        Role::State(value, nominal) => {
            let reinit = if has_rows { " reinit=\"true\"" } else { "" };
            format!(
                "causality=\"output\" variability=\"continuous\" initial=\"exact\" start=\"{value:?}\" \
                 nominal=\"{nominal:?}\"{reinit}"
            )
        }
        Role::Derivative(of) => format!(
            "causality=\"local\" variability=\"continuous\" initial=\"calculated\" derivative=\"{of}\""
        ),
        Role::Parameter(value) => {
            format!("causality=\"parameter\" variability=\"tunable\" initial=\"exact\" start=\"{value:?}\"")
        }
        Role::Input(value) => format!("causality=\"input\" variability=\"continuous\" start=\"{value:?}\""),
        Role::Output => "causality=\"output\" variability=\"continuous\" initial=\"calculated\"".to_owned(),
        Role::Indicator => "causality=\"local\" variability=\"continuous\" initial=\"calculated\"".to_owned(),
    };
    let unit = &variable.unit;
    let typed = match declared_type(unit, all) {
        Some(name) => format!(" declaredType=\"{name}\""),
        None => String::new(),
    };
    let unit = if unit.is_empty() { String::new() } else { format!(" unit=\"{}\"", xml(unit)) };
    let about = line(&variable.about);
    let about = if about.is_empty() { String::new() } else { format!(" description=\"{about}\"") };
    let name = xml(&variable.name);
    format!("    <Float64 name=\"{name}\" valueReference=\"{reference}\" {role}{typed}{unit}{about}/>\n")
}

/// What depends on what.
fn structure<M: SimulationModel>(plan: &Plan) -> String {
    let (variables, n) = (&plan.variables, M::COORDINATES.len());
    let mut out = String::from("  <ModelStructure>\n");
    // Importers know parameters as knowns of the initialization alone.
    let parameters: BTreeSet<usize> =
        variables.with(|role| matches!(role, Role::Parameter(_))).into_iter().collect();
    let list = |out: &mut String, tag: &str, references: Vec<usize>| {
        let is_initial = tag == "InitialUnknown";
        for reference in references {
            // Coordinates and rates are themselves; rates of coordinates are the states behind these.
            let constant = match variables.all[reference].role {
                Role::State(..) => Some(reference),
                Role::Derivative(of) if of <= n => Some(of + n),
                _ => None,
            };
            let on = match (constant, plan.dependencies.on(reference)) {
                (Some(on), _) => attributes(&[on], "constant"),
                // A start is first moved to the constraints, which mixes all states.
                (None, Some(_)) if is_initial && !M::ROWS.is_empty() => String::new(),
                (None, Some(known)) => {
                    let known = known.iter().copied().filter(|on| is_initial || !parameters.contains(on));
                    attributes(&known.collect::<Vec<_>>(), "dependent")
                }
                (None, None) => String::new(),
            };
            let _ = writeln!(out, "    <{tag} valueReference=\"{reference}\"{on}/>");
        }
    };
    let is_output = |role| matches!(role, Role::State(..) | Role::Output);
    let is_derivative = |role| matches!(role, Role::Derivative(_));
    list(&mut out, "Output", variables.with(is_output));
    list(&mut out, "ContinuousStateDerivative", variables.with(is_derivative));
    let is_unknown = |role| matches!(role, Role::Output | Role::Derivative(_));
    list(&mut out, "InitialUnknown", variables.with(is_unknown));
    list(&mut out, "EventIndicator", variables.with(|role| role == Role::Indicator));
    out.push_str("  </ModelStructure>\n");
    out
}

/// What an unknown depends on, in one way.
fn attributes(on: &[usize], kind: &str) -> String {
    let all = |text: &dyn Fn(usize) -> String| on.iter().map(|&i| text(i)).collect::<Vec<_>>().join(" ");
    let (on, kinds) = (all(&|i| i.to_string()), all(&|_| kind.to_owned()));
    format!(" dependencies=\"{on}\" dependenciesKind=\"{kinds}\"")
}

/// `buildDescription.xml`.
pub(crate) fn build<M: PrintedInC>(sources: &[(String, String)]) -> String {
    let files = sources.iter().filter(|(name, _)| name.ends_with(".c"));
    let files: String = files.map(|(name, _)| format!("      <SourceFile name=\"{name}\"/>\n")).collect();
    format!(
        "{HEAD}<fmiBuildDescription fmiVersion=\"3.0\">\n  <BuildConfiguration modelIdentifier=\"{}\">\n    \
         <SourceFileSet language=\"C99\">\n{files}    </SourceFileSet>\n  </BuildConfiguration>\n\
         </fmiBuildDescription>\n",
        M::C.name
    )
}
