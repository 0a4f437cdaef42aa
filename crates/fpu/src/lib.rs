//! Square root by the processor's floating-point unit.
//!
//! `core` has no square root, and that of `libm` takes 40 instructions where a Cortex-M4F has one. Both round correctly
//! (IEEE 754), so the bits are the same. A crate of its own, since the control crates have no unsafe code.
#![no_std]

/// Square root, correctly rounded; NaN for a negative number.
#[inline]
#[cfg_attr(target_arch = "arm", expect(unsafe_code, reason = "VSQRT is only available as inline assembly"))]
pub fn sqrt(x: f32) -> f32 {
    // By the hard-float ABI the processor has the instruction; other Arm targets may lack it.
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    {
        let root: u32;
        // SAFETY: reads and writes only the two registers that it names. The values go through core registers, since
        // the compiler refuses floating-point operands on this target.
        unsafe {
            core::arch::asm!(
                "vmov s0, {x}", "vsqrt.f32 s0, s0", "vmov {x}, s0",
                x = inlateout(reg) x.to_bits() => root, out("s0") _,
                options(pure, nomem, nostack, preserves_flags),
            );
        }
        f32::from_bits(root)
    }
    #[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
    libm::sqrtf(x)
}
