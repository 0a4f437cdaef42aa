//! Figures, as SVG: of flights, comparisons and campaigns.
//!
//! Gusts are marked where they strike, and shaded is for how long something is the matter. A contender has the same colour
//! in every figure, whoever else is in it.

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
