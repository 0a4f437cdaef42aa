//! Enters the boot loader in the chip's system memory.

use chip_stm32::boot_loader;
use embassy_stm32::pac::PWR;

/// Address of the boot loader in the system memory (AN2606, STM32H743).
const VECTORS: usize = 0x1FF0_9800;

/// Restarts the chip into the boot loader.
pub fn restart() -> ! {
    unlock();
    boot_loader::restart()
}

/// Enters the boot loader after a [`restart`]. Must be called first after a reset.
pub fn enter_if_wanted() {
    unlock();
    boot_loader::enter_if_wanted(VECTORS, || ());
}

/// Makes the backup registers writable.
fn unlock() {
    PWR.cr1().modify(|power| power.set_dbp(true));
}
