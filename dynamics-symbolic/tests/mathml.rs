//! MathML is well-formed, names the symbols, and says what the plain equations say.

use std::collections::BTreeMap;
use std::slice;

use crate::common::reader::{Names, evaluate};
use crate::texts::{close, models, names, values};
use dynamics_symbolic::compile::{Compiled, compile};
use dynamics_symbolic::text::{Dots, symbol_mathml};

/// An element, or text between elements.
#[derive(Clone, Debug, PartialEq)]
enum Node {
    Element { tag: String, symbol: Option<String>, children: Vec<Node> },
    Text(String),
}

impl Node {
    fn tag(&self) -> &str {
        match self {
            Self::Element { tag, .. } => tag,
            Self::Text(_) => "",
        }
    }
    fn children(&self) -> &[Self] {
        match self {
            Self::Element { children, .. } => children,
            Self::Text(_) => &[],
        }
    }
    fn symbol(&self) -> Option<&str> {
        match self {
            Self::Element { symbol, .. } => symbol.as_deref(),
            Self::Text(_) => None,
        }
    }
    /// The text of a token.
    fn token(&self) -> &str {
        match self.children() {
            [Self::Text(text)] => text,
            _ => "",
        }
    }
    fn is(&self, tag: &str, token: &str) -> bool {
        self.tag() == tag && self.token() == token
    }
    /// This and everything within.
    fn all(&self) -> Vec<&Self> {
        [self].into_iter().chain(self.children().iter().flat_map(Self::all)).collect()
    }
}

fn unescaped(text: &str) -> String {
    let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&#39;", "'");
    assert!(!text.replace("&amp;", "").contains('&'), "{text}");
    text.replace("&amp;", "&")
}

/// The elements of a text; panics where it is not well-formed.
fn parse(text: &str) -> Vec<Node> {
    let mut open: Vec<Node> = vec![Node::Element { tag: String::new(), symbol: None, children: Vec::new() }];
    let add = |open: &mut Vec<Node>, node: Node| match open.last_mut() {
        Some(Node::Element { children, .. }) => children.push(node),
        other => panic!("{node:?} within {other:?}"),
    };
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('<') {
        assert!(!before.contains('>'), "{before}");
        if !before.is_empty() {
            add(&mut open, Node::Text(unescaped(before)));
        }
        let (tag, after) = after.split_once('>').expect("a tag ends");
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            let closed = open.pop().expect("an element is open");
            assert_eq!(closed.tag(), name, "closes what is open");
            add(&mut open, closed);
            continue;
        }
        let (tag, is_empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let symbol = tag.split_once(" data-s=\"").map(|(_, value)| {
            let (value, end) = value.split_once('"').expect("a value ends");
            assert_eq!(end, "");
            unescaped(value)
        });
        let name = tag.split(' ').next().expect("a name").to_owned();
        let element = Node::Element { tag: name, symbol, children: Vec::new() };
        if is_empty { add(&mut open, element) } else { open.push(element) }
    }
    assert_eq!((rest.trim(), open.len()), ("", 1), "everything is closed");
    open[0].children().to_vec()
}

fn compiled() -> impl Iterator<Item = Compiled> {
    models().into_iter().map(|model| compile(model).unwrap_or_else(|found| panic!("{found:?}")))
}

#[test]
fn mathml_is_well_formed() {
    for c in compiled() {
        for paragraph in parse(&c.mathml) {
            if matches!(&paragraph, Node::Text(text) if text == "\n") {
                continue;
            }
            assert_eq!(paragraph.tag(), "p");
            for math in paragraph.children().iter().filter(|child| child.tag() == "math") {
                math.all().into_iter().for_each(check);
            }
        }
    }
}

/// An element has as many arguments as it needs, and text stands in tokens alone.
fn check(node: &Node) {
    let count = node.children().len();
    match node.tag() {
        "mi" | "mn" | "mo" | "mtext" => assert!(!node.token().is_empty(), "{node:?}"),
        "msub" | "msup" | "mover" | "mfrac" | "mroot" => assert_eq!(count, 2, "{node:?}"),
        "msubsup" => assert_eq!(count, 3, "{node:?}"),
        "mspace" => assert_eq!(count, 0, "{node:?}"),
        "math" | "mrow" | "msqrt" | "mtable" | "mtr" | "mtd" => {
            assert!(count > 0 && node.children().iter().all(|child| !child.tag().is_empty()), "{node:?}");
        }
        "" => {}
        tag => panic!("no MathML: {tag}"),
    }
}

/// What a page marks are names of the model; every symbol of a row has one.
#[test]
fn symbols_name_what_they_stand_for() {
    for c in compiled() {
        let model = &c.model;
        let known: Vec<&str> = model
            .coordinates
            .iter()
            .map(|c| c.name.as_str())
            .chain(model.inputs.iter().map(|i| i.name.as_str()))
            .chain(model.parameters.iter().map(|p| p.name.as_str()))
            .chain(model.functions.iter().map(|f| f.name.as_str()))
            .collect();
        let all = parse(&c.mathml);
        let found: Vec<&str> = all.iter().flat_map(Node::all).filter_map(Node::symbol).collect();
        found.iter().for_each(|name| assert!(known.contains(name), "{name}"));
        for coordinate in &model.coordinates {
            let is_written = c.equations_text.contains(&coordinate.name);
            assert_eq!(found.contains(&coordinate.name.as_str()), is_written, "{}", coordinate.name);
        }
    }
}

/// A sequence of elements as plain text.
fn plain(nodes: &[Node], rows: &BTreeMap<String, String>) -> String {
    let mut out = String::new();
    let mut rest = nodes;
    while let [node, after @ ..] = rest {
        rest = after;
        let inner = |i: usize| plain(&node.children()[i..=i], rows);
        let applies = matches!(after, [apply, _, ..] if apply.is("mo", "\u{2061}"));
        let power = matches!(node.tag(), "msup" | "msubsup")
            .then(|| node.children().last().expect("two or three"))
            .filter(|exponent| exponent.tag() != "mo");
        match (power, node.tag()) {
            // sin²x
            (Some(exponent), "msup") if applies => {
                let argument = plain(&after[1..2], rows);
                out.push_str(&format!(
                    "({}{argument})^({})",
                    inner(0),
                    plain(slice::from_ref(exponent), rows)
                ));
                rest = &after[2..];
            }
            (Some(exponent), "msup") if is_euler(&node.children()[0]) => {
                out.push_str(&format!("exp({})", plain(slice::from_ref(exponent), rows)));
            }
            (Some(exponent), _) => {
                let base = match node.tag() {
                    "msup" => format!("({})", inner(0)),
                    _ => name(node, rows),
                };
                out.push_str(&format!("{base}^({})", plain(slice::from_ref(exponent), rows)));
            }
            (None, _) => out.push_str(&element(node, rows)),
        }
    }
    out
}

fn element(node: &Node, rows: &BTreeMap<String, String>) -> String {
    let children = node.children();
    let inner = |i: usize| plain(&children[i..=i], rows);
    match node.tag() {
        _ if node.symbol().is_some() => name(node, rows),
        "mi" | "mn" => match node.token() {
            "arcsin" => "asin".to_owned(),
            "arccos" => "acos".to_owned(),
            "arctan" => "atan".to_owned(),
            "sgn" => "signum".to_owned(),
            token => token.to_owned(),
        },
        "mo" => match node.token() {
            "\u{2061}" => String::new(),
            "\u{2062}" | "⋅" => "*".to_owned(),
            "−" => "-".to_owned(),
            "≤" => "<=".to_owned(),
            token => token.to_owned(),
        },
        "mspace" => "*".to_owned(),
        "mtext" => String::new(),
        "msub" | "msubsup" | "msup" | "mover" => name(node, rows),
        "mfrac" => format!("(({})/({}))", inner(0), inner(1)),
        "msqrt" => format!("sqrt({})", plain(children, rows)),
        "mroot" => format!("cbrt({})", inner(0)),
        "mrow" if children[0].is("mo", "|") => {
            format!("abs({})", plain(&children[1..children.len() - 1], rows))
        }
        "mrow" if children[0].is("mo", "{") => {
            let [then, otherwise] = children[1].children() else { panic!("{node:?}") };
            let [value, condition] = then.children() else { panic!("{node:?}") };
            let condition = plain(condition.children(), rows).replace("=", "==").replace("<==", "<=");
            let [value, otherwise] = [value, &otherwise.children()[0]].map(|x| plain(x.children(), rows));
            format!("(if {condition} {{ {value} }} else {{ {otherwise} }})")
        }
        "mrow" | "math" => plain(children, rows),
        tag => panic!("{tag}"),
    }
}

/// The name of a symbol with its dots or primes, of a definition, of a multiplier.
fn name(node: &Node, rows: &BTreeMap<String, String>) -> String {
    let all = node.all();
    let has = |token: &str| all.iter().any(|part| part.is("mo", token));
    let marks = [("˙", "'"), ("¨", "''"), ("′", "'"), ("″", "''"), ("‴", "'''")];
    let marks = marks.iter().find(|(sign, _)| has(sign)).map_or("", |(_, marks)| marks);
    if let Some(symbol) = name_of(node) {
        return format!("{symbol}{marks}");
    }
    let [letter, index, ..] = node.children() else { panic!("{node:?}") };
    match letter.token() {
        "λ" => format!("lambda[{}]", rows[&format!("{index:?}")]),
        letter => format!("{letter}{}", index.token()),
    }
}

/// The base of natural logarithms; a parameter of this name carries it.
fn is_euler(node: &Node) -> bool {
    node.is("mi", "e") && node.symbol().is_none()
}

/// The user's name that an element or something within it carries.
fn name_of(node: &Node) -> Option<&str> {
    node.all().into_iter().find_map(Node::symbol)
}

/// A paragraph as `left = right`.
fn statement(paragraph: &Node, rows: &BTreeMap<String, String>) -> Option<(String, String)> {
    let is_name = |math: &Node| math.children()[0].is("mo", "(") && math.children().len() == 3;
    let maths = paragraph.children().iter().filter(|child| child.tag() == "math");
    let mut maths: Vec<&Node> = maths.collect();
    let is_zero = |math: &&Node| math.children().last().is_some_and(|last| last.is("mn", "0"));
    // The name of a constraint follows its zero.
    if maths.len() > 2 && is_name(maths[maths.len() - 1]) && is_zero(&maths[maths.len() - 2]) {
        maths.pop();
    }
    let text: String = maths.iter().map(|math| plain(math.children(), rows)).collect();
    let (left, right) = split_equation(&text)?;
    Some((left, right))
}

/// At the sign of equality that is outside of all selections.
fn split_equation(text: &str) -> Option<(String, String)> {
    let mut depth = 0;
    for (i, c) in text.char_indices() {
        match c {
            '(' | '{' => depth += 1,
            ')' | '}' => depth -= 1,
            '=' if depth == 0 => return Some((text[..i].to_owned(), text[i + 1..].to_owned())),
            _ => {}
        }
    }
    None
}

/// Values of the definitions among statements, which follow their uses and precede each other.
fn defined(statements: &[(String, String)], known: &mut Names) {
    for (left, right) in statements {
        if left.starts_with('w') && left[1..].bytes().all(|b| b.is_ascii_digit()) {
            let value = evaluate(right, known);
            known.insert(left.clone(), value);
        }
    }
}

/// Read back, both sides of every equation have the values that those of the plain text have, which are
/// verified against the derivation.
#[test]
fn mathml_says_what_the_equations_say() {
    for c in compiled() {
        let v = values(&c.model);
        let count = c.model.constraints.iter().map(|c| c.components.len()).sum::<usize>() as u32;
        let rows = (0..count).map(|row| c.model.row_name(row));
        let rows: BTreeMap<String, String> = rows
            .map(|row| {
                let markup = symbol_mathml(&row, Dots::None);
                let parsed = parse(&markup);
                (format!("{:?}", parsed[0]), row)
            })
            .collect();
        let paragraphs = parse(&c.mathml);
        let paragraphs = paragraphs.iter().filter(|node| node.tag() == "p");
        let own: Vec<(String, String)> = paragraphs
            .filter_map(|p| statement(p, &rows))
            .filter(|(left, _)| !left.starts_with("Mq"))
            .collect();
        let text = c.equations_text.replace("\n    ", " ");
        let lines = text.lines().filter_map(|line| line.split_once(" = "));
        let unnamed = |left: &str| left.split_once(": ").map_or(left, |(_, formula)| formula).to_owned();
        let expected: Vec<(String, String)> = lines
            .map(|(left, right)| (unnamed(left), right.to_owned()))
            .filter(|(left, _)| left != "M q''")
            .collect();
        let (mut known, mut known_of_text) = (names(&c.model, &v), names(&c.model, &v));
        defined(&own, &mut known);
        defined(&expected, &mut known_of_text);
        // Energies precede definitions here and follow them there.
        let is_definition = |(left, _): &&(String, String)| known.contains_key(left) && left.starts_with('w');
        let pairs =
            own.iter().filter(|s| !is_definition(s)).zip(expected.iter().filter(|s| !is_definition(s)));
        let mut compared = 0;
        for ((left, right), (left_of_text, right_of_text)) in pairs {
            let [value, of_text] = [evaluate(right, &known), evaluate(right_of_text, &known_of_text)];
            assert!(close(value, of_text), "{}: {right} is {right_of_text}", c.model.name);
            let is_element =
                |text: &str| text.len() == 1 || "MQR".contains(&text[..1]) && text[1..].starts_with('[');
            if !is_element(left_of_text) {
                let [value, of_text] = [evaluate(left, &known), evaluate(left_of_text, &known_of_text)];
                assert!(close(value, of_text), "{}: {left} is {left_of_text}", c.model.name);
            }
            compared += 1;
        }
        let cut = c.mathml.contains("more equations");
        assert!(compared >= c.model.coordinates.len() && (cut || own.len() == expected.len()), "{compared}");
    }
}
