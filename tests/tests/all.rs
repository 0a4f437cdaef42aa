//! All tests in one program, since linking one program per file takes longer than running the tests.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    unreachable_pub,
    reason = "a test that cannot go on should say why"
)]

mod airborne;
mod at_rest;
mod black_box;
mod board_table;
mod boards;
mod claims;
mod declared;
mod declared_values;
mod determinism;
mod documents;
mod endurance;
mod estimation;
mod exact_flights;
mod exact_log;
mod exact_replay;
mod fleet;
mod frozen;
mod gaps;
mod geometry;
mod golden_control;
mod golden_plant;
mod guarded;
mod hardware;
mod imports;
mod kept;
mod laps;
mod link_faults;
mod margins;
mod model;
mod monitored;
mod motors;
mod names;
mod oracle;
mod outages;
mod parameters;
mod realism;
mod results;
mod safety_cases;
mod safety_net;
mod sampled;
mod sensor_faults;
mod sequences;
mod structure;
mod suites;
mod take_off;
mod told;
mod trajectories;
mod tuning;
mod vehicle_files;
mod vehicles;
