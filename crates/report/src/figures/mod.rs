//! Figures as SVG: of flights, comparisons, campaigns and replays.
//!
//! Onsets of gusts are marked, and intervals with a fault or changed parameters are shaded. A contender has the same
//! colour in every figure.

#[cfg(feature = "campaigns")]
pub(super) mod campaign;
mod canvas;
#[cfg(feature = "campaigns")]
pub(super) mod compare;
#[cfg(feature = "replays")]
pub(super) mod exact;
pub(super) mod flights;
mod marks;
mod palette;
mod panel;
mod picture;
mod plotted_flight;
mod reduce;
#[cfg(feature = "replays")]
pub(super) mod replay;
mod time_chart;
mod trajectory;

pub(super) use picture::Picture;

/// Returns a contender's colour on white (red, green, blue); it is the same in every figure.
pub fn contender_color(name: &str) -> [u8; 3] {
    palette::color(name)
}
