//! Interactive view of flights in space.

use super::chart::LineStyle;
use super::packed::deltas;
use nalgebra::Vector3;
use serde::Serialize;

/// Largest number of points of a track.
const POINTS_MAX: usize = 1500;
/// Grid steps along the time axis, along an edge of the box, and in a full turn.
const TIME_STEPS: f64 = 1e6;
const BOX_STEPS: f64 = 65_536.0;
const TURN_STEPS: f64 = 65_536.0;

/// Flights in space, in the form that the page's script reads. Axes: x forward (or north), y left (or west), z up.
#[derive(Serialize)]
pub(crate) struct ExplorableScene {
    pub(crate) title: String,
    pub(crate) end_s: f64,
    /// Corners of the box that contains the tracks \[m\].
    pub(crate) low_m: [f64; 3],
    pub(crate) high_m: [f64; 3],
    /// Positions of the rotors in the body frame \[m\].
    pub(crate) rotors_m: Vec<[f64; 2]>,
    pub(crate) tracks: Vec<FlightTrack>,
}

/// The path of a vehicle, stored as differences on a grid: times in millionths of the scene's duration, positions in
/// 2^-16 of the box's edges from its lower corner, angles in 2^-16 of a turn.
#[derive(Serialize)]
pub(crate) struct FlightTrack {
    name: String,
    #[serde(flatten)]
    pen: LineStyle,
    times: Vec<i64>,
    position: [Vec<i64>; 3],
    /// Roll, pitch and yaw; `None` for a reference.
    attitude: Option<[Vec<i64>; 3]>,
}

/// Time \[s\], position \[m\], and roll, pitch and yaw \[rad\].
pub(crate) type TimedPose = (f64, Vector3<f64>, Vector3<f64>);

/// Returns made-up rotor positions on a circle \[m\], for a vehicle of which only the number of rotors is known.
pub(crate) fn rotors_on_a_circle_m(count: usize) -> Vec<[f64; 2]> {
    let rotor = |i: usize| {
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * (i as f64 + 0.5) / count as f64);
        [0.2 * cos, 0.2 * sin]
    };
    (0..count).map(rotor).collect()
}

impl ExplorableScene {
    /// Returns a scene whose box contains all these places, still without tracks; `None` for fewer than two places.
    pub(crate) fn around<'a>(
        places: impl Iterator<Item = &'a TimedPose> + Clone,
        rotors_m: Vec<[f64; 2]>,
    ) -> Option<Self> {
        places.clone().nth(1)?;
        let end_s = places.clone().map(|place| place.0).fold(0.0, f64::max);
        let limits = places.fold(None, |limits: Option<[Vector3<f64>; 2]>, place| {
            let [low, high] = limits.unwrap_or([place.1; 2]);
            Some([low.inf(&place.1), high.sup(&place.1)])
        });
        let [low, high] = limits?;
        let room = Vector3::repeat(0.25 + 0.05 * (high - low).max());
        let title = "In space".to_owned();
        Some(ExplorableScene {
            title,
            end_s,
            low_m: (low - room).into(),
            high_m: (high + room).into(),
            rotors_m,
            tracks: Vec::new(),
        })
    }

    /// Reduces each track to at most `points` points plus its last one, for pages with many flights.
    pub(crate) fn thinned(mut self, points: usize) -> Self {
        for track in &mut self.tracks {
            let stride = track.times.len().div_ceil(points.max(1)).max(1);
            let attitude = track.attitude.iter_mut().flatten();
            for deltas in core::iter::once(&mut track.times).chain(&mut track.position).chain(attitude) {
                *deltas = strided(deltas, stride);
            }
        }
        self
    }

    /// Adds the path of a vehicle, or of its reference, which has no attitude.
    pub(crate) fn add(&mut self, name: String, pen: LineStyle, places: &[TimedPose], is_reference: bool) {
        let stride = places.len().div_ceil(POINTS_MAX).max(1);
        // Keep the last place even if the stride skips it.
        let last = places.last().filter(|_| places.len() % stride != 1 && stride > 1);
        let few: Vec<&TimedPose> = places.iter().step_by(stride).chain(last).collect();
        let (low, high) = (Vector3::from(self.low_m), Vector3::from(self.high_m));
        let along = |axis: usize| {
            let [low, high] = [low, high].map(|corner| corner.get(axis).copied().unwrap_or_default());
            let value = move |place: &&TimedPose| place.1.get(axis).copied().unwrap_or_default();
            deltas(few.iter().map(value), low, high, BOX_STEPS)
        };
        let about = |axis: usize| {
            let value = move |place: &&TimedPose| place.2.get(axis).copied().unwrap_or_default();
            deltas(few.iter().map(value), 0.0, core::f64::consts::TAU, TURN_STEPS)
        };
        self.tracks.push(FlightTrack {
            name,
            pen,
            times: deltas(few.iter().map(|place| place.0), 0.0, self.end_s, TIME_STEPS),
            position: [0, 1, 2].map(along),
            attitude: (!is_reference).then(|| [0, 1, 2].map(about)),
        });
    }
}

/// Returns the differences between every `stride`-th value, including the last one.
fn strided(deltas: &[i64], stride: usize) -> Vec<i64> {
    let mut sum = 0;
    let step = |(place, delta): (usize, &i64)| {
        sum += delta;
        (place % stride == 0 || place + 1 == deltas.len()).then(|| core::mem::take(&mut sum))
    };
    deltas.iter().enumerate().filter_map(step).collect()
}

#[cfg(test)]
mod tests {
    #![expect(clippy::indexing_slicing, reason = "a test that panics has failed")]
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_left_of_a_track_is_where_it_was(
            deltas in prop::collection::vec(-1000..1000_i64, 0..60), stride in 1_usize..70,
        ) {
            let sums = |deltas: &[i64]| -> Vec<i64> {
                (1..=deltas.len()).map(|end| deltas[..end].iter().sum()).collect()
            };
            let (all, left) = (sums(&deltas), sums(&strided(&deltas, stride)));
            let mut expected: Vec<i64> = all.iter().step_by(stride).copied().collect();
            if deltas.len() % stride != 1 && stride > 1 {
                expected.extend(all.last());
            }
            prop_assert_eq!(left, expected);
        }
    }
}
