//! Figures in the documents are compared with the code, or state how and when they were measured.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // a page that cannot be read must stop the test

use afbc::Profile;
use afbc::adaptive;
use afbc_scenario::contender::ControllerKind;
use std::fs;
use std::path::Path;

/// True if `text` has a date after "measured" or "Measured".
fn is_dated(text: &str) -> bool {
    let is_date = |word: &str| {
        let form: String = word.chars().take(10).map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
        form == "0000-00-00"
    };
    text.split("easured").skip(1).any(|after| after.split_whitespace().next().is_some_and(is_date))
}

/// True if `text` names a source file that reads the page `name`.
fn is_compared(root: &Path, text: &str, name: &str) -> bool {
    let mut words = text.split(|c: char| !(c.is_alphanumeric() || "_./-".contains(c)));
    words.any(|word| word.ends_with(".rs") && fs::read_to_string(root.join(word)).is_ok_and(|code| code.contains(name)))
}

/// Tables with right-aligned columns hold figures. Their section names the source file that compares them with the
/// code, or says "Measured" with a date.
#[test]
fn every_table_of_figures_is_compared_or_dated() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let docs = root.join("docs");
    let folders = [docs.clone(), docs.join("reference")];
    let entries = folders.iter().flat_map(|folder| fs::read_dir(folder).unwrap());
    let mut pages: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    pages.extend(["README.md", "ARCHITECTURE.md"].map(|name| root.join(name)));
    pages.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
    let mut tables = 0;
    for page in pages {
        let name = page.strip_prefix(&docs).or_else(|_| page.strip_prefix(root)).unwrap().to_str().unwrap();
        let text = fs::read_to_string(&page).unwrap();
        for section in text.split("\n## ").filter(|section| section.lines().any(|line| line.contains("--:|"))) {
            let heading = section.lines().next().unwrap();
            assert!(
                is_compared(root, section, name) || is_dated(section),
                "{name}, {heading}: name the test that compares the table, or \"Measured\" with date and command"
            );
            tables += 1;
        }
    }
    assert!(tables >= 8, "{tables} sections");
}

/// Every table of keys that names laws lists all laws.
#[test]
fn pages_that_list_the_laws_list_all() {
    for (page, text) in [
        ("reference/scenario-keys.md", include_str!("../../docs/reference/scenario-keys.md")),
        ("json.md", include_str!("../../docs/json.md")),
        ("tuning.md", include_str!("../../docs/tuning.md")),
    ] {
        for kind in ControllerKind::ALL {
            assert!(
                text.contains(&format!("`{}`", kind.name())) || text.contains(&format!("`\"{}\"`", kind.name())),
                "docs/{page} lacks {}",
                kind.name()
            );
        }
    }
}

#[test]
fn the_gains_of_the_profile_flight_are_those_on_its_page() {
    let page = include_str!("../../docs/flight.md");
    let (gains, settings) = (Profile::Flight.gains(), Profile::Flight.settings());
    let row = |axes: &str, gains: &adaptive::Gains| {
        let adaptive::Gains { backstepping, gamma, eta, epsilon, safeguards: s, .. } = gains;
        let figures = [
            backstepping.alpha1,
            backstepping.alpha2,
            backstepping.stiffness,
            *gamma,
            *eta,
            *epsilon,
            s.theta_max,
            s.delta_max,
            s.sigma,
        ];
        // Compares to half of the last digit written.
        let close = |(cell, figure): (&str, &f32)| {
            let decimals = cell.split_once('.').map_or(0, |(_, decimals)| decimals.len());
            (cell.parse::<f32>().unwrap() - figure).abs() <= 0.501 * 0.1_f32.powi(decimals as i32)
        };
        let line = page.lines().find(|line| line.starts_with(&format!("| {axes} |"))).unwrap();
        let cells: Vec<_> = line.trim_matches('|').split('|').skip(1).map(str::trim).collect();
        assert_eq!(cells.len(), figures.len(), "{line}");
        assert!(cells.into_iter().zip(&figures).all(close), "{line}\n{figures:?}");
    };
    assert_eq!((gains.roll, gains.x), (gains.pitch, gains.y));
    row("roll, pitch", &gains.roll);
    row("yaw", &gains.yaw);
    row("z", &gains.z);
    row("x, y", &gains.x);

    let l = settings.limits;
    let plain = page.split_whitespace().collect::<Vec<_>>().join(" ");
    for sentence in [
        format!("a command filter of {} rad/s", settings.command_filter_rad_s),
        format!("rotors that lag by 20 ms and give {} N each", settings.common.rotor_force_max_n),
        format!(
            "tilt {} rad, tilt rate {} rad/s, acceleration {} m/s2, and for errors a speed of {} m/s, \
             {} m/s vertically",
            l.tilt_max_rad, l.tilt_rate_max_rad_s, l.acceleration_max_m_s2, l.speed_max_m_s, l.climb_max_m_s
        ),
    ] {
        assert!(plain.contains(&sentence), "docs/flight.md lacks: {sentence}");
    }
}
