//! Enters the chip's built-in boot loader, which takes programs by USB and UART (application note AN2606).
//!
//! The boot loader expects a chip just after reset. So the chip is reset, and the program jumps to the boot loader
//! before anything else. A backup register carries the request across the reset; callers must make it writable first.

use cortex_m::peripheral::SCB;
use embassy_stm32::pac::RTC;

/// Index of the backup register that carries the request.
const REGISTER: usize = 0;
/// Value of the backup register that requests the boot loader.
const WANTED: u32 = 0xB007_4DF0;

/// Resets the chip with a request for [`enter_if_wanted`].
pub fn restart() -> ! {
    RTC.bkpr(REGISTER).write(|register| register.set_bkp(WANTED));
    SCB::sys_reset()
}

/// Enters the boot loader if the chip was reset by [`restart`]. `vectors` is the boot loader's vector table; `prepare`
/// runs just before. Must be called first after a reset.
pub fn enter_if_wanted(vectors: usize, prepare: impl FnOnce()) {
    if RTC.bkpr(REGISTER).read().bkp() != WANTED {
        return;
    }
    // Clear the request, so that the next reset starts this program.
    RTC.bkpr(REGISTER).write(|register| register.set_bkp(0));
    prepare();
    enter(vectors)
}

/// Jumps to the boot loader. Not inlined, so that it can be identified in the image.
#[inline(never)]
#[expect(unsafe_code, reason = "another program takes over")]
fn enter(vectors: usize) -> ! {
    // SAFETY: `vectors` is the vector table of the chip's boot loader, and nothing of this program runs yet.
    unsafe { cortex_m::asm::bootload(vectors as *const u32) }
}
