//! Flies a campaign on many cores and merges its shards.

use crate::error::Error;
use crate::folder::{CampaignFolder, ResultRows, finished};
use crate::manifest::{Manifest, Shard};
use crate::plan::Campaign;
use crate::row::ResultRow;
use crate::summary::CampaignSummary;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Flies the missing flights of `campaign` in `folder` on the current rayon pool. Calls `progress` with the number of
/// newly finished flights; the first call counts those of earlier runs. The result does not depend on the number of
/// threads.
///
/// Returns none if `stop` became true before the end. Complete chunks are kept.
///
/// # Errors
/// A flight that cannot be flown, or results that cannot be written or are damaged.
pub fn fly(
    campaign: &Campaign,
    folder: &CampaignFolder,
    stop: &AtomicBool,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Option<CampaignSummary>, Error> {
    match flown(campaign, folder, stop, progress) {
        Err(Error::Stopped) => Ok(None),
        summary => summary.map(Some),
    }
}

/// Returns the results of all flights; flies the missing ones first.
fn flown(
    campaign: &Campaign,
    folder: &CampaignFolder,
    stop: &AtomicBool,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<CampaignSummary, Error> {
    // `stop` is also checked between rows, since reading and writing many flights takes time.
    let heard = |row| if stop.load(Ordering::Relaxed) { Err(Error::Stopped) } else { row };
    if let Some(rows) = folder.results()? {
        let mut summary = CampaignSummary::new(folder.manifest());
        rows.map(heard).try_for_each(|row| row.map(|row| summary.add(&row)))?;
        return Ok(summary.finish());
    }
    fly_missing(campaign, folder, stop, progress)?;
    let mut summary = CampaignSummary::new(folder.manifest());
    folder.write(folder.rows().map(heard).inspect(|row| row.iter().for_each(|row| summary.add(row))))?;
    Ok(summary.finish())
}

/// Flies the flights of the missing chunks in order.
fn fly_missing(
    campaign: &Campaign,
    folder: &CampaignFolder,
    stop: &AtomicBool,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<(), Error> {
    let kept = folder.kept(stop);
    progress(kept.iter().map(|chunk| folder.chunk(*chunk).count() as u64).sum());
    let missing = (0..folder.chunks()).filter(|chunk| !kept.contains(chunk));
    let jobs =
        missing.flat_map(|chunk| folder.chunk(chunk).enumerate().map(move |(place, flight)| (chunk, place, flight)));
    // Each thread takes the next flight, and the thread that completes a chunk writes it. Only unfinished chunks are in
    // memory.
    // The iterator is fused, since every thread asks once more after the last flight. Threads finish flights in any
    // order, so rows are sorted by their place in the chunk.
    let (jobs, begun) = (Mutex::new(jobs.fuse()), Mutex::new(BTreeMap::<u64, BTreeMap<usize, Vec<ResultRow>>>::new()));
    let failed = AtomicBool::new(false);
    // A panic poisons the lock, and rayon passes the panic on when all threads have ended. No flight starts until then.
    let next = || match jobs.lock() {
        Ok(mut jobs) => jobs.next(),
        Err(_) => None,
    };
    let gather = |chunk: u64, place: usize, rows: Vec<ResultRow>| {
        let Ok(mut begun) = begun.lock() else { return None };
        let flown = begun.entry(chunk).or_default();
        flown.insert(place, rows);
        if flown.len() == folder.chunk(chunk).count() { begun.remove(&chunk) } else { None }
    };
    let work = || {
        while !failed.load(Ordering::Relaxed) {
            if stop.load(Ordering::Relaxed) {
                return Err(Error::Stopped);
            }
            let Some((chunk, place, flight)) = next() else { break };
            let rows = campaign.rows(flight).map_err(|error| Error::Draw { flight, error })?;
            progress(1);
            if let Some(flown) = gather(chunk, place, rows) {
                folder.put_chunk(chunk, flown.into_values().flatten())?;
            }
        }
        Ok(())
    };
    let work = |_: rayon::BroadcastContext<'_>| work().inspect_err(|_| failed.store(true, Ordering::Relaxed));
    let ends = rayon::broadcast(work);
    // Errors take precedence over an interruption.
    let (stopped, others): (Vec<_>, Vec<_>) = ends.into_iter().partition(|end| matches!(end, Err(Error::Stopped)));
    others.into_iter().chain(stopped).collect()
}

/// Merges all `shards` of one campaign into the folder `out`. The files have the same bytes as if one machine had flown
/// the whole campaign. With `force`, files of the same names in `out` are replaced.
///
/// # Errors
/// Shards of different campaigns, a missing, unfinished or duplicate shard, and files that cannot be read or written.
pub fn merge(shards: &[PathBuf], out: &Path, force: bool) -> Result<(CampaignFolder, CampaignSummary), Error> {
    let is_out =
        |shard: &&PathBuf| shard.canonicalize().is_ok_and(|shard| out.canonicalize().is_ok_and(|out| out == shard));
    if let Some(part) = shards.iter().find(is_out) {
        return Err(Error::IntoPart(part.clone()));
    }
    let mut parts = shards.iter().map(|path| Ok((path, finished(path)?))).collect::<Result<Vec<_>, Error>>()?;
    // Sorting makes two copies of the same shard neighbours.
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
    let folder = CampaignFolder::open(out, whole, force)?;
    let mut summary = CampaignSummary::new(folder.manifest());
    // Flight `i` is in the shard at index `i` modulo the number of shards.
    let flights = (0..folder.manifest().flights).flat_map(|flight| core::iter::repeat_n(flight, contenders));
    let mut rows: Vec<ResultRows> = parts.into_iter().map(|(_, rows)| rows).collect();
    let rows = flights.map(|flight| {
        let shard = rows.get_mut((flight % of) as usize).ok_or(Error::Missing(Vec::new()))?;
        match shard.next() {
            Some(Ok(ResultRow { flight: found, .. })) if found != flight => Err(shard.incomplete()),
            None => Err(shard.incomplete()),
            Some(row) => row,
        }
    });
    folder.write(rows.inspect(|row| row.iter().for_each(|row| summary.add(row))))?;
    Ok((folder, summary.finish()))
}
