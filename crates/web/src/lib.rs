//! What pages are made of, each file as one text to be put into a page or served beside it, so that it needs no
//! network: three.js (MIT) for the vehicle in three dimensions and uPlot (MIT) for charts over time, and the page that
//! shows a vehicle ([`page_files`]). `scripts/build-web` bundles the libraries from the versions in `package.json`;
//! their licences are beside them, in `vendor`.

#![forbid(unsafe_code)]

mod page;
mod vendor;

pub use page::{PageFile, fit_script, page_files};
pub use vendor::{THREE_JS, UPLOT_CSS, UPLOT_JS};
