//! The flight image for an STM32F405RG. Pins, timers and memory are in [`board`].
#![no_std]
#![no_main]

mod board;

use defmt_rtt as _;

// The executors run on the interrupt lines of CAN2, which this firmware does not use otherwise.
firmware::image!(board::Stm32f405, control: CAN2_TX, comms: CAN2_RX0, housekeeping: CAN2_RX1);
chip_stm32::faults!(board::stop_motors);
