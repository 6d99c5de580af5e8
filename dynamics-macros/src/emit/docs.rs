//! Documentation of what is generated: it shows in the rustdoc of the user's crate.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::{Slot, Surface};

/// A derive attribute that does not depend on what the user's crate calls `derive` or `Clone`.
pub(super) fn derive(private: &TokenStream, traits: &[&str]) -> TokenStream {
    let traits = traits.iter().map(|t| format_ident!("{t}"));
    quote!(#[#private::derive(#(#private::#traits),*)])
}

fn unit(slot: &Slot) -> String {
    if slot.unit.is_empty() { String::new() } else { format!(", in {}", slot.unit) }
}

fn elements(slot: &Slot) -> String {
    slot.len.map_or_else(String::new, |n| format!(", {n} elements"))
}

/// A coordinate.
pub(super) fn coordinate(slot: &Slot) -> String {
    format!("Generalized coordinate `{}`{}{}.", slot.text(), elements(slot), unit(slot))
}

/// Where the search for a coordinate starts.
pub(super) fn guess(slot: &Slot) -> String {
    format!(
        "Sets where the search for `{0}` starts when the state is assembled: with several solutions the \
         guess decides. {1}",
        slot.text(),
        coordinate(slot)
    )
}

/// An input.
pub(super) fn input(slot: &Slot) -> String {
    format!("Input `{}`{}{}.", slot.text(), elements(slot), unit(slot))
}

/// The generalized velocity of a coordinate.
pub(super) fn rate(slot: &Slot) -> String {
    let unit = if slot.unit.is_empty() { String::new() } else { format!(", in {}/s", slot.unit) };
    format!("Generalized velocity of `{}`{}{unit}.", slot.text(), elements(slot))
}

/// A generalized speed.
pub(super) fn speed(slot: &Slot) -> String {
    format!(
        "Sets the generalized speed `{0}`{1}{2}. With some speed given, those that are not are 0, and all \
         velocities follow from them and from the constraints: rates are then not given.",
        slot.text(),
        elements(slot),
        unit(slot)
    )
}

/// Which element of q, u or the inputs holds what.
pub(super) fn order(slots: &[Slot]) -> String {
    let names: Vec<String> = slots
        .iter()
        .map(|slot| match slot.len {
            None => format!("`{}`", slot.text()),
            Some(n) => format!("`{0}[0]` … `{0}[{1}]`", slot.text(), n.saturating_sub(1)),
        })
        .collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// The state struct.
pub(super) fn state(surface: &Surface) -> String {
    format!(
        "State of [`{}`]: time, generalized coordinates, generalized velocities and inputs, with an accessor \
         for every name.",
        surface.name
    )
}
