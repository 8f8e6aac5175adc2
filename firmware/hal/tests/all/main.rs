//! Drivers of converters against recorded transfers, in one binary.

mod ad5686r;
mod ad7606;
