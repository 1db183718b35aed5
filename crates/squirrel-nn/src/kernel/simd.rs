//! Registers of windows, and the one place that asks the processor what it can do.
//!
//! A register (`Lanes`) holds one number of each of several windows. Work that is generic over it (`Kernel`) is run on the
//! widest registers there are, without being compiled for one machine. All operations are rounded the same way on every
//! path and there is no fused multiply-add, so the paths differ in speed only.
//!
//! This is the only module with `unsafe`: intrinsics may run only where the processor has them. The types of a path are
//! private to this module and only `Paths::run` hands them out, and a [`Path`] that the processor lacks cannot be made.

use core::ops::{Add, Div, Mul, Sub};
use squirrel_core::rnn::lane::{Lane, NetScalar, tanh};

/// Windows that are summed together before a batch is. Fixed, because the order of a sum decides its bits.
pub(crate) const BLOCK: usize = 16;

/// A register of windows.
pub(crate) trait Lanes: Lane<Weight: NetScalar> {
    /// Windows in it; a divisor of [`BLOCK`].
    const WIDTH: usize;
    /// From the first [`Self::WIDTH`] numbers.
    fn load(from: &[Self::Weight]) -> Self;
    /// To the first [`Self::WIDTH`] numbers.
    fn store(self, to: &mut [Self::Weight]);
}

/// Work that is the same on registers of any width.
pub(crate) trait Kernel<S> {
    /// What comes out; the same bits for every `L`.
    type Output;
    /// The work. To be marked `inline(always)`, as all that it calls in its inner loops: code is compiled for the features of
    /// the function that it ends up in.
    fn run<L: Lanes<Weight = S>>(self) -> Self::Output;
}

/// Registers that the processor has. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Path(Width);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Width {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    const ALL: &[Self] = &[
        Self::Portable,
        #[cfg(target_arch = "x86_64")]
        Self::Avx2,
        #[cfg(target_arch = "x86_64")]
        Self::Avx512,
    ];

    fn is_there(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => std::arch::is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => std::arch::is_x86_feature_detected!("avx512f"),
        }
    }
}

impl Path {
    /// What this processor has, slowest first. The first needs nothing and is always there.
    pub fn available() -> Vec<Self> {
        Width::ALL.iter().filter(|width| width.is_there()).map(|width| Self(*width)).collect()
    }

    /// The fastest that this processor has.
    pub fn best() -> Self {
        Self::available().pop().unwrap_or(Self(Width::Portable))
    }

    /// `portable`, `avx2` or `avx512`.
    pub fn name(self) -> &'static str {
        match self.0 {
            Width::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => "avx512",
        }
    }
}

/// Scalars that have paths.
pub(crate) trait Paths: NetScalar {
    /// Runs a kernel on the registers of a path.
    fn run<K: Kernel<Self>>(path: Path, kernel: K) -> K::Output;
}

impl Paths for f64 {
    /// Gradient checks have time.
    fn run<K: Kernel<Self>>(_: Path, kernel: K) -> K::Output {
        kernel.run::<Portable<f64>>()
    }
}

impl Paths for f32 {
    fn run<K: Kernel<Self>>(path: Path, kernel: K) -> K::Output {
        match path.0 {
            Width::Portable => kernel.run::<Portable<f32>>(),
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => x86::run_avx2(kernel),
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => x86::run_avx512(kernel),
        }
    }
}

/// Four windows in plain Rust; compilers make SSE2 or NEON of it.
#[derive(Clone, Copy)]
struct Portable<S>([S; 4]);

macro_rules! portable {
    ($scalar:ty, $activation:expr) => {
        portable!(@operator $scalar, Add add +, Sub sub -, Mul mul *, Div div /);

        impl Lane for Portable<$scalar> {
            type Weight = $scalar;
            #[inline(always)]
            fn splat(weight: $scalar) -> Self {
                Self([weight; 4])
            }
            #[inline(always)]
            fn zero() -> Self {
                Self([0.0; 4])
            }
            #[inline(always)]
            fn lower(self, bound: Self) -> Self {
                let ([a, b, c, d], [e, f, g, h]) = (self.0, bound.0);
                Self([a.lower(e), b.lower(f), c.lower(g), d.lower(h)])
            }
            #[inline(always)]
            fn upper(self, bound: Self) -> Self {
                let ([a, b, c, d], [e, f, g, h]) = (self.0, bound.0);
                Self([a.upper(e), b.upper(f), c.upper(g), d.upper(h)])
            }
            #[inline(always)]
            fn activation(self) -> Self {
                $activation(self)
            }
        }

        impl Lanes for Portable<$scalar> {
            const WIDTH: usize = 4;
            #[inline(always)]
            fn load(from: &[$scalar]) -> Self {
                Self([from[0], from[1], from[2], from[3]])
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                to[..4].copy_from_slice(&self.0);
            }
        }
    };
    (@operator $scalar:ty, $($trait:ident $method:ident $operator:tt),*) => {$(
        impl $trait for Portable<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
                Self([a $operator e, b $operator f, c $operator g, d $operator h])
            }
        }
    )*};
}
portable!(f32, tanh);
portable!(f64, |x: Self| Self(x.0.map(Lane::activation)));

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "intrinsics; each use says why the processor has them")]
mod x86 {
    use super::{Add, Div, Kernel, Lane, Lanes, Mul, Sub, tanh};
    use core::arch::x86_64 as intrinsic;

    /// Eight windows. A value of this type exists only inside of [`run_avx2`].
    #[derive(Clone, Copy)]
    struct Avx2(intrinsic::__m256);

    /// Sixteen windows. A value of this type exists only inside of [`run_avx512`].
    #[derive(Clone, Copy)]
    struct Avx512(intrinsic::__m512);

    pub(super) fn run_avx2<K: Kernel<f32>>(kernel: K) -> K::Output {
        #[target_feature(enable = "avx2")]
        fn inside<K: Kernel<f32>>(kernel: K) -> K::Output {
            kernel.run::<Avx2>()
        }
        // SAFETY: only `Paths::run` calls this, with a `Path` that was made after the processor said that it has AVX2.
        unsafe { inside(kernel) }
    }

    pub(super) fn run_avx512<K: Kernel<f32>>(kernel: K) -> K::Output {
        #[target_feature(enable = "avx512f")]
        fn inside<K: Kernel<f32>>(kernel: K) -> K::Output {
            kernel.run::<Avx512>()
        }
        // SAFETY: only `Paths::run` calls this, with a `Path` that was made after the processor said that it has AVX-512F.
        unsafe { inside(kernel) }
    }

    macro_rules! register {
        (
            $register:ident, $width:literal, $splat:ident, $zero:ident, $lower:ident, $upper:ident, $load:ident,
            $store:ident, $($trait:ident $method:ident $operation:ident),*
        ) => {
            $(impl $trait for $register {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: values of this type exist only where the processor has its instructions.
                    Self(unsafe { intrinsic::$operation(self.0, other.0) })
                }
            })*

            impl Lane for $register {
                type Weight = f32;
                #[inline(always)]
                fn splat(weight: f32) -> Self {
                    // SAFETY: called by kernels only, and those run on this type only inside of its `run_` function.
                    Self(unsafe { intrinsic::$splat(weight) })
                }
                #[inline(always)]
                fn zero() -> Self {
                    // SAFETY: as for `splat`.
                    Self(unsafe { intrinsic::$zero() })
                }
                #[inline(always)]
                fn lower(self, bound: Self) -> Self {
                    // The second operand where one is NaN, as `math::lower` does.
                    // SAFETY: values of this type exist only where the processor has its instructions.
                    Self(unsafe { intrinsic::$lower(self.0, bound.0) })
                }
                #[inline(always)]
                fn upper(self, bound: Self) -> Self {
                    // SAFETY: as for `lower`.
                    Self(unsafe { intrinsic::$upper(self.0, bound.0) })
                }
                #[inline(always)]
                fn activation(self) -> Self {
                    tanh(self)
                }
            }

            impl Lanes for $register {
                const WIDTH: usize = $width;
                #[inline(always)]
                fn load(from: &[f32]) -> Self {
                    let from = &from[..$width];
                    // SAFETY: the slice has as many numbers as are read, alignment is not needed; else as for `splat`.
                    Self(unsafe { intrinsic::$load(from.as_ptr()) })
                }
                #[inline(always)]
                fn store(self, to: &mut [f32]) {
                    let to = &mut to[..$width];
                    // SAFETY: the slice has as many numbers as are written, alignment is not needed; else as for `lower`.
                    unsafe { intrinsic::$store(to.as_mut_ptr(), self.0) };
                }
            }
        };
    }
    register!(
        Avx2, 8, _mm256_set1_ps, _mm256_setzero_ps, _mm256_min_ps, _mm256_max_ps, _mm256_loadu_ps, _mm256_storeu_ps,
        Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps
    );
    register!(
        Avx512, 16, _mm512_set1_ps, _mm512_setzero_ps, _mm512_min_ps, _mm512_max_ps, _mm512_loadu_ps, _mm512_storeu_ps,
        Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps, Div div _mm512_div_ps
    );
}
