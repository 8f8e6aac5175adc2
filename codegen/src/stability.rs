//! Stability of the adaptation, decided when compiling.
