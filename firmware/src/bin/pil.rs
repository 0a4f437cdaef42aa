//! The image for the processor in the loop. A panic or fault ends the emulator with a status that says which.
#![no_std]
#![no_main]

use core::panic::PanicInfo;
use defmt_rtt as _;
use semihosting::process::exit;

#[cortex_m_rt::entry]
fn main() -> ! {
    firmware::run(cortex_m::Peripherals::take().expect("taken once"))
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    semihosting::eprintln!("firmware: {info}");
    exit(101)
}

#[allow(unsafe_code, reason = "the runtime asks for it: a fault may have left anything behind")]
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    exit(102)
}
