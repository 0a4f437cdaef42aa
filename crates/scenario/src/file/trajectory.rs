//! Reads `[trajectory]`, the reference; its `kind` determines the other keys.

use super::motion::POSITION;
use super::path;
use super::reference::{START, flyable};
use crate::trajectory::minimum_snap::{FlatOutput, LEG_MIN_M, NoPath, PaceLimits, SWING_MAX, distance_m, minimum_snap};
use crate::trajectory::{Sine, Trajectory, Waypoint, nearest_heading};
use afbc_files::read::{FileError, Table};
use afbc_types::Range;
use core::f64::consts::{SQRT_2, TAU};
use libm::sqrt;

/// Accepted heading \[rad\].
const YAW: Range = Range::new("yaw_rad", -100.0, 100.0);
/// Accepted radius of a circle \[m\].
const RADIUS: Range = Range::new("radius_m", 0.0, 10_000.0);
/// Accepted acceleration towards the centre of a circle \[m/s2\].
const CENTRIPETAL: Range = Range::new("acceleration_m_s2", 0.001, 1000.0);
/// Accepted distance from the centre of a lemniscate to its ends \[m\].
const HALF_LENGTH: Range = Range::new("half_length_m", 0.01, 10_000.0);
/// Accepted largest speed on a lemniscate \[m/s\].
const SPEED: Range = Range::new("speed_m_s", 0.001, 1000.0);
/// Accepted period \[s\].
const PERIOD: Range = Range::new("period_s", 0.1, 36_000.0);
/// Accepted amplitude of a sine \[m\].
const AMPLITUDE: Range = Range::new("amplitude_m", -10_000.0, 10_000.0);
/// Accepted phase of a sine \[rad\].
const PHASE: Range = Range::new("phase_rad", -100.0, 100.0);
/// Accepted change of heading at a step \[rad\].
const TURN: Range = Range::new("turn_rad", -100.0, 100.0);
/// Accepted time of a step \[s\].
const STEP_TIME: Range = Range::new("at_s", 0.0, 36_000.0);
/// Accepted time of a waypoint \[s\].
const WAYPOINT_TIME: Range = Range::new("time_s", 0.0, 36_000.0);
/// Accepted largest speed through waypoints \[m/s\].
const SPEED_MAX: Range = Range::new("speed_max_m_s", 0.01, 100.0);
/// Accepted largest acceleration through waypoints \[m/s2\].
const ACCELERATION_MAX: Range = Range::new("acceleration_max_m_s2", 0.01, 100.0);

#[derive(Clone, Copy)]
enum TrajectoryKind {
    Paper,
    Hover,
    Step,
    Circle,
    Lemniscate,
    Lissajous,
    Waypoints,
    MinimumSnap,
    File,
}

impl TrajectoryKind {
    const ALL: [TrajectoryKind; 9] = [
        TrajectoryKind::Paper,
        TrajectoryKind::Hover,
        TrajectoryKind::Step,
        TrajectoryKind::Circle,
        TrajectoryKind::Lemniscate,
        TrajectoryKind::Lissajous,
        TrajectoryKind::Waypoints,
        TrajectoryKind::MinimumSnap,
        TrajectoryKind::File,
    ];

    const fn name(self) -> &'static str {
        match self {
            TrajectoryKind::Paper => "paper",
            TrajectoryKind::Hover => "hover",
            TrajectoryKind::Step => "step",
            TrajectoryKind::Circle => "circle",
            TrajectoryKind::Lemniscate => "lemniscate",
            TrajectoryKind::Lissajous => "lissajous",
            TrajectoryKind::Waypoints => "waypoints",
            TrajectoryKind::MinimumSnap => "minimum-snap",
            TrajectoryKind::File => "file",
        }
    }
}

pub(super) fn read(mut table: Table<'_>) -> Result<Trajectory, FileError> {
    let trajectory = match table.need_choice("kind", &TrajectoryKind::ALL, TrajectoryKind::name)? {
        TrajectoryKind::Paper => Trajectory::Paper,
        TrajectoryKind::Hover => {
            Trajectory::Hover { position_m: table.need_vector("position_m", &POSITION)?, yaw_rad: yaw(&mut table)? }
        }
        TrajectoryKind::Step => Trajectory::Step {
            from_m: table.need_vector("from_m", &POSITION)?,
            to_m: table.need_vector("to_m", &POSITION)?,
            at_s: table.need_number(&STEP_TIME)?,
            yaw_rad: yaw(&mut table)?,
            turn_rad: table.number(&TURN)?.unwrap_or(0.0),
        },
        TrajectoryKind::Circle => circle(&mut table)?,
        TrajectoryKind::Lemniscate => lemniscate(&mut table)?,
        TrajectoryKind::Lissajous => lissajous(&mut table)?,
        TrajectoryKind::Waypoints => waypoints(&mut table)?,
        TrajectoryKind::MinimumSnap => through_places(&mut table)?,
        TrajectoryKind::File => path::read(&mut table)?,
    };
    table.finish()?;
    Ok(trajectory)
}

fn yaw(table: &mut Table<'_>) -> Result<f64, FileError> {
    Ok(table.number(&YAW)?.unwrap_or(0.0))
}

fn circle(table: &mut Table<'_>) -> Result<Trajectory, FileError> {
    let centre_m = table.need_vector("centre_m", &POSITION)?;
    let radius_m = table.need_number(&RADIUS)?;
    let (acceleration_m_s2, period_s) = (table.number(&CENTRIPETAL)?, table.number(&PERIOD)?);
    let yaw_rad = yaw(table)?;
    // Unknown keys are refused first, since one may be a misspelt pace.
    table.finish()?;
    match (acceleration_m_s2, period_s) {
        (Some(_), Some(_)) => {
            let problem = "period_s and acceleration_m_s2 both set the pace; leave out one of them";
            table.clash(PERIOD.name, &[], problem)?;
        }
        (None, None) => table.clash(PERIOD.name, &[], "missing; add it (seconds)")?,
        _ => {}
    }
    let (period_s, key) = match acceleration_m_s2 {
        Some(acceleration_m_s2) => (TAU * sqrt(radius_m / acceleration_m_s2), CENTRIPETAL.name),
        None => (period_s.unwrap_or(PERIOD.max), PERIOD.name),
    };
    let circle = Trajectory::Circle { centre_m, radius_m, period_s, yaw_rad };
    flyable(table, key, &circle)?;
    Ok(circle)
}

/// Reads Gerono's lemniscate, x = a sin(w t), y = a/2 sin(2 w t). It is fastest in the middle, at sqrt(2) a w.
fn lemniscate(table: &mut Table<'_>) -> Result<Trajectory, FileError> {
    let centre_m = table.need_vector("centre_m", &POSITION)?;
    let (half_m, speed_m_s) = (table.need_number(&HALF_LENGTH)?, table.need_number(&SPEED)?);
    let rate = speed_m_s / (SQRT_2 * half_m);
    let period_s = TAU / rate;
    let sine = |amplitude_m, period_s| Sine { amplitude_m, period_s, phase_rad: 0.0 };
    let sines = [sine(half_m, period_s), sine(0.5 * half_m, 0.5 * period_s), sine(0.0, period_s)];
    let lemniscate = Trajectory::Lissajous { centre_m, sines, yaw_rad: yaw(table)? };
    flyable(table, SPEED.name, &lemniscate)?;
    Ok(lemniscate)
}

fn lissajous(table: &mut Table<'_>) -> Result<Trajectory, FileError> {
    let centre_m = table.need_vector("centre_m", &POSITION)?;
    let amplitude_m = table.need_vector("amplitude_m", &AMPLITUDE)?;
    let period_s = table.need_vector("period_s", &PERIOD)?;
    let phase_rad = table.vector("phase_rad", [&PHASE; 3])?.unwrap_or_default();
    let sine = |amplitude_m, period_s, phase_rad| Sine { amplitude_m, period_s, phase_rad };
    let sines = amplitude_m.zip_zip_map(&period_s, &phase_rad, sine).into();
    let lissajous = Trajectory::Lissajous { centre_m, sines, yaw_rad: yaw(table)? };
    flyable(table, PERIOD.name, &lissajous)?;
    Ok(lissajous)
}

fn waypoints(table: &mut Table<'_>) -> Result<Trajectory, FileError> {
    let (mut waypoints, tables) = (Vec::<Waypoint>::new(), table.tables("waypoint")?);
    if tables.is_empty() && table.knows("waypoint") {
        // Unknown keys are refused first, since one may be a misspelt `waypoint`.
        table.finish()?;
        return Err(table.missing("waypoint", "add [[trajectory.waypoint]] with time_s and position_m"));
    }
    for mut table in tables {
        let mut waypoint = Waypoint {
            time_s: table.need_number(&WAYPOINT_TIME)?,
            position_m: table.need_vector("position_m", &POSITION)?,
            yaw_rad: yaw(&mut table)?,
        };
        table.finish()?;
        // Do not check legs from or to a place or time that could not be read.
        if !table.knows(WAYPOINT_TIME.name) || !table.knows(POSITION.name) {
            continue;
        }
        if let Some(before) = waypoints.last() {
            let length_s = waypoint.time_s - before.time_s;
            if length_s <= 0.0 {
                let problem = format!(
                    "{} is not later than the {} of the waypoint before; make the times increase",
                    waypoint.time_s, before.time_s
                );
                table.clash(WAYPOINT_TIME.name, &[], problem)?;
                continue;
            }
            waypoint.yaw_rad = nearest_heading(before.yaw_rad, waypoint.yaw_rad);
            flyable(&table, WAYPOINT_TIME.name, &Trajectory::Waypoints(vec![*before, waypoint]))?;
        }
        waypoints.push(waypoint);
    }
    if waypoints.is_empty() {
        return Ok(Trajectory::Paper);
    }
    Ok(Trajectory::Waypoints(waypoints))
}

/// Reads a minimum-snap path through places, from rest to rest, within limits of speed and acceleration.
fn through_places(table: &mut Table<'_>) -> Result<Trajectory, FileError> {
    let start_s = table.number(&START)?.unwrap_or(0.0);
    let limits = PaceLimits {
        speed_m_s: table.need_number(&SPEED_MAX)?,
        acceleration_m_s2: table.need_number(&ACCELERATION_MAX)?,
    };
    let (mut places, mut are_known) = (Vec::<FlatOutput>::new(), true);
    for mut table in table.few_tables("waypoint")? {
        let position_m = table.need_vector("position_m", &POSITION)?;
        let place = [position_m.x, position_m.y, position_m.z, yaw(&mut table)?];
        table.finish()?;
        let is_known = table.knows(POSITION.name);
        if let Some(length_m) = places.last().map(|before| distance_m(before, &place)).filter(|it| *it < LEG_MIN_M)
            && is_known
        {
            let near = format!(
                "the waypoint is {length_m} m from the waypoint before, nearer than {LEG_MIN_M} m; leave one of the \
                 two out"
            );
            table.clash("position_m", &[], near)?;
        } else if is_known {
            places.push(place);
        }
        are_known &= is_known;
    }
    if places.len() < 2 && are_known && table.knows("waypoint") {
        table.finish()?;
        return Err(table.missing("waypoint", "add two or more [[trajectory.waypoint]] with position_m"));
    }
    let pieces = match minimum_snap(&places, start_s, limits) {
        Ok(pieces) => pieces,
        Err(error) => {
            let cure = "make the distances between waypoints more alike, or leave out one of two near waypoints";
            let problem = match error {
                NoPath::Swings(leg) => {
                    let swing = format!("leaves the straight line by more than {SWING_MAX} times the longest distance");
                    format!("from waypoint {} to {} the smooth path {swing}", leg + 1, leg + 2)
                }
                NoPath::TooFew | NoPath::ShortLeg(_) | NoPath::Unsolvable => {
                    "no smooth path goes through the waypoints".into()
                }
            };
            table.clash("waypoint", &[], format!("{problem}; {cure}"))?;
            return Ok(Trajectory::Paper);
        }
    };
    let path = Trajectory::Polynomials(pieces);
    flyable(table, SPEED_MAX.name, &path)?;
    Ok(path)
}
