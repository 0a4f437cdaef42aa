//! The image for processor-in-the-loop tests on QEMU's STM32F405. A panic ends the emulator with exit status 101, a
//! fault with 102.
#![no_std]
#![no_main]

mod board;

use core::panic::PanicInfo;
use defmt_rtt as _;
use semihosting::process::exit;

firmware::image!(
    board::Emulated, control: CAN2_TX, comms: CAN2_RX0, housekeeping: CAN2_RX1, sampling: CAN2_SCE
);

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    semihosting::eprintln!("firmware: {info}");
    exit(101)
}

#[allow(unsafe_code, reason = "required by the runtime: a fault may leave any state")]
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    exit(102)
}
