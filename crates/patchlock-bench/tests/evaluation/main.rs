//! Datasets, results, scores, exports and pages, on made-up and on real data.

mod datasets;
mod displayed_boxes;
mod export;
mod layouts_of_results;
mod published;
mod report;
mod same_boxes;
mod selection;
mod store;
mod support;
mod wrong_input;
