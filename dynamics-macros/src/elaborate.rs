//! The Rust subset of models → `dynamics_symbolic::mechanics::Model`.
//!
//! An interpreter over `syn`'s tree: values are nodes of the expression graph, integers and conditions that
//! are known now are decided now, and what the motion decides becomes a selection. Every mistake is reported
//! where it stands and poisons its value, so that nothing that follows from it is reported again. Nothing
//! here may recurse or loop without bound: see the limits in `expressions.rs`, `control.rs` and
//! `syntax/limits.rs`.

mod assumptions;
mod bodies;
mod calls;
mod constraints;
mod control;
mod declare;
mod derivative;
mod dimensions;
mod drawing;
mod expressions;
mod families;
mod findings;
mod integer_types;
mod integers;
mod operators;
mod origins;
mod outside;
mod paths;
mod patterns;
mod records;
mod roles;
mod rotations;
mod scalar_methods;
mod scope;
mod sequence_methods;
mod speeds;
mod statements;
mod terms;
mod values;
mod vector_methods;

use std::collections::{BTreeMap, BTreeSet};
use std::mem;

use dynamics_symbolic::families::{FamilyModel, Range};
use dynamics_symbolic::mechanics::Model;
use quote::ToTokens;

use crate::assertions::{Constants, TakenForLibrary, TakenForStd};
use crate::diagnostics::Diagnostics;
use crate::library::Library;
use crate::syntax::{Declaration, Implementation, Role};
use constraints::DeclaredConstraint;
use dimensions::Dimensions;
use families::Families;
pub(crate) use families::hulls;
pub(crate) use origins::Origins;
pub(crate) use roles::is_generated;
use scope::Frame;
use values::{UnitOf, Value};

/// What elaboration hands to the engine, and what the engine's findings need to find their way back.
pub(crate) struct Elaborated {
    pub(crate) model: Model,
    pub(crate) origins: Origins,
    /// Helpers that return vectors which by their units are no places.
    pub(crate) vectors: Vec<syn::Ident>,
    pub(crate) constants: Constants,
}

/// Unit of a smooth function's argument, unit of its values.
type FunctionUnits = (UnitOf, UnitOf);

/// Elaboration in progress.
struct Elaborator<'a> {
    declaration: &'a Declaration,
    implementation: &'a Implementation,
    library: &'a Library,
    /// What the macros of drawings contain.
    parsed: &'a drawing::Parsed,
    diagnostics: &'a mut Diagnostics,
    sums: Sums,
    /// What the functions with roles add up.
    terms: Vec<terms::Added<'a>>,
    model: Model,
    origins: Origins,
    dimensions: Dimensions,
    /// `self.name`.
    parameters: Vec<(String, Value)>,
    /// `q.name`.
    coordinates: Vec<(String, Value)>,
    functions: Vec<FunctionUnits>,
    /// Numbered coordinates, where the model has some.
    families: Families,
    /// `Self::NAME`, once evaluated.
    constants: Vec<Option<Value>>,
    /// Paths that were taken for constants of std's.
    taken: Vec<TakenForStd>,
    /// Paths that were taken for types and functions of the library.
    taken_words: Vec<TakenForLibrary>,
    frames: Vec<Frame>,
    /// Types of integers.
    inference: integers::Inference,
    /// Matrices that are known to turn, and how.
    rotations: rotations::Rotations,
    /// Vectors of which it is known how they were carried into the world.
    places: bodies::Places,
    /// Rigid bodies that have energies.
    bodies: bodies::Bodies,
    /// What is taken for granted of bodies and frames.
    assumptions: assumptions::Assumptions,
    /// The constraints so far.
    constraints: Vec<DeclaredConstraint>,
    /// The generalized speeds so far.
    speeds: Vec<speeds::Defined>,
    /// The role whose function is being elaborated, with all that it calls.
    role: Role,
    /// The picture while it is followed, with the words that only drawings have.
    picture: Option<drawing::DrawingState<'a>>,
    /// Functions that some role has called.
    reached: BTreeSet<usize>,
    /// Units of the vectors that helpers have returned.
    returned: BTreeMap<usize, Vec<UnitOf>>,
    steps: usize,
    depth: usize,
    /// A limit is passed and reported; everything that is left is skipped.
    exhausted: bool,
}

/// Elaborates all functions that have a role.
pub(crate) fn elaborate(
    declaration: &Declaration,
    implementation: &Implementation,
    diagnostics: &mut Diagnostics,
) -> Elaborated {
    elaborate_sums(declaration, implementation, Sums::Whole, Families::default(), diagnostics)
}

/// Elaborates a model with families unrolled: with counts of these values. Its declaration is that at these
/// counts.
pub(crate) fn elaborate_unrolled(
    declaration: &Declaration,
    implementation: &Implementation,
    counts: &[i64],
    diagnostics: &mut Diagnostics,
) -> Elaborated {
    let families = Families { values: counts.to_vec(), ..Families::default() };
    elaborate_sums(declaration, implementation, Sums::Whole, families, diagnostics)
}

/// A model with families, element by element.
pub(crate) struct ElaboratedFamilies {
    pub(crate) family: FamilyModel,
    pub(crate) origins: Origins,
    /// For helpers `(&self, q, index)`: the indices for which they are called, by the number of the function.
    pub(crate) called: Vec<(usize, Vec<Range>)>,
}

/// Elaborates all functions of a model with families that have a role.
pub(crate) fn elaborate_families(
    declaration: &Declaration,
    implementation: &Implementation,
    diagnostics: &mut Diagnostics,
) -> ElaboratedFamilies {
    let families = Families { symbolic: true, ..Families::default() };
    let library = Library::needed_by(implementation.functions.iter().map(|f| f.item.block.to_token_stream()));
    let parsed = drawing::Parsed::default();
    let known = (&library, &parsed);
    let mut elaborator =
        Elaborator::new(declaration, implementation, known, Sums::Whole, families, diagnostics);
    elaborator.declare();
    elaborator.roles();
    elaborator.check_integers();
    elaborator.check_families();
    elaborator.name_inferred_units();
    elaborator.note_scalars();
    elaborator.note_places();
    let Elaborator { model, families, origins, .. } = elaborator;
    let family = FamilyModel { model, ..families.found };
    ElaboratedFamilies { family, origins, called: families.called }
}

/// The same with every term of an energy or a force by itself, for the engine to find those at fault.
pub(crate) fn elaborate_terms(declaration: &Declaration, implementation: &Implementation) -> Elaborated {
    let mut known = Diagnostics::new();
    let elaborated =
        elaborate_sums(declaration, implementation, Sums::Apart, Families::default(), &mut known);
    // What could not be elaborated was reported before.
    let _ = known.finish();
    elaborated
}

/// Whether sums go to the engine as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sums {
    Whole,
    Apart,
}

fn elaborate_sums(
    declaration: &Declaration,
    implementation: &Implementation,
    sums: Sums,
    families: Families,
    diagnostics: &mut Diagnostics,
) -> Elaborated {
    let library = Library::needed_by(implementation.functions.iter().map(|f| f.item.block.to_token_stream()));
    let is_whole = sums == Sums::Whole && families.values.is_empty();
    let parsed = drawing::Parsed::default();
    let known = (&library, &parsed);
    let mut elaborator = Elaborator::new(declaration, implementation, known, sums, families, diagnostics);
    elaborator.declare();
    elaborator.check_speeds_are_defined();
    elaborator.roles();
    elaborator.check_integers();
    elaborator.add_speeds();
    elaborator.name_inferred_units();
    elaborator.name_constraint_units();
    elaborator.readers_outside();
    elaborator.note_angle_sets();
    elaborator.place_bodies();
    elaborator.place_assumptions();
    let followed = elaborator.followed();
    let (taken, words) = (elaborator.taken.clone(), elaborator.taken_words.clone());
    let constants = Constants { followed, taken, words };
    let shows = is_whole && elaborator.diagnostics.len() == 0 && elaborator.has_picture();
    if !elaborator.has_unread_places() && !shows {
        let vectors = elaborator.vectors_that_are_no_places();
        return Elaborated { model: elaborator.model, origins: elaborator.origins, vectors, constants };
    }
    let (mut model, origins) = (elaborator.model.clone(), elaborator.origins.clone());
    let known = mem::replace(elaborator.diagnostics, Diagnostics::new());
    if elaborator.has_unread_places() {
        elaborator.note_units_of_unread_places();
    }
    let vectors = elaborator.vectors_that_are_no_places();
    let unread = mem::replace(elaborator.diagnostics, known);
    // What no role reaches may hold what cannot be derived.
    let _ = unread.finish();
    model.picture = shows.then(|| elaborator.picture());
    Elaborated { model, origins, vectors, constants }
}

impl<'a> Elaborator<'a> {
    fn new(
        declaration: &'a Declaration,
        implementation: &'a Implementation,
        (library, parsed): (&'a Library, &'a drawing::Parsed),
        sums: Sums,
        families: Families,
        diagnostics: &'a mut Diagnostics,
    ) -> Self {
        Self {
            declaration,
            implementation,
            library,
            parsed,
            diagnostics,
            sums,
            terms: Vec::new(),
            model: Model { name: declaration.name.to_string(), ..Model::default() },
            origins: Origins::default(),
            dimensions: Dimensions::default(),
            parameters: Vec::new(),
            coordinates: Vec::new(),
            functions: Vec::new(),
            families,
            constants: Vec::new(),
            taken: Vec::new(),
            taken_words: Vec::new(),
            frames: Vec::new(),
            inference: integers::Inference::default(),
            rotations: rotations::Rotations::new(),
            places: bodies::Places::default(),
            bodies: bodies::Bodies::default(),
            assumptions: assumptions::Assumptions::default(),
            constraints: Vec::new(),
            speeds: Vec::new(),
            role: Role::Helper,
            picture: None,
            reached: BTreeSet::new(),
            returned: BTreeMap::new(),
            steps: 0,
            depth: 0,
            exhausted: false,
        }
    }
}
