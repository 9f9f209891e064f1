//! `report.html`.
mod slices;
mod svg;
mod timeline;
