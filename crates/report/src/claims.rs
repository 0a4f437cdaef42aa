//! Checks the paper's three claims about its experiment on the flights.

use afbc_scenario::contender::ControllerKind;
use afbc_scenario::paper;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::tracking_error;
use afbc_sim::run::FlightResult;
use nalgebra::Vector4;

/// A claim of the paper's Section IV, and the result of checking it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Claim of the paper, in words.
    pub statement: String,
    /// True if the flights confirm the claim.
    pub holds: bool,
    /// Numbers that confirm or refute the claim.
    pub evidence: String,
}

/// Limit for "goes to zero": AFBC's remaining error as a share of backstepping's, on every axis. The limit is not zero
/// because the last gust comes 15 s before the end, and yaw is still adapting to it.
pub const VANISHED: f64 = 0.25;

/// Time at the end over which the remaining error is averaged \[s\].
pub const TAIL_S: f64 = 5.0;

/// Checks the three claims on the first scenario that both laws have flown. Returns an empty list if there is no such
/// scenario, or if it is shorter than the paper's experiment. No claim holds if a vehicle was lost.
pub fn claims(flown: &[ScenarioFlight]) -> Vec<Claim> {
    let find = |kind, of: &ScenarioFlight| {
        let whole = of.scenario.duration_s >= paper::DURATION_S;
        flown.iter().find(|f| whole && f.run.contender.kind() == kind && f.scenario == of.scenario).map(|f| &f.run)
    };
    let pair =
        flown.iter().find_map(|of| Some((find(ControllerKind::Afbc, of)?, find(ControllerKind::Backstepping, of)?)));
    let Some((afbc, baseline)) = pair else { return Vec::new() };
    let survived = afbc.lost.is_none() && baseline.lost.is_none();
    weigh(afbc, baseline)
        .map(|(statement, holds, evidence)| Claim {
            statement: statement.into(),
            holds: survived && holds,
            evidence: if survived { evidence } else { "a vehicle was lost".into() },
        })
        .to_vec()
}

/// Returns the mean |error| over the last [`TAIL_S`].
fn tail(run: &FlightResult) -> Vector4<f64> {
    let end_s = run.log.last().map_or(0.0, |last| last.time_s);
    let tail = run.log.iter().filter(|sample| sample.time_s >= end_s - TAIL_S);
    let (sum, count) = tail.fold((Vector4::zeros(), 0), |(sum, n), s| (sum + tracking_error(s).abs(), n + 1));
    sum / f64::from(count.max(1))
}

fn weigh(afbc: &FlightResult, baseline: &FlightResult) -> [(&'static str, bool, String); 3] {
    let (left, kept) = (tail(afbc), tail(baseline));
    let (close, far) = (afbc.metrics.rmse, baseline.metrics.rmse);
    let chatter = |run: &FlightResult| run.metrics.mean_abs_delta_u * 1000.0;
    let (rough, smooth) = (chatter(afbc), chatter(baseline));
    [
        (
            "AFBC's errors go to zero under gusts and uncertainty, backstepping keeps an error",
            below(&left, &(kept * VANISHED)),
            format!("mean |error| over the last 5 s: {} against {}", outputs(&left), outputs(&kept)),
        ),
        (
            "AFBC tracks better than backstepping",
            below(&close, &far),
            format!("RMSE {} against {}", outputs(&close), outputs(&far)),
        ),
        (
            "AFBC's inputs are less smooth than backstepping's",
            below(&smooth, &rough),
            format!("mean |change| per step of U1..U4: {} against {} mN", four(&rough, 2), four(&smooth, 2)),
        ),
    ]
}

/// Returns true if `a` is smaller on every axis.
fn below(a: &Vector4<f64>, b: &Vector4<f64>) -> bool {
    a.iter().zip(b).all(|(a, b)| a < b)
}

fn four(v: &Vector4<f64>, digits: usize) -> String {
    format!("{:.digits$}, {:.digits$}, {:.digits$}, {:.digits$}", v.x, v.y, v.z, v.w)
}

fn outputs(v: &Vector4<f64>) -> String {
    format!("x {:.3}, y {:.3}, z {:.3} m, psi {:.3} rad", v.x, v.y, v.z, v.w)
}
