//! Figures, as SVG: of flights, comparisons and campaigns.
//!
//! Onsets of gusts are marked, and intervals with a fault or changed parameters are shaded. A contender has the same
//! colour in every figure.

pub(super) mod campaign;
mod canvas;
pub(super) mod compare;
mod figure;
pub(super) mod flights;
mod law;
mod marks;
mod palette;
mod reduce;
mod time_chart;
mod trajectory;

pub(super) use figure::Figure;
