//! The flight image for a Pixracer. Its pins and timers are in [`board`].
#![no_std]
#![no_main]

mod board;
mod sensors;

use defmt_rtt as _;

// The executors run on the interrupt lines of CAN1 and CAN2, which this firmware does not use otherwise.
firmware::image!(
    board::Pixracer, control: CAN2_TX, comms: CAN2_RX0, housekeeping: CAN2_RX1, sampling: CAN1_TX,
    aiding: CAN1_RX0, logging: CAN1_RX1
);
chip_stm32::faults!(board::stop_motors);
