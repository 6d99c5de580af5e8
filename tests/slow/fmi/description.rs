//! `modelDescription.xml` against the rules of the standard (FMI 3.0.2, sections 2.4 and 3.3).

use std::collections::{BTreeMap, BTreeSet};

use dynamics::prelude::*;
use roxmltree::{Document, Node};

use crate::models::Masses;
use crate::units::{Unit, units};

/// A body whose outputs reach an input in several ways.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x)]
#[inputs(push)]
struct Driven {
    mass: f64,
}

#[dynamics]
impl Driven {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push)
    }
    #[output]
    fn felt(&self, q: &Coordinates<Self>) -> Expr {
        let along = q.x.sin() * q.push;
        along + q.t
    }
    #[output]
    fn constant(&self, _: &Coordinates<Self>) -> Expr {
        (2.0 * self.mass).into()
    }
    #[output]
    fn acceleration(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt().dt()
    }
}

fn children<'a>(node: Node<'a, 'a>, tag: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| child.has_tag_name(tag))
}

fn one<'a>(node: Node<'a, 'a>, tag: &'static str) -> Node<'a, 'a> {
    let all: Vec<_> = children(node, tag).collect();
    assert_eq!(all.len(), 1, "{tag}");
    all[0]
}

fn reference(node: Node<'_, '_>, attribute: &str) -> usize {
    node.attribute(attribute).unwrap_or_else(|| panic!("{attribute}")).parse().unwrap()
}

/// Value references in a list of the model's structure, each once.
fn listed(structure: Node<'_, '_>, tag: &'static str) -> BTreeSet<usize> {
    let mut all = BTreeSet::new();
    for unknown in structure.children().filter(|child| child.has_tag_name(tag)) {
        assert!(all.insert(reference(unknown, "valueReference")), "{tag} twice");
        let count = |name| unknown.attribute(name).map(|text| text.split_whitespace().count());
        assert_eq!(count("dependencies"), count("dependenciesKind"), "{tag}");
    }
    all
}

/// Units and types that are declared.
fn declared(root: Node<'_, '_>, unit: &Unit) -> (BTreeSet<String>, BTreeMap<String, String>) {
    let names = |tag: &'static str, of: &'static str| {
        let all =
            root.children().filter(move |child| child.has_tag_name(tag)).flat_map(|node| node.children());
        all.filter(move |child| child.has_tag_name(of))
    };
    let name = |node: Node<'_, '_>| node.attribute("name").unwrap().to_owned();
    let defined: Vec<String> = names("UnitDefinitions", "Unit").map(name).collect();
    let all: BTreeSet<String> = defined.iter().cloned().collect();
    assert_eq!(all.len(), defined.len(), "{}: units twice", unit.name);
    for node in names("UnitDefinitions", "Unit") {
        // All units of these models are known.
        assert!(node.children().any(|child| child.has_tag_name("BaseUnit")), "{}", name(node));
    }
    let types = names("TypeDefinitions", "Float64Type");
    let types = types.map(|node| (name(node), node.attribute("unit").unwrap().to_owned()));
    (all, types.collect())
}

fn check(unit: &Unit) {
    let text = unit.text("modelDescription.xml");
    let document = Document::parse(text).unwrap();
    let root = document.root_element();
    assert!(root.has_tag_name("fmiModelDescription"));
    assert_eq!(root.attribute("fmiVersion"), Some("3.0"));
    let convention = if unit.structured { "structured" } else { "flat" };
    assert_eq!(root.attribute("variableNamingConvention"), Some(convention));
    let derivatives = if unit.directional { "true" } else { "false" };
    for interface in ["ModelExchange", "CoSimulation"] {
        let node = one(root, interface);
        assert_eq!(node.attribute("modelIdentifier"), Some(unit.prefix));
        assert_eq!(node.attribute("providesDirectionalDerivatives"), Some(derivatives), "{}", unit.name);
    }
    let (defined, types) = declared(root, unit);
    let mut names = BTreeSet::new();
    let variables: Vec<_> = one(root, "ModelVariables").children().filter(Node::is_element).collect();
    let mut by_causality: BTreeMap<&str, BTreeSet<usize>> = BTreeMap::new();
    let (mut derivatives, mut calculated) = (BTreeMap::new(), BTreeSet::new());
    for (i, &variable) in variables.iter().enumerate() {
        assert!(variable.has_tag_name("Float64"));
        assert_eq!(reference(variable, "valueReference"), i, "references count the variables");
        let name = variable.attribute("name").unwrap();
        assert!(names.insert(name), "{name} twice");
        let causality = variable.attribute("causality").unwrap();
        by_causality.entry(causality).or_default().insert(i);
        let initial = variable.attribute("initial");
        let has_start = initial == Some("exact") || causality == "input";
        assert_eq!(variable.attribute("start").is_some(), has_start, "{name}");
        if let Some(start) = variable.attribute("start") {
            assert!(start.parse::<f64>().unwrap().is_finite(), "{name}");
        }
        if initial == Some("calculated") {
            calculated.insert(i);
        }
        let variability = if causality == "parameter" { "tunable" } else { "continuous" };
        assert_eq!(variable.attribute("variability"), Some(variability), "{name}");
        if let Some(of) = variable.attribute("unit") {
            assert!(defined.contains(of), "{name}: {of}");
            let typed = variable.attribute("declaredType").map(|name| types[name].as_str());
            assert!(typed.is_none_or(|unit| unit == of), "{name}");
        }
        if variable.attribute("derivative").is_some() {
            let state = reference(variable, "derivative");
            assert_eq!(name, format!("der({})", variables[state].attribute("name").unwrap()));
            assert!(derivatives.insert(state, i).is_none(), "two derivatives of {state}");
        }
    }
    assert_eq!(by_causality["independent"].len(), 1);
    assert_eq!(derivatives.len(), unit.states, "{}", unit.name);
    for name in &unit.compared {
        assert!(names.contains(name.as_str()), "{}: {name}", unit.name);
    }
    let structure = one(root, "ModelStructure");
    assert_eq!(listed(structure, "Output"), by_causality["output"], "{}", unit.name);
    let listed_derivatives = listed(structure, "ContinuousStateDerivative");
    assert_eq!(listed_derivatives, derivatives.values().copied().collect(), "{}", unit.name);
    let indicators = listed(structure, "EventIndicator");
    let unknown: BTreeSet<usize> = calculated.difference(&indicators).copied().collect();
    assert_eq!(listed(structure, "InitialUnknown"), unknown, "{}", unit.name);
    let reactions = names.iter().filter(|name| name.starts_with("lambda.")).count();
    assert_eq!(reactions, unit.rows, "{}", unit.name);
}

#[test]
fn descriptions_follow_the_standard() {
    units().iter().for_each(check);
}

#[test]
fn variables_have_names_units_and_descriptions() {
    let all = units();
    let text = |name: &str| all.iter().find(|unit| unit.name == name).unwrap().text("modelDescription.xml");
    let masses = text("masses");
    assert!(masses.contains("name=\"der(x_rate[1])\""), "{masses}");
    assert!(masses.contains("name=\"stiffness[2]\""), "{masses}");
    assert!(masses.contains("description=\"The masses, from left to right.\""), "{masses}");
    assert!(masses.contains("<Unit name=\"N*s/m\"><BaseUnit kg=\"1\" s=\"-1\"/></Unit>"), "{masses}");
    assert!(masses.contains("<Unit name=\"(m/s)/s\"") || masses.contains("<Unit name=\"m/s^2\""), "{masses}");
    let cart = text("cart_pole");
    assert!(cart.contains("description=\"A cart with a bob &amp; an &lt;input&gt;.\""), "{cart}");
    assert!(cart.contains("causality=\"input\" variability=\"continuous\" start=\"0.5\""), "{cart}");
    assert!(cart.contains("<DisplayUnit name=\"deg\" factor=\"57.29577951308232\"/>"), "{cart}");
    let crank = text("slider_crank");
    assert!(crank.contains("name=\"lambda.closure.y\""), "{crank}");
    assert!(crank.contains("reinit=\"true\""), "{crank}");
    let ball = text("ball");
    for name in ["apex", "crosses_line", "kink[0]", "kink[1]"] {
        assert!(ball.contains(&format!("name=\"{name}\"")), "{ball}");
    }
}

/// What the unknown of a name depends on, in a list of the model's structure; `None`: on everything.
fn dependencies(text: &str, tag: &'static str, name: &str) -> Option<Vec<String>> {
    let document = Document::parse(text).unwrap();
    let root = document.root_element();
    let variables = one(root, "ModelVariables").children().filter(Node::is_element);
    let names: Vec<&str> = variables.map(|node| node.attribute("name").unwrap()).collect();
    let mut unknowns = one(root, "ModelStructure").children().filter(|node| node.has_tag_name(tag));
    let unknown = unknowns.find(|node| names[reference(*node, "valueReference")] == name).unwrap();
    let listed = unknown.attribute("dependencies")?.split_whitespace();
    Some(listed.map(|known| names[known.parse::<usize>().unwrap()].to_owned()).collect())
}

/// An importer sees an algebraic loop where an output depends on an input.
#[test]
fn outputs_depend_on_what_they_are_computed_from() {
    let all = units();
    let of = |unit: &str, tag, name: &str| {
        let unit = all.iter().find(|other| other.name == unit).unwrap();
        dependencies(unit.text("modelDescription.xml"), tag, name)
    };
    let listed = |names: &[&str]| Some(names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
    assert_eq!(of("cart_pole", "Output", "tip.x"), listed(&["x", "theta"]));
    assert_eq!(of("cart_pole", "Output", "tip.y"), listed(&["theta"]));
    assert_eq!(of("cart_pole", "Output", "energy"), listed(&["theta", "x_rate", "theta_rate"]));
    let driven = Driven { mass: 2.0 };
    let files = driven.fmu(driven.state().push(1.0).build().unwrap()).files().unwrap();
    let text = std::str::from_utf8(&files[0].bytes).unwrap();
    assert_eq!(dependencies(text, "Output", "felt"), listed(&["time", "x", "push"]));
    assert_eq!(dependencies(text, "Output", "constant"), listed(&[]));
    // By the equations of motion.
    assert_eq!(dependencies(text, "Output", "acceleration"), listed(&["push"]));
    assert_eq!(of("cart_pole", "InitialUnknown", "tip.y"), listed(&["theta", "l"]));
    assert_eq!(of("cart_pole", "ContinuousStateDerivative", "der(x)"), listed(&["x_rate"]));
    assert_eq!(of("cart_pole", "ContinuousStateDerivative", "der(x_rate)"), None);
    assert_eq!(of("ball", "EventIndicator", "apex"), listed(&["y_rate"]));
    assert_eq!(of("ball", "EventIndicator", "kink[0]"), listed(&["y"]));
    // Reactions depend on everything, and so does a start that is moved to the constraints.
    assert_eq!(of("slider_crank", "Output", "bearing"), None);
    assert_eq!(of("slider_crank", "InitialUnknown", "energy"), None);
    assert!(of("slider_crank", "Output", "energy").is_some());
}

/// Tolerances of motions near the rounding of numbers stay above it, as in Rust.
#[test]
fn nominal_values_stay_above_rounding() {
    let model = Masses { mass: [1.0, 2.0], stiffness: [10.0, 20.0, 30.0], damping: 0.3 };
    let start = model.state().x([1e-12, -1e-12]).build().unwrap();
    let files = model.fmu(start).tolerance(1e-7).files().unwrap();
    let text = std::str::from_utf8(&files[0].bytes).unwrap();
    let document = Document::parse(text).unwrap();
    let nominals = document.descendants().filter_map(|node| node.attribute("nominal"));
    let nominals: Vec<f64> = nominals.map(|nominal| nominal.parse().unwrap()).collect();
    assert_eq!(nominals.len(), 4);
    assert!(nominals.iter().all(|nominal| *nominal >= 0.999e-8 && *nominal < 1e-3), "{nominals:?}");
}

#[test]
fn builds_name_all_sources() {
    for unit in units() {
        let document = Document::parse(unit.text("sources/buildDescription.xml")).unwrap();
        let build = one(document.root_element(), "BuildConfiguration");
        assert_eq!(build.attribute("modelIdentifier"), Some(unit.prefix));
        let files = one(build, "SourceFileSet");
        assert_eq!(files.attribute("language"), Some("C99"));
        let named: BTreeSet<String> = children(files, "SourceFile")
            .map(|file| format!("sources/{}", file.attribute("name").unwrap()))
            .collect();
        let there: BTreeSet<String> =
            unit.files.iter().map(|file| file.name.clone()).filter(|name| name.ends_with(".c")).collect();
        assert_eq!(named, there);
        // Nothing of the templates is left.
        for file in unit.files.iter().filter(|file| file.name.starts_with("sources/")) {
            let text = std::str::from_utf8(&file.bytes).unwrap();
            assert!(!text.contains("<<") && !text.contains("%%") && !text.contains('$'), "{}", file.name);
        }
        assert!(unit.text("documentation/index.html").to_lowercase().contains("<!doctype html>"));
        assert!(unit.text("documentation/licenses/fmi-headers.txt").contains("2-Clause BSD License"));
    }
}
