//! Enters the boot loader in the chip's system memory.

use chip_stm32::boot_loader;
use embassy_stm32::pac::{PWR, RCC, SYSCFG};

/// Address of the system memory (RM0090, 2.4).
const VECTORS: usize = 0x1FFF_0000;
/// Value of MEM_MODE that maps the system memory to address 0 (9.2.1).
const SYSTEM_MEMORY: u8 = 0b01;

/// Restarts the chip into the boot loader.
pub fn restart() -> ! {
    unlock();
    boot_loader::restart()
}

/// Enters the boot loader after a [`restart`]. Must be called first after a reset.
pub fn enter_if_wanted() {
    unlock();
    boot_loader::enter_if_wanted(VECTORS, || {
        // The boot loader expects its own memory at address 0, as after a reset with BOOT0 high.
        RCC.apb2enr().modify(|enable| enable.set_syscfgen(true));
        SYSCFG.memrm().modify(|memory| memory.set_mem_mode(SYSTEM_MEMORY));
    });
}

/// Makes the backup registers writable.
fn unlock() {
    // Without PWR's clock, which is off after a reset, the store has no effect.
    RCC.apb1enr().modify(|enable| enable.set_pwren(true));
    PWR.cr1().modify(|power| power.set_dbp(true));
}
