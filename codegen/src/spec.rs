//! Reads the spec file: TOML text to a checked [`crate::model::Model`]. The only module that knows TOML.
