//! The boot loader in the chip's system memory.

use chip_stm32::boot_loader;
use embassy_stm32::pac::{PWR, RCC, SYSCFG};

/// System memory (RM0090, 2.4).
const VECTORS: usize = 0x1FFF_0000;
/// The same as what is mapped at address 0 (9.2.1).
const SYSTEM_MEMORY: u8 = 0b01;

/// Restarts the chip into it.
pub fn restart() -> ! {
    unlock();
    boot_loader::restart()
}

/// Enters it after a [`restart`]. To be called first after a reset.
pub fn enter_if_wanted() {
    unlock();
    boot_loader::enter_if_wanted(VECTORS, || {
        // It expects itself at address 0, as after a reset with the pin BOOT0 high.
        RCC.apb2enr().modify(|enable| enable.set_syscfgen(true));
        SYSCFG.memrm().modify(|memory| memory.set_mem_mode(SYSTEM_MEMORY));
    });
}

/// Makes the backup registers writable.
fn unlock() {
    // Without its clock, which is off after a reset, the store to PWR has no effect.
    RCC.apb1enr().modify(|enable| enable.set_pwren(true));
    PWR.cr1().modify(|power| power.set_dbp(true));
}
