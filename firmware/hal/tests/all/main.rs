//! Tests of converter drivers with recorded transfers, in one binary.

mod ad5686r;
mod ad7606;
