//! Files of the project's web pages, compiled in so that a page needs no network.
//!
//! They are three.js (MIT) for the 3D view, uPlot (MIT) for charts over time, and the page that shows a vehicle
//! ([`page_files`]). `scripts/build-web` bundles the libraries in the versions of `package.json`. Their licences are in
//! `vendor`.

#![forbid(unsafe_code)]

mod page;
mod vendor;

pub use page::{PageFile, fit_script, page_files};
pub use vendor::{THREE_JS, UPLOT_CSS, UPLOT_JS};
