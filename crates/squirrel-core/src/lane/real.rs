//! One number: what it is converted from, compared by and rooted with, the same on every target.

use super::Lane;
use nalgebra::RealField;

/// One number: `f32` on the target, `f64` in the simulator. What formulas are written over is
/// [`Lane`].
pub trait Real: RealField + Copy + Lane<Element = Self> {}
impl<T: RealField + Copy + Lane<Element = T>> Real for T {}

/// The constant `x` in the scalar type `T`.
#[inline(always)]
pub fn real<T: Real>(x: f64) -> T {
    nalgebra::convert(x)
}

/// The smaller of two numbers; `b` if `a` is NaN.
#[inline(always)]
pub fn lower<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The larger of two numbers; `b` if `a` is NaN.
#[inline(always)]
pub fn upper<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// The square root as IEEE 754 rounds it, as `libm` gives it too. Where an f32 has an instruction
/// for it that the standard library keeps for itself, that instruction.
#[inline(always)]
pub fn sqrt<T: Real>(x: T) -> T {
    #[cfg(all(target_arch = "arm", feature = "vfp"))]
    {
        use core::any::Any;
        // Both are known at compile time; nothing of this is left in the code.
        let single = <dyn Any>::downcast_ref::<f32>(&x).map(|x| vsqrt(*x));
        if let Some(root) = single.as_ref().and_then(|root| <dyn Any>::downcast_ref::<T>(root)) {
            return *root;
        }
    }
    x.sqrt()
}

/// The instruction of Arm's floating-point units.
#[cfg(all(target_arch = "arm", feature = "vfp"))]
#[allow(unsafe_code, reason = "core has no square root on stable Rust")]
#[inline(always)]
fn vsqrt(x: f32) -> f32 {
    let root: f32;
    // SAFETY: a function of its operand alone, and the feature says that the processor has it.
    unsafe {
        core::arch::asm!(
            "vsqrt.f32 {root}, {x}",
            root = lateout(sreg) root,
            x = in(sreg) x,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    root
}
