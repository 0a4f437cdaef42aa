//! Panics and processor faults.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

/// Defines the panic and fault handlers of a board. `$stop` stops the motors and must work in any state of the program.
#[macro_export]
macro_rules! faults {
    ($stop:path) => {
        #[panic_handler]
        fn panic(info: &core::panic::PanicInfo) -> ! {
            $crate::faults::panic(info, $stop)
        }

        #[expect(unsafe_code, reason = "nothing may be pushed before the stack pointer is set")]
        mod hard_fault {
            /// Runs on any fault, possibly with a stack pointer outside the RAM: sets up a new stack first.
            #[unsafe(naked)]
            #[unsafe(no_mangle)]
            extern "C" fn HardFault() -> ! {
                core::arch::naked_asm!("ldr r0, =_stack_start", "mov sp, r0", "b {fault}", fault = sym super::fault)
            }
        }

        extern "C" fn fault() -> ! {
            $crate::faults::fault($stop)
        }
    };
}

/// Parks a task that is not needed in flight. In any other task, stops the motors and waits for the reset.
pub fn panic(info: &PanicInfo, stop_motors: fn()) -> ! {
    if firmware::executors::in_dispensable_task() {
        let (file, line) = info.location().map_or(("", 0), |place| (place.file(), place.line()));
        defmt::error!("a task has failed, the flight continues without it: {=str}:{=u32}", file, line);
        park()
    }
    // Stop the motors before logging: the panic may come from the log, and logging would panic again.
    stop_motors();
    defmt::error!("{}", defmt::Display2Format(info));
    wait_for_watchdog()
}

/// Stops the motors and waits for the reset.
pub fn fault(stop_motors: fn()) -> ! {
    stop_motors();
    defmt::error!("hard fault");
    wait_for_watchdog()
}

/// Waits until the watchdog resets the chip, which starts disarmed.
fn wait_for_watchdog() -> ! {
    // With interrupts enabled, control ticks could continue and feed the watchdog.
    cortex_m::interrupt::disable();
    loop {
        cortex_m::asm::nop();
    }
}

static TASK_FAILED: AtomicBool = AtomicBool::new(false);

/// Returns true if a task that is not needed in flight has panicked.
pub fn task_has_failed() -> bool {
    TASK_FAILED.load(Ordering::Relaxed)
}

/// Stops a task that is not needed in flight, after its panic; everything of higher priority continues.
fn park() -> ! {
    TASK_FAILED.store(true, Ordering::Relaxed);
    loop {
        // The task may have panicked with interrupts disabled.
        #[expect(unsafe_code, reason = "it ends a critical section to which the code never returns")]
        // SAFETY: all data protected by critical sections is borrowed by try_borrow: the inbox, the ticks, the alarms.
        unsafe {
            cortex_m::interrupt::enable()
        };
        cortex_m::asm::wfi();
    }
}
