//! `sitl plot`: draws figures for papers from logs.

use super::terminal::{CommandError, print};
use afbc_files::OutputFile;
use afbc_plot::{
    FigureFormat, FigurePanel, LogColumns, PanelLine, PaperFigure, Points, axis_title, binned, over_seeds,
};
use afbc_report::contender_color;
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Millimetres per inch and per point.
const INCH_MM: f64 = 25.4;
const POINT_MM: f64 = INCH_MM / 72.0;

/// Draw a figure for a paper from logs: CSV, Parquet, ULog or MCAP
///
/// Draws a panel for each --y, over time or --x. Logs of the same name count as seeds of one law: the figure shows
/// their median with a band. A campaign's results.parquet gives median and band over any drawn quantity. See
/// docs/papers.md.
#[derive(Args, Debug)]
pub(crate) struct PlotArgs {
    /// Logs, as FILE or NAME=FILE; NAME is for the legend [default: the file's name]
    #[arg(required = true, value_name = "[NAME=]FILE")]
    logs: Vec<String>,

    /// Columns of a panel; give --y once for each panel. For ULog and MCAP, write topic.field
    #[arg(long, required = true, value_name = "COLUMN,...")]
    y: Vec<String>,

    /// Column for the x-axis [default: the time]
    #[arg(long, value_name = "COLUMN")]
    x: Option<String>,

    /// File to write: .pdf, .svg or .png
    #[arg(long, value_name = "FILE", default_value = "figure.pdf")]
    out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    force: bool,

    /// Width of the figure, in mm, cm, in or pt
    #[arg(long, value_name = "LENGTH", default_value = "88mm", value_parser = length)]
    width: f64,

    /// Height of a panel
    #[arg(long, value_name = "LENGTH", default_value = "34mm", value_parser = length)]
    height: f64,

    /// Font size
    #[arg(long, value_name = "LENGTH", default_value = "8pt", value_parser = length)]
    font: f64,

    /// Line width
    #[arg(long, value_name = "LENGTH", default_value = "0.9pt", value_parser = length)]
    line: f64,

    /// Pixels per inch of a .png
    #[arg(long, value_name = "N", default_value = "300", value_parser = clap::value_parser!(u32).range(30..=2400))]
    dpi: u32,

    /// Percentage of the seeds, or of a campaign's rows, within the band
    #[arg(long, value_name = "PERCENT", default_value = "80", value_parser = percent)]
    band: f64,

    /// Where the x-axis begins
    #[arg(long, value_name = "X", requires = "to", allow_negative_numbers = true)]
    from: Option<f64>,

    /// Where the x-axis ends
    #[arg(long, value_name = "X", requires = "from", allow_negative_numbers = true)]
    to: Option<f64>,

    /// Logarithmic y-axes
    #[arg(long)]
    log_y: bool,

    /// Title of the x-axis [default: the column's name, with its unit]
    #[arg(long, value_name = "TEXT")]
    x_title: Option<String>,

    /// Title of a panel's y-axis, in the order of --y [default: the columns' names, with their unit]
    #[arg(long, value_name = "TEXT")]
    y_title: Vec<String>,
}

/// Parses a length \[mm\].
fn length(text: &str) -> Result<f64, String> {
    let units = [("mm", 1.0), ("cm", 10.0), ("in", INCH_MM), ("pt", POINT_MM)];
    let number = units.iter().find_map(|(unit, mm)| Some(text.strip_suffix(unit)?.trim().parse::<f64>().ok()? * mm));
    number
        .filter(|mm| (0.01..=2000.0).contains(mm))
        .ok_or_else(|| "a length must be at most 2000 mm, such as 88mm, 3.5in or 8pt".into())
}

fn percent(text: &str) -> Result<f64, &'static str> {
    text.parse()
        .ok()
        .filter(|percent| (0.0..=100.0).contains(percent))
        .ok_or("the percentage must be from 0 to 100, such as 80")
}

/// Log and its name in the legend.
struct NamedLog {
    name: String,
    columns: LogColumns,
}

/// Lines of one name in a panel.
struct PanelLines {
    name: String,
    column: usize,
    /// True for rows of a campaign, each of which is a flight; false for flights over time.
    is_rows: bool,
    all: Vec<Points>,
}

impl PlotArgs {
    /// Reads the logs, draws and writes the figure.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let out = self.out.display();
        let Some(format) = FigureFormat::of(&self.out, self.dpi.into()) else {
            return Err(format!("--out {out}: the name's ending selects the format; use .pdf, .svg or .png").into());
        };
        let output = OutputFile::forcible(&self.out, "--out", self.force)?;
        let logs = self.logs()?;
        let x = match (&self.x, logs.first(), self.columns().next()) {
            (None, Some(first), Some(y)) => first.columns.usual_x(y)?,
            (x, ..) => x.clone().unwrap_or_default(),
        };
        // Topics have times of their own; the title names the time without its topic.
        let bare = x.rsplit('.').next().unwrap_or_default().to_owned();
        let panels = self.y.iter().enumerate().map(|(index, columns)| {
            let columns: Vec<&str> = columns.split(',').map(str::trim).collect();
            let usual = || columns.iter().map(|column| axis_title(column)).collect::<Vec<_>>().join(", ");
            let y_title = self.y_title.get(index).cloned().unwrap_or_else(usual);
            Ok(FigurePanel { y_title, lines: self.lines(&logs, &columns)? })
        });
        let panels = panels.collect::<Result<Vec<_>, CommandError>>()?;
        let figure = PaperFigure {
            width_mm: self.width,
            panel_mm: self.height,
            font_pt: self.font / POINT_MM,
            line_pt: self.line / POINT_MM,
            title: format!("{} over {x}", self.y.join(", ")),
            x_title: self.x_title.clone().unwrap_or_else(|| axis_title(self.x.as_ref().unwrap_or(&bare))),
            x_range: self.from.zip(self.to).map(|(from, to)| [from, to]),
            is_logarithmic: self.log_y,
            panels,
        };
        let bytes = figure.write(format).map_err(|problem| format!("--out {out}: {problem}"))?;
        output.write(|to| to.write_all(&bytes))?;
        print(&format!("{out}: {:.1} mm wide, {} panels\n", self.width, self.y.len()))?;
        Ok(ExitCode::SUCCESS)
    }

    /// Returns the columns of all panels.
    fn columns(&self) -> impl Iterator<Item = &str> {
        self.y.iter().flat_map(|columns| columns.split(',')).map(str::trim)
    }

    /// Reads the logs.
    fn logs(&self) -> Result<Vec<NamedLog>, CommandError> {
        let split = |log: &String| match log.split_once('=') {
            // A file name may itself contain an equals sign.
            Some((name, path)) if !Path::new(log).exists() => (Some(name.to_owned()), PathBuf::from(path)),
            _ => (None, PathBuf::from(log)),
        };
        let split: Vec<_> = self.logs.iter().map(split).collect();
        let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let stems: Vec<String> = split.iter().filter(|(name, _)| name.is_none()).map(|(_, path)| stem(path)).collect();
        let common = common(&stems);
        let read = |(name, path): (Option<String>, PathBuf)| {
            let name = name.unwrap_or_else(|| stem(&path).split_at(common).1.to_owned());
            Ok(NamedLog { name, columns: LogColumns::read(&path)? })
        };
        split.into_iter().map(read).collect()
    }

    /// Returns the lines of a panel.
    fn lines(&self, logs: &[NamedLog], columns: &[&str]) -> Result<Vec<PanelLine>, CommandError> {
        let mut all: Vec<PanelLines> = Vec::new();
        let is_one_log = logs.iter().all(|log| logs.first().is_some_and(|first| first.name == log.name));
        for (column, y) in columns.iter().enumerate() {
            for log in logs {
                // Each topic of a log has its own time.
                let x = self.x.clone().map_or_else(|| log.columns.usual_x(y), Ok)?;
                for (contender, points) in log.columns.points(&x, y)? {
                    let is_rows = contender.is_some();
                    let name = match contender {
                        Some(contender) if is_one_log => contender,
                        Some(contender) => format!("{}, {contender}", log.name),
                        None => log.name.clone(),
                    };
                    match all.iter_mut().find(|other| other.name == name && other.column == column) {
                        Some(known) => known.all.push(points),
                        None => all.push(PanelLines { name, column, is_rows, all: vec![points] }),
                    }
                }
            }
        }
        let mut names: Vec<String> = Vec::new();
        all.iter().for_each(|one| {
            if !names.contains(&one.name) {
                names.push(one.name.clone());
            }
        });
        let line = |collected: PanelLines| {
            let PanelLines { name, column, is_rows, all } = collected;
            let place = names.iter().position(|other| *other == name).unwrap_or_default();
            let title = columns.get(column).map(|column| axis_title(column)).unwrap_or_default();
            // Columns of a single log get a colour each; columns of several logs get a dash pattern each.
            let (label, color, dash) = match (columns.len(), names.len()) {
                (1, _) if self.y.iter().any(|columns| columns.contains(',')) => {
                    (name.clone(), contender_color(&name), 0)
                }
                (1, _) => (name.clone(), contender_color(&name), place),
                (_, 1) => (title.clone(), contender_color(&title), column),
                _ => (format!("{name}: {title}"), contender_color(&name), column),
            };
            let (lines, band) = summarised(all, is_rows, self.band);
            PanelLine { label, color, dash, lines, band }
        };
        Ok(all.into_iter().map(line).collect())
    }
}

/// Returns the curves of one name: median and band for a campaign's rows and for several flights over time; otherwise
/// all flights.
fn summarised(all: Vec<Points>, is_rows: bool, percent: f64) -> (Vec<Points>, Vec<(f64, [f64; 2])>) {
    let rises = |points: &Points| points.windows(2).all(|two| matches!(two, [a, b] if a.0 < b.0));
    let band = match all.len() {
        _ if is_rows => binned(all.into_iter().flatten().collect(), percent),
        2.. if all.iter().all(rises) => over_seeds(&all, percent),
        _ => return (all, Vec::new()),
    };
    (vec![band.median], band.edges)
}

/// Returns the length of the common prefix of file names, up to a hyphen; 0 if all names are equal.
fn common(stems: &[String]) -> usize {
    let Some(first) = stems.first().filter(|first| stems.iter().any(|stem| stem != *first)) else { return 0 };
    let ends = first.match_indices('-').map(|(at, _)| at + 1);
    let shared = |end: &usize| first.get(..*end).is_some_and(|head| stems.iter().all(|stem| stem.starts_with(head)));
    ends.filter(shared).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_units() {
        for (text, mm) in [("88mm", 88.0), ("8.8 cm", 88.0), ("3.5in", 88.9), ("72pt", 25.4)] {
            assert!(length(text).is_ok_and(|read| (read - mm).abs() < 1e-9), "{text}");
        }
        for text in ["88", "mm", "-3mm", "NaNmm", "1e9in", "0mm"] {
            assert!(length(text).is_err(), "{text}");
        }
    }

    #[test]
    fn names_lose_what_they_have_in_common() {
        let common = |stems: &[&str]| common(&stems.iter().map(|stem| (*stem).to_owned()).collect::<Vec<_>>());
        assert_eq!(common(&["paper-afbc", "paper-backstepping"]), 6);
        assert_eq!(common(&["a-b-afbc", "a-b-pid", "a-b-p"]), 4);
        assert_eq!(common(&["paper-afbc", "paper-afbc"]), 0);
        assert_eq!(common(&["afbc", "pid"]), 0);
        assert_eq!(common(&[]), 0);
    }
}
