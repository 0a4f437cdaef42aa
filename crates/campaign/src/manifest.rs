//! What results are the results of: written beside and into them.

use crate::built_in::built_in;
use crate::plan::{Campaign, Spread};
use crate::row::{Column, FIGURES, Row};
use core::hash::Hasher;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use twox_hash::XxHash64;

/// One of several parts that a campaign is flown in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// From 1 on.
    pub index: u64,
    /// How many there are.
    pub of: u64,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Shard = Shard { index: 1, of: 1 };

    /// How many of `flights` are of this part: every `of`-th.
    pub fn count(&self, flights: u64) -> u64 {
        (flights + self.of - self.index) / self.of
    }

    /// The `index`-th flight of this part, from 0 on.
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
            _ => Err("it must be I/N with I from 1 to N, such as 3/16"),
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
pub struct Drawn {
    /// Ends in the unit.
    pub name: String,
    /// For people.
    pub meaning: String,
    /// Ends of the interval.
    pub ends: [f64; 2],
}

/// A campaign as its results know it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// The campaign's.
    pub name: String,
    /// The campaign's.
    pub description: String,
    /// Of everything that determines the flights, this program's version included.
    pub fingerprint: String,
    /// The campaign's.
    pub seed: u64,
    /// Each contender's.
    pub flights: u64,
    /// Names, in the order flown.
    pub contenders: Vec<String>,
    /// Names, in turn.
    pub trajectories: Vec<String>,
    /// In the order of the columns.
    pub drawn: Vec<Drawn>,
    /// Which part of the campaign these results are.
    pub shard: Shard,
}

impl Manifest {
    /// The manifest of a part of `campaign`.
    pub fn new(campaign: &Campaign, shard: Shard) -> Self {
        let drawn = |spread: &Spread| {
            let quantity = spread.quantity()?;
            Some(Drawn { name: quantity.range.name.into(), meaning: quantity.meaning.into(), ends: spread.ends })
        };
        Manifest {
            name: campaign.name.clone(),
            description: campaign.description.clone(),
            fingerprint: fingerprint(campaign),
            seed: campaign.seed,
            flights: campaign.flights,
            contenders: campaign.scenario.contenders.iter().map(|contender| contender.name.clone()).collect(),
            trajectories: campaign.courses.iter().map(|course| course.name.clone()).collect(),
            drawn: campaign.spreads.iter().filter_map(drawn).collect(),
            shard,
        }
    }

    /// The columns of numbers.
    pub fn columns(&self) -> Vec<Column> {
        let drawn = self.drawn.iter().map(|drawn| Column { name: drawn.name.clone(), meaning: drawn.meaning.clone() });
        let figures = FIGURES.iter().map(|figure| Column { name: figure.name.into(), meaning: figure.meaning.into() });
        drawn.chain(figures).collect()
    }

    /// The number that `row` has in the column of this name.
    pub fn number(&self, row: &Row, name: &str) -> Option<f64> {
        let drawn = self.drawn.iter().position(|drawn| drawn.name == name);
        let figure = || Some(self.drawn.len() + FIGURES.iter().position(|figure| figure.name == name)?);
        row.numbers.get(drawn.or_else(figure)?).copied().flatten()
    }

    /// What `sitl campaign` knows the campaign by: the name of a built-in one, or of a file called after the campaign.
    /// Where somebody's file lies is no part of the results, so that they are the same wherever it does.
    pub fn target(&self) -> String {
        let same = |plan: Campaign| fingerprint(&plan) == self.fingerprint;
        let known = built_in(&self.name).and_then(|known| known.read().ok()).is_some_and(same);
        if known { self.name.clone() } else { format!("{}.toml", self.name) }
    }

    /// Whether `other` is of the same part of the same campaign, whatever the path of its file.
    pub fn is_same(&self, other: &Manifest) -> bool {
        self.fingerprint == other.fingerprint && self.shard == other.shard
    }

    /// Whether `other` is of a part of the same campaign, cut in as many.
    pub fn is_sibling(&self, other: &Manifest) -> bool {
        self.fingerprint == other.fingerprint && self.shard.of == other.shard.of
    }
}

/// A number that another campaign, or another version of this program, would hardly share.
fn fingerprint(campaign: &Campaign) -> String {
    // Names for people may change; whatever decides a flight is in the debug form, its numbers to the last bit.
    let Campaign { flights, seed, scenario, courses, spreads, .. } = campaign;
    let text = format!("{} {:?}", env!("CARGO_PKG_VERSION"), (flights, seed, scenario, courses, spreads));
    let mut hasher = XxHash64::with_seed(0);
    hasher.write(text.as_bytes());
    format!("{:016x}", hasher.finish())
}
