//! Tests of campaigns: results do not depend on how they were computed, and no finished flight is lost.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "tests")]

use afbc::Profile;
use afbc_campaign::{self as campaign, Campaign, CampaignFolder, Manifest, ResultRow, Shard};
use afbc_sim::run::FlightResult;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Creates an empty folder for a test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("campaign").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Short flights of two contenders on two trajectories. Some are lost.
const SMALL: &str = include_str!("small.toml");

fn parse(text: &str) -> Campaign {
    campaign::parse("small.toml", text, "small", Path::new("")).unwrap()
}

fn small() -> Campaign {
    parse(SMALL)
}

/// Flies all missing flights in `folder` on `threads` threads.
fn fly(campaign: &Campaign, path: &Path, shard: Shard, threads: usize) {
    let folder = CampaignFolder::open(path, Manifest::new(campaign, shard), false).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let flown = pool.install(|| campaign::fly(campaign, &folder, &AtomicBool::new(false), &|_| ())).unwrap();
    assert!(flown.is_some());
}

fn results_of(path: &Path) -> Vec<u8> {
    fs::read(path.join("results.parquet")).unwrap()
}

/// Returns the bytes of the results that every other way of flying must also give.
fn reference(campaign: &Campaign, folder: &Path) -> Vec<u8> {
    let path = folder.join("reference");
    fly(campaign, &path, Shard::WHOLE, 1);
    results_of(&path)
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let (folder, campaign) = (folder("threads"), small());
    let reference = reference(&campaign, &folder);
    fly(&campaign, &folder.join("many"), Shard::WHOLE, 5);
    assert_eq!(reference, results_of(&folder.join("many")));
    // Another seed gives other results.
    let other = parse(&SMALL.replace("seed = 7", "seed = 8"));
    fly(&other, &folder.join("other"), Shard::WHOLE, 5);
    assert_ne!(reference, results_of(&folder.join("other")));
}

#[test]
fn an_interrupted_campaign_goes_on_from_what_is_whole() {
    let (folder, campaign) = (folder("resume"), small());
    let reference = reference(&campaign, &folder);
    let path = folder.join("interrupted");

    // A single thread is stopped after 100 of 150 flights: six chunks of 16 are complete, the seventh was begun.
    {
        let (stop, done) = (AtomicBool::new(false), AtomicU64::new(0));
        let place = CampaignFolder::open(&path, Manifest::new(&campaign, Shard::WHOLE), false).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let progress = |flights| {
            if done.fetch_add(flights, Ordering::Relaxed) + flights >= 100 {
                stop.store(true, Ordering::Relaxed);
            }
        };
        assert!(pool.install(|| campaign::fly(&campaign, &place, &stop, &progress)).unwrap().is_none());
    }
    let chunks = || {
        let entries = fs::read_dir(path.join("chunks")).unwrap().map(|entry| entry.unwrap().path());
        entries.map(|path| (path.clone(), fs::read(path).unwrap())).collect::<BTreeMap<_, _>>()
    };
    let kept = chunks();
    assert_eq!(kept.len(), 6);

    // One chunk is damaged, one is from another campaign, four are complete. A temporary file remains too.
    let files: Vec<_> = kept.iter().collect();
    fs::write(files[0].0, &files[0].1[..files[0].1.len() / 2]).unwrap();
    let other = folder.join("other");
    fly(&parse(&SMALL.replace("seed = 7", "seed = 8").replace("= 150", "= 32")), &other, Shard::WHOLE, 1);
    fs::copy(other.join("results.parquet"), files[1].0).unwrap();
    let unfinished = path.join("chunks").join(".sitl.000004.parquet.1.tmp");
    fs::write(&unfinished, b"PAR1").unwrap();

    let resumed = AtomicU64::new(u64::MAX);
    {
        let place = CampaignFolder::open(&path, Manifest::new(&campaign, Shard::WHOLE), false).unwrap();
        assert!(!unfinished.exists());
        let first = |flights| {
            let _ = resumed.compare_exchange(u64::MAX, flights, Ordering::Relaxed, Ordering::Relaxed);
        };
        campaign::fly(&campaign, &place, &AtomicBool::new(false), &first).unwrap().unwrap();
    }
    assert_eq!(resumed.into_inner(), 64, "the four whole chunks are not flown again");
    assert_eq!(reference, results_of(&path));
    // Resumes once more with nothing left to fly.
    fly(&campaign, &path, Shard::WHOLE, 1);
    assert_eq!(reference, results_of(&path));
}

#[test]
fn shards_come_together_to_what_one_machine_gives() {
    let (folder, campaign) = (folder("shards"), small());
    let reference = reference(&campaign, &folder);
    let part = |index, of| {
        let path = folder.join(format!("{index}-of-{of}"));
        fly(&campaign, &path, Shard { index, of }, 2);
        path
    };
    let parts: Vec<_> = (1..=4).map(|index| part(index, 4)).collect();
    // The shards are given in arbitrary order.
    let order: Vec<_> = [2, 0, 3, 1].into_iter().map(|i: usize| parts[i].clone()).collect();
    let (_, summary) = campaign::merge(&order, &folder.join("merged"), false).unwrap();
    assert_eq!(reference, results_of(&folder.join("merged")));
    assert_eq!(summary.tallies[0].count.flights, 150);

    let refused = |shards: &[PathBuf]| {
        let out = folder.join("refused");
        let error = campaign::merge(shards, &out, false).map(|_| ()).unwrap_err().to_string();
        assert!(!out.exists(), "{error}");
        assert!(!error.contains('\n'), "{error}");
        error
    };
    assert!(refused(&parts[..3]).starts_with("shard 4/4 missing; "));
    assert!(refused(&[parts[3].clone()]).starts_with("shard 1/4, 2/4, 3/4 missing; "));
    let copy = folder.join("copy");
    fs::create_dir_all(&copy).unwrap();
    fs::copy(parts[1].join("results.parquet"), copy.join("results.parquet")).unwrap();
    assert!(refused(&[&parts[..], &[copy]].concat()).contains("both folders hold shard 2/4"));
    assert!(refused(&[&parts[..3], &[part(2, 3)]].concat()).contains("parts of different campaigns"));
    let other = parse(&SMALL.replace("0.7, 1.3", "0.7, 1.4"));
    let path = folder.join("other");
    fly(&other, &path, Shard { index: 4, of: 4 }, 2);
    assert!(refused(&[&parts[..3], &[path]].concat()).contains("parts of different campaigns"));
    fs::create_dir_all(folder.join("empty")).unwrap();
    assert!(refused(&[&parts[..3], &[folder.join("empty")]].concat()).contains("no finished results"));
    fs::write(parts[0].join("results.parquet"), b"PAR1").unwrap();
    assert!(refused(&parts).contains("damaged"));
}

#[test]
fn a_folder_belongs_to_one_campaign_and_one_program() {
    let (folder, campaign) = (folder("changed"), small());
    let refused = |campaign: &Campaign, shard| {
        CampaignFolder::open(&folder, Manifest::new(campaign, shard), false).map(|_| ()).unwrap_err().to_string()
    };
    {
        let _held = CampaignFolder::open(&folder, Manifest::new(&campaign, Shard::WHOLE), false).unwrap();
        assert!(refused(&campaign, Shard::WHOLE).contains("another program is writing into this folder"));
    }
    for (from, to) in [("seed = 7", "seed = 8"), ("\"circle\"", "\"step\""), ("0.02", "0.03"), ("= 150", "= 151")] {
        let error = refused(&parse(&SMALL.replace(from, to)), Shard::WHOLE);
        assert!(error.contains("results of another campaign") && error.contains("--out"), "{to}: {error}");
    }
    assert!(refused(&campaign, Shard { index: 1, of: 2 }).contains("results of another campaign"));
    // Names, descriptions and the file's path do not matter.
    let renamed = campaign::parse("/elsewhere/small.toml", SMALL, "small", Path::new("")).unwrap();
    CampaignFolder::open(&folder, Manifest::new(&renamed, Shard::WHOLE), false).unwrap();
    CampaignFolder::open(&folder, Manifest::new(&campaign, Shard::WHOLE), false).unwrap();
}

/// Two vehicles that differ in one number, which no law is told, have different results.
#[test]
fn a_folder_belongs_to_one_vehicle() {
    let folder = folder("vehicles");
    let iris = afbc_vehicles::built_in("iris").unwrap().text;
    let moved = iris.replace("[imu]\nposition_m = [0.0,", "[imu]\nposition_m = [0.03,");
    assert_ne!(iris, moved);
    let short = parse(&SMALL.replace("flights = 150", "flights = 2").replace("= 6.0", "= 0.2"));
    let on = |file: &str, text: &str| {
        let vehicle = afbc_vehicles::parse(file, text, "iris").unwrap();
        Campaign { scenario: short.scenario.clone().on(&vehicle, Profile::Flight).unwrap(), ..short.clone() }
    };
    let (a, b) = (on("a.toml", iris), on("b.toml", &moved));
    let one = Shard { index: 1, of: 2 };
    fly(&a, &folder.join("a"), one, 1);
    let refused =
        CampaignFolder::open(&folder.join("a"), Manifest::new(&b, one), false).map(|_| ()).unwrap_err().to_string();
    assert!(
        refused.contains("results of another campaign") && refused.contains("--out") && !refused.contains('\n'),
        "{refused}"
    );
    fly(&b, &folder.join("b"), Shard { index: 2, of: 2 }, 1);
    let parts = ["a", "b"].map(|part| folder.join(part));
    let refused = campaign::merge(&parts, &folder.join("merged"), false).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("parts of different campaigns") && !refused.contains('\n'), "{refused}");
    // The same vehicle from another path and with another comment counts as the same.
    let copied = on("/elsewhere/mine.toml", &format!("# mine\n{iris}"));
    fly(&copied, &folder.join("b2"), Shard { index: 2, of: 2 }, 1);
    campaign::merge(&["a", "b2"].map(|part| folder.join(part)), &folder.join("merged"), false).unwrap();
}

/// An inertial sensor alone gives no position, so the motors stay off, the vehicle falls and counts as lost. This holds
/// for every law, with and without the flight core.
#[test]
fn a_vehicle_that_never_flies_is_not_kept() {
    let text = "flights = 2\nduration_s = 5.0\n[scenario]\nvehicle = { name = \"iris\" }\n\
                controllers = [\"afbc\", \"pid\", \"geometric\", \"indi\", \"l1\", \"dfbc\"]\n\
                trajectory = { kind = \"hover\", position_m = [0, 0, 1] }\n\
                instruments = { imu = \"icm-42688-p\" }\n";
    let reasons = |text: &str| -> Vec<_> { rows(&parse(text), 2).into_iter().map(|row| row.lost_reason).collect() };
    let placed = text.replace("imu =", "tracker = \"mocap-100\", imu =");
    for core in ["", "flight_core = true\n"] {
        assert_eq!(reasons(&format!("{text}{core}")), vec![Some("never armed".to_owned()); 12]);
        assert_eq!(reasons(&format!("{placed}{core}")), vec![None; 12]);
    }
}

#[test]
fn a_flight_flown_again_gives_the_figures_of_its_row() {
    let campaign = small();
    let manifest = Manifest::new(&campaign, Shard::WHOLE);
    let mut lost = 0;
    for flight in 0..30 {
        let scenario = campaign.flight(flight).unwrap();
        for (row, contender) in campaign.rows(flight).unwrap().iter().zip(&scenario.contenders) {
            let FlightResult { metrics, lost: end, .. } = FlightResult::fly(&scenario, contender, 10).unwrap();
            let number = |name| manifest.number(row, name);
            assert_eq!(row.contender, contender.name);
            assert_eq!(row.lost_reason.as_deref(), end.map(|lost| lost.reason));
            assert_eq!(number("lost_at_s"), end.map(|lost| lost.time_s));
            let settled = end.is_none_or(|lost| lost.time_s >= 5.0);
            let expected = |value: f64| settled.then_some(value);
            assert_eq!(number("rmse_x_m"), expected(metrics.rmse.x));
            assert_eq!(number("max_psi_rad"), expected(metrics.max_abs.w));
            assert_eq!(number("mean_abs_du4_n"), expected(metrics.mean_abs_delta_u.w));
            lost += u32::from(end.is_some());
        }
    }
    assert!((1..60).contains(&lost), "{lost} lost: a test of both kinds");
}

/// Returns all rows of the first `flights` flights.
fn rows(campaign: &Campaign, flights: u64) -> Vec<ResultRow> {
    (0..flights).flat_map(|flight| campaign.rows(flight).unwrap()).collect()
}

#[test]
fn a_draw_depends_on_seed_and_flight_alone() {
    let campaign = small();
    let again = parse(&SMALL.replace("flights = 150", "flights = 9"));
    assert_eq!(rows(&campaign, 3), rows(&again, 3));
    // An additional quantity leaves the others unchanged, wherever it is listed.
    let more = parse(&SMALL.replace("[spread]", "[spread]\ninertia_ratio = [0.5, 2.0]\nsensor_delay_s = [0.0, 0.004]"));
    for flight in 0..100 {
        let (few, many) = (campaign.draw(flight), more.draw(flight));
        assert_eq!(few.seed, many.seed);
        assert_eq!(few.values[0], many.values[0]);
        assert_eq!(few.values[1..6], many.values[2..7]);
        assert!(few.seed < 1 << 53);
    }
}

#[test]
fn draws_fill_their_intervals_evenly() {
    let campaign = small();
    const FLIGHTS: u64 = 5_000;
    let (mut sums, mut rotors) = ([0.0; 6], [0_u32; 4]);
    for flight in 0..FLIGHTS {
        let draw = campaign.draw(flight);
        for ((sum, value), spread) in sums.iter_mut().zip(&draw.values).zip(&campaign.spreads) {
            let [low, high] = spread.ends;
            assert!((low..=high).contains(value), "{value}");
            *sum += if high > low { (value - low) / (high - low) } else { 0.5 };
        }
        rotors[draw.values[4] as usize - 1] += 1;
    }
    for sum in sums {
        // The mean of n uniform numbers has a standard deviation of 1 / sqrt(12 n) = 0.004.
        assert!((sum / FLIGHTS as f64 - 0.5).abs() < 0.02, "{sums:?}");
    }
    // Each rotor is drawn about 1250 times, with a standard deviation of 31.
    assert!(rotors.iter().all(|&count| count.abs_diff(1250) < 150), "{rotors:?}");
}

#[test]
fn what_is_drawn_reaches_the_vehicle() {
    let campaign = small();
    let flight = campaign.flight(5).unwrap();
    let values = campaign.draw(5).values;
    let (truth, nominal) = (*flight.environment.nominal(), campaign.scenario.vehicle);
    assert_eq!(truth.mass_kg, nominal.mass_kg * values[0]);
    assert_eq!(truth.thrust_factor_n_s2, nominal.thrust_factor_n_s2 * values[1]);
    assert_eq!(truth.inertia_kg_m2, nominal.inertia_kg_m2);
    assert_eq!(flight.vehicle, nominal, "the law is not told");
    let rotors = &flight.realism.rotors;
    assert_eq!(rotors.time_constant_s, 0.02);
    assert_eq!(rotors.faults.len(), 1);
    assert_eq!((rotors.faults[0].efficiency, f64::from(rotors.faults[0].rotor)), (values[3], values[4]));
    assert_eq!(rotors.faults[0].start_s, values[5]);
    // The trajectories are flown in turn.
    assert_eq!(campaign.trajectory(5).unwrap().name, "circle");
    assert_ne!(campaign.flight(4).unwrap().trajectory, flight.trajectory);
}

/// Refuses files with a flipped bit or a missing end.
#[test]
fn damaged_files_are_refused() {
    let folder = folder("damaged");
    let campaign = parse(&SMALL.replace("flights = 150", "flights = 4").replace("= 6.0", "= 5.2"));
    let whole = folder.join("whole");
    fly(&campaign, &whole, Shard::WHOLE, 1);
    let parts: Vec<_> = (1..=2).map(|index| folder.join(format!("part-{index}"))).collect();
    for (index, part) in (1..).zip(&parts) {
        fly(&campaign, part, Shard { index, of: 2 }, 1);
    }
    // The folder `begun` holds a chunk of an interrupted campaign.
    let begun = folder.join("begun");
    fly(&campaign, &begun, Shard::WHOLE, 1);
    fs::create_dir_all(begun.join("chunks")).unwrap();
    fs::rename(begun.join("results.parquet"), begun.join("chunks/000000.parquet")).unwrap();

    let never = AtomicBool::new(false);
    let open = |path: &Path| CampaignFolder::open(path, Manifest::new(&campaign, Shard::WHOLE), false);
    let (results, chunks) = (open(&whole).unwrap(), open(&begun).unwrap());
    let again = || campaign::fly(&campaign, &results, &never, &|_| panic!("it is finished")).map(|_| ());
    let merged = || campaign::merge(&parts, &folder.join("merged"), false).map(|_| ());
    // Returns the number of flights that a resumed campaign does not fly again.
    let kept = || {
        let (stop, kept) = (AtomicBool::new(false), AtomicU64::new(0));
        let first = |flights| {
            kept.fetch_add(flights, Ordering::Relaxed);
            stop.store(true, Ordering::Relaxed);
        };
        assert!(campaign::fly(&campaign, &chunks, &stop, &first).unwrap().is_none());
        kept.into_inner()
    };
    assert!(again().is_ok());
    assert_eq!(kept(), 4);
    let refused = |file: &Path, error: Result<(), campaign::Error>| {
        let error = error.unwrap_err().to_string();
        assert!(error.starts_with(&format!("{}: the file is damaged (", file.display())), "{error}");
        assert!(error.contains("delete it") && !error.contains('\n'), "{error}");
    };
    each_damage(&whole.join("results.parquet"), 3, |file| refused(file, again()));
    each_damage(&parts[1].join("results.parquet"), 7, |file| refused(file, merged()));
    each_damage(&begun.join("chunks/000000.parquet"), 7, |_| assert_eq!(kept(), 0));
    assert!(!folder.join("merged").exists());
    drop(results);
    each_damage(&whole.join("campaign.json"), 1, |file| refused(file, open(&whole).map(|_| ())));
    // Undamaged files are all read.
    drop(chunks);
    fly(&campaign, &begun, Shard::WHOLE, 1);
    assert_eq!(results_of(&begun), results_of(&whole));
    campaign::merge(&parts, &folder.join("merged"), false).unwrap();
    assert_eq!(results_of(&folder.join("merged")), results_of(&whole));
}

/// Calls `see` with the file after each damage: a changed bit in every `stride`-th byte, each changed bit of the first
/// and last bytes, truncations, additional bytes. Then restores the file.
fn each_damage(path: &Path, stride: usize, mut see: impl FnMut(&Path)) {
    let whole = fs::read(path).unwrap();
    let mut damage = |bytes: &[u8]| {
        fs::write(path, bytes).unwrap();
        see(path);
    };
    let mut bytes = whole.clone();
    for at in 0..whole.len() {
        let is_end = at < 8 || at + 150 > whole.len();
        let flips = if is_end { (0..8).map(|bit| 1 << bit).collect() } else { vec![1 << (at / stride % 8)] };
        for flip in flips.iter().filter(|_| is_end || at % stride == 0) {
            bytes[at] ^= flip;
            damage(&bytes);
            bytes[at] = whole[at];
        }
        if at % 101 == 0 {
            damage(&whole[..at]);
        }
    }
    damage(&[&whole[..], b"x"].concat());
    damage(&[&whole[..], &whole[..]].concat());
    fs::write(path, whole).unwrap();
}

#[test]
fn a_damaged_folder_is_mended_by_what_its_error_says() {
    let (folder, campaign) = (folder("mended"), small());
    let path = folder.join("campaign");
    fly(&campaign, &path, Shard::WHOLE, 2);
    let reference = results_of(&path);
    for (file, cure_by_force) in [("campaign.json", false), ("results.parquet", false), ("results.parquet", true)] {
        let mut bytes = fs::read(path.join(file)).unwrap();
        bytes[100] ^= 4;
        fs::write(path.join(file), bytes).unwrap();
        let manifest = || Manifest::new(&campaign, Shard::WHOLE);
        let fly_on = |force| {
            let place = CampaignFolder::open(&path, manifest(), force)?;
            campaign::fly(&campaign, &place, &AtomicBool::new(false), &|_| ())
        };
        let error = fly_on(false).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(file) && error.contains("damaged (the file's checksum is wrong); delete it"), "{error}");
        if !cure_by_force {
            fs::remove_file(path.join(file)).unwrap();
        }
        fly_on(cure_by_force).unwrap().unwrap();
        assert_eq!(results_of(&path), reference);
    }
}

/// The work before the first flight, and per chunk, does not grow with the number of flights. A campaign of ten million
/// flights that is stopped after its first chunk returns soon.
#[test]
fn ten_million_flights_start_with_the_first() {
    let folder = folder("ten-million");
    let campaign = parse(&SMALL.replace("flights = 150", "flights = 10000000").replace("= 6.0", "= 0.2"));
    for shard in [Shard::WHOLE, Shard { index: 3, of: 16 }, Shard { index: 100_000, of: 100_000 }] {
        let path = folder.join(format!("of-{}", shard.of));
        let place = CampaignFolder::open(&path, Manifest::new(&campaign, shard), false).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let chunks = || fs::read_dir(path.join("chunks")).map_or(0, |entries| entries.count());
        let flown = |most: u64, stop: bool| {
            let (stop, flown) = (AtomicBool::new(stop), AtomicU64::new(0));
            let progress = |flights| {
                stop.fetch_or(flown.fetch_add(flights, Ordering::Relaxed) + flights >= most, Ordering::Relaxed);
            };
            assert!(pool.install(|| campaign::fly(&campaign, &place, &stop, &progress)).unwrap().is_none());
            flown.into_inner()
        };
        // A campaign that is stopped before its first flight flies nothing.
        assert_eq!((flown(u64::MAX, true), chunks()), (0, 0));
        assert_eq!((flown(16, false), chunks()), (16, 1));
        assert_eq!((flown(40, false), chunks()), (40, 2));
    }
}

/// An unreadable file is not called damaged, since the advice would be to delete it.
#[test]
fn what_cannot_be_read_is_not_called_damaged() {
    let (folder, campaign) = (folder("unreadable"), parse(&SMALL.replace("= 150", "= 2").replace("= 6.0", "= 0.2")));
    for file in ["campaign.json", "results.parquet"] {
        let path = folder.join(file.replace('.', "-"));
        fly(&campaign, &path, Shard::WHOLE, 1);
        fs::remove_file(path.join(file)).unwrap();
        fs::create_dir(path.join(file)).unwrap();
        let place = CampaignFolder::open(&path, Manifest::new(&campaign, Shard::WHOLE), false);
        let flown = place.and_then(|place| campaign::fly(&campaign, &place, &AtomicBool::new(false), &|_| ()));
        let error = flown.map(|_| ()).unwrap_err().to_string();
        assert!(error.starts_with(&format!("{}: the file cannot be read (", path.join(file).display())), "{error}");
    }
}

#[test]
fn a_shard_is_every_nth_flight() {
    for (flights, of) in [(1, 1), (150, 1), (150, 4), (16, 16), (17, 16), (31, 16), (100, 7)] {
        let mut seen = 0;
        for index in 1..=of {
            let shard = Shard { index, of };
            let found: Vec<_> = (0..shard.count(flights)).map(|nth| shard.flight(nth)).collect();
            assert_eq!(found, (0..flights).filter(|flight| flight % of == index - 1).collect::<Vec<_>>(), "{shard}");
            seen += found.len() as u64;
        }
        assert_eq!(seen, flights);
    }
}

const PAGE: &str = include_str!("../../../docs/campaigns.md");
const REFERENCE: &str = include_str!("../../../docs/reference/campaigns.md");

#[test]
fn every_quantity_and_column_is_documented() {
    for quantity in &campaign::QUANTITIES {
        let range = quantity.range;
        let row = REFERENCE.lines().find(|line| line.starts_with("| `") && line.contains(&format!("`{}`", range.name)));
        let cells: Vec<_> = row.unwrap_or_else(|| panic!("{}", range.name)).split(" | ").collect();
        let number = |text: &str| text.parse::<f64>().unwrap();
        let (min, max) = cells[1].split_once(" to ").unwrap();
        assert!((number(min) - range.min).abs() < 1e-4 && (number(max) - range.max).abs() < 1e-4, "{}", range.name);
        if let Some(needed) = quantity.needs {
            assert!(cells[2].contains(&format!("`{needed}`")), "{}", range.name);
        }
    }
    for figure in &campaign::FIGURES {
        assert!(
            REFERENCE.contains(&format!("`{}`", figure.name)) || figure.name.starts_with("mean_abs_du"),
            "{}",
            figure.name
        );
    }
}

#[test]
fn a_scenario_may_be_written_out() {
    let inline = "[scenario]\n[[scenario.contender]]\nname = \"me\"\ncontroller = \"pid\"\n";
    let text = SMALL.replace("scenario = \"hover\"\n", "") + inline;
    let campaign = parse(&text);
    assert_eq!(campaign.scenario.contenders.len(), 1);
    assert_eq!(campaign.rows(0).unwrap()[0].contender, "me");
    // The table's own trajectory is used if no others are listed.
    let line = "trajectories = [\"hover\", \"circle\"]\n";
    let error = campaign::parse("f", &text.replace(line, ""), "f", Path::new("")).unwrap_err().to_string();
    assert!(error.contains("scenario.trajectory: missing; "), "{error}");
    let own = "[scenario.trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 9]\n";
    assert_eq!(parse(&(text.replace(line, "") + own)).trajectories[0].initial.position_m.z, 9.0);
    // A mistake in the table is reported with its key.
    let error = campaign::parse("f", &text.replace("\"pid\"", "\"pdi\""), "f", Path::new("")).unwrap_err().to_string();
    assert!(error.contains("contender.controller: \"pdi\" is unknown"), "{error}");
}

#[test]
fn the_documented_file_is_a_campaign() {
    let example = PAGE.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let campaign = campaign::parse("example", example, "example", Path::new("")).unwrap();
    assert_eq!(campaign.flights, 10_000);
    // Every key in the page's table is in the example.
    for line in PAGE.lines().take_while(|line| !line.starts_with("## What is drawn")) {
        if let Some(key) = line.strip_prefix("| `").and_then(|line| line.split('`').next()) {
            assert!(example.contains(&format!("{key} = ")), "{key}");
        }
    }
}
