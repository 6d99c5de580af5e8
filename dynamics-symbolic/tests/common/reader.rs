//! Reads the plain texts back and evaluates them: a second route to what they claim.

use std::collections::BTreeMap;

/// Values of names.
pub type Names = BTreeMap<String, f64>;

/// Evaluates a formula such as `(m1 + m2) l1^2 theta1''` or `c1*sin(x)/v2`.
pub fn evaluate(text: &str, names: &Names) -> f64 {
    let mut reader = Reader { text, at: 0, names };
    let value = reader.sum();
    reader.space();
    assert_eq!(reader.at, text.len(), "left over: {:?} of {text:?}", &text[reader.at..]);
    value
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    names: &'a Names,
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }
    fn space(&mut self) {
        self.at += self.rest().len() - self.rest().trim_start().len();
    }
    fn take(&mut self, sign: &str) -> bool {
        self.space();
        let there = self.rest().starts_with(sign);
        self.at += if there { sign.len() } else { 0 };
        there
    }
    fn need(&mut self, sign: &str) {
        assert!(self.take(sign), "expected {sign:?} at {:?}", self.rest());
    }

    fn sum(&mut self) -> f64 {
        if self.take("if ") {
            return self.choice();
        }
        let mut value = if self.take("-") { -self.product() } else { self.product() };
        loop {
            if self.take("+") {
                value += self.product();
            } else if self.take("-") {
                value -= self.product();
            } else {
                return value;
            }
        }
    }

    fn choice(&mut self) -> f64 {
        let left = self.sum();
        let holds = if self.take("<=") {
            left <= self.sum()
        } else if self.take("<") {
            left < self.sum()
        } else {
            self.need("==");
            left == self.sum()
        };
        self.need("{");
        let then = self.sum();
        self.need("}");
        self.need("else");
        self.need("{");
        let otherwise = self.sum();
        self.need("}");
        if holds { then } else { otherwise }
    }

    fn product(&mut self) -> f64 {
        let mut value = self.power();
        loop {
            if self.take("*") {
                value *= self.power();
            } else if self.take("/") {
                value /= self.power();
            } else {
                self.space();
                // Juxtaposition.
                match self.rest().chars().next() {
                    Some(c) if c.is_alphanumeric() || c == '(' => value *= self.power(),
                    _ => return value,
                }
            }
        }
    }

    fn power(&mut self) -> f64 {
        let base = self.atom();
        if self.take("^") { base.powf(self.atom()) } else { base }
    }

    fn atom(&mut self) -> f64 {
        if self.take("(") {
            let value = self.sum();
            self.need(")");
            return value;
        }
        self.space();
        let rest = self.rest();
        if rest.starts_with(|c: char| c.is_ascii_digit()) {
            let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
            let (number, after) = rest.split_at(end);
            let exponent = after
                .strip_prefix('e')
                .map_or(0, |e| 1 + e.find(|c: char| !c.is_ascii_digit() && c != '-').unwrap_or(e.len()));
            let value = format!("{number}{}", &after[..exponent]).parse().expect("a number");
            self.at += end + exponent;
            return value;
        }
        let name = self.name();
        if self.rest().starts_with('(') {
            self.at += 1;
            let first = self.sum();
            let second = if self.take(",") { self.sum() } else { f64::NAN };
            self.need(")");
            return function(&name, first, second);
        }
        *self.names.get(&name).unwrap_or_else(|| panic!("no value for {name:?} in {:?}", self.text))
    }

    fn name(&mut self) -> String {
        let rest = self.rest();
        let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_' && c != '.').unwrap_or(rest.len());
        let mut bracket = 0;
        // `lambda[closure[1]]`: brackets may be nested.
        while rest[word + bracket..].starts_with('[') {
            let mut depth = 0;
            let closes = |c: char| {
                depth += i32::from(c == '[') - i32::from(c == ']');
                depth == 0
            };
            bracket += rest[word + bracket..].find(closes).expect("a bracket") + 1;
        }
        let primes = rest[word + bracket..].chars().take_while(|c| *c == '\'').count();
        let end = word + bracket + primes;
        let name = rest[..end].to_owned();
        assert!(!name.is_empty(), "expected a name at {rest:?} of {:?}", self.text);
        self.at += end;
        name
    }
}

fn function(name: &str, a: f64, b: f64) -> f64 {
    match name {
        "sin" => a.sin(),
        "cos" => a.cos(),
        "tan" => a.tan(),
        "asin" => a.asin(),
        "acos" => a.acos(),
        "atan" => a.atan(),
        "sinh" => a.sinh(),
        "cosh" => a.cosh(),
        "tanh" => a.tanh(),
        "exp" => a.exp(),
        "ln" => a.ln(),
        "sqrt" => a.sqrt(),
        "cbrt" => a.cbrt(),
        "abs" => a.abs(),
        "signum" => a.signum(),
        "atan2" => a.atan2(b),
        "hypot" => a.hypot(b),
        "min" => a.min(b),
        "max" => a.max(b),
        // The smooth functions of `Values`: sin(x) + x/2 and its derivatives.
        _ => match name.chars().filter(|c| *c == '\'').count() {
            0 => a.sin() + a / 2.0,
            1 => a.cos() + 0.5,
            2 => -a.sin(),
            _ => -a.cos(),
        },
    }
}
