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
mod paired;
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

pub use built_in::{BUILT_IN, built_in, similar_built_in};
pub use draw::Draw;
pub use error::Error;
pub use file::parse;
pub use fly::{fly, merge};
pub use folder::{CampaignFolder, ResultRows};
pub use manifest::{DrawnQuantity, Manifest, Shard};
pub use paired::PairedDifference;
pub use plan::{Campaign, NamedTrajectory, Spread};
pub use quantity::{QUANTITIES, Quantity};
pub use row::{FIGURES, FigureOfMerit, ResultColumn, ResultRow};
pub use summary::{BINS, CampaignSummary, ContenderSummary, SurvivalCount, WorstFlight};
