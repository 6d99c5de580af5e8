//! Vectors of x86-64 processors: four lanes with AVX2, eight with AVX-512.
//!
//! **Why this is sound.** An instruction that the processor lacks must not run. Values of the types here are
//! made, and their functions called, only in code that is generic over [`Lanes`]. The types are private to
//! the crate, so that such code is run with them by [`in_four_lanes`](crate::in_four_lanes),
//! [`in_widest_lanes`](crate::in_widest_lanes) and [`in_fused_lanes`](crate::in_fused_lanes) alone, after
//! [`has_four_lanes`] and [`has_eight_lanes`] have found the instructions, those of fused products among
//! them, or where the build's target has them. Loads and stores go through arrays whose length slices are
//! checked for.
//!
//! **Why this is fast.** A function that is compiled for certain instructions is not inlined into one that is
//! not, and the other way round the calls of instructions are not inlined. [`Lanes::call`] is the one border:
//! behind it everything is inlined into a function with the attribute.
#![allow(unsafe_code, reason = "instructions that the processor may lack: see the head of the file")]

use core::arch::x86_64::*;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use crate::lanes::sines as sin_cos;
use crate::lanes::{Code, Lanes};

/// Whether the build's target has the instructions of [`Avx2`], so that no border is needed.
const AVX2_BUILD: bool = cfg!(all(target_feature = "avx2", target_feature = "fma"));
/// The same for [`Avx512`].
const AVX512_BUILD: bool =
    cfg!(all(target_feature = "avx512f", target_feature = "avx512dq", target_feature = "fma"));

/// Whether the processor has the instructions of [`Avx2`].
#[inline(always)]
pub(crate) fn has_four_lanes() -> bool {
    #[cfg(feature = "std")]
    {
        AVX2_BUILD
            || std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(feature = "std"))]
    {
        AVX2_BUILD
    }
}

/// Whether the processor has the instructions of [`Avx512`].
#[inline(always)]
pub(crate) fn has_eight_lanes() -> bool {
    #[cfg(feature = "std")]
    {
        AVX512_BUILD
            || std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512dq")
                && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(feature = "std"))]
    {
        AVX512_BUILD
    }
}

/// Four numbers in one vector of 256 bits. `FUSES`: products are fused, whatever the target of the build is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2<const FUSES: bool>(__m256d);

/// All bits of a lane, or none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2Mask(__m256d);

/// Eight numbers in one vector of 512 bits. `FUSES`: as of [`Avx2`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512<const FUSES: bool>(__m512d);

/// One bit per lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512Mask(__mmask8);

/// Functions that are one instruction of the type's vectors.
macro_rules! instructions {
    ($type:ident: $add:ident $sub:ident $mul:ident $div:ident) => {
        instructions! { operator $type Add add $add }
        instructions! { operator $type Sub sub $sub }
        instructions! { operator $type Mul mul $mul }
        instructions! { operator $type Div div $div }
    };
    (operator $type:ident $trait:ident $function:ident $instruction:ident) => {
        impl<const FUSES: bool> $trait for $type<FUSES> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                // SAFETY: the type exists only where its instructions do.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    };
}

instructions! { Avx2: _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_div_pd }
instructions! { Avx512: _mm512_add_pd _mm512_sub_pd _mm512_mul_pd _mm512_div_pd }

impl<const FUSES: bool> Neg for Avx2<FUSES> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_xor_pd(self.0, _mm256_set1_pd(-0.0)) })
    }
}

impl<const FUSES: bool> Neg for Avx512<FUSES> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm512_xor_pd(self.0, _mm512_set1_pd(-0.0)) })
    }
}

impl<const FUSES: bool> PartialEq for Avx2<FUSES> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.array() == other.array()
    }
}

impl<const FUSES: bool> PartialEq for Avx512<FUSES> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.array() == other.array()
    }
}

impl BitAnd for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_and_pd(self.0, other.0) })
    }
}

impl BitOr for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_or_pd(self.0, other.0) })
    }
}

impl Not for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_xor_pd(self.0, _mm256_castsi256_pd(_mm256_set1_epi64x(-1))) })
    }
}

impl BitAnd for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl<const FUSES: bool> Lanes for Avx2<FUSES> {
    const COUNT: usize = 4;
    const FUSED: bool = FUSES || sin_cos::FUSED;
    type Mask = Avx2Mask;

    #[inline(always)]
    fn call<C: Code>(code: C) -> C::Output {
        #[target_feature(enable = "avx2,fma")]
        fn compiled<C: Code>(code: C) -> C::Output {
            code.run()
        }
        if AVX2_BUILD {
            return code.run();
        }
        // SAFETY: the type exists only where its instructions do.
        unsafe { compiled(code) }
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_set1_pd(x) })
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        let from: &[f64; 4] = from.first_chunk().expect("four numbers");
        // SAFETY: the type exists only where its instructions do, and an array of four is read.
        Self(unsafe { _mm256_loadu_pd(from.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        let to: &mut [f64; 4] = to.first_chunk_mut().expect("four numbers");
        // SAFETY: the type exists only where its instructions do, and an array of four is written.
        unsafe { _mm256_storeu_pd(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        if !Self::FUSED {
            return self * b + c;
        }
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_fmadd_pd(self.0, b.0, c.0) })
    }
    #[inline(always)]
    fn less(self, other: Self) -> Avx2Mask {
        // SAFETY: the type exists only where its instructions do.
        Avx2Mask(unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> Avx2Mask {
        // SAFETY: the type exists only where its instructions do.
        Avx2Mask(unsafe { _mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn mask(bits: u32) -> Avx2Mask {
        // SAFETY: the type exists only where its instructions do.
        unsafe {
            let lanes = _mm256_set_epi64x(8, 4, 2, 1);
            let chosen = _mm256_and_si256(_mm256_set1_epi64x(i64::from(bits)), lanes);
            Avx2Mask(_mm256_castsi256_pd(_mm256_cmpeq_epi64(chosen, lanes)))
        }
    }
    #[inline(always)]
    fn bits(mask: Avx2Mask) -> u32 {
        // SAFETY: the type exists only where its instructions do.
        unsafe { _mm256_movemask_pd(mask.0) as u32 }
    }
    #[inline(always)]
    fn or(self, mask: Avx2Mask, other: Self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm256_blendv_pd(other.0, self.0, mask.0) })
    }
    #[inline(always)]
    fn turn(quarter: Self, sine: Self, cosine: Self) -> (Self, Self) {
        // SAFETY: the type exists only where its instructions do.
        unsafe {
            let quarter = _mm256_castpd_si256(quarter.0);
            // The sign bit decides which of two a blend takes: it is the last bit of the quarter.
            let odd = _mm256_castsi256_pd(_mm256_slli_epi64::<63>(quarter));
            let second = _mm256_castsi256_pd(_mm256_slli_epi64::<62>(quarter));
            let sign = _mm256_set1_pd(-0.0);
            let of_sine = _mm256_and_pd(second, sign);
            // Bit 1 of quarter + 1.
            let of_cosine = _mm256_and_pd(_mm256_xor_pd(second, odd), sign);
            (
                Self(_mm256_xor_pd(_mm256_blendv_pd(sine.0, cosine.0, odd), of_sine)),
                Self(_mm256_xor_pd(_mm256_blendv_pd(cosine.0, sine.0, odd), of_cosine)),
            )
        }
    }
}

impl<const FUSES: bool> Lanes for Avx512<FUSES> {
    const COUNT: usize = 8;
    const FUSED: bool = FUSES || sin_cos::FUSED;
    type Mask = Avx512Mask;

    #[inline(always)]
    fn call<C: Code>(code: C) -> C::Output {
        #[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
        fn compiled<C: Code>(code: C) -> C::Output {
            code.run()
        }
        if AVX512_BUILD {
            return code.run();
        }
        // SAFETY: the type exists only where its instructions do.
        unsafe { compiled(code) }
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm512_set1_pd(x) })
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        let from: &[f64; 8] = from.first_chunk().expect("eight numbers");
        // SAFETY: the type exists only where its instructions do, and an array of eight is read.
        Self(unsafe { _mm512_loadu_pd(from.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        let to: &mut [f64; 8] = to.first_chunk_mut().expect("eight numbers");
        // SAFETY: the type exists only where its instructions do, and an array of eight is written.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm512_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm512_andnot_pd(_mm512_set1_pd(-0.0), self.0) })
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        if !Self::FUSED {
            return self * b + c;
        }
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm512_fmadd_pd(self.0, b.0, c.0) })
    }
    #[inline(always)]
    fn less(self, other: Self) -> Avx512Mask {
        // SAFETY: the type exists only where its instructions do.
        Avx512Mask(unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> Avx512Mask {
        // SAFETY: the type exists only where its instructions do.
        Avx512Mask(unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn mask(bits: u32) -> Avx512Mask {
        Avx512Mask(bits as __mmask8)
    }
    #[inline(always)]
    fn bits(mask: Avx512Mask) -> u32 {
        u32::from(mask.0)
    }
    #[inline(always)]
    fn or(self, mask: Avx512Mask, other: Self) -> Self {
        // SAFETY: the type exists only where its instructions do.
        Self(unsafe { _mm512_mask_blend_pd(mask.0, other.0, self.0) })
    }
    #[inline(always)]
    fn turn(quarter: Self, sine: Self, cosine: Self) -> (Self, Self) {
        // SAFETY: the type exists only where its instructions do.
        unsafe {
            let quarter = _mm512_castpd_si512(quarter.0);
            let odd = _mm512_test_epi64_mask(quarter, _mm512_set1_epi64(1));
            let first = _mm512_castsi512_pd(_mm512_slli_epi64::<63>(quarter));
            let second = _mm512_castsi512_pd(_mm512_slli_epi64::<62>(quarter));
            let sign = _mm512_set1_pd(-0.0);
            let of_sine = _mm512_and_pd(second, sign);
            // Bit 1 of quarter + 1.
            let of_cosine = _mm512_and_pd(_mm512_xor_pd(second, first), sign);
            (
                Self(_mm512_xor_pd(_mm512_mask_blend_pd(odd, sine.0, cosine.0), of_sine)),
                Self(_mm512_xor_pd(_mm512_mask_blend_pd(odd, cosine.0, sine.0), of_cosine)),
            )
        }
    }
}
