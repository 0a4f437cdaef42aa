//! Tests logs in flash that fills, fails, holds other data, or loses power while programming or erasing. The logs are
//! read by the layout in docs/reference/black-box-storage.md and by the specification of ULog.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

mod room;

use afbc_comms::services::storage::LogStore;
use afbc_log::storage::{LogMode, StorageState};
use afbc_mavlink::LogRequest;
use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use room::Room;
use room::chip::{Change, Chip, SECTOR, apply, logs};
use room::station::Station;
use room::ulog::{ReadLog, read};
use std::task::Poll;

/// Time between two samples of a small log \[us\].
const PERIOD_US: u64 = 10_000;

/// Checks that each gap between samples is covered by dropouts of that length. Returns the times of the first and last
/// sample \[us\].
fn adds_up(log: &ReadLog) -> [u64; 2] {
    let times = &log.samples_us;
    let mut dropouts = log.dropouts.iter().filter(|(_, before)| *before > 0).peekable();
    for (index, pair) in times.windows(2).enumerate() {
        let mut told_ms = 0;
        while let Some((ms, _)) = dropouts.next_if(|(_, before)| *before <= index + 1) {
            told_ms += ms;
        }
        let missing_us = (pair[1] - pair[0]).saturating_sub(PERIOD_US + 2_000);
        assert!(
            missing_us <= 1_000 * told_ms + PERIOD_US * u64::from(told_ms > 0),
            "{missing_us} us, {told_ms} ms told"
        );
    }
    [times[0], *times.last().unwrap()]
}

/// A chip that is never slow keeps a complete small log over several sectors, and serves it unchanged.
#[test]
fn all_is_kept() {
    let chip = Chip::new(16);
    let mut station = Station::new(&chip);
    station.fly(8_000);
    let kept = station.room.logs();
    let [(name, bytes)] = kept.as_slice() else { panic!("{} logs", kept.len()) };
    let log = read(bytes);
    assert_eq!((name.as_str(), log.whole), ("1", bytes.len()));
    let [first, last] = adds_up(&log);
    assert!(last - first > 8_300_000 && log.dropouts.is_empty(), "{first} {last} {:?}", log.dropouts);
    assert!(bytes.len() > 3 * SECTOR && bytes.len() < 500_000, "{} bytes", bytes.len());
    // Each further log begins in a sector of its own.
    (0..3).for_each(|_| station.fly(400));
    station.is_served_as_it_is_kept();
    let held = station.room.logs();
    assert_eq!(held.len(), 4);
    for (log, offset, bytes) in [(0, 1, 90), (0, 65_279, 2), (0, 65_000, 900), (1, 450, 451), (3, 511, 1_000)] {
        let (from, to) = (offset as usize, (offset + bytes) as usize);
        assert_eq!(station.download(log, offset, bytes), held[usize::from(log)].1[from..to]);
    }
    for (log, offset) in [(3, held[3].1.len() as u32), (3, u32::MAX), (4, 0), (u16::MAX, 7)] {
        assert!(station.download(log, offset, 900).is_empty());
    }
    assert!(station.room.told.is_empty());
    // After a restart the logs are still there, and the next log gets the next number.
    let mut station = Station::new(&Chip::holding(chip.0.lock().unwrap().bytes.clone()));
    station.fly(400);
    station.is_served_as_it_is_kept();
    let now = station.room.logs();
    assert_eq!(now[..4], held);
    assert_eq!((now.len(), now[4].0.as_str()), (5, "5"));
}

/// The log being written is not served. It continues while other logs are downloaded, and is not erased.
#[test]
fn downloads_beside_a_log() {
    let chip = Chip::new(8);
    let mut station = Station::new(&chip);
    (0..2).for_each(|_| station.fly(500));
    let held = station.room.logs();
    station.room.armed = true;
    station.room.run(300);
    assert_eq!(station.list().len(), 2);
    for (log, (_, bytes)) in held.iter().enumerate() {
        assert!(station.download(log as u16, 0, u32::MAX) == *bytes);
    }
    assert!(!station.erase());
    station.room.armed = false;
    station.room.run(1_500);
    let log = read(&station.room.logs()[2].1);
    adds_up(&log);
    let missing_ms: u64 = log.dropouts.iter().map(|(ms, _)| ms).sum();
    assert!(missing_ms < 50, "{missing_ms} ms");
    station.is_served_as_it_is_kept();
}

/// A full flash ends its log, is reported once, and takes logs again after an erasure.
#[test]
fn a_full_flash_is_emptied() {
    let chip = Chip::new(4);
    let mut station = Station::new(&chip);
    (0..3).for_each(|_| station.fly(6_000));
    assert_eq!(station.room.told, [StorageState::Full.text().unwrap()]);
    let kept = station.room.logs();
    assert_eq!(kept.iter().map(|(_, bytes)| bytes.len().div_ceil(SECTOR - 256)).sum::<usize>(), 4);
    for (_, bytes) in &kept {
        adds_up(&read(bytes));
    }
    assert_eq!(kept.last().unwrap().1.len() % (SECTOR - 256), 0, "the last one fills it");
    station.is_served_as_it_is_kept();
    assert!(station.erase());
    assert!(chip.0.lock().unwrap().bytes.iter().all(|byte| *byte == 0xFF));
    assert_eq!(station.room.told.last(), StorageState::Ready.text().as_ref());
    station.fly(3_000);
    station.is_served_as_it_is_kept();
    assert_eq!(station.room.logs().len(), 1);
}

/// Returns the cells after a power cut in the middle of a change: each bit that was to change has randomly changed or
/// not.
fn cut(cells: &[u8], change: &Change, random: &mut impl FnMut() -> u8) -> Vec<u8> {
    let mut cells = cells.to_vec();
    match change {
        Change::Program(at, bytes) => {
            let done = usize::from(random()) * bytes.len() / 256;
            for (index, byte) in bytes.iter().enumerate() {
                cells[at + index] &= if index < done { *byte } else { *byte | random() };
            }
        }
        Change::Erase(sector) => cells[sector * SECTOR..][..SECTOR].iter_mut().for_each(|cell| *cell |= random()),
    }
    cells
}

/// After a power cut in any page, earlier logs are intact, the present log can be read up to the cut, and the next log
/// is written.
#[test]
fn cuts_of_the_power_leave_logs() {
    let chip = Chip::new(6);
    let mut station = Station::new(&chip);
    station.fly(300);
    let first = station.room.logs();
    station.fly(2_500);
    let changes = chip.0.lock().unwrap().changes.clone();
    let mut cells = vec![0xFF; 6 * SECTOR];
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut random = || random.next_u32() as u8;
    let (mut cuts, mut read_to_us) = (0, 0);
    for (at_us, change) in &changes {
        if cuts % 7 == 0 || cells[change_sector(change) * SECTOR] == 0xFF || is_end(change) {
            let left = cut(&cells, change, &mut random);
            let kept = logs(&left);
            if *at_us > 2_000_000 {
                assert_eq!(kept[0], first[0]);
                if let Some((_, bytes)) = kept.get(1) {
                    let log = read(bytes);
                    // A cut during the log's beginning leaves no samples.
                    if let Some(last_us) = log.samples_us.last() {
                        assert!(*last_us >= read_to_us && last_us + 200_000 > *at_us, "cut at {at_us} us, {last_us}");
                        read_to_us = *last_us;
                    }
                }
            }
            if cuts % 49 == 0 || is_end(change) {
                let mut station = Station::new(&Chip::holding(left));
                station.is_served_as_it_is_kept();
                station.fly(300);
                station.is_served_as_it_is_kept();
                let now = station.room.logs();
                assert_eq!((now.len(), &now[..kept.len()]), (kept.len() + 1, kept.as_slice()));
                adds_up(&read(&now.last().unwrap().1));
            }
        }
        cuts += 1;
        apply(&mut cells, change);
    }
    assert!(cuts > 400 && read_to_us > 4_000_000, "{cuts} cuts, {read_to_us} us");
}

fn change_sector(change: &Change) -> usize {
    match change {
        Change::Program(at, _) => at / SECTOR,
        Change::Erase(sector) => *sector,
    }
}

/// Returns true if a change writes the length of a log, which happens when the log ends.
fn is_end(change: &Change) -> bool {
    matches!(change, Change::Program(at, _) if at % SECTOR == 24)
}

/// After a power cut during an erasure, each log is whole or gone, except that one may be shortened. Then all can be
/// erased.
#[test]
fn cuts_of_erasing_leave_logs() {
    let chip = Chip::new(6);
    let mut station = Station::new(&chip);
    station.fly(8_000);
    (0..2).for_each(|_| station.fly(300));
    let held = station.room.logs();
    let before = chip.0.lock().unwrap().bytes.clone();
    let written = chip.0.lock().unwrap().changes.len();
    assert!(station.erase());
    let changes = chip.0.lock().unwrap().changes[written..].to_vec();
    assert!(changes.len() >= 4, "{changes:?}");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut cells = before;
    for (_, change) in &changes {
        let left = cut(&cells, change, &mut || random.next_u32() as u8);
        let mut station = Station::new(&Chip::holding(left));
        station.is_served_as_it_is_kept();
        let kept = station.room.logs();
        for (index, (log, before)) in kept.iter().zip(&held).enumerate() {
            let is_last = index + 1 == kept.len();
            assert!(log == before || is_last && log.0 == before.0 && before.1.starts_with(&log.1), "{}", log.0);
        }
        station.fly(300);
        assert!(station.room.logs().len() > kept.len() || station.room.state == StorageState::Full);
        assert!(station.erase());
        assert!(station.room.card.0.lock().unwrap().bytes.iter().all(|byte| *byte == 0xFF));
        apply(&mut cells, change);
    }
}

/// If a chip is missing, write-protected or busy forever, stations are told, and the vehicle continues.
#[test]
fn a_chip_that_does_not_work() {
    let chip = Chip::new(4);
    chip.0.lock().unwrap().is_there = false;
    let mut station = Station::new(&chip);
    station.fly(300);
    assert_eq!(station.room.told, [StorageState::Failed.text().unwrap()]);
    assert!(station.list().is_empty());
    chip.0.lock().unwrap().is_there = true;
    station.room.run(1_500);
    station.fly(300);
    assert_eq!(station.room.told.last(), StorageState::Ready.text().as_ref());
    station.is_served_as_it_is_kept();
    for is_protected in [true, false] {
        let chip = Chip::new(4);
        chip.0.lock().unwrap().is_protected = is_protected;
        chip.0.lock().unwrap().takes_us[0] = if is_protected { 700 } else { 1_000_000_000 };
        let mut station = Station::new(&chip);
        station.fly(6_000);
        assert_eq!(station.room.told[0], StorageState::Failed.text().unwrap());
        assert!(station.room.logs().iter().all(|(_, bytes)| bytes.is_empty()));
    }
}

/// A chip that fails in the middle of a download does not end the log. The download continues once the chip is back.
#[test]
fn a_lost_chip_ends_no_log() {
    let chip = Chip::new(8);
    let mut station = Station::new(&chip);
    station.fly(500);
    let (_, bytes) = station.room.logs().remove(0);
    assert!(station.download(0, 0, 9_000) == bytes[..9_000]);
    chip.0.lock().unwrap().is_there = false;
    let rest = LogRequest::Data { log: 0, offset: 9_000, bytes: u32::MAX };
    let told = station.ask_for(rest, 300);
    assert!(told.is_empty() && station.transfer.is_busy(), "{told:?}");
    assert_eq!(station.room.told, [StorageState::Failed.text().unwrap()]);
    chip.0.lock().unwrap().is_there = true;
    assert!(station.download(0, 9_000, u32::MAX) == bytes[9_000..]);
}

/// Pages that take the longest time of the data sheet cost no records.
#[test]
fn slow_pages_lose_nothing() {
    let chip = Chip::new(8);
    let mut station = Station::new(&chip);
    chip.0.lock().unwrap().takes_us[0] = 5_000;
    station.fly(4_000);
    // Gives the queued blocks time to be stored after the log's end.
    station.room.run(2_000);
    let log = read(&station.room.logs()[0].1);
    adds_up(&log);
    assert!(log.dropouts.is_empty(), "{:?}", log.dropouts);
}

/// A stalling chip costs records, and the log contains a dropout of that length.
#[test]
fn a_stall_is_a_dropout() {
    let chip = Chip::new(8);
    let mut station = Station::new(&chip);
    station.room.armed = true;
    station.room.run(2_000);
    chip.0.lock().unwrap().takes_us[0] = 600_000;
    station.room.run(30);
    chip.0.lock().unwrap().takes_us[0] = 700;
    station.fly(3_000);
    let kept = station.room.logs();
    let log = read(&kept[0].1);
    let [_, last] = adds_up(&log);
    let missing_ms: u64 = log.dropouts.iter().map(|(ms, _)| ms).sum();
    assert!((200..900).contains(&missing_ms) && kept.len() == 1 && last > 5_900_000, "{missing_ms} ms, {last}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Other data in the flash stays until it is erased, and only takes up room.
    #[test]
    fn something_else_is_in_it(seed: u64, spans in prop::collection::vec((0..8 * SECTOR, 1..100_000_usize), 0..6)) {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut cells = vec![0xFF; 8 * SECTOR];
        for (from, length) in &spans {
            let to = (from + length).min(cells.len());
            random.fill_bytes(&mut cells[*from..to]);
        }
        let chip = Chip::holding(cells.clone());
        let mut station = Station::new(&chip);
        station.fly(2_000);
        // Gives the keeper time to check the sector ahead.
        station.room.run(4_000);
        station.is_served_as_it_is_kept();
        let free = cells.chunks(SECTOR).rev().take_while(|sector| sector.starts_with(&[0xFF; 24])).collect::<Vec<_>>();
        let blank = free.iter().filter(|sector| sector.iter().all(|byte| *byte == 0xFF)).count();
        prop_assert_eq!(station.room.logs().len(), usize::from(blank > 0));
        prop_assert!(station.erase());
        prop_assert!(chip.0.lock().unwrap().bytes.iter().all(|byte| *byte == 0xFF));
    }

    /// With random failures, arming and queries, each request is answered, and each byte served is the log's.
    #[test]
    fn whatever_the_chip_does_there_is_an_answer(steps in prop::collection::vec((0_u8..7, any::<u32>()), 1..25)) {
        let chip = Chip::new(16);
        let mut station = Station::new(&chip);
        (0..2).for_each(|_| station.fly(200));
        let held = station.room.logs();
        for (step, number) in steps {
            match step {
                0 => chip.0.lock().unwrap().is_there = false,
                1 => chip.0.lock().unwrap().is_there = true,
                2 => chip.0.lock().unwrap().fails_in = Some(number % 400),
                3 => station.room.armed = number % 2 == 0,
                4 => chip.0.lock().unwrap().takes_us[0] = [700, 3_000, 9_000][number as usize % 3],
                5 => {
                    station.ask_for(LogRequest::List { first: 0, last: 9 }, 300);
                    station.transfer.hear(LogRequest::End);
                }
                _ => {
                    let (log, offset) = ((number % 2) as u16, number / 2 % 20_000);
                    let wanted = 1 + number % 5_000;
                    let found = station.ask_for(LogRequest::Data { log, offset, bytes: wanted }, 300);
                    let is_whole = !station.transfer.is_busy();
                    station.transfer.hear(LogRequest::End);
                    let found = Station::<Chip>::joined(log, offset, found);
                    let bytes = &held[usize::from(log)].1[offset as usize..(offset + wanted) as usize];
                    prop_assert!(bytes.starts_with(&found));
                    prop_assert!(!is_whole || found.len() == bytes.len() || found.is_empty());
                }
            }
            station.room.run(u64::from(number % 300));
        }
        {
            let mut cells = chip.0.lock().unwrap();
            (cells.is_there, cells.fails_in, cells.takes_us) = (true, None, [700, 150_000]);
        }
        station.room.armed = false;
        station.room.run(4_000);
        let now = station.room.logs();
        for (before, after) in held.iter().zip(&now) {
            prop_assert_eq!(before, after);
        }
        station.is_served_as_it_is_kept();
        prop_assert!(station.erase());
        prop_assert!(station.room.logs().is_empty());
    }
}

/// The writer decides when to log, for flash as for cards.
#[test]
fn a_log_from_power_up() {
    let chip = Chip::new(8);
    let mut room = Room::new(&chip);
    room.mode = LogMode::Boot;
    room.run(3_000);
    room.mode = LogMode::Armed;
    room.run(300);
    let kept = room.logs();
    assert_eq!(kept.len(), 1);
    let [first, last] = adds_up(&read(&kept[0].1));
    assert!(first < 500_000 && last > 2_900_000, "{first} {last}");
    assert!(matches!(room.stored.count_logs(), Poll::Pending));
}
