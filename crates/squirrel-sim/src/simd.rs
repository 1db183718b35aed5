//! Registers, and the one place that asks the processor what it can do.
//!
//! A register ([`Register`]) holds one number of each of several vehicles, or of several windows of
//! a network. Work that is generic over it ([`Kernel`]) is run on the widest registers there are,
//! without being compiled for one machine. All operations are rounded the same way on every path
//! and there is no fused multiply-add, so the paths differ in speed only.
//!
//! `unsafe` is here, because intrinsics may run only where the processor has them, and in
//! `exchange.rs` of `squirrel-batch`. The types of a path are private to this module and only [`Paths::run`]
//! hands them out, and a [`Path`] that the processor lacks cannot be made.

pub use squirrel_core::lane::{BLOCK, Register};

use squirrel_core::lane::Portable;
use squirrel_core::math::Real;

/// Work that is the same on registers of any width.
pub trait Kernel<S> {
    /// What comes out; the same bits for every `L`.
    type Output;
    /// The work. To be marked `inline(always)`, as all that it calls in its inner loops: code is
    /// compiled for the features of the function that it ends up in.
    fn run<L: Register<Element = S>>(self) -> Self::Output;
}

/// Registers that the processor has. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Path(Width);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Width {
    Scalar,
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    const ALL: &[Self] = &[
        Self::Scalar,
        Self::Portable,
        #[cfg(target_arch = "x86_64")]
        Self::Avx2,
        #[cfg(target_arch = "x86_64")]
        Self::Avx512,
    ];

    fn is_there(self) -> bool {
        match self {
            Self::Scalar | Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => std::arch::is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => std::arch::is_x86_feature_detected!("avx512f"),
        }
    }
}

impl Path {
    /// What this processor has, slowest first. The first two need nothing and are always there.
    pub fn available() -> Vec<Self> {
        Width::ALL.iter().filter(|width| width.is_there()).map(|width| Self(*width)).collect()
    }

    /// The fastest that this processor has.
    pub fn best() -> Self {
        Self::available().pop().unwrap_or(Self(Width::Portable))
    }

    /// `scalar` (one number), `portable` (four), `avx2` (32 bytes) or `avx512` (64 bytes).
    pub fn name(self) -> &'static str {
        match self.0 {
            Width::Scalar => "scalar",
            Width::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => "avx512",
        }
    }
}

/// Scalars that have paths.
pub trait Paths: Real + Register<Element = Self> {
    /// Runs a kernel on the registers of a path.
    fn run<K: Kernel<Self>>(path: Path, kernel: K) -> K::Output;
}

macro_rules! paths {
    ($scalar:ty, $width:literal, $avx2:ident, $avx512:ident) => {
        impl Paths for $scalar {
            fn run<K: Kernel<Self>>(path: Path, kernel: K) -> K::Output {
                match path.0 {
                    Width::Scalar => kernel.run::<Self>(),
                    Width::Portable => kernel.run::<Portable<Self, $width>>(),
                    #[cfg(target_arch = "x86_64")]
                    Width::Avx2 => x86::$avx2(kernel),
                    #[cfg(target_arch = "x86_64")]
                    Width::Avx512 => x86::$avx512(kernel),
                }
            }
        }
    };
}
paths!(f32, 4, avx2_f32, avx512_f32);
paths!(f64, 2, avx2_f64, avx512_f64);

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "intrinsics; each use says why the processor has them")]
mod x86 {
    use super::Kernel;
    use core::arch::x86_64 as intrinsic;
    use core::ops::{Add, Div, Mul, Sub};
    use squirrel_core::lane::{
        BLOCK, Lane, ROUND_F32, ROUND_F64, Register, THIRD_F32, THIRDS_F32, net_tanh,
    };

    macro_rules! register {
        (
            $entry:ident $feature:literal $register:ident($inner:ident) [$scalar:ident; $width:literal]
            $splat:ident $lower:ident $upper:ident $load:ident $store:ident $root:ident
            $($trait:ident $method:ident $operation:ident),*;
            $activation:expr;
            ($zeros:ident, $x:ident, $then:ident, $otherwise:ident) => $select:expr, $any:expr;
            $round:ident $power:expr; $guess:expr; $split:expr
        ) => {
            /// A value of this type exists only inside of the entry beside it.
            #[derive(Clone, Copy)]
            struct $register(intrinsic::$inner);

            pub(super) fn $entry<K: Kernel<$scalar>>(kernel: K) -> K::Output {
                #[target_feature(enable = $feature)]
                fn inside<K: Kernel<$scalar>>(kernel: K) -> K::Output {
                    kernel.run::<$register>()
                }
                // SAFETY: only `Paths::run` calls this, with a `Path` that was made after the
                // processor said that it has this feature.
                unsafe { inside(kernel) }
            }

            $(impl $trait for $register {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: values of this type exist only where the processor has its
                    // instructions.
                    Self(unsafe { intrinsic::$operation(self.0, other.0) })
                }
            })*

            impl Lane for $register {
                type Element = $scalar;
                #[inline(always)]
                fn splat(element: $scalar) -> Self {
                    // SAFETY: called by kernels only, and those run on this type only inside of its
                    // entry.
                    Self(unsafe { intrinsic::$splat(element) })
                }
                #[inline(always)]
                fn of(constant: f64) -> Self {
                    Self::splat(constant as $scalar)
                }
                #[inline(always)]
                fn lower(self, bound: Self) -> Self {
                    // The second operand where one is NaN, as `math::lower` does.
                    // SAFETY: values of this type exist only where the processor has its
                    // instructions.
                    Self(unsafe { intrinsic::$lower(self.0, bound.0) })
                }
                #[inline(always)]
                fn upper(self, bound: Self) -> Self {
                    // SAFETY: as for `lower`.
                    Self(unsafe { intrinsic::$upper(self.0, bound.0) })
                }
                #[inline(always)]
                fn root(self) -> Self {
                    // SAFETY: as for `lower`.
                    Self(unsafe { intrinsic::$root(self.0) })
                }
                #[inline(always)]
                fn where_positive(self, then: Self, otherwise: Self) -> Self {
                    let ($zeros, $x, $then, $otherwise) = (Self::of(0.0).0, self.0, then.0, otherwise.0);
                    // SAFETY: as for `lower`.
                    Self(unsafe { $select })
                }
                #[inline(always)]
                fn any_positive(self) -> bool {
                    let ($zeros, $x) = (Self::of(0.0).0, self.0);
                    // SAFETY: as for `lower`.
                    unsafe { $any }
                }
                #[inline(always)]
                fn nearest_and_power_of_two(self) -> (Self, Self) {
                    let rounded = self + Self::splat($round);
                    // SAFETY: as for `lower`.
                    (rounded - Self::splat($round), Self(unsafe { $power(rounded.0) }))
                }
                #[inline(always)]
                fn inverse_cube_root_guess(self) -> Self {
                    // SAFETY: as for `lower`.
                    Self(unsafe { $guess(self.0) })
                }
                #[inline(always)]
                fn mantissa_and_exponent(self) -> (Self, Self) {
                    // SAFETY: as for `lower`.
                    let (mantissa, exponent) = unsafe { $split(self.0) };
                    (Self(mantissa), Self(exponent))
                }
                #[inline(always)]
                fn activation(self) -> Self {
                    $activation(self)
                }
            }

            impl Register for $register {
                const WIDTH: usize = $width;
                #[inline(always)]
                fn load(from: &[$scalar]) -> Self {
                    let from = &from[..$width];
                    // SAFETY: the slice has as many numbers as are read, alignment is not needed;
                    // else as for `splat`.
                    Self(unsafe { intrinsic::$load(from.as_ptr()) })
                }
                #[inline(always)]
                fn store(self, to: &mut [$scalar]) {
                    let to = &mut to[..$width];
                    // SAFETY: the slice has as many numbers as are written, alignment is not
                    // needed; else as for `lower`.
                    unsafe { intrinsic::$store(to.as_mut_ptr(), self.0) };
                }
            }
        };
    }

    /// The functions on bits, in the integers of a register.
    macro_rules! bits {
        (
            $power:ident $guess:ident $split:ident $feature:literal $register:ident
            $to:ident $from:ident $left:ident $right:ident $and:ident $or:ident $add:ident $sub:ident $splat:ident $set:ident
            $mantissa:literal $whole:ident $scalar:ty, $bias:literal;
            ($bits:ident) => $guessed:expr
        ) => {
            #[target_feature(enable = $feature)]
            #[inline]
            fn $power(x: intrinsic::$register) -> intrinsic::$register {
                let one = intrinsic::$splat((1.0 as $scalar).to_bits().cast_signed());
                intrinsic::$from(intrinsic::$add(
                    intrinsic::$left::<$mantissa>(intrinsic::$to(x)),
                    one,
                ))
            }
            #[target_feature(enable = $feature)]
            #[inline]
            fn $guess(x: intrinsic::$register) -> intrinsic::$register {
                let $bits = intrinsic::$to(x);
                intrinsic::$from($guessed)
            }
            #[target_feature(enable = $feature)]
            #[inline]
            fn $split(x: intrinsic::$register) -> (intrinsic::$register, intrinsic::$register) {
                let round = $whole / 1.5;
                let one = intrinsic::$splat((1.0 as $scalar).to_bits().cast_signed());
                let low = intrinsic::$splat((1 << $mantissa) - 1);
                let bits = intrinsic::$to(x);
                let mantissa = intrinsic::$or(intrinsic::$and(bits, low), one);
                let whole = intrinsic::$splat(round.to_bits().cast_signed());
                let whole =
                    intrinsic::$from(intrinsic::$or(whole, intrinsic::$right::<$mantissa>(bits)));
                (intrinsic::$from(mantissa), intrinsic::$sub(whole, intrinsic::$set(round + $bias)))
            }
        };
    }
    bits!(
        avx2_power_f32 avx2_guess_f32 avx2_split_f32 "avx2" __m256
        _mm256_castps_si256 _mm256_castsi256_ps _mm256_slli_epi32 _mm256_srli_epi32 _mm256_and_si256 _mm256_or_si256
        _mm256_add_epi32 _mm256_sub_ps _mm256_set1_epi32 _mm256_set1_ps 23 ROUND_F32 f32, 127.0;
        (bits) => {
            let third = intrinsic::_mm256_mul_ps(intrinsic::_mm256_cvtepi32_ps(bits), intrinsic::_mm256_set1_ps(THIRD_F32));
            intrinsic::_mm256_cvttps_epi32(intrinsic::_mm256_sub_ps(intrinsic::_mm256_set1_ps(THIRDS_F32), third))
        }
    );
    bits!(
        avx512_power_f32 avx512_guess_f32 avx512_split_f32 "avx512f" __m512
        _mm512_castps_si512 _mm512_castsi512_ps _mm512_slli_epi32 _mm512_srli_epi32 _mm512_and_si512 _mm512_or_si512
        _mm512_add_epi32 _mm512_sub_ps _mm512_set1_epi32 _mm512_set1_ps 23 ROUND_F32 f32, 127.0;
        (bits) => {
            let third = intrinsic::_mm512_mul_ps(intrinsic::_mm512_cvtepi32_ps(bits), intrinsic::_mm512_set1_ps(THIRD_F32));
            intrinsic::_mm512_cvttps_epi32(intrinsic::_mm512_sub_ps(intrinsic::_mm512_set1_ps(THIRDS_F32), third))
        }
    );
    bits!(
        avx2_power_f64 avx2_guess_f64 avx2_split_f64 "avx2" __m256d
        _mm256_castpd_si256 _mm256_castsi256_pd _mm256_slli_epi64 _mm256_srli_epi64 _mm256_and_si256 _mm256_or_si256
        _mm256_add_epi64 _mm256_sub_pd _mm256_set1_epi64x _mm256_set1_pd 52 ROUND_F64 f64, 1023.0;
        (bits) => {
            let third = intrinsic::_mm256_mul_epu32(intrinsic::_mm256_srli_epi64::<32>(bits), intrinsic::_mm256_set1_epi64x(0x5555_5556));
            let third = intrinsic::_mm256_srli_epi64::<32>(third);
            intrinsic::_mm256_slli_epi64::<32>(intrinsic::_mm256_sub_epi64(intrinsic::_mm256_set1_epi64x(0x553e_eaa8), third))
        }
    );
    bits!(
        avx512_power_f64 avx512_guess_f64 avx512_split_f64 "avx512f" __m512d
        _mm512_castpd_si512 _mm512_castsi512_pd _mm512_slli_epi64 _mm512_srli_epi64 _mm512_and_si512 _mm512_or_si512
        _mm512_add_epi64 _mm512_sub_pd _mm512_set1_epi64 _mm512_set1_pd 52 ROUND_F64 f64, 1023.0;
        (bits) => {
            let third = intrinsic::_mm512_mul_epu32(intrinsic::_mm512_srli_epi64::<32>(bits), intrinsic::_mm512_set1_epi64(0x5555_5556));
            let third = intrinsic::_mm512_srli_epi64::<32>(third);
            intrinsic::_mm512_slli_epi64::<32>(intrinsic::_mm512_sub_epi64(intrinsic::_mm512_set1_epi64(0x553e_eaa8), third))
        }
    );

    /// The exact activation, one number after the other: gradient checks have time.
    #[inline(always)]
    fn one_by_one<L: Register<Element = f64>>(x: L) -> L {
        let mut numbers = [0.0; BLOCK];
        x.store(&mut numbers);
        for number in &mut numbers[..L::WIDTH] {
            *number = number.activation();
        }
        L::load(&numbers)
    }

    register!(
        avx2_f32 "avx2" Avx2F32(__m256) [f32; 8]
        _mm256_set1_ps _mm256_min_ps _mm256_max_ps _mm256_loadu_ps _mm256_storeu_ps _mm256_sqrt_ps
        Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps;
        net_tanh;
        (zero, x, then, otherwise) => intrinsic::_mm256_blendv_ps(
            otherwise, then, intrinsic::_mm256_cmp_ps::<{ intrinsic::_CMP_GT_OQ }>(x, zero)
        ), intrinsic::_mm256_movemask_ps(intrinsic::_mm256_cmp_ps::<{ intrinsic::_CMP_GT_OQ }>(x, zero)) != 0;
        ROUND_F32 avx2_power_f32; avx2_guess_f32; avx2_split_f32
    );
    register!(
        avx2_f64 "avx2" Avx2F64(__m256d) [f64; 4]
        _mm256_set1_pd _mm256_min_pd _mm256_max_pd _mm256_loadu_pd _mm256_storeu_pd _mm256_sqrt_pd
        Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd;
        one_by_one;
        (zero, x, then, otherwise) => intrinsic::_mm256_blendv_pd(
            otherwise, then, intrinsic::_mm256_cmp_pd::<{ intrinsic::_CMP_GT_OQ }>(x, zero)
        ), intrinsic::_mm256_movemask_pd(intrinsic::_mm256_cmp_pd::<{ intrinsic::_CMP_GT_OQ }>(x, zero)) != 0;
        ROUND_F64 avx2_power_f64; avx2_guess_f64; avx2_split_f64
    );
    register!(
        avx512_f32 "avx512f" Avx512F32(__m512) [f32; 16]
        _mm512_set1_ps _mm512_min_ps _mm512_max_ps _mm512_loadu_ps _mm512_storeu_ps _mm512_sqrt_ps
        Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps, Div div _mm512_div_ps;
        net_tanh;
        (zero, x, then, otherwise) => intrinsic::_mm512_mask_blend_ps(
            intrinsic::_mm512_cmp_ps_mask::<{ intrinsic::_CMP_GT_OQ }>(x, zero), otherwise, then
        ), intrinsic::_mm512_cmp_ps_mask::<{ intrinsic::_CMP_GT_OQ }>(x, zero) != 0;
        ROUND_F32 avx512_power_f32; avx512_guess_f32; avx512_split_f32
    );
    register!(
        avx512_f64 "avx512f" Avx512F64(__m512d) [f64; 8]
        _mm512_set1_pd _mm512_min_pd _mm512_max_pd _mm512_loadu_pd _mm512_storeu_pd _mm512_sqrt_pd
        Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd;
        one_by_one;
        (zero, x, then, otherwise) => intrinsic::_mm512_mask_blend_pd(
            intrinsic::_mm512_cmp_pd_mask::<{ intrinsic::_CMP_GT_OQ }>(x, zero), otherwise, then
        ), intrinsic::_mm512_cmp_pd_mask::<{ intrinsic::_CMP_GT_OQ }>(x, zero) != 0;
        ROUND_F64 avx512_power_f64; avx512_guess_f64; avx512_split_f64
    );
}
