//! All tests in one program, since linking one program per file takes longer than running the tests.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on should say why"
)]

mod campaign;
mod compare;
mod fingerprint;
mod mistakes;
mod random;
mod rough;
mod suite;
mod told;
