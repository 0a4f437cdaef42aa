//! Tests of single parts, in the crate itself so that they are built once for all.

extern crate std;

mod detectors;
mod law_inputs;
mod reckoning;
mod turning;
