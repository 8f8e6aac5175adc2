//! Tests of the command and the compiler from a user's view, in one binary: a module for each subject.
#![allow(clippy::unwrap_used, clippy::panic)] // Helpers of tests, where a panic is a failed test.

mod arrays;
mod assumed;
#[path = "../../../tests/tests/board_support/mod.rs"]
mod board_support;
mod build_cache;
mod cli;
mod commission;
mod documents;
mod dynamics_command;
mod examples;
mod export;
mod files;
mod findings;
mod firmware;
mod fmu;
mod gains;
mod guide;
mod interrupt;
mod kills;
mod lsp;
mod microcontroller;
mod new;
mod operate;
mod optional;
mod output_folder;
mod pil;
mod platform_check;
mod platform_reach;
mod rate_specs;
mod recording;
mod records;
mod refit;
mod report;
mod reproducible;
mod robust;
mod rt_pc;
mod scale;
mod shell_lines;
mod support;
mod tune;
