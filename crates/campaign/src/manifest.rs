//! The manifest, which says which campaign results belong to. It is stored as a file beside the results and inside
//! them.

use crate::built_in::built_in;
use crate::plan::{Campaign, Spread};
use crate::row::{FIGURES, ResultColumn, ResultRow};
use afbc_files::seal::hash_of;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// One of several separately flown parts of a campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Index of the shard, from 1 on.
    pub index: u64,
    /// Number of shards.
    pub of: u64,
}

impl Shard {
    /// The whole campaign.
    pub const WHOLE: Shard = Shard { index: 1, of: 1 };

    /// Returns how many of `flights` belong to this shard, which takes every `of`-th.
    pub fn count(&self, flights: u64) -> u64 {
        // The division rounds up. The sum cannot be negative, since the index is at most `of`.
        (flights + self.of - self.index) / self.of
    }

    /// Returns the `index`-th flight of this shard, from 0 on.
    pub fn flight(&self, index: u64) -> u64 {
        self.index - 1 + index * self.of
    }
}

impl FromStr for Shard {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((index, of)) if 1 <= index && index <= of && of <= 100_000 => Ok(Shard { index, of }),
            _ => Err("a shard must be I/N with I from 1 to N, such as 3/16"),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

/// A drawn quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawnQuantity {
    /// Name, ending in the unit.
    pub name: String,
    /// Meaning in words.
    pub meaning: String,
    /// Ends of the interval.
    pub ends: [f64; 2],
}

/// Description of the campaign and shard that results belong to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Name of the campaign.
    pub name: String,
    /// Description of the campaign.
    pub description: String,
    /// Fingerprint of everything that determines the flights, including this program's version.
    pub fingerprint: String,
    /// Seed of the campaign.
    pub seed: u64,
    /// Number of flights of each contender.
    pub flights: u64,
    /// Names of the contenders, in the order flown.
    pub contenders: Vec<String>,
    /// Names of the trajectories, which are flown in turn.
    pub trajectories: Vec<String>,
    /// Drawn quantities, in the order of the columns.
    pub drawn: Vec<DrawnQuantity>,
    /// The shard that these results cover.
    pub shard: Shard,
}

impl Manifest {
    /// Creates the manifest of a shard of `campaign`.
    pub fn new(campaign: &Campaign, shard: Shard) -> Self {
        let drawn = |spread: &Spread| {
            let quantity = spread.quantity()?;
            Some(DrawnQuantity {
                name: quantity.range.name.into(),
                meaning: quantity.meaning.into(),
                ends: spread.ends,
            })
        };
        Manifest {
            name: campaign.name.clone(),
            description: campaign.description.clone(),
            fingerprint: fingerprint(campaign),
            seed: campaign.seed,
            flights: campaign.flights,
            contenders: campaign.scenario.contenders.iter().map(|contender| contender.name.clone()).collect(),
            trajectories: campaign.trajectories.iter().map(|trajectory| trajectory.name.clone()).collect(),
            drawn: campaign.spreads.iter().filter_map(drawn).collect(),
            shard,
        }
    }

    /// Returns the columns of numbers: drawn quantities, then figures.
    pub fn columns(&self) -> Vec<ResultColumn> {
        let drawn =
            self.drawn.iter().map(|drawn| ResultColumn { name: drawn.name.clone(), meaning: drawn.meaning.clone() });
        let figures =
            FIGURES.iter().map(|figure| ResultColumn { name: figure.name.into(), meaning: figure.meaning.into() });
        drawn.chain(figures).collect()
    }

    /// Returns the value of `row` in the column `name`.
    pub fn number(&self, row: &ResultRow, name: &str) -> Option<f64> {
        let drawn = self.drawn.iter().position(|drawn| drawn.name == name);
        let figure = || Some(self.drawn.len() + FIGURES.iter().position(|figure| figure.name == name)?);
        row.numbers.get(drawn.or_else(figure)?).copied().flatten()
    }

    /// Returns the argument by which `sitl campaign` flies this campaign: the name of a built-in one, or the file name
    /// derived from the campaign's name. The file's folder is left out, so that results do not depend on it.
    pub fn target(&self) -> String {
        let same = |plan: Campaign| fingerprint(&plan) == self.fingerprint;
        let known = built_in(&self.name).and_then(|known| known.read().ok()).is_some_and(same);
        if known { self.name.clone() } else { format!("{}.toml", self.name) }
    }

    /// True if `other` belongs to the same shard of the same campaign. The path of the campaign's file does not matter.
    pub fn is_same(&self, other: &Manifest) -> bool {
        self.fingerprint == other.fingerprint && self.shard == other.shard
    }

    /// True if `other` belongs to a shard of the same campaign, with the same number of shards.
    pub fn is_sibling(&self, other: &Manifest) -> bool {
        self.fingerprint == other.fingerprint && self.shard.of == other.shard.of
    }
}

/// Returns a fingerprint that differs between campaigns and between versions of this program.
fn fingerprint(campaign: &Campaign) -> String {
    // Every field is named, so that the compiler reports a forgotten new one.
    let Campaign { name: _, description: _, flights, seed, scenario, trajectories, spreads } = campaign;
    // The name stands for the quantity, since its index may change.
    let spreads: Vec<_> =
        spreads.iter().map(|spread| (spread.quantity().map(|quantity| quantity.range.name), spread.ends)).collect();
    hash_of(&(env!("CARGO_PKG_VERSION"), flights, seed, scenario, trajectories, spreads))
}
