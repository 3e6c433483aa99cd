//! The files of exports: one module for a format, and what holds for all of them.

mod all_formats;
mod benchmarks;
mod coco;
mod cvat;
mod displayed_boxes;
mod kitti;
mod label_studio;
mod mot;
mod selection;
mod support;
mod voc;
mod yolo;
