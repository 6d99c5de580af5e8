//! The functions of `rivals.c`.

macro_rules! rivals {
    ($($name:ident $fast:ident ($($argument:ident: $type:ty),*);)*) => {
        unsafe extern "C" {
            $(pub fn $name($($argument: $type),*);
            pub fn $fast($($argument: $type),*);)*
        }
    };
}

rivals! {
    string_scattering string_scattering_fast(
        n: usize, pitch: f64, ea: f64, tension: f64, inverse: *const f64, q: *const f64, a: *mut f64);
    string_by_nodes string_by_nodes_fast(
        n: usize, pitch: f64, ea: f64, tension: f64, inverse: *const f64, q: *const f64, a: *mut f64);
    chain_by_nodes chain_by_nodes_fast(
        n: usize, k: f64, beta: f64, inverse: *const f64, s: *const f64, a: *mut f64);
    chain_scattering chain_scattering_fast(
        n: usize, k: f64, beta: f64, inverse: *const f64, s: *const f64, a: *mut f64);
    tridiagonal_factor tridiagonal_factor_fast(
        n: usize, diagonal: *const f64, beside: f64, l: *mut f64, p: *mut f64);
    bar_consistent bar_consistent_fast(
        n: usize, stiffness: f64, l: *const f64, p: *const f64, s: *const f64, a: *mut f64);
    beam_scattering beam_scattering_fast(
        n: usize, h: f64, ea: f64, ga: f64, ei: f64, inverse: *const f64, q: *const f64, a: *mut f64);
    string_newton string_newton_fast(
        n: usize, pitch: f64, ea: f64, tension: f64, mass: *const f64, q: *const f64, diagonal: *mut f64,
        beside: *mut f64, r: *mut f64);
    triad triad_fast(n: usize, factor: f64, b: *const f64, c: *const f64, a: *mut f64);
}
