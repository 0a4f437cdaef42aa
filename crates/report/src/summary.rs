//! Writes `summary.json`: the figures of merit of each run.

use afbc::Profile;
use afbc_scenario::case::{Reading, Sign};
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::{AidMetrics, AidSource, EstimateMetrics, SETTLED_S};
use nalgebra::Vector4;
use serde::Serialize;
use std::io::{self, Write};

/// Summary of one run. A value that does not apply or could not be measured is null.
#[derive(Serialize)]
struct RunJson<'a> {
    scenario: &'a str,
    reading: Option<&'a str>,
    inertia_sign: Option<&'a str>,
    thrust_sign: Option<&'a str>,
    plant: &'a str,
    contender: &'a str,
    controller: &'a str,
    /// Profile whose gains and settings were flown, if any.
    profile: Option<&'a str>,
    duration_s: f64,
    lost_at_s: Option<f64>,
    lost_reason: Option<&'a str>,
    /// Time at which AFBC's monitor switched to the fallback law, and the reason.
    tripped_at_s: Option<f64>,
    tripped_reason: Option<&'a str>,
    seed: u64,
    /// Time from which `rmse`, `max_abs` and `mean_abs_delta_u_n` are evaluated.
    measured_from_s: f64,
    rmse: Option<OutputsJson>,
    max_abs: Option<OutputsJson>,
    final_error: OutputsJson,
    /// Mean absolute change of U1..U4 per control step.
    mean_abs_delta_u_n: Option<[f64; 4]>,
    /// Errors of the vehicle's own estimate.
    estimate: Option<EstimateJson>,
}

#[derive(Serialize)]
struct EstimateJson {
    position_rms_m: f64,
    horizontal_rms_m: f64,
    velocity_rms_m_s: f64,
    attitude_rms_deg: f64,
    tilt_rms_deg: f64,
    heading_rms_deg: f64,
    nees_mean: f64,
    valid_ratio: f64,
    aids: Vec<EstimateAidJson>,
}

#[derive(Serialize)]
struct EstimateAidJson {
    name: &'static str,
    fused: u64,
    rejected: u64,
    nis_mean: Option<f64>,
}

impl From<EstimateMetrics> for EstimateJson {
    fn from(metrics: EstimateMetrics) -> Self {
        let EstimateMetrics { position_m, velocity_m_s, attitude_rad, nees, valid_ratio, aids } = metrics;
        let heard = AidSource::ALL.into_iter().zip(aids).filter(|(_, aid)| aid.fused + aid.rejected > 0);
        let aid = |(aid, AidMetrics { fused, rejected, nis, .. })| EstimateAidJson {
            name: name(aid),
            fused,
            rejected,
            nis_mean: (fused > 0).then_some(nis),
        };
        EstimateJson {
            position_rms_m: position_m.norm(),
            horizontal_rms_m: position_m.xy().norm(),
            velocity_rms_m_s: velocity_m_s.norm(),
            attitude_rms_deg: attitude_rad.norm().to_degrees(),
            tilt_rms_deg: attitude_rad.xy().norm().to_degrees(),
            heading_rms_deg: attitude_rad.z.to_degrees(),
            nees_mean: nees,
            valid_ratio,
            aids: heard.map(aid).collect(),
        }
    }
}

const fn name(aid: AidSource) -> &'static str {
    match aid {
        AidSource::TrackerPosition => "tracker-position",
        AidSource::TrackerAttitude => "tracker-attitude",
        AidSource::GnssPosition => "gnss-position",
        AidSource::GnssHeight => "gnss-height",
        AidSource::GnssVelocity => "gnss-velocity",
        AidSource::Height => "height",
        AidSource::Heading => "heading",
    }
}

#[derive(Serialize)]
struct OutputsJson {
    x_m: f64,
    y_m: f64,
    z_m: f64,
    psi_rad: f64,
}

impl From<Vector4<f64>> for OutputsJson {
    fn from(v: Vector4<f64>) -> Self {
        OutputsJson { x_m: v.x, y_m: v.y, z_m: v.z, psi_rad: v.w }
    }
}

fn summary(ScenarioFlight { scenario, run }: &ScenarioFlight) -> RunJson<'_> {
    let uncertainty = scenario.case.and_then(|case| case.uncertainty);
    let measured = |figures: Vector4<f64>| run.is_settled().then_some(figures);
    RunJson {
        scenario: &scenario.name,
        reading: scenario.case.and_then(|case| case.reading).map(Reading::name),
        inertia_sign: uncertainty.map(|u| u.inertia).map(Sign::symbol),
        thrust_sign: uncertainty.map(|u| u.thrust).map(Sign::symbol),
        plant: scenario.model.name(),
        contender: &run.contender.name,
        controller: run.contender.kind().name(),
        profile: run.contender.profile().map(Profile::name),
        duration_s: scenario.duration_s,
        lost_at_s: run.lost.map(|lost| lost.time_s),
        lost_reason: run.lost.map(|lost| lost.reason),
        tripped_at_s: run.tripped.map(|tripped| tripped.time_s),
        tripped_reason: run.tripped.map(|tripped| tripped.reason),
        seed: scenario.seed,
        measured_from_s: SETTLED_S,
        rmse: measured(run.metrics.rmse).map(OutputsJson::from),
        max_abs: measured(run.metrics.max_abs).map(OutputsJson::from),
        final_error: run.metrics.final_error.into(),
        mean_abs_delta_u_n: measured(run.metrics.mean_abs_delta_u).map(Into::into),
        estimate: run.metrics.estimate.map(EstimateJson::from),
    }
}

/// Writes an array with one object per run.
///
/// # Errors
/// Fails if writing to `out` fails.
pub fn write(out: &mut dyn Write, flown: &[ScenarioFlight]) -> io::Result<()> {
    let summaries: Vec<_> = flown.iter().map(summary).collect();
    serde_json::to_writer_pretty(&mut *out, &summaries)?;
    writeln!(out)
}
