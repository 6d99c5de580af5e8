//! What a case is: a model as text, and what is expected of it.

use std::path::Path;

use crate::generate::{self, Generated};
use crate::kinds;
use crate::mistakes;
use crate::random::Random;

/// What has to come of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expectation {
    /// It compiles without a warning, and agrees with its own functions.
    Runs,
    /// It is refused by one error.
    Refused,
    /// One or the other.
    Either,
}

/// A model of a package.
#[derive(Clone, Debug)]
pub struct Case {
    /// The name of its module.
    pub module: String,
    /// How it is told: `case 17`, or the file in `defects/`.
    pub title: String,
    pub text: String,
    pub expectation: Expectation,
    /// It is larger than models usually are: it may be refused as too large.
    pub is_large: bool,
}

/// Once in this many models there is a mistake.
const ONE_MISTAKE_IN: usize = 12;

impl Case {
    /// The case of a number: a model, and sometimes its twin, another Lagrangian of the same motions.
    #[must_use]
    pub fn random(case: u64) -> Vec<Self> {
        if case >= kinds::FIRST {
            let (module, title) = (format!("case_{case}"), format!("case {case}"));
            return vec![Self {
                module,
                title,
                text: kinds::model(case),
                expectation: Expectation::Runs,
                is_large: false,
            }];
        }
        let mut random = Random::new(case.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ 0x5bd1_e995);
        let mistaken = random.one_in(ONE_MISTAKE_IN);
        let mut further = Random::new(case.wrapping_mul(0x9fb2_1c65_1e98_df25) ^ 0x2c1b_3c6d);
        let Generated { mut text, twin, mut expectation } = generate::model(&mut random, &mut further);
        let (module, title) = (format!("case_{case}"), format!("case {case}"));
        if mistaken && expectation == Expectation::Runs {
            text = mistakes::with_mistake(&text, &mut random);
            return vec![Self { module, title, text, expectation: Expectation::Refused, is_large: false }];
        }
        let twin = twin.map(|text| {
            let (module, title) = (format!("case_{case}_twin"), format!("case {case}, its twin"));
            Self { module, title, text, expectation: Expectation::Runs, is_large: false }
        });
        if twin.is_some() {
            expectation = Expectation::Runs;
        }
        std::iter::once(Self { module, title, text, expectation, is_large: false }).chain(twin).collect()
    }
}

/// The models of `defects/`: each was found by a random model, or should have been.
#[must_use]
pub fn defects() -> Vec<Case> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("defects");
    let mut files: Vec<_> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|f| f.path()).collect();
    files.sort();
    files
        .into_iter()
        .filter_map(|path| {
            let text = std::fs::read_to_string(&path).ok()?;
            let name = path.file_stem()?.to_str()?.to_owned();
            let expectation = match text.lines().find_map(|line| line.strip_prefix("// expect: ")) {
                Some("runs") => Expectation::Runs,
                Some("refused") => Expectation::Refused,
                _ => Expectation::Either,
            };
            Some(Case {
                module: format!("defect_{name}"),
                title: format!("defects/{name}.rs"),
                text,
                expectation,
                is_large: false,
            })
        })
        .collect()
}
