//! The image that flies, on an STM32F405RG. Pins, timers and memory are in [`board`].
#![no_std]
#![no_main]

mod board;
mod clocks;
mod reset;

use core::panic::PanicInfo;
use defmt_rtt as _;

// The interrupt lines of CAN2, which this firmware does not need.
firmware::image!(board::Stm32f405, control: CAN2_TX, comms: CAN2_RX0, housekeeping: CAN2_RX1);

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    if firmware::executors::in_dispensable_task() {
        let (file, line) = info.location().map_or(("", 0), |place| (place.file(), place.line()));
        defmt::error!("a task has failed, the flight continues without it: {=str}:{=u32}", file, line);
        board::park()
    }
    board::stop_motors();
    defmt::error!("{}", defmt::Display2Format(info));
    wait_for_watchdog()
}

#[expect(unsafe_code, reason = "nothing may be pushed before the stack pointer is set")]
mod hard_fault {
    /// Entered on any fault, possibly with a stack pointer outside the RAM: sets up a new stack first.
    #[unsafe(naked)]
    #[unsafe(no_mangle)]
    extern "C" fn HardFault() -> ! {
        core::arch::naked_asm!("ldr r0, =_stack_start", "mov sp, r0", "b {fault}", fault = sym super::fault)
    }
}

extern "C" fn fault() -> ! {
    board::stop_motors();
    defmt::error!("hard fault");
    wait_for_watchdog()
}

/// Waits until the watchdog resets the chip, which starts disarmed.
fn wait_for_watchdog() -> ! {
    cortex_m::interrupt::disable();
    loop {
        cortex_m::asm::nop();
    }
}
