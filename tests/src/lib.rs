//! Helpers that the cross-crate tests share. The tests themselves are in `tests/tests/`.
