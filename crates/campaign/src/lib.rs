//! Monte Carlo campaigns: one scenario, flown many times with drawn vehicles, weather and faults.
//!
//! Flight `i` depends only on the campaign's seed and on `i`, so any machine can fly it again by itself. All contenders
//! fly the same draws. `docs/campaigns.md` describes the format of campaign files. [`compare`] flies unmodified
//! scenarios under every contender; [`suite`] flies lists of scenarios; [`random`] and [`rough`] draw flights across
//! vehicles.
#![forbid(unsafe_code)]

mod built_in;
pub mod compare;
mod draw;
mod error;
mod file;
mod fly;
mod folder;
mod manifest;
mod parquet;
mod plan;
mod quantity;
pub mod random;
pub mod rough;
mod row;
pub mod statistics;
pub mod subject;
pub mod suite;
mod summary;
mod versus;

pub use built_in::{BUILT_IN, built_in, similar_built_in};
pub use draw::Draw;
pub use error::Error;
pub use file::parse;
pub use fly::{fly, merge};
pub use folder::{CampaignFolder, Rows};
pub use manifest::{Drawn, Manifest, Shard};
pub use plan::{Campaign, NamedTrajectory, Spread};
pub use quantity::{QUANTITIES, Quantity};
pub use row::{Column, FIGURES, Figure, Row};
pub use summary::{BINS, Bad, Count, Summary, Tally};
pub use versus::Versus;
