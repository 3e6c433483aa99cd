//! Datasets, results, scores and pages, on made-up and on real data.

mod datasets;
mod exports_read_back;
mod layouts_of_results;
mod published;
mod report;
mod same_boxes;
mod store;
mod support;
mod wrong_input;
