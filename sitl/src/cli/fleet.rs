//! `sitl tune --fleet`: searches gains of several laws on several vehicles.

use super::progress::CommandProgress;
use super::terminal::{CommandError, INTERRUPTED, print, say};
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_tune::fleet::{FleetOutcome, FleetResults, GAINS, GainSearch};
use afbc_tune::{SearchOptions, is_paper};
use afbc_vehicles::Vehicle;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Marker lines in a vehicle's file, between which the gains are written.
const BEGIN: &str = "# Gains found by `sitl tune --fleet`, up to the line of the same form.";
const END: &str = "# End of the gains found by `sitl tune --fleet`.";

/// Parameters of the searches.
pub(super) struct FleetArgs<'a> {
    pub(super) folder: &'a Path,
    /// Names of laws; all laws if empty.
    pub(super) laws: &'a [String],
    /// Vehicles; all built-in ones if empty.
    pub(super) vehicles: Vec<Vehicle>,
    pub(super) course: SearchOptions,
    /// True to start from the vehicles' present gains.
    pub(super) flying: bool,
    /// Folder with the vehicle files into which the gains are written.
    pub(super) write: Option<&'a Path>,
}

impl FleetArgs<'_> {
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let laws = laws(self.laws)?;
        let vehicles = if self.vehicles.is_empty() {
            afbc_vehicles::BUILT_IN.iter().map(afbc_files::read::BuiltIn::read).collect::<Result<_, _>>()?
        } else {
            self.vehicles
        };
        for (index, vehicle) in vehicles.iter().enumerate() {
            if vehicles.iter().take(index).any(|other| other.name == vehicle.name) {
                return Err(format!(
                    "--vehicle {}: the vehicle is named twice; name it once",
                    vehicle.name.escape_debug()
                )
                .into());
            }
            if vehicle.name.contains(['/', '\\']) || vehicle.name.starts_with('.') {
                return Err(format!(
                    "--vehicle {}: a vehicle's name must be a valid file name; rename the vehicle",
                    vehicle.name.escape_debug()
                )
                .into());
            }
        }
        // The files are checked before the search, which takes hours.
        if let Some(folder) = self.write {
            written(&vehicles).try_for_each(|vehicle| with_gains(folder, &vehicle.name, "").map(drop))?;
        }
        let mut searches = Vec::new();
        for vehicle in &vehicles {
            for kind in &laws {
                searches.push(GainSearch::new(*kind, vehicle, self.flying)?);
            }
        }
        let results = FleetResults::open(self.folder, &searches, self.course, self.flying)?;
        let mut done = 0;
        for search in &searches {
            done += u64::from(results.outcome(search)?.is_some());
        }
        let stop = Arc::new(AtomicBool::new(false));
        let stopper = Arc::clone(&stop);
        ctrlc::set_handler(move || stopper.store(true, Ordering::Relaxed))?;
        let (each, all) = (self.course.budget as u64, searches.len() as u64);
        let progress = CommandProgress::new("tune --fleet", "tried", each * all, each * done);
        let outcomes = results.complete(&searches, &stop, |tries| progress.add(tries as u64))?;
        drop(progress);
        let Some(outcomes) = outcomes else {
            say(&format!(
                "stopped; finished searches are kept in {}; run the same command to resume",
                self.folder.display()
            ));
            return Ok(ExitCode::from(INTERRUPTED));
        };
        results.write_gains(&outcomes)?;
        let mut text = table(&outcomes);
        let _ = writeln!(text, "\nthe gains of each vehicle are in {}", self.folder.join(GAINS).display());
        if let Some(folder) = self.write {
            for vehicle in &vehicles {
                if is_paper(vehicle) {
                    let _ = writeln!(
                        text,
                        "{}: not written, since the vehicle flies with the profile's gains",
                        vehicle.name
                    );
                    continue;
                }
                let (path, whole) = with_gains(folder, &vehicle.name, &results.gains_of(&vehicle.name, &outcomes))?;
                // The new file is parsed first, so that no file that cannot fly is written.
                let read = afbc_vehicles::parse(&path.display().to_string(), &whole, &vehicle.name)?;
                Law::on(ControllerKind::Afbc, &read, afbc::Profile::Flight)?;
                afbc_files::write_atomically(&path, |out| out.write_all(whole.as_bytes())).map_err(|source| {
                    format!("{}: the file cannot be written ({source}); make it writable", path.display())
                })?;
                let _ = writeln!(text, "{}: written", path.display());
            }
        }
        print(&text)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Returns the vehicles whose files hold their gains.
fn written(vehicles: &[Vehicle]) -> impl Iterator<Item = &Vehicle> {
    vehicles.iter().filter(|vehicle| !is_paper(vehicle))
}

/// Returns the laws with these names. Without names, returns all laws except backstepping, which flies with AFBC's
/// gains.
fn laws(names: &[String]) -> Result<Vec<ControllerKind>, CommandError> {
    let all = ControllerKind::all().into_iter();
    if names.is_empty() {
        return Ok(all.filter(|kind| *kind != ControllerKind::Backstepping).collect());
    }
    if let Some(unknown) = names.iter().find(|name| ControllerKind::named(name).is_none()) {
        let cure = ControllerKind::cure(unknown);
        return Err(format!("{}: no such law; {cure}", unknown.escape_debug()).into());
    }
    Ok(all.filter(|kind| names.iter().any(|name| kind.name() == name)).collect())
}

/// Returns the path of the vehicle's file in `folder`, and its text with `gains` between the marker lines. If the file
/// has no marker lines, they are appended.
fn with_gains(folder: &Path, vehicle: &str, gains: &str) -> Result<(PathBuf, String), CommandError> {
    let path = folder.join(format!("{vehicle}.toml"));
    let text = std::fs::read_to_string(&path).map_err(|error| {
        format!(
            "{}: the folder cannot be read ({error}); --write needs the folder of the vehicles' files",
            path.display()
        )
    })?;
    let whole = replaced(&text, gains).map_err(|problem| format!("{}: {problem}", path.display()))?;
    Ok((path, whole))
}

/// Returns the tables of `held` for laws without a table in `gains`. Comments belong to the tables that follow them.
fn kept(held: &str, gains: &str) -> String {
    // A table is named [gains.PROFILE.LAW] or [gains.PROFILE.LAW.AXIS].
    let law = |line: &str| {
        let mut names = line.strip_prefix("[gains.")?.split(['.', ']']).map(str::to_owned);
        Some([names.next()?, names.next()?])
    };
    let found: Vec<_> = gains.lines().filter_map(law).collect();
    let (mut text, mut comments, mut keeps) = (String::new(), String::new(), false);
    // True while a comment goes on, and while a kept table goes on, whose own comments stay in it.
    let (mut comment_goes_on, mut table_goes_on) = (false, false);
    for line in held.lines() {
        if let Some(law) = law(line) {
            keeps = !found.contains(&law);
            table_goes_on = true;
            // Several tables may share a comment: it goes to the first of them that is kept.
            if keeps {
                text += &std::mem::take(&mut comments);
            }
        } else if line.starts_with('#') && !table_goes_on {
            if !comment_goes_on {
                comments.clear();
            }
            comments = format!("{comments}{line}\n");
            comment_goes_on = true;
            continue;
        } else if line.trim().is_empty() {
            table_goes_on = false;
        }
        comment_goes_on = false;
        if keeps {
            text = format!("{text}{line}\n");
        }
    }
    text
}

/// Returns `text` with `gains` between the marker lines. The gains of other laws that stand there are kept.
fn replaced(text: &str, gains: &str) -> Result<String, String> {
    let (before, held, after) = match (text.split_once(BEGIN), text.contains(END)) {
        (None, false) => (text, "", ""),
        (Some((before, rest)), true) => match rest.split_once(END) {
            Some((held, after)) => (before, held, after.trim_start_matches('\n')),
            None => {
                return Err(
                    "the end line of the gains stands before their begin line; delete both lines and the gains".into(),
                );
            }
        },
        _ => {
            return Err(
                "only one of the two lines that enclose the gains is there; delete that line and the gains".into()
            );
        }
    };
    if [before, after].iter().any(|text| text.lines().any(|line| line.trim_start().starts_with("[gains"))) {
        return Err("the file has [gains] of its own beside those of `sitl tune --fleet`; delete its own".into());
    }
    let after = if after.is_empty() { String::new() } else { format!("\n{after}") };
    let kept = kept(held, gains);
    let kept = if kept.is_empty() { kept } else { format!("\n\n{}", kept.trim_end()) };
    Ok(format!("{}\n\n{BEGIN}\n{}{kept}\n{END}\n{after}", before.trim_end(), gains.trim_end()))
}

/// Returns a table with a line for each search.
fn table(outcomes: &[FleetOutcome]) -> String {
    let mut text = format!(
        "{:<14}{:<14}{:>10}{:>10}{:>12}{:>10}  {}\n",
        "vehicle", "law", "before", "after", "held out", "after", "conditions not met"
    );
    for FleetOutcome { planned, cost: [before, after], held_out: [old, new], unmet, .. } in outcomes {
        let unmet = if unmet.is_empty() { "-".into() } else { unmet.join(", ") };
        let _ = writeln!(
            text,
            "{:<14}{:<14}{before:>10.4}{after:>10.4}{old:>12.4}{new:>10.4}  {unmet}",
            planned.vehicle, planned.law
        );
    }
    text
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn gains_replace_those_written_before() {
        let file = "[vehicle]\nmass_kg = 1.0\n";
        let once = replaced(file, "[gains.flight.pid]\na = 1\n").unwrap();
        let twice = replaced(&once, "[gains.flight.pid]\na = 2\n").unwrap();
        assert!(once.starts_with(file) && once.contains("a = 1"), "{once}");
        assert_eq!(twice, once.replace("a = 1", "a = 2"));
        let followed = format!("{once}# more\n");
        assert_eq!(replaced(&followed, "x").unwrap().matches("# more").count(), 1);
        assert!(replaced(&format!("{file}[gains.flight.pid]\n"), "x").is_err());
        assert!(replaced(&format!("{file}{BEGIN}\n"), "x").is_err());
    }

    /// A search of some laws leaves the gains of the others in the file, with the comment that says their source.
    #[test]
    fn other_laws_keep_their_gains() {
        let first =
            "# first\n[gains.flight.afbc.roll]\na = 1\n\n[gains.flight.cascade]\nb = 1\n\n[gains.flight.pid]\nc = 1\n";
        let file = replaced("[vehicle]\n", first).unwrap();
        let second = "# second\n[gains.flight.afbc.roll]\na = 2\n\n[gains.flight.cascade]\nb = 2\n";
        let file = replaced(&file, second).unwrap();
        let pid = "# first\n[gains.flight.pid]\nc = 1\n";
        assert_eq!(file, format!("[vehicle]\n\n{BEGIN}\n{second}\n{pid}{END}\n"));
        let third = "# third\n[gains.flight.indi]\nd = 3\n";
        let file = replaced(&file, third).unwrap();
        assert_eq!(file, format!("[vehicle]\n\n{BEGIN}\n{third}\n{second}\n{pid}{END}\n"));
        // A law that is searched again takes its comment with it, and a comment within a table stays there.
        let again =
            replaced(&file, "# fourth\n[gains.flight.afbc.roll]\na = 4\n\n[gains.flight.cascade]\nb = 4\n").unwrap();
        assert!(!again.contains("# second") && again.contains(&third.to_owned()) && again.contains(pid), "{again}");
        let by_hand = format!("{BEGIN}\n[gains.flight.indi]\n# why\nd = 1\n\n[gains.paper.pid]\ne = 1\n{END}\n");
        let file_by_hand = replaced(&by_hand, "[gains.flight.pid]\nc = 5\n").unwrap();
        assert!(
            file_by_hand.contains("[gains.flight.indi]\n# why\nd = 1\n\n[gains.paper.pid]\ne = 1\n"),
            "{file_by_hand}"
        );
        // With every law searched again, nothing old is left.
        let all = replaced(&file, &format!("{first}\n[gains.flight.indi]\nd = 4\n")).unwrap();
        assert!(!all.contains("second") && !all.contains("= 2") && !all.contains("= 3"), "{all}");
    }
}
