//! Reads `kind = "file"`: the user's own path, from a file of comma-separated values.
//!
//! The file has either samples over time, with the columns of a flight log, or polynomials of the Crazyflie's tools
//! (`duration,x^0,...,x^7,y^0,...,yaw^7`).

use super::reference::{START, flyable};
use crate::trajectory::polynomial::{COEFFICIENTS, PolynomialCoefficients, PolynomialPiece, through};
use crate::trajectory::smoothing::{disturbs, median_step, smoothed};
use crate::trajectory::spline::PathSamples;
use crate::trajectory::{Reference, Trajectory, nearest_heading};
use afbc_files::read::{DelimitedFormat, FileError, SourceFile, Table};
use afbc_types::Range;
use csv::{ReaderBuilder, StringRecord};
use std::path::Path;

/// Key of the file's path.
const FILE: &str = "file";
/// Accepted factor on the speed.
const PACE: Range = Range::new("pace", 0.01, 100.0);
/// Largest number of lines of a path.
const LINES: usize = 200_000;
/// Largest coordinate and largest angle \[m, rad\].
const LARGEST: f64 = 10_000.0;
/// Coarsest rounding that is smoothed. Numbers with fewer decimals count as exact: people type them.
const COARSEST: f64 = 0.01;
/// First column of a file of polynomials.
const DURATION: &str = "duration";
/// Coordinates with the columns of their value, first and second derivative.
const COLUMNS: [[&[&str]; 3]; 4] = [
    [&["x_m"], &["vx_m_s"], &["ax_m_s2"]],
    [&["y_m"], &["vy_m_s"], &["ay_m_s2"]],
    [&["z_m"], &["vz_m_s"], &["az_m_s2"]],
    [&["yaw_rad", "psi_rad"], &["yaw_rate_rad_s"], &["yaw_acceleration_rad_s2"]],
];

/// Reads the path that the table names, relative to the folder of the scenario's file.
pub(super) fn read(table: &mut Table<'_>) -> Result<Trajectory, FileError> {
    let named = table.need_text(FILE, "give the path of a file of comma-separated values")?;
    let start_s = table.number(&START)?;
    let pace = table.number(&PACE)?.unwrap_or(1.0);
    table.finish()?;
    if !table.knows(FILE) {
        return Ok(Trajectory::Paper);
    }
    let path = Path::new(table.file()).parent().unwrap_or(Path::new("")).join(named);
    let shown = path.display().to_string();
    let text = std::fs::read_to_string(&path)
        .map_err(|error| table.fault_at(FILE, format!("{shown} cannot be read ({error}); name a text file")))?;
    let file = PathLines { source: SourceFile { file: &shown, text: &text } };
    let mut pieces = file.pieces().map_err(|error| table.through(FILE, error))?;
    let first_s = pieces.first().map_or(0.0, |piece| piece.start_s);
    let start_s = start_s.unwrap_or(first_s);
    for piece in &mut pieces {
        *piece = paced(piece, first_s, start_s, pace);
    }
    if start_s < 0.0 {
        return Err(table.fault_at(FILE, format!("the path begins at {start_s} s; set start_s to 0 or later")));
    }
    let path = Trajectory::Polynomials(pieces);
    flyable(table, FILE, &path)?;
    Ok(path)
}

/// Returns the piece of a path that is flown `pace` times as fast. The path begins at `start_s` instead of `first_s`.
fn paced(piece: &PolynomialPiece, first_s: f64, start_s: f64, pace: f64) -> PolynomialPiece {
    let mut coefficients = piece.coefficients;
    for axis in &mut coefficients {
        let mut factor = 1.0;
        // At `pace` times the speed, the coefficient of s^k is multiplied by pace^k.
        for coefficient in axis {
            *coefficient *= factor;
            factor *= pace;
        }
    }
    let start_s = start_s + (piece.start_s - first_s) / pace;
    PolynomialPiece { start_s, duration_s: piece.duration_s / pace, coefficients }
}

/// A path's file.
struct PathLines<'a> {
    source: SourceFile<'a>,
}

impl PathLines<'_> {
    fn pieces(&self) -> Result<Vec<PolynomialPiece>, FileError> {
        let mut reader = ReaderBuilder::new()
            .delimiter(self.form().separator)
            .trim(csv::Trim::All)
            .from_reader(self.source.text.as_bytes());
        let head = reader.headers().map_err(|error| self.broken(&error))?.clone();
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| self.broken(&error))?;
            if rows.len() >= LINES {
                return Err(self.fault(&record, "", format!("the path has more than {LINES} lines; remove some")));
            }
            rows.push(record);
        }
        match head.get(0) {
            Some(DURATION) => self.polynomials(&head, &rows),
            _ => self.samples(&head, &rows),
        }
    }

    /// Reads samples over time.
    fn samples(&self, head: &StringRecord, rows: &[StringRecord]) -> Result<Vec<PolynomialPiece>, FileError> {
        let place = |names: &[&str]| head.iter().position(|column| names.contains(&column));
        let need = |names: &[&str]| {
            let first = names.first().copied().unwrap_or_default();
            place(names).ok_or_else(|| {
                self.whole(format!("the column {first} is missing; a path needs time_s, x_m, y_m and z_m"))
            })
        };
        let time = need(&["time_s"])?;
        let mut samples = PathSamples { time_s: self.column(rows, time, head)?, ..PathSamples::default() };
        let later = samples.time_s.iter().zip(rows).skip(1);
        if let Some((before, (time_s, row))) =
            samples.time_s.iter().zip(later).find(|(before, (time_s, _))| before >= time_s)
        {
            return Err(self.fault(
                row,
                "time_s",
                format!("{time_s} is not later than {before}; make the times increase"),
            ));
        }
        if samples.time_s.len() < 2 {
            return Err(self.whole("the path has fewer than two lines of numbers; add lines"));
        }
        let mut units = [[COARSEST; 3]; 4];
        for (axis, [value, rate, acceleration]) in COLUMNS.into_iter().enumerate() {
            for (unit, names) in units.get_mut(axis).into_iter().flatten().zip([value, rate, acceleration]) {
                *unit = place(names).map_or(COARSEST, |place| unit_of(rows, place).min(COARSEST));
            }
            let known = |names| place(names).map(|place| self.column(rows, place, head)).transpose();
            let values = match (axis, place(value)) {
                (3, None) => vec![0.0; rows.len()],
                _ => self.column(rows, need(value)?, head)?,
            };
            if let (Some(slot), Some(rates), Some(accelerations)) =
                (samples.values.get_mut(axis), samples.rates.get_mut(axis), samples.accelerations.get_mut(axis))
            {
                *slot = if axis == 3 { unwrapped(values) } else { values };
                (*rates, *accelerations) = (known(rate)?, known(acceleration)?);
            }
        }
        let columns = samples.columns(&units);
        let step_s = median_step(&samples.time_s);
        let is_rounded = units.iter().take(3).any(|[unit, ..]| disturbs(*unit, step_s));
        let smooth = if is_rounded { smoothed(&samples.time_s, columns.each_ref().map(Vec::as_slice)) } else { None };
        Ok(smooth.unwrap_or_else(|| through(&samples.knots())))
    }

    /// Reads polynomials that follow one another.
    fn polynomials(&self, head: &StringRecord, rows: &[StringRecord]) -> Result<Vec<PolynomialPiece>, FileError> {
        let names = ["x", "y", "z", "yaw"].map(|axis| (0..COEFFICIENTS).map(move |power| format!("{axis}^{power}")));
        let expected: Vec<String> = core::iter::once(DURATION.to_owned()).chain(names.into_iter().flatten()).collect();
        if !head.iter().filter(|column| !column.is_empty()).eq(expected.iter().map(String::as_str)) {
            return Err(self.whole("its columns must be duration, x^0 to x^7, y^0 to y^7, z^0 to z^7, yaw^0 to yaw^7"));
        }
        let (mut pieces, mut start_s): (Vec<PolynomialPiece>, f64) = (Vec::new(), 0.0);
        for row in rows {
            let duration_s = self.number(row, 0, head)?;
            if duration_s <= 0.0 {
                return Err(self.fault(row, DURATION, "a piece must last longer than 0 s".into()));
            }
            let mut coefficients: [PolynomialCoefficients; 4] = Default::default();
            for (i, coefficient) in coefficients.iter_mut().flatten().enumerate() {
                *coefficient = self.number(row, i + 1, head)?;
            }
            let mut piece = PolynomialPiece { start_s, duration_s, coefficients };
            if let Some(before) = pieces.last() {
                let [.., [yaw_rad, ..]] = &mut piece.coefficients;
                *yaw_rad = nearest_heading(before.at(before.end_s()).yaw_rad, *yaw_rad);
                self.joined(row, before, &piece)?;
            }
            start_s = piece.end_s();
            pieces.push(piece);
        }
        if pieces.is_empty() {
            return Err(self.whole("the path has no line of numbers; add one"));
        }
        Ok(pieces)
    }

    /// Checks that a piece begins at the place, velocity and heading at which the previous piece ends.
    fn joined(&self, row: &StringRecord, before: &PolynomialPiece, piece: &PolynomialPiece) -> Result<(), FileError> {
        let [end, begin]: [Reference; 2] = [before.at(before.end_s()), piece.at(piece.start_s)];
        let jump_m = (end.position_m - begin.position_m).norm();
        let jump_m_s = (end.velocity_m_s - begin.velocity_m_s).norm();
        let turn_rad = (end.yaw_rad - begin.yaw_rad).abs();
        if jump_m > 0.01 || jump_m_s > 0.1 || turn_rad > 0.1 {
            let jump = format!("{jump_m:.3} m, {jump_m_s:.3} m/s and {turn_rad:.3} rad");
            let problem = format!("the piece begins {jump} from the end of the piece before");
            return Err(self.fault(row, DURATION, format!("{problem}; pieces must join")));
        }
        Ok(())
    }

    fn form(&self) -> DelimitedFormat {
        DelimitedFormat::of(self.source.text.as_bytes())
    }

    fn column(&self, rows: &[StringRecord], place: usize, head: &StringRecord) -> Result<Vec<f64>, FileError> {
        rows.iter().map(|row| self.number(row, place, head)).collect()
    }

    fn number(&self, row: &StringRecord, place: usize, head: &StringRecord) -> Result<f64, FileError> {
        let (text, column) = (row.get(place).unwrap_or_default(), head.get(place).unwrap_or_default());
        // Derivatives and coefficients may be larger than coordinates.
        let number = self.form().number(text).filter(|number| number.is_finite() && number.abs() <= 1e3 * LARGEST);
        let number = number.filter(|number| !column.ends_with("_m") || number.abs() <= LARGEST);
        number.ok_or_else(|| {
            self.fault(row, column, format!("\"{}\" is no number, or too large for a path", text.escape_debug()))
        })
    }

    fn whole(&self, problem: impl Into<String>) -> FileError {
        FileError::whole(self.source.file, problem)
    }

    fn fault(&self, row: &StringRecord, column: &str, problem: String) -> FileError {
        let at = row.position().map_or(0, |position| position.byte() as usize);
        FileError::at(self.source, at, column, problem)
    }

    fn broken(&self, error: &csv::Error) -> FileError {
        let at = error.position().map_or(0, |position| position.byte() as usize);
        let problem = match error.kind() {
            csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                format!("the line has {len} values, but the first line names {expected_len} columns")
            }
            _ => "not comma-separated values".into(),
        };
        FileError::at(self.source, at, "", problem)
    }
}

/// Returns the unit to which a column's numbers are rounded: one of the last decimal of the number with most decimals.
fn unit_of(rows: &[StringRecord], place: usize) -> f64 {
    let decimals = |text: &str| {
        let (digits, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
        let after = digits.split_once(['.', ',']).map_or(0, |(_, after)| after.len() as i32);
        after - exponent.parse::<i32>().unwrap_or_default().clamp(-30, 30)
    };
    let most = rows.iter().filter_map(|row| row.get(place)).map(decimals).max().unwrap_or_default();
    0.1_f64.powi(most.min(30))
}

/// Returns the angles without jumps of whole turns.
fn unwrapped(mut angles: Vec<f64>) -> Vec<f64> {
    let mut before = None;
    for angle in &mut angles {
        if let Some(before) = before {
            *angle = nearest_heading(before, *angle);
        }
        before = Some(*angle);
    }
    angles
}
