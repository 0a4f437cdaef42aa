//! Unit tests inside the crate, in one place so that they are built once.

extern crate std;

mod detectors;
mod law_inputs;
mod reckoning;
mod turning;
