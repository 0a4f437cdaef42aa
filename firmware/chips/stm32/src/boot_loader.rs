//! The boot loader in the chip's own memory, which takes programs by USB and UARTs (application note AN2606).
//!
//! It expects a chip as after a reset: so the chip is reset, and then the program jumps there before anything else.
//! What it remembers across the reset is in a backup register, which must be writable in both functions.

use cortex_m::peripheral::SCB;
use embassy_stm32::pac::RTC;

/// The backup register.
const REGISTER: usize = 0;
/// Its value if the boot loader is wanted.
const WANTED: u32 = 0xB007_4DF0;

/// Resets the chip, for [`enter_if_wanted`].
pub fn restart() -> ! {
    RTC.bkpr(REGISTER).write(|register| register.set_bkp(WANTED));
    SCB::sys_reset()
}

/// Enters the boot loader whose vector table is at `vectors`, after `prepare`, if the chip was reset by [`restart`]. To
/// be called first after a reset.
pub fn enter_if_wanted(vectors: usize, prepare: impl FnOnce()) {
    if RTC.bkpr(REGISTER).read().bkp() != WANTED {
        return;
    }
    // Once only.
    RTC.bkpr(REGISTER).write(|register| register.set_bkp(0));
    prepare();
    enter(vectors)
}

/// Ends this program. Out of line, to be identified in the image.
#[inline(never)]
#[expect(unsafe_code, reason = "another program takes over")]
fn enter(vectors: usize) -> ! {
    // SAFETY: there is the vector table of the chip's boot loader, and nothing of this program runs yet.
    unsafe { cortex_m::asm::bootload(vectors as *const u32) }
}
