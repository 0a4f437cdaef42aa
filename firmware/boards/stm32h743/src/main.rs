//! The flight image for an STM32H743VI. Pins, timers and memory are in [`board`].
#![no_std]
#![no_main]

mod board;
mod sensors;

use defmt_rtt as _;

// The executors run on the interrupt lines of the display controller, HDMI, JPEG codec, camera and serial audio, which
// this firmware does not use otherwise.
firmware::image!(
    board::Stm32h743, control: LTDC, comms: LTDC_ER, housekeeping: CEC, sampling: JPEG, aiding: DCMI,
    logging: SAI1
);
chip_stm32::faults!(board::stop_motors);
