//! Flying a campaign on many cores, and putting together what was flown apart.

use super::folder::{Rows, finished};
use super::{Campaign, Error, Folder, Manifest, Row, Shard, Summary};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Flies whatever `folder` lacks of `campaign`, on the current rayon pool. `progress` hears of every number of flights
/// that is done, those of earlier runs first. What comes of it is the same however many threads there are.
///
/// None if `stop` became true before the end: whole chunks are kept then.
///
/// # Errors
/// A flight that cannot be flown, results that cannot be written.
pub fn fly(
    campaign: &Campaign,
    folder: &Folder,
    stop: &AtomicBool,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Option<Summary>, Error> {
    if !folder.is_complete() {
        let chunk = |chunk| (chunk, folder.chunk(chunk));
        let (kept, missing): (Vec<_>, Vec<_>) =
            (0..folder.chunks()).into_par_iter().map(chunk).partition(|(chunk, _)| folder.has_chunk(*chunk));
        progress(kept.iter().map(|(_, flights)| flights.len() as u64).sum());
        missing.par_iter().with_max_len(1).try_for_each(|(chunk, flights)| {
            let fly = |&flight: &u64| {
                if stop.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                let rows = campaign.rows(flight).map_err(|error| Error::Draw { flight, error })?;
                progress(1);
                Ok(Some(rows))
            };
            let rows = flights.par_iter().map(fly).collect::<Result<Vec<_>, Error>>()?;
            match rows.into_iter().collect::<Option<Vec<_>>>() {
                Some(rows) => folder.put_chunk(*chunk, rows.into_iter().flatten()),
                None => Ok(()),
            }
        })?;
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
    }
    let mut summary = Summary::new(folder.manifest());
    folder.collect(&mut |row| summary.add(row))?;
    Ok(Some(summary.finish()))
}

/// Makes one whole of all `shards` of one campaign, in the folder `out`: the same bytes that one machine would have
/// written.
///
/// # Errors
/// Shards of different campaigns, a shard that is missing, unfinished or there twice, and what cannot be read or written.
pub fn merge(shards: &[PathBuf], out: &Path) -> Result<(Folder, Summary), Error> {
    let mut parts = shards.iter().map(|path| Ok((path, finished(path)?))).collect::<Result<Vec<_>, Error>>()?;
    parts.sort_by_key(|(_, rows)| rows.manifest().shard.index);
    let Some((first, manifest)) = parts.first().map(|(path, rows)| (*path, rows.manifest().clone())) else {
        return Err(Error::Missing(vec![Shard::WHOLE]));
    };
    for (path, rows) in &parts {
        if !manifest.is_sibling(rows.manifest()) {
            return Err(Error::Strangers([first.clone(), (*path).clone()]));
        }
    }
    for ((a, rows), (b, next)) in parts.iter().zip(parts.iter().skip(1)) {
        if rows.manifest().shard == next.manifest().shard {
            return Err(Error::Twice(rows.manifest().shard, [(*a).clone(), (*b).clone()]));
        }
    }
    let of = manifest.shard.of;
    let has = |shard: &Shard| parts.iter().any(|(_, rows)| rows.manifest().shard == *shard);
    let missing: Vec<_> = (1..=of).map(|index| Shard { index, of }).filter(|shard| !has(shard)).collect();
    if !missing.is_empty() {
        return Err(Error::Missing(missing));
    }

    let whole = Manifest { shard: Shard::WHOLE, ..manifest };
    let contenders = whole.contenders.len();
    let folder = Folder::open(out, whole)?;
    let mut summary = Summary::new(folder.manifest());
    // Flight i is in shard i modulo their number.
    let flights = (0..folder.manifest().flights).flat_map(|flight| core::iter::repeat_n(flight, contenders));
    let mut rows: Vec<Rows> = parts.into_iter().map(|(_, rows)| rows).collect();
    let rows = flights.map(|flight| {
        let shard = rows.get_mut((flight % of) as usize).ok_or(Error::Missing(Vec::new()))?;
        match shard.next() {
            Some(Ok(Row { flight: found, .. })) if found != flight => Err(shard.incomplete()),
            None => Err(shard.incomplete()),
            Some(row) => row,
        }
    });
    folder.write(rows, &mut |row| summary.add(row))?;
    Ok((folder, summary.finish()))
}
